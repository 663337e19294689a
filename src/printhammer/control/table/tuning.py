"""Tune a compensation table for a hammer: every dot like a dot from rest, whatever was printed before it."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, Final, SupportsIndex

import numpy as np

from printhammer.control.table.draft import Draft, blank
from printhammer.control.table.drive import LARGEST_CURRENT, clearance, print_pulse
from printhammer.control.table.drivers import driven_by
from printhammer.control.table.histories import checked_size, histories, number_of
from printhammer.control.table.newton import ROUNDS
from printhammer.control.table.polish import polish
from printhammer.control.table.refine import refined
from printhammer.control.table.search import SPACING, chosen, spaced
from printhammer.control.table.task import Single, Task, single_of
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.printing.dots.limits import Limits
from printhammer.printing.rates.perturbation import Perturbation, perturbed
from printhammer.run.ensemble import DISPLAY_TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.control.table.compensation import CompensationTable
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.rates.variability import Variability
    from printhammer.support.arrays import FloatArray

FIRST: Final = 100.0  # Lowest rate of a table over all rates, Hz: every dot is printed from rest
STEP: Final = 5.0  # Step between the rates of such a table, Hz
SPREAD: Final = (
    *(Perturbation(current=share) for share in (0.03, -0.03)),
    *(Perturbation(travel=way) for way in (10e-6, -10e-6)),
)
"""By how much the hammers differ on which ways to fire a dot are compared, and a robust table is tuned."""

# Deviation, in parts of the limits, up to which a rate belongs to a table over all rates
_USABLE: Final = 0.9
_POOR: Final = 0.5  # Deviation, in parts of the limits, above which a given rate is tuned once more
# How far from the times between dots ways are then looked for as well, s
_AROUND: Final = 1e-6 * np.arange(-60.0, 61.0, 15.0)


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
    driver: str = "own",
    variability: Variability | None = None,
    largest_current: float | str = LARGEST_CURRENT,
    tolerance: float = DISPLAY_TOLERANCE,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> CompensationTable:
    """Tune a compensation table: pulse width and advance as a function of the last gaps between dots.

    A dot made like a dot from rest leaves the hammer as every such dot does. So its pulse is a function of
    the time since the dot before, as long as that one was made right; longer histories put right what is
    left. For each history, width and advance are found by Newton's method so that force and arrival of the
    last dot of patterns with that history are those of the single pulse. Mostly there is more than one way
    to do it: before a rebound or after it, with one or another brake pulse that takes some of the rebound
    away, or without. The one is taken in which a row of such dots stays nearest to the single pulse on
    hammers with 3 % more and less current and 10 um more and less travel, counting what this hammer itself
    does eight times. No dot is fired before the armature has left the pack of the one before.

    Parameters
    ----------
    hammer : Hammer
        A hammer with a pack, a backstop and a waveform that has a width: a current, or a driver of the coil,
        of which the widths are then times on the rail.
    rate, rates : float or str, or sequence of them, optional
        Slots per second, Hz, or text with a unit; by default rates from 100 Hz, at which every dot is printed
        from rest, to the highest one at which the table keeps to the limits, `STEP` apart, and closer where
        the way to fire a dot changes.
    history : int, optional
        Number of gaps that a history holds, 1 to 4.
    reach : int, optional
        Longest gap that counts, slots.
    limits : Limits, optional
        By which deviations are measured.
    brake : bool, optional
        Whether brake pulses may be used.
    robust : bool, optional
        Tune width and advance on the hammers that differ as well, for the least mean square of all, instead
        of on this hammer alone.
    driver : str, optional
        What switches the coil, of `DRIVERS` in `printhammer.control.table.drivers`: "own", the pulse of the
        hammer or the driver of its coil, "switch", a fast unipolar switch, or "bridge", an H-bridge. With
        these two, which replace a current, the dot from rest is as hard as with the own pulse, and is fired
        so much later that it arrives as it does.
    variability : Variability, optional
        How the constants of a production are spread. The way is then taken in which a row of dots is least
        off in the mean square, over this hammer and the sigma points of the variability.
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
    driven = driven_by(hammer, driver, largest)
    pulse, widest = print_pulse(driven, largest)
    single = single_of(driven, pulse, tolerance)
    if rate is not None and rates is not None:
        raise InputError("rate and rates are given, expected one of them")
    asked = [rate] if rate is not None else rates
    grid = _all_rates(single) if asked is None else _given_rates(asked)
    nodes = len(spaced(_periods(grid, far, single), SPACING))
    # Once a time at which ways are looked for, once a step of Newton's method, with and without long rows.
    steps = nodes + 3 + 2 * (ROUNDS + 1) * gaps
    if variability is not None:
        spread = others = variability.sigma_points(driven)
    else:
        spread, others = _spread(driven), [perturbed(driven, by) for by in SPREAD] if robust else []
    task = Task(
        gaps=gaps,
        reach=far,
        hammers=[driven, *(others if robust else [])],
        spread=spread,
        pulse=pulse,
        largest=largest,
        widest=widest,
        wait=clearance(driven, pulse, widest, largest),
        single=single,
        limits=bounds,
        brake=brake,
        tolerance=tolerance,
        threads=threads,
        report=_counter(progress, steps),
        mean_square=variability is not None,
    )
    draft = _tuned(task, grid, open_ended=asked is None)
    if asked is None:
        return refined(draft.rows(np.arange(_usable(draft)))).table().fired_by(driver, hammer)
    _tune_again(draft)
    lost = np.flatnonzero(~np.isfinite(draft.worst))
    if lost.size:
        speed = float(grid[lost[0]])
        raise InputError(
            f"rate = {speed:g} Hz: no pulse prints every dot when others come {1e3 / speed:.4g} ms before,"
            " expected a lower rate"
        )
    return draft.table().fired_by(driver, hammer)


