"""Candidate pulses for a dot that follows another dot: solver for the pulses, and cost of rows of dots.

The solver is a damped Gauss-Newton iteration (Levenberg-Marquardt) for firing time and width, vectorised over
dots.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from printhammer.control.table.drive import Pulses, sequence
from printhammer.control.table.task import Task
from printhammer.derivatives.rows import MORE, row_multipliers
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    Measure = Callable[[FloatArray, IntArray, FloatArray], FloatArray]
    Bounded = Callable[[FloatArray, IntArray, BoolArray], None]

ROUNDS: Final = 7  # Maximum number of iterations; arbitrary
LONGEST_STEP: Final = 25e-6  # Largest change of firing time or width per iteration, s; arbitrary
# Levenberg-Marquardt damping, as a fraction of the limits for a change of `LONGEST_STEP`; arbitrary
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
    longest: float = LONGEST_STEP,
) -> FloatArray:
    """Minimise the deviations of dots; return the firing time and width of each dot, s, shape (dots, 2).

    The method is Levenberg-Marquardt (J. Nocedal and S. J. Wright, *Numerical Optimization*, ch. 10).

    The values of a dot are its firing time (or advance) and width [s]; `start` contains the initial guesses.
    `measure(values, active, shifts)` returns the deviations of the dots with the indices `active` for each of
    the shifts of their values, as fractions of the limits, NaN for a lost dot; shape (active, shifts,
    deviations). Derivatives are finite differences with `steps` [s], forward in time and backward in width. A
    step is at most `longest` [s], and widths stay between `least` and `most` [s]. `bounded(values, active,
    stepped)` clips the values in place; `stepped` is the mask of the active dots that made a step. A dot is
    finished when its largest deviation is at most `good`.
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
        # Step halfway back to the best iterate.
        back = active[~better]
        now[back] = 0.5 * (now[back] + best[back])
        slopes = np.stack([(off[:, 1] - here) / steps[0], (off[:, 2] - here) / -steps[1]], axis=2)
        stepped = better & np.isfinite(slopes).all(axis=(1, 2))
        on = active[stepped]
        width = now[on, 1]
        now[on] += changes(slopes[stepped], here[stepped], least - width, most - width, longest)
        bounded(now, active, stepped)
    return best


def largest_of(off: FloatArray) -> FloatArray:
    """Return the largest absolute deviation of each row; infinite for a row with NaN."""
    size = np.abs(off).reshape(off.shape[0], -1).max(axis=1)
    return np.asarray(np.where(np.isnan(size), np.inf, size))


def changes(
    slopes: FloatArray,
    off: FloatArray,
    least: FloatArray,
    most: FloatArray,
    longest: float = LONGEST_STEP,
) -> FloatArray:
    """Compute the Levenberg-Marquardt step of firing time and width [s], shape (dots, 2).

    `off`, shape (dots, deviations), are the deviations; `slopes`, shape (dots, deviations, 2), are their
    derivatives with respect to firing time (or advance) and width, 1/s. The step of the width is clipped to
    the range from `least` to `most` [s], one value per dot, and both steps to at most `longest` [s].
    """
    turned = slopes.transpose(0, 2, 1)
    # The damping keeps the step finite in a direction that does not affect the deviations.
    square = turned @ slopes + (_DAMPING / longest) ** 2 * np.eye(2)
    change = -np.linalg.solve(square, turned @ off[:, :, np.newaxis])[:, :, 0]
    wider = np.clip(change[:, 1], least, most)
    along = slopes[:, :, 0]
    rest = off + slopes[:, :, 1] * wider[:, np.newaxis]
    length = np.maximum((along * along).sum(axis=1), np.finfo(np.float64).tiny)
    later = np.where(wider == change[:, 1], change[:, 0], -(along * rest).sum(axis=1) / length)
    return np.asarray(np.clip(np.column_stack([later, wider]), -longest, longest))


BAD: Final = 0.75  # Cost above which more candidates are searched for; arbitrary
_SECOND: Final = 2  # Index of the first firing after the two dots with solved pulses
UNSTABLE: Final = 1e3
"""Lowest cost of an unstable candidate, which is never chosen, but may have a stable neighbour; arbitrary."""

ROW: Final = 8  # Number of dots in the row that rates a candidate; arbitrary
NOMINAL: Final = 8.0  # Weight of the design hammer relative to the perturbed hammers; arbitrary
LEAST_OF_OWN: Final = 0.5
"""Smallest pulse width, as a fraction of the width of the hammer's own pulse; arbitrary."""
# Deviation of the second dot, as a fraction of the limits, at which a candidate is solved; arbitrary
_SOLVED: Final = 1e-3
_STEPS: Final = (1e-6, 0.5e-6)  # Finite-difference steps of firing time and width, s; arbitrary
# Deviation of the second dot, as a fraction of the limits, above which a candidate is not a solution;
# arbitrary
_RIGHT: Final = 0.02
_WRONG: Final = 1.0
"""Cost added to a candidate that is not a solution, so that solutions rank first; arbitrary."""
STABLE: Final = 0.97
"""Largest absolute multiplier, from dot to dot, of an admissible row of dots. Arbitrary: below 1, with a
margin for interpolation and timer ticks."""

_FAR_OFF: Final = 5.0  # Deviation, as a fraction of the limits, at which an RMS term is cut off; arbitrary
_ROUNDING: Final = 1e-12
"""Tolerance by which ranges of firing times are extended to include their ends, s; arbitrary."""


