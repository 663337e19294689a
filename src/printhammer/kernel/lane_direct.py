"""Landing on a switch without another step, where the tolerance is loose enough for it.

The step that held the switch is taken for a polynomial of degree 6: the quintic of its ends, corrected to the
force in its middle. The size of the correction bounds the error.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel import lane_layout as R
from printhammer.kernel.compiling import compiled
from printhammer.kernel.layout import FRONT, POSITION
from printhammer.kernel.modes import EDGE, REACHED_BACKSTOP, REVERSAL

if TYPE_CHECKING:
    from printhammer.kernel.forces import Hammer
    from printhammer.kernel.lane_events import sixth_term
    from printhammer.kernel.lane_steps import lane_contact_rate

LOOSE = 1e-6
"""Allowance of the order 7 estimate from which a direct landing is tried."""

Point = tuple[float, float, float]


@compiled
def sextic(
    u: float,
    h: float,
    x0: float,
    v0: float,
    a0: float,
    x1: float,
    v1: float,
    a1: float,
    k: float,
) -> Point:
    """Return value and first two derivatives at `u` of the quintic plus k u^3 (u - 1)^3."""
    b = h * v0
    c = 0.5 * h * h * a0
    d = x1 - (x0 + b + c)
    e = h * v1 - (b + 2.0 * c)
    f = h * h * (a1 - a0)
    p3 = 10.0 * d - 4.0 * e + 0.5 * f - k
    p4 = -15.0 * d + 7.0 * e - f + 3.0 * k
    p5 = 6.0 * d - 3.0 * e + 0.5 * f - 3.0 * k
    value = x0 + u * (b + u * (c + u * (p3 + u * (p4 + u * (p5 + u * k)))))
    slope = b + u * (2.0 * c + u * (3.0 * p3 + u * (4.0 * p4 + u * (5.0 * p5 + u * 6.0 * k))))
    bend = 2.0 * c + u * (6.0 * p3 + u * (12.0 * p4 + u * (20.0 * p5 + u * 30.0 * k)))
    return value, slope, bend


@compiled
def land_off_backstop(
    pool: Any, i: int, which: int, switch: int, part: float, hammer: Hammer, allowed: float
) -> tuple[bool, float, float, float]:
    """Return whether a direct landing is good, and time, displacement and velocity at the switch."""
    k = sixth_term(pool, i, which)
    h = pool[R.LENGTH * R.BLOCK + i]
    t0 = pool[R.OLD_T * R.BLOCK + i]
    x0, x1 = pool[R.OLD_X * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
    v0, v1 = pool[R.OLD_V * R.BLOCK + i], pool[R.NEW_V * R.BLOCK + i]
    a0, a1 = pool[R.OLD_A * R.BLOCK + i], pool[R.NEW_A * R.BLOCK + i]
    if not abs(k) <= allowed:
        return False, t0, x0, v0
    level = hammer[POSITION] if switch == REACHED_BACKSTOP else hammer[FRONT]
    u, change = part, 0.0
    for _ in range(3):
        value, slope, bend = sextic(u, h, x0, v0, a0, x1, v1, a1, k)
        change = -slope / bend if switch == REVERSAL else (level - value) / slope
        u += change
    value, slope, _bend = sextic(u, h, x0, v0, a0, x1, v1, a1, k)
    good = 0.0 < u <= 1.0 and abs(change) <= 1e-9
    if switch == REVERSAL:
        return good, t0 + u * h, value, 0.0
    return good, t0 + u * h, level, slope / h


@compiled
def land_in_contact(
    pool: Any, i: int, switch: int, part: float, allowed: float
) -> tuple[bool, float, float, float]:
    """Return as `land_off_backstop`, in the contact pool: time, w and velocity."""
    h = pool[R.LENGTH * R.BLOCK + i]
    t0, t1 = pool[R.OLD_T * R.BLOCK + i], pool[R.NEW_T * R.BLOCK + i]
    w0, w1 = pool[R.OLD_X * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
    v0, v1 = pool[R.OLD_V * R.BLOCK + i], pool[R.NEW_V * R.BLOCK + i]
    a0, a1 = pool[R.OLD_A * R.BLOCK + i], pool[R.NEW_A * R.BLOCK + i]
    middle, slope, bend = sextic(0.5, h, w0, -v0, -a0, w1, -v1, -a1, 0.0)
    now = sextic(0.5, h, t0, 2.0 * w0, -2.0 * v0, t1, 2.0 * w1, -2.0 * v1, 0.0)
    rate = lane_contact_rate(pool, i, now[0], middle, -slope / h)
    k = (-rate * h * h - bend) / 0.375
    # d2t/ds2 = -2 v = 2 dw/ds
    k_t = (2.0 * slope * h - now[2]) / 0.375
    if not 2.0 * max(w0, w1) * abs(k) <= allowed:
        return False, t0, w0, v0
    u, change = part, 0.0
    for _ in range(3):
        w, slope, _bend = sextic(u, h, w0, -v0, -a0, w1, -v1, -a1, k)
        t, pace, _turn = sextic(u, h, t0, 2.0 * w0, -2.0 * v0, t1, 2.0 * w1, -2.0 * v1, k_t)
        change = (pool[R.NEXT * R.BLOCK + i] - t) / pace if switch == EDGE else -w / slope
        u += change
    w, slope, _bend = sextic(u, h, w0, -v0, -a0, w1, -v1, -a1, k)
    t, _pace, _turn = sextic(u, h, t0, 2.0 * w0, -2.0 * v0, t1, 2.0 * w1, -2.0 * v1, k_t)
    good = 0.0 < u <= 1.0 and abs(change) <= 1e-9
    if switch == EDGE:
        return good and w > 0.0, pool[R.NEXT * R.BLOCK + i], w, -slope / h
    return good and t <= pool[R.NEXT * R.BLOCK + i] and t > t0, t, 0.0, -slope / h


@compiled
def land_directly(
    pool: Any, i: int, which: int, switch: int, part: float, hammer: Hammer, control: Any
) -> tuple[bool, float, float, float]:
    """Return whether a direct landing is good, and time, displacement (w in contact) and velocity."""
    allowed = 64.0 * control[3] * control[0]
    if which == R.CONTACT_POOL:
        return land_in_contact(pool, i, switch, part, allowed)
    return land_off_backstop(pool, i, which, switch, part, hammer, allowed)
