"""Robust weighted least squares with outlier rejection, variance components and sandwich errors.

    data = law(p) + noise, variance of the noise in row i = sum over j of columns[i, j] theta[j]

A robust fit (soft-l1 loss, scale from the median absolute residual) estimates the parameters and the variance
components theta >= 0; outliers are excluded; the rest is fitted by iteratively reweighted least squares until
rows and weights converge. The covariance is the sandwich estimator HC2, which is valid even if the weights
are wrong, with degrees of freedom for each parameter (R. M. Bell and D. F. McCaffrey, Survey
Methodology 28 (2002) 169; G. W. Imbens and M. Kolesar, Rev. Econ. Stat. 98 (2016) 701).

An error in the abscissa enters as a variance column equal to the squared slope of the law (effective
variance: J. Orear, Am. J. Phys. 50 (1982) 912).
"""

from __future__ import annotations

import math
from typing import Any, Final, Protocol, Self

import numpy as np

from printhammer.identify.noise import robust_scale, variance_of
from printhammer.results import Declared, part
from printhammer.support.arrays import BoolArray, FloatArray

_FALSE_OUTLIERS: Final = 0.01
"""Expected number of rows without gross error that a fit excludes, for normal noise; arbitrary."""

_EXACT: Final = 1e-11
"""RMS residual, as a fraction of the largest datum, below which the data are treated as exact; arbitrary."""

_ROUNDS: Final = 30  # Iteration limit of the fit; arbitrary

_ALONE: Final = 0.9
"""Leverage above which a row alone determines a parameter; arbitrary."""

_HOLDING: Final = 4.0
"""Smallest factor by which omitting essential rows increases the variance of a parameter; arbitrary."""

_AT_BOUND: Final = 1e-6  # Arbitrary
"""Distance from a bound, as a fraction of the parameter, below which the parameter is at the bound."""

_SINGULAR: Final = 1e-12  # Arbitrary
"""Smallest singular value of the column-normalised Jacobian at which all parameters are determined."""

_TIED: Final = 0.5  # Arbitrary
"""Component of the weakest direction, as a fraction of the largest, above which a parameter may be held."""

_RESISTS: Final = 1.0  # Arbitrary
"""Largest increase of the weighted sum of squares (one standard error) that holding a parameter may cause."""

_DIFFERENCES: Final = 1e-9
"""Error of finite-difference derivatives, as a fraction of the largest datum magnitude; arbitrary."""