def _spread(hammer: Hammer) -> list[Hammer]:
    """Return the hammers that differ a little, as far as the laws of the hammer let them."""
    hammers = []
    for by in SPREAD:
        with suppress(InputError):
            hammers.append(perturbed(hammer, by))
    return hammers


def _counter(progress: Callable[[int, int], None] | None, total: int) -> Callable[[], None]:
    """Return a function that reports one more step of the work each time that it is called."""
    steps = iter(range(1, total + 1))

    def count() -> None:
        step = next(steps, total)
        if progress is not None:
            progress(step, total)

    return count


def _all_rates(single: Single) -> FloatArray:
    """Return rates from that at which all is rest to one at which the armature is not back from the pack."""
    lowest = STEP * np.floor(1.0 / (single.settled * STEP))
    return np.array([FIRST, *np.arange(lowest, 1.0 / single.left, STEP).tolist()])


def _given_rates(asked: Sequence[float | str]) -> FloatArray:
    if isinstance(asked, str) or len(asked) == 0:
        raise InputError(f"rates = {asked!r}, expected a list of rates, at least one")
    rates = np.array([read_positive(rate, "Hz", "rate") for rate in asked])
    if (np.diff(rates) <= 0.0).any():
        raise InputError(f"rates = {list(asked)!r}, expected ascending rates")
    return rates


def _tune_again(draft: Draft) -> None:
    """Tune rates once more that are not good enough, with ways from times around theirs; changes the rows."""
    poor = np.flatnonzero(~(draft.worst <= _POOR))
    if not poor.size:
        return
    again = _tuned(draft.task, draft.rates[poor], around=_AROUND)
    better = again.worst < draft.worst[poor]
    draft.values[:, poor[better]] = again.values[:, better]


def _tuned(
    task: Task, rates: FloatArray, *, open_ended: bool = False, around: FloatArray | None = None
) -> Draft:
    """Return tuned rows; the deviation of an entry for which no dot is found is infinite.

    An `open_ended` table ends below the first rate at which no pulse comes near. `around` is how far from the
    times between dots ways are looked for as well, s.
    """
    draft = blank(task, rates)
    draft.timing[1] = task.width
    every = np.arange(1, task.reach + 1) / rates[:, np.newaxis]
    periods = _periods(rates, task.reach, task.single)
    if around is not None:
        others = (periods[:, np.newaxis] + around).ravel()
        longest, shortest = task.single.settled, periods.min(initial=np.inf) + around.min()
        periods = np.unique([*periods, *others[(others <= longest) & (others > max(shortest, 0.0))]])
    there, ways = chosen(task, periods)
    settings = ways.settings
    for gap in range(1, task.reach + 1):
        columns = [number_of(each, task.reach) for each in histories(task.gaps, task.reach) if each[0] == gap]
        for row, period in enumerate(every[:, gap - 1].tolist()):
            if period > task.single.settled:
                continue
            place = int(np.searchsorted(there, period))
            if place == there.size or there[place] != period:
                draft.deviation[row, columns] = np.inf
            else:
                draft.values[:4, row, columns] = settings[:, [place]]
    complete = np.flatnonzero(np.isfinite(draft.worst))
    if open_ended:
        complete = complete[complete == np.arange(complete.size)]
    if complete.size:
        good = draft.rows(complete)
        polish(good)
        draft.values[:, complete] = good.values
    return draft


def _periods(rates: FloatArray, reach: int, single: Single) -> FloatArray:
    """Return all times between dots, s, within which the hammer does not come to rest, ascending."""
    every = np.arange(1, reach + 1) / rates[:, np.newaxis]
    return np.unique(every[every <= single.settled])


def _usable(draft: Draft) -> int:
    """Return the number of rates that keep well to the limits, from the lowest on."""
    bad = np.flatnonzero(~(draft.worst <= _USABLE))
    if bad.size and bad[0] == 0:
        raise InputError("the table does not keep to the limits at any rate, expected a hammer that prints")
    return int(bad[0]) if bad.size else draft.rates.size
