"""Observer: model-based estimates of the armature's state in flight and at the next contact.

In flight the acceleration is that of magnet and spring, a known function of displacement and current. Three
numbers are unknown: displacement X and speed V at a reference time, and the relative deviation s of all
currents from nominal, e.g. with another supply. With c the twice integrated acceleration, x = X + V tau +
c(tau; s). This expression is linear in X and V and nearly linear in s, so a few Gauss-Newton steps, with the
expectation as a prior, give the maximum a posteriori estimate.

Contacts serve to estimate two constants recursively: the position of the pack's front and the current scale.
The front may be farther away than nominal by a distance f, and all currents may deviate from nominal by a
relative scale s. Both are constant or drift slowly from dot to dot, whereas the noise is independent. Both
are estimated as in a Kalman filter (R. E. Kalman, J. Basic Eng. 82 (1960) 35): each dot updates mean and
standard deviation, and process noise inflates the standard deviation between dots, so that old data are
forgotten.

A flight observes s, since a larger current accelerates more. A contact observes f: the state before the touch
is known from the flight, and the deceleration, turning and rebound show where the pack is. A simulation of
the nominal hammer predicts the samples of the contact, and perturbed simulations give their derivatives with
respect to displacement and speed before it, f and s; one Gauss-Newton step then estimates all four. A weak
supply is not mistaken for a distant pack, since both are unknowns of the same fit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.feedback.impact_map import bilinear, blend
from printhammer.control.feedback.plant import Loop, Plant, Touched
from printhammer.control.feedback.sensor import Samples
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.static_force import StaticForce
from printhammer.run.ensemble import DISPLAY_TOLERANCE, Ensemble
from printhammer.support.arrays import FloatArray

if TYPE_CHECKING:
    Accelerations = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]

_ROUNDS: Final = 3  # Iterations of path integration, of the fit, and of the touch time; arbitrary
_NODES: Final = 65  # Number of time nodes of a flight path; arbitrary
_SLOWEST: Final = 1e-2  # Smallest speed of a touch, m/s; arbitrary
_SHORTEST: Final = 1e-6  # Shortest flight, s; arbitrary
# Finite-difference steps: relative speed, and current scale; arbitrary
_STEP: Final = 0.01
_SCALE_STEP: Final = 0.02  # Finite-difference step of the current scale; arbitrary
_BENDS: Final = 2  # Number of Picard iterations of the path per fit; arbitrary
_PLACES, _CURRENTS = 97, 129  # Grid size of the force table: displacements, currents; arbitrary


class FreeForce:
    """Force of magnet and spring, N, interpolated in a table over displacement and current.

    The table covers displacements from `low` to `high` [m] and currents up to `largest` [A] of either sign.
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
        """Interpolate the force [N] at displacements [m] and currents [A], clipped to the table's range."""
        row = np.clip((x - self._low) / (self._high - self._low), 0.0, 1.0) * (_PLACES - 1)
        column = np.clip(0.5 + 0.5 * current / self._largest, 0.0, 1.0) * (_CURRENTS - 1)
        i = np.minimum(row.astype(np.int64), _PLACES - 2)
        j = np.minimum(column.astype(np.int64), _CURRENTS - 2)
        return bilinear(self._table, i, row - i, j, column - j)


@dataclass(frozen=True)
class Expected:
    """Predicted time, speed and current scale of M runs at their next pack contacts, before new samples.

    `time` [s] and `speed` [m/s] describe the contacts; `scale` is the relative deviation of all currents
    from nominal. `covariance` is the prior covariance of the displacement [m] at `time`, the speed [m/s] and
    the scale, shape (M, 3, 3).
    """

    time: FloatArray
    speed: FloatArray
    scale: FloatArray
    covariance: FloatArray


