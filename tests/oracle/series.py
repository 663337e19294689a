"""Taylor series of the motion in one mode, the run they make up, and the first sign change of a polynomial.

Part of the slow, independent oracle (`tests.oracle`). Between switches the equation of motion is

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

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return displacements [m] and velocities [m/s]."""
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
        """Displacement [m], and velocity [m/s] at any times of the run; NaN after its end."""
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
        x, v = np.full(wanted.size, math.nan), np.full(wanted.size, math.nan)
        places = np.searchsorted([step.t for step in self.steps], wanted, side="right") - 1
        inside = np.flatnonzero((places >= 0) & (wanted <= self.end))
        for place in np.unique(places[inside]).tolist():
            own = inside[places[inside] == place]
            x[own], v[own] = self.steps[place].at(wanted[own])
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


def _first_fall(c: Array, theta: float) -> float:
    """Return what `first_fall` does, NaN for None."""

    def root(c: Array) -> float:
        """Return the root in [0, 1] of a falling polynomial, by Newton's rule inside a bracket."""
        low, high, s = 0.0, 1.0, c[0] / (c[0] - c.sum())
        for _ in range(100):
            value, slope = 0.0, 0.0
            for coefficient in c[::-1]:
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
                return float(trial)
            s = trial
        return float(s)

    first, last = 0, c.size
    while first < last and c[first] == 0.0:
        first += 1
    while last > first and c[last - 1] == 0.0:
        last -= 1
    size = last - first
    if size == 0:
        return math.nan
    if c[first] < 0.0:
        return 0.0
    # Each halving leaves one more half to look at later.
    waiting, starts, lengths = np.empty((64, size)), np.zeros(64), np.ones(64)
    for k in range(size):
        waiting[0, k] = c[first + k] * theta**k
    count = 1
    while count > 0:
        count -= 1
        start, length, own = starts[count], lengths[count], waiting[count].copy()
        if own[0] < 0.0:
            return float(theta * start)
        sizes, slopes, first_slope = 0.0, 0.0, 0.0
        for k in range(1, size):
            sizes += abs(own[k])
            if k == 1:
                first_slope = abs(own[k])
            else:
                slopes += k * abs(own[k])
        if own[0] >= sizes:
            continue
        if first_slope >= slopes or length < 1e-13:
            if own.sum() < 0.0:
                return float(theta * (start + length * root(own)))
            continue
        half = 1.0
        for k in range(size):
            own[k] *= half
            half *= 0.5
        waiting[count + 1] = own
        # The right half, by Taylor's shift.
        for j in range(size - 1):
            for k in range(size - 2, j - 1, -1):
                own[k] += own[k + 1]
        waiting[count] = own
        starts[count], starts[count + 1] = start + 0.5 * length, start
        lengths[count] = lengths[count + 1] = 0.5 * length
        count += 2
    return math.nan


@functools.cache
def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function (cached on disk by numba)."""
    import numba

    try:
        compiled: Any = numba.njit(cache=True)(function)
    except RuntimeError:
        # No folder for machine code can be written to.
        compiled = numba.njit(function)
    return compiled  # type: ignore[no-any-return]


def motion_series() -> Callable[..., None]:
    """Return `_motion_series`, compiled."""
    return _compiled(_motion_series)


def first_fall(c: Array, theta: float) -> float | None:
    """Return the smallest s in [0, theta] from which on the polynomial sum c_k s**k is negative, or None.

    A leading coefficient that is exactly zero (a start on the switch itself) is divided out, so a start with
    the polynomial about to rise is no root, and one about to fall returns 0. Intervals are halved until the
    polynomial has no root or is monotone there, by sums of absolute coefficients, hence no pair of crossings
    inside a step is missed. A touch without a crossing is not a fall.
    """
    s: float = _compiled(_first_fall)(c, float(theta))
    return None if math.isnan(s) else s


def _horner(c: Array, s: Any) -> Any:
    total = 0.0 * s
    for coefficient in c[::-1]:
        total = total * s + coefficient
    return total


def horner(c: Array, s: Any) -> Any:
    """Return the value of the polynomial sum c_k s**k at a number, or at each of an array."""
    return _compiled(_horner)(c, s)


def offset(c: Array, value: float) -> Array:
    """Return the polynomial plus a constant."""
    out = c.copy()
    out[0] += value
    return out
