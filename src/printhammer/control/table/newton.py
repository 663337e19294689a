"""Newton's method for firing time and width of many dots at once, so that force and arrival are right."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.support.arrays import BoolArray, FloatArray, IntArray

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
