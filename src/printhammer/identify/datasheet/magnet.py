"""The magnet of a data sheet: the reluctance law whose forces and inductance are those that a maker prints.

A sheet has a few forces at one current, where the law has seven constants. So what the sheet does not settle
is held near what such devices have: every constant but the area has a guess and a spread, in logarithms, and
the sum of squared misfits of forces, inductance and guesses is made least. A constant that comes out much
less uncertain than its guess was is derived; another one is assumed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from printhammer.parts.magnet import reluctance as law
from printhammer.parts.magnet.reluctance import MU0, ReluctanceMagnet
from printhammer.support.arrays import FloatArray

FORCE_ERROR: Final = 0.03
"""Relative error of a printed force."""

INDUCTANCE_ERROR: Final = 0.05
"""Relative error of a printed inductance."""

DERIVED: Final = 0.5
"""Of its guess's spread: a constant that is less uncertain than this is derived."""


@dataclass(frozen=True)
class Guess:
    """What such devices have."""

    value: float
    spread: float
    """Standard deviation of the logarithm."""
    why: str


GUESSES: Final = {
    "turns": Guess(1000.0, 0.7, "1000 turns within a factor 2"),
    "residual_gap": Guess(
        0.1e-3, 1.0, "air beside the armature and a film at the stop, 0.1 mm within a factor e"
    ),
    "core": Guess(0.05e-3, 1.0, "iron like 0.05 mm of air, within a factor e"),
    "field": Guess(1.6, 0.2, "1.6 T in the core at saturation, within 20 %"),
    "fringe": Guess(0.5, 0.7, "flanks that fringe half as high as the pole's radius, within a factor 2"),
    "leakage": Guess(0.3, 1.0, "a third of the printed inductance passes the armature, within a factor e"),
}
"""Constants in the terms in which devices of all sizes are alike; core is a gap, leakage a share."""


@dataclass(frozen=True)
class Sheet:
    """What a data sheet says of the magnet, SI."""

    current: float
    """Current of the forces, A."""
    gaps: FloatArray
    forces: FloatArray
    """Gaps, m, and forces there, N."""
    inductance: tuple[float, float] | None
    """Inductance at small currents, H, and the gap where it was measured, m."""
    turns: float | None
    area: float | None
    """Area of the pole face, m^2; like the turns None where the sheet does not tell."""
    residual_gap: float | None
    """Air in series with the gap, m; None where the sheet does not tell."""
    closed_at: float
    """Displacement at which the gap is closed, m."""


@dataclass(frozen=True)
class SheetMagnet:
    """A magnet and how its constants came about."""

    part: ReluctanceMagnet
    derived: dict[str, float]
    """Constants that the sheet settles, with their relative standard errors."""
    assumed: dict[str, str]
    """The others, with what was assumed."""
    forces: FloatArray
    """Forces of the law at the gaps of the sheet, N."""
    misfit: float
    """Largest relative deviation of these."""
    inductance: float
    """Inductance of the law at small currents at full gap or where it was measured, H."""


def fit_magnet(sheet: Sheet) -> SheetMagnet:
    """Fit the reluctance law to a data sheet."""
    from scipy.optimize import least_squares

    known = {"turns": sheet.turns is not None, "leakage": sheet.inductance is None}
    known["residual_gap"] = sheet.residual_gap is not None
    names = [name for name in GUESSES if not known.get(name)]
    # The area that the force at the widest gap would have without fringe and iron.
    widest = int(np.argmax(sheet.gaps))
    open_gap = float(sheet.gaps[widest]) + GUESSES["residual_gap"].value
    turned = (sheet.turns or GUESSES["turns"].value) * sheet.current
    first = 2.0 * float(sheet.forces[widest]) * open_gap**2 / (MU0 * turned**2)
    free = sheet.area is None
    start = [0.0] * (free + len(names))

    def made(moved: FloatArray) -> ReluctanceMagnet:
        area = first * math.exp(moved[0]) if free else float(sheet.area or 0.0)
        each = {
            name: GUESSES[name].value * math.exp(GUESSES[name].spread * move)
            for name, move in zip(names, moved[free:], strict=True)
        }
        share = each.get("leakage", 0.0)
        return ReluctanceMagnet(
            turns=each.get("turns", sheet.turns or 0.0),
            pole_area=area,
            closed_at=sheet.closed_at,
            residual_gap=each.get("residual_gap", sheet.residual_gap or 0.0),
            fringe_perimeter=2.0 * math.sqrt(math.pi * area),
            fringe_height=each["fringe"] * math.sqrt(area / math.pi),
            core_reluctance=each["core"] / (MU0 * area),
            saturation_flux=each["field"] * area,
            leakage=share * sheet.inductance[0] if sheet.inductance else 0.0,
        )

    def off(moved: FloatArray) -> FloatArray:
        part = made(moved)
        rows = list(np.log(forces_of(part, sheet) / sheet.forces) / FORCE_ERROR)
        if sheet.inductance is not None:
            rows.append(math.log(inductance_of(part, sheet) / sheet.inductance[0]) / INDUCTANCE_ERROR)
        return np.array([*rows, *moved[free:]])

    best = least_squares(off, start, xtol=1e-14, ftol=1e-14, gtol=1e-12, max_nfev=400)
    slopes = np.asarray(best.jac)
    spread = np.sqrt(np.diag(np.linalg.pinv(slopes.T @ slopes)))[free:]
    part = made(best.x)
    return _described(sheet, part, dict(zip(names, spread.tolist(), strict=True)), forces_of)


def forces_of(part: ReluctanceMagnet, sheet: Sheet) -> FloatArray:
    """Return the forces of a magnet at the gaps of a sheet, N."""
    c = part.packed(0.0)
    places = (sheet.closed_at - sheet.gaps).tolist()
    return np.array([law.magnet_force(c, place, sheet.current) for place in places])


def inductance_of(part: ReluctanceMagnet, sheet: Sheet) -> float:
    """Return the inductance of a magnet at small currents, H, at the gap of the sheet's or the widest one."""
    gap = float(sheet.gaps.max()) if sheet.inductance is None else sheet.inductance[1]
    return law.magnet_inductance(part.packed(0.0), sheet.closed_at - gap, 0.0)


def _described(
    sheet: Sheet,
    part: ReluctanceMagnet,
    spread: dict[str, float],
    forces: Callable[[ReluctanceMagnet, Sheet], FloatArray],
) -> SheetMagnet:
    """Sort the constants into derived and assumed ones."""
    key = {
        "turns": "turns",
        "residual_gap": "residual_gap",
        "core": "core_reluctance",
        "field": "saturation_flux",
        "fringe": "fringe_height",
        "leakage": "leakage",
    }
    settled = {name for name, left in spread.items() if left < DERIVED}
    derived = {key[name]: spread[name] * GUESSES[name].spread for name in settled}
    assumed = {key[name]: GUESSES[name].why for name in spread if name not in settled}
    at_gaps = forces(part, sheet)
    return SheetMagnet(
        part=part,
        derived=derived,
        assumed=assumed,
        forces=at_gaps,
        misfit=float(np.abs(at_gaps / sheet.forces - 1.0).max()),
        inductance=inductance_of(part, sheet),
    )
