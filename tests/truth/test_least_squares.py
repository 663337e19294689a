"""The machinery of the fits against closed forms."""

import itertools

import numpy as np
import pytest

from printhammer.identify.least_squares import sandwich, variance_of
from printhammer.identify.result import FittedConstant, student
from printhammer.identify.static.assemble import runs_p_value


def test_the_sandwich_of_a_mean() -> None:
    """For one mean, HC2 is s^2 / n and has n - 1 degrees of freedom, whatever the data."""
    data = np.random.default_rng(0).standard_normal(17)
    covariance, freedoms = sandwich(np.ones((17, 1)), data - data.mean())
    assert covariance[0, 0] == pytest.approx(data.var(ddof=1) / 17, rel=1e-12)
    assert freedoms[0] == pytest.approx(16.0, rel=1e-12)


def test_the_sandwich_of_two_groups_is_that_of_welch() -> None:
    """The difference of two means of unequal noise: s1^2 / n1 + s2^2 / n2 (B. L. Welch, 1938)."""
    rng = np.random.default_rng(1)
    groups = np.array([0.0] * 5 + [1.0] * 40)
    data = np.where(groups > 0, rng.standard_normal(45), 5.0 * rng.standard_normal(45))
    means = np.array([data[groups == group].mean() for group in (0, 1)])
    errors = data - means[groups.astype(int)]
    covariance, freedoms = sandwich(np.column_stack([np.ones(45), groups]), errors)
    expected = sum(data[groups == group].var(ddof=1) / (groups == group).sum() for group in (0, 1))
    assert covariance[1, 1] == pytest.approx(expected, rel=1e-12)
    # Bell and McCaffrey's freedom for equal variances of the noise, by the formula of Satterthwaite.
    parts = np.array([1 / 5, 1 / 40])
    assert freedoms[1] == pytest.approx(parts.sum() ** 2 / (parts**2 / [4, 39]).sum(), rel=1e-12)


def test_the_sandwich_does_not_depend_on_the_scale_of_a_parameter() -> None:
    rng = np.random.default_rng(2)
    rows, errors = rng.standard_normal((30, 2)), rng.standard_normal(30)
    plain, freedoms = sandwich(rows, errors)
    scaled, same = sandwich(rows * [1e9, 1e-6], errors)
    np.testing.assert_allclose(scaled * np.outer([1e9, 1e-6], [1e9, 1e-6]), plain, rtol=1e-9)
    np.testing.assert_allclose(same, freedoms, rtol=1e-9)


def test_components_of_the_variance_are_found() -> None:
    rng = np.random.default_rng(3)
    steep = rng.uniform(0.0, 3.0, 20000)
    spread = np.column_stack([np.ones(20000), steep**2, np.zeros(20000)])
    truth = 0.04 + 0.09 * steep**2
    residuals = np.sqrt(truth) * rng.standard_normal(20000)
    used = np.ones(20000, dtype=bool)
    for clipped in (False, True):
        found = variance_of(spread, residuals, used, 3, clipped=clipped)
        np.testing.assert_allclose(found, truth, rtol=0.06)


def test_runs_against_all_orders() -> None:
    """With 8 of either sign, against the share of all orders that have as few runs, or as many."""
    n, above = 16, 8
    counts = []
    for places in itertools.combinations(range(n), above):
        signs = np.full(n, -1.0)
        signs[list(places)] = 1.0
        counts.append(1 + int(np.count_nonzero(signs[1:] != signs[:-1])))
    mean = np.mean(counts)
    assert mean == pytest.approx(2 * above * (n - above) / n + 1)
    for runs in (2, 4, 6):
        # Runs of one sign by turns, the first two as long as it takes.
        lengths = [above - (runs // 2 - 1)] * 2 + [1] * (runs - 2)
        signs = np.concatenate([np.full(size, (-1.0) ** k) for k, size in enumerate(lengths)])
        exact = np.mean(np.abs(np.array(counts) - mean) >= abs(runs - mean) - 1e-9)
        assert runs_p_value(signs) == pytest.approx(exact, abs=0.08)
    assert np.isnan(runs_p_value(np.array([1.0] * 20 + [-1.0] * 7)))


def test_intervals_are_those_of_student() -> None:
    """Quantiles of printed tables."""
    assert student(4) == pytest.approx(2.776, abs=5e-4)
    assert student(30) == pytest.approx(2.042, abs=5e-4)
    assert student(np.inf) == pytest.approx(1.95996, abs=1e-5)
    constant = FittedConstant.of("mass", 2.0, 0.1, 4, "kg")
    assert constant.interval == pytest.approx((2.0 - 0.2776, 2.0 + 0.2776), abs=1e-4)
