"""Magnet, equation (3): permanent magnet and bucking coil as one fitted force.

    Fm = F0 - (Am - Bm I)^2 / sqrt(x)

Source: F. Hendriks, IBM J. Res. Develop. 27 (1983), equation (3), a fit to forces measured at several
currents. The same coenergy, W' = F0 x - 2 (Am - Bm I)^2 sqrt(x), determines the flux linkage

    lambda = dW'/dI = 4 Bm (Am - Bm I) sqrt(x),

whose derivative with respect to the current is negative: the coil needs a constant inductance above
4 Bm^2 sqrt(x).
Validity: the measured range of x and I, which the paper does not print; state the range of x as `range_min`
and `range_max`.
Weakness: singular at x = 0, where the origin is arbitrary (the backstop sits at 0.002 in); the pull grows
again if Bm I exceeds Am; no eddy currents, no back-EMF.

Packed constants: c = [F0, Am, Bm].
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from pydantic import model_validator

from printhammer.parts.base import MagnetPart, register
from printhammer.support.constants import quantity


def magnet_force(c: Any, x: float, current: float) -> float:
    """Return the net magnetic force of equation (3), N; NaN for x <= 0, where the law does not hold."""
    if x <= 0.0:
        return math.nan
    pull = c[1] - c[2] * current
    # Independent division and root run in parallel, faster than in sequence.
    return float(c[0] - pull * pull / x * math.sqrt(x))


def magnet_energy(c: Any, x: float) -> float:
    """Return the potential energy at zero current, 2 Am^2 sqrt(x) - F0 x, J; NaN for x < 0.

    The energy is zero at x = 0.
    """
    if x < 0.0:
        return math.nan
    return float(2.0 * c[1] * c[1] * math.sqrt(x) - c[0] * x)


def magnet_linkage(c: Any, x: float, current: float) -> float:
    """Return the flux linkage 4 Bm (Am - Bm I) sqrt(x), Wb; NaN for x < 0."""
    if x < 0.0:
        return math.nan
    return float(4.0 * c[2] * (c[1] - c[2] * current) * math.sqrt(x))


def magnet_emf(c: Any, x: float, current: float) -> float:
    """Return the derivative of the flux linkage with respect to displacement, Wb/m; NaN for x <= 0."""
    if x <= 0.0:
        return math.nan
    return float(2.0 * c[2] * (c[1] - c[2] * current) / math.sqrt(x))


def magnet_inductance(c: Any, x: float, current: float) -> float:
    """Return the derivative of the flux linkage with respect to current, H; NaN for x < 0."""
    if x < 0.0:
        return math.nan
    return float(-4.0 * c[2] * c[2] * math.sqrt(x))


def magnet_current(c: Any, x: float, linkage: float, inductance: float) -> float:
    """Return the current [A] for the flux linkage of magnet and series inductance.

    The result is NaN where this linkage does not increase with the current.
    """
    if x < 0.0:
        return math.nan
    depth = 4.0 * c[2] * math.sqrt(x)
    slope = inductance - depth * c[2]
    if slope <= 0.0:
        return math.nan
    return float((linkage - depth * c[1]) / slope)


def magnet_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (F0, Am, Bm) to `c` from the part's values `q`; return their count."""
    c[0], c[1], c[2] = q[0], q[1], q[2]
    return 3


def magnet_domain(q: Any, ends: Any) -> None:
    """Write the displacement range [m] in which the law is valid to `ends`, from the part's values `q`.

    The lower end is 0 if the part states none; at x = 0 itself, the law is singular.
    """
    ends[0] = 0.0 if math.isnan(q[3]) else q[3]
    ends[1] = math.inf if math.isnan(q[4]) else q[4]


@register
class InverseRootMagnet(MagnetPart):
    """Magnet of equation (3), with the constants F0, Am and Bm."""

    law: ClassVar[str] = "inverse-root"

    F0: float = quantity("N", "F0", "largest magnetic force", gt=0)
    Am: float = quantity("N^0.5 m^0.25", "Am", "pull of the permanent magnet", gt=0)
    Bm: float = quantity("N^0.5 m^0.25/A", "Bm", "reduction of the pull by the coil current", ge=0)
    range_min: float | None = quantity("m", "x_min", "smallest displacement of the fit", ge=0, default=None)
    range_max: float | None = quantity("m", "x_max", "largest displacement of the fit", gt=0, default=None)

    @model_validator(mode="after")
    def _range_is_ordered(self) -> InverseRootMagnet:
        if self.range_min is not None and self.range_max is not None and self.range_min >= self.range_max:
            raise ValueError("range_min is not below range_max")
        return self
