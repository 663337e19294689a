"""From a solution of least squares to the result that a user sees."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.least_squares import NoSolutionError, solve
from printhammer.identify.result import Fit, FittedConstant, Profile, student
from printhammer.identify.static.checks import inseparable
from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from printhammer.identify.least_squares import Law, Solution
    from printhammer.support.arrays import FloatArray, IntArray

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
            f"{files}: no constants of the law come near the data, line {data.lines[error.row]} lies farthest"
            f" off, expected rows in the order of the measurement, and none too far from the others"
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
                f"{data.files[0]}: {key} cannot be distinguished from zero (95 % interval {low:.3g} to"
                f" {high:.3g} {constants[key].unit}), expected {remedy}"
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
    """Refuse data with fewer rows than a fit needs.

    Raises
    ------
    InputError
        Names the file, the number of rows and the number expected.
    """
    where = " and ".join(str(path) for path in data.files)
    if len(data.values) < needed:
        raise InputError(f"{where}: {len(data.values)} rows, too few for {what}, expected {needed} or more")
    if not np.any(data.values):
        raise InputError(f"{where}: every {data.axes[1][0]} is 0, expected measured values")
