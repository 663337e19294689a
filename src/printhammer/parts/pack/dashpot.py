"""Pack of a linear spring and a dashpot in parallel (Kelvin-Voigt).

    Fp = -(K (x - xp) + C v)      for x > xp

Source: the Kelvin-Voigt solid; the contact of the textbook impact oscillator.
Validity: small indentations of a pack that recovers fully. Weakness: the dashpot acts from first touch, so
the force jumps there, and near the end of a contact the force would be attractive; `pull = false` (the
default) cuts the force off at zero.

Packed constants: c = [K, C, xp, 1 if it may pull else 0].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import PackPart, register
from printhammer.support.constants import quantity

MEMORY = False


def pack_loading(c: Any, x: float, v: float) -> float:
    """Return the force of spring and dashpot, N; 0 for x < xp."""
    depth = x - c[2]
    if depth < 0.0:
        return 0.0
    push = c[0] * depth + c[1] * v
    if push < 0.0 and c[3] == 0.0:
        return 0.0
    return float(-push)


def pack_unloading(c: Any, x: float, v: float, q: float) -> float:
    """Return the force of spring and dashpot, N; without memory, the pack unloads along its loading curve."""
    depth = x - c[2]
    if depth < 0.0:
        return 0.0
    push = c[0] * depth + c[1] * v
    if push < 0.0 and c[3] == 0.0:
        return 0.0
    return float(-push)


def pack_switch(c: Any, x: float, v: float) -> float:
    """Return K (x - xp) + C v [N], which changes sign at the cut-off of the force.

    Return 1 if the pack may pull, since its force is then not cut off.
    """
    if c[3] != 0.0:
        return 1.0
    return float(c[0] * (x - c[2]) + c[1] * v)


def pack_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (K, C, xp, pull) to `c`; return their count.

    The values `q` of the part are xp, K, C and pull, in this order.
    """
    c[0], c[1], c[2], c[3] = q[1], q[2], q[0], q[3]
    return 4


@register
class DashpotPack(PackPart):
    """Kelvin-Voigt pack, with a stiffness and a damping."""

    law: ClassVar[str] = "dashpot"

    stiffness: float = quantity("N/m", "K", "stiffness of the pack", ge=0)
    damping: float = quantity("N s/m", "C", "damping of the pack", ge=0)
    front: float = quantity("m", "xp", "front of the pack")
    pull: bool = False
