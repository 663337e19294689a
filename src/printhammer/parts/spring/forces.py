"""Sum of the spring, of further forces and of further contacts, as one law of the displacement.

A hammer file lists them as ``[[force]]`` and ``[[contact]]``. With x0 a position, d the indentation:

    Fs = sum of  F + B (x - x0) + D (x - x0)^3          forces: constant, gravity, spring, cubic
       - sum of  K d^n,  d = x - x0 > 0                 contacts of the front side
       + sum of  K d^n,  d = x0 - x > 0                 contacts of the back side

Source: Newton's law of gravity near the ground, Hooke's law; H. Hertz (1882) for n = 3/2. A contact is
elastic, touches without a jump of force, and may be closed together with others and with pack or backstop:
the contact spring of a relay before the armature meets the pole. Validity: quasi-static contacts. Weakness:
contacts without damping and mass of their own.

Packed constants: c = [number of rows, then five numbers a row]: 0, x0, F, B, D for a force; 1 (front) or -1
(back), x0, K, n, 0 for a contact.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Final, Literal

from pydantic import BaseModel, ConfigDict

from printhammer.errors import InputError
from printhammer.parts.base import SpringPart
from printhammer.support.constants import quantity

LEVELS = True

ROOM: Final = 64
"""Number of packed constants that the kernel reserves for a spring."""

WIDTH: Final = 5
"""Number of packed constants of a force or contact."""

MOST: Final = (ROOM - 1) // WIDTH
"""Largest number of forces and contacts, the spring included."""

FRONT, BACK = 1.0, -1.0

GRAVITY: Final = 9.80665
"""Standard acceleration of free fall, m/s^2: 3rd General Conference on Weights and Measures (1901)."""


def spring_force(c: Any, x: float) -> float:
    """Return the sum of all forces, N."""
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
    """Return the sum of the potential energies, J; that of a contact is zero outside the contact."""
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
    """Return the position of the k-th contact, m; infinity from the number of contacts on."""
    left = k
    for i in range(int(c[0])):
        row = 1 + WIDTH * i
        if c[row] != 0.0:
            if left == 0.0:
                return float(c[row + 1])
            left -= 1.0
    return math.inf


def spring_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants; the positions that are NaN are those of the backstop; return the count."""
    count = 1 + WIDTH * int(q[0])
    for k in range(count):
        c[k] = origin if math.isnan(q[k]) else q[k]
    return count


Row = tuple[float, float, float, float, float]
"""Packed constants of a force or contact; NaN for the position of the backstop."""


