"""The last dot of many patterns, and how its pulse is to change: Newton's method on force and arrival."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.compensation import COLUMNS, Settings
from printhammer.control.table.drive import pulses_of, sequence
from printhammer.control.table.histories import (
    REST,
    History,
    histories,
    histories_of,
    number_of,
    pattern_of,
    plain,
)
from printhammer.control.table.newton import changes
from printhammer.control.table.ways import earliest, latest
from printhammer.run.ensemble import Ensemble

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from printhammer.control.table.single import Single
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.limits import Limits
    from printhammer.support.arrays import FloatArray

ROUNDS: Final = 7
"""Steps of Newton's method for each length of history."""

GOOD: Final = 1e-4
"""Deviation, in parts of the limits, from which on an entry is left as it is."""

LEAST_OF_WIDEST: Final = 0.3
"""Least width, in parts of the largest one."""

ROUGH: Final = 0.2
"""Deviation, in parts of the limits, above which an entry is made less wrong in all patterns."""

_DENSE: Final = 6
_STEP: Final = 0.5e-6
_TAIL: Final = 1e-3
_PIECE: Final = 4096


VALUES: Final = (*COLUMNS, "deviation")
"""Names of the arrays of a table."""


@dataclass
class Work:
    """A table in the making: arrays of shape (rates, entries), and what is asked of it.

    It is tuned on `hammers`, the one it is made for first; those of `spread` differ a little from that one.
    No pulse is wider than `widest`, and none begins earlier than `wait` after a brake pulse, s.
    """

    rates: FloatArray
    gaps: int
    reach: int
    advance: FloatArray
    width: FloatArray
    brake_delay: FloatArray
    brake_width: FloatArray
    deviation: FloatArray
    hammers: Sequence[Hammer]
    spread: Sequence[Hammer]
    pulse: Waveform
    widest: float
    wait: float
    single: Single
    limits: Limits
    tolerance: float
    threads: int | None

    def settings(self, row: int) -> Settings:
        """Return what the table says at one of its rates."""
        return Settings(self.advance[row], self.width[row], self.brake_delay[row], self.brake_width[row])


def subset(work: Work, rows: npt.NDArray[np.int64]) -> Work:
    """Return some rows of a table in the making, as a copy."""
    values: dict[str, Any] = {name: getattr(work, name)[rows] for name in VALUES}
    return replace(work, rates=work.rates[rows], **values)


def befores(history: History, reach: int, *, dense: bool = True) -> list[tuple[int, ...]]:
    """Return gaps before a history: of the pattern that begins with it, and of others that it comes late in.

    Parameters
    ----------
    history : tuple of int
        The history.
    reach : int
        Longest gap that counts, slots.
    dense : bool, optional
        Whether to return more than the first.
    """
    if not dense:
        return [()]
    late = (reach + 1,)
    if REST in history:
        return [(), late]
    row = (1,) * _DENSE
    return [(), late, (*row, reach), (*row, *late), (reach, 1, reach, 1)]


def polish(work: Work, told: Callable[[], None]) -> None:
    """Improve all entries, those of short histories first, since they come before the others.

    Parameters
    ----------
    work : Work
        With a first guess for every history; changed in place. The entry from rest stays as it is.
    told : callable
        Called after each round.
    """
    for known in range(1, work.gaps + 1):
        level = level_of(work, known)
        for history in level if known > 1 else []:
            parent = number_of((*history[: known - 1], *[REST] * (work.gaps - known + 1)), work.reach)
            column = number_of(history, work.reach)
            for values in (work.advance, work.width, work.brake_delay, work.brake_width):
                values[:, column] = values[:, parent]
        polish_level(work, level, told)
    # Entries that come before others may have changed since they were looked at.
    for known in range(1, work.gaps + 1):
        look_at(work, level_of(work, known))
    told()


def level_of(work: Work, known: int) -> list[History]:
    """List the histories that hold a number of gaps before they are rest."""
    every = histories(work.gaps, work.reach)
    return [history for history in every if work.gaps - history.count(REST) == known]


