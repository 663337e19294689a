"""What residuals say of a law: a test against richer laws, a runs test, constants that go together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.identify.least_squares import Solution
    from printhammer.segments import FloatArray

LEVEL: Final = 0.01
"""A law is said to be rejected where its data have less than this probability."""

_HARD_TO_TELL: Final = 30.0
"""Condition number from which on it is said which constants go together."""


def law_p_value(solution: Solution, richer: FloatArray) -> float:
    """Test a law against one with more terms.

    The terms are added to the linearised, weighted fit; an F test tells whether they are needed.

    Parameters
    ----------
    solution : Solution
        Fit of the law.
    richer : array, shape (m, q)
        The terms, in the unit of the data.

    Returns
    -------
    float
        Probability of terms at least as large if the law holds; NaN where the data are exact or too few.
    """
    from scipy.stats import f

    used, q = solution.used, richer.shape[1]
    freedom = solution.degrees_of_freedom - q
    if solution.exact or freedom < 2:
        return math.nan
    root = np.sqrt(solution.variance[used])
    rows = solution.jacobian[used] / root[:, None]
    both = np.hstack([rows, richer[used] / root[:, None]])
    both = both / np.linalg.norm(both, axis=0)
    if np.linalg.matrix_rank(both, tol=1e-9) < both.shape[1]:
        return math.nan
    errors = solution.residuals[used] / root
    left = errors - both @ np.linalg.lstsq(both, errors, rcond=None)[0]
    after = float(left @ left)
    ratio = (float(errors @ errors) - after) / q / (after / freedom)
    return float(f.sf(ratio, q, freedom))


def runs_p_value(values: FloatArray) -> float:
    """Test whether the signs of residuals come in too few or too many runs.

    Equation: A. Wald and J. Wolfowitz, Ann. Math. Statist. 11 (1940) 147, by the normal distribution of the
    number of runs.

    Parameters
    ----------
    values : array, shape (m,)
        Residuals in the order in which they are to be looked at.

    Returns
    -------
    float
        Probability of a number of runs as far from the expected one; NaN for fewer than 8 of either sign.
    """
    from scipy.stats import norm

    signs = values[values != 0.0] > 0.0
    n, above = len(signs), int(signs.sum())
    below = n - above
    if min(above, below) < 8:
        return math.nan
    runs = 1 + int(np.count_nonzero(signs[1:] != signs[:-1]))
    pairs = 2.0 * above * below
    mean, variance = pairs / n + 1.0, pairs * (pairs - n) / (n * n * (n - 1.0))
    return float(2.0 * norm.sf(abs(runs - mean) / math.sqrt(variance)))


def whiteness(solution: Solution, abscissa: FloatArray, series: npt.NDArray[np.int64]) -> list[str]:
    """Say whether residuals depend on each other, taken in the order of the abscissa, series by series.

    Returns
    -------
    list of str
        A sentence where the runs test has a probability below 1 %; else nothing.
    """
    if solution.exact:
        return []
    order = np.lexsort((abscissa, series))
    p = runs_p_value(solution.residuals[order][solution.used[order]])
    if not p < LEVEL:
        return []
    why = "the law bends another way than the data, or the sensor is slow"
    what = f"neighbouring residuals depend on each other (runs test, p = {p:.2g})"
    return [f"{what}: {why}, and the standard errors are too small"]


def together(solution: Solution, names: Sequence[str]) -> list[str]:
    """Say which parameters the data hardly tell apart.

    Parameters
    ----------
    solution : Solution
        The fit.
    names : sequence of str
        Of its parameters; an empty name for one that is of no interest.

    Returns
    -------
    list of str
        A sentence with the parameters whose common change the data resist least; nothing where the condition
        number is small.
    """
    if solution.condition_number < _HARD_TO_TELL:
        return []
    rows = solution.jacobian[solution.used] / np.sqrt(solution.variance[solution.used])[:, None]
    weakest = np.linalg.svd(rows / np.linalg.norm(rows, axis=0))[2][-1]
    parts = [name for name, part in zip(names, weakest, strict=True) if name and abs(part) > 0.3]
    if len(parts) < 2:
        return []
    listed = f"{', '.join(parts[:-1])} and {parts[-1]}"
    together = f"{listed} go together (condition number {solution.condition_number:.3g})"
    return [f"{together}: the data fix a combination of them better than each alone"]
