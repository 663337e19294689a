"""Linear spring, equation (4), defined by the constants of the paper or by preload and stiffness.

    Fs = Bs - (Bs / As)(x - b)  =  preload - stiffness (x - b)

Source: F. Hendriks, IBM J. Res. Develop. 27 (1983), equation (4), and Hooke's law; b is the position of the
backstop (0 without a backstop). Bs, the preload, is the force at the backstop, and As the travel over which
the force falls to zero. Preload and stiffness may have any sign: a negative stiffness describes the pull of a
magnet linearised about a point, or a buckled spring; a preload of zero with b = 0 is the spring of the
textbook impact oscillator.
Validity: the linear range of the spring. Weakness: neither mass nor damping of its own.

Packed constants: c = [preload, stiffness, b].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import SpringPart, register
from printhammer.support.constants import quantity


def spring_force(c: Any, x: float) -> float:
    """Return the spring force, N."""
    return float(c[0] - c[1] * (x - c[2]))


def spring_energy(c: Any, x: float) -> float:
    """Return the potential energy of the spring, J; zero at the backstop."""
    travel = x - c[2]
    return float((0.5 * c[1] * travel - c[0]) * travel)


def spring_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (preload, stiffness, b) to `c`; return their count.

    The values `q` of the part are Bs, As and 0 (law `linear`), or preload, stiffness and 1 (law `preload`);
    `origin` is b.
    """
    c[0], c[1], c[2] = q[0], q[1] if q[2] == 1.0 else q[0] / q[1], origin
    return 3


@register
class LinearSpring(SpringPart):
    """Linear spring of equation (4), with the constants Bs and As."""

    law: ClassVar[str] = "linear"

    Bs: float = quantity("N", "Bs", "spring force at the backstop", gt=0)
    As: float = quantity("m", "As", "travel from the backstop to zero spring force", gt=0)


@register
class PreloadSpring(SpringPart):
    """Linear spring defined by preload and stiffness."""

    law: ClassVar[str] = "preload"
    variant: ClassVar[int] = 1

    preload: float = quantity("N", "P", "spring force at the backstop")
    stiffness: float = quantity("N/m", "K", "spring stiffness, negative for an unstable spring")
