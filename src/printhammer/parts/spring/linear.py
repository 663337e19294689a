"""Spring after equation (4): the preloaded armature spring of the paper.

    Fs = Bs - (Bs / As)(x - b)

Source: F. Hendriks, IBM J. Res. Develop. 27 (1983), equation (4); b is the position of the backstop (0
without one).
Validity: the linear range of the spring. Bs is its force at the backstop, As the travel over which it falls
to zero. Weakness: neither mass nor damping of its own.

Packed constants: c = [Bs, Bs / As, b].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import SpringPart, register
from printhammer.support.constants import quantity


def spring_force(c: Any, x: float) -> float:
    """Return the spring force of equation (4).

    Parameters
    ----------
    c : float64 array
        [Bs, Bs / As, b].
    x : float
        Displacement, m.

    Returns
    -------
    float
        Force, N, positive toward the paper.
    """
    return float(c[0] - c[1] * (x - c[2]))


def spring_energy(c: Any, x: float) -> float:
    """Return the potential energy of the spring, zero at the backstop.

    Parameters
    ----------
    c : float64 array
        [Bs, Bs / As, b].
    x : float
        Displacement, m.

    Returns
    -------
    float
        Energy, J; minus its slope is the force.
    """
    travel = x - c[2]
    return float((0.5 * c[1] * travel - c[0]) * travel)


@register
class LinearSpring(SpringPart):
    """Constants of equation (4)."""

    law: ClassVar[str] = "linear"

    Bs: float = quantity("N", "Bs", "spring force at the backstop", gt=0)
    As: float = quantity("m", "As", "travel from the backstop to zero spring force", gt=0)

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return (Bs, Bs / As, b)."""
        return (self.Bs, self.Bs / self.As, origin)
