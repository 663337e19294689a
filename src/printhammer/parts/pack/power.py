"""Ribbon and paper pack, equation (5), with hysteresis.

    loading    Fp = -S r^2.7
    unloading  Fp = -S rmax^-8.3 r^11          r = (x - xp)/d,  S = Ai Ep

Source: F. Hendriks, IBM J. Res. Develop. 27 (1983), equation (5), after Wang and Hall. The printed x_max/d is
read as rmax = (x_max - xp)/d, so that both branches meet at the turning point (11 - 8.3 = 2.7).
Validity: paper that has not been indented before, no mechanical failure; no humidity, no plastic memory. Each
contact meets fresh paper; a new local maximum inside a contact resets rmax. Reloading inside a contact
follows the loading branch, as printed, or the unloading curve up to rmax, as a measured pack shows
(`reloading`).
Weakness: as printed, the force jumps where reloading begins; the pack never pulls and keeps no permanent set.

Packed constants: c = [S, xp, 1/d].
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Literal

from printhammer.parts.base import PackPart, register
from printhammer.support.constants import quantity

MEMORY = True


def pack_loading(c: Any, x: float, v: float) -> float:
    """Return the force [N] of the loading branch of equation (5), not positive; 0 for x <= xp."""
    r = (x - c[1]) * c[2]
    if r <= 0.0:
        return 0.0
    return float(-c[0] * r * r * math.pow(r, 0.7))


def pack_memory(c: Any, peak: float) -> float:
    """Return q = S rmax^-8.3 [N], the constant of the unloading branch after a local maximum at `peak` [m].

    rmax is the indentation at the local maximum divided by d. The result is 0 for an indentation below
    1e-30 d, whose force would be below 1e-81 S.
    """
    r = (peak - c[1]) * c[2]
    if r <= 1e-30:
        return 0.0
    return float(c[0] * math.pow(r, -8.3))


def pack_unloading(c: Any, x: float, v: float, q: float) -> float:
    """Return the force [N] of the unloading branch of equation (5), -q r^11; 0 for x <= xp."""
    r = (x - c[1]) * c[2]
    if r <= 0.0:
        return 0.0
    r2 = r * r
    r4 = r2 * r2
    return float(-q * (r4 * r4) * (r2 * r))


def pack_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (S, xp, 1/d) to `c`; return their count.

    The first values `q` of the part are xp, S and d, in this order.
    """
    c[0], c[1], c[2] = q[1], q[0], 1.0 / q[2]
    return 3


@register
class PowerPack(PackPart):
    """Ribbon and paper pack of equation (5), with stiffness S, front xp and thickness d."""

    law: ClassVar[str] = "power"

    stiffness: float = quantity("N", "AiEp", "indenter area times pack stiffness", gt=0)
    front: float = quantity("m", "xp", "front of the ribbon and paper pack")
    thickness: float = quantity("m", "d", "thickness of the ribbon and paper pack", gt=0)
    reloading: Literal["loading-branch", "unloading-curve"] = "loading-branch"
