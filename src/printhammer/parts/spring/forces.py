"""Sum of the spring and of the additional forces and contacts of a hammer file, as one spring law.

A hammer file lists the forces as ``[[force]]`` and the contacts as ``[[contact]]``. With the displacement x,
the position x0 of an entry and the indentation d of a contact, the sum is

    Fs = sum of  F + B (x - x0) + D (x - x0)^3          forces: constant, gravity, spring, cubic
       - sum of  K d^n,  d = x - x0 > 0                 contacts on the front side
       + sum of  K d^n,  d = x0 - x > 0                 contacts on the back side

Source: Newton's law of gravity near the ground, Hooke's law; H. Hertz (1882) for n = 3/2. The force of a
contact is continuous when the contact closes. Several contacts may be closed at once, also together with pack
or backstop: in a relay, the contact spring engages before the armature meets the pole. Contacts with damping
have a dissipative part as well: `printhammer.parts.spring.sums`; sampled forces are defined in
`printhammer.parts.spring.sampled`. Validity: quasi-static contacts. Weakness: contacts have no mass.

Packed constants: c[0] is the number of rows. The five numbers of a row follow: 0, x0, F, B, D for a force; 1
(front) or -1 (back), x0, K, n, chi for a contact with the damping chi, 0 if the contact is elastic.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final

from pydantic import ConfigDict

from printhammer.parts.base import SpringPart

LEVELS = True
"""Whether the slope of the law changes at the positions that `spring_level` returns."""

ROOM: Final = 272
"""Number of packed constants that the kernel reserves for a spring; arbitrary."""

WIDTH: Final = 5
"""Number of packed constants of a force or contact, by definition of the row."""

MOST: Final = 12
"""Maximum number of forces and contacts, including the spring; arbitrary."""

MOST_SAMPLES: Final = 100
"""Maximum number of samples of all sampled forces; arbitrary, with `MOST` entries within `ROOM`."""

FRONT, BACK = 1.0, -1.0
"""First number of the row of a contact: by definition, the sign of the side of the armature that touches."""


def spring_force(c: Any, x: float) -> float:
    """Return the sum [N] of all forces and contact forces at the displacement `x` [m]."""
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
    """Return the potential energy [J] of all forces and contacts at `x` [m]; 0 for an open contact."""
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
    """Return the position [m] of contact `k`, counted from 0; infinity if there are fewer contacts."""
    left = k
    for i in range(int(c[0])):
        row = 1 + WIDTH * i
        if c[row] != 0.0:
            if left == 0.0:
                return float(c[row + 1])
            left -= 1.0
    return math.inf


def spring_packed(q: Any, origin: float, c: Any) -> int:
    """Write the part's values `q` to `c`, with `origin` in place of NaN positions; return their count.

    `origin` is the position of the backstop, m.
    """
    count = 1 + WIDTH * int(q[0])
    for k in range(count):
        c[k] = origin if math.isnan(q[k]) else q[k]
    return count


Row = tuple[float, float, float, float, float]
"""Packed constants of a force or contact; a NaN position stands for the position of the backstop."""


class ForceSum(SpringPart):
    """Sum of the spring of a hammer and of its additional forces and contacts; see `sum_of`."""

    model_config = ConfigDict(allow_inf_nan=True)

    law: ClassVar[str] = "sum"

    rows: tuple[Row, ...]

    def numbers(self) -> tuple[float, ...]:
        """Return the number of rows, followed by the rows; each row is one force or contact."""
        return (float(len(self.rows)), *(number for row in self.rows for number in row))

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return the packed constants; `origin` is the position of the backstop, m."""
        constants = [0.0] * ROOM
        return tuple(constants[: self.function("spring_packed")(self.numbers(), origin, constants)])