class Law(Protocol):
    """Interface of a law to fit: predicted data as a function of parameters."""

    def value(self, p: FloatArray) -> FloatArray:
        """Return the predicted data, shape (m,)."""

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Return the derivatives of the data with respect to the parameters, shape (m, n)."""

    def variance_columns(self, p: FloatArray) -> FloatArray:
        """Return the coefficient of each variance component in each row, shape (m, q), not negative."""


class Parameters(Declared, eq=False):
    """Initial guess, bounds and Gaussian prior of a fit; arrays of shape (n,)."""

    start: FloatArray = part("initial guess, and mean of the prior")
    low: FloatArray = part("lower bounds; -inf for none")
    high: FloatArray = part("upper bounds; inf for none")
    deviation: FloatArray = part("standard deviation of the prior; inf for none")
    size: FloatArray | None = part(
        "plausible change of a parameter, at least its own magnitude; a parameter is held if the data would"
        " not show that change. None to hold only parameters that the Jacobian does not determine",
        default=None,
    )
    rest: FloatArray | None = part(
        "value at which an undetermined parameter is held; None for `start`",
        default=None,
    )
    tolerance: float = part("relative tolerance of the least-squares iterations", default=1e-15)

    @classmethod
    def of(
        cls,
        start: FloatArray,
        *,
        low: FloatArray | float = -math.inf,
        high: FloatArray | float = math.inf,
        deviation: FloatArray | float = math.inf,
        size: FloatArray | float | None = None,
        rest: FloatArray | None = None,
        tolerance: float = 1e-15,
    ) -> Self:
        """Create parameters, by default without bounds or prior; a scalar applies to every parameter."""
        low, high, deviation = (np.broadcast_to(each, start.shape).copy() for each in (low, high, deviation))
        sizes = None if size is None else np.broadcast_to(size, start.shape).copy()
        return cls(start, low, high, deviation, sizes, rest, tolerance)


class Solution(Declared, eq=False):
    """Fitted parameters with their covariance, residuals and diagnostics."""

    p: FloatArray = part("parameters, shape (n,)")
    covariance: FloatArray = part("covariance of the parameters, shape (n, n); 0 for held parameters")
    fitted: FloatArray = part("predicted data, shape (m,)")
    residuals: FloatArray = part("data minus prediction, shape (m,)")
    jacobian: FloatArray = part("Jacobian at `p`, shape (m, n)")
    variance: FloatArray = part("noise variance of each row; all 1 if the data are exact. Shape (m,)")
    outliers: BoolArray = part("mask of the excluded rows, shape (m,)")
    degrees_of_freedom: int = part("number of rows used minus number of free parameters")
    freedoms: FloatArray = part("degrees of freedom of the estimated variance of each parameter. Shape (n,)")
    residual_scale: float = part("root of the sum of squared residuals over the degrees of freedom")
    condition_number: float = part("condition number of the weighted Jacobian with normalised columns")
    exact: bool = part("whether the residuals are only rounding errors")
    parameters: Parameters = part("initial guess, bounds and prior")
    free: BoolArray = part("mask of the parameters that the data determine, not held; shape (n,)")

    @property
    def used(self) -> BoolArray:
        """Mask of the rows that were not excluded."""
        return ~self.outliers

    @property
    def standard_errors(self) -> FloatArray:
        """Square roots of the diagonal of the covariance, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def weights(self) -> FloatArray:
        """Weights proportional to 1 / variance, scaled so that the largest is 1, shape (m,)."""
        weights: FloatArray = self.variance.min() / self.variance
        return weights

    @property
    def rows(self) -> FloatArray:
        """Weighted Jacobian of the used rows and free parameters, with one extra row per prior."""
        return _weighted_jacobian(self.jacobian, self.variance, self.used, self.parameters, self.free)


class NoSolutionError(ArithmeticError):
    """Raised if no parameters fit the data; `row` is the index of the datum that deviates most."""

    def __init__(self, row: int) -> None:
        super().__init__(f"the law does not fit the data: row {row} deviates most")
        self.row = row


def solve(law: Law, data: FloatArray, start: FloatArray | Parameters, *, robust: bool = True) -> Solution:
    """Fit a law to data, shape (m,), with more rows than parameters, from an initial guess.

    A robust fit excludes outliers, but never all rows that determine a parameter. A parameter that the data
    do not determine, or that runs into a bound, is held and the fit is repeated; the weakest right
    singular vector of the scaled Jacobian selects the parameter.

    Raises
    ------
    NoSolutionError
        The parameters diverge, or the law becomes non-finite during the iteration.
    """
    space = start if isinstance(start, Parameters) else Parameters.of(start)
    free = np.ones(len(space.start), dtype=bool)
    p = space.start
    while True:
        solution = _finite_solution(law, data, space, p, free, robust)
        if solution is None:
            with np.errstate(all="ignore"):
                distances = np.abs(data - law.value(space.start))
            raise NoSolutionError(int(np.argmax(np.where(np.isnan(distances), np.inf, distances))))
        weakest = _next_held(solution, data)
        if weakest is None:
            return solution
        free = free.copy()
        free[weakest] = False
        p = _held_at(law, data, solution, free, weakest)


def _finite_solution(
    law: Law, data: FloatArray, space: Parameters, start: FloatArray, free: BoolArray, robust: bool
) -> Solution | None:
    # A gross outlier can make the plain first fit diverge; the second attempt omits that fit.
    for plain_first in (True, False) if robust else (True,):
        with np.errstate(all="ignore"):
            try:
                solution = _solve(law, data, space, start, free, robust, plain_first)
            except (ArithmeticError, ValueError):
                # SciPy and LAPACK raise these if residuals or Jacobian are not finite.
                continue
        if np.isfinite(solution.p).all() and np.isfinite(solution.covariance).all():
            return solution
    return None


