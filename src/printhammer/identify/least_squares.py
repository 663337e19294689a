"""Least squares as measurements need it: outliers left out, weights from the data, errors that stay honest.

    data = law(p) + noise,   variance of the noise in row i = sum over j of spread[i, j] theta[j]

A robust fit (soft-l1 loss, scale from the median absolute residual) finds the parameters and the components
theta >= 0 of the variance; rows too far off are left out; the rest is fitted by weighted least squares until
rows and weights stay as they are. The covariance is the sandwich HC2, which is right also where the weights
are not, with degrees of freedom of its own for each parameter (R. M. Bell and D. F. McCaffrey, Survey
Methodology 28 (2002) 169; G. W. Imbens and M. Kolesar, Rev. Econ. Stat. 98 (2016) 701).

An error in the abscissa enters as a column of `spread` that is the squared slope of the law (effective
variance: J. Orear, Am. J. Phys. 50 (1982) 912).

What residuals and records say of their noise: its size, its outliers, its memory.
"""

from __future__ import annotations

import math
from typing import Any, Final, Protocol

import numpy as np

from printhammer.results import Declared, part
from printhammer.support.arrays import BoolArray, FloatArray

_MAD: Final = 1.482602218505602
"""Standard deviation of a normal distribution over its median absolute deviation."""
_SPIKE: Final = 10.0
_FAR: Final = 4.5
"""Residuals of more standard deviations are outliers: of 100 000 normal ones, less than one."""
_LONGEST_MEMORY: Final = 8


def robust_scale(values: FloatArray) -> float:
    """Return the standard deviation of normal noise about 0 from its median absolute value."""
    return _MAD * float(np.median(np.abs(values)))


def noise_of_record(values: FloatArray) -> float:
    """Return the standard deviation of the white noise in evenly spaced samples of something smoother.

    From third differences, which leave no parabola; their median does not see outliers or contacts.
    """
    if len(values) < 8:
        return 0.0
    return robust_scale(np.diff(values, 3)) / float(np.sqrt(20.0))


def running_median(values: FloatArray, width: int) -> FloatArray:
    """Return the running median over an odd number of samples; at the ends that of the outermost ones."""
    half = width // 2
    windows = np.lib.stride_tricks.sliding_window_view(values, width)
    first, last = np.median(values[:width]), np.median(values[-width:])
    return np.concatenate([np.full(half, first), np.median(windows, axis=1), np.full(half, last)])


def spikes_of(values: FloatArray, noise: float) -> BoolArray:
    """Return which samples of a record stand out of their neighbours, more than noise and slope explain."""
    middle = running_median(values, 5)
    padded = np.pad(middle, 2, mode="edge")
    return np.abs(values - middle) > _SPIKE * noise + np.abs(padded[4:] - padded[:-4])


def outliers_of(residuals: FloatArray, floor: float) -> BoolArray:
    """Return which residuals of mostly good data are larger than normal noise, or the floor, has them."""
    return np.abs(residuals) > _FAR * max(robust_scale(residuals), floor)


