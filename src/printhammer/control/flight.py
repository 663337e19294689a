"""Where a flying armature is and will touch the pack, from samples of its position and a model of its forces.

In flight the acceleration is that of magnet and spring, a function of displacement and current, which the
controller knows. What it does not know are two numbers: where the armature is at one instant, and how fast.
With c the twofold integral of the acceleration from that instant, x = X + V tau + c(tau), which is linear in
the two, so that they follow from the samples by least squares, together with what was expected before.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.static_force import StaticForce

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.hammer import Hammer
    from printhammer.segments import FloatArray

    Accelerations = Callable[[FloatArray, FloatArray], FloatArray]

_ROUNDS: Final = 3
_NODES: Final = 65
_SLOWEST: Final = 1e-2
_PLACES, _CURRENTS = 97, 129


class FreeForce:
    """Force of magnet and spring of a hammer, N, read from a table over displacement and current.

    Parameters
    ----------
    hammer : Hammer
        The hammer.
    low, high : float
        Displacements at the ends of the table, m.
    largest : float
        Largest absolute value of the current, A.
    """

    def __init__(self, hammer: Hammer, low: float, high: float, largest: float) -> None:
        force = StaticForce(hammer)
        self._low, self._high, self._largest = low, high, largest
        currents = np.linspace(-largest, largest, _CURRENTS)
        self._table = np.array(
            [
                [force.free(x, current) for current in currents.tolist()]
                for x in np.linspace(low, high, _PLACES).tolist()
            ]
        )

    def __call__(self, x: FloatArray, current: FloatArray) -> FloatArray:
        """Return the force; outside the table that of its edge."""
        row = np.clip((x - self._low) / (self._high - self._low), 0.0, 1.0) * (_PLACES - 1)
        column = np.clip(0.5 + 0.5 * current / self._largest, 0.0, 1.0) * (_CURRENTS - 1)
        i = np.minimum(row.astype(np.int64), _PLACES - 2)
        j = np.minimum(column.astype(np.int64), _CURRENTS - 2)
        p, q = row - i, column - j
        values = self._table
        found: FloatArray = (1.0 - p) * ((1.0 - q) * values[i, j] + q * values[i, j + 1]) + p * (
            (1.0 - q) * values[i + 1, j] + q * values[i + 1, j + 1]
        )
        return found


@dataclass(frozen=True)
class Expected:
    """What is expected of a touch before the samples are looked at.

    Attributes
    ----------
    time, speed : array, shape (M,)
        Of the touch, s and m/s.
    place_error, speed_error : float
        Standard deviations of the displacement at that time, m, and of the speed, m/s.
    """

    time: FloatArray
    speed: FloatArray
    place_error: float
    speed_error: float


def touch_from_samples(
    times: FloatArray,
    seen: FloatArray,
    used: FloatArray,
    error: float,
    expected: Expected,
    front: float,
    accelerations: Accelerations,
) -> tuple[FloatArray, FloatArray]:
    """Return time, s, and speed, m/s, of the coming touch of the pack.

    Parameters
    ----------
    times, seen : array, shape (M, N)
        Times of the samples, s, and what the sensor shows, m.
    used : array, shape (M, N)
        1 for a sample that counts, 0 for one that does not.
    error : float
        Standard deviation of a sample, m.
    expected : Expected
        What is expected before.
    front : float
        Front of the pack, m.
    accelerations : callable
        Of a flying armature: displacements, m, and times, s, both of shape (M, K), to m/s².
    """
    reference = expected.time
    place, speed = np.full(len(reference), front), expected.speed.copy()
    first = np.where(used > 0.0, times, np.inf).min(axis=1, initial=np.inf)
    first = np.minimum(np.where(np.isfinite(first), first, reference), reference)
    grid = reference[:, np.newaxis] + np.linspace(-1.0, 0.0, _NODES) * (reference - first)[:, np.newaxis]
    curve = np.zeros_like(grid)
    weight = used / error**2
    place_weight, speed_weight = expected.place_error**-2.0, expected.speed_error**-2.0
    tau = np.where(used > 0.0, times - reference[:, np.newaxis], 0.0)
    for _ in range(_ROUNDS):
        along = place[:, np.newaxis] + speed[:, np.newaxis] * (grid - reference[:, np.newaxis]) + curve
        curve = _twice_integrated(grid, accelerations(along, grid))
        bend = _interpolated(grid, curve, times)
        rest = np.where(used > 0.0, seen - bend, 0.0)
        s0 = weight.sum(axis=1) + place_weight
        s1 = (weight * tau).sum(axis=1)
        s2 = (weight * tau * tau).sum(axis=1) + speed_weight
        b0 = (weight * rest).sum(axis=1) + place_weight * front
        b1 = (weight * tau * rest).sum(axis=1) + speed_weight * expected.speed
        determinant = s0 * s2 - s1 * s1
        place = (s2 * b0 - s1 * b1) / determinant
        speed = (s0 * b1 - s1 * b0) / determinant
    speed = np.maximum(speed, _SLOWEST)
    bend = accelerations(np.full((len(reference), 1), front), reference[:, np.newaxis])[:, 0]
    late = np.zeros_like(place)
    for _ in range(_ROUNDS):
        late = (front - place - 0.5 * bend * late**2) / speed
    return reference + late, speed + bend * late


def _twice_integrated(grid: FloatArray, values: FloatArray) -> FloatArray:
    """Integrate twice over evenly spaced times, (M, K), back from the last one; trapezoidal rule."""
    step = (grid[:, -1:] - grid[:, :1]) / (grid.shape[1] - 1)

    def backwards(integrand: FloatArray) -> FloatArray:
        pieces = 0.5 * (integrand[:, 1:] + integrand[:, :-1]) * step
        summed = np.cumsum(pieces[:, ::-1], axis=1)[:, ::-1]
        return -np.concatenate([summed, np.zeros((len(grid), 1))], axis=1)

    return backwards(backwards(values))


def _interpolated(grid: FloatArray, values: FloatArray, times: FloatArray) -> FloatArray:
    """Interpolate rows over evenly spaced times linearly; beyond the ends the value there."""
    count = grid.shape[1] - 1
    span = np.maximum(grid[:, -1:] - grid[:, :1], 1e-300)
    place = np.clip((times - grid[:, :1]) / span, 0.0, 1.0) * count
    below = np.minimum(place.astype(np.int64), count - 1)
    share = place - below
    row = np.arange(len(grid))[:, np.newaxis]
    found: FloatArray = (1.0 - share) * values[row, below] + share * values[row, below + 1]
    return found
