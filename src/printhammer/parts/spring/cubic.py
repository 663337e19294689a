"""Spring of Duffing's equation: a linear and a cubic term about the relaxed position.

    Fs = -K (x - x0) - D (x - x0)^3

Source: G. Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz (Vieweg, 1918); for a negative K
and a positive D (two wells), P. Holmes, Phil. Trans. R. Soc. Lond. A 292 (1979) 419. Validity: deflections
for which higher terms are small. Weakness: symmetric about x0, neither mass nor damping of its own; with a
negative D the force is repulsive without bound beyond sqrt(-K / D).

Packed constants: c = [K, D, x0].
"""

from __future__ import annotations

from typing import Any, ClassVar

from printhammer.parts.base import SpringPart, register
from printhammer.support.constants import quantity


def spring_force(c: Any, x: float) -> float:
    """Return the spring force, N."""
    travel = x - c[2]
    return float(-(c[0] + c[1] * travel * travel) * travel)


def spring_energy(c: Any, x: float) -> float:
    """Return the potential energy of the spring, J; zero at the relaxed position."""
    square = (x - c[2]) * (x - c[2])
    return float((0.5 * c[0] + 0.25 * c[1] * square) * square)


def spring_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants (K, D, x0) to `c` from the part's values `q`; return their count."""
    c[0], c[1], c[2] = q[0], q[1], q[2]
    return 3


@register
class CubicSpring(SpringPart):
    """Spring with a linear and a cubic term about a relaxed position."""

    law: ClassVar[str] = "cubic"

    stiffness: float = quantity("N/m", "K", "stiffness at the relaxed position, negative between two wells")
    cubic: float = quantity("N/m^3", "D", "coefficient of the cubic term")
    center: float = quantity("m", "x0", "position at which the spring is relaxed")
