"""Spring with a cubic term.

    Fs = -(K (x - b) + D (x - b)^3)

Source: G. Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz (1918).
Validity: deflections for which higher terms are small. Weakness: the spring has
neither mass nor damping.

Packed constants: c = [K, D, b].
"""

from printhammer.parts import SpringPart, register
from printhammer.support.constants import quantity


def spring_force(c, x):
    """Return the spring force, N, at displacement x, m."""
    travel = x - c[2]
    return -(c[0] + c[1] * travel * travel) * travel


def spring_energy(c, x):
    """Return the potential energy, J; its negative slope is the force."""
    square = (x - c[2]) * (x - c[2])
    return (0.5 * c[0] + 0.25 * c[1] * square) * square


@register
class CubicSpring(SpringPart):
    """Constants of the cubic spring."""

    law = "hardening"

    stiffness: float = quantity("N/m", "K", "stiffness at small deflections")
    cubic: float = quantity("N/m^3", "D", "coefficient of the cubic term", ge=0)

    def packed(self, origin):
        """Return the packed constants (K, D, b)."""
        return (self.stiffness, self.cubic, origin)
