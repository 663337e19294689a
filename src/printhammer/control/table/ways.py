"""Ways to fire a dot some time after another one: which are right, and what becomes of rows of them.

Newton's method for firing time and width of many dots at once, so that force and arrival are right.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from printhammer.control.table.drive import Pulses, sequence
from printhammer.control.table.task import Task
from printhammer.derivatives.rows import DOTS, row_multipliers
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    Measure = Callable[[FloatArray, IntArray, FloatArray], FloatArray]
    Bounded = Callable[[FloatArray, IntArray, BoolArray], None]

ROUNDS: Final = 7  # Largest number of steps
LONGEST_STEP: Final = 25e-6  # Longest change of firing time or width in one step, s
# Damping after Levenberg and Marquardt, in parts of the limits for a change of `LONGEST_STEP`
_DAMPING: Final = 0.02


def solve(
    measure: Measure,
    start: FloatArray,
    *,
    steps: tuple[float, float],
    good: float,
    least: float,
    most: float,
    bounded: Bounded,
) -> FloatArray:
    """Return the times and widths (dots, 2) at which deviations are least, of all steps that were tried.

    `measure` returns deviations (active, shifts, deviations), in parts of the limits and NaN for a lost dot,
    from all values as they are, the numbers of the dots that are still worked on, and shifts (shifts, 2) of
    their values. `start` are firing time, or advance, and width, s; derivatives are taken from differences of
    `steps`, s, forward in time and backward in width. A dot whose deviation is `good` is left as it is;
    widths are between `least` and `most`, s. `bounded` puts values in place within their bounds, given all of
    them, the numbers of the dots that are worked on, and whether each made a step.
    """
    now, best, best_off = start.copy(), start.copy(), np.full(len(start), np.inf)
    shifts = np.array([(0.0, 0.0), (steps[0], 0.0), (0.0, -steps[1])])
    for turn in range(ROUNDS + 1):
        active = np.flatnonzero(best_off > good)
        if not active.size:
            break
        off = measure(now, active, shifts if turn < ROUNDS else shifts[:1])
        here = off[:, 0]
        size = largest_of(here)
        better = size < best_off[active]
        best[active[better]], best_off[active[better]] = now[active[better]], size[better]
        if turn == ROUNDS:
            break
        # Half the way back to the best that is known.
        back = active[~better]
        now[back] = 0.5 * (now[back] + best[back])
        slopes = np.stack([(off[:, 1] - here) / steps[0], (off[:, 2] - here) / -steps[1]], axis=2)
        stepped = better & np.isfinite(slopes).all(axis=(1, 2))
        on = active[stepped]
        width = now[on, 1]
        now[on] += changes(slopes[stepped], here[stepped], least - width, most - width)
        bounded(now, active, stepped)
    return best


def largest_of(off: FloatArray) -> FloatArray:
    """Return the largest absolute deviation of each row; infinite where one is NaN."""
    size = np.abs(off).reshape(off.shape[0], -1).max(axis=1)
    return np.asarray(np.where(np.isnan(size), np.inf, size))


def changes(slopes: FloatArray, off: FloatArray, least: FloatArray, most: FloatArray) -> FloatArray:
    """Return changes (dots, 2) of two times, s, after which deviations are least in the mean square.

    `slopes` (dots, deviations, 2) are the derivatives of the deviations `off` (dots, deviations) after firing
    time, or advance, and width, 1/s; the change of the width, s, is between `least` and `most` (dots,).
    """
    turned = slopes.transpose(0, 2, 1)
    # A little of what Levenberg and Marquardt do: a direction in which nothing changes is left alone.
    square = turned @ slopes + (_DAMPING / LONGEST_STEP) ** 2 * np.eye(2)
    change = -np.linalg.solve(square, turned @ off[:, :, np.newaxis])[:, :, 0]
    wider = np.clip(change[:, 1], least, most)
    along = slopes[:, :, 0]
    rest = off + slopes[:, :, 1] * wider[:, np.newaxis]
    length = np.maximum((along * along).sum(axis=1), np.finfo(np.float64).tiny)
    later = np.where(wider == change[:, 1], change[:, 0], -(along * rest).sum(axis=1) / length)
    return np.asarray(np.clip(np.column_stack([later, wider]), -LONGEST_STEP, LONGEST_STEP))


ROW: Final = 8  # Number of dots of the row that decides
NOMINAL: Final = 8.0  # How often the hammer that a table is made for counts, beside those that differ
LEAST_OF_OWN: Final = 0.5  # Least width, in parts of that of the pulse of the hammer
# Deviation of the second dot, in parts of the limits, from which on a way is left as it is
_SOLVED: Final = 1e-3
_STEPS: Final = (1e-6, 0.5e-6)  # Differences of firing time and width from which derivatives are taken, s
# Deviation of the second dot, in parts of the limits, above which a way does not make it right
_RIGHT: Final = 0.02
_WRONG: Final = 1.0  # What such a way costs more, so that any that makes it right comes first
STABLE: Final = 0.97
"""Largest absolute multiplier of a row, from dot to dot, of a way: within the unit circle, with room for
interpolation and ticks."""

_FAR_OFF: Final = 5.0  # Deviation, in parts of the limits, beyond which a row is no worse in a mean square
_ROUNDING: Final = 1e-12


class Ways(NamedTuple):
    """Ways to fire a dot: arrays of shape (ways,), times after the slot of the dot before, s.

    The dot is due at `period`. A brake pulse of width `brake` begins at `delay`, both 0 without one; the dot
    is `fired` with a pulse of `width`. `cost` says how far a row of such dots is off, see `costs`.
    """

    period: FloatArray
    delay: FloatArray
    brake: FloatArray
    fired: FloatArray
    width: FloatArray
    cost: FloatArray

    @property
    def size(self) -> int:
        """Number of ways."""
        return self.period.size

    @property
    def settings(self) -> FloatArray:
        """Advance, width, and delay and width of the brake pulse, s, shape (4, ways)."""
        return np.stack([self.period - self.fired, self.width, self.delay, self.brake])

    def take(self, which: Any) -> Ways:
        """Return some of them."""
        return Ways(*(values[which] for values in self))

    def at(self, period: float) -> Ways:
        """Return the same for another time, fired as long before or after it."""
        moved = self.fired + (period - self.period)
        return self._replace(period=np.full(self.size, period), fired=moved)


def joined(parts: Iterable[Ways]) -> Ways:
    """Concatenate sets of ways, none at all among them."""
    return Ways(*map(np.concatenate, zip(ways_of([]), *parts, strict=True)))


def ways_of(cells: Sequence[tuple[float, float, float, float, float]]) -> Ways:
    """Return ways from their period, delay, brake, firing time and width, of unknown cost."""
    period, delay, brake, fired, width = np.array(cells, dtype=np.float64).reshape(-1, 5).T
    return Ways(period, delay, brake, fired, width, np.full(period.size, np.inf))


def fits(task: Task, ways: Ways) -> BoolArray:
    """Return which ways fire after what comes before, and so that a brake pulse may come after."""
    first, last = task.earliest(ways.delay, ways.brake), ways.period + task.latest(ways.width)
    return np.asarray((ways.fired >= first - _ROUNDING) & (ways.fired <= last + _ROUNDING))


def solved(task: Task, ways: Ways) -> Ways:
    """Return firing times and widths for which the second dot is right, by Newton's method.

    Where there are none, those of the best step.
    """
    if not ways.size:
        return ways
    first = task.earliest(ways.delay, ways.brake)

    def measure(now: FloatArray, active: IntArray, shifts: FloatArray) -> FloatArray:
        fired, width = (now[active, np.newaxis] + shifts).reshape(-1, 2).T
        tried = ways.take(np.repeat(active, len(shifts)))._replace(fired=fired, width=width)
        return seconds(task, tried).reshape(active.size, len(shifts), 2)

    def bounded(now: FloatArray, active: IntArray, _stepped: Any) -> None:
        last = ways.period[active] + task.latest(now[active, 1])
        now[active, 0] = np.maximum(np.minimum(now[active, 0], last), first[active])

    start = np.column_stack([ways.fired, ways.width])
    bounded(start, np.arange(ways.size), None)
    fired, width = solve(
        measure,
        start,
        steps=_STEPS,
        good=_SOLVED,
        least=LEAST_OF_OWN * task.width,
        most=task.widest,
        bounded=bounded,
    ).T
    return ways._replace(fired=fired, width=width)


def costs(task: Task, ways: Ways) -> FloatArray:
    """Return how far off rows of dots made in some ways are, in parts of the limits.

    That is the largest deviation of any dot of a row of `ROW`, on the hammers that differ a little from the
    one the table is made for; what that one itself does counts `NOMINAL` times. Where a variability is stated
    it is the root of the mean square of the largest deviations on its sigma points and on that hammer. A way
    that cannot make even the second dot right is put behind others. Infinite where a dot is lost, the pulses
    do not fit between each other, or an error in a long row grows: where its multiplier is beyond `STABLE`.
    """
    cost = np.full(ways.size, np.inf)
    some = np.flatnonzero(fits(task, ways))
    if some.size:
        part = ways.take(some)
        drives = rows_of(task, part, ROW)
        own = _deviations(task, task.hammers[0], part, drives)
        spread = [largest_of(_deviations(task, hammer, part, drives)) for hammer in task.spread]
        if task.mean_square:
            every = np.minimum([largest_of(own), *spread], _FAR_OFF)
            worst = np.where(np.isfinite(largest_of(own)), np.sqrt((every**2).mean(axis=0)), np.inf)
        else:
            worst = np.maximum.reduce([NOMINAL * largest_of(own), *spread])
        cost[some] = worst + np.where(largest_of(own[:, 1]) > _RIGHT, _WRONG, 0.0)
        made = np.flatnonzero(np.isfinite(cost))
        cost[made[~is_stable(task, ways.take(made))]] = np.inf
    return cost


def is_stable(task: Task, ways: Ways) -> BoolArray:
    """Return in which ways an error in a long row shrinks from dot to dot, (ways,)."""
    hammers = [task.hammers[0]] * ways.size
    growth = row_multipliers(hammers, rows_of(task, ways, DOTS), task.effort, closed=False)
    return np.abs(growth) <= STABLE


def seconds(task: Task, ways: Ways) -> FloatArray:
    """Return deviations of force and arrival of second dots, in parts of the limits, shape (ways, 2)."""
    return _deviations(task, task.hammers[0], ways, rows_of(task, ways, 2))[:, 1]


def rows_of(task: Task, ways: Ways, dots: int) -> list[Drive]:
    """Return drives of rows of dots, one way each, the first dot from rest."""
    known: dict[tuple[float, float, float], Waveform] = {}
    drives: list[Drive] = []
    for period, delay, brake, fired, width, _cost in zip(*(column.tolist() for column in ways), strict=True):
        due = np.arange(dots) * period
        advance = np.array([0.0, *[period - fired] * (dots - 1)])
        widths = np.array([task.width, *[width] * (dots - 1)])
        braked = np.array([*[brake] * (dots - 1), 0.0])
        pulses = Pulses(due, advance, due - advance, widths, braked, delay + advance)
        drives.append(sequence(pulses, task.pulse, known))
    return drives


def _deviations(task: Task, hammer: Hammer, ways: Ways, drives: Sequence[Drive]) -> FloatArray:
    """Return deviations of force and arrival, in parts of the limits, shape (ways, dots, 2).

    NaN for a lost dot or one with extra contacts.
    """
    count = len(drives[0].times) if drives else 2
    slots = np.arange(count) * ways.period[:, np.newaxis]
    ends = np.array([float(drive.times[-1]) for drive in drives])
    off, crowded = task.deviations(hammer, drives, slots, ends)
    off[crowded] = np.nan
    return off
