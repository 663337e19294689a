"""Estimates from readings, against functions with a known answer."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from printhammer.control.learning.belief import Belief, Evidence, believe
from printhammer.control.learning.learner import mean
from printhammer.control.learning.lines import Surrogate
from printhammer.support.threads import answered

Readings = Callable[[np.ndarray], np.ndarray]
SIZE = 4
RNG = np.random.default_rng(3)
SLOPES = RNG.standard_normal((12, SIZE))


def linear(rows: np.ndarray) -> np.ndarray:
    return np.asarray(rows @ SLOPES.T)


def bent(rows: np.ndarray) -> np.ndarray:
    """Oscillating readings: a search that starts far away is trapped in a local minimum."""
    flat = rows @ SLOPES.T
    return np.asarray(flat + 0.8 * np.sin(4.0 * flat) * (np.arange(12) >= 6))


def believed(readings: Readings, evidence: Evidence, *places: list[np.ndarray]) -> Belief:
    """Return the estimate for readings that are a function of constants."""
    return answered(believe(evidence, *places), lambda asked: [readings(rows) for rows in asked])


def evidence(value: np.ndarray, noise: float, rough: float = 0.0) -> Evidence:
    return Evidence(value, np.full(value.size, noise), np.full(value.size, rough))


@given(st.lists(st.floats(-2.0, 2.0), min_size=SIZE, max_size=SIZE))
def test_constants_are_found_where_readings_are_exact(truth: list[float]) -> None:
    belief = believed(linear, evidence(linear(np.array([truth]))[0], 1e-3), [np.zeros(SIZE)]).modes[0]
    assert belief.mean == pytest.approx(np.array(truth), abs=2e-2)
    assert belief.level == 0.0


def test_little_is_known_from_readings_that_are_mostly_noise() -> None:
    """Only the prior remains: standard deviations of 1."""
    belief = believed(linear, evidence(np.zeros(12), 1e3), [np.zeros(SIZE)]).modes[0]
    assert belief.mean == pytest.approx(np.zeros(SIZE), abs=1e-3)
    assert belief.covariance == pytest.approx(np.eye(SIZE), abs=1e-3)


def test_the_covariance_is_that_of_linear_regression() -> None:
    """For small errors, Student's t with 4 degrees of freedom is normal with 4/5 of the variance."""
    noise = 0.1
    belief = believed(linear, evidence(np.zeros(12), noise), [np.zeros(SIZE)]).modes[0]
    expected = np.linalg.inv(np.eye(SIZE) + SLOPES.T @ SLOPES * 1.25 / noise**2)
    assert belief.covariance == pytest.approx(expected, rel=1e-6)


def test_one_reading_that_is_wrong_counts_for_little() -> None:
    truth = np.array([0.5, -1.0, 0.2, 0.8])
    value = linear(truth[None])[0]
    value[3] += 100.0
    belief = believed(linear, evidence(value, 0.01), [np.zeros(SIZE)]).modes[0]
    assert belief.mean == pytest.approx(truth, abs=0.03)


def test_what_is_left_of_readings_is_their_misfit() -> None:
    """The misfit is about 1 if law and noise are correct; outliers count as five standard deviations."""
    truth = np.array([0.5, -1.0, 0.2, 0.8])
    noise = 0.01 * np.random.default_rng(2).standard_normal(12)
    holds = believed(linear, evidence(linear(truth[None])[0] + noise, 0.01), [np.zeros(SIZE)]).modes[0]
    assert 0.4 < holds.misfit < 1.5
    # Alternating errors of 0.2 are not in the span of four slopes.
    other = linear(truth[None])[0] + 0.2 * (-1.0) ** np.arange(12)
    assert believed(linear, evidence(other, 0.01), [np.zeros(SIZE)]).modes[0].misfit > 3.0


def test_readings_that_bend_are_followed_from_level_to_level() -> None:
    truth = np.array([0.9, -1.1, 0.4, -0.6])
    value = bent(truth[None])[0]
    rough = np.where(np.arange(12) >= 6, 0.6, 0.0)
    belief = believed(bent, Evidence(value, np.full(12, 0.01), rough), [np.zeros(SIZE)]).modes[0]
    assert belief.mean == pytest.approx(truth, abs=0.05)
    assert belief.level == 0.0


def test_a_dot_that_nobody_saw_counts_for_nothing() -> None:
    truth = np.array([0.5, -1.0, 0.2, 0.8])
    value = linear(truth[None])[0]
    value[[1, 7]] = np.nan
    mode = believed(linear, evidence(value, 1e-3), [np.zeros(SIZE)]).modes[0]
    assert mode.mean == pytest.approx(truth, abs=0.02)


def test_two_ways_to_explain_readings_are_both_believed_in() -> None:
    """The square of a constant determines its magnitude, but not its sign."""

    def squared(rows: np.ndarray) -> np.ndarray:
        return np.asarray(rows**2)

    value = np.array([1.0, 0.25])
    starts = [np.array([0.8, 0.3]), np.array([-0.8, 0.3]), np.array([0.9, 0.3])]
    belief = believed(squared, evidence(value, 0.01), starts)
    assert len(belief.modes) == 2
    assert belief.weights == pytest.approx(np.array([0.5, 0.5]), rel=0.15)
    assert sorted(mode.mean[0] for mode in belief.modes) == pytest.approx([-1.0, 1.0], abs=0.02)
    drawn = belief.draw(20, 1)[:, 0]
    assert (drawn > 0.0).sum() == 10
    later = believed(squared, evidence(value, 0.01), starts, [mode.mean for mode in belief.modes])
    assert len(later.modes) == 2


@given(st.integers(0, 2**32 - 1))
def test_a_surrogate_of_a_quadratic_function_is_the_function(seed: int) -> None:
    rng = np.random.default_rng(seed)
    slope, curvature = rng.standard_normal(3), rng.standard_normal((3, 3))
    curvature = curvature + curvature.T

    def value(rows: np.ndarray) -> np.ndarray:
        return np.asarray(0.7 + rows @ slope + 0.5 * np.einsum("mi,ij,mj->m", rows, curvature, rows))

    rows = rng.standard_normal((200, 3))
    values = value(rows)
    values[5] = np.nan
    made = Surrogate.of(rows, values)
    there = rng.standard_normal((4, 3))
    assert made.value(there) == pytest.approx(value(there), abs=1e-3)
    assert made.gradient(there) == pytest.approx(slope + there @ curvature, abs=1e-3)
    assert made.rest < 1e-3


def test_means_leave_out_what_lies_apart() -> None:
    rng = np.random.default_rng(1)
    readings = [0.1 * rng.standard_normal((1, 3)) for _ in range(20)]
    readings[4][0, 1] += 50.0
    readings[5][0, 2] = np.nan
    found = mean(readings, np.array([[0.1]]))
    assert np.abs(found.value).max() < 0.1
    assert found.seen.tolist() == [[20.0, 19.0, 19.0]]
    nothing = mean([np.full((1, 2), np.nan)] * 4, np.array([[0.1]]))
    assert np.isnan(nothing.value).all()
