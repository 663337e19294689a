"""Taylor series of the motion in one mode, the run they make up, and the first sign change of a polynomial.

Part of the slow, independent oracle (`printhammer.reference`). Between switches the equation of motion is

    m x'' = F(x, t) - sigma (K r**p + E r**q u'),    u = sigma (x - surface),  r = u / scale

with F the magnet (3), the spring (4) and the drive, and the last term whatever contact is closed. Everything
in it is analytic, so the Taylor coefficients of x follow from recurrences for products and powers (A. Jorba
and M. Zou, Experimental Mathematics 14 (2005) 99; for powers D. E. Knuth, The Art of Computer Programming 2,
4.7). A step is a polynomial: it is its own dense output, and every switch is a root of a polynomial, found
with a guarantee.
"""

from __future__ import annotations

import functools
import math
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike

Array = NDArray[np.float64]

ORDER = 30
"""Degree of the polynomials; high, since each step is dear in Python and the coefficients are cheap."""

NO_MAGNET, INVERSE_ROOT, CELL = 0, 1, 2


@dataclass(frozen=True)
class Step:
    """Motion from ``t`` on for ``length``: x = ref + sum y_k ((time - t)/h)**k, likewise v."""

    t: float
    length: float
    h: float
    ref: float
    y: Array
    v: Array

    def at(self, time: float) -> tuple[float, float]:
        """Return displacement, m, and velocity, m/s."""
        s = (time - self.t) / self.h
        return self.ref + horner(self.y, s), horner(self.v, s)


@dataclass(frozen=True)
class Event:
    """A switch.

    ``kind`` is pack-touch, pack-peak, pack-trough, pack-leave, backstop-touch, backstop-leave,
    backstop-rebound, backstop-stick, backstop-release, cut (a contact would begin to pull), uncut, or
    range-left; ``time`` in s, ``x`` in m, ``v`` in m/s (just after a rebound).
    """

    time: float
    kind: str
    x: float
    v: float


@dataclass
class ReferenceRun:
    """Outcome of `reference`: ``t``, ``x``, ``v`` (SI, at the times asked for), ``events``, ``status``."""

    status: str
    events: list[Event]
    steps: list[Step] = field(repr=False)
    t: Array = field(default_factory=lambda: np.zeros(0))
    x: Array = field(default_factory=lambda: np.zeros(0))
    v: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def end(self) -> float:
        """Time that the run reached, s."""
        return self.steps[-1].t + self.steps[-1].length if self.steps else 0.0

    def at(self, times: ArrayLike) -> tuple[Array, Array]:
        """Displacement, m, and velocity, m/s, at any times of the run; NaN after its end."""
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
        starts = [step.t for step in self.steps]
        x, v = np.full(wanted.size, math.nan), np.full(wanted.size, math.nan)
        end = self.end
        for i, time in enumerate(wanted):
            place = bisect_right(starts, time) - 1
            if place < 0 or time > end:
                continue
            x[i], v[i] = self.steps[place].at(float(time))
        return x, v


def _motion_series(
    h: float,
    ref: float,
    drive: Array,
    is_current: bool,
    mass: float,
    magnet_kind: int,
    magnet: Array,
    spring: Array,
    damping: float,
    contact: Array,
    y: Array,
    v: Array,
) -> None:
    """Fill ``y`` and ``v`` with coefficients in s/h, given ``y[0]`` and ``v[0]``; x = ref + y.

    ``magnet``: (F0, Am, Bm), or the cell (x0, i0, 16 coefficients c[i, j] of (x-x0)**i (i-i0)**j).
    ``spring``: (force at x = 0, slope, coefficient of the cubic term, place about which that is).
    ``damping``: of a unit of velocity. ``contact``: (sigma or 0, K, p, E, q, scale). ``drive``: series in
    s/h. SI throughout.
    """

    def product(a: Array, b: Array, k: int) -> float:
        """Coefficient k of a product."""
        total = 0.0
        for j in range(k + 1):
            total += a[j] * b[k - j]
        return total

    def power(p: float, a: Array, b: Array, k: int) -> float:
        """Coefficient k > 0 of b = a**p, from those before it."""
        total = 0.0
        for j in range(1, k + 1):
            total += (p * j - (k - j)) * a[j] * b[k - j]
        return float(total / (k * a[0]))

    n = y.size - 1
    sigma, big_k, p, big_e, q, scale = contact[0], contact[1], contact[2], contact[3], contact[4], contact[5]
    rows = np.zeros((9, n + 1))
    x, root, gap, r, r_p, r_q, speed = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6]
    away, away_2 = rows[7], rows[8]
    chain, current_power, x_power = np.zeros((4, n + 1)), np.zeros((4, n + 1)), np.zeros((4, n + 1))
    if magnet_kind == 1:
        for k in range(n + 1):
            drop = magnet[1] if k == 0 else 0.0
            current_power[1, k] = drop - (magnet[2] * drive[k] if is_current else 0.0)
        for k in range(n + 1):
            gap[k] = product(current_power[1], current_power[1], k)
    elif magnet_kind == 2:
        current_power[0, 0] = 1.0
        for k in range(n + 1):
            current_power[1, k] = drive[k] if is_current else 0.0
        current_power[1, 0] -= magnet[1]
        for e in range(2, 4):
            for k in range(n + 1):
                current_power[e, k] = product(current_power[1], current_power[e - 1], k)
        x_power[0, 0] = 1.0
    for k in range(n):
        x[k] = y[k] if k > 0 else ref + y[0]
        force = spring[1] * x[k] + (spring[0] if k == 0 else 0.0) - damping * v[k]
        if spring[2] != 0.0:
            away[k] = y[k] if k > 0 else (ref - spring[3]) + y[0]
            away_2[k] = product(away, away, k)
            force += spring[2] * product(away_2, away, k)
        if not is_current:
            force += drive[k]
        if magnet_kind == 1:
            if k == 0:
                root[0] = 1.0 / math.sqrt(x[0])
                force += magnet[0]
            else:
                root[k] = power(-0.5, x, root, k)
            for j in range(k + 1):
                force -= gap[j] * root[k - j]
        elif magnet_kind == 2:
            x_power[1, k] = y[k] if k > 0 else (ref - magnet[0]) + y[0]
            for e in range(2, 4):
                x_power[e, k] = product(x_power[1], x_power[e - 1], k)
            for e in range(4):
                for f in range(4):
                    force += magnet[2 + 4 * e + f] * product(x_power[e], current_power[f], k)
        if sigma != 0.0:
            r[k] = sigma * y[k] / scale
            speed[k] = sigma * v[k]
            if p == 1.0:
                r_p[k] = r[k]
            elif p == 11.0:
                # r2, r3, r4, r8 by products: an integer power needs no division by r, which may be tiny.
                chain[0, k] = product(r, r, k)
                chain[1, k] = product(chain[0], r, k)
                chain[2, k] = product(chain[0], chain[0], k)
                chain[3, k] = product(chain[2], chain[2], k)
                r_p[k] = product(chain[3], chain[1], k)
            else:
                r_p[k] = power(p, r, r_p, k) if k > 0 else r[0] ** p
            push = big_k * r_p[k]
            if big_e != 0.0 and q == 0.0:
                push += big_e * speed[k]
            elif big_e != 0.0:
                r_q[k] = power(q, r, r_q, k) if k > 0 else r[0] ** q
                push += big_e * product(r_q, speed, k)
            force -= sigma * push
        v[k + 1] = h * force / (mass * (k + 1))
        y[k + 1] = h * v[k] / (k + 1)