def _at_bound(solution: Solution) -> BoolArray:
    """Return the mask, shape (n,), of the parameters that ended at a bound."""
    space, p = solution.parameters, solution.p
    room = np.minimum(p - space.low, space.high - p)
    at_bound: BoolArray = room <= _AT_BOUND * np.maximum(np.abs(p), np.abs(space.start))
    return at_bound


def _next_held(solution: Solution, data: FloatArray) -> int | None:
    """Select the next parameter to hold; return its index, or None if the data determine all parameters."""
    space, free = solution.parameters, np.flatnonzero(solution.free)
    bound = [k for k in free.tolist() if _at_bound(solution)[k]]
    if bound:
        return int(bound[0])
    if len(free) < (2 if space.size is None else 1):
        return None
    rows, limit = solution.rows, _SINGULAR
    if space.size is None:
        rows = rows / lengths_of(rows)
    else:
        # Finite-difference derivatives are no more accurate than this fraction of the largest datum.
        noise = _DIFFERENCES * float(np.abs(data).max()) if solution.exact else 1.0
        rows, limit = rows * np.maximum(space.size, np.abs(solution.p))[free], noise
    _, singular, directions = np.linalg.svd(rows, full_matrices=False)
    if singular[-1] >= limit:
        return None
    parts = np.abs(directions[-1])
    # Of correlated parameters the last one is held, since laws list their main constants first.
    return int(free[np.flatnonzero(parts > _TIED * parts.max())[-1]])


def _held_at(law: Law, data: FloatArray, solution: Solution, free: BoolArray, held: int) -> FloatArray:
    """Hold the parameter `held` at its default value, and refit the parameters in the mask `free`.

    The default is `Parameters.rest`, or the initial guess. If the data exclude the default, the parameter is
    held at its estimate. A parameter at a bound stays there unless `rest` is stated and fits: where two
    parameters have the same effect, one can end at its bound because the other compensates for it.
    """
    p, space = solution.p.copy(), solution.parameters
    if space.rest is None and _at_bound(solution)[held]:
        return p
    p[held] = (space.start if space.rest is None else space.rest)[held]
    used, root = solution.used, np.sqrt(solution.variance[solution.used])
    with np.errstate(all="ignore"):
        try:
            p = descend(law, data, solution.variance, used, space, p, free)
            after = float(np.sum(((data - law.value(p))[used] / root) ** 2))
        except (ArithmeticError, ValueError):
            return solution.p
    before = float(np.sum((solution.residuals[used] / root) ** 2))
    allowed = (_DIFFERENCES * float(np.abs(data).max())) ** 2 * len(data) if solution.exact else _RESISTS
    return p if after <= before + allowed else solution.p


def _solve(
    law: Law,
    data: FloatArray,
    space: Parameters,
    start: FloatArray,
    free: BoolArray,
    robust: bool,
    plain_first: bool,
) -> Solution:
    m, n = len(data), int(free.sum())
    used = np.ones(m, dtype=bool)
    p = np.where(free, np.clip(start, space.low, space.high), start)
    guess = np.ones(m)
    if np.isfinite(space.deviation[free]).any():
        # The prior is weighted against the noise of the data, which is not estimated yet.
        guess *= robust_scale(data - law.value(p)) ** 2 or 1.0
    if plain_first:
        p = descend(law, data, guess, used, space, p, free)
    if robust:
        for _ in range(3):
            scale = robust_scale(data - law.value(p))
            if scale <= _EXACT * np.abs(data).max():
                break
            p = descend(law, data, np.full(m, scale * scale), used, space, p, free, loss="soft_l1")
    exact = _is_exact(data, data - law.value(p))
    variance = np.ones(m)
    tried: set[bytes] = set()
    for step in range(_ROUNDS):
        residuals = data - law.value(p)
        exact = _is_exact(data, residuals[used])
        if exact:
            variance = np.ones(m)
        else:
            variance = variance_of(law.variance_columns(p), residuals, used, n, clipped=robust and step == 0)
        if robust and not exact:
            jacobian = law.jacobian(p)
            inside = _inside(jacobian[:, free], residuals, variance, used)
            inside = _with_determining_rows(_weighted_jacobian(jacobian, variance, None, space, free), inside)
            if inside.tobytes() in tried:
                # Rows that alternate between used and excluded stay excluded.
                inside &= used
            tried.add(inside.tobytes())
        else:
            inside = used
        if inside.sum() <= n:
            inside = used
        after = descend(law, data, variance, inside, space, p, free)
        same = bool(np.array_equal(inside, used))
        moved = bool(np.any(np.abs(after - p) > 1e-9 * np.abs(after)))
        p, used = after, inside
        if step > 0 and same and (exact or not moved):
            break
    return _solution(law, data, space, p, free, variance, used, exact=exact)


