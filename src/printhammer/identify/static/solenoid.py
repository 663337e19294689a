"""Fit the magnetic circuit of a solenoid, the law `reluctance`, to forces and inductances over its gap.

Data: the columns ``gap``, ``force``, the magnitude of the pull, and ``inductance`` or ``linkage``, optionally
``current``; from a static measurement or a field computation. Force and linkage at one current determine the
saturation: without saturation, the force is half the square of the current times the slope of the inductance.
The logarithms of force and linkage are fitted, so that each row counts by its relative error.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.least_squares import Parameters
from printhammer.identify.result import Fit
from printhammer.identify.static.assemble import Data, assemble, check_rows, solved
from printhammer.parts.magnet.reluctance import (
    MU0,
    ReluctanceMagnet,
    magnet_force,
    magnet_linkage,
    magnet_packed,
)
from printhammer.support.arrays import FloatArray
from printhammer.support.tables.readings import read_table

CONSTANTS: Final = {
    "pole_area": "m^2",
    "residual_gap": "m",
    "fringe_perimeter": "m",
    "fringe_height": "m",
    "core_reluctance": "A/Wb",
    "saturation_flux": "Wb",
    "leakage": "H",
    "leakage_reach": "m",
}
"""Fitted constants and their SI units."""

_REACH: Final = 1e3
"""Largest factor between a fitted constant and its initial guess; arbitrary."""

_ABSENT_HIGH: Final = ("saturation_flux", "leakage_reach")
"""Constants whose effect vanishes at large values; the effect of every other constant vanishes at 0."""

_FACTOR: Final = 4.0  # Arbitrary
"""Ratio of force to i^2/2 dL/dg that saturation cannot explain, e.g. 4.4 for forces in lbf instead of N."""

_SPARE: Final = 4
"""Smallest number of rows in excess of parameters for which standard errors are computed; arbitrary."""

_STARTS: Final = 8  # Arbitrary
"""Number of initial guesses of the multi-start search: an estimate, and random points around the estimate."""


def fit_solenoid(
    path: str | Path,
    *,
    turns: float,
    current: float | None = None,
    robust: bool = True,
    columns: str | None = None,
) -> Fit:
    """Fit the law `reluctance` to a table of one coil with a given number of turns.

    `current` [A] applies to all rows of a table without a column of currents. The `CONSTANTS` are fitted for
    a magnet that pulls toward the paper and is closed at x = 0; a table over the gap does not determine the
    position at which the magnet is closed.
    For the other options, see `printhammer.identify.fitting.fit`.

    Raises
    ------
    InputError
        The table is invalid, is too small, or has neither inductances nor linkages.
    """
    more = {"current": "A", "inductance": "H", "linkage": "Wb", "armature flux": "Wb"}
    table = read_table(path, {"gap": "m", "force": "N"}, optional=more, columns=columns)
    if not turns > 0.0:
        raise InputError.of("turns", turns, "more than 0", written=f"{turns:g}")
    if "current" not in table.values and current is None:
        raise InputError(
            f"{table.path}: the column 'current' is missing",
            file=table.path,
            key="current",
            expected="this column, or one current for all rows",
        )
    if "inductance" not in table.values and "linkage" not in table.values:
        raise InputError(
            f"{table.path}: neither 'inductance' nor 'linkage'",
            file=table.path,
            key="inductance",
            expected="one of these columns besides the force, to determine the saturation",
        )
    gap, force = table.values["gap"], table.values["force"]
    currents = table.values.get("current", np.full(len(gap), current))
    linkage = table.values.get("linkage")
    if linkage is None:
        linkage = table.values["inductance"] * currents
    for name, values in (("current", currents), ("force", force), ("linkage", linkage)):
        low = int(np.argmin(values))
        if not values[low] > 0.0:
            where = f"{table.path}: line {table.lines[low]}"
            raise InputError(
                f"{where}: the {name} is {values[low]:.4g}", file=where, key=name, expected="more than 0"
            )
    if gap.min() < 0.0:
        low = int(np.argmin(gap))
        raise InputError(
            f"{table.path}: line {table.lines[low]}: gap {gap[low]:.4g} m",
            file=table.path,
            key="gap",
            expected="0 or more",
        )
    _check_factor(table.path, gap, currents, force, linkage)
    rows = len(gap)
    data = Data(
        (table.path,),
        "solenoid",
        np.concatenate([gap, gap]),
        np.log(np.concatenate([force, linkage])),
        (("gap", "m"), ("logarithm", "1")),
        np.repeat([0, 1], rows),
        ("ln(force / N)", "ln(linkage / Wb)"),
        np.concatenate([table.lines, table.lines]),
    )
    check_rows(data, len(CONSTANTS) + _SPARE, "the constants of the magnetic circuit and their errors")
    law = CircuitLaw(gap, currents, turns)
    start = _start(law, gap, force, linkage, data.values)
    least, most = start / _REACH, start * _REACH
    # Values without fringe, iron or a limit of the leakage, for constants that the data do not determine.
    rest = np.where([name in _ABSENT_HIGH for name in CONSTANTS], most, least)
    space = Parameters.of(start, low=least, high=most, size=0.0, rest=rest)
    solution = solved(data, law, space, robust=robust)
    given = {"magnet.turns": f"{turns!r} 1"}
    if "current" not in table.values:
        given["current"] = f"{current!r} A"
    return assemble(
        data,
        law,
        solution,
        [(f"magnet.{name}", unit, True) for name, unit in CONSTANTS.items()],
        given=given,
        remedies={"magnet.pole_area": "more rows over a wider span of the gap"},
    )


def _check_factor(
    path: Path, gap: FloatArray, current: FloatArray, force: FloatArray, linkage: FloatArray
) -> None:
    """Raise `InputError` if the forces differ greatly from i^2/2 dL/dg at the same currents.

    Between neighbouring gaps the force is i^2 / 2 times the difference quotient of the inductance; for an
    inductance inversely proportional to the gap, the geometric mean of the two forces equals it exactly.
    """
    order = np.lexsort((gap, current))
    g, i, f, inductance = gap[order], current[order], force[order], (linkage / current)[order]
    same = (np.diff(i) <= 1e-6 * i[1:]) & (np.diff(g) > 0.0)
    with np.errstate(all="ignore"):
        asked = -0.5 * i[1:] ** 2 * np.diff(inductance) / np.diff(g)
        factors = (np.sqrt(f[1:] * f[:-1]) / asked)[same & (asked > 0.0)]
    if not factors.size:
        return
    factor = float(np.median(factors))
    if not 1.0 / _FACTOR < factor < _FACTOR:
        raise InputError(
            f"{path}: the force is {factor:.3g} times the value from the inductance (i^2/2 dL/dg)",
            file=path,
            key="force",
            value=factor,
            expected="forces, inductances, gaps and currents of one magnet, each in its unit",
        )


class CircuitLaw:
    """Logarithms of force and linkage at m gaps and currents (SI), shape (2 m,); p contains `CONSTANTS`."""

    def __init__(self, gap: FloatArray, current: FloatArray, turns: float) -> None:
        magnet = ReluctanceMagnet(turns=turns, pole_area=1.0, closed_at=0.0)
        self.turns = turns
        self.numbers = list(magnet.numbers())
        self.places = [magnet.names().index(name) for name in CONSTANTS]
        self.widest = float(gap.max())
        self.rows = list(zip(gap.tolist(), current.tolist(), strict=True))

    def value(self, p: FloatArray) -> FloatArray:
        """Compute the logarithms of the forces [N] and flux linkages [Wb] at the measured points."""
        # The constants are positive; building a magnet, to validate them, would take a third of the fit.
        *constants, reach = p.tolist()
        numbers = self.numbers.copy()
        for place, value in zip(
            self.places, [*constants, max(reach, (1.0 + 1e-9) * self.widest)], strict=True
        ):
            numbers[place] = value
        c = [0.0] * len(numbers)
        magnet_packed(numbers, 0.0, c)
        forces = [magnet_force(c, -gap, current) for gap, current in self.rows]
        linkages = [magnet_linkage(c, -gap, current) for gap, current in self.rows]
        logarithms: FloatArray = np.log(forces + linkages)
        return logarithms

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Compute the derivatives of the logarithms with respect to the parameters by central differences."""
        steps = 1e-5 * p
        columns = [
            (self.value(p + step) - self.value(p - step)) / (2.0 * size)
            for size, step in zip(steps, np.diag(steps), strict=True)
        ]
        return np.column_stack(columns)

    def variance_columns(self, p: FloatArray) -> FloatArray:  # noqa: ARG002
        """Return the variance coefficients of the relative errors of force and linkage, shape (2 m, 2)."""
        return np.repeat(np.eye(2), len(self.rows), axis=0)


