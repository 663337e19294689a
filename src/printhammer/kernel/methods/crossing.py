"""Event location within a step: change of the coil's conduction path, or end of a rest of the armature.

The event is the first root of an event function, called `gap`: a smooth function of the state that is
positive until the event; see `printhammer.kernel.model.circuit.path_gap`. The Bernstein coefficients of the
cubic through the gaps and slopes at both ends of a step show whether a root lies inside; their deviation from
a straight line measures the reliability of the cubic. The root is located with the integrator.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import called, compiled, inlined
from printhammer.kernel.methods.hermite import velocity_root
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import POSITION, Control, ForceLaw

if TYPE_CHECKING:
    from printhammer.kernel.methods.dop853 import contact_state, whole_time_step
    from printhammer.kernel.model.circuit import (
        Electric,
        driven,
        electric_rates,
        moved,
        path_gap,
        path_may_change,
    )
    from printhammer.kernel.model.forces import Hammer, acceleration, hold_limit, is_on_stop
    from printhammer.kernel.model.laws import FRICTION
    from printhammer.kernel.model.pulses import Drive

STILL = 1e-12
"""Largest velocity change of an armature at rest in one characteristic time, relative to the velocity
scale."""

BEGUN = 1e-9
"""Largest event-function value treated as zero at the start of a step, e.g. on a new conduction path."""

SHARE = 1e-5
"""Finite-difference step for the time derivative of an event function, as a fraction of the step."""

NARROW = 1e-15
"""Width of a bracket, as a fraction of a backstop step, at which the location of an event ends."""

PATH_GAP, REST_GAP = 0, 1
"""Codes of the event functions: change of the coil's conduction path, and end of a rest of the armature."""


@compiled
def closes(g0: float, d0: float, g1: float, d1: float) -> int:
    """Decide from values g and scaled slopes d at both ends whether an event function has a zero in a step.

    The slopes are derivatives with respect to the fraction of the step.

    Returns
    -------
    int
        REACHED_FRONT if the gap has one root, NO_SWITCH if it has none, UNRESOLVED if the step must be
        halved.
    """
    b1, b2 = g0 + d0 / 3.0, g1 - d1 / 3.0
    if g0 <= BEGUN:
        # The slope at the start is no more accurate than the gap.
        if g1 > BEGUN:
            return M.NO_SWITCH if b2 > 0.0 else M.UNRESOLVED
        if g1 >= -BEGUN:
            return M.NO_SWITCH
        return M.REACHED_FRONT if g0 < -0.1 * BEGUN else M.UNRESOLVED
    if g1 <= 0.0:
        return M.UNRESOLVED if b1 < 0.0 < b2 else M.REACHED_FRONT
    bent = max(abs(b1 - (2.0 * g0 + g1) / 3.0), abs(b2 - (g0 + 2.0 * g1) / 3.0))
    return M.NO_SWITCH if min(b1, b2) > 0.5 * bent else M.UNRESOLVED


@inlined
def rest_gap(a: float, mode: int, hammer: Hammer, control: Control) -> float:
    """Return the event function for the end of a rest: positive while the armature stays at rest.

    `a` is the acceleration [m/s^2] that all forces but friction and a rigid stop would cause.
    """
    unit = control[1] * control[1] / control[0]
    if is_on_stop(mode):
        toward = a if mode == M.RESTING else -a
        return (hold_limit(hammer) - toward) / unit if FRICTION else -toward / unit
    if FRICTION:
        limit = hold_limit(hammer)
        return 1.0 - (a / limit) * (a / limit)
    return 1.0 - abs(a) / (STILL * unit)


@compiled
def gap_at(
    which: int, t: float, x: float, v: float, electric: Electric, law: ForceLaw, live: Any, control: Control
) -> float:
    """Evaluate the event function `which`, PATH_GAP or REST_GAP, at a state off the backstop."""
    mode, memory, hammer, _drive = law
    if which == PATH_GAP:
        return path_gap(x, v, electric, hammer, live)
    branch = mode
    if not FRICTION:
        branch = M.LOADING if mode == M.HELD_LOADING else (M.UNLOADING if mode == M.HELD_UNLOADING else mode)
    a = acceleration(t, x, v, branch, memory, hammer, driven(live, electric))
    return rest_gap(a, mode, hammer, control)


@compiled
def gap_and_change(
    which: int,
    t: float,
    x: float,
    v: float,
    a: float,
    electric: Electric,
    h: float,
    law: ForceLaw,
    live: Any,
    control: Control,
) -> tuple[float, float]:
    """Evaluate an event function off the backstop, and its time derivative multiplied by `h`."""
    gap = gap_at(which, t, x, v, electric, law, live, control)
    pause = SHARE * h
    rates = electric_rates(t, x, v, electric, law.hammer, live)
    if law.mode >= M.RESTING:
        v, a = 0.0, 0.0
    later = gap_at(
        which, t + pause, x + pause * v, v + pause * a, moved(electric, pause, rates), law, live, control
    )
    return gap, (later - gap) / SHARE


