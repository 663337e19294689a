"""Sum of the spring and of the additional forces and contacts of a hammer file, as one spring law.

A hammer file lists the forces as ``[[force]]`` and the contacts as ``[[contact]]``. With the displacement x,
the position x0 of an entry and the indentation d of a contact, the sum is

    Fs = sum of  F + B (x - x0) + D (x - x0)^3          forces: constant, gravity, spring, cubic
       + sum of  S(x)                                   forces sampled over the displacement
       - sum of  K d^n,  d = x - x0 > 0                 contacts on the front side
       + sum of  K d^n,  d = x0 - x > 0                 contacts on the back side

Source: Newton's law of gravity near the ground, Hooke's law; H. Hertz (1882) for n = 3/2. The force of a
contact is continuous when the contact closes. Several contacts may be closed at once, also together with pack
or backstop: in a relay, the contact spring engages before the armature meets the pole. Contacts with damping
have a dissipative part as well: `printhammer.parts.spring.sums`. A sampled force S is the curve of
`printhammer.parts.samples` through its samples, NaN outside their range; its slope or curvature jumps at each
sample. Validity: quasi-static contacts. Weakness: contacts have no mass.

Packed constants: c[0] is the number of rows. The five numbers of a row follow: 0, x0, F, B, D for a force; 1
(front) or -1 (back), x0, K, n, chi for a contact with the damping chi, 0 if the contact is elastic; 2, k, n,
1 for straight lines or 0 for cubics, 0 for a sampled force. Its n displacements begin at c[k], after all
rows, and the n forces follow.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar, Final

from pydantic import ConfigDict

from printhammer.parts.base import SpringPart
from printhammer.parts.samples import curve_at, integral_to

LEVELS = True
"""Whether the slope of the law changes at the positions that `spring_level` returns."""

ROOM: Final = 272
"""Number of packed constants that the kernel reserves for a spring; arbitrary."""

WIDTH: Final = 5
"""Number of packed constants of a force or contact, by definition of the row."""

MOST: Final = 12
"""Maximum number of forces and contacts, including the spring; arbitrary."""

MOST_SAMPLES: Final = 100
"""Maximum number of samples of all sampled forces; with `MOST` rows, they fit into `ROOM`."""

FRONT, BACK = 1.0, -1.0
"""First number of the row of a contact: by definition, the sign of the side of the armature that touches."""

SAMPLED: Final = 2.0
"""First number of the row of a sampled force, by definition of the row."""


def spring_force(c: Any, x: float) -> float:
    """Return the sum of all forces and contact forces, N, at `x`, m; NaN beyond the samples of a force."""
    total = 0.0
    for k in range(int(c[0])):
        row = 1 + WIDTH * k
        travel = x - c[row + 1]
        side = c[row]
        if side == 0.0:
            total += c[row + 2] + (c[row + 3] + c[row + 4] * travel * travel) * travel
        elif side == SAMPLED:
            first, n = int(c[row + 1]), int(c[row + 2])
            if not c[first] <= x <= c[first + n - 1]:
                return math.nan
            total += curve_at(c, first, n, c[row + 3] != 0.0, x)
        elif side * travel > 0.0:
            depth = side * travel
            total -= side * c[row + 2] * (depth if c[row + 3] == 1.0 else depth ** c[row + 3])
    return float(total)


def spring_energy(c: Any, x: float) -> float:
    """Return the sum of the potential energies, J; that of an open contact or at a first sample is zero."""
    total = 0.0
    for k in range(int(c[0])):
        row = 1 + WIDTH * k
        travel = x - c[row + 1]
        side = c[row]
        if side == 0.0:
            square = travel * travel
            total -= (c[row + 2] + 0.5 * c[row + 3] * travel) * travel + 0.25 * c[row + 4] * square * square
        elif side == SAMPLED:
            first, n = int(c[row + 1]), int(c[row + 2])
            if not c[first] <= x <= c[first + n - 1]:
                return math.nan
            total -= integral_to(c, first, n, c[row + 3] != 0.0, x)
        elif side * travel > 0.0:
            n = c[row + 3] + 1.0
            total += c[row + 2] * (side * travel) ** n / n
    return float(total)


def spring_level(c: Any, k: float) -> float:
    """Return the position of kink `k`, from 0, m: a contact or an inner sample; infinity beyond the last."""
    left = int(k)
    for i in range(int(c[0])):
        row = 1 + WIDTH * i
        if c[row] == SAMPLED:
            inner = int(c[row + 2]) - 2
            if left < inner:
                return float(c[int(c[row + 1]) + 1 + left])
            left -= inner
        elif c[row] != 0.0:
            if left == 0:
                return float(c[row + 1])
            left -= 1
    return math.inf


def spring_domain(c: Any, ends: Any) -> None:
    """Narrow a displacement range, m, to the samples of all sampled forces."""
    for i in range(int(c[0])):
        row = 1 + WIDTH * i
        if c[row] == SAMPLED:
            first = int(c[row + 1])
            ends[0] = max(ends[0], c[first])
            ends[1] = min(ends[1], c[first + int(c[row + 2]) - 1])


def spring_packed(q: Any, origin: float, c: Any) -> int:
    """Write the packed constants to `c`, with `origin` for NaN positions; return the number of constants."""
    count = 1 + WIDTH * int(q[0])
    for i in range(int(q[0])):
        if q[1 + WIDTH * i] == SAMPLED:
            count += 2 * int(q[3 + WIDTH * i])
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
    samples: tuple[float, ...] = ()
    """Displacements, m, then forces, N, of each sampled force, in the order of the rows."""

    @property
    def domain(self) -> tuple[float, float]:
        """Range of displacements of the sampled forces, m."""
        ends = [-math.inf, math.inf]
        spring_domain(self.numbers(), ends)
        return (ends[0], ends[1])

    def numbers(self) -> tuple[float, ...]:
        """Return the number of rows, followed by the rows and the samples."""
        return (float(len(self.rows)), *(number for row in self.rows for number in row), *self.samples)

    def packed(self, origin: float) -> tuple[float, ...]:
        """Return the packed constants; `origin` is the position of the backstop, m."""
        constants = [0.0] * ROOM
        return tuple(constants[: spring_packed(self.numbers(), origin, constants)])