def _start(
    law: CircuitLaw, gap: FloatArray, force: FloatArray, linkage: FloatArray, data: FloatArray
) -> FloatArray:
    """Estimate the initial guess by a multi-start least-squares search in the logarithms of the constants."""
    from scipy.optimize import least_squares

    current = np.array([row[1] for row in law.rows])
    scale, widest = MU0 * law.turns**2, float(gap.max())
    residual = 0.05 * widest
    area = float(np.median(2.0 * force * (gap + residual) ** 2 / (scale * current**2)))
    least = float((linkage / current).min())
    first = np.array(
        [
            area,
            residual,
            2.0 * math.sqrt(math.pi * area),
            widest,
            0.2 * law.turns**2 * float((current / linkage).min()),
            1.2 * float(linkage.max()) / law.turns,
            0.3 * least,
            3.0 * widest,
        ]
    )

    def residuals(logs: FloatArray) -> FloatArray:
        away = law.value(np.exp(logs)) - data
        return np.where(np.isfinite(away), away, 10.0)

    scatter = np.random.default_rng(0).normal(0.0, 0.4, (_STARTS, len(first)))
    scatter[0] = 0.0
    with np.errstate(all="ignore"):
        found = [least_squares(residuals, np.log(first) + each, max_nfev=300) for each in scatter]
    best = min(found, key=lambda each: float(each.cost))
    return np.exp(np.asarray(best.x, dtype=np.float64))