def look_at(work: Work, level: Sequence[History]) -> None:
    """Put down how far off some histories are at all rates."""
    cells = [(row, history) for row in range(work.rates.size) for history in level]
    rows = np.array([row for row, _history in cells])
    columns = np.array([number_of(history, work.reach) for _row, history in cells])
    now = np.column_stack([work.advance[rows, columns], work.width[rows, columns]])
    size = last_dots(work, cells, now, [(0.0, 0.0)], whole=True).max(axis=(1, 2, 3))
    work.deviation[rows, columns] = np.where(np.isnan(size), np.inf, size)


def polish_level(work: Work, level: Sequence[History], told: Callable[[], None]) -> None:
    """Improve the entries of some histories at all rates; what is printed from rest stays as it is.

    At first each entry is made right in the pattern that begins with it: where all dots before are right, it
    is right in all others as well. Where that cannot be, it is made less wrong in all.

    Parameters
    ----------
    work : Work
        The table; changed in place.
    level : sequence of tuple
        The histories.
    told : callable
        Called after each round.
    """
    cells = [
        (row, history)
        for row, rate in enumerate(work.rates.tolist())
        for history in level
        if history[0] / rate <= work.single.settled
    ]
    _newton(work, cells, told, dense=False)
    look_at(work, level)
    rough = [
        (row, history)
        for row, history in cells
        if work.deviation[row, number_of(history, work.reach)] > ROUGH
    ]
    if not rough:
        return
    before = subset(work, np.arange(work.rates.size))
    _newton(work, rough, told, dense=True)
    look_at(work, level)
    for row, history in rough:
        column = number_of(history, work.reach)
        if not work.deviation[row, column] < before.deviation[row, column]:
            for name in VALUES:
                getattr(work, name)[row, column] = getattr(before, name)[row, column]


def _newton(
    work: Work, cells: Sequence[tuple[int, History]], told: Callable[[], None], *, dense: bool
) -> None:
    if not cells:
        return
    columns = np.array([number_of(history, work.reach) for _row, history in cells])
    rows = np.array([row for row, _history in cells])
    now = np.column_stack([work.advance[rows, columns], work.width[rows, columns]])
    gap = np.array([history[0] for _row, history in cells]) / work.rates[rows]
    brake = work.brake_width[rows, columns]
    first = earliest(work, work.brake_delay[rows, columns], brake)
    best, best_off = now.copy(), np.full(len(cells), np.inf)
    for turn in range(ROUNDS + 1):
        active = np.flatnonzero(best_off > GOOD)
        if not active.size:
            break
        # Dots before the last one may have the same history.
        work.advance[rows, columns], work.width[rows, columns] = now.T
        shifts = [(0.0, 0.0)] if turn == ROUNDS else [(0.0, 0.0), (_STEP, 0.0), (0.0, -_STEP)]
        off = last_dots(work, [cells[k] for k in active.tolist()], now[active], shifts, dense=dense)
        told()
        here = off[:, 0]
        size = np.abs(here).max(axis=(1, 2))
        size = np.where(np.isnan(size), np.inf, size)
        better = size < best_off[active]
        best[active[better]] = now[active[better]]
        best_off[active[better]] = size[better]
        if turn == ROUNDS:
            break
        # Half the way back to the best that is known.
        back = active[~better]
        now[back] = 0.5 * (now[back] + best[back])
        slopes = np.stack([(off[:, 1] - here) / _STEP, (off[:, 2] - here) / -_STEP], axis=-1)
        slopes = slopes.reshape(active.size, -1, 2)
        known = better & np.isfinite(slopes).all(axis=(1, 2))
        on = active[known]
        wide = now[on, 1]
        least = LEAST_OF_WIDEST * work.widest - wide
        wrong = here[known].reshape(on.size, slopes.shape[1])
        now[on] += changes(slopes[known], wrong, least, work.widest - wide)
        now[on, 0] = np.clip(now[on, 0], -latest(work, now[on, 1]), gap[on] - first[on])
    work.advance[rows, columns], work.width[rows, columns] = best.T


