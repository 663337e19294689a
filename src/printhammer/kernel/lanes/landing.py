"""Event location in lanes: estimate the time of the event, step to that time, and correct the estimate.

The quintic interpolant of the step that contains the event gives the estimate. The next step of the lane ends
at the estimated time, and a Taylor expansion from there yields the event. If the expansion is too inaccurate,
the scalar kernel locates the event.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.lanes import layout as R
from printhammer.kernel.methods.hermite import position_root, rises_through, turns_down, velocity_root
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import FRONT, POSITION

if TYPE_CHECKING:
    from printhammer.kernel.lanes.events import (
        part_at,
        quintic,
    )
    from printhammer.kernel.model.forces import Hammer

CLOSE = 1e-3
"""Largest time from the end of a step to the event for a Taylor expansion, as a fraction of the step."""

GOES_ON = -1
"""Return value instead of an event code: the lane takes another step before the event is located."""


@inlined
def ends_of_step(pool: Any, i: int, sign: float) -> tuple[float, float, float, float, float, float, float]:
    """Return sign * (x, v, a) at the start and the end of the latest step, and the length of the step."""
    x, v, a = pool[R.X * R.BLOCK + i], pool[R.V * R.BLOCK + i], pool[R.A * R.BLOCK + i]
    x1, v1 = pool[R.NEW_X * R.BLOCK + i], pool[R.NEW_V * R.BLOCK + i]
    a1, h = pool[R.NEW_A * R.BLOCK + i], pool[R.LENGTH * R.BLOCK + i]
    return sign * x, sign * v, sign * a, sign * x1, sign * v1, sign * a1, h


@inlined
def rises_in_step(pool: Any, i: int, level: float, sign: float) -> int:
    """Return the code of `rises_through` for sign * x and sign * `level` in a lane's latest step."""
    return rises_through(*ends_of_step(pool, i, sign), sign * level)


@inlined
def level_part(pool: Any, i: int, level: float, sign: float) -> float:
    """Return the fraction of a lane's latest step at which sign * x rises through sign * `level`."""
    return position_root(*ends_of_step(pool, i, sign), sign * level, 1.0)


@compiled
def guess_free(pool: Any, i: int, hammer: Hammer) -> tuple[int, float]:
    """Return the code of the first event in a lane's latest step in free flight, and where it occurs.

    The place of the event is an estimate, as a fraction of the step.
    """
    down = rises_in_step(pool, i, hammer[POSITION], -1.0)
    up = rises_in_step(pool, i, hammer[FRONT], 1.0)
    if M.UNRESOLVED in (down, up):
        return M.UNRESOLVED, 1.0
    if M.NEAR_TOUCH in (down, up):
        return M.NEAR_TOUCH, 1.0
    switch, part = M.NO_SWITCH, 2.0
    if down == M.REACHED_FRONT:
        switch, part = M.REACHED_BACKSTOP, level_part(pool, i, hammer[POSITION], -1.0)
    if up == M.REACHED_FRONT:
        other = level_part(pool, i, hammer[FRONT], 1.0)
        if other < part:
            switch, part = M.REACHED_FRONT, other
    return switch, part


@compiled
def guess_in_pack(pool: Any, i: int, which: int, hammer: Hammer) -> tuple[int, float]:
    """Return the code of the first event in a lane's latest step in the pack, and where it occurs.

    The place of the event is an estimate, as a fraction of the step.
    """
    h = pool[R.LENGTH * R.BLOCK + i]
    turn = -1.0 if which == R.UNLOADING_POOL else 1.0
    v0, a0 = turn * pool[R.V * R.BLOCK + i], turn * pool[R.A * R.BLOCK + i]
    v1, a1 = turn * pool[R.NEW_V * R.BLOCK + i], turn * pool[R.NEW_A * R.BLOCK + i]
    switch, part = M.NO_SWITCH, 2.0
    if which == R.UNLOADING_POOL:
        code = rises_in_step(pool, i, hammer[FRONT], -1.0)
        if code in (M.UNRESOLVED, M.NEAR_TOUCH):
            return code, 1.0
        if code == M.REACHED_FRONT:
            switch, part = M.LEFT_FRONT, level_part(pool, i, hammer[FRONT], -1.0)
    code = turns_down(turn * pool[R.X * R.BLOCK + i], v0, a0, turn * pool[R.NEW_X * R.BLOCK + i], v1, a1, h)
    if code == M.UNRESOLVED:
        return M.UNRESOLVED, 1.0
    if code == M.REACHED_FRONT:
        other = velocity_root(v0, a0, v1, a1, h)
        if other < part:
            switch, part = M.REVERSAL, other
    return switch, part