@functools.lru_cache(maxsize=1)
def motion_series() -> Callable[..., None]:
    """Compile `_motion_series` (cached on disk by numba)."""
    import numba

    try:
        compiled: Any = numba.njit(cache=True)(_motion_series)
    except RuntimeError:
        # No folder for machine code can be written to.
        compiled = numba.njit(_motion_series)
    return compiled  # type: ignore[no-any-return]


@functools.lru_cache(maxsize=ORDER + 2)
def _shift_matrix(size: int) -> Array:
    """Return the matrix that takes a polynomial on [0, 1] to its right half, again on [0, 1]."""
    return np.array([[math.comb(k, j) * 0.5**k for k in range(size)] for j in range(size)])


def _root_of_monotone(c: Array) -> float:
    """Return the root in [0, 1] of a falling polynomial, by Newton's rule inside a bracket."""
    low, high, s = 0.0, 1.0, float(c[0] / (c[0] - c.sum()))
    coefficients = [float(value) for value in c[::-1]]
    for _ in range(100):
        value, slope = 0.0, 0.0
        for coefficient in coefficients:
            slope = slope * s + value
            value = value * s + coefficient
        if value >= 0.0:
            low = s
        else:
            high = s
        trial = s - value / slope if slope != 0.0 else 0.5 * (low + high)
        if not low <= trial <= high:
            trial = 0.5 * (low + high)
        if abs(trial - s) <= 1e-17 + 1e-16 * s:
            return trial
        s = trial
    return s


def first_fall(c: Array, theta: float) -> float | None:
    """Return the smallest s in [0, theta] from which on the polynomial sum c_k s**k is negative, or None.

    A leading coefficient that is exactly zero (a start on the switch itself) is divided out, so a start with
    the polynomial about to rise is no root, and one about to fall returns 0. Intervals are halved until the
    polynomial has no root or is monotone there, by sums of absolute coefficients, hence no pair of crossings
    inside a step is missed. A touch without a crossing is not a fall.
    """
    nonzero = np.flatnonzero(c)
    if nonzero.size == 0:
        return None
    c = c[nonzero[0] : nonzero[-1] + 1]
    if c[0] < 0.0:
        return 0.0
    c = c * theta ** np.arange(c.size)
    degree = np.arange(c.size)
    pieces = [(0.0, 1.0, c)]
    while pieces:
        start, length, c = pieces.pop()
        if c[0] < 0.0:
            return theta * start
        if c[0] >= np.abs(c[1:]).sum():
            continue
        slopes = np.abs(degree * c)
        if slopes[1] >= slopes[2:].sum() or length < 1e-13:
            if c.sum() < 0.0:
                return theta * (start + length * _root_of_monotone(c))
            continue
        pieces.append((start + 0.5 * length, 0.5 * length, _shift_matrix(c.size) @ c))
        pieces.append((start, 0.5 * length, c * 0.5**degree))
    return None


def horner(c: Array, s: float) -> float:
    """Return the value of the polynomial sum c_k s**k."""
    total, s = 0.0, float(s)
    for coefficient in c[::-1].tolist():
        total = total * s + coefficient
    return total


def offset(c: Array, value: float) -> Array:
    """Return the polynomial plus a constant."""
    out = c.copy()
    out[0] += value
    return out
