"""The estimators of feedback against textbook Kalman filters, implemented here with NumPy alone.

R. E. Kalman, J. Basic Eng. 82 (1960) 35; the measurement update in the form of Joseph.
"""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests import hammers

from printhammer.control.feedback.flight import (
    Expected,
    Flight,
    FreeForce,
    flight_from_samples,
    least_squares,
)
from printhammer.control.feedback.sensor import Samples
from printhammer.hammer.static_force import StaticForce

Array = npt.NDArray[np.float64]


def updated(mean: Array, covariance: Array, row: Array, shown: float, variance: float) -> tuple[Array, Array]:
    """Return the measurement update of a Kalman filter by one number."""
    gain = covariance @ row / (row @ covariance @ row + variance)
    keep = np.eye(len(mean)) - np.outer(gain, row)
    return mean + gain * (shown - row @ mean), keep @ covariance @ keep.T + variance * np.outer(gain, gain)


def covariance_of(rng: np.random.Generator, count: int) -> Array:
    square = rng.normal(size=(count, count))
    return square @ square.T + 0.1 * np.eye(count)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.integers(0, 12), st.integers(1, 3))
def test_least_squares_are_a_kalman_filter_of_a_state_that_stands(
    seed: int, unknowns: int, count: int, runs: int
) -> None:
    rng = np.random.default_rng(seed)
    slopes = rng.normal(size=(unknowns, runs, count))
    shown, errors = rng.normal(size=(runs, count)), rng.uniform(0.05, 2.0, (runs, count))
    used = rng.random((runs, count)) < 0.7
    means = rng.normal(size=(runs, unknowns))
    covariances = np.array([covariance_of(rng, unknowns) for _ in range(runs)])
    # What is not used may be anything.
    rest = np.where(used, shown, np.nan)
    step, precision = least_squares(
        list(slopes), rest, np.where(used, errors**-2.0, 0.0), np.linalg.inv(covariances), means
    )
    for run in range(runs):
        mean, covariance = means[run], covariances[run]
        # In any order.
        for k in rng.permutation(np.flatnonzero(used[run])):
            variance = float(errors[run, k] ** 2)
            mean, covariance = updated(mean, covariance, slopes[:, run, k], float(shown[run, k]), variance)
        np.testing.assert_allclose(step[run], mean, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(np.linalg.inv(precision[run]), covariance, rtol=1e-8, atol=1e-9)


PULL = 9e3
"""Acceleration away from the pack at nominal currents, m/s^2."""
FRONT, TOUCH, SPEED, STEP = 2e-4, 6e-4, 0.9, 2e-6
NODES = 64
"""Intervals of the path; samples at its nodes are met without interpolation."""


def pulled(x: Array, _t: Array, scale: Array) -> Array:
    return -PULL * (1.0 + scale) + np.zeros_like(x)


def carried(mean: Array, covariance: Array, time: float) -> tuple[Array, Array]:
    """Return the time update, x + v t - (1 + s) PULL t^2 / 2 and its speed."""
    matrix = np.array([[1.0, time, -0.5 * PULL * time**2], [0.0, 1.0, -PULL * time], [0.0, 0.0, 1.0]])
    drift = -PULL * np.array([0.5 * time**2, time, 0.0])
    return matrix @ mean + drift, matrix @ covariance @ matrix.T


def filtered(times: Array, shown: Array, error: float, prior: Array) -> tuple[Array, Array]:
    """Run a textbook filter back to the first sample, through all samples, and on to the expected touch."""
    mean, covariance, now = np.array([FRONT, SPEED, 0.0]), prior, TOUCH
    for time, each in zip(times, shown, strict=True):
        mean, covariance = carried(mean, covariance, time - now)
        now = float(time)
        mean, covariance = updated(mean, covariance, np.array([1.0, 0.0, 0.0]), float(each), error**2)
    return carried(mean, covariance, TOUCH - now)


def estimated(times: Array, shown: Array, error: float, prior: Array) -> Flight:
    samples = Samples(times[np.newaxis], shown[np.newaxis], np.ones((1, len(times)), np.bool_), error)
    one = np.ones(1)
    expected = Expected(TOUCH * one, SPEED * one, 0.0 * one, prior[np.newaxis])
    return flight_from_samples(samples, expected, FRONT * one, pulled)


@pytest.mark.parametrize("seed", range(8))
def test_a_flight_under_a_steady_force_is_that_of_a_kalman_filter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    error = 1.5e-6
    prior = np.diag([4e-6, 0.05, 0.03]) ** 2
    prior[0, 1] = prior[1, 0] = rng.uniform(-0.9, 0.9) * np.sqrt(prior[0, 0] * prior[1, 1])
    true = rng.multivariate_normal([FRONT, SPEED, 0.0], prior)
    # The first sample decides where the path begins; of the others some are missing.
    number = np.append(0, np.sort(rng.choice(np.arange(1, 54), 40, replace=False)))
    times = TOUCH + STEP * (number - NODES)
    late = times - TOUCH
    shown = true[0] + true[1] * late - 0.5 * PULL * (1.0 + true[2]) * late**2
    shown = shown + error * rng.normal(size=len(times))
    mean, covariance = filtered(times, shown, error, prior)
    found = estimated(times, shown, error, prior)
    scales = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose((found.state[0] - mean) / scales, 0.0, atol=1e-6)
    sizes = np.outer(scales, scales)
    np.testing.assert_allclose(found.covariance[0] / sizes, covariance / sizes, atol=1e-6)
    # The touch: where the parabola from there meets the front.
    place, speed, scale = mean
    pull = -PULL * (1.0 + scale)
    root = np.sqrt(speed**2 + 2.0 * pull * (FRONT - place))
    after = 2.0 * (FRONT - place) / (speed + root)
    # Three iterations, of which each leaves so much of the error; the first one has half of it.
    left = abs(after) * abs(pull * after / speed) ** 3 + 1e-13
    assert found.touch[0] == pytest.approx(TOUCH + after, abs=left)
    assert found.speed[0] == pytest.approx(root, abs=-pull * left + 1e-9)
    # And the state at any other time, with its covariance.
    for time in (TOUCH - 9e-5, TOUCH + 2e-5):
        state, spread = found.at(np.array([time]), pulled)
        exact, wide = carried(mean, covariance, time - TOUCH)
        size = np.sqrt(np.diag(wide))
        np.testing.assert_allclose((state[0] - exact) / size, 0.0, atol=1e-5)
        np.testing.assert_allclose(spread[0] / np.outer(size, size), wide / np.outer(size, size), atol=1e-6)


def test_without_samples_the_expectation_stands() -> None:
    prior = np.diag([4e-6, 0.05, 0.03]) ** 2
    none = Samples(np.full((1, 3), 5e-4), np.zeros((1, 3)), np.zeros((1, 3), np.bool_), 1e-6)
    one = np.ones(1)
    expected = Expected(TOUCH * one, SPEED * one, 0.02 * one, prior[np.newaxis])
    found = flight_from_samples(none, expected, FRONT * one, pulled)
    assert found.touch[0] == pytest.approx(TOUCH, abs=1e-12)
    assert found.speed[0] == pytest.approx(SPEED)
    assert found.scale[0] == pytest.approx(0.02)
    np.testing.assert_allclose(found.covariance[0], prior, rtol=1e-9)


def test_the_estimate_is_as_far_off_as_it_says() -> None:
    """Squared errors, weighted by the inverse covariance, follow a chi-squared distribution."""
    rng = np.random.default_rng(4)
    runs, error = 600, 1.5e-6
    prior = np.diag([4e-6, 0.05, 0.03]) ** 2
    true = rng.multivariate_normal([FRONT, SPEED, 0.0], prior, runs)
    times = np.broadcast_to(TOUCH + STEP * (np.arange(54) - NODES), (runs, 54))
    late = times - TOUCH
    shown = true[:, :1] + true[:, 1:2] * late - 0.5 * PULL * (1.0 + true[:, 2:]) * late**2
    shown = shown + error * rng.normal(size=shown.shape)
    expected = Expected(
        np.full(runs, TOUCH), np.full(runs, SPEED), np.zeros(runs), np.broadcast_to(prior, (runs, 3, 3))
    )
    used = np.ones(shown.shape, np.bool_)
    found = flight_from_samples(Samples(times, shown, used, error), expected, np.full(runs, FRONT), pulled)
    away = found.state - true
    squares = np.einsum("mi,mij,mj->m", away, np.linalg.inv(found.covariance), away)
    # Of 3 unknowns the mean is 3 and the variance 6.
    assert abs(squares.mean() - 3.0) < 4.0 * np.sqrt(6.0 / runs)
    assert abs(squares.var() - 6.0) < 4.0 * np.sqrt(8.0 * 36.0 / runs)


@given(st.floats(0.0, 1.0), st.floats(-1.0, 1.0))
def test_the_table_of_forces_is_the_force(share: float, part: float) -> None:
    hammer = hammers.crude()
    assert hammer.front is not None
    low, high, largest = hammer.origin, hammer.front, 2.5
    table, exact = _table(), StaticForce(hammer)
    x, current = low + share * (high - low), part * largest
    # Interpolation is off by an eighth of the square of a step by the curvature, here from differences.
    dx, di = (high - low) / 96.0, 2.0 * largest / 128.0
    x0 = low + dx * np.clip(np.floor((x - low) / dx), 0, 95)
    i0 = -largest + di * np.clip(np.floor((current + largest) / di), 0, 127)
    corners = [exact.free(x0 + a * dx, i0 + b * di) for a in (0, 1) for b in (0, 1)]
    centre = exact.free(x0 + 0.5 * dx, i0 + 0.5 * di)
    bound = 2.0 * abs(centre - np.mean(corners)) + 1e-9
    found = float(table(np.array([x]), np.array([current]))[0])
    assert found == pytest.approx(exact.free(x, current), abs=bound)
    assert min(corners) - 1e-12 <= found <= max(corners) + 1e-12


def test_beyond_the_table_the_force_is_that_of_its_edge() -> None:
    hammer = hammers.crude()
    assert hammer.front is not None
    table, exact = _table(), StaticForce(hammer)
    x = np.array([hammer.origin - 1e-4, hammer.front + 1e-4, hammer.front])
    current = np.array([0.3, 3.0, -9.0])
    edge = [(hammer.origin, 0.3), (hammer.front, 2.5), (hammer.front, -2.5)]
    np.testing.assert_allclose(table(x, current), [exact.free(*each) for each in edge], rtol=1e-4)


def _table() -> FreeForce:
    hammer = hammers.crude()
    assert hammer.front is not None
    return FreeForce(hammer, hammer.origin, hammer.front, 2.5)
