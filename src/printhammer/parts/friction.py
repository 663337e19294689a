"""Dry (Coulomb) friction of the armature, together with a viscous damping.

    moving:   Fv = -c v - Fk sign(v)
    at rest:  the friction balances the other forces as long as their sum is at most Fs, Fs >= Fk

Source: C. A. Coulomb, *Théorie des machines simples* (1785); J. P. Den Hartog, Trans. ASME 53 (1931) 107;
S. W. Shaw, J. Sound Vib. 108 (1986) 305, for static and kinetic friction of different size. The friction is
set-valued: the kernel locates every reversal, and holds the armature until the other forces exceed Fs.
Validity: dry bearings, plungers in a tube. Weakness: Fk does not depend on speed, load or time at rest.

Packed constants: c = [viscous coefficient, Fk, Fs].
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, ClassVar

from printhammer.errors import InputError
from printhammer.parts.base import DampingPart
from printhammer.parts.damping import ViscousDamping
from printhammer.parts.spring.terms import Friction

FRICTION = True
"""Whether dry friction acts; `friction_force` returns its static and kinetic values."""


def damping_force(c: Any, v: float) -> float:
    """Return the viscous part of the damping force, N."""
    return float(-c[0] * v)


def friction_force(c: Any, k: float) -> float:
    """Return the kinetic (`k` = 0) or static (`k` = 1) friction force [N], at least 0."""
    return float(c[1] if k == 0.0 else c[2])


def damping_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants, which are the part's values `q`, to `c`; return their count."""
    for k in range(3):
        c[k] = q[k]
    return 3


class DryFriction(DampingPart):
    """Viscous damping and dry friction of a hammer; see `with_friction`."""

    law: ClassVar[str] = "dry friction"

    coefficient: float
    kinetic: float
    static: float

    def numbers(self) -> tuple[float, ...]:
        """Return the viscous coefficient, N s/m, and the kinetic and static friction, N."""
        return (self.coefficient, self.kinetic, self.static)


def with_friction(damping: DampingPart | None, frictions: Iterable[Friction]) -> DryFriction:
    """Build the damping part of a hammer from its viscous damping, if any, and its dry frictions.

    The kinetic friction forces are added, and so are the static friction forces.

    Raises
    ------
    InputError
        The damping law is not `viscous`.
    """
    if damping is not None and not isinstance(damping, ViscousDamping):
        raise InputError.of("damping.law", damping.law, "viscous beside friction")
    each = list(frictions)
    return DryFriction(
        coefficient=0.0 if damping is None else damping.coefficient,
        kinetic=math.fsum(friction.kinetic for friction in each),
        static=math.fsum(friction.largest for friction in each),
    )
