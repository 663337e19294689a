"""Rigid stop on the paper side, with a coefficient of restitution.

    v_out = -e v_in      at x = xp

Source: Newton's law of restitution; the front stop of a valve, a marker or an impact oscillator with two
stops. Validity: a contact much shorter than all other time scales. Weakness: no contact time, no force, no
indentation; pressed against the stop, the armature comes to rest after infinitely many bounces in finite
time.

Packed constants: c = [e].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import PackPart, register
from printhammer.support.constants import quantity

MEMORY = False
RIGID_FRONT = True


def pack_rebound(c: Any, v_in: float) -> float:
    """Return the velocity [m/s] after an impact, -e v_in, not positive."""
    return float(-c[0] * v_in)


def pack_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (e,) to `c` from the part's values `q`; return their count."""
    c[0] = q[1]
    return 1


@register
class RigidFront(PackPart):
    """Rigid stop on the paper side, with a position and a coefficient of restitution."""

    law: ClassVar[str] = "rigid"

    front: float = quantity("m", "xp", "position of the stop")
    restitution: float = quantity("1", "e", "coefficient of restitution", ge=0, le=1)
