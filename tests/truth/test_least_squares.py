"""The least-squares routines of the fits against closed forms."""

import itertools

import numpy as np
import pytest

from printhammer.identify.least_squares import Parameters, sandwich, solve
from printhammer.identify.noise import variance_of
from printhammer.identify.result import FittedConstant, student
from printhammer.identify.static.assemble import ratio_p_value, runs_p_value, stretch_p_value
from printhammer.support.arrays import FloatArray


def test_the_sandwich_of_a_mean() -> None:
    """For one mean, HC2 is s^2 / n with n - 1 degrees of freedom, for any data."""
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


def test_the_sandwich_of_a_row_that_stands_alone() -> None:
    """A row that alone determines a parameter has the noise of the other rows: s^2 (1 + 1 / n)."""
    n = 15
    data = np.random.default_rng(4).standard_normal(n)
    rows = np.column_stack([np.ones(n + 1), np.append(np.zeros(n), 1.0)])
    covariance, freedoms = sandwich(rows, np.append(data - data.mean(), 0.0))
    assert covariance[1, 1] == pytest.approx(data.var(ddof=1) * (1 + 1 / n), rel=1e-12)
    assert freedoms == pytest.approx([n - 1, n - 1], rel=1e-12)


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
    """With 8 of either sign, the p value is near the share of all orders with as few runs or as many."""
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
    """Quantiles from printed tables."""
    assert student(4) == pytest.approx(2.776, abs=5e-4)
    assert student(30) == pytest.approx(2.042, abs=5e-4)
    assert student(np.inf) == pytest.approx(1.95996, abs=1e-5)
    constant = FittedConstant.of("mass", 2.0, 0.1, 4, "kg")
    assert constant.interval == pytest.approx((2.0 - 0.2776, 2.0 + 0.2776), abs=1e-4)


class Line:
    """A law that is linear in its parameters, up to a function of them."""

    def __init__(self, columns: FloatArray, *, product: bool = False) -> None:
        self.columns, self.product = columns, product

    def value(self, p: FloatArray) -> FloatArray:
        return np.asarray(self.columns @ ([p[0] * p[1], *p[2:]] if self.product else p))

    def jacobian(self, p: FloatArray) -> FloatArray:
        if not self.product:
            return self.columns
        first = self.columns[:, :1]
        return np.column_stack([first * p[1], first * p[0], self.columns[:, 1:]])

    def variance_columns(self, p: FloatArray) -> FloatArray:
        return np.ones((len(self.columns), 1))


def noisy_line(seed: int, slope: float) -> tuple[FloatArray, FloatArray]:
    x = np.linspace(-1.0, 1.0, 40)
    columns = np.column_stack([np.ones(40), x])
    return columns, columns @ [2.0, slope] + 0.1 * np.random.default_rng(seed).standard_normal(40)


def test_a_parameter_stays_at_the_bound_to_which_the_data_drive_it() -> None:
    columns, data = noisy_line(5, -3.0)
    space = Parameters.of(np.array([1.0, 1.0]), low=np.array([-np.inf, 0.0]))
    solution = solve(Line(columns), data, space, robust=False)
    assert solution.free.tolist() == [True, False]
    # Without the slope the constant is the mean, with the error of a mean.
    assert solution.p == pytest.approx([data.mean(), 0.0], abs=1e-6)
    assert solution.standard_errors == pytest.approx([data.std(ddof=1) / np.sqrt(40), 0.0], rel=1e-6)


def test_of_two_parameters_that_the_data_do_not_tell_apart_one_is_held() -> None:
    columns, data = noisy_line(6, 1.5)
    start = np.array([1.0, 3.0, 1.0])
    solution = solve(Line(columns, product=True), data, start, robust=False)
    held = np.flatnonzero(~solution.free)
    assert held.size == 1
    assert held[0] < 2
    assert solution.p[held[0]] == start[held[0]]
    expected = np.linalg.lstsq(columns, data, rcond=None)[0]
    assert [solution.p[0] * solution.p[1], solution.p[2]] == pytest.approx(expected, rel=1e-9)


def test_a_parameter_is_held_where_the_noise_hides_what_it_does() -> None:
    columns, data = noisy_line(7, 0.0)
    weak = Line(columns * [1.0, 1e-4])
    solution = solve(weak, data, Parameters.of(np.array([1.0, 5.0]), size=0.0), robust=False)
    assert solution.free.tolist() == [True, False]
    assert solution.p[1] == 5.0
    assert solve(weak, data, np.array([1.0, 5.0]), robust=False).free.all()


def test_what_is_known_beforehand_counts_with_its_error() -> None:
    """The estimate has the mean and variance of a normal posterior, with estimated noise."""
    columns, data = np.ones((4000, 1)), 0.02 + np.random.default_rng(8).standard_normal(4000)
    known = 0.01
    solution = solve(Line(columns), data, Parameters.of(np.zeros(1), deviation=known), robust=False)
    variance = 1.0 / (4000 / data.var() + 1.0 / known**2)
    assert solution.p[0] == pytest.approx(variance * data.sum() / data.var(), rel=1e-2)
    assert solution.standard_errors[0] ** 2 == pytest.approx(variance, rel=0.03)


def test_the_rows_that_hold_a_parameter_are_never_all_left_out() -> None:
    """Five rows of forty hold the step; their readings lie far apart."""
    rng = np.random.default_rng(9)
    step = np.append(np.zeros(35), np.ones(5))
    columns = np.column_stack([np.ones(40), step])
    data = 1.0 + 0.01 * rng.standard_normal(40) + step * np.array([1.0] * 35 + [4.0, -3.0, 9.0, 1.0, -7.0])
    solution = solve(Line(columns), data, np.array([1.0, 0.5]))
    assert solution.used[35:].sum() > 1
    assert solution.standard_errors[1] > 0.1
    # A wrong reading among rows that others hold too is left out.
    data[3] = 50.0
    assert solve(Line(columns), data, np.array([1.0, 0.5])).outliers[3]


def test_the_ratio_of_von_neumann_has_its_probabilities() -> None:
    rng = np.random.default_rng(10)
    p_values = np.array([ratio_p_value(rng.standard_normal(20)) for _ in range(4000)])
    for level in (0.01, 0.05, 0.5):
        assert np.mean(p_values < level) == pytest.approx(level, abs=4 * np.sqrt(level / 4000))
    assert ratio_p_value(np.sin(np.linspace(0.0, 6.0, 20))) < 1e-4
    assert np.isnan(ratio_p_value(np.ones(7)))


def test_rows_left_out_that_follow_one_another() -> None:
    """The rate of false alarms keeps its bound, and six successive outliers of one sign are reported."""
    rng = np.random.default_rng(11)
    fractions = [
        stretch_p_value(np.where(rng.random(60) < 0.1, rng.choice([-1.0, 1.0], 60), 0.0)) < 0.05
        for _ in range(2000)
    ]
    assert np.mean(fractions) < 0.05
    signs = np.zeros(60)
    assert np.isnan(stretch_p_value(signs))
    signs[20:26] = 1.0
    assert stretch_p_value(signs) < 1e-5
    signs[20:26:2] = -1.0
    assert np.isnan(stretch_p_value(signs))