class Ways(NamedTuple):
    """Candidate pulses for a dot that follows another dot: arrays with one element per candidate.

    Times are in s, measured from the slot of the preceding dot. The dot is due at `period`. A brake pulse of
    the width `brake` begins at `delay`; both are 0 without a brake pulse. The dot is fired at `fired` with a
    pulse of the width `width`. `cost` is the deviation of a row of such dots; see `costs`.
    """

    period: FloatArray
    delay: FloatArray
    brake: FloatArray
    fired: FloatArray
    width: FloatArray
    cost: FloatArray

    @property
    def size(self) -> int:
        """Number of candidates."""
        return self.period.size

    @property
    def settings(self) -> FloatArray:
        """Rows of advance and width of the dot's pulse, and delay and width of the brake pulse, s."""
        return np.stack([self.period - self.fired, self.width, self.delay, self.brake])

    def take(self, which: Any) -> Ways:
        """Return the candidates selected by an index array, mask or slice."""
        return Ways(*(values[which] for values in self))

    def at(self, period: float) -> Ways:
        """Return the candidates for a new period [s]; firing times relative to the slot are unchanged."""
        moved = self.fired + (period - self.period)
        return self._replace(period=np.full(self.size, period), fired=moved)


def joined(parts: Iterable[Ways]) -> Ways:
    """Concatenate several sets of candidates into a single set, which may be empty."""
    return Ways(*map(np.concatenate, zip(ways_of([]), *parts, strict=True)))


def ways_of(cells: Sequence[tuple[float, float, float, float, float]]) -> Ways:
    """Create candidates of infinite cost from (period, brake delay, brake width, firing time, width), s."""
    period, delay, brake, fired, width = np.array(cells, dtype=np.float64).reshape(-1, 5).T
    return Ways(period, delay, brake, fired, width, np.full(period.size, np.inf))


def fits(task: Task, ways: Ways) -> BoolArray:
    """Return a mask of the candidates with admissible firing times; see `Task.earliest`, `Task.latest`."""
    first, last = task.earliest(ways.delay, ways.brake), ways.period + task.latest(ways.width)
    return np.asarray((ways.fired >= first - _ROUNDING) & (ways.fired <= last + _ROUNDING))


def solved(task: Task, ways: Ways) -> Ways:
    """Solve for the firing times and widths with which the second dot equals the single-pulse dot.

    The first dot is printed from rest. A candidate that does not converge keeps its best iterate; see
    `solve`.
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
        steps=(_STEPS[0] * task.scale, _STEPS[1] * task.scale),
        good=_SOLVED,
        least=LEAST_OF_OWN * task.width,
        most=task.widest,
        bounded=bounded,
        longest=LONGEST_STEP * task.scale,
    ).T
    return ways._replace(fired=fired, width=width)


def costs(task: Task, ways: Ways) -> FloatArray:
    """Compute the costs of candidates: deviations of rows of dots, as fractions of the limits.

    The cost is the largest deviation of any dot of a row of `ROW` dots, over the hammers of `task.spread`
    and, with the weight `NOMINAL`, the design. With a stated variability the cost is the RMS, over the
    design and the sigma points of the variability, of the largest deviation on each hammer. Candidates that
    miss even the second dot cost `_WRONG` more. If the multiplier of a long row exceeds `STABLE`, the cost is
    at least `UNSTABLE` and increases with the multiplier. The cost is infinite if a dot is lost or the pulses
    overlap.
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
        growth = growths(task, ways.take(made)._replace(cost=cost[made]))
        grows = ~(growth <= STABLE)
        cost[made[grows]] = UNSTABLE * (1.0 + np.fmin(growth[grows], UNSTABLE))
    return cost


def growths(task: Task, ways: Ways) -> FloatArray:
    """Compute, for each candidate, the growth factor of a deviation from dot to dot in a long row.

    All later dots of the row repeat the second dot of the candidate. The factor is the absolute value of the
    leading Floquet multiplier; NaN if the multiplier is unknown. The multiplier is evaluated at the state
    after the first two dots, which is the fixed point of the row if both dots meet their target. If the cost
    of a candidate exceeds `BAD`, or if `task.located` is set, and the row appears stable, the fixed point is
    located by Newton's method, and the multiplier is evaluated there: near a grazing, a row may have no fixed
    point even if its first dots meet their target.
    """
    rows = rows_of(task, ways, _SECOND + MORE)
    hammers = [task.hammers[0]] * ways.size
    growth = np.abs(row_multipliers(hammers, rows, task.effort, closed=False, firing=_SECOND))
    far = np.flatnonzero(((ways.cost > BAD) | task.located) & (growth <= STABLE))
    located = row_multipliers(hammers[: far.size], [rows[k] for k in far], task.effort, firing=_SECOND)
    growth[far] = np.abs(located)
    return growth


def seconds(task: Task, ways: Ways) -> FloatArray:
    """Simulate each candidate's second dot; return its normalised deviations of force and arrival."""
    return _deviations(task, task.hammers[0], ways, rows_of(task, ways, 2))[:, 1]


def rows_of(task: Task, ways: Ways, dots: int) -> list[Drive]:
    """Return the drives of rows of `dots` dots, one drive per candidate; the first dot is from rest."""
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
    """Simulate the drive of each candidate on a hammer; return the deviations of all dots.

    The deviations of force and arrival are fractions of the limits, shape (candidates, dots, 2); NaN for a
    lost dot and for a dot with extra contacts.
    """
    count = len(drives[0].times) if drives else 2
    slots = np.arange(count) * ways.period[:, np.newaxis]
    ends = np.array([float(drive.times[-1]) for drive in drives])
    off, crowded = task.deviations(hammer, drives, slots, ends)
    off[crowded] = np.nan
    return off
