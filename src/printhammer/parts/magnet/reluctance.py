"""Solenoid or pot magnet as a magnetic circuit: gap with fringing, saturating core, leakage.

    N i = Phi / P(g) + Rc Phi / (1 - Phi / Phi_s),    P = mu0 [A / (g + g0) + (U / pi) ln(1 + 2 h / (g + g0))]
    lambda = N Phi + Ls (1 - g / gs) i,               g = closed_at - x, or x - closed_at

The flux Phi of N turns crosses the gap g and, in series, the residual gap g0 and the core. The fringing field
beside the pole face of area A runs in half annuli between flanks of perimeter U and height h. The core
follows Froehlich and Kennelly: reluctance Rc at small flux, saturation at the flux Phi_s. The leakage Ls
links the coil but bypasses the core; it decreases with the gap, as for a plunger that leaves the coil, and
vanishes at gs. Force, linkage and their slopes come from one coenergy, maximised over Phi:

    W' = N i Phi - Phi^2 / (2 P) + Rc Phi_s^2 [Phi / Phi_s + ln(1 - Phi / Phi_s)] + Ls (1 - g / gs) i^2 / 2

Far from saturation F = (i^2 / 2) dL/dx. Flux from current, and current from linkage, are quadratic equations,
solved without cancellation.

    [magnet]
    law = "reluctance"
    turns = { value = 957, unit = "1", status = "stated", source = "winding sheet" }
    pole_area = { value = 50, unit = "mm^2", status = "stated", source = "drawing" }
    residual_gap = { value = 0.2, unit = "mm", status = "assumed", source = "air beside the armature" }
    closed_at = { value = 5, unit = "mm", status = "stated", source = "drawing" }
    saturation_flux = { value = 1.5e-4, unit = "Wb", status = "derived", source = "1.9 T in the core" }
    core_reluctance = { value = 2e5, unit = "A/Wb", status = "derived", source = "length of the core" }

Source: H. C. Roters, Electromagnetic Devices (1941), chapters 5 (permeances) and 8 (plungers);
A. E. Kennelly, Trans. AIEE 8 (1891) 485 (core).
Validity: quasi-static flux, gaps above -g0 and below gs. Weakness: one core of one cross section; hysteresis,
remanence, the low permeability of iron at small fields, and eddy currents are neglected (a shorted turn of
the coil can represent eddy currents).

Packed constants: c = [dg/dx, closed_at, mu0 N^2 A, g0, mu0 N^2 U / pi, 2 h, Ls, Ls / gs, Rc / N^2,
1 / (N Phi_s)].
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final, Literal

from pydantic import Field, model_validator

from printhammer.parts.base import MagnetPart, register
from printhammer.support.constants import quantity

MU0: Final = 4e-7 * math.pi
"""Magnetic constant, H/m, to nine digits."""


def _gap_inductance(c: Any, x: float) -> float:
    """Return N^2 P, the inductance of the gap, H; NaN outside the range of the law."""
    g = c[0] * (x - c[1])
    s = g + c[3]
    if not (s > 0.0 and c[6] - c[7] * g >= 0.0):
        return math.nan
    return float(c[2] / s + c[4] * math.log(1.0 + c[5] / s))


def _gap_slope(c: Any, x: float) -> float:
    """Return N^2 dP/dg, the derivative of the gap inductance with respect to the gap, H/m."""
    s = c[0] * (x - c[1]) + c[3]
    return float(-(c[2] / s + c[4] * c[5] / (s + c[5])) / s)


def _unsaturated(p: float, q: float, y: float) -> float:
    """Solve p (1 - v) + q (1 - v) / v = y for v in [0, 1]; p > 0, q >= 0, y >= 0.

    The solution v = 1 - |Phi| / Phi_s is 1 at zero flux and 0 at saturation of the core.
    """
    d = p - q - y
    root = math.sqrt(d * d + 4.0 * p * q)
    if d > 0.0:
        return 0.5 * (d + root) / p
    return 2.0 * q / (root - d) if root > d else 0.0


def magnet_force(c: Any, x: float, current: float) -> float:
    """Return the magnetic force [N]; NaN outside the range of the law."""
    length = _gap_inductance(c, x)
    if not length > 0.0:
        return math.nan
    p = 1.0 / length
    drop = p * current / (p + c[8] / _unsaturated(p, c[8], c[9] * abs(current)))
    return float(0.5 * c[0] * (drop * drop * _gap_slope(c, x) - c[7] * current * current))


def magnet_energy(c: Any, x: float) -> float:
    """Return 0 J, the potential energy at zero current; NaN outside the range of the law."""
    return 0.0 * _gap_inductance(c, x)


def magnet_linkage(c: Any, x: float, current: float) -> float:
    """Return the flux linkage [Wb]; NaN outside the range of the law."""
    length = _gap_inductance(c, x)
    if not length > 0.0:
        return math.nan
    p = 1.0 / length
    main = current / (p + c[8] / _unsaturated(p, c[8], c[9] * abs(current)))
    return float(main + (c[6] - c[7] * c[0] * (x - c[1])) * current)


def magnet_emf(c: Any, x: float, current: float) -> float:
    """Return the derivative of the linkage with respect to x, Wb/m; NaN outside the range of the law."""
    length = _gap_inductance(c, x)
    if not length > 0.0:
        return math.nan
    p = 1.0 / length
    v = _unsaturated(p, c[8], c[9] * abs(current))
    main = current / (p + c[8] / v) * p * p / (p + c[8] / (v * v))
    return float(c[0] * (main * _gap_slope(c, x) - c[7] * current))


def magnet_inductance(c: Any, x: float, current: float) -> float:
    """Return the differential inductance d(linkage)/dI, H; NaN outside the range of the law."""
    length = _gap_inductance(c, x)
    if not length > 0.0:
        return math.nan
    p = 1.0 / length
    v = _unsaturated(p, c[8], c[9] * abs(current))
    return float(1.0 / (p + c[8] / (v * v)) + (c[6] - c[7] * c[0] * (x - c[1])))


def magnet_current(c: Any, x: float, linkage: float, inductance: float) -> float:
    """Return the current [A] for the flux linkage of magnet and series inductance.

    The result is NaN outside the range of the law; without leakage and series inductance, also at or above
    the saturation flux.
    """
    length = _gap_inductance(c, x)
    if not length > 0.0:
        return math.nan
    p = 1.0 / length
    stray = inductance + (c[6] - c[7] * c[0] * (x - c[1]))
    v = _unsaturated(1.0 + stray * p, stray * c[8], c[9] * abs(linkage))
    if not v > 0.0:
        return math.nan
    turned = p + c[8] / v
    return float(linkage * turned / (1.0 + stray * turned))


_TURNS, _AREA, _CLOSED_AT, _RESIDUAL_GAP, _PERIMETER, _HEIGHT = range(6)
_CORE, _SATURATION, _LEAKAGE, _REACH, _PULL = range(6, 11)
"""Indices of constants in `numbers`; the pull is 0 toward the paper and 1 toward the backstop."""


def magnet_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants to `c`, in the order stated by the module; return their count.

    `q` holds the values of the part.
    """
    square = q[_TURNS] ** 2
    scale = MU0 * square
    c[0] = -1.0 if q[_PULL] == 0.0 else 1.0
    c[1] = q[_CLOSED_AT]
    c[2] = scale * q[_AREA]
    c[3] = q[_RESIDUAL_GAP]
    c[4] = scale * q[_PERIMETER] / math.pi
    c[5] = 2.0 * q[_HEIGHT]
    c[6] = q[_LEAKAGE]
    c[7] = 0.0 if math.isnan(q[_REACH]) else q[_LEAKAGE] / q[_REACH]
    c[8] = q[_CORE] / square
    c[9] = 0.0 if math.isnan(q[_SATURATION]) else 1.0 / (q[_TURNS] * q[_SATURATION])
    return 10


