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
    Three = tuple[float, float, float]

    from printhammer.kernel.model.forces import Hammer, acceleration, backstop_acceleration
    from printhammer.kernel.model.layout import ForceLaw
    from printhammer.kernel.model.pulses import Drive


@compiled
def combined_error(e5: float, e3: float) -> float:
    """Combine the estimates of order 5 and 3 into one of order 7 (Hairer, Norsett, Wanner, II.10)."""
    if e5 == 0.0:
        return 0.0
    return e5 * e5 / math.sqrt(e5 * e5 + 0.01 * e3 * e3)


@inlined
def plus(total: Three, c: float, k: Three) -> Three:
    """Return a sum of slopes and one more, times its weight."""
    return total[0] + c * k[0], total[1] + c * k[1], total[2] + c * k[2]


@inlined
def _sum1(c: Numbers, k1: Three) -> Three:
    """Return the first slope times its weight; the functions that follow add up more."""
    return c[0] * k1[0], c[0] * k1[1], c[0] * k1[2]


@inlined
def _sum2(c: Numbers, k1: Three, k2: Three) -> Three:
    return plus(_sum1(c, k1), c[1], k2)


@inlined
def _sum3(c: Numbers, k1: Three, k2: Three, k3: Three) -> Three:
    return plus(_sum2(c, k1, k2), c[2], k3)


@inlined
def _sum4(c: Numbers, k1: Three, k2: Three, k3: Three, k4: Three) -> Three:
    return plus(_sum3(c, k1, k2, k3), c[3], k4)


@inlined
def _sum5(c: Numbers, k1: Three, k2: Three, k3: Three, k4: Three, k5: Three) -> Three:
    return plus(_sum4(c, k1, k2, k3, k4), c[4], k5)


@inlined
def _sum6(c: Numbers, k1: Three, k2: Three, k3: Three, k4: Three, k5: Three, k6: Three) -> Three:
    return plus(_sum5(c, k1, k2, k3, k4, k5), c[5], k6)


@inlined
def _sum7(c: Numbers, k1: Three, k2: Three, k3: Three, k4: Three, k5: Three, k6: Three, k7: Three) -> Three:
    return plus(_sum6(c, k1, k2, k3, k4, k5, k6), c[6], k7)


@inlined
def _sum8(
    c: Numbers, k1: Three, k2: Three, k3: Three, k4: Three, k5: Three, k6: Three, k7: Three, k8: Three
) -> Three:
    return plus(_sum7(c, k1, k2, k3, k4, k5, k6, k7), c[7], k8)


@inlined
def _sum9(
    c: Numbers,
    k1: Three,
    k2: Three,
    k3: Three,
    k4: Three,
    k5: Three,
    k6: Three,
    k7: Three,
    k8: Three,
    k9: Three,
) -> Three:
    return plus(_sum8(c, k1, k2, k3, k4, k5, k6, k7, k8), c[8], k9)


@inlined
def along(y: Three, h: float, slope: Three) -> Three:
    """Return the state a step of `h` along a slope from `y`."""
    return y[0] + h * slope[0], y[1] + h * slope[1], y[2] + h * slope[2]


@inlined
def time_slope(t: float, y: Three, law: ForceLaw) -> Three:
    """Return the rates of time, position and velocity; `t` is exact where the time in `y` is a sum."""
    mode, memory, hammer, drive = law
    return 1.0, y[2], acceleration(t, y[1], y[2], mode, memory, hammer, drive)


@inlined
def contact_slope(y: Three, hammer: Hammer, drive: Drive) -> Three:
    """Return the derivatives of time, w and velocity with s."""
    pace = 2.0 * y[1]
    return pace, -y[2], pace * backstop_acceleration(y[0], y[1], y[2], hammer, drive)


