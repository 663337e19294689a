"""Tuning of compensation tables: every dot equals a dot from rest, whatever dots precede it.

Where interpolation between two rates is poor, the grid of rates is refined.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Final, SupportsIndex, Unpack

import numpy as np

from printhammer.control.pulses import current_bound
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.draft import Draft, blank, polish
from printhammer.control.table.drive import (
    REST,
    checked_size,
    clearance,
    driven_by,
    histories,
    number_of,
    print_pulse,
)
from printhammer.control.table.multipliers import with_multipliers
from printhammer.control.table.search import SPACING, chosen, searched, spaced
from printhammer.control.table.task import Single, Task, search_scale, single_of
from printhammer.control.table.ways import BAD, ROUNDS, costs, solved, ways_of
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Limits
from printhammer.printing.rates.variability import Perturbation, Variability, perturbed
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.support.arrays import FloatArray, IntArray

HALVINGS: Final = 3  # Maximum number of bisections of the step between two rates; arbitrary
# Deviation halfway between two rates, as a fraction of the limits, above which a rate is inserted; arbitrary
BETWEEN: Final = 0.5


def refined(draft: Draft) -> Draft:
    """Insert rates into a draft table where interpolation halfway between neighbouring rates is poor.

    Interpolation is poor where the solution branch changes. A new entry follows the branch of the rate below
    or above, whichever costs less; if both are poor, a new search is run.
    """
    # Below the first of these rates every dot is printed from rest.
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
    """Interpolate and evaluate a draft table halfway between rates `lower` (indices) and the next rates."""
    table = draft.table()
    rates = 0.5 * (draft.rates[lower] + draft.rates[lower + 1])
    settings = np.array([table.at(float(rate)) for rate in rates])
    values = np.concatenate([settings, np.zeros_like(settings[:, :1])], axis=1).transpose(1, 0, 2)
    halfway = Draft(draft.task, rates, values)
    halfway.judge()
    return halfway


def _tuned_between(draft: Draft, lower: IntArray) -> Draft:
    """Tune table rows halfway between the rates with indices `lower` and the next rates."""
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
                # Neither branch continues to the rate halfway; a new branch may exist.
                more = searched(task, float(periods[row]))
                if more.size and more.cost.min() < cost[place].min():
                    best = more.take([int(more.cost.argmin())])
            halfway.values[:4, row, column] = best.settings[:, 0]
    polish(halfway)
    return halfway


FIRST: Final = 100.0  # Lowest rate of an automatic grid, Hz: every dot is printed from rest; arbitrary
STEP: Final = 5.0  # Step of an automatic grid of rates, Hz; arbitrary
SPREAD: Final = (
    *(Perturbation(current=share) for share in (0.03, -0.03)),
    *(Perturbation(travel=way) for way in (10e-6, -10e-6)),
)
"""Perturbations of the hammers on which candidates are compared, and on which a robust table is tuned."""

# Deviation, as a fraction of the limits, up to which a rate is kept in an automatic grid; arbitrary
_USABLE: Final = 0.9
_GAP: Final = 6
"""Largest number of successive unusable rates that are tuned again; arbitrary, as the tuning of a rate takes
seconds."""
_TRIES: Final = 4
"""Maximum number of times to search a rate again, without the candidates that failed; arbitrary."""
_POOR: Final = 0.5
"""Deviation, as a fraction of the limits, above which a requested rate is tuned again; arbitrary."""
# Offsets of additional periods at which candidates are then searched, s; arbitrary
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
    largest_current: float | str | None = None,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> CompensationTable:
    """Tune a compensation table: pulse width and advance as a function of the last gaps between dots.

    If a dot equals a dot from rest, the hammer is left in the same state as after a dot from rest. The pulse
    of the next dot then depends only on the time since that dot; longer histories correct the remaining
    error. For each history, advance and width are found by a damped Gauss-Newton (Levenberg-Marquardt)
    iteration so that force and arrival of the last dot of patterns with that history equal force and arrival
    of the single pulse. There are usually several solutions: before or after a rebound, with or without a
    brake pulse that removes some of the rebound. `printhammer.control.table.search` enumerates them and keeps
    the solution whose row of dots stays nearest to the single pulse on hammers with 3 % more or less current,
    or 10 um more or less travel; the deviation on `hammer` has a weight of eight. Solutions are admitted only
    if a small deviation decays from dot to dot in a long row. No dot is fired before the armature has left
    the pack after the preceding dot.

    Parameters
    ----------
    hammer : Hammer
        A hammer with a pack, a backstop and a waveform that has a width: a current, or a driver of the coil,
        for which widths are times on the rail.
    rate, rates : float or str, or sequence of them, optional
        Slot rates [Hz] or text with a unit. By default an automatic grid from 100 Hz, where every dot is
        printed from rest, to the highest rate at which the table is within the limits, in steps of `STEP`,
        refined where the solution branch changes; both ends are lower for a slow device.
    history : int, optional
        Number of gaps in a history, 1 to 4.
    reach : int, optional
        Longest gap that counts, slots.
    limits : Limits, optional
        Limits that normalise the deviations.
    brake : bool, optional
        Whether brake pulses may be used.
    robust : bool, optional
        Whether width and advance are fitted by least squares to the perturbed hammers too, instead of to
        `hammer` alone.
    driver : str, optional
        Driver of the coil, one of `DRIVERS` in `printhammer.control.table.drive`: "own", the driver
        of the hammer file; "switch", a fast unipolar switch; or "bridge", an H-bridge. A
        switch or bridge replaces a current; its dot from rest has the force of the hammer's own pulse,
        and is fired later, to arrive at the same time.
    variability : Variability, optional
        Variability of the constants from unit to unit. The cost of a candidate is then the RMS deviation of
        a row of dots over `hammer` and the sigma points of the variability.
    largest_current : float or str, optional
        Current limit, A, or text with a unit; by default 2 A or, if larger, the current that the widest
        pulse of the device reaches.

    Returns
    -------
    CompensationTable
        The table, with the largest deviation of each entry, which may exceed the limits.
    """
    gaps, far = checked_size(read_count(history, "history"), read_count(reach, "reach"))
    bounds = Limits() if limits is None else limits
    largest = current_bound(hammer, largest_current)
    driven = driven_by(hammer, driver, largest)
    pulse, widest = print_pulse(driven, largest)
    single = single_of(driven, pulse, effort.tolerance)
    if rate is not None and rates is not None:
        raise InputError("rate and rates", key="rates", expected="one of them")
    asked = [rate] if rate is not None else rates
    scale = search_scale(driven, pulse)
    grid = _all_rates(single, scale) if asked is None else _given_rates(asked)
    periods = _periods(grid, far, single)
    if not periods.size:
        raise InputError(
            f"{hammer.path}: the armature is at rest {1e3 * single.settled:.3g} ms after a pulse, so that"
            f" pulses at {grid[-1]:.4g} Hz do not interact and need no table",
            file=hammer.path,
            key="rate",
            value=float(grid[-1]),
            expected=f"a rate above {1.0 / single.settled:.4g} Hz",
        )
    nodes = len(spaced(periods, SPACING * scale))
    # One report per searched period, one per Newton step, with and without dense patterns.
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
    draft = _tune_rows(task, grid, open_ended=asked is None)
    if asked is None:
        _bridge(draft)
        table = refined(draft.rows(np.arange(_usable(draft)))).table()
        return with_multipliers(table, driven, effort=effort.quiet).fired_by(driver, hammer)
    _tune_again(draft, np.flatnonzero(~(draft.worst <= _POOR)))
    lost = np.flatnonzero(~np.isfinite(draft.worst))
    if lost.size:
        speed = float(grid[lost[0]])
        raise InputError(
            (f"rate = {speed:g} Hz: no pulse makes every dot of rows {1e3 / speed:.4g} ms apart"),
            key="rate",
            value=speed,
            expected="a lower rate",
        )
    return with_multipliers(draft.table(), driven, effort=effort.quiet).fired_by(driver, hammer)


def _spread(hammer: Hammer) -> list[Hammer]:
    """Return copies of a hammer with each of the perturbations `SPREAD` that its laws admit."""
    hammers = []
    for by in SPREAD:
        with suppress(InputError):
            hammers.append(perturbed(hammer, by))
    return hammers


def _counter(effort: Effort, total: int) -> Callable[[], None]:
    """Return a function that reports one more finished step of `total` at each call."""
    steps = iter(range(1, total + 1))

    def count() -> None:
        step = next(steps, total)
        effort.report(step, total)

    return count


def _all_rates(single: Single, scale: float) -> FloatArray:
    """Return the default rates [Hz] of a table, up to the rate at which pack contacts nearly overlap.

    `scale` is the time scale of the device relative to the paper's hammer.
    """
    first, step = FIRST / scale, STEP / scale
    lowest = step * np.floor(1.0 / (single.settled * step))
    rates = np.arange(lowest, 1.0 / single.left, step)
    return np.array([first, *rates[rates > first].tolist()])


def _given_rates(asked: Sequence[float | str]) -> FloatArray:
    if isinstance(asked, str) or len(asked) == 0:
        raise InputError.of("rates", asked, "a list of rates, at least one")
    rates = np.array([read_positive(rate, "Hz", "rate") for rate in asked])
    if (np.diff(rates) <= 0.0).any():
        raise InputError.of("rates", list(asked), "ascending rates")
    return rates


def _bridge(draft: Draft) -> None:
    """Retune short runs of unusable rates in place, lowest first, until a run remains unusable.

    A table ends below its first unusable rate, so a run of a few unusable rates would cost all higher rates.
    """
    while (bad := np.flatnonzero(~(draft.worst <= _USABLE))).size:
        first = bad[: _GAP + 1]
        gap = first[first - first[0] == np.arange(first.size)]
        if gap.size > _GAP:
            return
        _tune_again(draft, gap)
        if not draft.worst[gap[0]] <= _USABLE:
            return


def _tune_again(draft: Draft, poor: IntArray) -> None:
    """Retune the rates with the indices `poor`, in place, adding candidates from nearby periods."""
    if not poor.size:
        return
    task = draft.task
    for _ in range(_TRIES):
        again = _tune_rows(task, draft.rates[poor], around=_AROUND * task.scale)
        better = again.worst < draft.worst[poor]
        draft.values[:, poor[better]] = again.values[:, better]
        failed = ~np.isfinite(again.worst)
        if not failed.any():
            break
        barred = task.barred + _failed_brakes(again.rows(np.flatnonzero(failed)))
        poor, task = poor[failed], replace(task, barred=barred, located=True)


def _failed_brakes(draft: Draft) -> tuple[tuple[float, float, float], ...]:
    """Return period, delay and width [s] of the brake pulses of candidates whose rows of dots failed."""
    task, barred = draft.task, []
    for gap in range(1, task.reach + 1):
        columns = [number_of(each, task.reach) for each in histories(task.gaps, task.reach) if each[0] == gap]
        for row in np.flatnonzero(~np.isfinite(draft.deviation[:, columns]).all(axis=1)).tolist():
            delay, brake = draft.values[2:4, row, columns[0]].tolist()
            barred.append((gap / float(draft.rates[row]), delay, brake))
    return tuple(barred)


def _tune_rows(
    task: Task, rates: FloatArray, *, open_ended: bool = False, around: FloatArray | None = None
) -> Draft:
    """Tune a table row for each of the given rates; an entry without a solution has an infinite deviation.

    An `open_ended` draft ends below the first rate without a solution. `around` are offsets [s] from each
    period to additional periods at which candidates are searched.
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
    """Return all times of 1 to `reach` slots in which the hammer does not come to rest, s, ascending."""
    every = np.arange(1, reach + 1) / rates[:, np.newaxis]
    return np.unique(every[every <= single.settled])


def _usable(draft: Draft) -> int:
    """Return the number of consecutive rates, from the lowest, with all deviations well within the limits."""
    bad = np.flatnonzero(~(draft.worst <= _USABLE))
    if bad.size and bad[0] == 0:
        raise InputError(
            "the table does not keep to the limits at any rate",
            key="rates",
            expected="lower rates",
        )
    return int(bad[0]) if bad.size else draft.rates.size