def last_dots(
    work: Work,
    cells: Sequence[tuple[int, History]],
    values: FloatArray,
    shifts: Sequence[tuple[float, float]],
    *,
    dense: bool = True,
    whole: bool = False,
) -> FloatArray:
    """Return deviations of last dots of patterns, in parts of the limits.

    Parameters
    ----------
    work : Work
        The table.
    cells : sequence of tuple
        Row and history of each entry.
    values : array, shape (cells, 2)
        Advance and width of the last dot, s.
    shifts : sequence of tuple
        Changes of these to be tried, s.
    dense : bool, optional
        As for `befores`.
    whole : bool, optional
        Whether to return the largest deviations of all dots of a pattern that have the history instead.

    Returns
    -------
    array, shape (cells, shifts, patterns and hammers, 2)
        Of force and arrival; NaN for a lost dot or one with extra contacts. Where an entry has fewer patterns
        than others, its first one is repeated.
    """
    most = max(len(befores(history, work.reach, dense=dense)) for _row, history in cells)
    drives: list[Drive] = []
    due: list[FloatArray] = []
    alike: list[npt.NDArray[np.bool_]] = []
    known: dict[tuple[float, float, float], Waveform] = {}
    for (row, history), value in zip(cells, values, strict=True):
        settings, rate = work.settings(row), float(work.rates[row])
        given = befores(history, work.reach, dense=dense)
        for shift in shifts:
            for before in [*given, *[given[0]] * (most - len(given))]:
                slots = pattern_of(plain(history), before)
                pulses = pulses_of(settings, work.gaps, work.reach, slots, rate)
                advance, width = value + shift
                pulses.fired[-1] = pulses.due[-1] - advance
                pulses.width[-1] = width
                pulses.offset[-1] += advance - pulses.advance[-1]
                drives.append(sequence(pulses, work.pulse, known))
                due.append(pulses.due)
                numbers = histories_of(slots, work.gaps, work.reach)[:-1]
                alike.append(numbers == numbers[-1])
    found = []
    for hammer in work.hammers:
        off = np.empty((len(drives), 2))
        for start in range(0, len(drives), _PIECE):
            part = slice(start, start + _PIECE)
            off[part] = _off(work, hammer, drives[part], due[part], alike[part] if whole else None)
        found.append(off)
    shape = len(cells), len(shifts), most, 2
    return np.concatenate([off.reshape(shape) for off in found], axis=2)


def _off(
    work: Work,
    hammer: Hammer,
    drives: Sequence[Drive],
    due: Sequence[FloatArray],
    alike: Sequence[npt.NDArray[np.bool_]] | None,
) -> FloatArray:
    """Return deviations of force and arrival of last dots, or the largest ones of the dots that are asked."""
    nominal = work.single.nominal
    last = np.array([len(times) - 1 for times in due])
    slots = np.full((len(drives), int(last.max()) + 1), np.nan)
    for row, times in zip(slots, due, strict=True):
        row[: times.size] = times
    rows = np.arange(len(drives))
    ends = slots[rows, last] + nominal.flight_time + _TAIL
    ensemble = Ensemble(hammer, list(drives), ends, tolerance=work.tolerance)
    result = ensemble.run(dots=True, threads=work.threads)
    dots = result.dots
    assert dots is not None
    force = (dots.peak_force / nominal.force - 1.0) / work.limits.force
    touched = dots.fired_at + dots.flight_time
    arrival = (touched - (slots + nominal.flight_time)) / work.limits.arrival
    bad = ~result.ok | (dots.extra_contacts > work.limits.extra_contacts).any(axis=1)
    if alike is not None:
        there = np.zeros(slots.shape, np.bool_)
        for row, those in zip(there, alike, strict=True):
            row[: those.size] = those
        off = np.stack([np.where(there, np.abs(one), 0.0).max(axis=1) for one in (force, arrival)], axis=1)
    else:
        off = np.column_stack([force[rows, last], arrival[rows, last]])
    off[bad] = np.nan
    return off
