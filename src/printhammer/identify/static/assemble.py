"""From a solution of least squares to the result that a user sees.

What residuals say of a law: a test against richer laws, a runs test, constants that go together.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.least_squares import Law, NoSolutionError, Solution, lengths_of, sandwich, solve
from printhammer.identify.result import Fit, FittedConstant, Profile, student
from printhammer.results import Declared, part
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


_WEAK: Final = 0.1
"""Relative standard error from which on a constant gets a profile."""

_GRID: Final = 25


class Data(Declared, eq=False):
    """The data of a fit and where they were measured."""

    files: tuple[Path, ...] = part("where they come from")
    kind: str = part('one of "magnet", "solenoid", "spring", "pack" and "backstop"')
    abscissa: FloatArray = part("SI, shape (m,)")
    values: FloatArray = part("SI, shape (m,)")
    axes: tuple[tuple[str, str], tuple[str, str]] = part("names and SI units")
    series: IntArray = part("place in `series_names`, shape (m,)")
    series_names: tuple[str, ...] = part("for the legend")
    lines: IntArray = part("lines of the files, shape (m,)")


def solved(data: Data, law: Law, start: FloatArray, *, robust: bool) -> Solution:
    """Fit a law to data; see `printhammer.identify.least_squares.solve`.

    Raises
    ------
    InputError
        No parameters come near the data; names the line that lies farthest off.
    """
    try:
        return solve(law, data.values, start, robust=robust)
    except NoSolutionError as error:
        files = " and ".join(str(path) for path in data.files)
        raise InputError(
            (
                f"{files}: no constants of the law come near the data, line {data.lines[error.row]}"
                " lies farthest off"
            ),
            file=files,
            key=f"line {data.lines[error.row]}",
            expected="rows in the order of the measurement, and none too far from the others",
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
    """Make the result of a fit, with intervals, and profiles of weak constants by the law.

    Of each parameter key, SI unit, and whether a hammer file has it; an empty key stands for one that is of
    no interest. `remedies` say by key what to measure to find a constant that has to be positive. `given`,
    `indistinct`, `rejected`, `p_value` and `notes` are as in `Fit`.

    Raises
    ------
    InputError
        The 95 % interval of a constant that has to be positive reaches zero; says what is missing.
    """
    kept = [k for k, (key, _unit, _in_file) in enumerate(parameters) if key]
    errors = solution.standard_errors
    constants, profiles = {}, {}
    for k in kept:
        key, unit, in_file = parameters[k]
        value, error = float(solution.p[k]), float(errors[k])
        freedom = float(solution.freedoms[k])
        constants[key] = FittedConstant.of(key, value, error, freedom, unit, in_file=in_file)
        if in_file and error > _WEAK * abs(value) and not solution.exact:
            profiles[key] = profile(law, data.values, solution, k)
    for key, remedy in remedies.items():
        if key in constants and constants[key].interval[0] <= 0.0:
            low, high = constants[key].interval
            raise InputError(
                (
                    f"{data.files[0]}: {key} cannot be distinguished from zero (95 % interval {low:.3g} to"
                    f" {high:.3g} {constants[key].unit})"
                ),
                file=data.files[0],
                key=key,
                expected=remedy,
            )
    weak = [
        f"{key} is weakly determined: its profile puts it between {shape.interval[0]:.4g} and"
        f" {shape.interval[1]:.4g} {constants[key].unit}"
        for key, shape in profiles.items()
    ]
    names = [key for key, _unit, _in_file in parameters]
    return Fit(
        kind=data.kind,
        source=tuple(path.name for path in data.files),
        constants=constants,
        keys=tuple(constants),
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
        indistinct=(*indistinct, *inseparable(solution, names)),
        profiles=profiles,
        rejected=rejected,
        p_value=p_value,
        remarks=(*notes, *weak),
    )


def profile(law: Law, data: FloatArray, solution: Solution, index: int) -> Profile:
    """Hold one parameter at values about the best one and fit the others again.

    The values go up to four standard errors away; rows and weights are as in the fit.
    """
    from scipy.optimize import least_squares

    used = solution.used
    root = np.sqrt(solution.variance[used])
    others = np.arange(len(solution.p)) != index
    best, error = solution.p[index], solution.standard_errors[index]
    freedom = max(solution.degrees_of_freedom, 1)
    least = float(np.sum((solution.residuals[used] / root) ** 2))
    values = best + error * np.linspace(-4.0, 4.0, _GRID)
    increase = np.empty(_GRID)

    def full(rest: FloatArray, value: float) -> FloatArray:
        p = solution.p.copy()
        p[others], p[index] = rest, value
        return p

    def residuals(rest: FloatArray, value: float) -> FloatArray:
        return (law.value(full(rest, value)) - data)[used] / root

    def jacobian(rest: FloatArray, value: float) -> FloatArray:
        return law.jacobian(full(rest, value))[used][:, others] / root[:, None]

    middle = _GRID // 2
    for way in (range(middle, _GRID), range(middle, -1, -1)):
        rest = solution.p[others]
        for k in way:
            if others.any():
                rest = least_squares(residuals, rest, jac=jacobian, x_scale="jac", args=(values[k],)).x
            total = float(np.sum(residuals(rest, float(values[k])) ** 2))
            increase[k] = max(total - least, 0.0) * freedom / least
    level = student(float(solution.freedoms[index])) ** 2
    ends = (
        _crossing(values[middle::-1], increase[middle::-1], level, -math.inf),
        _crossing(values[middle:], increase[middle:], level, math.inf),
    )
    return Profile(values, increase, ends)


def _crossing(values: FloatArray, increase: FloatArray, level: float, never: float) -> float:
    """Return where a profile first reaches a level, by straight lines between its roots."""
    above = np.flatnonzero(increase >= level)
    if not above.size:
        return never
    k = int(above[0])
    low, high = np.sqrt(increase[k - 1 : k + 1])
    share = (math.sqrt(level) - low) / (high - low)
    return float(values[k - 1] + share * (values[k] - values[k - 1]))


def enough(data: Data, needed: int, what: str) -> None:
    """Refuse data with fewer rows than a fit needs."""
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
