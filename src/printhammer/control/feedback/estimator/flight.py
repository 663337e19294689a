"""The observer: estimates of the flying armature's state and next touch, from samples and a force model.

In flight the acceleration is that of magnet and spring, a known function of displacement and current. Three
numbers are unknown: displacement X and speed V at a reference time, and the relative deviation s of all
currents from nominal, e.g. with another supply. With c the twice integrated acceleration, x = X + V tau +
c(tau; s). This is linear in X and V and nearly linear in s, so a few Gauss-Newton steps, with the expectation
as a prior, give the maximum a posteriori estimate.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.estimator.sensor import Samples
from printhammer.control.feedback.impact_map import bilinear, blend
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.support.arrays import FloatArray

if TYPE_CHECKING:
    Accelerations = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]

_ROUNDS: Final = 3  # Iterations of path integration, of the fit, and of the touch time
_NODES: Final = 65  # Time nodes of a path
_SLOWEST: Final = 1e-2  # Smallest speed of a touch, m/s
_SHORTEST: Final = 1e-6  # Shortest flight, s
# Finite-difference steps: relative speed, and current scale
_STEP: Final = 0.01
_SCALE_STEP: Final = 0.02
_BENDS: Final = 2  # Picard iterations of a path per fit
_PLACES, _CURRENTS = 97, 129  # Numbers of displacements and currents of the force table


class FreeForce:
    """Force of magnet and spring, N, interpolated in a table over displacement and current.

    The table covers displacements from `low` to `high`, m, and currents up to `largest`, A, of either sign.
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
        """Interpolate the force, N, at displacements, m, and currents, A, clipped to the table's range."""
        row = np.clip((x - self._low) / (self._high - self._low), 0.0, 1.0) * (_PLACES - 1)
        column = np.clip(0.5 + 0.5 * current / self._largest, 0.0, 1.0) * (_CURRENTS - 1)
        i = np.minimum(row.astype(np.int64), _PLACES - 2)
        j = np.minimum(column.astype(np.int64), _CURRENTS - 2)
        return bilinear(self._table, i, row - i, j, column - j)


@dataclass(frozen=True)
class Expected:
    """Prior expectation of M touches, one element of each array per touch.

    Time, s, and speed, m/s; `scale`, the relative deviation of all currents from nominal; and the covariance,
    shape (M, 3, 3), of displacement at that time, m, speed, m/s, and scale.
    """

    time: FloatArray
    speed: FloatArray
    scale: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class Flight:
    """Flights estimated from samples: states, covariances, and the coming touches."""

    # Time, s, and speed, m/s, of the coming touch, (M,)
    touch: FloatArray
    speed: FloatArray
    scale: FloatArray  # Relative deviation of all currents from nominal, (M,)
    reference: FloatArray  # Reference time of `state` and `covariance`, s, (M,)
    # Displacement, m, speed, m/s, and scale, (M, 3), and their covariance, (M, 3, 3)
    state: FloatArray
    covariance: FloatArray

    def at(self, time: FloatArray, accelerations: Accelerations) -> tuple[FloatArray, FloatArray]:
        """Propagate states, shape (M, 3), and covariances, (M, 3, 3), in free flight to another time, s."""
        place, speed, scale = self.state.T
        way = time - self.reference
        grid = self.reference[:, np.newaxis] + np.linspace(1.0, 0.0, _NODES) * way[:, np.newaxis]
        once, twice = np.zeros_like(grid), np.zeros_like(grid)
        more_once, more_twice = once, twice
        for _ in range(_ROUNDS):
            along = place[:, np.newaxis] + speed[:, np.newaxis] * (grid - self.reference[:, np.newaxis])
            along = along + twice
            once, twice = _integrate(grid, accelerations(along, grid, scale[:, np.newaxis]))
            stepped = accelerations(along, grid, scale[:, np.newaxis] + _SCALE_STEP)
            more_once, more_twice = _integrate(grid, stepped)
        moved = self.state.copy()
        moved[:, 0] += speed * way + twice[:, 0]
        moved[:, 1] += once[:, 0]
        carry = np.broadcast_to(np.eye(3), (len(way), 3, 3)).copy()
        carry[:, 0, 1] = way
        carry[:, 0, 2] = (more_twice[:, 0] - twice[:, 0]) / _SCALE_STEP
        carry[:, 1, 2] = (more_once[:, 0] - once[:, 0]) / _SCALE_STEP
        return moved, np.einsum("mij,mjk,mlk->mil", carry, self.covariance, carry, optimize=False)


