"""The magnetic circuit of a solenoid from forces and inductances against its gap: the law `reluctance`.

Data: the columns ``gap``, ``force``, the magnitude of the pull, and ``inductance`` or ``linkage``, perhaps
``current``; a static measurement or field computation. Force and linkage at one current tell the saturation:
without it, the force is that current's square times half the slope of the inductance. Both are fitted by
their logarithms, so that each row counts by its relative error.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Final

import numpy as np

from printhammer.errors import InputError
from printhammer.identify.least_squares import Parameters
from printhammer.identify.result import Fit
from printhammer.identify.static.assemble import Data, assemble, enough, solved
from printhammer.parts.magnet.reluctance import MU0, ReluctanceMagnet, magnet_force, magnet_linkage
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
"""What is fitted, with its SI unit."""

_REACH: Final = 1e3
"""Factor by which constants may go away from those that the fit begins with."""

_ABSENT_HIGH: Final = ("saturation_flux", "leakage_reach")
"""Constants whose effect vanishes where they are large; of the others, where they are small."""

_FACTOR: Final = 4.0
"""Factor between force and slope of the inductance that no saturation explains; a pound-force is 4.4 N."""

_SPARE: Final = 4
"""Rows more than parameters, for the errors."""

_STARTS: Final = 8
"""Places from which the best constants are sought; the first is an estimate, the others scatter about it."""


def fit_solenoid(
    path: str | Path,
    *,
    turns: float,
    current: float | None = None,
    robust: bool = True,
    columns: str | None = None,
) -> Fit:
    """Fit the law `reluctance` to a table of one coil of a number of turns.

    The current, A, is that of all rows where the table has no column of it. What is fitted are the
    `CONSTANTS`, as of a magnet that pulls toward the paper and is closed at 0; a gap does not tell where
    that is. Options of all fits are described with `printhammer.identify.fitting.fit`.

    Raises
    ------
    InputError
        The table cannot be used, is too small, or has neither inductances nor linkages.
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
            expected="it or one current for all rows",
        )
    if "inductance" not in table.values and "linkage" not in table.values:
        raise InputError(
            f"{table.path}: neither 'inductance' nor 'linkage'",
            file=table.path,
            key="inductance",
            expected="one of these columns beside the force, or the saturation cannot be told",
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
    enough(data, len(CONSTANTS) + _SPARE, "the constants of the magnetic circuit and their errors")
    law = CircuitLaw(gap, currents, turns)
    start = _start(law, gap, force, linkage, data.values)
    least, most = start / _REACH, start * _REACH
    # Without fringe, iron or an end of the leakage, where the data show none.
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
    """Refuse forces that are far from what the inductances at the same currents ask for.

    Between neighbouring gaps the force is i^2 / 2 times the chord of the inductance; where the inductance
    falls as the inverse of the gap, their geometric mean is that exactly.
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
            f"{path}: the force is {factor:.3g} of what the slope of the inductance asks for (i^2/2 dL/dg)",
            file=path,
            key="force",
            value=factor,
            expected="forces, inductances, gaps and currents of one magnet, each in its unit",
        )


class CircuitLaw:
    """Logarithms of force and linkage at gaps, m, and currents, A, shape (2 m,); p are the `CONSTANTS`."""

    def __init__(self, gap: FloatArray, current: FloatArray, turns: float) -> None:
        self.turns = turns
        self.widest = float(gap.max())
        self.rows = list(zip(gap.tolist(), current.tolist(), strict=True))

    def value(self, p: FloatArray) -> FloatArray:
        """Return the logarithms."""
        constants = dict(zip(CONSTANTS, p.tolist(), strict=True))
        constants["leakage_reach"] = max(constants["leakage_reach"], (1.0 + 1e-9) * self.widest)
        c = ReluctanceMagnet(turns=self.turns, closed_at=0.0, **constants).packed(0.0)
        forces = [magnet_force(c, -gap, current) for gap, current in self.rows]
        linkages = [magnet_linkage(c, -gap, current) for gap, current in self.rows]
        logarithms: FloatArray = np.log(forces + linkages)
        return logarithms

    def jacobian(self, p: FloatArray) -> FloatArray:
        """Return the derivatives by the parameters, by central differences."""
        steps = 1e-5 * p
        columns = [
            (self.value(p + step) - self.value(p - step)) / (2.0 * size)
            for size, step in zip(steps, np.diag(steps), strict=True)
        ]
        return np.column_stack(columns)

    def spread(self, p: FloatArray) -> FloatArray:  # noqa: ARG002
        """Return the components of the variance: the relative errors of force and of linkage."""
        return np.repeat(np.eye(2), len(self.rows), axis=0)


def _start(
    law: CircuitLaw, gap: FloatArray, force: FloatArray, linkage: FloatArray, data: FloatArray
) -> FloatArray:
    """Return constants near the best ones: the best of several descents in their logarithms."""
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