@compiled
def guess_in_contact(pool: Any, i: int) -> tuple[int, float]:
    """Return the code of the first event in a lane's latest step in backstop contact, and where it occurs.

    The place of the event is an estimate, as a fraction of the step in the regularised variable s.
    """
    t0, t1 = pool[i], pool[R.NEW_T * R.BLOCK + i]
    w0, w1 = pool[R.X * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
    v0, v1 = pool[R.V * R.BLOCK + i], pool[R.NEW_V * R.BLOCK + i]
    kv0, kv1 = pool[R.A * R.BLOCK + i], pool[R.NEW_A * R.BLOCK + i]
    h = pool[R.LENGTH * R.BLOCK + i]
    t_next = pool[R.NEXT * R.BLOCK + i]
    code = rises_through(-w0, v0, kv0, -w1, v1, kv1, h, 0.0)
    if code in (M.UNRESOLVED, M.NEAR_TOUCH):
        return M.UNRESOLVED, 1.0
    if code == M.REACHED_FRONT:
        part = position_root(-w0, v0, kv0, -w1, v1, kv1, h, 0.0, 1.0)
        if quintic(part, h, t0, 2.0 * w0, -2.0 * v0, t1, 2.0 * w1, -2.0 * v1) < t_next:
            return M.LEFT_BACKSTOP, part
        return M.EDGE, part_at(pool, i, t_next)
    if t1 == t_next:
        return M.EDGE, 1.0
    if t1 > t_next:
        return M.EDGE, part_at(pool, i, t_next)
    return M.NO_SWITCH, 1.0


@compiled
def guess(pool: Any, i: int, which: int, hammer: Hammer) -> tuple[int, float]:
    """Return the code of the first event in a lane's latest step, and where it occurs.

    The place of the event is an estimate, as a fraction of the step.
    """
    if which == R.CONTACT_POOL:
        return guess_in_contact(pool, i)
    if which == R.FREE_POOL:
        return guess_free(pool, i, hammer)
    return guess_in_pack(pool, i, which, hammer)


@compiled
def aim(pool: Any, i: int, slot: Any, switch: int, part: float) -> None:
    """Set the next step of a lane to end at the event `switch`.

    The event is estimated to occur at the fraction `part` of the latest step, which is repeated.
    """
    slot[R.SAVED_STEP] = pool[R.FOLLOWING * R.BLOCK + i]
    slot[R.ATTEMPTS] = 0.0
    pool[R.H * R.BLOCK + i] = part * pool[R.LENGTH * R.BLOCK + i]
    pool[R.LANDING * R.BLOCK + i] = switch


@compiled
def land(
    pool: Any, i: int, which: int, slot: Any, hammer: Hammer, control: Any
) -> tuple[int, float, float, float]:
    """Compute the event at which a lane's latest step was aimed, by a Taylor expansion from its end.

    Returns
    -------
    tuple
        Code of the event, and time, displacement (w in the contact pool) and velocity at the event. The code
        is GOES_ON if the expansion is too inaccurate, so that another step is needed.
    """
    switch = int(pool[R.LANDING * R.BLOCK + i])
    h = pool[R.LENGTH * R.BLOCK + i]
    t, x = pool[R.NEW_T * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
    v, a = pool[R.NEW_V * R.BLOCK + i], pool[R.NEW_A * R.BLOCK + i]
    # The remainder may be a hundred times the tolerance: the error of the expansion is of the next order.
    allowed = 10.0 * control[3] * control[0]
    if which == R.CONTACT_POOL:
        if switch == M.EDGE:
            target = pool[R.NEXT * R.BLOCK + i]
            rest = (target - t) / (2.0 * x)
            good = x > 0.0 and abs(rest) * (abs(v) + abs(a * rest)) <= 1e-4 * x
            rest += 0.5 * v * rest * rest / x
            t, x, v = target, x - v * rest - 0.5 * a * rest * rest, v + a * rest
        else:
            rest = x / v
            good = abs(a * rest) <= 1e-4 * abs(v)
            t, x, v = t + x * rest, 0.0, v + 0.5 * a * rest
    elif switch == M.REVERSAL:
        rest = -v / a
        good = abs(0.5 * v * rest) <= allowed
        t, x, v = t + rest, x + 0.5 * v * rest, 0.0
    else:
        level = hammer[POSITION] if switch == M.REACHED_BACKSTOP else hammer[FRONT]
        rest = (level - x) / v
        good = abs(0.5 * a * rest * rest) <= allowed and abs(a * rest) <= 1e-3 * abs(v)
        rest -= 0.5 * a * rest * rest / v
        t, x, v = t + rest, level, v + a * rest
    if good and abs(rest) <= CLOSE * h and t >= pool[i]:
        pool[R.LANDING * R.BLOCK + i] = 0.0
        pool[R.H * R.BLOCK + i] = slot[R.SAVED_STEP]
        return switch, t, x, v
    slot[R.ATTEMPTS] += 1.0
    length = h + rest
    if slot[R.ATTEMPTS] < 4.0 and 0.0 < length < 2.0 * h:
        pool[R.H * R.BLOCK + i] = length
    else:
        pool[R.LANDING * R.BLOCK + i] = 0.0
        pool[R.H * R.BLOCK + i] = slot[R.SAVED_STEP]
        slot[R.CAREFUL] = 1.0
    return GOES_ON, t, x, v