@called
def land_on_gap(
    which: int, start: Any, end: Any, electric: Electric, guess: float, law: ForceLaw, control: Control
) -> tuple[float, float, float, float, Electric]:
    """Locate the root of an event function in a step from `start` to `end`.

    The method is Newton's, from the fraction `guess` of the step, with a bisection if a correction exceeds
    half the previous correction or leaves the bracket. `electric` is the electric state at `end`.

    Returns
    -------
    tuple
        Time, displacement, velocity, acceleration and electric state at the root.
    """
    t, x, v, a = start
    h = end[0] - t
    low, high, at, ahead = 0.0, 1.0, guess, 2.0
    x1, v1, a1, e1 = end[1], end[2], end[3], electric
    negligible = 1e-15 * control[0] / control[1] / h
    for _ in range(100):
        if not (low < at < high):
            at = 0.5 * (low + high)
        if high - low <= negligible or not (low < at < high):
            break
        x2, v2, a2, _ex, _ev, e2, _ee = whole_time_step(t, x, v, a, at * h, law)
        gap, change = gap_and_change(which, t + at * h, x2, v2, a2, e2, h, law, law.drive[0], control)
        before, ahead = ahead, -gap / change if change < 0.0 else 2.0
        near = abs(gap) <= 1e-15 or abs(ahead) <= negligible
        # A rest ends where a force drives the armature off, not where the force is zero.
        if gap < 0.0 or (which == PATH_GAP and (gap == 0.0 or near)):
            high, x1, v1, a1, e1 = at, x2, v2, a2, e2
            if near:
                break
        else:
            low = at
            if near:
                negligible *= 2.0
                ahead = 0.5 * negligible
        at = at + ahead if abs(ahead) <= 0.5 * abs(before) else high
    return t + high * h, x1, v1, a1, e1


@compiled
def circuit_switch(
    start: Any, end: Any, electric: Electric, law: ForceLaw, control: Control
) -> tuple[int, Any, Electric]:
    """Search a step off the backstop for a change of the coil's conduction path or the end of a rest.

    Returns
    -------
    tuple
        Code CIRCUIT, REST_ENDED, NO_SWITCH or UNRESOLVED, and state and electric state at the event or,
        without an event, at the end of the step.
    """
    live = law.drive[0]
    result = M.NO_SWITCH
    resting = law.mode >= M.RESTING
    for which in range(2 if resting else 1):
        if which == PATH_GAP and not path_may_change(live):
            continue
        span = end[0] - start[0]
        g0, d0 = gap_and_change(
            which, start[0], start[1], start[2], start[3], law.drive[1], span, law, live, control
        )
        g1, d1 = gap_and_change(which, end[0], end[1], end[2], end[3], electric, span, law, live, control)
        code = closes(g0, d0, g1, d1)
        if code == M.UNRESOLVED:
            return code, end, electric
        if code == M.REACHED_FRONT:
            guess = velocity_root(g0, d0, g1, d1, 1.0)
            t, x, v, a, electric = land_on_gap(which, start, end, electric, guess, law, control)
            end = (t, x, v, a)
            result = M.CIRCUIT if which == PATH_GAP else M.REST_ENDED
    return result, end, electric


@compiled
def contact_gap(w: float, v: float, electric: Electric, hammer: Hammer, live: Any) -> float:
    """Evaluate `path_gap`, the event function for a change of conduction path, in a backstop contact."""
    return path_gap(hammer[POSITION] - w * w, v, electric, hammer, live)


@compiled
def contact_gap_and_change(
    t: float, w: float, v: float, kv: float, electric: Electric, h: float, hammer: Hammer, live: Any
) -> tuple[float, float]:
    """Evaluate `path_gap` in a backstop contact, and its derivative with respect to s multiplied by `h`."""
    gap = contact_gap(w, v, electric, hammer, live)
    pause = SHARE * h
    pace = 2.0 * w * pause
    rates = electric_rates(t, hammer[POSITION] - w * w, v, electric, hammer, live)
    later = contact_gap(w - v * pause, v + kv * pause, moved(electric, pace, rates), hammer, live)
    return gap, (later - gap) / SHARE


@called
def land_on_gap_in_contact(
    start: Any, end: Any, electric: Electric, h: float, guess: float, hammer: Hammer, drive: Drive
) -> tuple[float, float, float, float, Electric]:
    """Locate a change of the coil's conduction path in a backstop step.

    The length of the step in the regularised variable s is `h`. The method, `guess` and `electric` are those
    of `land_on_gap`.

    Returns
    -------
    tuple
        Time, w, velocity, dv/ds and electric state at the change.
    """
    t, w, v, kv = start
    low, high, at, ahead = 0.0, 1.0, guess, 2.0
    t1, w1, v1, kv1, e1 = end[0], end[1], end[2], end[3], electric
    for _ in range(100):
        if not (low < at < high):
            at = 0.5 * (low + high)
        if high - low <= NARROW or not (low < at < high):
            break
        t2, w2, v2, kv2, e2 = contact_state(t, w, v, kv, at * h, hammer, drive)
        gap, change = contact_gap_and_change(t2, w2, v2, kv2, e2, h, hammer, drive[0])
        before, ahead = ahead, -gap / change if change < 0.0 else 2.0
        near = abs(gap) <= 1e-15 or abs(ahead) <= NARROW
        if gap <= 0.0 or near:
            high, t1, w1, v1, kv1, e1 = at, t2, w2, v2, kv2, e2
            if near:
                break
        else:
            low = at
        at = at + ahead if abs(ahead) <= 0.5 * abs(before) else high
    return t1, w1, v1, kv1, e1
