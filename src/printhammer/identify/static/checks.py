"""What residuals say of a law: a test against richer laws, a runs test, constants that go together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.identify.least_squares import Solution, lengths_of, sandwich

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from printhammer.support.arrays import FloatArray, IntArray

LEVEL: Final = 0.01
"""A law is said to be rejected where its data have less than this probability."""

_RUNS: Final = (
    "residuals of neighbours go together: the data bend another way than the law, or the sensor is slow"
)

_HARD_TO_TELL: Final = 30.0
"""Condition number from which on it is said which constants go together."""


def judge(
    solution: Solution, terms: Mapping[str, FloatArray], abscissa: FloatArray, series: IntArray
) -> tuple[float, str]:
    """Test a law against ones with one more term each, and its residuals for runs.

    A term is added to the linearised, weighted fit, and Student's t tells whether it is needed, with errors
    and degrees of freedom as those of the fit. The runs test looks at residuals in the order of the abscissa,
    series by series. The least probability counts once for each test (Bonferroni).

    Terms are what the law lacks, in the unit of the data, by what their need would mean; they, abscissa and
    series have the shape (m,) of the data. Returned are the probability of so much against the law if it
    holds, NaN where the data are exact or too few, and what speaks most against it, empty unless it is
    rejected.
    """
    if solution.exact or solution.degrees_of_freedom < 3:
        return math.nan, ""
    p_values = {why: _need(solution, term) for why, term in terms.items()}
    order = np.lexsort((abscissa, series))
    p_values[_RUNS] = runs_p_value(solution.residuals[order][solution.used[order]])
    known = {why: p for why, p in p_values.items() if not math.isnan(p)}
    if not known:
        return math.nan, ""
    why = min(known, key=lambda name: known[name])
    p_value = min(1.0, len(known) * known[why])
    return p_value, why if p_value < LEVEL else ""


def _need(solution: Solution, term: FloatArray) -> float:
    """Return the probability that a law in need of no term asks for as much of it; NaN for a copy."""
    from scipy.stats import t

    root = np.sqrt(solution.variance[solution.used])
    errors = solution.residuals[solution.used] / root
    rows = np.column_stack([solution.jacobian, term])[solution.used] / root[:, None]
    rows = rows / lengths_of(rows)
    if np.linalg.matrix_rank(rows, tol=1e-9) < rows.shape[1]:
        return math.nan
    need = np.linalg.lstsq(rows, errors, rcond=None)[0]
    try:
        covariance, freedoms = sandwich(rows, errors - rows @ need)
    except ZeroDivisionError:
        # A row alone determines the term.
        return math.nan
    return 2.0 * float(t.sf(abs(need[-1]) / math.sqrt(covariance[-1, -1]), freedoms[-1]))


def runs_p_value(values: FloatArray) -> float:
    """Test whether the signs of residuals, in their order, come in too few or too many runs.

    The probability of a number of runs as far from the expected one is by the normal distribution of that
    number (A. Wald and J. Wolfowitz, Ann. Math. Statist. 11 (1940) 147); NaN for fewer than 8 of either sign.
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


def inseparable(solution: Solution, names: Sequence[str]) -> list[str]:
    """Say which parameters the data hardly tell apart; nothing where the condition number is small.

    A sentence has the parameters whose common change the data resist least; one with an empty name is of no
    interest.
    """
    if solution.condition_number < _HARD_TO_TELL:
        return []
    rows = solution.jacobian[solution.used] / np.sqrt(solution.variance[solution.used])[:, None]
    weakest = np.linalg.svd(rows / lengths_of(rows))[2][-1]
    parts = [name for name, part in zip(names, weakest, strict=True) if name and abs(part) > 0.3]
    if len(parts) < 2:
        return []
    listed = f"{', '.join(parts[:-1])} and {parts[-1]}"
    tied = f"{listed} go together (condition number {solution.condition_number:.3g})"
    return [f"{tied}: the data fix a combination of them better than each alone"]
