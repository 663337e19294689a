"""One step of the Runge-Kutta method DOP853, in time or in the regularised variables of the backstop.

In the backstop, delta = b - x and the force holds delta^1.5, which is not smooth at delta = 0. With w =
sqrt(delta) and a new independent variable s, dt = 2 w ds, the motion obeys

    dw/ds = -v,    dv/ds = 2 w a,    dt/ds = 2 w,

whose right-hand sides are smooth: the contact force is a polynomial in w, and leaving the backstop is a plain
crossing of w = 0. The electric state of a coil circuit, if any, is integrated together with the motion.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import called, compiled, inlined
from printhammer.kernel.methods import dop853_tableau as T
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    CHARGED,
    CURRENT_SCALE,
    LINKAGE_SCALE,
    POSITION,
    RESISTANCE,
)

if TYPE_CHECKING:
    Numbers = tuple[float, ...]

    from printhammer.kernel.model.circuit import Electric, driven, electric_rates
    from printhammer.kernel.model.forces import Hammer, acceleration, backstop_acceleration
    from printhammer.kernel.model.laws import HAS_CIRCUIT
    from printhammer.kernel.model.layout import ForceLaw
    from printhammer.kernel.model.pulses import Drive

Point = Any
"""State vector of a step: time, displacement or w, velocity and, with a coil circuit, the electric state."""

VANISHING = 1e-280
"""Weighted sum of squares of the error estimates below which only the order 5 estimate is used."""


@compiled
def combined_error(e5: float, e3: float) -> float:
    """Combine the error estimates of orders 5 and 3 into one of order 7 (Hairer, Norsett, Wanner, II.10)."""
    square = e5 * e5 + 0.01 * e3 * e3
    # Squares of errors below about 1e-150 would underflow; a NaN stays NaN.
    if square < VANISHING:
        return abs(e5)
    return e5 * e5 / math.sqrt(square)


@inlined
def plus(total: Point, c: float, k: Point) -> Point:
    """Return `total` + c * k, one term of a weighted sum of slopes."""
    if HAS_CIRCUIT:
        return (
            total[0] + c * k[0],
            total[1] + c * k[1],
            total[2] + c * k[2],
            total[3] + c * k[3],
            total[4] + c * k[4],
            total[5] + c * k[5],
        )
    return total[0] + c * k[0], total[1] + c * k[1], total[2] + c * k[2]


@inlined
def _sum1(c: Numbers, k1: Point) -> Point:
    """Return c[0] * k1; `_sum2` to `_sum9` return weighted sums of two to nine slopes, in a fixed order."""
    if HAS_CIRCUIT:
        return c[0] * k1[0], c[0] * k1[1], c[0] * k1[2], c[0] * k1[3], c[0] * k1[4], c[0] * k1[5]
    return c[0] * k1[0], c[0] * k1[1], c[0] * k1[2]


@inlined
def _sum2(c: Numbers, k1: Point, k2: Point) -> Point:
    return plus(_sum1(c, k1), c[1], k2)


@inlined
def _sum3(c: Numbers, k1: Point, k2: Point, k3: Point) -> Point:
    return plus(_sum2(c, k1, k2), c[2], k3)


@inlined
def _sum4(c: Numbers, k1: Point, k2: Point, k3: Point, k4: Point) -> Point:
    return plus(_sum3(c, k1, k2, k3), c[3], k4)


@inlined
def _sum5(c: Numbers, k1: Point, k2: Point, k3: Point, k4: Point, k5: Point) -> Point:
    return plus(_sum4(c, k1, k2, k3, k4), c[4], k5)


@inlined
def _sum6(c: Numbers, k1: Point, k2: Point, k3: Point, k4: Point, k5: Point, k6: Point) -> Point:
    return plus(_sum5(c, k1, k2, k3, k4, k5), c[5], k6)


@inlined
def _sum7(c: Numbers, k1: Point, k2: Point, k3: Point, k4: Point, k5: Point, k6: Point, k7: Point) -> Point:
    return plus(_sum6(c, k1, k2, k3, k4, k5, k6), c[6], k7)


@inlined
def _sum8(
    c: Numbers, k1: Point, k2: Point, k3: Point, k4: Point, k5: Point, k6: Point, k7: Point, k8: Point
) -> Point:
    return plus(_sum7(c, k1, k2, k3, k4, k5, k6, k7), c[7], k8)


@inlined
def _sum9(
    c: Numbers,
    k1: Point,
    k2: Point,
    k3: Point,
    k4: Point,
    k5: Point,
    k6: Point,
    k7: Point,
    k8: Point,
    k9: Point,
) -> Point:
    return plus(_sum8(c, k1, k2, k3, k4, k5, k6, k7, k8), c[8], k9)


@inlined
def along(y: Point, h: float, slope: Point) -> Point:
    """Return the state y + h * slope."""
    if HAS_CIRCUIT:
        return (
            y[0] + h * slope[0],
            y[1] + h * slope[1],
            y[2] + h * slope[2],
            y[3] + h * slope[3],
            y[4] + h * slope[4],
            y[5] + h * slope[5],
        )
    return y[0] + h * slope[0], y[1] + h * slope[1], y[2] + h * slope[2]


@inlined
def point(t: float, place: float, v: float, drive: Drive) -> Point:
    """Return the state vector: time, place, velocity and, with a coil circuit, the electric state.

    `place` is the displacement or, in the regularised equations of a backstop contact, w = sqrt(b - x).
    """
    if HAS_CIRCUIT:
        electric = drive[1]
        return t, place, v, electric[0], electric[1], electric[2]
    return t, place, v


@inlined
def electric_of(y: Point) -> Electric:
    """Return the electric state of a state vector; empty in a kernel without a circuit."""
    if HAS_CIRCUIT:
        return y[3], y[4], y[5]
    return ()


# Inlined at every stage, the coil circuit would make compilation seven times as long.
@(called if HAS_CIRCUIT else inlined)
def time_slope(t: float, y: Point, law: ForceLaw) -> Point:
    """Return the time derivative of the state vector off the backstop, at time `t` [s]."""
    mode, memory, hammer, drive = law
    if HAS_CIRCUIT:
        electric = electric_of(y)
        rates = electric_rates(t, y[1], y[2], electric, hammer, drive[0])
        if mode >= M.RESTING:
            return 1.0, 0.0, 0.0, rates[0], rates[1], rates[2]
        a = acceleration(t, y[1], y[2], mode, memory, hammer, driven(drive[0], electric))
        return 1.0, y[2], a, rates[0], rates[1], rates[2]
    return 1.0, y[2], acceleration(t, y[1], y[2], mode, memory, hammer, drive)


@(called if HAS_CIRCUIT else inlined)
def contact_slope(y: Point, hammer: Hammer, drive: Drive) -> Point:
    """Return the derivative of the state vector with respect to s in backstop contact, where dt = 2 w ds."""
    pace = 2.0 * y[1]
    if HAS_CIRCUIT:
        electric, live = electric_of(y), drive[0]
        rates = electric_rates(y[0], hammer[POSITION] - y[1] * y[1], y[2], electric, hammer, live)
        rate = pace * backstop_acceleration(y[0], y[1], y[2], hammer, driven(live, electric))
        return pace, -y[2], rate, pace * rates[0], pace * rates[1], pace * rates[2]
    return pace, -y[2], pace * backstop_acceleration(y[0], y[1], y[2], hammer, drive)


@inlined
def slope_at(y: Point, place_rate: float, rate: float, law: ForceLaw) -> Point:
    """Return the time derivative of the state vector `y` at the start of a step off the backstop.

    `place_rate` and `rate` are the time derivatives of position and velocity, which are already known.
    """
    if HAS_CIRCUIT:
        rates = electric_rates(y[0], y[1], y[2], electric_of(y), law.hammer, law.drive[0])
        if law.mode >= M.RESTING:
            return 1.0, 0.0, 0.0, rates[0], rates[1], rates[2]
        return 1.0, place_rate, rate, rates[0], rates[1], rates[2]
    return 1.0, place_rate, rate


@inlined
def contact_slope_at(y: Point, rate: float, hammer: Hammer, drive: Drive) -> Point:
    """Return the derivative of the state vector `y` with respect to s at the start of a backstop step.

    `rate` is the derivative of the velocity, dv/ds, which is already known.
    """
    pace = 2.0 * y[1]
    if HAS_CIRCUIT:
        x = hammer[POSITION] - y[1] * y[1]
        rates = electric_rates(y[0], x, y[2], electric_of(y), hammer, drive[0])
        return pace, -y[2], rate, pace * rates[0], pace * rates[1], pace * rates[2]
    return pace, -y[2], rate


@inlined
def electric_error(e5: Point, e3: Point, h: float, hammer: Hammer) -> float:
    """Return the error estimate of the electric state, normalised by scales of flux linkage and voltage.

    `e5` and `e3` are the weighted sums of slopes for the estimates of orders 5 and 3.
    """
    if HAS_CIRCUIT:
        linkage = hammer[LINKAGE_SCALE]
        voltage = max(hammer[CHARGED], hammer[RESISTANCE] * hammer[CURRENT_SCALE])
        worst = max(
            abs(combined_error(h * e5[3], h * e3[3])) / linkage,
            abs(combined_error(h * e5[4], h * e3[4])) / linkage,
            abs(combined_error(h * e5[5], h * e3[5])) / voltage,
        )
        return float(worst)
    return 0.0


@(called if HAS_CIRCUIT else inlined)
def whole_time_step(
    t0: float, x0: float, v0: float, a0: float, h: float, law: ForceLaw
) -> tuple[float, float, float, float, float, Electric, float]:
    """Compute the step of `time_step` together with the electric state and its normalised error."""
    y = point(t0, x0, v0, law.drive)
    k1 = slope_at(y, v0, a0, law)
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
    end = along(y, h, _sum8(T.B, k1, k6, k7, k8, k9, k10, k11, k12))
    x, v = end[1], end[2]
    a = time_slope(t0 + h, end, law)[2]
    e5, e3 = _sum8(T.E5, k1, k6, k7, k8, k9, k10, k11, k12), _sum8(T.E3, k1, k6, k7, k8, k9, k10, k11, k12)
    error_x = combined_error(h * e5[1], h * e3[1])
    error_e = electric_error(e5, e3, h, law.hammer)
    return x, v, a, error_x, combined_error(h * e5[2], h * e3[2]), electric_of(end), error_e


@inlined
def time_step(
    t0: float, x0: float, v0: float, a0: float, h: float, law: ForceLaw
) -> tuple[float, float, float, float, float]:
    """Compute a DOP853 step of `h` [s] off the backstop, for accelerations that depend on the velocity.

    Returns
    -------
    tuple of float
        Position [m], velocity [m/s] and acceleration [m/s^2] at the end of the step, and the error estimates
        of position and velocity.
    """
    x, v, a, error_x, error_v, _electric, _error_e = whole_time_step(t0, x0, v0, a0, h, law)
    return x, v, a, error_x, error_v


@(called if HAS_CIRCUIT else inlined)
def whole_contact_step(
    t0: float, w0: float, v0: float, kv0: float, h: float, hammer: Hammer, drive: Drive, scales: Any
) -> tuple[float, float, float, float, float, Electric]:
    """Compute the step of `contact_step` together with the electric state, whose error is included."""
    y = point(t0, w0, v0, drive)
    k1 = contact_slope_at(y, kv0, hammer, drive)
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
    error = combined_error(error5, error3) + electric_error(e5, e3, h, hammer)
    return end[0], end[1], end[2], kv, error, electric_of(end)


@inlined
def contact_step(
    t0: float, w0: float, v0: float, kv0: float, h: float, hammer: Hammer, drive: Drive, scales: Any
) -> tuple[float, float, float, float, float]:
    """Compute a DOP853 step of the regularised variable s in backstop contact.

    The length of the step is `h`; `kv0` is dv/ds at the start of the step.

    Returns
    -------
    tuple of float
        Time [s], w [m^0.5], velocity [m/s] and dv/ds at the end, and the error estimate: the sum of the
        errors of time, w and velocity, each normalised by its entry of `scales`.
    """
    t, w, v, kv, error, _electric = whole_contact_step(t0, w0, v0, kv0, h, hammer, drive, scales)
    return t, w, v, kv, error


@called
def contact_state(
    t0: float, w0: float, v0: float, kv0: float, h: float, hammer: Hammer, drive: Drive
) -> tuple[float, float, float, float, Electric]:
    """Compute the state at the end of a step of `whole_contact_step`, without the error estimate.

    All callers share the machine code of the function.

    Returns
    -------
    tuple
        Time [s], w [m^0.5], velocity [m/s], dv/ds and electric state.
    """
    t, w, v, kv, _error, electric = whole_contact_step(t0, w0, v0, kv0, h, hammer, drive, M.ANY_SCALES)
    return t, w, v, kv, electric


@inlined
def contact_end(
    t0: float, w0: float, v0: float, kv0: float, h: float, hammer: Hammer, drive: Drive
) -> tuple[float, float, float, float, Electric]:
    """Return the result of `contact_state`; without a circuit, the function is inlined.

    For functions that evaluate every point of a record.
    """
    if HAS_CIRCUIT:
        return contact_state(t0, w0, v0, kv0, h, hammer, drive)
    t, w, v, kv, _error, electric = whole_contact_step(t0, w0, v0, kv0, h, hammer, drive, M.ANY_SCALES)
    return t, w, v, kv, electric
