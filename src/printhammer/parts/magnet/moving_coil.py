"""Moving coil (voice coil) in the field of a permanent magnet.

    Fm = k i,    lambda = k x

The coil of wire length l moves across a constant flux density B, k = B l; the back-EMF is k v. Force and
linkage come from the coenergy W' = k x i.

    [magnet]
    law = "moving-coil"
    constant = { value = 4.2, unit = "N/A", status = "stated", source = "data sheet of the voice coil" }

Source: the force on a current across a field, F = B l i, and Faraday's law.
Validity: the range of travel over which the field is constant. Weakness: k falls toward the ends of the
travel, and the field of the current itself (reluctance force) is neglected. A voltage-driven coil must have
an inductance: the linkage alone does not determine the current.

Packed constants: c = [k].
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from printhammer.parts.base import MagnetPart, register
from printhammer.support.constants import quantity


def magnet_force(c: Any, x: float, current: float) -> float:
    """Return the force k i on the moving coil, N."""
    return float(c[0] * current)


def magnet_energy(c: Any, x: float) -> float:
    """Return 0 J, the potential energy at zero current, where there is no magnetic force."""
    return 0.0


def magnet_linkage(c: Any, x: float, current: float) -> float:
    """Return the flux linkage k x of the permanent field, Wb."""
    return float(c[0] * x)


def magnet_emf(c: Any, x: float, current: float) -> float:
    """Return k [V s/m], the back-EMF divided by the velocity of the armature."""
    return float(c[0])


def magnet_inductance(c: Any, x: float, current: float) -> float:
    """Return 0 H, the derivative of the flux linkage of the permanent field with respect to current."""
    return 0.0


def magnet_current(c: Any, x: float, linkage: float, inductance: float) -> float:
    """Return the current [A] for the flux linkage of magnet and series inductance; NaN without inductance."""
    return float((linkage - c[0] * x) / inductance) if inductance > 0.0 else math.nan


def magnet_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (k,) to `c` from the part's values `q`; return their count."""
    c[0] = q[0]
    return 1


@register
class MovingCoilMagnet(MagnetPart):
    """Moving coil in a permanent field, with the force constant k."""

    law: ClassVar[str] = "moving-coil"

    constant: float = quantity("N/A", "k", "force per current, and back-EMF per speed")
