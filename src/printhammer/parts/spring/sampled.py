"""Sum of the spring and of the additional forces and contacts of a hammer, with sampled forces.

    Fs = sum of forces and contacts + sum of S(x)

S is the curve of `printhammer.parts.samples` through samples of a force against displacement, NaN outside
their range. Its slope, or with shape-preserving cubics its curvature, jumps at each sample. Source: the
measurement in the file that the entry names. Validity: displacements between the first and the last sample.
Weakness: the curve also follows the noise of the samples, and a hysteresis is lost.

Packed constants: those of `printhammer.parts.spring.forces`, then the number of curves. Each curve follows
with its number n of samples, 1 for straight lines or 0 for cubics, n displacements, ascending, and n forces.
"""

from __future__ import annotations

import math
from typing import Any, ClassVar

from printhammer.parts.samples import curve_at, integral_to
from printhammer.parts.spring.forces import LEVELS, WIDTH, ForceSum
from printhammer.parts.spring.forces import spring_energy as energy_of_rows
from printhammer.parts.spring.forces import spring_force as force_of_rows
from printhammer.parts.spring.forces import spring_level as level_of_rows
from printhammer.parts.spring.forces import spring_packed as rows_packed

__all__ = ["LEVELS", "spring_domain", "spring_energy", "spring_force", "spring_level", "spring_packed"]


def sum_of_curves(c: Any, x: float, integrated: bool) -> float:
    """Return the sum of the sampled forces [N] at `x` [m]; NaN beyond the samples of any force.

    If `integrated`, return the sum of the integrals of the forces from their first samples to `x`, J.
    """
    total = 0.0
    at = 1 + WIDTH * int(c[0])
    first = at + 3
    for _ in range(int(c[at])):
        n = int(c[first - 2])
        if not c[first] <= x <= c[first + n - 1]:
            return math.nan
        straight = c[first - 1] != 0.0
        if integrated:
            total += integral_to(c, first, n, straight, x)
        else:
            total += curve_at(c, first, n, straight, x)
        first += 2 * n + 2
    return float(total)


def spring_force(c: Any, x: float) -> float:
    """Return the sum [N] of all forces and contact forces at `x` [m]; NaN beyond the samples of a force."""
    return force_of_rows(c, x) + sum_of_curves(c, x, False)


def spring_energy(c: Any, x: float) -> float:
    """Return the potential energy [J] of all forces and contacts at `x` [m]; NaN beyond any force's samples.

    The energy of a sampled force is 0 at its first sample.
    """
    return energy_of_rows(c, x) - sum_of_curves(c, x, True)


def spring_level(c: Any, k: float) -> float:
    """Return the position [m] of kink `k`, counted from 0; infinity if there are fewer kinks.

    Each inner sample of a force and each contact is a kink.
    """
    at = 1 + WIDTH * int(c[0])
    first = at + 3
    left = int(k)
    for _ in range(int(c[at])):
        n = int(c[first - 2])
        if left < n - 2:
            return float(c[first + 1 + left])
        left -= n - 2
        first += 2 * n + 2
    return level_of_rows(c, float(left))


def spring_domain(q: Any, ends: Any) -> None:
    """Narrow the displacement range `ends` [m] to the samples of all forces; `q` holds the part's values."""
    at = 1 + WIDTH * int(q[0])
    first = at + 3
    for _ in range(int(q[at])):
        n = int(q[first - 2])
        ends[0] = max(ends[0], q[first])
        ends[1] = min(ends[1], q[first + n - 1])
        first += 2 * n + 2


def spring_packed(q: Any, origin: float, c: Any) -> int:
    """Write the part's values `q` to `c`, with `origin` in place of NaN positions; return their count.

    `origin` is the position of the backstop, m.
    """
    for k in range(rows_packed(q, origin, c), len(q)):
        c[k] = q[k]
    return len(q)


Curve = tuple[bool, tuple[tuple[float, float], ...]]
"""Sampled curve: whether its pieces are straight lines, and its displacements, m, and forces, N."""


class SampledSum(ForceSum):
    """Sum of a hammer's spring, additional forces and contacts, where forces may be sampled."""

    law: ClassVar[str] = "sampled sum"

    curves: tuple[Curve, ...] = ()

    @property
    def domain(self) -> tuple[float, float]:
        """Range of displacements that the samples of every sampled force cover, `(x_min, x_max)`, m."""
        ends = [-math.inf, math.inf]
        spring_domain(self.numbers(), ends)
        return (ends[0], ends[1])

    def numbers(self) -> tuple[float, ...]:
        """Return the number of rows, the rows, the number of curves, and the curves.

        Each row is one force or contact, each curve one sampled force.
        """
        numbers = [*super().numbers(), float(len(self.curves))]
        for straight, samples in self.curves:
            numbers += [float(len(samples)), float(straight)]
            numbers += [number for column in zip(*samples, strict=True) for number in column]
        return tuple(numbers)