def _with_determining_rows(rows: FloatArray, inside: BoolArray) -> BoolArray:
    """Add to the mask `inside` the outliers without which a parameter would be undetermined.

    A parameter counts as undetermined if the exclusion of the outliers increases its variance by more than
    the factor `_HOLDING`. `rows` is the weighted Jacobian of the m rows, followed by one row per prior; masks
    have the shape (m,).
    """
    if inside.all():
        return inside
    scaled = rows / lengths_of(rows)
    # The rows of the prior are always included.
    kept = np.concatenate([inside, np.ones(len(rows) - len(inside), dtype=bool)])
    all_rows = np.linalg.pinv(scaled)
    before, after = np.sum(all_rows**2, axis=1), np.sum(np.linalg.pinv(scaled[kept]) ** 2, axis=1)
    if np.linalg.matrix_rank(scaled[kept]) < np.linalg.matrix_rank(scaled):
        after = np.full_like(before, np.inf)
    lost = after > _HOLDING * before
    share = all_rows[:, : len(inside)] ** 2 / before[:, np.newaxis]
    holding: BoolArray = inside | (share[lost] > 1.0 / len(inside)).any(axis=0)
    return holding


def _weighted_jacobian(
    jacobian: FloatArray, variance: FloatArray, used: BoolArray | None, space: Parameters, free: BoolArray
) -> FloatArray:
    """Return the weighted Jacobian of the `used` rows and `free` parameters, with one extra row per prior."""
    rows = jacobian[:, free] / np.sqrt(variance)[:, None]
    rows = rows if used is None else rows[used]
    known = np.isfinite(space.deviation)
    prior: FloatArray = np.diag(1.0 / space.deviation)[known][:, free]
    return np.concatenate([rows, prior[prior.any(axis=1)]])


def _solution(
    law: Law,
    data: FloatArray,
    space: Parameters,
    p: FloatArray,
    free: BoolArray,
    variance: FloatArray,
    used: BoolArray,
    *,
    exact: bool,
) -> Solution:
    fitted = law.value(p)
    residuals, jacobian = data - fitted, law.jacobian(p)
    freedom = int(used.sum()) - int(free.sum())
    rows = _weighted_jacobian(jacobian, variance, used, space, free)
    errors = residuals[used] / np.sqrt(variance[used])
    singular = np.linalg.svd(rows / lengths_of(rows), compute_uv=False)
    condition = 1.0
    if singular.size:
        condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else math.inf
    scale = math.sqrt(float(np.sum(residuals[used] ** 2)) / max(freedom, 1))
    covariance, freedoms = np.zeros((len(p), len(p))), np.full(len(p), float(max(freedom, 1)))
    covariance[np.ix_(free, free)], freedoms[free] = sandwich(rows, errors)
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
        space,
        free,
    )