def flight_from_samples(
    samples: Samples, expected: Expected, front: FloatArray, accelerations: Accelerations
) -> Flight:
    """Estimate flights and coming touches of packs with their fronts at `front`, m, from samples.

    `accelerations` maps displacements, m, times, s, and scales, all broadcastable to the shape (M, K), to
    accelerations of a flying armature, m/s².
    """
    times, shown, used, error = samples
    reference = expected.time
    mean = np.stack([front, expected.speed, expected.scale], axis=1)
    state = mean.copy()
    first = np.where(used, times, np.inf).min(axis=1, initial=np.inf)
    first = np.minimum(np.where(np.isfinite(first), first, reference), reference)
    grid = reference[:, np.newaxis] + np.linspace(-1.0, 0.0, _NODES) * (reference - first)[:, np.newaxis]
    curve = np.zeros_like(grid)
    tau = np.where(used, times - reference[:, np.newaxis], 0.0)
    ways = [np.ones_like(grid), grid - reference[:, np.newaxis]]
    span = np.maximum(-ways[1][:, 0], _SHORTEST)
    quick = _STEP * np.maximum(np.abs(expected.speed), _SLOWEST)
    steps = [(quick * span)[:, np.newaxis], quick[:, np.newaxis]]
    scale_step = np.full((len(reference), 1), _SCALE_STEP)
    prior = np.asarray(np.linalg.inv(expected.covariance), np.float64)
    precision = prior

    def bent(straight: FloatArray, curve: FloatArray, scale: FloatArray) -> FloatArray:
        for _ in range(_BENDS):
            curve = _integrate(grid, accelerations(straight + curve, grid, scale))[1]
        return curve

    for _ in range(_ROUNDS):
        scale = state[:, 2:]
        straight = state[:, :1] + state[:, 1:2] * ways[1]
        # The acceleration depends on the path: Picard iteration.
        curve = bent(straight, curve, scale)
        others = [bent(straight + step * way, curve, scale) for way, step in zip(ways, steps, strict=True)]
        others.append(bent(straight, curve, scale + scale_step))
        slopes = [
            _interpolate(grid, (other - curve) / step, times)
            for other, step in zip(others, [*steps, scale_step], strict=True)
        ]
        slopes[0] += 1.0
        slopes[1] += tau
        rest = shown - state[:, :1] - state[:, 1:2] * tau - _interpolate(grid, curve, times)
        step, precision = least_squares(slopes, rest, used / error**2, prior, mean - state)
        state = state + step
    place, speed, scale = state.T
    speed = np.maximum(speed, _SLOWEST)
    bend = accelerations(front[:, np.newaxis], reference[:, np.newaxis], scale[:, np.newaxis])[:, 0]
    late = np.zeros_like(place)
    for _ in range(_ROUNDS):
        late = (front - place - 0.5 * bend * late**2) / speed
    covariance = np.asarray(np.linalg.inv(precision), np.float64)
    return Flight(reference + late, speed + bend * late, scale, reference, state, covariance)


def least_squares(
    slopes: Sequence[FloatArray],
    rest: FloatArray,
    weight: FloatArray,
    prior: FloatArray,
    expected: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Compute the weighted least-squares step with a prior, and its precision matrix (Gauss-Newton).

    For M runs, `slopes` are the derivatives of N samples with respect to each of U unknowns, each of shape
    (M, N); `rest` are the residuals and `weight` the weights, 0 for unused samples, of the same shape. The
    prior is a step `expected`, shape (M, U), with the precision `prior`, shape (M, U, U). The returned
    precision is the inverse of the covariance of the step.
    """
    precision, pull = prior.copy(), np.empty(expected.shape)
    # Explicit sums, so that a run's bits do not depend on the other runs, as they may in a matrix product.
    for i, slope in enumerate(slopes):
        pull[:, i] = (prior[:, i] * expected).sum(axis=1)
        pull[:, i] += np.where(weight > 0.0, weight * slope * rest, 0.0).sum(axis=1)
        for j, other in enumerate(slopes):
            precision[:, i, j] += np.where(weight > 0.0, weight * slope * other, 0.0).sum(axis=1)
    step = np.linalg.solve(precision, pull[..., np.newaxis])[..., 0]
    return np.asarray(step, np.float64), precision


def _integrate(grid: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Integrate rows once and twice by the trapezoidal rule on equal steps, backwards from the last time."""
    step = (grid[:, -1:] - grid[:, :1]) / (grid.shape[1] - 1)

    def backwards(integrand: FloatArray) -> FloatArray:
        pieces = 0.5 * (integrand[:, 1:] + integrand[:, :-1]) * step
        summed = np.cumsum(pieces[:, ::-1], axis=1)[:, ::-1]
        return -np.concatenate([summed, np.zeros((len(grid), 1))], axis=1)

    once = backwards(values)
    return once, backwards(once)


def _interpolate(grid: FloatArray, values: FloatArray, times: FloatArray) -> FloatArray:
    """Interpolate rows over evenly spaced times linearly; arguments beyond the ends are clipped."""
    count = grid.shape[1] - 1
    span = np.maximum(grid[:, -1:] - grid[:, :1], 1e-300)
    place = np.clip((times - grid[:, :1]) / span, 0.0, 1.0) * count
    below = np.minimum(place.astype(np.int64), count - 1)
    row = np.arange(len(grid))[:, np.newaxis]
    return blend(values[row, below], values[row, below + 1], place - below)