def magnet_domain(q: Any, ends: Any) -> None:
    """Write the displacement range [m] in which the law is valid to `ends`, from the part's values `q`.

    The end at which the gap is -g0 is itself excluded.
    """
    reach = math.inf if math.isnan(q[_REACH]) else q[_REACH]
    if q[_PULL] == 0.0:
        ends[0], ends[1] = q[_CLOSED_AT] - reach, q[_CLOSED_AT] + q[_RESIDUAL_GAP]
    else:
        ends[0], ends[1] = q[_CLOSED_AT] - q[_RESIDUAL_GAP], q[_CLOSED_AT] + reach


@register
class ReluctanceMagnet(MagnetPart):
    """Magnetic circuit with one gap, a saturating core and leakage."""

    law: ClassVar[str] = "reluctance"

    turns: float = quantity("1", "N", "turns of the coil", gt=0)
    pole_area: float = quantity("m^2", "A", "area of the pole face", gt=0)
    closed_at: float = quantity("m", "x_c", "displacement at which the gap is closed")
    residual_gap: float = quantity("m", "g0", "residual air gap in series with the gap", ge=0, default=0.0)
    fringe_perimeter: float = quantity("m", "U", "perimeter of the fringing flanks", ge=0, default=0.0)
    fringe_height: float = quantity("m", "h", "height of the fringing flanks", ge=0, default=0.0)
    core_reluctance: float = quantity("A/Wb", "Rc", "reluctance of the core at small flux", ge=0, default=0.0)
    saturation_flux: float | None = quantity("Wb", "Phi_s", "saturation flux of the core", gt=0, default=None)
    leakage: float = quantity("H", "Ls", "leakage of the coil at the closed gap", ge=0, default=0.0)
    leakage_reach: float | None = quantity("m", "gs", "gap at which the leakage vanishes", gt=0, default=None)
    pull: Literal["paper", "backstop"] = Field("paper", description="surface toward which the magnet pulls")

    @model_validator(mode="after")
    def _constants_belong_together(self) -> ReluctanceMagnet:
        if self.saturation_flux is not None and self.core_reluctance == 0.0:
            raise ValueError("saturation_flux is given without a core_reluctance: expected both or none")
        if (self.fringe_perimeter == 0.0) != (self.fringe_height == 0.0):
            raise ValueError("expected both fringe_perimeter and fringe_height or none of them")
        if self.leakage_reach is not None and self.leakage == 0.0:
            raise ValueError("leakage_reach is given without a leakage: expected both or the leakage alone")
        return self