@dataclass(frozen=True)
class Flight:
    """Flights estimated from sensor samples: states, covariances, and the predicted pack contacts."""

    # Time, s, and speed, m/s, of the coming touch, (M,)
    touch: FloatArray
    speed: FloatArray
    scale: FloatArray  # Relative deviation of all currents from nominal, (M,)
    reference: FloatArray  # Reference time of `state` and `covariance`, s, (M,)
    # Displacement, m, speed, m/s, and scale, (M, 3), and their covariance, (M, 3, 3)
    state: FloatArray
    covariance: FloatArray

    def at(self, time: FloatArray, accelerations: Accelerations) -> tuple[FloatArray, FloatArray]:
        """Return the states, shape (M, 3), and covariances, (M, 3, 3), propagated in flight to `time` [s].

        `accelerations` is as for `flight_from_samples`.
        """
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
    """Estimate flights from sensor samples; predict the next contact with the pack at `front` [m].

    `accelerations` returns the accelerations of the armature in flight [m/s²] for displacements [m], times
    [s] and relative deviations of the current from nominal, for M runs and K times per run.
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
    """Compute the Gauss-Newton step of a weighted least-squares fit with a prior, and its precision matrix.

    M runs with N samples each are fitted, with U unknowns per run. `slopes` contains the derivatives of the
    samples with respect to each unknown, U arrays of shape (M, N). `rest` contains the residuals and `weight`
    the weights of the samples, both of shape (M, N); the weight of an unused sample is 0. The prior is a step
    `expected`, shape (M, U), with the precision `prior`, shape (M, U, U). The returned precision is the
    inverse of the covariance of the step.
    """
    precision, pull = prior.copy(), np.empty(expected.shape)
    # Explicit sums: in a matrix product, the last bits of a run may depend on the other runs.
    for i, slope in enumerate(slopes):
        pull[:, i] = (prior[:, i] * expected).sum(axis=1)
        pull[:, i] += np.where(weight > 0.0, weight * slope * rest, 0.0).sum(axis=1)
        for j, other in enumerate(slopes):
            precision[:, i, j] += np.where(weight > 0.0, weight * slope * other, 0.0).sum(axis=1)
    step = np.linalg.solve(precision, pull[..., np.newaxis])[..., 0]
    return np.asarray(step, np.float64), precision


def _integrate(grid: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Integrate each row of `values` over time, once and twice, by the trapezoidal rule.

    `grid` contains the times [s]; the integrals vanish at the last time of each row.
    """
    step = (grid[:, -1:] - grid[:, :1]) / (grid.shape[1] - 1)

    def backwards(integrand: FloatArray) -> FloatArray:
        pieces = 0.5 * (integrand[:, 1:] + integrand[:, :-1]) * step
        summed = np.cumsum(pieces[:, ::-1], axis=1)[:, ::-1]
        return -np.concatenate([summed, np.zeros((len(grid), 1))], axis=1)

    once = backwards(values)
    return once, backwards(once)


def _interpolate(grid: FloatArray, values: FloatArray, times: FloatArray) -> FloatArray:
    """Interpolate each row of `values` linearly at `times` [s]; times outside the grid are clipped.

    `grid` contains the evenly spaced times [s] at which the values are given.
    """
    count = grid.shape[1] - 1
    span = np.maximum(grid[:, -1:] - grid[:, :1], 1e-300)
    place = np.clip((times - grid[:, :1]) / span, 0.0, 1.0) * count
    below = np.minimum(place.astype(np.int64), count - 1)
    row = np.arange(len(grid))[:, np.newaxis]
    return blend(values[row, below], values[row, below + 1], place - below)


# Standard deviation of the model error of a contact, as a fraction of the stroke; arbitrary
_MODEL_ERROR: Final = 0.003
_GRID: Final = 1.0 / 128.0  # Spacing of the simulated pack fronts, as a fraction of the stroke; arbitrary
# Finite-difference steps: front in grid steps, current scale, displacement as a fraction of the stroke, speed
# in m/s; arbitrary
_FRONT_STEPS: Final = 4
_FACTOR_STEP: Final = 0.03  # Finite-difference step of the current scale; arbitrary
_PLACE_STEP: Final = 0.005
"""Finite-difference step of the displacement, as a fraction of the stroke; arbitrary."""
_SPEED_STEP: Final = 0.02  # Finite-difference step of the speed, m/s; arbitrary
# Mean squared normalised residual above which a contact is rejected; arbitrary
_STRANGE: Final = 9.0


