"""Tune a compensation table for a hammer: every dot like a dot from rest, whatever was printed before it.

Rates between the rates of a table: where the table is no good there, more rates are put in between.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final, SupportsIndex, Unpack

import numpy as np

from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.draft import Draft, blank, polish
from printhammer.control.table.drive import (
    LARGEST_CURRENT,
    REST,
    checked_size,
    clearance,
    driven_by,
    histories,
    number_of,
    print_pulse,
)
from printhammer.control.table.search import BAD, SPACING, chosen, searched, spaced
from printhammer.control.table.task import Single, Task, single_of
from printhammer.control.table.ways import ROUNDS, costs, solved, ways_of
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Limits
from printhammer.printing.rates.variability import Perturbation, Variability, perturbed
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.support.arrays import FloatArray, IntArray

HALVINGS: Final = 3  # How often the step between two rates is halved at most
# Deviation between two rates, in parts of the limits, from which on there is one more between them
BETWEEN: Final = 0.5


def refined(draft: Draft) -> Draft:
    """Put rates between those of a table where it is not good enough halfway between two of them.

    Such places are where the way to fire a dot changes. The new entries follow that of the rate below or that
    of the rate above, whichever is the better one; where neither is good, another one is looked for.
    """
    # Rates at which every dot is printed from rest need nothing.
    lower = np.flatnonzero(1.0 / draft.rates[1:] <= draft.task.single.settled)
    wanted = set(draft.rates[lower].tolist())
    for _ in range(HALVINGS):
        lower = np.flatnonzero(np.isin(draft.rates, list(wanted)))
        lower = lower[lower < draft.rates.size - 1]
        if not lower.size:
            break
        halfway = _halfway(draft, lower)
        draft.task.report()
        lower = lower[~(halfway.worst <= BETWEEN)]
        if not lower.size:
            break
        more = _tuned_between(draft, lower)
        wanted = {*draft.rates[lower].tolist(), *more.rates.tolist()}
        rates = np.concatenate([draft.rates, more.rates])
        order = np.argsort(rates, kind="stable")
        values = np.concatenate([draft.values, more.values], axis=1)
        draft = Draft(draft.task, rates[order], values[:, order])
    return draft


def _halfway(draft: Draft, lower: IntArray) -> Draft:
    """Return what the table says halfway between some rates and those above them, and how good that is."""
    table = draft.table()
    rates = 0.5 * (draft.rates[lower] + draft.rates[lower + 1])
    settings = np.array([table.at(float(rate)) for rate in rates])
    values = np.concatenate([settings, np.zeros_like(settings[:, :1])], axis=1).transpose(1, 0, 2)
    halfway = Draft(draft.task, rates, values)
    halfway.judge()
    return halfway


def _tuned_between(draft: Draft, lower: IntArray) -> Draft:
    """Return tuned rows halfway between some rates and those above them."""
    task = draft.task
    rates = 0.5 * (draft.rates[lower] + draft.rates[lower + 1])
    halfway = Draft(task, rates, draft.values[:, lower])
    for gap in range(1, task.reach + 1):
        periods = gap / rates
        near = np.flatnonzero(periods <= task.single.settled)
        if not near.size:
            continue
        column = number_of((gap, *[REST] * (task.gaps - 1)), task.reach)
        cells = []
        for row in near.tolist():
            for side in (lower[row], lower[row] + 1):
                advance, width, delay, brake = draft.values[:4, side, column].tolist()
                cells.append((float(periods[row]), delay, brake, float(periods[row]) - advance, width))
        ways = solved(task, ways_of(cells))
        cost = costs(task, ways).reshape(-1, 2)
        for place, row in enumerate(near.tolist()):
            best = ways.take([2 * place + int(cost[place].argmin())])
            if not cost[place].min() <= BAD:
                # Neither goes on from its rate to here; perhaps there is one more.
                more = searched(task, float(periods[row]))
                if more.size and more.cost.min() < cost[place].min():
                    best = more.take([int(more.cost.argmin())])
            halfway.values[:4, row, column] = best.settings[:, 0]
    polish(halfway)
    return halfway


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


@computation
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
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> CompensationTable:
    """Tune a compensation table: pulse width and advance as a function of the last gaps between dots.

    A dot made like a dot from rest leaves the hammer as every such dot does. So its pulse is a function of
    the time since the dot before, as long as that one was made right; longer histories put right what is
    left. For each history, width and advance are found by Newton's method so that force and arrival of the
    last dot of patterns with that history are those of the single pulse. Mostly there is more than one way to
    do it: before a rebound or after it, with one or another brake pulse that takes some of the rebound away,
    or without. The one is taken in which a row of such dots stays nearest to the single pulse on hammers with
    3 % more and less current and 10 um more and less travel, counting what this hammer itself does eight
    times. Only ways count in which a small error in a long row shrinks from dot to dot. No dot is fired
    before the armature has left the pack of the one before.

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
        What switches the coil, of `DRIVERS` in `printhammer.control.table.drive`: "own", the pulse of the
        hammer or the driver of its coil, "switch", a fast unipolar switch, or "bridge", an H-bridge. With
        these two, which replace a current, the dot from rest is as hard as with the own pulse, and is fired
        so much later that it arrives as it does.
    variability : Variability, optional
        How the constants of a production are spread. The way is then taken in which a row of dots is least
        off in the mean square, over this hammer and the sigma points of the variability.
    largest_current : float or str, optional
        Bound on the current, A, or text with a unit.

    Returns
    -------
    CompensationTable
        With the worst deviation of each entry; it is not promised to be within the limits.
    """
    gaps, far = checked_size(read_count(history, "history"), read_count(reach, "reach"))
    bounds = Limits() if limits is None else limits
    largest = read_positive(largest_current, "A", "largest_current")
    driven = driven_by(hammer, driver, largest)
    pulse, widest = print_pulse(driven, largest)
    single = single_of(driven, pulse, effort.tolerance)
    if rate is not None and rates is not None:
        raise InputError("rate and rates are given", key="rates", expected="one of them")
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
        effort=effort.quiet,
        report=_counter(effort, steps),
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
            (f"rate = {speed:g} Hz: no pulse prints every dot of rows {1e3 / speed:.4g} ms apart"),
            key="rate",
            value=speed,
            expected="a lower rate",
        )
    return draft.table().fired_by(driver, hammer)


def _spread(hammer: Hammer) -> list[Hammer]:
    """Return the hammers that differ a little, as far as the laws of the hammer let them."""
    hammers = []
    for by in SPREAD:
        with suppress(InputError):
            hammers.append(perturbed(hammer, by))
    return hammers


def _counter(effort: Effort, total: int) -> Callable[[], None]:
    """Return a function that reports one more step of the work each time that it is called."""
    steps = iter(range(1, total + 1))

    def count() -> None:
        step = next(steps, total)
        effort.report(step, total)

    return count


def _all_rates(single: Single) -> FloatArray:
    """Return rates from that at which all is rest to one at which the armature is not back from the pack."""
    lowest = STEP * np.floor(1.0 / (single.settled * STEP))
    return np.array([FIRST, *np.arange(lowest, 1.0 / single.left, STEP).tolist()])


def _given_rates(asked: Sequence[float | str]) -> FloatArray:
    if isinstance(asked, str) or len(asked) == 0:
        raise InputError.of("rates", asked, "a list of rates, at least one")
    rates = np.array([read_positive(rate, "Hz", "rate") for rate in asked])
    if (np.diff(rates) <= 0.0).any():
        raise InputError.of("rates", list(asked), "ascending rates")
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
        raise InputError(
            "the table does not keep to the limits at any rate", key="rates", expected="a hammer that prints"
        )
    return int(bad[0]) if bad.size else draft.rates.size
