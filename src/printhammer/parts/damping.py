"""Viscous damping of the armature at every displacement: in flight, in the pack and in the backstop.

    Fv = -c v

Source: the textbook oscillator; S. W. Shaw and P. J. Holmes, J. Sound Vib. 90 (1983) 129, use it in the
impact oscillator. Hendriks (1983) has no damping in flight. Validity: slow motion in a fluid, bearings with
an oil film, eddy currents in a uniform field. Weakness: air at high speed resists with the square of the
speed, dry bearings with a constant force.

Packed constants: c = [coefficient].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import DampingPart, register
from printhammer.support.constants import quantity


def damping_force(c: Any, v: float) -> float:
    """Return the damping force, N."""
    return float(-c[0] * v)


def damping_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (coefficient,) to `c` from the part's values `q`; return their count."""
    c[0] = q[0]
    return 1


@register
class ViscousDamping(DampingPart):
    """Viscous damping of the armature, with its coefficient."""

    law: ClassVar[str] = "viscous"

    coefficient: float = quantity("N s/m", "c", "viscous damping of the armature", ge=0)