class Term(BaseModel):
    """Base class of the entries of ``[[force]]`` and ``[[contact]]``."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    law: ClassVar[str]

    def row(self, mass: float) -> Row:
        """Return the packed constants; `mass` is the mass of the armature, kg."""
        raise NotImplementedError


class ConstantForce(Term):
    """Constant force."""

    law: ClassVar[str] = "constant"

    force: float = quantity("N", "F", "constant force, positive toward the paper")

    def row(self, mass: float) -> Row:
        """Return the packed constants."""
        return (0.0, 0.0, self.force, 0.0, 0.0)


class Gravity(Term):
    """Weight of the armature on an inclined axis."""

    law: ClassVar[str] = "gravity"

    angle: float = quantity(
        "rad", "theta", "angle of the motion above the horizontal, 90 deg for an upward blow"
    )
    acceleration: float = quantity("m/s^2", "g", "acceleration of free fall", gt=0, default=GRAVITY)

    def row(self, mass: float) -> Row:
        """Return the packed constants."""
        return (0.0, 0.0, -mass * self.acceleration * math.sin(self.angle), 0.0, 0.0)


class FurtherSpring(Term):
    """Linear spring: a preload at a position, by default that of the backstop, and a stiffness."""

    law: ClassVar[str] = "spring"

    preload: float = quantity("N", "P", "spring force at `position`", default=0.0)
    stiffness: float = quantity("N/m", "K", "spring stiffness, negative for an unstable spring")
    position: float | None = quantity("m", "x0", "position of the preload", default=None)

    def row(self, mass: float) -> Row:
        """Return the packed constants."""
        position = math.nan if self.position is None else self.position
        return (0.0, position, self.preload, -self.stiffness, 0.0)


class CubicForce(Term):
    """Linear and cubic spring about a relaxed position."""

    law: ClassVar[str] = "cubic"

    stiffness: float = quantity("N/m", "K", "stiffness at the relaxed position, negative between two wells")
    cubic: float = quantity("N/m^3", "D", "coefficient of the cubic term")
    center: float = quantity("m", "x0", "position at which the spring is relaxed")

    def row(self, mass: float) -> Row:
        """Return the packed constants."""
        return (0.0, self.center, 0.0, -self.stiffness, -self.cubic)


class LinearContact(Term):
    """Linear spring that acts on one side of a position."""

    law: ClassVar[str] = "linear"
    power: ClassVar[float] = 1.0
    """Power of the indentation in the force."""

    side: Literal["front", "back"]
    """Side of the armature that touches: front for a contact beyond `position`, back for one before it."""
    position: float = quantity("m", "x0", "position at which the contact closes")
    stiffness: float = quantity("N/m", "K", "stiffness of the contact", gt=0)

    def row(self, mass: float) -> Row:
        """Return the packed constants."""
        return (FRONT if self.side == "front" else BACK, self.position, self.stiffness, self.power, 0.0)

    def force(self, depth: float) -> float:
        """Return the contact force, N, at an indentation, m."""
        return float(self.stiffness * depth**self.power)


class HertzContact(LinearContact):
    """Elastic contact of round bodies: the force grows with the 3/2 power of the indentation."""

    law: ClassVar[str] = "hertz"
    power: ClassVar[float] = 1.5

    stiffness: float = quantity("N/m^1.5", "K", "Hertz stiffness of the contact", gt=0)


TERMS: Final[dict[str, dict[str, type[Term]]]] = {
    "force": {term.law: term for term in (ConstantForce, CubicForce, Gravity, FurtherSpring)},
    "contact": {term.law: term for term in (HertzContact, LinearContact)},
}
"""Classes of forces and contacts, by the list of a hammer file and the law."""


class ForceSum(SpringPart):
    """Sum of the spring of a hammer and of its further forces and contacts; built from a hammer file."""

    model_config = ConfigDict(allow_inf_nan=True)

    law: ClassVar[str] = "sum"

    rows: tuple[Row, ...]

    def numbers(self) -> tuple[float, ...]:
        """Return the number of rows and the rows."""
        return (float(len(self.rows)), *(number for row in self.rows for number in row))

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return the packed constants; `origin` is the position of the backstop, m."""
        constants = [0.0] * ROOM
        return tuple(constants[: spring_packed(self.numbers(), origin, constants)])


def sum_of(spring: SpringPart | None, terms: Mapping[str, Term], mass: float) -> ForceSum:
    """Return the sum of a spring, None without one, and of forces and contacts.

    Parameters
    ----------
    spring : SpringPart or None
        Spring of the hammer.
    terms : mapping
        Forces and contacts by key, such as "force.weight".
    mass : float
        Mass of the armature, kg.

    Raises
    ------
    InputError
        The spring has a law that cannot be added, two contacts of a side have the same position, or there are
        more than twelve forces and contacts.
    """
    rows = [] if spring is None else [_spring_row(spring)]
    taken: dict[tuple[float, float], str] = {}
    for key, term in terms.items():
        row = term.row(mass)
        place = (row[0], row[1])
        if row[0] != 0.0 and taken.setdefault(place, key) != key:
            raise InputError.of(
                f"{key}.position", row[1], f"another position than that of {taken[place]}", unit="m"
            )
        rows.append(row)
    if len(rows) > MOST:
        raise InputError.of("force", len(rows), f"at most {MOST} forces and contacts, the spring included")
    return ForceSum(rows=tuple(rows))


def _spring_row(spring: SpringPart) -> Row:
    """Return the row of the spring of a hammer, whose law is `linear`, `preload` or `cubic`."""
    values = {name: getattr(spring, name) for name in spring.names()}
    if spring.law == "linear":
        return (0.0, math.nan, values["Bs"], -values["Bs"] / values["As"], 0.0)
    if spring.law == "preload":
        return (0.0, math.nan, values["preload"], -values["stiffness"], 0.0)
    if spring.law == "cubic":
        return (0.0, values["center"], 0.0, -values["stiffness"], -values["cubic"])
    expected = "linear, preload or cubic beside [[force]] and [[contact]]"
    raise InputError.of("spring.law", spring.law, expected)
