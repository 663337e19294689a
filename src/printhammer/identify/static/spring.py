"""Fit the spring to its force against displacement: Bs and As of equation (4).

    F = Bs - (Bs / As)(x - b)

Data: the columns ``displacement`` and ``force`` of the spring alone, positive toward the paper.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.result import Fit
from printhammer.identify.static.assemble import Data, assemble, check_rows, judge, solved
from printhammer.support.arrays import FloatArray
from printhammer.support.tables.readings import read_table

_ROWS = 5  # Smallest number of rows for two constants and their errors; arbitrary


class SpringLaw:
    """Spring force, equation (4), at displacements x - b [m] from the backstop, shape (m,); p = [Bs, As]."""

    def __init__(self, travel: FloatArray) -> None:
        self.travel = travel

    def value(self, p: FloatArray) -> FloatArray:
        """Compute the force of the spring, N."""
        return np.asarray(p[0] * (1.0 - self.travel / p[1]))

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Compute the derivatives of the force with respect to Bs and As."""
        return np.column_stack([1.0 - self.travel / p[1], p[0] * self.travel / (p[1] * p[1])])

    def variance_columns(self, p: FloatArray) -> FloatArray:  # noqa: ARG002
        """Return the variance coefficients, all 1: errors in x act like errors of the linear force."""
        return np.ones((len(self.travel), 1))


def fit_spring(path: str | Path, *, position: float, robust: bool = True, columns: str | None = None) -> Fit:
    """Fit "spring.Bs" and "spring.As" to a table with the columns ``displacement`` and ``force``.

    `position` is the position b of the backstop, m; for the other options, see
    `printhammer.identify.fitting.fit`.

    Raises
    ------
    InputError
        The table is invalid, is too small, or its force does not fall linearly from a positive value.
    """
    table = read_table(path, {"displacement": "m", "force": "N"}, columns=columns)
    x, force = table.values["displacement"], table.values["force"]
    data = Data(
        (table.path,),
        "spring",
        x,
        force,
        (("displacement", "m"), ("force", "N")),
        np.zeros(len(x), dtype=np.int64),
        ("spring",),
        table.lines,
    )
    check_rows(data, _ROWS, "the two constants of the spring and their errors")
    if len(np.unique(x)) < 3:
        raise InputError(
            f"{table.path}: {len(np.unique(x))} different displacements",
            file=table.path,
            key="displacement",
            expected="3 or more, to fit a line",
        )
    law = SpringLaw(x - position)
    solution = solved(data, law, start_of(table.path, x - position, force), robust=robust)
    middle, half = 0.5 * (x.min() + x.max()), 0.5 * (x.max() - x.min())
    u = (x - middle) / half
    bent = "the force is not a linear function of the displacement"
    p_value, why = judge(solution, {bent: u * u, f"{bent} but oscillates about a line": u**3}, x, data.series)
    return assemble(
        data,
        law,
        solution,
        [("spring.Bs", "N", True), ("spring.As", "m", True)],
        given={"backstop.position": f"{position!r} m"},
        remedies=dict.fromkeys(("spring.Bs", "spring.As"), "more rows over a wider span of displacement"),
        rejected=why,
        p_value=p_value,
    )


def start_of(path: Path, travel: FloatArray, force: FloatArray) -> FloatArray:
    """Return initial guesses of the spring constants Bs and As by the Theil-Sen estimator.

    The estimator is robust to outliers. `travel` is the displacement from the backstop, m.
    """
    from scipy.stats import theilslopes

    slope, height = (float(part) for part in theilslopes(force, travel)[:2])
    if not slope < 0.0:
        raise InputError(
            f"{path}: the spring force rises by {slope:.3g} N/m with the displacement",
            file=path,
            key="force",
            expected="a force toward the paper that decreases",
        )
    if not height > 0.0:
        raise InputError(
            f"{path}: the spring force at the backstop is {height:.3g} N",
            file=path,
            key="force",
            expected="a positive force, toward the paper",
        )
    return np.array([height, -height / slope])
