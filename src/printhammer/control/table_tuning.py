"""Tune a compensation table for a hammer: every dot like a dot from rest, whatever was printed before it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, SupportsIndex

import numpy as np

from printhammer.control.histories import checked_size, entries_of, histories, number_of, shared_numbers
from printhammer.control.table import CompensationTable
from printhammer.control.table_brake import BRAKES, Braked, brakes
from printhammer.control.table_drive import LARGEST_CURRENT, print_pulse
from printhammer.control.table_maps import GUESSES, Guess, guesses, plane
from printhammer.control.table_polish import (
    ROUNDS,
    VALUES,
    Work,
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

    from printhammer.hammer import Hammer
    from printhammer.segments import FloatArray

FIRST: Final = 100.0
"""Lowest rate of a table over all rates, Hz: every dot is printed from rest."""

STEP: Final = 5.0
"""Step between the rates of such a table, Hz."""

SPREAD: Final = (
    Perturbation(current=0.03),
    Perturbation(current=-0.03),
    Perturbation(travel=10e-6),
    Perturbation(travel=-10e-6),
)
"""By how much the hammers differ that a robust table is tuned on, beside the hammer itself."""

_FREE: Final = 0.2
_FINE: Final = 0.1
_HOPELESS: Final = 2.0
_USABLE: Final = 0.9


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
    work = _tuned(blank, grid, brake, steps, open_ended=asked is None)
    lost = np.flatnonzero(~np.isfinite(work.deviation.max(axis=1)))
    if asked is None:
        work = subset(work, np.arange(_kept(work)))
    elif lost.size:
        speed = float(grid[lost[0]])
        raise InputError(
            f"rate = {speed:g} Hz: no pulse prints every dot when others come {1e3 / speed:.4g} ms before,"
            " expected a lower rate"
        )
    shared = shared_numbers(gaps, far)
    values: dict[str, Any] = {name: getattr(work, name)[:, shared] for name in VALUES}
    return CompensationTable(
        hammer=hammer.name,
        fingerprint=hammer.fingerprint,
        rates=work.rates,
        gaps=gaps,
        reach=far,
        largest_current=largest,
        **values,
    )


class _Steps:
    """Tell how far the work is."""

    def __init__(self, progress: Callable[[int, int], None] | None, total: int) -> None:
        self._progress, self._total, self._done = progress, total, 0

    def __call__(self) -> None:
        self._done += 1
        if self._progress is not None:
            self._progress(min(self._done, self._total), self._total)


def _all_rates(single: Single) -> FloatArray:
    """Return rates from that at which all is rest to one at which the armature is not back from the pack."""
    lowest = STEP * np.floor(1.0 / (single.settled * STEP))
    return np.array([FIRST, *np.arange(lowest, 1.0 / single.left, STEP).tolist()])


def _given_rates(asked: Sequence[float | str]) -> FloatArray:
    if isinstance(asked, str) or len(asked) == 0:
        raise InputError(f"rates = {asked!r}, expected a list of rates, at least one")
    found = np.array([read_positive(rate, "Hz", "rate") for rate in asked])
    if (np.diff(found) <= 0.0).any():
        raise InputError(f"rates = {list(asked)!r}, expected ascending rates")
    return found


def _tuned(
    blank: Work, rates: FloatArray, brake: bool, steps: Callable[[], None], *, open_ended: bool
) -> Work:
    """Return tuned rows; the deviation of an entry for which no dot is found is infinite.

    Parameters
    ----------
    blank : Work
        What is asked, without rows.
    rates : array
        Of the rows, Hz.
    brake : bool
        Whether brake pulses may be used.
    steps : callable
        Called after each step of the work.
    open_ended : bool
        Whether rates at which nothing comes near are left out.
    """
    own: Any = blank.pulse
    shape = rates.size, entries_of(blank.gaps, blank.reach)
    blanks: dict[str, Any] = {name: np.zeros(shape) for name in VALUES}
    work = replace(blank, rates=rates, **blanks)
    work.width[:] = own.width
    for gap, numbers in _columns(work).items():
        near = np.flatnonzero(gap / rates <= blank.single.settled)
        for column in numbers:
            work.deviation[near, column] = np.inf
    starts = _starts(work)
    steps()
    if open_ended:
        # A table without given rates ends below the first at which no pulse comes near.
        close = [all(not cells or cells[0].off <= _HOPELESS for cells in row) for row in starts]
        ends = close.index(False) if False in close else len(close)
        work, starts = subset(work, np.arange(ends)), starts[:ends]
    for turn in range(GUESSES):
        _try(work, [[cells[turn] if turn < len(cells) else None for cells in row] for row in starts], steps)
    for turn in range(BRAKES if brake else 0):
        if turn == 0:
            pulses = _brakes(work)
        _try(work, [[cells[turn] if turn < len(cells) else None for cells in row] for row in pulses], steps)
    found = np.isfinite(work.deviation.max(axis=1))
    good = subset(work, np.flatnonzero(found))
    if found.any():
        polish(good, steps)
    for name in VALUES:
        getattr(work, name)[found] = getattr(good, name)
    return work


def _starts(work: Work) -> list[list[list[Guess]]]:
    """Return first guesses for each rate and gap from a plane of second dots; none for dots from rest.

    Where there should be one and is none, the guess is the hammer's own pulse, infinitely far off.
    """
    own: Any = work.pulse
    spans = [[gap / rate for gap in range(1, work.reach + 1)] for rate in work.rates.tolist()]
    periods = np.unique([period for row in spans for period in row if period <= work.single.settled])
    if not periods.size:
        return [[[] for _period in row] for row in spans]
    planes = [plane(work, hammer, periods) for hammer in work.hammers]
    return [
        [
            guesses(planes, period, work.limits) or [Guess(period, own.width, np.inf)]
            if period <= work.single.settled
            else []
            for period in row
        ]
        for row in spans
    ]


def _brakes(work: Work) -> list[list[list[Braked]]]:
    """Return brake pulses for each rate and gap at which dots are not good enough without."""
    found: list[list[list[Braked]]] = []
    for row, rate in enumerate(work.rates.tolist()):
        found.append([])
        for gap in range(1, work.reach + 1):
            wanted = not work.deviation[row, _columns(work)[gap][0]] <= _FREE
            found[-1].append(brakes(work, gap / rate) if wanted else [])
    return found


def _columns(work: Work) -> dict[int, list[int]]:
    """Return the numbers of the histories that begin with a gap; the first one is rest before that."""
    every = histories(work.gaps, work.reach)
    return {
        gap: [number_of(one, work.reach) for one in every if one[0] == gap]
        for gap in range(1, work.reach + 1)
    }


def _try(work: Work, cells: Sequence[Sequence[Guess | Braked | None]], steps: Callable[[], None]) -> None:
    """Polish some guesses, one for each rate and gap or none, and keep those that turn out better.

    Parameters
    ----------
    work : Work
        The table; changed in place.
    cells : sequence of sequence
        For each rate and gap.
    steps : callable
        Called after each step of the work.
    """
    columns = _columns(work)
    wanted = {
        (row, gap): cell
        for row, some in enumerate(cells)
        for gap, cell in enumerate(some, 1)
        if cell is not None and work.deviation[row, columns[gap][0]] > _FINE
    }
    if not wanted:
        return
    rows = np.unique([row for row, _gap in wanted])
    other = subset(work, rows)
    for place, row in enumerate(rows.tolist()):
        for gap, own in columns.items():
            cell = wanted.get((row, gap))
            if cell is None:
                continue
            other.advance[place, own] = gap / work.rates[row] - cell.fired
            other.width[place, own] = cell.width
            other.brake_delay[place, own] = cell.delay if isinstance(cell, Braked) else 0.0
            other.brake_width[place, own] = cell.brake if isinstance(cell, Braked) else 0.0
    level = level_of(work, 1)
    polish_level(other, level, steps)
    look_at(other, level)
    for own in columns.values():
        first = own[0]
        better = other.deviation[:, first] < work.deviation[rows, first]
        for column in own:
            for name in VALUES:
                getattr(work, name)[rows[better], column] = getattr(other, name)[better, first]


def _kept(work: Work) -> int:
    """Return how many rates keep well to the limits, from the lowest on."""
    bad = np.flatnonzero(~(work.deviation.max(axis=1) <= _USABLE))
    if bad.size and bad[0] == 0:
        raise InputError("the table does not keep to the limits at any rate, expected a hammer that prints")
    return int(bad[0]) if bad.size else work.rates.size