class Contacts:
    """Observer that estimates the position of the pack front from sensor samples of pack contacts.

    The contacts are simulated with the nominal hammer, at several distances of the pack.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._shifted = {0: plant.hammer}

    def learn(self, loops: Sequence[Loop], samples: Samples) -> None:
        """Update each run's estimates of pack front and current scale from samples of its latest contact."""
        stroke = self._plant.stroke
        touches = [loop.touched for loop in loops if loop.touched is not None]
        places = [round(loop.learned.front / _GRID) for loop in loops]
        base = np.array([touched.state for touched in touches])
        steps = np.array([_PLACE_STEP * stroke, _SPEED_STEP, _FRONT_STEPS * _GRID, _FACTOR_STEP])
        runs = self._runs(loops, touches, places, steps, samples)
        counts = samples.used & np.isfinite(runs).all(axis=0)
        runs = np.where(counts, runs, 0.0)
        slopes = [(run - runs[0]) / step for run, step in zip(runs[1:], steps.tolist(), strict=True)]
        prior = np.zeros((len(loops), 4, 4))
        states = [0, 1, 3]
        prior[np.ix_(range(len(loops)), states, states)] = np.linalg.inv(
            np.array([touched.covariance for touched in touches])
        )
        prior[:, 2, 2] = np.array([loop.learned.front_error for loop in loops]) ** -2.0
        expected = np.zeros((len(loops), 4))
        expected[:, 2] = [
            loop.learned.front - place * _GRID for loop, place in zip(loops, places, strict=True)
        ]
        # The simulations use nominal currents.
        expected[:, 3] = base[:, 2]
        spread = np.hypot(samples.error, _MODEL_ERROR * stroke)
        rest = np.where(counts, samples.shown - runs[0], 0.0)
        fitted, precision = least_squares(slopes, rest, counts / spread**2, prior, expected)
        left = rest - sum(slope * fitted[:, [k]] for k, slope in enumerate(slopes))
        number = counts.sum(axis=1)
        strange = np.where(counts, left**2, 0.0).sum(axis=1) > _STRANGE * spread**2 * number
        variances = np.diagonal(np.linalg.inv(precision), axis1=1, axis2=2)
        for k, loop in enumerate(loops):
            loop.touched = None
            if number[k] == 0 or strange[k]:
                continue
            loop.learned.take_front(places[k] * _GRID + float(fitted[k, 2]), float(variances[k, 2]))
            loop.learned.take_scale(float(fitted[k, 3]), float(variances[k, 3]))

    def _runs(
        self,
        loops: Sequence[Loop],
        touches: Sequence[Touched],
        places: Sequence[int],
        steps: FloatArray,
        samples: Samples,
    ) -> FloatArray:
        """Simulate the latest contact of each of M runs with nominal and with perturbed constants.

        `places` are the estimated pack fronts, in steps of `_GRID`; `steps` are the changes of displacement
        [m], speed [m/s], pack front [strokes] and current scale in the four perturbed simulations. Returns
        the displacements [m] at the N sample times, shape (5, M, N), the nominal simulation first.
        """
        hammers, drives, states, strobes = [], [], [], []
        plain = [loop.recent(self._plant.driver) for loop in loops]
        stronger = [drive.scaled(1.0 + _FACTOR_STEP) for drive in plain]
        for number in range(5):
            for k, (touched, place) in enumerate(zip(touches, places, strict=True)):
                hammers.append(self._with_front(place + _FRONT_STEPS if number == 3 else place))
                drives.append(stronger[k] if number == 4 else plain[k])
                x, v = touched.state[:2].tolist()
                states.append(
                    (x + (steps[0] if number == 1 else 0.0), v + (steps[1] if number == 2 else 0.0))
                )
                strobes.append(samples.times[k][samples.used[k]])
        result = Ensemble(
            hammers,
            drives,
            np.tile([touched.end for touched in touches], 5),
            states=np.array(states),
            starts=np.tile([touched.start for touched in touches], 5),
            tolerance=DISPLAY_TOLERANCE,
        ).run(strobes=strobes, threads=self._plant.threads)
        assert result.strobes is not None
        whole = np.full((5, *samples.times.shape), np.nan)
        for row, x in enumerate(result.strobes.x):
            number, k = divmod(row, len(loops))
            whole[number, k, samples.used[k]] = x[: int(samples.used[k].sum())]
        return whole

    def _with_front(self, place: int) -> Hammer:
        """Return the nominal hammer with its pack moved away by `place` steps of `_GRID`; cached."""
        if place not in self._shifted:
            self._shifted[place] = self._plant.moved(place * _GRID).hammer
        return self._shifted[place]
