"""Hard backstop, equations (6) and (7): Hertz contact with viscoelastic loss.

    Fb + Fe = k delta^1.5 - l v delta^1.5,     delta = b - x > 0

Source: F. Hendriks, IBM J. Res. Develop. 27 (1983), equations (6) and (7); (7) is after Hunt and
Crossley; the program adds the unit step that (6) lacks in print. k may follow from radii and Young's moduli,
l from a restitution (`printhammer.parts.backstop._hertz`).
Validity: quasi-static contact within the elastic limit. Weakness: (7) can pull once v > k/l; a free rebound
never reaches this speed, and `pull = false` excludes the pull where other forces accelerate the armature.

Packed constants: c = [k, l, 1 if it may pull else 0].
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from pydantic import model_validator

from printhammer.parts.backstop._hertz import damping_from_restitution, hertz_stiffness
from printhammer.parts.base import BackstopPart, register
from printhammer.support.constants import quantity


def backstop_elastic(c: Any, w: float) -> float:
    """Return the Hertz force of equation (6), k w^3 [N], not negative, with w = sqrt(b - x)."""
    return float(c[0] * (w * w * w))


def backstop_viscous(c: Any, w: float, v: float) -> float:
    """Return the viscoelastic force of equation (7), -l v w^3 [N], with w = sqrt(b - x).

    Unless the backstop may pull, the force is at least -k w^3.
    """
    rate = c[1] * v
    if rate > c[0] and c[2] == 0.0:
        rate = c[0]
    return float(-rate * (w * w * w))


def backstop_energy(c: Any, w: float) -> float:
    """Return the elastic energy of equation (6), (2/5) k w^5 [J], with w = sqrt(b - x)."""
    w2 = w * w
    return float(0.4 * c[0] * w2 * w2 * w)


def backstop_switch(c: Any, w: float, v: float) -> float:
    """Return k - l v [N/m^1.5], which changes sign at the cut-off of the force.

    Return 1 if the backstop may pull, since its force is then not cut off.
    """
    if c[2] != 0.0:
        return 1.0
    return float(c[0] - c[1] * v)


_STIFFNESS, _DAMPING, _RESTITUTION, _SPEED, _PULL = 1, 8, 9, 10, 11
"""Indices of constants in `numbers`; the constants of both bodies lie between stiffness and damping."""


def backstop_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (k, l, pull) to `c` from the part's values `q`; return their count."""
    c[0] = q[_STIFFNESS]
    if math.isnan(c[0]):
        c[0] = hertz_stiffness(q[2], q[3], q[4], q[5], q[6], q[7])
    c[1] = q[_DAMPING]
    if math.isnan(c[1]):
        c[1] = damping_from_restitution(c[0], q[_RESTITUTION], q[_SPEED])
    c[2] = q[_PULL]
    return 3


_BODIES = (
    "expected stiffness, or instead of it radius1 (and radius2 unless the backstop is flat), "
    "youngs_modulus1, youngs_modulus2, poisson_ratio1 and poisson_ratio2"
)
_REBOUND = "expected damping, or instead of it restitution and restitution_speed"


@register
class HertzBackstop(BackstopPart):
    """Hard backstop of equations (6) and (7): Hertz contact with viscoelastic loss.

    The stiffness k is given by `stiffness`, or by `radius1` and the Young's moduli and Poisson ratios of both
    bodies (without `radius2`, the second is flat). The damping l is given by `damping`, or by the
    `restitution` of a free rebound at `restitution_speed`. The properties `k` and `l` are the resulting
    values.
    """

    law: ClassVar[str] = "hertz"

    position: float = quantity("m", "b", "position of the backstop")
    stiffness: float | None = quantity("N/m^1.5", "k", "Hertz stiffness", gt=0, default=None)
    radius1: float | None = quantity("m", "R1", "radius of the armature's contact face", gt=0, default=None)
    radius2: float | None = quantity(
        "m", "R2", "radius of the backstop; a flat if omitted", gt=0, default=None
    )
    youngs_modulus1: float | None = quantity(
        "Pa", "E1", "Young's modulus of the armature", gt=0, default=None
    )
    youngs_modulus2: float | None = quantity(
        "Pa", "E2", "Young's modulus of the backstop", gt=0, default=None
    )
    poisson_ratio1: float | None = quantity(
        "1", "nu1", "Poisson ratio of the armature", gt=-1, le=0.5, default=None
    )
    poisson_ratio2: float | None = quantity(
        "1", "nu2", "Poisson ratio of the backstop", gt=-1, le=0.5, default=None
    )
    damping: float | None = quantity("N s/m^2.5", "l", "damping of the backstop", ge=0, default=None)
    restitution: float | None = quantity("1", "e", "restitution of a free rebound", gt=0, le=1, default=None)
    restitution_speed: float | None = quantity(
        "m/s", "v_e", "impact speed of the free rebound", gt=0, default=None
    )
    pull: bool = True

    @model_validator(mode="after")
    def _given_once(self) -> HertzBackstop:
        bodies = {
            name: getattr(self, name) is not None
            for name in ("radius1", "youngs_modulus1", "youngs_modulus2", "poisson_ratio1", "poisson_ratio2")
        }
        any_body = any(bodies.values()) or self.radius2 is not None
        if (self.stiffness is not None) == any_body or (any_body and not all(bodies.values())):
            raise ValueError(_BODIES)
        rebound = (self.restitution is not None, self.restitution_speed is not None)
        if (self.damping is not None) == any(rebound) or (any(rebound) and not all(rebound)):
            raise ValueError(_REBOUND)
        return self

    @property
    def k(self) -> float:
        """Hertz stiffness of equation (6), N/m^1.5, stated or computed from the two bodies."""
        return self.packed(0.0)[0]

    @property
    def l(self) -> float:  # noqa: E743
        """Damping of equation (7), N s/m^2.5, stated or computed from the restitution."""
        return self.packed(0.0)[1]