def memory_factor(residuals: FloatArray) -> float:
    """Return by how much the variance of a slow average exceeds that of independent residuals.

    An autoregressive process is fitted (Yule and Walker), its order by the Bayes criterion; the factor is its
    spectrum at frequency 0 over its variance. 1 for white noise.
    """
    count = len(residuals)
    centred = residuals - residuals.mean() if count else residuals
    longest = min(_LONGEST_MEMORY, count // 20)
    if longest < 1 or not centred.any():
        return 1.0
    r = np.array([float(centred[: count - k] @ centred[k:]) for k in range(longest + 1)]) / count
    best, factor = count * np.log(r[0]), 1.0
    error = r[0]
    a = np.zeros(0)
    for order in range(1, longest + 1):
        # Levinson's recursion.
        reflection = (r[order] - a @ r[order - 1 : 0 : -1]) / error if order > 1 else r[1] / error
        a = np.append(a - reflection * a[::-1], reflection)
        error *= 1.0 - reflection * reflection
        if error <= 0.0:
            break
        criterion = count * np.log(error) + order * np.log(count)
        if criterion < best:
            best, factor = criterion, error / (1.0 - a.sum()) ** 2 / r[0]
    return float(factor)


_FALSE_OUTLIERS: Final = 0.01
"""How many rows of good data with normal noise are left out, on average, in one fit."""

_CLIP: Final = 2.5
"""Residuals count as no larger than this, in standard deviations, while the outliers are not known."""

_EXACT: Final = 1e-11
"""Residuals below this part of the data are rounding, not noise."""

_ROUNDS: Final = 30


class Law(Protocol):
    """What is fitted: data as a function of parameters."""

    def value(self, p: FloatArray) -> FloatArray:
        """Return the data that the law expects, shape (m,)."""

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Return their derivatives by the parameters, shape (m, n)."""

    def spread(self, p: FloatArray) -> FloatArray:
        """Return how much each component of the variance has in each row, shape (m, q), not negative."""


class Solution(Declared, eq=False):
    """Parameters and what the residuals say."""

    p: FloatArray = part("parameters, shape (n,)")
    covariance: FloatArray = part("of the parameters, shape (n, n)")
    fitted: FloatArray = part("the law, shape (m,)")
    residuals: FloatArray = part("the data less the law, shape (m,)")
    jacobian: FloatArray = part("at `p`, shape (m, n)")
    variance: FloatArray = part("of the noise in each row; all 1 where the data are exact. Shape (m,)")
    outliers: BoolArray = part("rows left out, shape (m,)")
    degrees_of_freedom: int = part("rows used less parameters")
    freedoms: FloatArray = part(
        "degrees of freedom with which the variance of each parameter is known. Shape (n,)"
    )
    residual_scale: float = part("root of the sum of squared residuals over the degrees of freedom")
    condition_number: float = part("of the weighted Jacobian with columns of unit length")
    exact: bool = part("whether the residuals are no more than rounding")

    @property
    def used(self) -> BoolArray:
        """Rows that were not left out."""
        return ~self.outliers

    @property
    def standard_errors(self) -> FloatArray:
        """Roots of the diagonal of the covariance, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def weights(self) -> FloatArray:
        """Proportional to 1 / variance, the largest 1, shape (m,)."""
        weights: FloatArray = self.variance.min() / self.variance
        return weights


class NoSolutionError(ArithmeticError):
    """No parameters of a law come near the data; `row` is farthest from those that the fit began with."""

    def __init__(self, row: int) -> None:
        super().__init__(f"no parameters of the law come near the data, row {row} lies farthest off")
        self.row = row


def solve(law: Law, data: FloatArray, start: FloatArray, *, robust: bool = True) -> Solution:
    """Fit a law to data, shape (m,), more than it has parameters, from parameters near enough.

    Rows that lie too far off are left out if the fit is to be robust.

    Raises
    ------
    NoSolutionError
        The parameters run away, or the law has no finite value on the way.
    """
    # A row very far off can drive the first fit, which counts it in full, away; a second try leaves that out.
    for plain_first in (True, False) if robust else (True,):
        with np.errstate(all="ignore"):
            try:
                solution = _solve(law, data, start, robust, plain_first)
            except (ArithmeticError, ValueError):
                # What SciPy and LAPACK raise where residuals or Jacobian are not finite.
                continue
        if np.isfinite(solution.p).all() and np.isfinite(solution.covariance).all():
            return solution
    with np.errstate(all="ignore"):
        distances = np.abs(data - law.value(start))
    raise NoSolutionError(int(np.argmax(np.where(np.isnan(distances), np.inf, distances))))


def _solve(law: Law, data: FloatArray, start: FloatArray, robust: bool, plain_first: bool) -> Solution:
    m, n = len(data), len(start)
    used = np.ones(m, dtype=bool)
    p = _least_squares(law, data, np.ones(m), used, start) if plain_first else start
    if robust:
        for _ in range(3):
            scale = robust_scale(data - law.value(p))
            if scale <= _EXACT * np.abs(data).max():
                break
            p = _least_squares(law, data, np.full(m, scale * scale), used, p, loss="soft_l1")
    exact = _is_exact(data, data - law.value(p))
    variance = np.ones(m)
    tried: set[bytes] = set()
    for step in range(_ROUNDS):
        residuals = data - law.value(p)
        exact = _is_exact(data, residuals[used])
        if exact:
            variance = np.ones(m)
        else:
            variance = variance_of(law.spread(p), residuals, used, n, clipped=robust and step == 0)
        if robust and not exact:
            inside = _inside(law.jacobian(p), residuals, variance, used)
            if inside.tobytes() in tried:
                # Where rows come and go by turns they stay out.
                inside &= used
            tried.add(inside.tobytes())
        else:
            inside = used
        if inside.sum() <= n:
            inside = used
        after = _least_squares(law, data, variance, inside, p)
        same = bool(np.array_equal(inside, used))
        moved = bool(np.any(np.abs(after - p) > 1e-9 * np.abs(after)))
        p, used = after, inside
        if step > 0 and same and (exact or not moved):
            break
    return _solution(law, data, p, variance, used, exact=exact)


def _solution(
    law: Law,
    data: FloatArray,
    p: FloatArray,
    variance: FloatArray,
    used: BoolArray,
    *,
    exact: bool,
) -> Solution:
    fitted = law.value(p)
    residuals, jacobian = data - fitted, law.jacobian(p)
    freedom = int(used.sum()) - len(p)
    root = np.sqrt(variance[used])
    rows, errors = jacobian[used] / root[:, None], residuals[used] / root
    length = lengths_of(rows)
    singular = np.linalg.svd(rows / length, compute_uv=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else math.inf
    scale = math.sqrt(float(np.sum(residuals[used] ** 2)) / max(freedom, 1))
    covariance, freedoms = sandwich(rows, errors)
    return Solution(
        p,
        covariance,
        fitted,
        residuals,
        jacobian,
        variance,
        ~used,
        freedom,
        freedoms,
        scale,
        condition,
        exact,
    )


def sandwich(rows: FloatArray, errors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the covariance HC2 of a linear regression, shape (n, n), and its degrees of freedom, shape (n,).

    Of the weighted Jacobian, shape (m, n), and the weighted residuals. The freedoms are for the Student's t
    of each parameter, those of Bell and McCaffrey.
    """
    m, n = rows.shape
    length = lengths_of(rows)
    inverse = np.linalg.pinv(rows / length) / length[:, None]
    basis = _basis(rows)
    own = np.sum(basis * basis, axis=1)
    # A row that alone determines a parameter has no residual of its own; it counts like one with 0.9.
    half = inverse / np.sqrt(np.maximum(1.0 - own, 0.1))
    covariance: FloatArray = (half * errors) @ (half * errors).T
    freedoms = np.full(n, float(max(m - n, 1)))
    if m <= n:
        return covariance, freedoms
    for k in range(n):
        # The estimated variance is the quadratic form (1 - H) D (1 - H) of the noise, H the projection on the
        # rows, D diagonal; its mean and spread give the freedom.
        d = half[k] ** 2
        trace = float(d @ (1.0 - own))
        inner = basis.T @ (d[:, None] * basis)
        freedoms[k] = trace**2 / (float(d**2 @ (1.0 - 2.0 * own)) + float(np.sum(inner * inner)))
    return covariance, freedoms


def leverage(rows: FloatArray) -> FloatArray:
    """Return how much each row determines its own fitted value, 0 to 1, shape (m,)."""
    shares: FloatArray = np.sum(_basis(rows) ** 2, axis=1)
    return shares


def _basis(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis of what the columns span, shape (m, rank)."""
    basis, singular, _ = np.linalg.svd(rows / lengths_of(rows), full_matrices=False)
    return basis[:, singular > 1e-12 * singular[0]] if singular.size else basis


def lengths_of(rows: FloatArray) -> FloatArray:
    """Return the lengths of the columns; 1 for a column of zeros."""
    lengths: FloatArray = np.linalg.norm(rows, axis=0)
    lengths[lengths == 0.0] = 1.0
    return lengths


def _least_squares(
    law: Law,
    data: FloatArray,
    variance: FloatArray,
    used: BoolArray,
    start: FloatArray,
    loss: Any = "linear",
) -> FloatArray:
    from scipy.optimize import least_squares

    root = np.sqrt(variance[used])

    def residuals(p: FloatArray) -> FloatArray:
        return (law.value(p)[used] - data[used]) / root

    def jacobian(p: FloatArray) -> FloatArray:
        return law.jacobian(p)[used] / root[:, None]

    solution = least_squares(
        residuals,
        start,
        jac=jacobian,
        method="trf",
        loss=loss,
        x_scale="jac",
        ftol=1e-15,
        xtol=1e-15,
        gtol=1e-15,
        max_nfev=200,
    )
    return np.asarray(solution.x, dtype=np.float64)


def _is_exact(data: FloatArray, residuals: FloatArray) -> bool:
    return bool(np.sqrt(np.mean(residuals**2)) <= _EXACT * np.abs(data).max())


def variance_of(
    spread: FloatArray,
    residuals: FloatArray,
    used: BoolArray,
    parameters: int,
    *,
    clipped: bool = False,
) -> FloatArray:
    """Return the variance of each row, shape (m,), by maximum likelihood of its components.

    Each step multiplies every component by the root of the ratio of what the residuals ask for to what they
    have; a component that is not needed goes to zero. Each component has its `spread`, shape (m, q), in each
    row; only the rows used count, and the parameters of the law take up as many residuals. Where the outliers
    are not known yet, large residuals are clipped.
    """
    from scipy.stats import chi2

    g, r2 = spread[used], residuals[used] ** 2
    size = g.mean(axis=0)
    g = g[:, size > 0.0] / size[size > 0.0]
    kept = spread[:, size > 0.0] / size[size > 0.0]
    first = robust_scale(residuals[used]) ** 2 if clipped else float(r2.mean())
    theta = np.full(g.shape[1], (first or float(r2.mean())) / g.shape[1])
    limit = _CLIP * _CLIP
    # Mean of a squared normal number that is cut at the limit.
    mean = float(chi2.cdf(limit, 3) + limit * chi2.sf(limit, 1)) if clipped else 1.0
    share = len(r2) / (len(r2) - parameters) if len(r2) > parameters else 1.0
    for _ in range(500):
        v = g @ theta
        ratio = share * r2 / v
        if clipped:
            ratio = np.minimum(ratio, limit)
        factor = np.sqrt((g.T @ (ratio / (mean * v))) / (g.T @ (1.0 / v)))
        theta = theta * factor
        if np.abs(np.where(theta > 1e-9 * theta.max(), factor, 1.0) - 1.0).max() < 1e-6:
            break
    # Weights that rest on a handful of residuals would follow their noise: no row counts 1e4 times another.
    v = kept @ theta
    variance: FloatArray = np.maximum(v, 1e-4 * v.max())
    return variance


def _inside(jacobian: FloatArray, residuals: FloatArray, variance: FloatArray, used: BoolArray) -> BoolArray:
    """Return which rows lie as far off as noise can put them."""
    from scipy.stats import norm

    root = np.sqrt(variance)
    rows = jacobian / root[:, None]
    freedom = int(used.sum()) - rows.shape[1]
    free = np.ones(len(root))
    free[used] = np.maximum(1.0 - leverage(rows[used]), 0.1) if freedom > 0 else 1.0
    limit = float(norm.isf(0.5 * _FALSE_OUTLIERS / len(root)))
    return np.abs(residuals) <= limit * root * np.sqrt(free)
