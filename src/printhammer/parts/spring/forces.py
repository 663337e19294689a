"""Sum of the spring and of the additional forces and contacts of a hammer file, as one spring law.

A hammer file lists the forces as ``[[force]]`` and the contacts as ``[[contact]]``. With the displacement x,
the position x0 of an entry and the indentation d of a contact, the sum is

    Fs = sum of  F + B (x - x0) + D (x - x0)^3          forces: constant, gravity, spring, cubic
       - sum of  K d^n,  d = x - x0 > 0                 contacts on the front side
       + sum of  K d^n,  d = x0 - x > 0                 contacts on the back side

Source: Newton's law of gravity near the ground, Hooke's law; H. Hertz (1882) for n = 3/2. The force of a
contact is continuous when the contact closes. Several contacts may be closed at once, also together with pack
or backstop: in a relay, the contact spring engages before the armature meets the pole. Contacts with damping
have a dissipative part as well: `printhammer.parts.spring.sums`. Validity: quasi-static contacts. Weakness:
contacts have no mass.

Packed constants: c[0] is the number of rows. The five numbers of a row follow: 0, x0, F, B, D for a force; 1
(front) or -1 (back), x0, K, n, chi for a contact with the damping chi, 0 if the contact is elastic.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, model_validator

from printhammer.parts.base import SpringPart
from printhammer.support.constants import quantity

LEVELS = True
"""Whether the slope of the law changes at the positions that `spring_level` returns."""

ROOM: Final = 64
"""Number of packed constants that the kernel reserves for a spring; arbitrary."""

WIDTH: Final = 5
"""Number of packed constants of a force or contact, by definition of the row."""

MOST: Final = (ROOM - 1) // WIDTH
"""Maximum number of forces and contacts, including the spring."""

FRONT, BACK = 1.0, -1.0
"""First number of the row of a contact: by definition, the sign of the side of the armature that touches."""

GRAVITY: Final = 9.80665
"""Standard acceleration of free fall, m/s^2: 3rd General Conference on Weights and Measures (1901)."""


def spring_force(c: Any, x: float) -> float:
    """Return the sum of all forces and contact forces, N, at the displacement `x`, m."""
    total = 0.0
    for k in range(int(c[0])):
        row = 1 + WIDTH * k
        travel = x - c[row + 1]
        side = c[row]
        if side == 0.0:
            total += c[row + 2] + (c[row + 3] + c[row + 4] * travel * travel) * travel
        elif side * travel > 0.0:
            depth = side * travel
            total -= side * c[row + 2] * (depth if c[row + 3] == 1.0 else depth ** c[row + 3])
    return float(total)


def spring_energy(c: Any, x: float) -> float:
    """Return the sum of the potential energies, J; the energy of an open contact is zero."""
    total = 0.0
    for k in range(int(c[0])):
        row = 1 + WIDTH * k
        travel = x - c[row + 1]
        side = c[row]
        if side == 0.0:
            square = travel * travel
            total -= (c[row + 2] + 0.5 * c[row + 3] * travel) * travel + 0.25 * c[row + 4] * square * square
        elif side * travel > 0.0:
            n = c[row + 3] + 1.0
            total += c[row + 2] * (side * travel) ** n / n
    return float(total)


def spring_level(c: Any, k: float) -> float:
    """Return the position of contact `k`, counted from 0, m; infinity if there are fewer contacts."""
    left = k
    for i in range(int(c[0])):
        row = 1 + WIDTH * i
        if c[row] != 0.0:
            if left == 0.0:
                return float(c[row + 1])
            left -= 1.0
    return math.inf


def spring_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants to `c`, with `origin` for NaN positions; return the number of constants."""
    count = 1 + WIDTH * int(q[0])
    for k in range(count):
        c[k] = origin if math.isnan(q[k]) else q[k]
    return count


Row = tuple[float, float, float, float, float]
"""Packed constants of a force or contact; a NaN position stands for the position of the backstop."""


class Term(BaseModel):
    """Base class of the entries of ``[[force]]`` and ``[[contact]]``."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    law: ClassVar[str]

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the entry; `mass` is the mass of the armature, kg."""
        raise NotImplementedError


class ConstantForce(Term):
    """Constant force."""

    law: ClassVar[str] = "constant"

    force: float = quantity("N", "F", "constant force, positive toward the paper")

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the force."""
        return (0.0, 0.0, self.force, 0.0, 0.0)


class Gravity(Term):
    """Weight of the armature on an inclined axis."""

    law: ClassVar[str] = "gravity"

    angle: float = quantity(
        "rad", "theta", "angle of the motion above the horizontal, 90 deg for an upward blow"
    )
    acceleration: float = quantity("m/s^2", "g", "acceleration of free fall", gt=0, default=GRAVITY)

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the force."""
        return (0.0, 0.0, -mass * self.acceleration * math.sin(self.angle), 0.0, 0.0)


