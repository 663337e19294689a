"""Tune a compensation table for a hammer: every dot like a dot from rest, whatever was printed before it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, SupportsIndex

import numpy as np

from printhammer.control.histories import REST, checked_size, entries_of, histories, number_of, shared_numbers
from printhammer.control.table import COLUMNS, CompensationTable
from printhammer.control.table_brake import Brake, best_brake
from printhammer.control.table_drive import LARGEST_CURRENT, print_pulse
from printhammer.control.table_maps import guess, plane
from printhammer.control.table_polish import (
    ROUNDS,
    VALUES,
    Work,
    joined,
    level_of,
    look_at,
    polish,
    polish_level,
    subset,
)
from printhammer.control.table_single import Single, single_of
from printhammer.drive_input import read_count, read_positive
from printhammer.ensemble import DISPLAY_TOLERANCE
from printhammer.errors import InputError
from printhammer.printing.limits import Limits
from printhammer.printing.perturbation import Perturbation, perturbed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from printhammer.hammer import Hammer
    from printhammer.segments import FloatArray

FIRST: Final = 100.0
"""Lowest rate of a table over all rates, Hz: every dot is printed from rest."""

STEP: Final = 0.015
"""Step between the rates of such a table, in parts of the period."""

SPREAD: Final = (
    Perturbation(current=0.03),
    Perturbation(current=-0.03),
    Perturbation(travel=10e-6),
    Perturbation(travel=-10e-6),
)
"""By how much the hammers differ that a robust table is tuned on, beside the hammer itself."""

_FREE: Final = 0.2
_USABLE: Final = 0.9
_BETWEEN: Final = 0.2
_REFINEMENTS: Final = 4


def tune(
    hammer: Hammer,
    *,
    rate: float | str | None = None,
    rates: Sequence[float | str] | None = None,
    history: SupportsIndex = 2,
    reach: SupportsIndex = 2,
    limits: Limits | None = None,
    brake: bool = True,
    robust: bool = False,
    largest_current: float | str = LARGEST_CURRENT,
    tolerance: float = DISPLAY_TOLERANCE,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> CompensationTable:
    """Tune a compensation table: pulse width and advance as a function of the last gaps between dots.

    A dot made like a dot from rest leaves the hammer as every such dot does. So its pulse is a function of
    the time since the dot before, as long as that one was made right; longer histories put right what is
    left. For each history, width and advance are found by Newton's method so that force and arrival of the
    last dot of patterns with that history are those of the single pulse. Where no pulse does it, because the
    armature falls back from a rebound when it should be fired, a brake pulse, one for the whole table, takes
    some of the rebound away.

    Parameters
    ----------
    hammer : Hammer
        A hammer with a pack, a backstop and a current waveform that has a width.
    rate, rates : float or str, or sequence of them, optional
        Slots per second, Hz, or text with a unit; by default rates from 100 Hz, at which every dot is printed
        from rest, to the highest one at which the table keeps to the limits.
    history : int, optional
        Number of gaps that a history holds, 1 to 4.
    reach : int, optional
        Longest gap that counts, slots.
    limits : Limits, optional
        By which deviations are measured.
    brake : bool, optional
        Whether brake pulses may be used.
    robust : bool, optional
        Tune on hammers with 3 % more and less current and 10 um more and less travel as well, for the least
        mean square of all, instead of on this hammer alone.
    largest_current : float or str, optional
        Bound on the current, A, or text with a unit.
    tolerance : float, optional
        As for `printhammer.simulate`; by default that for pictures.
    threads : int, optional
        By default as many as there are cores; the table does not depend on it.
    progress : callable, optional
        Called now and then with the number of steps done and of all, at most.

    Returns
    -------
    CompensationTable
        With the worst deviation of each entry; it is not promised to be within the limits.

    Raises
    ------
    InputError
        An argument is not what is described above; a hammer that does not print or does not settle; a rate at
        which no pulse prints a dot one slot after another.
    """
    gaps, far = checked_size(read_count(history, "history"), read_count(reach, "reach"))
    bounds = Limits() if limits is None else limits
    largest = read_positive(largest_current, "A", "largest_current")
    pulse, widest = print_pulse(hammer, largest)
    single = single_of(hammer, pulse, tolerance)
    if rate is not None and rates is not None:
        raise InputError("rate and rates are given, expected one of them")
    asked = [rate] if rate is not None else rates
    grid = _all_rates(single) if asked is None else _given_rates(asked)
    hammers = [hammer, *([perturbed(hammer, by) for by in SPREAD] if robust else [])]
    steps = _Steps(progress, 2 + ROUNDS * (gaps + 1))
    shape = 0, entries_of(gaps, far)
    blank = Work(
        rates=grid[:0],
        gaps=gaps,
        reach=far,
        **{name: np.zeros(shape) for name in VALUES},
        hammers=hammers,
        pulse=pulse,
        widest=widest,
        single=single,
        limits=bounds,
        tolerance=tolerance,
        threads=threads,
    )
    tuner = _Tuner(blank, brake, steps)
    work = tuner.rows(grid)
    if asked is None:
        work = _refined(tuner, work, hammer, largest)
    else:
        _refuse_lost(work)
    return _table(work, hammer, largest)


class _Steps:
    """Tell how far the work is."""

    def __init__(self, progress: Callable[[int, int], None] | None, total: int) -> None:
        self._progress, self._total, self._done = progress, total, 0

    def __call__(self) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(min(self._done, self._total), self._total)


def _all_rates(single: Single) -> FloatArray:
    """Return rates from that at which all is rest to one that no hammer keeps to, evenly in log period."""
    longest = single.settled + single.nominal.flight_time
    count = int(np.log(longest / single.left) / np.log1p(STEP))
    return np.array([FIRST, *(1.0 / (longest * (1.0 + STEP) ** -np.arange(count))).tolist()])


def _given_rates(asked: Sequence[float | str]) -> FloatArray:
    if isinstance(asked, str) or len(asked) == 0:
        raise InputError(f"rates = {asked!r}, expected a list of rates, at least one")
    found = np.array([read_positive(rate, "Hz", "rate") for rate in asked])
    if (np.diff(found) <= 0.0).any():
        raise InputError(f"rates = {list(asked)!r}, expected ascending rates")
    return found


class _Tuner:
    """Tunes rows of a table.

    Parameters
    ----------
    blank : Work
        What is asked, without rows.
    brake : bool
        Whether brake pulses may be used.
    steps : callable
        Called after each step of the work.
    """

    def __init__(self, blank: Work, brake: bool, steps: Callable[[], None]) -> None:
        self._blank, self._may_brake, self._steps = blank, brake, steps
        self._brakes: list[Brake | None] = []

    def rows(self, rates: FloatArray) -> Work:
        """Return tuned rows; the deviation of an entry for which no dot is found is infinite."""
        blank = self._blank
        own: Any = blank.pulse
        shape = rates.size, entries_of(blank.gaps, blank.reach)
        blanks: dict[str, Any] = {name: np.zeros(shape) for name in VALUES}
        work = replace(blank, rates=rates, **blanks)
        work.width[:] = own.width
        self._begin(work, None)
        wrong = np.flatnonzero(~(work.deviation.max(axis=1) <= _FREE))
        if wrong.size and (brake := self._brake()) is not None:
            self._with_brakes(work, wrong, brake)
        found = np.isfinite(work.deviation.max(axis=1))
        good = subset(work, np.flatnonzero(found))
        polish(good, self._steps)
        for name in VALUES:
            getattr(work, name)[found] = getattr(good, name)
        return work

    def _brake(self) -> Brake | None:
        """Return the one brake pulse of the table, looked for when it is first needed."""
        blank = self._blank
        if not self._brakes:
            options: dict[str, Any] = {"tolerance": blank.tolerance, "threads": blank.threads}
            self._brakes.append(
                best_brake(blank.hammers, blank.pulse, blank.widest, blank.single, **options)
                if self._may_brake
                else None
            )
        return self._brakes[0]

    def _begin(self, work: Work, brake: Brake | None) -> None:
        """Find entries that depend on the last gap only, all of them with a brake pulse or all without."""
        periods = np.unique(np.outer(1.0 / work.rates, np.arange(1, work.reach + 1)).ravel())
        periods = periods[periods <= work.single.settled]
        if not periods.size:
            return
        planes = [plane(work, hammer, brake, periods) for hammer in work.hammers]
        for history in histories(work.gaps, work.reach):
            column = number_of(history, work.reach)
            for row, rate in enumerate(work.rates.tolist()):
                period = history[0] / rate
                if not 0.0 < period <= work.single.settled:
                    continue
                cell = guess(planes, period, work.limits)
                if cell is None:
                    continue
                work.advance[row, column] = period - cell.fired
                work.width[row, column] = cell.width
                if cell.brake is not None:
                    work.brake_delay[row, column] = cell.brake.delay
                    work.brake_width[row, column] = cell.brake.width
        polish_level(work, level_of(work, 1), self._steps)
        look_at(work, level_of(work, 1))

    def _with_brakes(self, work: Work, rows: npt.NDArray[np.int64], brake: Brake) -> None:
        """Put brake pulses into the gaps where dots are nearer to the limits with than without."""
        other = subset(work, rows)
        self._begin(other, brake)
        for gap in range(1, work.reach + 1):
            first = number_of((gap, *[REST] * (work.gaps - 1)), work.reach)
            before = work.deviation[rows, first]
            better = (before > _FREE) & (other.deviation[:, first] < before)
            for history in histories(work.gaps, work.reach):
                column = number_of(history, work.reach)
                for name in VALUES if history[0] == gap else ():
                    getattr(work, name)[rows[better], column] = getattr(other, name)[better, first]


def _refined(tuner: _Tuner, work: Work, hammer: Hammer, largest: float) -> Work:
    """Add rates where the table is off between two, and near the highest; leave out those above it."""
    for _ in range(_REFINEMENTS):
        kept = _kept(work)
        table = _table(subset(work, np.arange(kept)), hammer, largest)
        between = np.sqrt(table.rates[:-1] * table.rates[1:])
        told = [table.at(rate) for rate in between.tolist()]
        tried = subset(work, np.zeros(between.size, np.int64))
        tried.rates = between
        for name in COLUMNS:
            setattr(tried, name, np.array([getattr(one, name) for one in told]))
        for known in range(1, work.gaps + 1):
            look_at(tried, level_of(tried, known))
        more = between[~(tried.deviation.max(axis=1) <= _BETWEEN)].tolist()
        if kept < work.rates.size:
            more.append(float(np.sqrt(work.rates[kept - 1] * work.rates[kept])))
        if not more:
            break
        added = tuner.rows(np.array(more))
        work = joined(work, added)
    return subset(work, np.arange(_kept(work)))


def _table(work: Work, hammer: Hammer, largest: float) -> CompensationTable:
    shared = shared_numbers(work.gaps, work.reach)
    return CompensationTable(
        hammer=hammer.name,
        fingerprint=hammer.fingerprint,
        rates=work.rates,
        gaps=work.gaps,
        reach=work.reach,
        **{name: getattr(work, name)[:, shared] for name in VALUES},
        largest_current=largest,
    )


def _refuse_lost(work: Work) -> None:
    """Refuse rates at which no dot can follow another one."""
    lost = np.flatnonzero(~np.isfinite(work.deviation.max(axis=1)))
    if lost.size:
        rate = float(work.rates[lost[0]])
        raise InputError(
            f"rate = {rate:g} Hz: no pulse prints every dot when others come {1e3 / rate:.4g} ms before,"
            " expected a lower rate"
        )


def _kept(work: Work) -> int:
    """Return how many rates keep well to the limits, from the lowest on."""
    bad = np.flatnonzero(~(work.deviation.max(axis=1) <= _USABLE))
    if bad.size and bad[0] == 0:
        raise InputError("the table does not keep to the limits at any rate, expected a hammer that prints")
    return int(bad[0]) if bad.size else work.rates.size
