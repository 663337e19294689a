"""Spring given by preload and stiffness, either of any sign.

    Fs = preload - stiffness (x - b)

Source: Hooke's law. With the preload Bs and the stiffness Bs/As this is equation (4) of the paper. A negative
stiffness describes the pull of a magnet linearised about a point, or a buckled spring; a preload of zero with
b = 0 is the spring of the textbook impact oscillator.
Validity: the linear range of the spring; b is the position of the backstop (0 without one). Weakness: neither
mass nor damping of its own.

Packed constants: c = [preload, stiffness, b].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import SpringPart, register
from printhammer.support.constants import quantity


def spring_force(c: Any, x: float) -> float:
    """Return the force of the spring.

    Parameters
    ----------
    c : float64 array
        [preload, stiffness, b].
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
        [preload, stiffness, b].
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
class PreloadSpring(SpringPart):
    """Preload and stiffness of a spring."""

    law: ClassVar[str] = "preload"

    preload: float = quantity("N", "P", "spring force at the backstop")
    stiffness: float = quantity("N/m", "K", "spring stiffness, negative for an unstable spring")

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return (preload, stiffness, b)."""
        return (self.preload, self.stiffness, origin)
