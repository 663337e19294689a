"""Error-controlled step off the backstop that ends exactly at the first switching event, if any.

After a step is accepted, its quintic Hermite interpolant shows whether it contains an event (see
:mod:`printhammer.kernel.methods.hermite`). If so, the step is repeated from its start with the length that
the quintic suggests, and a Taylor expansion covers the small rest of the way to the event: the displacement
at the event is exact, and the time has the accuracy of the integrator.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import called, compiled, inlined
from printhammer.kernel.methods.hermite import position_root, rises_through, turns_down, velocity_root
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    FRONT,
    MAGNET,
    MOST_LEVELS,
    PACK,
    POSITION,
    SPRING,
    Control,
    ForceLaw,
)

if TYPE_CHECKING:
    from printhammer.kernel.methods.crossing import circuit_switch
    from printhammer.kernel.methods.dop853 import time_step, whole_time_step
    from printhammer.kernel.methods.nystrom8 import nystrom_step
    from printhammer.kernel.model.circuit import Electric, fastest_rate
    from printhammer.kernel.model.forces import Hammer, acceleration, slip
    from printhammer.kernel.model.laws import (
        BACKSTOP_PULLS,
        FRICTION,
        HAS_BACKSTOP,
        HAS_CIRCUIT,
        HAS_DAMPING,
        HAS_PACK,
        LEVELS,
        MEMORY,
        PACK_PULLS,
        VISCOUS,
        backstop_switch,
        pack_switch,
        spring_level,
        spring_switch,
    )

State = Any
"""State off the backstop: time [s], position [m], velocity [m/s], acceleration [m/s^2]."""

FAILED = -1
"""Return value instead of an event code if the error exceeds the tolerance for every step size."""


@inlined
def takes_velocity(mode: int) -> bool:
    """Whether the force off the backstop depends on the velocity in a mode, so that DOP853 is needed."""
    return HAS_DAMPING or HAS_CIRCUIT or (HAS_PACK and not MEMORY and mode == M.LOADING)


@inlined
def plain_step(
    t: float, x: float, v: float, a: float, h: float, law: ForceLaw
) -> tuple[float, float, float, float, float]:
    """Compute a step of `h` [s], by DOP853 if the force depends on velocity, else by Runge-Kutta-Nystrom."""
    if takes_velocity(law.mode):
        return time_step(t, x, v, a, h, law)
    return nystrom_step(t, x, v, a, h, law)


@inlined
def whole_step(
    t: float, x: float, v: float, a: float, h: float, law: ForceLaw
) -> tuple[float, float, float, float, float, Electric, float]:
    """Compute the step of `plain_step` together with the electric state and its normalised error."""
    if HAS_CIRCUIT:
        return whole_time_step(t, x, v, a, h, law)
    x1, v1, a1, error_x, error_v = plain_step(t, x, v, a, h, law)
    return x1, v1, a1, error_x, error_v, (), 0.0


@called
def state_after(
    t: float, x: float, v: float, a: float, h: float, law: ForceLaw
) -> tuple[float, float, float]:
    """Return position [m], velocity [m/s] and acceleration [m/s^2] after a step of `h` [s] off the backstop.

    The machine code is shared by all callers, which keeps the kernel short, and omits the error estimates.
    """
    x1, v1, a1, _error_x, _error_v = plain_step(t, x, v, a, h, law)
    return x1, v1, a1


@compiled
def error_ratio(error_x: float, error_v: float, error_e: float, mode: int, control: Control) -> float:
    """Return the error estimate of a step as a multiple of the tolerance; NaN stays NaN.

    `error_e` is the normalised error estimate of the electric state. `control` holds the scales of x and v
    and the tolerances of the order 6 and order 7 estimates.
    """
    ratio_x = abs(error_x) / control[0]
    ratio_v = abs(error_v) / control[1]
    worst = ratio_x if ratio_x > ratio_v else ratio_v
    if math.isnan(ratio_x):
        worst = ratio_x
    if HAS_CIRCUIT:
        worst = worst if worst > error_e else error_e
        if math.isnan(error_e):
            worst = error_e
    if takes_velocity(mode):
        return worst / control[3]
    if mode in (M.UNLOADING, M.RELOADING):
        # On the steep unloading branch r^11, the order 6 estimate is too small by about this factor.
        worst *= 5.0
    return worst / control[2]


@compiled
def step_factor(ratio: float) -> float:
    """Return the size of the next step divided by the size of the latest step, from 0.2 to 5.

    `ratio` is the error of the latest step as a multiple of the tolerance; NaN gives 0.2.
    """
    if not ratio < 1e6:
        return 0.2
    # Compute the eighth root by three square roots; a call of pow would cost as much as half a step.
    return min(5.0, max(0.2, 0.85 / math.sqrt(math.sqrt(math.sqrt(max(ratio, 1e-7))))))


@called
def land_on_level(
    start: State,
    h: float,
    fraction: float,
    upper: float,
    level: float,
    sign: float,
    law: ForceLaw,
    control: Control,
) -> State:
    """Return the state at which sign * x rises through sign * `level` in a step of `h` [s].

    The search begins at `fraction` and ends at `upper`, both as fractions of the step.
    """
    t, x, v, a = start
    low, high = 0.0, upper
    negligible = 1e-15 * control[0]
    for _ in range(80):
        step = fraction * h
        x1, v1, a1 = state_after(t, x, v, a, step, law)
        gap = level - x1
        if sign * gap < 0.0:
            high = fraction
        else:
            low = fraction
        rest = gap / v1 if v1 != 0.0 else math.inf
        if abs(0.5 * a1 * rest * rest) <= negligible and abs(rest) <= 0.01 * h:
            return t + max(step + rest, 0.0), level, v1 + a1 * rest, a1
        if (high - low) * h <= 1e-15 * control[0] / control[1]:
            return t + step, level, v1, a1
        fraction += rest / h
        if not (low < fraction < high):
            fraction = 0.5 * (low + high)
    return t + step, level, v1, a1


@called
def land_on_reversal(
    start: State, h: float, fraction: float, sign: float, law: ForceLaw, control: Control
) -> tuple[float, float, float, float, float]:
    """Return the state at which sign * v falls to zero in a step of `h` [s], and the fraction of the step.

    The search begins at the fraction `fraction`.
    """
    t, x, v, a = start
    low, high = 0.0, 1.0
    negligible = 1e-8 * control[1]
    for _ in range(80):
        step = fraction * h
        x1, v1, a1 = state_after(t, x, v, a, step, law)
        if sign * v1 > 0.0:
            low = fraction
        else:
            high = fraction
        rest = -v1 / a1 if a1 != 0.0 else math.inf
        if abs(v1) <= negligible and abs(rest) <= 0.01 * h:
            return t + max(step + rest, 0.0), x1 + 0.5 * v1 * rest, 0.0, a1, fraction
        if (high - low) * h <= 1e-15 * control[0] / control[1]:
            return t + step, x1, 0.0, a1, fraction
        fraction += rest / h
        if not (low < fraction < high):
            fraction = 0.5 * (low + high)
    return t + step, x1, 0.0, a1, fraction


@called
def longest_still_step(start: State, law: ForceLaw, control: Control) -> float:
    """Return the largest stable step [s] for small oscillations about the present position.

    Near rest, error control does not limit the step: errors are below the tolerance even while an instability
    begins to grow.
    """
    t, x, v, _a = start
    mode, memory, hammer, drive = law
    small = 1e-5 * control[0]
    if HAS_PACK and mode in (M.LOADING, M.UNLOADING, M.RELOADING):
        small = min(small, 1e-3 * (x - hammer[FRONT]))
    if small <= 1e-14 * abs(x):
        return math.inf
    rise = acceleration(t, x + small, v, mode, memory, hammer, drive)
    slope = abs(rise - acceleration(t, x - small, v, mode, memory, hammer, drive)) / (2.0 * small)
    longest = 2.0 / math.sqrt(slope) if slope > 0.0 else math.inf
    if HAS_DAMPING:
        slow = 1e-5 * control[1]
        fall = acceleration(t, x, v - slow, mode, memory, hammer, drive)
        rate = abs(fall - acceleration(t, x, v + slow, mode, memory, hammer, drive)) / (2.0 * slow)
        longest = min(longest, 2.0 / rate if rate > 0.0 else math.inf)
    if HAS_CIRCUIT:
        rate = fastest_rate(x, drive[1], hammer, drive[0])
        longest = min(longest, 2.0 / rate if rate > 0.0 else math.inf)
    return longest


@compiled
def pushes(x: float, v: float, mode: int, hammer: Hammer) -> float:
    """Evaluate the sign function of the contact in `mode`: positive where the law of the contact pushes."""
    if mode == M.BACKSTOP_RELEASED:
        return backstop_switch(hammer[BACKSTOP_PART:MAGNET], math.sqrt(max(hammer[POSITION] - x, 0.0)), v)
    return pack_switch(hammer[PACK:BACKSTOP_PART], x, v)


@compiled
def push_gap(cut: bool, start: State, x: float, v: float, law: ForceLaw) -> float:
    """Evaluate the event function of `land_on_push` at a state: negative after the event.

    With `cut`, the event is a kink of the dissipative force of the spring, at a velocity between those of
    `start` and the state. Otherwise, the event is that a contact ceases to push or, if already released,
    begins to push again.
    """
    if VISCOUS and cut:
        c = law.hammer[SPRING:PACK]
        return spring_switch(c, start[2]) * spring_switch(c, v)
    number = pushes(x, v, law.mode, law.hammer)
    return -number if law.mode in (M.PACK_RELEASED, M.BACKSTOP_RELEASED) else number


@called
def land_on_push(start: State, end: State, cut: bool, law: ForceLaw, control: Control) -> State:
    """Return the state in which a contact starts or ceases to push in a step from `start` to `end`.

    The method is regula falsi with the Illinois rule, and a bisection at every fourth estimate. With `cut`,
    the event is a kink of the dissipative force of the spring; see `push_gap`.
    """
    t, x, v, a = start
    h = end[0] - t
    low, high = 0.0, 1.0
    low_gap, high_gap = push_gap(cut, start, x, v, law), push_gap(cut, start, end[1], end[2], law)
    x1, v1, a1 = end[1], end[2], end[3]
    number, side = 0, 0
    while (high - low) * h > 1e-15 * control[0] / control[1]:
        at = (low * high_gap - high * low_gap) / (high_gap - low_gap) if high_gap < low_gap else low
        if not (low < at < high) or number % 4 == 3:
            at = 0.5 * (low + high)
            if not (low < at < high):
                break
        x2, v2, a2 = state_after(t, x, v, a, at * h, law)
        gap = push_gap(cut, start, x2, v2, law)
        if gap < 0.0:
            high, high_gap, x1, v1, a1 = at, gap, x2, v2, a2
            low_gap *= 0.5 if side == -1 else 1.0
            side = -1
        else:
            low, low_gap = at, gap
            high_gap *= 0.5 if side == 1 else 1.0
            side = 1
        number += 1
    return t + high * h, x1, v1, a1


@compiled
def level_switch(
    start: State, end: State, h: float, level: float, sign: float, law: ForceLaw, control: Control
) -> tuple[int, float, float]:
    """Detect a rise of sign * x through sign * `level` in a step from `start` to `end`.

    Returns a code, the estimated fraction of the step at the crossing, and an upper bound of this fraction.
    The code is REACHED_FRONT for a crossing of any level, NO_SWITCH, or UNRESOLVED if the step is too long.
    """
    x0, v0, a0 = sign * start[1], sign * start[2], sign * start[3]
    x1, v1, a1 = sign * end[1], sign * end[2], sign * end[3]
    code = rises_through(x0, v0, a0, x1, v1, a1, h, sign * level)
    if code == M.NEAR_TOUCH:
        guess = velocity_root(v0, a0, v1, a1, h)
        turn = land_on_reversal(start, h, guess, sign, law, control)
        if not sign * turn[1] > sign * level:
            return M.NO_SWITCH, 1.0, 1.0
        upper = turn[4]
        guess = position_root(x0, v0, a0, sign * turn[1], 0.0, sign * turn[3], upper * h, sign * level, 1.0)
        return M.REACHED_FRONT, guess * upper, upper
    if code == M.REACHED_FRONT:
        return M.REACHED_FRONT, position_root(x0, v0, a0, x1, v1, a1, h, sign * level, 1.0), 1.0
    return code, 1.0, 1.0


@inlined
def is_beyond(x: float, v: float, a: float, level: float) -> bool:
    """Whether `x` is above `level` [m], or at `level` and about to move above it."""
    return x > level or (x == level and (v > 0.0 or (v == 0.0 and a > 0.0)))


@inlined
def first_switch(
    start: State, end: State, h: float, law: ForceLaw, peak: float, control: Control
) -> tuple[int, float, float, float, float]:
    """Find the first event inside a step by tests on its quintic Hermite interpolant.

    `peak` is the latest local maximum in the pack [m].

    Returns
    -------
    tuple
        Code of the event (NO_SWITCH if none, UNRESOLVED if the step is too long for the tests), estimated
        fraction of the step, upper bound of this fraction, displacement [m] at the event (0 for a reversal),
        and sign of the velocity at a crossing or before a reversal.
    """
    mode, hammer = law.mode, law.hammer
    switch, fraction, upper, level, sign = M.NO_SWITCH, 2.0, 1.0, 0.0, 1.0
    if (
        (HAS_BACKSTOP and mode == M.FREE)
        or (HAS_PACK and mode in (M.UNLOADING, M.PACK_RELEASED))
        or (HAS_PACK and not MEMORY and mode == M.LOADING)
    ):
        bound = hammer[POSITION] if mode == M.FREE else hammer[FRONT]
        code, f, u = level_switch(start, end, h, bound, -1.0, law, control)
        if code == M.UNRESOLVED:
            return M.UNRESOLVED, f, u, bound, -1.0
        if code == M.REACHED_FRONT:
            switch = M.REACHED_BACKSTOP if mode == M.FREE else M.LEFT_FRONT
            fraction, upper, level, sign = f, u, bound, -1.0
    if (HAS_PACK and mode in (M.FREE, M.RELOADING)) or mode == M.BACKSTOP_RELEASED:
        bound, reached = hammer[FRONT], M.REACHED_FRONT
        if mode == M.BACKSTOP_RELEASED:
            bound, reached = hammer[POSITION], M.LEFT_BACKSTOP
        elif mode == M.RELOADING:
            bound, reached = peak, M.REACHED_PEAK
        code, f, u = level_switch(start, end, h, bound, 1.0, law, control)
        if code == M.UNRESOLVED:
            return M.UNRESOLVED, f, u, bound, 1.0
        if code == M.REACHED_FRONT and f < fraction:
            switch, fraction, upper, level, sign = reached, f, u, bound, 1.0
    branching = HAS_PACK and MEMORY and mode in (M.LOADING, M.UNLOADING, M.RELOADING)
    if branching or (FRICTION and mode < M.RESTING):
        turn = -1.0 if mode == M.UNLOADING else 1.0
        if FRICTION:
            turn = slip(mode, law.memory)
        code = turns_down(
            turn * start[1], turn * start[2], turn * start[3], turn * end[1], turn * end[2], turn * end[3], h
        )
        if code == M.UNRESOLVED:
            return M.UNRESOLVED, 1.0, 1.0, 0.0, turn
        if code == M.REACHED_FRONT:
            f = velocity_root(turn * start[2], turn * start[3], turn * end[2], turn * end[3], h)
            if f < fraction:
                switch, fraction, upper, level, sign = M.REVERSAL, f, 1.0, 0.0, turn
    if LEVELS:
        for k in range(MOST_LEVELS):
            bound = spring_level(hammer[SPRING:PACK], float(k))
            if math.isinf(bound):
                break
            toward = -1.0 if is_beyond(start[1], start[2], start[3], bound) else 1.0
            code, f, u = level_switch(start, end, h, bound, toward, law, control)
            if code == M.UNRESOLVED:
                return M.UNRESOLVED, f, u, bound, toward
            if code == M.REACHED_FRONT and f < fraction:
                switch, fraction, upper, level, sign = M.REACHED_LEVEL, f, u, bound, toward
    return switch, fraction, upper, level, sign


@compiled
def is_near_level(x0: float, x1: float, hammer: Hammer) -> bool:
    """Whether a step from `x0` to `x1` [m] has a kink of the spring law within its length of either end."""
    if LEVELS:
        for k in range(MOST_LEVELS):
            level = spring_level(hammer[SPRING:PACK], float(k))
            if math.isinf(level):
                break
            if min(abs(x0 - level), abs(x1 - level)) <= abs(x1 - x0):
                return True
    return False


@inlined
def advance(
    start: State, h: float, t_next: float, law: ForceLaw, peak: float, control: Control
) -> tuple[int, State, float, Electric]:
    """Integrate over one accepted step off the backstop, up to the first switching event or `t_next` [s].

    `peak` is the latest local maximum in the pack [m].

    Returns
    -------
    tuple
        Code of the event (EDGE at `t_next`, NO_SWITCH if none, FAILED if no step size meets the tolerance),
        state at the end of the step, proposed length of the next step [s], and electric state at the end.
    """
    mode = law.mode
    t, x, v, a = start
    shortest = 1e-14 * control[0] / control[1]
    if abs(v) * h + abs(a) * h * h < 1e-6 * control[0]:
        h = min(h, longest_still_step(start, law, control))
    while True:
        at_edge = h >= t_next - t
        if at_edge:
            h = t_next - t
        x1, v1, a1, error_x, error_v, electric, error_e = whole_step(t, x, v, a, h, law)
        # Outside the range of the law, the acceleration at the end may be NaN although the errors are finite.
        ratio = error_ratio(error_x, error_v, error_e, mode, control) + 0.0 * a1
        if not ratio <= 1.0:
            h *= step_factor(ratio)
            if h < shortest:
                return FAILED, start, h, electric
            continue
        end = (t_next if at_edge else t + h, x1, v1, a1)
        switch, fraction, upper, level, sign = first_switch(start, end, h, law, peak, control)
        if switch == M.UNRESOLVED and h > shortest:
            h *= 0.5
            continue
        following = h * step_factor(ratio)
        if switch in (M.NO_SWITCH, M.UNRESOLVED):
            switch = M.EDGE if at_edge else M.NO_SWITCH
        elif switch == M.REVERSAL:
            turn = land_on_reversal(start, h, fraction, sign, law, control)
            end = (turn[0], turn[1], turn[2], turn[3])
        else:
            end = land_on_level(start, h, fraction, upper, level, sign, law, control)
        if VISCOUS and end[0] > t and push_gap(True, start, end[1], end[2], law) < 0.0:
            end = land_on_push(start, end, True, law, control)
            switch = M.REACHED_LEVEL
        if LEVELS and h > shortest and end[0] > t and is_near_level(x, end[1], law.hammer):
            # Near a kink, a law may be a fractional power of the distance: the error of the step is then as
            # large as its estimate, and must meet the smaller tolerance.
            _x, _v, _a, error_x, error_v, _electric, error_e = whole_step(t, x, v, a, end[0] - t, law)
            worst = max(abs(error_x) / control[0], abs(error_v) / control[1], error_e)
            if worst > control[3]:
                h *= 0.5
                continue
        may_let_go = HAS_PACK and not PACK_PULLS and mode in (M.LOADING, M.PACK_RELEASED)
        may_let_go = may_let_go or (not BACKSTOP_PULLS and mode == M.BACKSTOP_RELEASED)
        if may_let_go and end[0] > t and push_gap(False, start, end[1], end[2], law) < 0.0:
            end = land_on_push(start, end, False, law, control)
            switch = M.PUSH_BEGAN if mode in (M.PACK_RELEASED, M.BACKSTOP_RELEASED) else M.PUSH_ENDED
        if HAS_CIRCUIT:
            if switch not in (M.NO_SWITCH, M.EDGE):
                electric = whole_time_step(t, x, v, a, end[0] - t, law)[5]
            code, end, electric = circuit_switch(start, end, electric, law, control)
            if code == M.UNRESOLVED and h > shortest:
                h *= 0.5
                continue
            if code in (M.CIRCUIT, M.REST_ENDED):
                switch = code
        return switch, end, following, electric
