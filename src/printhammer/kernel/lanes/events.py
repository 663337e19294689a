"""Events of a member between two steps of its lane: mode changes, drive edges, samples and strobes.

The functions are scalar code for one lane at a time. Data of a member that the steps do not need are stored
in a row `slot` outside its lane. Rare events (a touch with zero velocity, a rest, a departure from the range,
a reloading) remove the member from the lanes: :func:`printhammer.kernel.lanes.members.members` then repeats
its run from the beginning.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.lanes import layout as R
from printhammer.kernel.methods.hermite import rises_through
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.dots import TIME_OUT
from printhammer.kernel.model.layout import BACKSTOP_PART, FRONT, PACK, POSITION, Control, ForceLaw, Train
from printhammer.kernel.model.transitions import FOLLOWING

if TYPE_CHECKING:
    from printhammer.kernel.lanes.drive import add_up
    from printhammer.kernel.lanes.steps import lane_acceleration, lane_contact_rate
    from printhammer.kernel.methods.contact import contact_switch
    from printhammer.kernel.methods.landing import first_switch, land_on_level, land_on_reversal
    from printhammer.kernel.model.forces import Hammer
    from printhammer.kernel.model.laws import HAS_DAMPING, RELOAD_ALONG_UNLOADING, pack_memory
    from printhammer.kernel.model.pulses import Drive, edges_at
    from printhammer.kernel.single.around import contact_unit
    from printhammer.kernel.single.resample import state_in_step
    from printhammer.kernel.single.stretch import deepen_dot, open_dot

MODE_OF = (M.FREE, M.LOADING, M.UNLOADING, M.BACKSTOP)
"""Mode of motion of the members of each pool, indexed by pool."""

STAYS = -1
"""Return value instead of a pool index: the member stays in its lane."""
LEAVES = -2
"""Return value instead of a pool index: the member leaves the lanes; the scalar kernel repeats its run."""
DONE = -3
"""Return value instead of a pool index: the run of the member is complete."""


@inlined
def place(lane: int) -> int:
    """Return the index of the first row of a lane in the array of its pool; rows follow at stride `BLOCK`."""
    return (lane // R.BLOCK) * R.BLOCK_SIZE + lane % R.BLOCK


@compiled
def copy_lane(source: Any, i: int, target: Any, j: int, rows: int) -> None:
    """Copy the first `rows` rows of the lane at index `i` of one pool to index `j` of another pool."""
    for row in range(rows):
        target[row * R.BLOCK + j] = source[row * R.BLOCK + i]


@compiled
def quintic(part: float, h: float, x0: float, v0: float, a0: float, x1: float, v1: float, a1: float) -> float:
    """Evaluate the quintic Hermite interpolant of a step of length `h` at the fraction `part` of the step."""
    # Remainders relative to the quadratic Taylor polynomial at the start of the step.
    b0 = h * v0
    c0 = 0.5 * h * h * a0
    d = x1 - (x0 + b0 + c0)
    e = h * v1 - (b0 + 2.0 * c0)
    f = h * h * (a1 - a0)
    p3 = 10.0 * d - 4.0 * e + 0.5 * f
    p4 = -15.0 * d + 7.0 * e - f
    p5 = 6.0 * d - 3.0 * e + 0.5 * f
    return x0 + part * (b0 + part * (c0 + part * (p3 + part * (p4 + part * p5))))


@compiled
def sixth_term(pool: Any, i: int, which: int) -> float:
    """Return the coefficient k of the correction k u^3 (u - 1)^3 to the latest step's quintic interpolant.

    Here u is the fraction of the step. With the correction, the acceleration of the interpolant at the middle
    of the step, u = 1/2, agrees with the force there.
    """
    h = pool[R.LENGTH * R.BLOCK + i]
    x0, x1 = pool[R.OLD_X * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
    v0, v1 = pool[R.OLD_V * R.BLOCK + i], pool[R.NEW_V * R.BLOCK + i]
    a0, a1 = pool[R.OLD_A * R.BLOCK + i], pool[R.NEW_A * R.BLOCK + i]
    middle = quintic(0.5, h, x0, v0, a0, x1, v1, a1)
    t = pool[R.OLD_T * R.BLOCK + i] + 0.5 * h
    memory, v = pool[R.MEMORY * R.BLOCK + i], 0.0
    if HAS_DAMPING:
        v = 1.875 * (x1 - x0) / h - 0.4375 * (v0 + v1) + 0.03125 * h * (a1 - a0)
    a = lane_acceleration(pool, i, t, middle, v, MODE_OF[which], memory)
    # Second derivative of the quintic with respect to u at the middle of the step.
    bend = 1.5 * h * (v1 - v0) - 0.25 * h * h * (a0 + a1)
    return float((a * h * h - bend) / 0.375)


@compiled
def position_in_step(pool: Any, i: int, which: int, time: float, b: float, sixth: float, fine: bool) -> float:
    """Return the displacement [m] at a time [s] inside the latest step of a lane, by interpolation.

    `b` is the backstop position [m], and `sixth` the result of `sixth_term`, or 0. With `fine`, a backstop
    contact is always interpolated in the regularised variable s, otherwise in time where that is smooth.
    """
    x0, x1 = pool[R.OLD_X * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
    v0, v1 = pool[R.OLD_V * R.BLOCK + i], pool[R.NEW_V * R.BLOCK + i]
    a0, a1 = pool[R.OLD_A * R.BLOCK + i], pool[R.NEW_A * R.BLOCK + i]
    h = pool[R.LENGTH * R.BLOCK + i]
    if not time > pool[R.OLD_T * R.BLOCK + i]:
        # The requested time may coincide with the start of the step.
        return float(b - x0 * x0 if which == R.CONTACT_POOL else x0)
    if which != R.CONTACT_POOL:
        u = (time - pool[R.OLD_T * R.BLOCK + i]) / h
        bump = u * (u - 1.0)
        return float(quintic(u, h, x0, v0, a0, x1, v1, a1) + sixth * bump * bump * bump)
    if not fine and x1 > 0.5 * x0 and x0 > 0.5 * x1:
        # Away from the ends of a contact, the displacement is also a smooth function of time.
        t0 = pool[R.OLD_T * R.BLOCK + i]
        h = pool[R.NEW_T * R.BLOCK + i] - t0
        a0, a1 = 0.5 * a0 / x0, 0.5 * a1 / x1
        return quintic((time - t0) / h, h, b - x0 * x0, v0, a0, b - x1 * x1, v1, a1)
    part = part_at(pool, i, time)
    w = quintic(part, h, x0, -v0, -a0, x1, -v1, -a1)
    return b - w * w


@compiled
def part_at(pool: Any, i: int, time: float) -> float:
    """Return the fraction of a lane's latest backstop step, in the variable s, at which `time` [s] lies."""
    t0, t1 = pool[R.OLD_T * R.BLOCK + i], pool[R.NEW_T * R.BLOCK + i]
    w0, w1 = pool[R.OLD_X * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
    v0, v1 = pool[R.OLD_V * R.BLOCK + i], pool[R.NEW_V * R.BLOCK + i]
    a0, a1 = pool[R.OLD_A * R.BLOCK + i], pool[R.NEW_A * R.BLOCK + i]
    h = pool[R.LENGTH * R.BLOCK + i]
    low, high = 0.0, 1.0
    # The step may extend beyond the end of the contact, where w < 0 and the time decreases.
    part = (time - t0) / (t1 - t0) if time < t1 and w1 > 0.0 else 0.5
    for _ in range(60):
        # dt/ds = 2 w, d2t/ds2 = -2 v
        found = quintic(part, h, t0, 2.0 * w0, -2.0 * v0, t1, 2.0 * w1, -2.0 * v1)
        w = quintic(part, h, w0, -v0, -a0, w1, -v1, -a1)
        if found > time or w <= 0.0:
            high = part
        else:
            low = part
        change = (time - found) / (2.0 * w * h) if w > 0.0 else 1.0
        if abs(change) <= 1e-10:
            break
        part += change
        if not (low < part < high):
            part = 0.5 * (low + high)
    return part


@compiled
def note_samples(
    pool: Any,
    i: int,
    which: int,
    until: float,
    last: bool,
    fine: bool,
    slot: Any,
    grid: Any,
    x: Any,
    b: float,
) -> None:
    """Store the displacement samples of a lane's latest step whose times lie before `until` [s].

    With `last`, a sample at the time `until` is stored as well. With `fine`, an additional force evaluation
    raises the order of the interpolation by one. `b` is the backstop position [m].
    """
    m = int(slot[R.MEMBER])
    sample = int(slot[R.NEXT_SAMPLE])
    sixth = np.nan if fine and which != R.CONTACT_POOL else 0.0
    while sample < grid.size and (grid[sample] < until or (last and grid[sample] == until)):
        if sixth != sixth:  # noqa: PLR0124
            sixth = sixth_term(pool, i, which)
        x[m, sample] = position_in_step(pool, i, which, grid[sample], b, sixth, fine)
        sample += 1
    slot[R.NEXT_SAMPLE] = sample
    due = grid[sample] if sample < grid.size else np.inf
    pool[R.SAMPLE * R.BLOCK + i] = min(due, slot[R.NEXT_TIME])


@compiled
def note_strobes(
    pool: Any,
    i: int,
    which: int,
    until: float,
    last: bool,
    slot: Any,
    times: Any,
    strobes: Any,
    train: Train,
    hammer: Hammer,
) -> None:
    """Store the strobes of a lane's latest step whose times lie before `until` [s].

    With `last`, a strobe at the time `until` is stored as well. Otherwise, a strobe at the end of a step is
    stored with the next step, which determines its mode.
    """
    strobe = int(slot[R.NEXT_STROBE])
    t0 = pool[R.OLD_T * R.BLOCK + i]
    x0 = pool[R.OLD_X * R.BLOCK + i]
    v0 = pool[R.OLD_V * R.BLOCK + i]
    mode = MODE_OF[which]
    kept = 0.0
    if which == R.CONTACT_POOL:
        kept = x0
        x0 = hammer[POSITION] - kept * kept
    elif which == R.UNLOADING_POOL:
        kept = pool[R.PEAK * R.BLOCK + i]
    edges_at(t0, train)
    while strobe < times.size and (times[strobe] < until or (last and times[strobe] == until)):
        x, v, _w, _electric = state_in_step(times[strobe], t0, x0, v0, mode, kept, hammer, train.live)
        strobes[strobe, 0] = x
        strobes[strobe, 1] = v
        strobes[strobe, 2] = mode
        strobes[strobe, 3] = kept if mode == M.UNLOADING else 0.0
        strobe += 1
    slot[R.NEXT_STROBE] = strobe
    slot[R.NEXT_TIME] = times[strobe] if strobe < times.size else np.inf


@compiled
def enter_contact(pool: Any, i: int, v: float, slot: Any, control: Any) -> int:
    """Start a backstop contact at zero compression with velocity `v` [m/s]; return the lane's new pool."""
    unit = contact_unit(v, control)
    slot[R.UNIT] = unit
    pool[R.X * R.BLOCK + i] = 0.0
    pool[R.V * R.BLOCK + i] = v
    pool[R.A * R.BLOCK + i] = 0.0
    pool[R.H * R.BLOCK + i] = slot[R.CONTACT_STEP] * unit
    pool[R.FIRST * R.BLOCK + i] = 0.0
    return R.CONTACT_POOL


@compiled
def enter(pool: Any, i: int, t: float, x: float, v: float, mode: int, h: float, memory: float) -> None:
    """Write the state of a lane at the start of a mode off the backstop, with the initial step size `h`."""
    pool[R.X * R.BLOCK + i] = x
    pool[R.V * R.BLOCK + i] = v
    pool[R.A * R.BLOCK + i] = lane_acceleration(pool, i, t, x, v, mode, memory)
    pool[R.H * R.BLOCK + i] = h
    pool[R.FIRST * R.BLOCK + i] = 0.0
    pool[R.MEMORY * R.BLOCK + i] = memory


@compiled
def remember_step(pool: Any, i: int, which: int, slot: Any) -> None:
    """Store the step size that suited the start of the present mode, for the next start of that mode."""
    first = pool[R.FIRST * R.BLOCK + i]
    if first > 0.0:
        if which == R.FREE_POOL:
            slot[R.FREE_STEP] = first
        elif which == R.LOADING_POOL:
            slot[R.PACK_STEP] = first
        elif which == R.CONTACT_POOL and slot[R.UNIT] > 0.0:
            slot[R.CONTACT_STEP] = first / slot[R.UNIT]


@compiled
def turn_in_pack(
    pool: Any,
    i: int,
    t: float,
    x: float,
    which: int,
    slot: Any,
    dots: Any,
    hammer: Hammer,
    control: Any,
) -> int:
    """Select the next mode after the velocity has become zero inside the pack at displacement `x`.

    Returns the index of the pool for this mode, or LEAVES if the armature would rest. The rule is that of
    :func:`printhammer.kernel.single.around.reversed_mode`.
    """
    # As in the scalar kernel, oscillations too small to distinguish from rest would never end.
    still = R.STILL * control[1] * control[1] / control[0]
    inward = lane_acceleration(pool, i, t, x, 0.0, M.LOADING, 0.0) > 0.0
    if (inward and which == R.LOADING_POOL) or (RELOAD_ALONG_UNLOADING and which == R.UNLOADING_POOL):
        return LEAVES
    dot = int(slot[R.DOT])
    if dot >= 0:
        deepen_dot(dots, dot, x, hammer)
    if inward:
        enter(pool, i, t, x, 0.0, M.LOADING, slot[R.PACK_STEP], 0.0)
        return R.LOADING_POOL if pool[R.A * R.BLOCK + i] > still else LEAVES
    enter(pool, i, t, x, 0.0, M.UNLOADING, slot[R.PACK_STEP], pack_memory(hammer[PACK:BACKSTOP_PART], x))
    pool[R.PEAK * R.BLOCK + i] = x
    return R.UNLOADING_POOL if pool[R.A * R.BLOCK + i] < -still else LEAVES


@compiled
def after_switch(
    switch: int,
    pool: Any,
    i: int,
    t: float,
    x: float,
    v: float,
    which: int,
    slot: Any,
    dots: Any,
    want_dots: bool,
    firings: Any,
    hammer: Hammer,
    control: Any,
) -> int:
    """Update a member after a switching event; return the index of its new pool of lanes, or LEAVES."""
    remember_step(pool, i, which, slot)
    pool[R.T * R.BLOCK + i] = t
    if switch == M.REVERSAL:
        if x <= hammer[FRONT]:
            return LEAVES
        return turn_in_pack(pool, i, t, x, which, slot, dots, hammer, control)
    following = FOLLOWING[MODE_OF[which], switch]
    if following == M.BACKSTOP:
        return enter_contact(pool, i, v, slot, control) if v < 0.0 else LEAVES
    if following == M.LOADING:
        if not v > 0.0:
            return LEAVES
        slot[R.DOT] = -1.0
        if want_dots:
            row, extra = open_dot(dots, int(slot[R.EXTRA]), M.PACK_SURFACE, False, t, v, firings)
            slot[R.DOT], slot[R.EXTRA] = row, extra
        enter(pool, i, t, x, v, M.LOADING, slot[R.PACK_STEP], 0.0)
        return R.LOADING_POOL
    if following != M.FREE:
        return LEAVES
    away, level = v, hammer[POSITION]
    if switch == M.LEFT_FRONT:
        away, level = -v, hammer[FRONT]
        if int(slot[R.DOT]) >= 0:
            dots[int(slot[R.DOT]), TIME_OUT] = t
        slot[R.DOT] = -1.0
    if not away > 0.0:
        return LEAVES
    enter(pool, i, t, level, v, M.FREE, slot[R.FREE_STEP], 0.0)
    return R.FREE_POOL


@compiled
def new_edge(
    pool: Any,
    i: int,
    which: int,
    end: float,
    train: Train,
    rates: Any,
) -> None:
    """Update the active pulses, the acceleration and the next edge of a lane at an edge of the drive.

    The end of the run, `end` [s], counts as an edge.
    """
    t = pool[R.T * R.BLOCK + i]
    _first, _last, edge = edges_at(t, train)
    add_up(t, train.live, rates, pool, i)
    pool[R.NEXT * R.BLOCK + i] = min(edge, end)
    x, v = pool[R.X * R.BLOCK + i], pool[R.V * R.BLOCK + i]
    if which == R.CONTACT_POOL:
        pool[R.A * R.BLOCK + i] = lane_contact_rate(pool, i, t, x, v)
    else:
        memory = pool[R.MEMORY * R.BLOCK + i]
        pool[R.A * R.BLOCK + i] = lane_acceleration(pool, i, t, x, v, MODE_OF[which], memory)


@compiled
def close_member(pool: Any, i: int, which: int, slot: Any, dots: Any, hammer: Hammer) -> None:
    """Record the largest depth of a pack contact that is still open at the end of a run."""
    dot = int(slot[R.DOT])
    if which == R.LOADING_POOL and dot >= 0:
        deepen_dot(dots, dot, pool[R.X * R.BLOCK + i], hammer)


@compiled
def locate(
    pool: Any, i: int, which: int, hammer: Hammer, live: Drive, control: Control
) -> tuple[int, float, float, float]:
    """Locate the event in a lane's latest step with the functions of the scalar kernel.

    Returns the code of the event, and time, position and velocity at the event. In the contact pool, w =
    sqrt(b - x) replaces the position. The code is NO_SWITCH if the step contains no event, UNRESOLVED if the
    step must be halved.
    """
    start = (pool[i], pool[R.X * R.BLOCK + i], pool[R.V * R.BLOCK + i], pool[R.A * R.BLOCK + i])
    h = pool[R.LENGTH * R.BLOCK + i]
    t, x = pool[R.NEW_T * R.BLOCK + i], pool[R.NEW_X * R.BLOCK + i]
    v, a = pool[R.NEW_V * R.BLOCK + i], pool[R.NEW_A * R.BLOCK + i]
    if which == R.CONTACT_POOL:
        code = rises_through(-start[1], start[2], start[3], -x, v, a, h, 0.0)
        if code in (M.UNRESOLVED, M.NEAR_TOUCH):
            return M.UNRESOLVED, t, x, v
        t_next = pool[R.NEXT * R.BLOCK + i]
        leaves = code == M.REACHED_FRONT
        switch, end = contact_switch(start, (t, x, v, a), h, leaves, t_next, hammer, live, control)
        return switch, end[0], end[1], end[2]
    law = ForceLaw(MODE_OF[which], pool[R.MEMORY * R.BLOCK + i], hammer, live)
    peak = pool[R.PEAK * R.BLOCK + i]
    switch, fraction, upper, level, sign = first_switch(start, (t, x, v, a), h, law, peak, control)
    if switch == M.REVERSAL:
        turn = land_on_reversal(start, h, fraction, sign, law, control)
        return switch, turn[0], turn[1], 0.0
    if switch not in (M.NO_SWITCH, M.UNRESOLVED):
        t, x, v, a = land_on_level(start, h, fraction, upper, level, sign, law, control)
    return switch, t, x, v