@inlined
def time_step(
    t0: float, x0: float, v0: float, a0: float, h: float, law: ForceLaw
) -> tuple[float, float, float, float, float]:
    """Advance position and velocity by `h` [s]; for accelerations that depend on the velocity.

    Returns
    -------
    tuple of float
        Position [m], velocity [m/s] and acceleration [m/s^2] at the end, and their error estimates.
    """
    y, k1 = (t0, x0, v0), (1.0, v0, a0)
    y2 = along(y, h, _sum1(T.A02, k1))
    k2 = time_slope(t0 + T.C02 * h, y2, law)
    y3 = along(y, h, _sum2(T.A03, k1, k2))
    k3 = time_slope(t0 + T.C03 * h, y3, law)
    y4 = along(y, h, _sum2(T.A04, k1, k3))
    k4 = time_slope(t0 + T.C04 * h, y4, law)
    y5 = along(y, h, _sum3(T.A05, k1, k3, k4))
    k5 = time_slope(t0 + T.C05 * h, y5, law)
    y6 = along(y, h, _sum3(T.A06, k1, k4, k5))
    k6 = time_slope(t0 + T.C06 * h, y6, law)
    y7 = along(y, h, _sum4(T.A07, k1, k4, k5, k6))
    k7 = time_slope(t0 + T.C07 * h, y7, law)
    y8 = along(y, h, _sum5(T.A08, k1, k4, k5, k6, k7))
    k8 = time_slope(t0 + T.C08 * h, y8, law)
    y9 = along(y, h, _sum6(T.A09, k1, k4, k5, k6, k7, k8))
    k9 = time_slope(t0 + T.C09 * h, y9, law)
    y10 = along(y, h, _sum7(T.A10, k1, k4, k5, k6, k7, k8, k9))
    k10 = time_slope(t0 + T.C10 * h, y10, law)
    y11 = along(y, h, _sum8(T.A11, k1, k4, k5, k6, k7, k8, k9, k10))
    k11 = time_slope(t0 + T.C11 * h, y11, law)
    y12 = along(y, h, _sum9(T.A12, k1, k4, k5, k6, k7, k8, k9, k10, k11))
    k12 = time_slope(t0 + h, y12, law)
    _t, x, v = along(y, h, _sum8(T.B, k1, k6, k7, k8, k9, k10, k11, k12))
    a = time_slope(t0 + h, (t0, x, v), law)[2]
    e5, e3 = _sum8(T.E5, k1, k6, k7, k8, k9, k10, k11, k12), _sum8(T.E3, k1, k6, k7, k8, k9, k10, k11, k12)
    error_x = combined_error(h * e5[1], h * e3[1])
    return x, v, a, error_x, combined_error(h * e5[2], h * e3[2])


@inlined
def contact_step(
    t0: float, w0: float, v0: float, kv0: float, h: float, hammer: Hammer, drive: Drive, scales: Any
) -> tuple[float, float, float, float, float]:
    """Advance time, w and velocity in the backstop by `h` in s, from a state whose dv/ds is `kv0`.

    Returns
    -------
    tuple of float
        Time [s], w [m^0.5], velocity [m/s] and dv/ds at the end, and the error estimate, the sum of those of
        time, w and velocity in units of `scales`.
    """
    y, k1 = (t0, w0, v0), (2.0 * w0, -v0, kv0)
    k2 = contact_slope(along(y, h, _sum1(T.A02, k1)), hammer, drive)
    k3 = contact_slope(along(y, h, _sum2(T.A03, k1, k2)), hammer, drive)
    k4 = contact_slope(along(y, h, _sum2(T.A04, k1, k3)), hammer, drive)
    k5 = contact_slope(along(y, h, _sum3(T.A05, k1, k3, k4)), hammer, drive)
    k6 = contact_slope(along(y, h, _sum3(T.A06, k1, k4, k5)), hammer, drive)
    k7 = contact_slope(along(y, h, _sum4(T.A07, k1, k4, k5, k6)), hammer, drive)
    k8 = contact_slope(along(y, h, _sum5(T.A08, k1, k4, k5, k6, k7)), hammer, drive)
    k9 = contact_slope(along(y, h, _sum6(T.A09, k1, k4, k5, k6, k7, k8)), hammer, drive)
    k10 = contact_slope(along(y, h, _sum7(T.A10, k1, k4, k5, k6, k7, k8, k9)), hammer, drive)
    k11 = contact_slope(along(y, h, _sum8(T.A11, k1, k4, k5, k6, k7, k8, k9, k10)), hammer, drive)
    k12 = contact_slope(along(y, h, _sum9(T.A12, k1, k4, k5, k6, k7, k8, k9, k10, k11)), hammer, drive)
    end = along(y, h, _sum8(T.B, k1, k6, k7, k8, k9, k10, k11, k12))
    kv = contact_slope(end, hammer, drive)[2]
    e5, e3 = _sum8(T.E5, k1, k6, k7, k8, k9, k10, k11, k12), _sum8(T.E3, k1, k6, k7, k8, k9, k10, k11, k12)
    error5 = abs(h * e5[0]) / scales[0] + abs(h * e5[1]) / scales[1] + abs(h * e5[2]) / scales[2]
    error3 = abs(h * e3[0]) / scales[0] + abs(h * e3[1]) / scales[1] + abs(h * e3[2]) / scales[2]
    return end[0], end[1], end[2], kv, combined_error(error5, error3)
