"""Elastomer backstop with hysteresis: viscoelastic Hertz contact.

    F = k (delta^1.5 + (3/2) A delta^0.5 d(delta)/dt),    delta = b - x > 0

Source: G. Kuwabara and K. Kono, Jpn. J. Appl. Phys. 26 (1987) 1230; N. V. Brilliantov, F. Spahn, J.-M.
Hertzsch and T. Poeschel, Phys. Rev. E 53 (1996) 5382. A is the relaxation time of the elastomer.
Sensible values: the paper describes deformations of about 25 um at forces of a few pounds, that is k = 10 N /
(25 um)^1.5 = 8e7 N/m^1.5; few rebounds, so A of the order of the contact time, 10 to 100 us.
Validity: slow compared with the speed of sound in the elastomer, small strain. Weakness: near the end of a
contact the force would be attractive for A v > (2/3) delta; `pull = false` (the default) cuts the force off
at zero there.

Packed constants: c = [k, 1.5 k A, 1 if it may pull else 0].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import BackstopPart, register
from printhammer.support.constants import quantity


def backstop_elastic(c: Any, w: float) -> float:
    """Return the elastic force k w^3 [N], not negative, with w = sqrt(b - x)."""
    return float(c[0] * w * w * w)


def backstop_viscous(c: Any, w: float, v: float) -> float:
    """Return the viscous force -1.5 k A w v [N], with w = sqrt(b - x).

    Unless the backstop may pull, the viscous force is limited so that the total force is never attractive.
    """
    force = -c[1] * w * v
    if c[2] == 0.0:
        least = -c[0] * w * w * w
        if force < least:
            return float(least)
    return float(force)


def backstop_energy(c: Any, w: float) -> float:
    """Return the elastic energy (2/5) k w^5 [J], with w = sqrt(b - x)."""
    w2 = w * w
    return float(0.4 * c[0] * w2 * w2 * w)


def backstop_switch(c: Any, w: float, v: float) -> float:
    """Return k w^2 - 1.5 k A v [N/m^0.5], which changes sign at the cut-off of the force.

    Return 1 if the backstop may pull, since its force is then not cut off.
    """
    if c[2] != 0.0:
        return 1.0
    return float(c[0] * w * w - c[1] * v)


def backstop_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (k, 1.5 k A, pull) to `c` from the part's values `q`; return their count."""
    c[0], c[1], c[2] = q[1], 1.5 * q[1] * q[2], q[3]
    return 3


@register
class ElastomerBackstop(BackstopPart):
    """Elastomer backstop: viscoelastic Hertz contact with stiffness k and relaxation time A."""

    law: ClassVar[str] = "elastomer"

    position: float = quantity("m", "b", "position of the backstop")
    stiffness: float = quantity("N/m^1.5", "k", "stiffness of the elastomer", gt=0)
    relaxation_time: float = quantity("s", "A", "relaxation time of the elastomer", ge=0)
    pull: bool = False
