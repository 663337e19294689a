"""Build fit results from least-squares solutions, and test the residuals.

The tests compare the law with laws that have one more term, and look for runs in the residuals; the result
names constants that the data cannot separate.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.least_squares import (
    Law,
    NoSolutionError,
    Parameters,
    Solution,
    descend,
    lengths_of,
    sandwich,
    solve,
)
from printhammer.identify.result import HELD, Fit, FittedConstant, Profile, student
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray, IntArray

LEVEL: Final = 0.01
"""Significance level below which a law is rejected; arbitrary."""

_RUNS: Final = "residuals of neighbours are correlated: the data deviate from the law, or the sensor is slow"
_COPY: Final = 1e-6  # Arbitrary
"""Singular value of the normalised Jacobian below which a term is collinear with its columns."""

_TOGETHER: Final = "the excluded rows are consecutive: there the data deviate from the law"

_HARD_TO_TELL: Final = 30.0
"""Condition number above which the result names the constants that the data hardly separate; arbitrary."""


def judge(
    solution: Solution, terms: Mapping[str, FloatArray], abscissa: FloatArray, series: IntArray
) -> tuple[float, str]:
    """Test a law against laws with one additional term, and test residuals and outliers for runs.

    Each term is added to the linearised, weighted fit, and a t-test, with errors and degrees of freedom as in
    the fit, determines whether the term is significant. Two tests examine the residuals in the order of the
    abscissa, series by series: the runs of their signs, and von Neumann's ratio. A third test checks whether
    the excluded rows are more clustered than gross errors at random rows would be. The smallest p-value is
    corrected for the number of tests (Bonferroni).

    `terms` maps the description of each additional term to its values, in the unit of the data. Terms,
    abscissa and series have the shape (m,) of the data.

    Returns
    -------
    p_value : float
        Smallest p-value, corrected; NaN if the residuals are only rounding errors, or the data are too few.
    why : str
        Description of the term, or of the finding of the test, with the smallest p-value; an empty string
        unless the law is rejected.
    """
    if solution.exact or solution.degrees_of_freedom < 3:
        return math.nan, ""
    p_values = {why: term_p_value(solution, term) for why, term in terms.items()}
    order = np.lexsort((abscissa, series))
    ordered = (solution.residuals / np.sqrt(solution.variance))[order][solution.used[order]]
    p_values[_RUNS] = min(1.0, 2.0 * float(np.nanmin([1.0, runs_p_value(ordered), ratio_p_value(ordered)])))
    p_values[_TOGETHER] = stretch_p_value((np.sign(solution.residuals) * solution.outliers)[order])
    known = {why: p for why, p in p_values.items() if not math.isnan(p)}
    if not known:
        return math.nan, ""
    why = min(known, key=lambda name: known[name])
    p_value = min(1.0, len(known) * known[why])
    return p_value, why if p_value < LEVEL else ""


def term_p_value(solution: Solution, term: FloatArray) -> float:
    """Compute the p-value of one additional term in the linearised fit.

    The result is NaN if the term is collinear with the derivatives with respect to the parameters.
    """
    from scipy.special import stdtr

    root = np.sqrt(solution.variance[solution.used])
    errors = solution.residuals[solution.used] / root
    rows = solution.rows
    known = np.zeros(len(rows) - len(errors))
    rows = np.column_stack([rows, np.concatenate([term[solution.used] / root, known])])
    rows = rows / lengths_of(rows)
    if np.linalg.matrix_rank(rows, tol=_COPY) < rows.shape[1]:
        return math.nan
    need = np.linalg.lstsq(rows, np.concatenate([errors, known]), rcond=None)[0]
    covariance, freedoms = sandwich(rows, errors - rows[: len(errors)] @ need)
    if not covariance[-1, -1] > 0.0:
        return math.nan
    return 2.0 * float(stdtr(freedoms[-1], -abs(need[-1]) / math.sqrt(covariance[-1, -1])))


def runs_p_value(values: FloatArray) -> float:
    """Compute the p-value of the Wald-Wolfowitz runs test on the signs of ordered residuals.

    The number of runs is compared with its normal approximation, two-sided (A. Wald and J. Wolfowitz, Ann.
    Math. Statist. 11 (1940) 147); NaN for fewer than 8 residuals of either sign.
    """
    from scipy.special import ndtr

    signs = values[values != 0.0] > 0.0
    n, above = len(signs), int(signs.sum())
    below = n - above
    if min(above, below) < 8:
        return math.nan
    runs = 1 + int(np.count_nonzero(signs[1:] != signs[:-1]))
    pairs = 2.0 * above * below
    mean, variance = pairs / n + 1.0, pairs * (pairs - n) / (n * n * (n - 1.0))
    return float(2.0 * ndtr(-abs(runs - mean) / math.sqrt(variance)))


def ratio_p_value(values: FloatArray) -> float:
    """Compute the p-value of von Neumann's ratio test for positive serial correlation.

    The ratio of the mean squared difference of neighbours to the mean square is nearly normal with mean 2 and
    variance 4 (n - 2) / (n^2 - 1) (J. von Neumann, Ann. Math. Statist. 12 (1941) 367); NaN for fewer than 8
    values.
    """
    from scipy.special import ndtr

    n = len(values)
    square = float(values @ values)
    if n < 8 or not square > 0.0:
        return math.nan
    ratio = float(np.sum(np.diff(values) ** 2)) / square * n / (n - 1.0)
    return float(ndtr((ratio - 2.0) / math.sqrt(4.0 * (n - 2.0) / (n * n - 1.0))))


def stretch_p_value(signs: FloatArray) -> float:
    """Return an upper bound of the p-value of the longest run of excluded rows of one sign.

    The null hypothesis is gross errors at random rows: a run of k rows begins at any of the n rows with
    probability (1/2)^(k - 1) q^k, with q the fraction of excluded rows. `signs` contains the signs of the
    residuals, 0 for used rows. NaN without two consecutive excluded rows.
    """
    longest = length = 0
    for before, here in zip([0.0, *signs.tolist()], signs.tolist(), strict=False):
        length = 0 if here == 0.0 else length + 1 if here == before else 1
        longest = max(longest, length)
    if longest < 2:
        return math.nan
    fraction = float(np.count_nonzero(signs)) / len(signs)
    return min(1.0, len(signs) * fraction**longest * 0.5 ** (longest - 1))


def inseparable(solution: Solution, names: Sequence[str]) -> list[str]:
    """Describe the parameters that the data hardly separate, as a list of one sentence or an empty list.

    The sentence names the parameters with large components in the weakest direction; parameters with an empty
    name are skipped.
    """
    if solution.condition_number < _HARD_TO_TELL:
        return []
    rows = solution.rows
    weakest = np.linalg.svd(rows / lengths_of(rows), full_matrices=False)[2][-1]
    free = [name for name, is_free in zip(names, solution.free, strict=True) if is_free]
    parts = [name for name, part in zip(free, weakest, strict=True) if name and abs(part) > 0.3]
    if len(parts) < 2:
        return []
    listed = f"{', '.join(parts[:-1])} and {parts[-1]}"
    tied = f"{listed} are correlated (condition number {solution.condition_number:.3g})"
    return [f"{tied}: the data determine a combination better than each constant alone"]


_WEAK: Final = 0.1
"""Relative standard error above which the profile likelihood of a constant is computed; arbitrary."""

_GRID: Final = 25  # Number of values of a profile likelihood; arbitrary

_COARSE: Final = 1e-8
"""Relative tolerance of the least-squares iterations of a profile likelihood; arbitrary."""


class Data(Declared, eq=False):
    """Data of a fit, with abscissa, series and file of origin."""

    files: tuple[Path, ...] = part("files of the data")
    kind: str = part('one of "magnet", "solenoid", "spring", "pack" and "backstop"')
    abscissa: FloatArray = part("abscissa, SI, shape (m,)")
    values: FloatArray = part("data, SI, shape (m,)")
    axes: tuple[tuple[str, str], tuple[str, str]] = part("names and SI units of abscissa and data")
    series: IntArray = part("index in `series_names`, shape (m,)")
    series_names: tuple[str, ...] = part("names of the series, for the legend")
    lines: IntArray = part("line numbers in the files, shape (m,)")


def solved(data: Data, law: Law, start: FloatArray | Parameters, *, robust: bool) -> Solution:
    """Fit a law to data by least squares; see `printhammer.identify.least_squares.solve`.

    Raises
    ------
    InputError
        The law does not fit the data; the message names the line that deviates most.
    """
    try:
        return solve(law, data.values, start, robust=robust)
    except NoSolutionError as error:
        files = " and ".join(str(path) for path in data.files)
        raise InputError(
            (
                f"{files}: the law does not fit the data: line {data.lines[error.row]} deviates most from the"
                " initial guess"
            ),
            file=files,
            key=f"line {data.lines[error.row]}",
            expected="readings of a device that the law describes",
        ) from None


def assemble(
    data: Data,
    law: Law,
    solution: Solution,
    parameters: Sequence[tuple[str, str, bool]],
    *,
    given: Mapping[str, str],
    remedies: Mapping[str, str],
    indistinct: Sequence[str] = (),
    rejected: str = "",
    p_value: float = math.nan,
    notes: Sequence[str] = (),
) -> Fit:
    """Build the result of a fit, with 95 % intervals and with profiles of weakly determined constants.

    `parameters` lists key, SI unit, and whether the key exists in hammer files, for each parameter; an empty
    key marks a nuisance parameter. `remedies` states, by key, what to measure to determine a constant that
    must be positive. `given`, `indistinct`, `rejected`, `p_value` and `notes` are as in `Fit`.

    Raises
    ------
    InputError
        The 95 % interval of a constant that must be positive reaches zero, unless the law is rejected; the
        message says what to measure.
    """
    kept = [k for k, (key, _unit, _in_file) in enumerate(parameters) if key and solution.free[k]]
    errors = solution.standard_errors
    constants, profiles = {}, {}
    for k, (key, unit, in_file) in enumerate(parameters):
        if not key:
            continue
        value, error = float(solution.p[k]), float(errors[k])
        if not solution.free[k]:
            ends = float(solution.parameters.low[k]), float(solution.parameters.high[k])
            constants[key] = FittedConstant(key, value, math.inf, ends, unit, in_file, HELD, held=True)
            continue
        freedom = float(solution.freedoms[k])
        constants[key] = FittedConstant.of(key, value, error, freedom, unit, in_file=in_file)
        if in_file and error > _WEAK * abs(value) and not (solution.exact or rejected):
            profiles[key] = profile(law, data.values, solution, k)
    unseen = [key for key in remedies if key in constants and not constants[key].held]
    unseen = [key for key in unseen if constants[key].interval[0] <= 0.0]
    if not rejected:
        for key in unseen[:1]:
            low, high = constants[key].interval
            raise InputError(
                (
                    f"{data.files[0]}: {key} {_unseen(constants[key])} (95 % interval {low:.3g} to {high:.3g}"
                    f" {constants[key].unit})"
                ),
                file=data.files[0],
                key=key,
                expected=remedies[key],
            )
    held = [
        f"the data do not determine {key}, which is held at {each.value:.4g} {each.unit}"
        for key, each in constants.items()
        if each.held
    ]
    held += [f"{key} {_unseen(constants[key])}" for key in unseen]
    weak = [
        f"{key} is weakly determined: the profile confines the constant to {shape.interval[0]:.4g} and"
        f" {shape.interval[1]:.4g} {constants[key].unit}"
        for key, shape in profiles.items()
    ]
    names = [key for key, _unit, _in_file in parameters]
    return Fit(
        kind=data.kind,
        source=tuple(path.name for path in data.files),
        constants=constants,
        keys=tuple(key for key, each in constants.items() if not each.held),
        covariance=solution.covariance[np.ix_(kept, kept)],
        abscissa=data.abscissa,
        data=data.values,
        fitted=solution.fitted,
        residuals=solution.residuals,
        axes=data.axes,
        degrees_of_freedom=solution.degrees_of_freedom,
        residual_scale=solution.residual_scale,
        weights=solution.weights,
        outliers=solution.outliers,
        condition_number=solution.condition_number,
        series=data.series,
        series_names=data.series_names,
        lines=data.lines,
        given=given,
        indistinct=(*indistinct, *held, *inseparable(solution, names)),
        profiles=profiles,
        rejected=rejected,
        p_value=p_value,
        remarks=(*notes, *weak),
    )


def _unseen(constant: FittedConstant) -> str:
    """Describe why an estimate is not significantly positive: negative, or indistinguishable from zero."""
    if constant.interval[1] < 0.0:
        return f"came out negative, {constant.value:.3g} {constant.unit}"
    return "cannot be distinguished from zero"


def profile(law: Law, data: FloatArray, solution: Solution, index: int) -> Profile:
    """Compute the profile likelihood of one parameter: fix its value, and refit the other parameters.

    The values extend to four standard errors from the optimum, within the bounds; rows and weights are those
    of the fit.
    """
    used, space = solution.used, replace(solution.parameters, tolerance=_COARSE)
    root = np.sqrt(solution.variance[used])
    others = solution.free & (np.arange(len(solution.p)) != index)
    best, error = solution.p[index], solution.standard_errors[index]
    freedom = max(solution.degrees_of_freedom, 1)
    least = float(np.sum((solution.residuals[used] / root) ** 2))
    values = np.clip(best + error * np.linspace(-4.0, 4.0, _GRID), space.low[index], space.high[index])
    increase = np.empty(_GRID)

    middle = _GRID // 2
    for way in (range(middle, _GRID), range(middle, -1, -1)):
        p = solution.p.copy()
        for k in way:
            p[index] = values[k]
            p = descend(law, data, solution.variance, used, space, p, others)
            total = float(np.sum(((law.value(p) - data)[used] / root) ** 2))
            increase[k] = max(total - least, 0.0) * freedom / least
    level = student(float(solution.freedoms[index])) ** 2
    ends = (
        _crossing(values[middle::-1], increase[middle::-1], level, -math.inf),
        _crossing(values[middle:], increase[middle:], level, math.inf),
    )
    return Profile(values, increase, ends)


def _crossing(values: FloatArray, increase: FloatArray, level: float, never: float) -> float:
    """Return the first of the values at which a profile likelihood reaches a level; `never` if it does not.

    `increase` is the profile likelihood at `values`; its square root is interpolated linearly between the
    values.
    """
    above = np.flatnonzero(increase >= level)
    if not above.size:
        return never
    k = int(above[0])
    low, high = np.sqrt(increase[k - 1 : k + 1])
    share = (math.sqrt(level) - low) / (high - low)
    return float(values[k - 1] + share * (values[k] - values[k - 1]))


def check_rows(data: Data, needed: int, what: str) -> None:
    """Raise `InputError` for data with fewer than `needed` rows for a fit of `what`, or with only zeros."""
    where = " and ".join(str(path) for path in data.files)
    if len(data.values) < needed:
        raise InputError(
            f"{where}: {len(data.values)} rows, too few for {what}",
            file=where,
            key="rows",
            expected=f"{needed} or more",
        )
    if not np.any(data.values):
        raise InputError(
            f"{where}: every {data.axes[1][0]} is 0",
            file=where,
            key=data.axes[1][0],
            expected="measured values",
        )
