"""Rigid backstop with a coefficient of restitution.

    v_out = -e v_in

Source: Newton's law of restitution, which the paper mentions as the usual way to describe hard backstops.
Validity: a contact much shorter than all other time scales. Weakness: no contact time, no force; pressed
against the stop, the armature comes to rest after infinitely many bounces in finite time.

Packed constants: c = [e].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import BackstopPart, register
from printhammer.support.constants import quantity

RIGID = True


def backstop_rebound(c: Any, v_in: float) -> float:
    """Return the velocity [m/s] after a bounce, -e v_in, not negative."""
    return float(-c[0] * v_in)


def backstop_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (e,) to `c` from the part's values `q`; return their count."""
    c[0] = q[1]
    return 1


@register
class RigidBackstop(BackstopPart):
    """Rigid backstop, with a position and a coefficient of restitution."""

    law: ClassVar[str] = "rigid"

    position: float = quantity("m", "b", "position of the backstop")
    restitution: float = quantity("1", "e", "coefficient of restitution", ge=0, le=1)
