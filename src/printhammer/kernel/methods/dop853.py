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

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.methods import dop853_tableau as T

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import Hammer, acceleration, backstop_acceleration
    from printhammer.kernel.model.pulses import Drive


@compiled
def combined_error(e5: float, e3: float) -> float:
    """Combine the estimates of order 5 and 3 into one of order 7 (Hairer, Norsett, Wanner, II.10)."""
    if e5 == 0.0:
        return 0.0
    return e5 * e5 / math.sqrt(e5 * e5 + 0.01 * e3 * e3)


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
    v2 = v0 + h * (T.A02_01 * a1)
    x = x0 + h * (T.A02_01 * v1)
    a2 = acceleration(t0 + T.C02 * h, x, v2, mode, memory, hammer, drive)
    v3 = v0 + h * (T.A03_01 * a1 + T.A03_02 * a2)
    x = x0 + h * (T.A03_01 * v1 + T.A03_02 * v2)
    a3 = acceleration(t0 + T.C03 * h, x, v3, mode, memory, hammer, drive)
    v4 = v0 + h * (T.A04_01 * a1 + T.A04_03 * a3)
    x = x0 + h * (T.A04_01 * v1 + T.A04_03 * v3)
    a4 = acceleration(t0 + T.C04 * h, x, v4, mode, memory, hammer, drive)
    v5 = v0 + h * (T.A05_01 * a1 + T.A05_03 * a3 + T.A05_04 * a4)
    x = x0 + h * (T.A05_01 * v1 + T.A05_03 * v3 + T.A05_04 * v4)
    a5 = acceleration(t0 + T.C05 * h, x, v5, mode, memory, hammer, drive)
    v6 = v0 + h * (T.A06_01 * a1 + T.A06_04 * a4 + T.A06_05 * a5)
    x = x0 + h * (T.A06_01 * v1 + T.A06_04 * v4 + T.A06_05 * v5)
    a6 = acceleration(t0 + T.C06 * h, x, v6, mode, memory, hammer, drive)
    v7 = v0 + h * (T.A07_01 * a1 + T.A07_04 * a4 + T.A07_05 * a5 + T.A07_06 * a6)
    x = x0 + h * (T.A07_01 * v1 + T.A07_04 * v4 + T.A07_05 * v5 + T.A07_06 * v6)
    a7 = acceleration(t0 + T.C07 * h, x, v7, mode, memory, hammer, drive)
    v8 = v0 + h * (T.A08_01 * a1 + T.A08_04 * a4 + T.A08_05 * a5 + T.A08_06 * a6 + T.A08_07 * a7)
    x = x0 + h * (T.A08_01 * v1 + T.A08_04 * v4 + T.A08_05 * v5 + T.A08_06 * v6 + T.A08_07 * v7)
    a8 = acceleration(t0 + T.C08 * h, x, v8, mode, memory, hammer, drive)
    v9 = v0 + h * (
        T.A09_01 * a1 + T.A09_04 * a4 + T.A09_05 * a5 + T.A09_06 * a6 + T.A09_07 * a7 + T.A09_08 * a8
    )
    x = x0 + h * (
        T.A09_01 * v1 + T.A09_04 * v4 + T.A09_05 * v5 + T.A09_06 * v6 + T.A09_07 * v7 + T.A09_08 * v8
    )
    a9 = acceleration(t0 + T.C09 * h, x, v9, mode, memory, hammer, drive)
    v10 = v0 + h * (
        T.A10_01 * a1
        + T.A10_04 * a4
        + T.A10_05 * a5
        + T.A10_06 * a6
        + T.A10_07 * a7
        + T.A10_08 * a8
        + T.A10_09 * a9
    )
    x = x0 + h * (
        T.A10_01 * v1
        + T.A10_04 * v4
        + T.A10_05 * v5
        + T.A10_06 * v6
        + T.A10_07 * v7
        + T.A10_08 * v8
        + T.A10_09 * v9
    )
    a10 = acceleration(t0 + T.C10 * h, x, v10, mode, memory, hammer, drive)
    v11 = v0 + h * (
        T.A11_01 * a1
        + T.A11_04 * a4
        + T.A11_05 * a5
        + T.A11_06 * a6
        + T.A11_07 * a7
        + T.A11_08 * a8
        + T.A11_09 * a9
        + T.A11_10 * a10
    )
    x = x0 + h * (
        T.A11_01 * v1
        + T.A11_04 * v4
        + T.A11_05 * v5
        + T.A11_06 * v6
        + T.A11_07 * v7
        + T.A11_08 * v8
        + T.A11_09 * v9
        + T.A11_10 * v10
    )
    a11 = acceleration(t0 + T.C11 * h, x, v11, mode, memory, hammer, drive)
    v12 = v0 + h * (
        T.A12_01 * a1
        + T.A12_04 * a4
        + T.A12_05 * a5
        + T.A12_06 * a6
        + T.A12_07 * a7
        + T.A12_08 * a8
        + T.A12_09 * a9
        + T.A12_10 * a10
        + T.A12_11 * a11
    )
    x = x0 + h * (
        T.A12_01 * v1
        + T.A12_04 * v4
        + T.A12_05 * v5
        + T.A12_06 * v6
        + T.A12_07 * v7
        + T.A12_08 * v8
        + T.A12_09 * v9
        + T.A12_10 * v10
        + T.A12_11 * v11
    )
    a12 = acceleration(t0 + h, x, v12, mode, memory, hammer, drive)
    x_end = x0 + h * (
        T.B01 * v1
        + T.B06 * v6
        + T.B07 * v7
        + T.B08 * v8
        + T.B09 * v9
        + T.B10 * v10
        + T.B11 * v11
        + T.B12 * v12
    )
    v_end = v0 + h * (
        T.B01 * a1
        + T.B06 * a6
        + T.B07 * a7
        + T.B08 * a8
        + T.B09 * a9
        + T.B10 * a10
        + T.B11 * a11
        + T.B12 * a12
    )
    a_end = acceleration(t0 + h, x_end, v_end, mode, memory, hammer, drive)
    x5e = h * (
        T.E5_01 * v1
        + T.E5_06 * v6
        + T.E5_07 * v7
        + T.E5_08 * v8
        + T.E5_09 * v9
        + T.E5_10 * v10
        + T.E5_11 * v11
        + T.E5_12 * v12
    )
    x3e = h * (
        T.E3_01 * v1
        + T.E3_06 * v6
        + T.E3_07 * v7
        + T.E3_08 * v8
        + T.E3_09 * v9
        + T.E3_10 * v10
        + T.E3_11 * v11
        + T.E3_12 * v12
    )
    v5e = h * (
        T.E5_01 * a1
        + T.E5_06 * a6
        + T.E5_07 * a7
        + T.E5_08 * a8
        + T.E5_09 * a9
        + T.E5_10 * a10
        + T.E5_11 * a11
        + T.E5_12 * a12
    )
    v3e = h * (
        T.E3_01 * a1
        + T.E3_06 * a6
        + T.E3_07 * a7
        + T.E3_08 * a8
        + T.E3_09 * a9
        + T.E3_10 * a10
        + T.E3_11 * a11
        + T.E3_12 * a12
    )
    return x_end, v_end, a_end, combined_error(x5e, x3e), combined_error(v5e, v3e)


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
    w = w0 + h * (T.A02_01 * kw1)
    v2 = v0 + h * (T.A02_01 * kv1)
    t = t0 + h * (T.A02_01 * kt1)
    kw2 = -v2
    kt2 = 2.0 * w
    kv2 = kt2 * backstop_acceleration(t, w, v2, hammer, drive)
    w = w0 + h * (T.A03_01 * kw1 + T.A03_02 * kw2)
    v3 = v0 + h * (T.A03_01 * kv1 + T.A03_02 * kv2)
    t = t0 + h * (T.A03_01 * kt1 + T.A03_02 * kt2)
    kw3 = -v3
    kt3 = 2.0 * w
    kv3 = kt3 * backstop_acceleration(t, w, v3, hammer, drive)
    w = w0 + h * (T.A04_01 * kw1 + T.A04_03 * kw3)
    v4 = v0 + h * (T.A04_01 * kv1 + T.A04_03 * kv3)
    t = t0 + h * (T.A04_01 * kt1 + T.A04_03 * kt3)
    kw4 = -v4
    kt4 = 2.0 * w
    kv4 = kt4 * backstop_acceleration(t, w, v4, hammer, drive)
    w = w0 + h * (T.A05_01 * kw1 + T.A05_03 * kw3 + T.A05_04 * kw4)
    v5 = v0 + h * (T.A05_01 * kv1 + T.A05_03 * kv3 + T.A05_04 * kv4)
    t = t0 + h * (T.A05_01 * kt1 + T.A05_03 * kt3 + T.A05_04 * kt4)
    kw5 = -v5
    kt5 = 2.0 * w
    kv5 = kt5 * backstop_acceleration(t, w, v5, hammer, drive)
    w = w0 + h * (T.A06_01 * kw1 + T.A06_04 * kw4 + T.A06_05 * kw5)
    v6 = v0 + h * (T.A06_01 * kv1 + T.A06_04 * kv4 + T.A06_05 * kv5)
    t = t0 + h * (T.A06_01 * kt1 + T.A06_04 * kt4 + T.A06_05 * kt5)
    kw6 = -v6
    kt6 = 2.0 * w
    kv6 = kt6 * backstop_acceleration(t, w, v6, hammer, drive)
    w = w0 + h * (T.A07_01 * kw1 + T.A07_04 * kw4 + T.A07_05 * kw5 + T.A07_06 * kw6)
    v7 = v0 + h * (T.A07_01 * kv1 + T.A07_04 * kv4 + T.A07_05 * kv5 + T.A07_06 * kv6)
    t = t0 + h * (T.A07_01 * kt1 + T.A07_04 * kt4 + T.A07_05 * kt5 + T.A07_06 * kt6)
    kw7 = -v7
    kt7 = 2.0 * w
    kv7 = kt7 * backstop_acceleration(t, w, v7, hammer, drive)
    w = w0 + h * (T.A08_01 * kw1 + T.A08_04 * kw4 + T.A08_05 * kw5 + T.A08_06 * kw6 + T.A08_07 * kw7)
    v8 = v0 + h * (T.A08_01 * kv1 + T.A08_04 * kv4 + T.A08_05 * kv5 + T.A08_06 * kv6 + T.A08_07 * kv7)
    t = t0 + h * (T.A08_01 * kt1 + T.A08_04 * kt4 + T.A08_05 * kt5 + T.A08_06 * kt6 + T.A08_07 * kt7)
    kw8 = -v8
    kt8 = 2.0 * w
    kv8 = kt8 * backstop_acceleration(t, w, v8, hammer, drive)
    w = w0 + h * (
        T.A09_01 * kw1 + T.A09_04 * kw4 + T.A09_05 * kw5 + T.A09_06 * kw6 + T.A09_07 * kw7 + T.A09_08 * kw8
    )
    v9 = v0 + h * (
        T.A09_01 * kv1 + T.A09_04 * kv4 + T.A09_05 * kv5 + T.A09_06 * kv6 + T.A09_07 * kv7 + T.A09_08 * kv8
    )
    t = t0 + h * (
        T.A09_01 * kt1 + T.A09_04 * kt4 + T.A09_05 * kt5 + T.A09_06 * kt6 + T.A09_07 * kt7 + T.A09_08 * kt8
    )
    kw9 = -v9
    kt9 = 2.0 * w
    kv9 = kt9 * backstop_acceleration(t, w, v9, hammer, drive)
    w = w0 + h * (
        T.A10_01 * kw1
        + T.A10_04 * kw4
        + T.A10_05 * kw5
        + T.A10_06 * kw6
        + T.A10_07 * kw7
        + T.A10_08 * kw8
        + T.A10_09 * kw9
    )
    v10 = v0 + h * (
        T.A10_01 * kv1
        + T.A10_04 * kv4
        + T.A10_05 * kv5
        + T.A10_06 * kv6
        + T.A10_07 * kv7
        + T.A10_08 * kv8
        + T.A10_09 * kv9
    )
    t = t0 + h * (
        T.A10_01 * kt1
        + T.A10_04 * kt4
        + T.A10_05 * kt5
        + T.A10_06 * kt6
        + T.A10_07 * kt7
        + T.A10_08 * kt8
        + T.A10_09 * kt9
    )
    kw10 = -v10
    kt10 = 2.0 * w
    kv10 = kt10 * backstop_acceleration(t, w, v10, hammer, drive)
    w = w0 + h * (
        T.A11_01 * kw1
        + T.A11_04 * kw4
        + T.A11_05 * kw5
        + T.A11_06 * kw6
        + T.A11_07 * kw7
        + T.A11_08 * kw8
        + T.A11_09 * kw9
        + T.A11_10 * kw10
    )
    v11 = v0 + h * (
        T.A11_01 * kv1
        + T.A11_04 * kv4
        + T.A11_05 * kv5
        + T.A11_06 * kv6
        + T.A11_07 * kv7
        + T.A11_08 * kv8
        + T.A11_09 * kv9
        + T.A11_10 * kv10
    )
    t = t0 + h * (
        T.A11_01 * kt1
        + T.A11_04 * kt4
        + T.A11_05 * kt5
        + T.A11_06 * kt6
        + T.A11_07 * kt7
        + T.A11_08 * kt8
        + T.A11_09 * kt9
        + T.A11_10 * kt10
    )
    kw11 = -v11
    kt11 = 2.0 * w
    kv11 = kt11 * backstop_acceleration(t, w, v11, hammer, drive)
    w = w0 + h * (
        T.A12_01 * kw1
        + T.A12_04 * kw4
        + T.A12_05 * kw5
        + T.A12_06 * kw6
        + T.A12_07 * kw7
        + T.A12_08 * kw8
        + T.A12_09 * kw9
        + T.A12_10 * kw10
        + T.A12_11 * kw11
    )
    v12 = v0 + h * (
        T.A12_01 * kv1
        + T.A12_04 * kv4
        + T.A12_05 * kv5
        + T.A12_06 * kv6
        + T.A12_07 * kv7
        + T.A12_08 * kv8
        + T.A12_09 * kv9
        + T.A12_10 * kv10
        + T.A12_11 * kv11
    )
    t = t0 + h * (
        T.A12_01 * kt1
        + T.A12_04 * kt4
        + T.A12_05 * kt5
        + T.A12_06 * kt6
        + T.A12_07 * kt7
        + T.A12_08 * kt8
        + T.A12_09 * kt9
        + T.A12_10 * kt10
        + T.A12_11 * kt11
    )
    kw12 = -v12
    kt12 = 2.0 * w
    kv12 = kt12 * backstop_acceleration(t, w, v12, hammer, drive)
    t_end = t0 + h * (
        T.B01 * kt1
        + T.B06 * kt6
        + T.B07 * kt7
        + T.B08 * kt8
        + T.B09 * kt9
        + T.B10 * kt10
        + T.B11 * kt11
        + T.B12 * kt12
    )
    w_end = w0 + h * (
        T.B01 * kw1
        + T.B06 * kw6
        + T.B07 * kw7
        + T.B08 * kw8
        + T.B09 * kw9
        + T.B10 * kw10
        + T.B11 * kw11
        + T.B12 * kw12
    )
    v_end = v0 + h * (
        T.B01 * kv1
        + T.B06 * kv6
        + T.B07 * kv7
        + T.B08 * kv8
        + T.B09 * kv9
        + T.B10 * kv10
        + T.B11 * kv11
        + T.B12 * kv12
    )
    kv_end = 2.0 * w_end * backstop_acceleration(t_end, w_end, v_end, hammer, drive)
    t5e = h * (
        T.E5_01 * kt1
        + T.E5_06 * kt6
        + T.E5_07 * kt7
        + T.E5_08 * kt8
        + T.E5_09 * kt9
        + T.E5_10 * kt10
        + T.E5_11 * kt11
        + T.E5_12 * kt12
    )
    t3e = h * (
        T.E3_01 * kt1
        + T.E3_06 * kt6
        + T.E3_07 * kt7
        + T.E3_08 * kt8
        + T.E3_09 * kt9
        + T.E3_10 * kt10
        + T.E3_11 * kt11
        + T.E3_12 * kt12
    )
    w5e = h * (
        T.E5_01 * kw1
        + T.E5_06 * kw6
        + T.E5_07 * kw7
        + T.E5_08 * kw8
        + T.E5_09 * kw9
        + T.E5_10 * kw10
        + T.E5_11 * kw11
        + T.E5_12 * kw12
    )
    w3e = h * (
        T.E3_01 * kw1
        + T.E3_06 * kw6
        + T.E3_07 * kw7
        + T.E3_08 * kw8
        + T.E3_09 * kw9
        + T.E3_10 * kw10
        + T.E3_11 * kw11
        + T.E3_12 * kw12
    )
    v5e = h * (
        T.E5_01 * kv1
        + T.E5_06 * kv6
        + T.E5_07 * kv7
        + T.E5_08 * kv8
        + T.E5_09 * kv9
        + T.E5_10 * kv10
        + T.E5_11 * kv11
        + T.E5_12 * kv12
    )
    v3e = h * (
        T.E3_01 * kv1
        + T.E3_06 * kv6
        + T.E3_07 * kv7
        + T.E3_08 * kv8
        + T.E3_09 * kv9
        + T.E3_10 * kv10
        + T.E3_11 * kv11
        + T.E3_12 * kv12
    )
    error5 = abs(t5e) / scales[0] + abs(w5e) / scales[1] + abs(v5e) / scales[2]
    error3 = abs(t3e) / scales[0] + abs(w3e) / scales[1] + abs(v3e) / scales[2]
    return t_end, w_end, v_end, kv_end, combined_error(error5, error3)
