"""Ways to fire a dot some time after another one: which are right, and what becomes of rows of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from printhammer.control.table.drive import Pulses, sequence
from printhammer.control.table.newton import largest_of, solve

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from printhammer.control.table.task import Task
    from printhammer.drive.trains import Drive
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import BoolArray, FloatArray, IntArray

ROW: Final = 8  # Number of dots of the row that decides
NOMINAL: Final = 8.0  # How often the hammer that a table is made for counts, beside those that differ
LEAST_OF_OWN: Final = 0.5  # Least width, in parts of that of the pulse of the hammer
# Deviation of the second dot, in parts of the limits, from which on a way is left as it is
_SOLVED: Final = 1e-3
_STEPS: Final = (1e-6, 0.5e-6)  # Differences of firing time and width from which derivatives are taken, s
# Deviation of the second dot, in parts of the limits, above which a way does not make it right
_RIGHT: Final = 0.02
_WRONG: Final = 1.0  # What such a way costs more, so that any that makes it right comes first
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
    that cannot make even the second dot right is put behind others. Infinite where a dot is lost, or the
    pulses do not fit between each other.
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
    return cost


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