class FurtherSpring(Term):
    """Linear spring with a preload at a position, by default the position of the backstop."""

    law: ClassVar[str] = "spring"

    preload: float = quantity("N", "P", "spring force at `position`", default=0.0)
    stiffness: float = quantity("N/m", "K", "spring stiffness, negative for an unstable spring")
    position: float | None = quantity("m", "x0", "position of the preload", default=None)

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the force."""
        position = math.nan if self.position is None else self.position
        return (0.0, position, self.preload, -self.stiffness, 0.0)


class CubicForce(Term):
    """Linear and cubic spring about a relaxed position."""

    law: ClassVar[str] = "cubic"

    stiffness: float = quantity("N/m", "K", "stiffness at the relaxed position, negative between two wells")
    cubic: float = quantity("N/m^3", "D", "coefficient of the cubic term")
    center: float = quantity("m", "x0", "position at which the spring is relaxed")

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the force."""
        return (0.0, self.center, 0.0, -self.stiffness, -self.cubic)


class Friction(Term):
    """Dry friction of the armature in its guide; part of the damping, see `printhammer.parts.friction`."""

    law: ClassVar[str] = "friction"

    kinetic: float = quantity("N", "Fk", "friction force of the moving armature", gt=0)
    static: float | None = quantity("N", "Fs", "largest friction force at rest (default: Fk)", default=None)

    @model_validator(mode="after")
    def _static_is_not_less(self) -> Self:
        if self.static is not None and self.static < self.kinetic:
            raise ValueError("static is less than kinetic: expected at least the kinetic friction")
        return self

    @property
    def largest(self) -> float:
        """Static friction, N."""
        return self.kinetic if self.static is None else self.static


class LinearContact(Term):
    """Linear spring that acts on one side of a position, with or without damping."""

    law: ClassVar[str] = "linear"
    power: ClassVar[float] = 1.0
    """Exponent of the indentation in the force law."""

    side: Literal["front", "back"]
    """Side of the armature that touches: the front if x > `position`, the back if x < `position`."""
    position: float = quantity("m", "x0", "position at which the contact closes")
    stiffness: float = quantity("N/m", "K", "stiffness of the contact", gt=0)
    damping: float | None = quantity(
        "s/m", "chi", "damping: share of the elastic force per unit speed of indentation", gt=0, default=None
    )

    @property
    def sign(self) -> float:
        """Direction of motion in which the indentation grows, 1 toward the paper, or -1."""
        return FRONT if self.side == "front" else BACK

    def row(self, mass: float) -> Row:
        """Return the row of packed constants of the contact."""
        return (self.sign, self.position, self.stiffness, self.power, self.damping or 0.0)

    def force(self, depth: Any, rate: Any = 0.0) -> Any:
        """Return the contact force, N, at indentations, m, and their rates, m/s, numbers or arrays."""
        return self.stiffness * depth**self.power * np.maximum(1.0 + (self.damping or 0.0) * rate, 0.0)


class HertzContact(LinearContact):
    """Elastic contact of round bodies: the force grows with the 3/2 power of the indentation."""

    law: ClassVar[str] = "hertz"
    power: ClassVar[float] = 1.5

    stiffness: float = quantity("N/m^1.5", "K", "Hertz stiffness of the contact", gt=0)


TERMS: Final[dict[str, dict[str, type[Term]]]] = {
    "force": {term.law: term for term in (ConstantForce, CubicForce, Friction, Gravity, FurtherSpring)},
    "contact": {term.law: term for term in (HertzContact, LinearContact)},
}
"""Classes of forces and contacts, by the list of the hammer file, "force" or "contact", and by law."""


class ForceSum(SpringPart):
    """Sum of the spring of a hammer and of its additional forces and contacts; see `sum_of`."""

    model_config = ConfigDict(allow_inf_nan=True)

    law: ClassVar[str] = "sum"

    rows: tuple[Row, ...]

    def numbers(self) -> tuple[float, ...]:
        """Return the number of rows, followed by the rows."""
        return (float(len(self.rows)), *(number for row in self.rows for number in row))

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return the packed constants; `origin` is the position of the backstop, m."""
        constants = [0.0] * ROOM
        return tuple(constants[: spring_packed(self.numbers(), origin, constants)])