def sandwich(rows: FloatArray, errors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute the HC2 covariance of a linear regression, shape (n, n), and its degrees of freedom, (n,).

    `rows` is the weighted Jacobian, shape (m, n), and `errors` are the weighted residuals; rows beyond the
    residuals belong to the prior, with variance 1. The degrees of freedom, for Student's t of each parameter,
    are those of Bell and McCaffrey. A row that alone determines a parameter has no residual of its own, so
    the unexplained part of its variance is taken from the pooled residuals of all rows.
    """
    n, m = rows.shape[1], len(errors)
    length = lengths_of(rows)
    inverse = np.linalg.pinv(rows / length) / length[:, None]
    basis = _basis(rows)[:m]
    own = np.minimum(np.sum(basis * basis, axis=1), 1.0)
    left = float(np.sum(1.0 - own))
    alone = own > _ALONE
    divisor = np.where(alone, 1.0, 1.0 - own)
    pooled = float(errors @ errors) / left if left > 0.0 else 0.0
    variances = errors**2 / divisor + np.where(alone, own * pooled, 0.0)
    half = inverse * np.sqrt(np.concatenate([variances, np.ones(len(rows) - m)]))
    covariance: FloatArray = half @ half.T
    freedoms = np.full(n, float(max(m - n, 1)))
    if m <= n:
        return covariance, freedoms
    for k in range(n):
        # The estimated variance is the quadratic form (1 - H) D (1 - H) of the noise, H the hat matrix, D
        # diagonal; mean and spread of the form give the degrees of freedom (Satterthwaite).
        each = inverse[k, :m] ** 2
        d = each / divisor + float(each[alone] @ own[alone]) / max(left, 1e-300)
        inner = basis.T @ (d[:, None] * basis)
        spread = float(d**2 @ (1.0 - 2.0 * own)) + float(np.sum(inner * inner))
        mean = float(d @ (1.0 - own)) + float(np.sum(inverse[k, m:] ** 2))
        if spread > 0.0:
            freedoms[k] = mean**2 / spread
    return covariance, freedoms


def leverage(rows: FloatArray) -> FloatArray:
    """Return the leverage of each row of a weighted Jacobian, 0 to 1, shape (m,)."""
    shares: FloatArray = np.sum(_basis(rows) ** 2, axis=1)
    return shares


def _basis(rows: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the column space of a matrix, shape (m, rank)."""
    basis, singular, _ = np.linalg.svd(rows / lengths_of(rows), full_matrices=False)
    return basis[:, singular > 1e-12 * singular[0]] if singular.size else basis


def lengths_of(rows: FloatArray) -> FloatArray:
    """Return the Euclidean norms of the columns of a matrix; 1 for a zero column."""
    lengths: FloatArray = np.linalg.norm(rows, axis=0)
    lengths[lengths == 0.0] = 1.0
    return lengths


def descend(
    law: Law,
    data: FloatArray,
    variance: FloatArray,
    used: BoolArray,
    space: Parameters,
    start: FloatArray,
    free: BoolArray,
    loss: Any = "linear",
) -> FloatArray:
    """Minimise the weighted sum of squares over the free parameters; return all parameters."""
    from scipy.optimize import least_squares

    if not free.any():
        return start
    root = np.sqrt(variance[used])
    known = free & np.isfinite(space.deviation)

    def full(values: FloatArray) -> FloatArray:
        p = start.copy()
        p[free] = values
        return p

    def residuals(values: FloatArray) -> FloatArray:
        p = full(values)
        prior = (p[known] - space.start[known]) / space.deviation[known]
        return np.concatenate([(law.value(p)[used] - data[used]) / root, prior])

    def jacobian(values: FloatArray) -> FloatArray:
        return _weighted_jacobian(law.jacobian(full(values)), variance, used, space, free)

    solution = least_squares(
        residuals,
        start[free],
        jac=jacobian,
        bounds=(space.low[free], space.high[free]),
        method="trf",
        loss=loss,
        x_scale="jac",
        ftol=space.tolerance,
        xtol=space.tolerance,
        gtol=space.tolerance,
        max_nfev=200,
    )
    return full(np.asarray(solution.x, dtype=np.float64))


def _is_exact(data: FloatArray, residuals: FloatArray) -> bool:
    return bool(np.sqrt(np.mean(residuals**2)) <= _EXACT * np.abs(data).max())


def _inside(jacobian: FloatArray, residuals: FloatArray, variance: FloatArray, used: BoolArray) -> BoolArray:
    """Return the mask of the rows whose residuals are consistent with the noise."""
    from scipy.special import ndtri

    root = np.sqrt(variance)
    rows = jacobian / root[:, None]
    freedom = int(used.sum()) - rows.shape[1]
    free = np.ones(len(root))
    free[used] = np.maximum(1.0 - leverage(rows[used]), 0.1) if freedom > 0 else 1.0
    limit = -float(ndtri(0.5 * _FALSE_OUTLIERS / len(root)))
    return np.abs(residuals) <= limit * root * np.sqrt(free)
