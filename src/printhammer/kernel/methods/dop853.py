"""One step of the Runge-Kutta method DOP853: in time, and in the regularised variables of a backstop contact.

In the backstop, delta = b - x and the force holds delta^1.5, which is not smooth at delta = 0. With w =
sqrt(delta) and a new independent variable s, dt = 2 w ds, the motion obeys

    dw/ds = -v,    dv/ds = 2 w a,    dt/ds = 2 w,

whose right-hand sides are smooth: the contact force is a polynomial in w, and leaving the backstop is a plain
crossing of w = 0.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.methods import dop853_tableau as T

if TYPE_CHECKING:
    Numbers = tuple[float, ...]

    from printhammer.kernel.model.forces import Hammer, acceleration, backstop_acceleration
    from printhammer.kernel.model.pulses import Drive


@compiled
def combined_error(e5: float, e3: float) -> float:
    """Combine the estimates of order 5 and 3 into one of order 7 (Hairer, Norsett, Wanner, II.10)."""
    if e5 == 0.0:
        return 0.0
    return e5 * e5 / math.sqrt(e5 * e5 + 0.01 * e3 * e3)


@inlined
def dot2(c: Numbers, k: Numbers) -> float:
    """Return the scalar product of the first 2 of weights and slopes; those that follow, of more."""
    return c[0] * k[0] + c[1] * k[1]


@inlined
def dot3(c: Numbers, k: Numbers) -> float:
    """Return the sum of 3 products."""
    return dot2(c, k) + c[2] * k[2]


@inlined
def dot4(c: Numbers, k: Numbers) -> float:
    """Return the sum of 4 products."""
    return dot3(c, k) + c[3] * k[3]


@inlined
def dot5(c: Numbers, k: Numbers) -> float:
    """Return the sum of 5 products."""
    return dot4(c, k) + c[4] * k[4]


@inlined
def dot6(c: Numbers, k: Numbers) -> float:
    """Return the sum of 6 products."""
    return dot5(c, k) + c[5] * k[5]


@inlined
def dot7(c: Numbers, k: Numbers) -> float:
    """Return the sum of 7 products."""
    return dot6(c, k) + c[6] * k[6]


@inlined
def dot8(c: Numbers, k: Numbers) -> float:
    """Return the sum of 8 products."""
    return dot7(c, k) + c[7] * k[7]


@inlined
def dot9(c: Numbers, k: Numbers) -> float:
    """Return the sum of 9 products."""
    return dot8(c, k) + c[8] * k[8]


@compiled
def time_step(
    t0: float,
    x0: float,
    v1: float,
    a1: float,
    h: float,
    mode: int,
    memory: float,
    hammer: Hammer,
    drive: Drive,
) -> tuple[float, float, float, float, float]:
    """Advance position and velocity by `h` [s]; for accelerations that depend on the velocity.

    Returns
    -------
    tuple of float
        Position [m], velocity [m/s] and acceleration [m/s^2] at the end, and their error estimates.
    """
    v0 = v1
    v2 = v0 + h * (T.A02[0] * a1)
    x = x0 + h * (T.A02[0] * v1)
    a2 = acceleration(t0 + T.C02 * h, x, v2, mode, memory, hammer, drive)
    v3 = v0 + h * dot2(T.A03, (a1, a2))
    x = x0 + h * dot2(T.A03, (v1, v2))
    a3 = acceleration(t0 + T.C03 * h, x, v3, mode, memory, hammer, drive)
    v4 = v0 + h * dot2(T.A04, (a1, a3))
    x = x0 + h * dot2(T.A04, (v1, v3))
    a4 = acceleration(t0 + T.C04 * h, x, v4, mode, memory, hammer, drive)
    v5 = v0 + h * dot3(T.A05, (a1, a3, a4))
    x = x0 + h * dot3(T.A05, (v1, v3, v4))
    a5 = acceleration(t0 + T.C05 * h, x, v5, mode, memory, hammer, drive)
    v6 = v0 + h * dot3(T.A06, (a1, a4, a5))
    x = x0 + h * dot3(T.A06, (v1, v4, v5))
    a6 = acceleration(t0 + T.C06 * h, x, v6, mode, memory, hammer, drive)
    v7 = v0 + h * dot4(T.A07, (a1, a4, a5, a6))
    x = x0 + h * dot4(T.A07, (v1, v4, v5, v6))
    a7 = acceleration(t0 + T.C07 * h, x, v7, mode, memory, hammer, drive)
    v8 = v0 + h * dot5(T.A08, (a1, a4, a5, a6, a7))
    x = x0 + h * dot5(T.A08, (v1, v4, v5, v6, v7))
    a8 = acceleration(t0 + T.C08 * h, x, v8, mode, memory, hammer, drive)
    v9 = v0 + h * dot6(T.A09, (a1, a4, a5, a6, a7, a8))
    x = x0 + h * dot6(T.A09, (v1, v4, v5, v6, v7, v8))
    a9 = acceleration(t0 + T.C09 * h, x, v9, mode, memory, hammer, drive)
    v10 = v0 + h * dot7(T.A10, (a1, a4, a5, a6, a7, a8, a9))
    x = x0 + h * dot7(T.A10, (v1, v4, v5, v6, v7, v8, v9))
    a10 = acceleration(t0 + T.C10 * h, x, v10, mode, memory, hammer, drive)
    v11 = v0 + h * dot8(T.A11, (a1, a4, a5, a6, a7, a8, a9, a10))
    x = x0 + h * dot8(T.A11, (v1, v4, v5, v6, v7, v8, v9, v10))
    a11 = acceleration(t0 + T.C11 * h, x, v11, mode, memory, hammer, drive)
    v12 = v0 + h * dot9(T.A12, (a1, a4, a5, a6, a7, a8, a9, a10, a11))
    x = x0 + h * dot9(T.A12, (v1, v4, v5, v6, v7, v8, v9, v10, v11))
    a12 = acceleration(t0 + h, x, v12, mode, memory, hammer, drive)
    v = (v1, v6, v7, v8, v9, v10, v11, v12)
    a = (a1, a6, a7, a8, a9, a10, a11, a12)
    x_end = x0 + h * dot8(T.B, v)
    v_end = v0 + h * dot8(T.B, a)
    a_end = acceleration(t0 + h, x_end, v_end, mode, memory, hammer, drive)
    error_x = combined_error(h * dot8(T.E5, v), h * dot8(T.E3, v))
    error_v = combined_error(h * dot8(T.E5, a), h * dot8(T.E3, a))
    return x_end, v_end, a_end, error_x, error_v


@compiled
def contact_step(
    t0: float, w0: float, v1: float, kv1: float, h: float, hammer: Hammer, drive: Drive, scales: Any
) -> tuple[float, float, float, float, float]:
    """Advance time, w and velocity in the backstop by `h` in s, from a state whose dv/ds is `kv1`.

    Returns
    -------
    tuple of float
        Time [s], w [m^0.5], velocity [m/s] and dv/ds at the end, and the error estimate, the sum of those of
        time, w and velocity in units of `scales`.
    """
    v0 = v1
    kw1 = -v1
    kt1 = 2.0 * w0
    w = w0 + h * (T.A02[0] * kw1)
    v = v0 + h * (T.A02[0] * kv1)
    t = t0 + h * (T.A02[0] * kt1)
    kw2 = -v
    kt2 = 2.0 * w
    kv2 = kt2 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot2(T.A03, (kw1, kw2))
    v = v0 + h * dot2(T.A03, (kv1, kv2))
    t = t0 + h * dot2(T.A03, (kt1, kt2))
    kw3 = -v
    kt3 = 2.0 * w
    kv3 = kt3 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot2(T.A04, (kw1, kw3))
    v = v0 + h * dot2(T.A04, (kv1, kv3))
    t = t0 + h * dot2(T.A04, (kt1, kt3))
    kw4 = -v
    kt4 = 2.0 * w
    kv4 = kt4 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot3(T.A05, (kw1, kw3, kw4))
    v = v0 + h * dot3(T.A05, (kv1, kv3, kv4))
    t = t0 + h * dot3(T.A05, (kt1, kt3, kt4))
    kw5 = -v
    kt5 = 2.0 * w
    kv5 = kt5 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot3(T.A06, (kw1, kw4, kw5))
    v = v0 + h * dot3(T.A06, (kv1, kv4, kv5))
    t = t0 + h * dot3(T.A06, (kt1, kt4, kt5))
    kw6 = -v
    kt6 = 2.0 * w
    kv6 = kt6 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot4(T.A07, (kw1, kw4, kw5, kw6))
    v = v0 + h * dot4(T.A07, (kv1, kv4, kv5, kv6))
    t = t0 + h * dot4(T.A07, (kt1, kt4, kt5, kt6))
    kw7 = -v
    kt7 = 2.0 * w
    kv7 = kt7 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot5(T.A08, (kw1, kw4, kw5, kw6, kw7))
    v = v0 + h * dot5(T.A08, (kv1, kv4, kv5, kv6, kv7))
    t = t0 + h * dot5(T.A08, (kt1, kt4, kt5, kt6, kt7))
    kw8 = -v
    kt8 = 2.0 * w
    kv8 = kt8 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot6(T.A09, (kw1, kw4, kw5, kw6, kw7, kw8))
    v = v0 + h * dot6(T.A09, (kv1, kv4, kv5, kv6, kv7, kv8))
    t = t0 + h * dot6(T.A09, (kt1, kt4, kt5, kt6, kt7, kt8))
    kw9 = -v
    kt9 = 2.0 * w
    kv9 = kt9 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot7(T.A10, (kw1, kw4, kw5, kw6, kw7, kw8, kw9))
    v = v0 + h * dot7(T.A10, (kv1, kv4, kv5, kv6, kv7, kv8, kv9))
    t = t0 + h * dot7(T.A10, (kt1, kt4, kt5, kt6, kt7, kt8, kt9))
    kw10 = -v
    kt10 = 2.0 * w
    kv10 = kt10 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot8(T.A11, (kw1, kw4, kw5, kw6, kw7, kw8, kw9, kw10))
    v = v0 + h * dot8(T.A11, (kv1, kv4, kv5, kv6, kv7, kv8, kv9, kv10))
    t = t0 + h * dot8(T.A11, (kt1, kt4, kt5, kt6, kt7, kt8, kt9, kt10))
    kw11 = -v
    kt11 = 2.0 * w
    kv11 = kt11 * backstop_acceleration(t, w, v, hammer, drive)
    w = w0 + h * dot9(T.A12, (kw1, kw4, kw5, kw6, kw7, kw8, kw9, kw10, kw11))
    v = v0 + h * dot9(T.A12, (kv1, kv4, kv5, kv6, kv7, kv8, kv9, kv10, kv11))
    t = t0 + h * dot9(T.A12, (kt1, kt4, kt5, kt6, kt7, kt8, kt9, kt10, kt11))
    kw12 = -v
    kt12 = 2.0 * w
    kv12 = kt12 * backstop_acceleration(t, w, v, hammer, drive)
    kt = (kt1, kt6, kt7, kt8, kt9, kt10, kt11, kt12)
    kw = (kw1, kw6, kw7, kw8, kw9, kw10, kw11, kw12)
    kv = (kv1, kv6, kv7, kv8, kv9, kv10, kv11, kv12)
    t_end = t0 + h * dot8(T.B, kt)
    w_end = w0 + h * dot8(T.B, kw)
    v_end = v0 + h * dot8(T.B, kv)
    kv_end = 2.0 * w_end * backstop_acceleration(t_end, w_end, v_end, hammer, drive)
    t5 = h * dot8(T.E5, kt)
    w5 = h * dot8(T.E5, kw)
    v5 = h * dot8(T.E5, kv)
    t3 = h * dot8(T.E3, kt)
    w3 = h * dot8(T.E3, kw)
    v3 = h * dot8(T.E3, kv)
    error5 = abs(t5) / scales[0] + abs(w5) / scales[1] + abs(v5) / scales[2]
    error3 = abs(t3) / scales[0] + abs(w3) / scales[1] + abs(v3) / scales[2]
    return t_end, w_end, v_end, kv_end, combined_error(error5, error3)
