"""Error-controlled step in contact with the elastic backstop, in regularised variables; event location."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import called, compiled, inlined
from printhammer.kernel.methods.hermite import position_root, rises_through, velocity_root
from printhammer.kernel.methods.landing import FAILED, step_factor
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import BACKSTOP_PART, INVERSE_MASS, MAGNET, POSITION, Control

if TYPE_CHECKING:
    from printhammer.kernel.methods.crossing import closes, contact_gap_and_change, land_on_gap_in_contact
    from printhammer.kernel.methods.dop853 import contact_end, contact_state, whole_contact_step
    from printhammer.kernel.model.circuit import (
        Electric,
        electric_rates,
        fastest_rate,
        moved,
        path_may_change,
    )
    from printhammer.kernel.model.forces import Hammer, backstop_acceleration
    from printhammer.kernel.model.laws import BACKSTOP_PULLS, HAS_CIRCUIT, backstop_elastic, backstop_switch
    from printhammer.kernel.model.pulses import Drive

ContactState = Any
"""State in backstop contact: time [s], w = sqrt(compression) [m^0.5], velocity v [m/s], and dv/ds, where s is
the regularised variable."""

PHASE_LIMIT = 2.0
"""Largest phase advance [rad] of the contact oscillation in one step; DOP853 is unstable beyond about 5."""


@compiled
def contact_rate(w: float, v: float, t: float, hammer: Hammer, drive: Drive) -> float:
    """Return dv/ds = 2 w a, the derivative of the velocity with respect to s in backstop contact."""
    return 2.0 * w * backstop_acceleration(t, w, v, hammer, drive)


@compiled
def length_while_pushed_in(left: float, w: float, v: float, kv: float) -> float:
    """Return the increment ds of the regularised variable s over the time `left` [s] in a backstop contact.

    Solves 2 w ds - v ds^2 - kv ds^3 / 3 = left for ds by Newton's method, where `kv` is dv/ds. The
    acceleration must be directed into the backstop, so that the left side increases with ds.
    """
    ds = 0.0
    for _ in range(60):
        rest = left - ds * (2.0 * w - ds * (v + ds * kv / 3.0))
        change = rest / (2.0 * (w - ds * (v + 0.5 * ds * kv)))
        ds += change
        if abs(change) <= 1e-12 * ds:
            break
    return ds


@compiled
def length_of(left: float, w: float, v: float, kv: float) -> float:
    """Return the approximate increment of the regularised variable s over the time `left` [s].

    Solves 2 w ds - v ds^2 = left for ds; the root is regular also at release, w = 0. The cubic term is
    included if it matters and the armature stays on the backstop. `s_at` iterates this approximation.
    """
    under_root = max(w * w - v * left, 0.0)
    if w > 0.0 and under_root > 0.0:
        change = left / (w + math.sqrt(under_root))
    else:
        change = (w - math.sqrt(under_root)) / v if v != 0.0 else 0.0
    stays = w > 0.0 and kv < 0.0 and (v <= 0.0 or v * v + kv * w < 0.0)
    if stays and -kv * change * change * change > left > 0.0:
        return length_while_pushed_in(left, w, v, kv)
    return change


@compiled
def s_at(t: float, t0: float, w0: float, v0: float, kv0: float, hammer: Hammer, drive: Drive) -> float:
    """Return the regularised variable s at which a backstop step that starts at `t0` reaches time `t` [s].

    If `t` is later than the release, the value of s at the release is returned.
    """
    left = t - t0
    if left <= 0.0:
        return 0.0
    s = 0.0
    t1, w1, v1, kv1 = t0, w0, v0, kv0
    for _ in range(12):
        change = length_of(t - t1, w1, v1, kv1)
        s += change
        if abs(change) <= 1e-15 * s:
            break
        t1, w1, v1, kv1, _electric = contact_end(t0, w0, v0, kv0, s, hammer, drive)
    return s


@inlined
def longest_contact_step(w: float, hammer: Hammer, drive: Drive) -> float:
    """Return the largest stable step in the regularised variable s at compression ``w**2`` [m].

    The decay rate of a coil circuit, if any, also limits the step.
    """
    if w <= 0.0:
        return math.inf
    stretch = 1.01 * w
    softness = (stretch * stretch - w * w) / (
        backstop_elastic(hammer[BACKSTOP_PART:MAGNET], stretch)
        - backstop_elastic(hammer[BACKSTOP_PART:MAGNET], w)
    )
    longest = math.inf
    if softness > 0.0:
        longest = PHASE_LIMIT * math.sqrt(softness / hammer[INVERSE_MASS]) / (2.0 * w)
    if HAS_CIRCUIT:
        rate = fastest_rate(hammer[POSITION] - w * w, drive[1], hammer, drive[0])
        longest = min(longest, PHASE_LIMIT / (2.0 * w * rate) if rate > 0.0 else math.inf)
    return longest


@compiled
def contact_scales(w: float, v: float, h: float, control: Control) -> tuple[float, float, float]:
    """Return error scales of time, w and velocity, derived from the scales of displacement and velocity."""
    return control[0] / control[1], control[0] / (2.0 * max(w, abs(v) * h)), control[1]


@called
def leave(
    start: ContactState,
    h: float,
    fraction: float,
    upper: float,
    hammer: Hammer,
    drive: Drive,
    control: Control,
) -> tuple[float, float, float, float, float]:
    """Locate the release from the backstop, at zero compression, in a step of the regularised variable s.

    The length of the step is `h`. The search begins at `fraction` and ends at `upper`, both as fractions of
    the step. Returns time, w = 0, velocity, dv/ds = 0, and fraction of the step at the release.
    """
    t, w, v, kv = start
    low, high = 0.0, upper
    negligible = 1e-12 * math.sqrt(control[0])
    for _ in range(80):
        t1, w1, v1, kv1, _electric = contact_state(t, w, v, kv, fraction * h, hammer, drive)
        if w1 < 0.0:
            high = fraction
        else:
            low = fraction
        rest = w1 / v1 if v1 != 0.0 else math.inf
        if abs(0.5 * kv1 * rest * rest) <= negligible and abs(rest) <= 0.01 * h:
            return t1 + w1 * rest, 0.0, v1 + 0.5 * kv1 * rest, 0.0, fraction
        if (high - low) < 1e-15:
            break
        fraction += rest / h
        if not (low < fraction < high):
            fraction = 0.5 * (low + high)
    return t1, 0.0, v1, 0.0, fraction


@called
def reach_time(
    start: ContactState, h: float, upper: float, t_upper: float, target: float, hammer: Hammer, drive: Drive
) -> ContactState:
    """Return the state at the time `target` [s] in a backstop step.

    The length of the step in the regularised variable s is `h`. The search ends at the fraction `upper` of
    the step, where the time is `t_upper` [s].
    """
    t, w, v, kv = start
    low, high = 0.0, upper
    fraction = upper * (target - t) / (t_upper - t)
    for _ in range(80):
        if not (low < fraction < high):
            fraction = 0.5 * (low + high)
        t1, w1, v1, kv1, _electric = contact_state(t, w, v, kv, fraction * h, hammer, drive)
        if t1 > target:
            high = fraction
        else:
            low = fraction
        if w1 > 0.0:
            rest = (target - t1) / (2.0 * w1)
            if abs(rest) * (abs(v1) + abs(kv1) * abs(rest)) <= 1e-9 * w1:
                # Close the remainder by a second-order expansion, which makes w and t accurate to rounding.
                rest += 0.5 * v1 * rest * rest / w1
                w_end = w1 - v1 * rest - 0.5 * kv1 * rest * rest
                return target, w_end, v1 + kv1 * rest, kv1
            fraction += rest / h
        if high - low < 1e-15:
            break
    return target, max(w1, 0.0), v1, kv1


@called
def end_push(start: ContactState, h: float, upper: float, hammer: Hammer, drive: Drive) -> ContactState:
    """Return the state in which the backstop ceases to push during a backstop step.

    The length of the step in the regularised variable s is `h`. The method is bisection; the search ends at
    the fraction `upper` of the step.
    """
    t, w, v, kv = start
    low, high = 0.0, upper
    for _ in range(60):
        middle = 0.5 * (low + high)
        _t1, w1, v1, _kv1, _electric = contact_state(t, w, v, kv, middle * h, hammer, drive)
        if backstop_switch(hammer[BACKSTOP_PART:MAGNET], w1, v1) > 0.0:
            low = middle
        else:
            high = middle
    t1, w1, v1, kv1, _electric = contact_state(t, w, v, kv, high * h, hammer, drive)
    return t1, w1, v1, kv1


@inlined
def contact_switch(
    start: ContactState,
    end: ContactState,
    h: float,
    leaves: bool,
    t_next: float,
    hammer: Hammer,
    drive: Drive,
    control: Control,
) -> tuple[int, ContactState]:
    """Return the first event in a backstop step, and the state at the event.

    The length of the step in the regularised variable s is `h`. `leaves` states whether w falls to zero
    within the step, so that the armature leaves the backstop. An event later than `t_next` [s] is replaced by
    EDGE at `t_next`.
    """
    _t, w, v, kv = start
    switch, upper = M.NO_SWITCH, 1.0
    if leaves:
        guess = position_root(-w, v, kv, -end[1], end[2], end[3], h, 0.0, 1.0)
        left = leave(start, h, guess, 1.0, hammer, drive, control)
        switch, end, upper = M.LEFT_BACKSTOP, (left[0], left[1], left[2], left[3]), left[4]
    if not BACKSTOP_PULLS and backstop_switch(hammer[BACKSTOP_PART:MAGNET], end[1], end[2]) <= 0.0:
        switch, end = M.PUSH_ENDED, end_push(start, h, upper, hammer, drive)
    if end[0] > t_next:
        return M.EDGE, reach_time(start, h, upper, end[0], t_next, hammer, drive)
    if end[0] == t_next and switch == M.NO_SWITCH:
        switch = M.EDGE
    return switch, end


@compiled
def electric_in_contact(
    start: ContactState, t: float, hammer: Hammer, drive: Drive
) -> tuple[float, Electric]:
    """Return the regularised variable s at time `t` [s] in a backstop step, and the electric state there."""
    s = s_at(t, start[0], start[1], start[2], start[3], hammer, drive)
    t1, w1, v1, _kv1, electric = contact_state(start[0], start[1], start[2], start[3], s, hammer, drive)
    rates = electric_rates(t1, hammer[POSITION] - w1 * w1, v1, electric, hammer, drive[0])
    return s, moved(electric, t - t1, rates)


@inlined
def advance_contact(
    start: ContactState, h: float, t_next: float, hammer: Hammer, drive: Drive, control: Control
) -> tuple[int, ContactState, float, Electric]:
    """Integrate over one accepted step in backstop contact, up to the first switching event or `t_next` [s].

    Returns
    -------
    tuple
        Code of the event (EDGE at `t_next`, NO_SWITCH, FAILED, LEFT_BACKSTOP, PUSH_ENDED or CIRCUIT), state
        at the end of the step, proposed length of the next step in the regularised variable s, and electric
        state at the end of the step.
    """
    t, w, v, kv = start
    shortest = 1e-14 * math.sqrt(control[0]) / control[1]
    limit = longest_contact_step(w, hammer, drive)
    while True:
        h = min(h, limit)
        # A step far beyond the next edge would be wasted.
        reach = (t_next - t) / (2.0 * w) if w > 0.0 else math.inf
        if v >= 0.0 and h > 4.0 * reach:
            h = 4.0 * reach
        elif v < 0.0 and h > 1.01 * reach:
            h = 1.01 * reach
        scales = contact_scales(w, v, h, control)
        t1, w1, v1, kv1, error, electric = whole_contact_step(t, w, v, kv, h, hammer, drive, scales)
        ratio = error / control[3]
        if not ratio <= 1.0:
            h *= step_factor(ratio)
            if h < shortest:
                return FAILED, start, h, electric
            continue
        code = rises_through(-w, v, kv, -w1, v1, kv1, h, 0.0)
        if code in (M.UNRESOLVED, M.NEAR_TOUCH):
            if h > shortest:
                h *= 0.5
                continue
            code = M.NO_SWITCH
        end = (t1, w1, v1, kv1)
        following = h * step_factor(ratio)
        switch, end = contact_switch(start, end, h, code == M.REACHED_FRONT, t_next, hammer, drive, control)
        if HAS_CIRCUIT:
            span = h
            if end[0] != t1:
                span, electric = electric_in_contact(start, end[0], hammer, drive)
            if not path_may_change(drive[0]):
                return switch, end, following, electric
            g0, d0 = contact_gap_and_change(t, w, v, kv, drive[1], span, hammer, drive[0])
            g1, d1 = contact_gap_and_change(end[0], end[1], end[2], end[3], electric, span, hammer, drive[0])
            code = closes(g0, d0, g1, d1)
            if code == M.UNRESOLVED and h > shortest:
                h *= 0.5
                continue
            if code == M.REACHED_FRONT:
                guess = velocity_root(g0, d0, g1, d1, 1.0)
                t1, w1, v1, kv1, electric = land_on_gap_in_contact(
                    start, end, electric, span, guess, hammer, drive
                )
                switch, end = M.CIRCUIT, (t1, w1, v1, kv1)
        return switch, end, following, electric
