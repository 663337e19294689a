"""One step of a run, by mode: in backstop contact, at rest, or off the backstop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import inlined
from printhammer.kernel.methods.crossing import STILL
from printhammer.kernel.methods.landing import FAILED
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import POSITION, ForceLaw
from printhammer.kernel.single import carry as C

if TYPE_CHECKING:
    from printhammer.kernel.methods.contact import advance_contact
    from printhammer.kernel.methods.landing import advance
    from printhammer.kernel.model.circuit import driven, electric_rates, is_quiet, moved
    from printhammer.kernel.model.forces import hold_limit, is_on_stop, least_at_rest, most_at_rest
    from printhammer.kernel.model.laws import FRICTION, HAS_CIRCUIT, MEMORY
    from printhammer.kernel.single.around import (
        contact_unit,
        kick_into_backstop,
        left_range,
        reversed_mode,
        sensible_step,
    )
    from printhammer.kernel.single.carry import Setup
    from printhammer.kernel.single.phases import (
        State,
        accelerate,
        accelerate_at_rest,
        acceleration_in,
        electric_of,
        keep_electric,
        mode_at_rest,
        rate_in_backstop,
    )
    from printhammer.kernel.single.record import relabel_node, renew_node
    from printhammer.kernel.single.rest import friction_ends, goes_on_in, rest_ends

BRANCHES = (M.UNLOADING, M.LOADING, M.RELOADING)
"""Modes inside the pack in which an armature can come to rest."""


@inlined
def stillness(control: Any) -> float:
    """Return the acceleration [m/s^2] below which an armature with zero velocity stays at rest."""
    return float(STILL * control[1] / (control[0] / control[1]))


@inlined
def take_step(state: State, setup: Setup, t_next: float, nodes: Any) -> tuple[int, int]:
    """Integrate over one step, up to `t_next` [s] at most, with the method of the present mode.

    Returns the switching event that ends the step, or `HOLDS`, and the status of the run.
    """
    mode, control = int(state[C.MODE]), setup.control
    still = stillness(control)
    rests = is_on_stop(mode) or (
        state[C.VELOCITY] == 0.0 and abs(state[C.ACCELERATION]) <= still and mode in BRANCHES
    )
    if FRICTION and state[C.VELOCITY] == 0.0:
        accelerate_at_rest(state, setup)
        rests = is_on_stop(mode) or abs(state[C.ACCELERATION]) <= hold_limit(setup.hammer)
        if not rests:
            rests = set_off(state, setup, nodes)
    if mode == M.BACKSTOP:
        return backstop_step(state, setup, t_next, still, nodes), M.OK
    if rests and not (HAS_CIRCUIT and not circuit_is_quiet(state, setup)):
        return wait(state, setup, t_next, still, nodes), M.OK
    if HAS_CIRCUIT and rests:
        return step_at_rest(state, setup, t_next, nodes), M.OK
    return smooth_step(state, setup, t_next)


@inlined
def circuit_is_quiet(state: State, setup: Setup) -> bool:
    """Whether the electric state is constant until the next edge of the drive, with the armature at rest."""
    if HAS_CIRCUIT:
        control = setup.control
        return is_quiet(
            state[C.TIME],
            state[C.POSITION_NOW],
            control[0] / control[1],
            electric_of(state),
            setup.hammer,
            setup.train.live,
        )
    return True


@inlined
def backstop_step(state: State, setup: Setup, t_next: float, still: float, nodes: Any) -> int:
    """Integrate one step in backstop contact, in regularised variables; return the event that ends it.

    `still` is the result of `stillness`.
    """
    hammer, control, live = setup.hammer, setup.control, setup.train.live
    if state[C.ENTERED] != 0.0:
        rate_in_backstop(state, setup)
        state[C.ENTERED] = 0.0
    t, w, v, kv = state[C.TIME], state[C.ROOT], state[C.VELOCITY], state[C.ROOT_RATE]
    idle = state[C.FIRST] == state[C.LAST]
    if HAS_CIRCUIT:
        idle = circuit_is_quiet(state, setup)
    switch = M.NO_SWITCH
    if w > 0.0 and idle and abs(v) <= 1e-14 * control[1] and abs(kv) <= 0.1 * still * 2.0 * w:
        relabel_node(nodes, int(state[C.USED]), M.HELD)
        state[C.TIME] = t_next
        switch = M.EDGE
    elif w == 0.0 and v == 0.0:
        later, w, v = kick_into_backstop(t, state[C.ACCELERATION], t_next, control)
        if HAS_CIRCUIT:
            electric = electric_of(state)
            rates = electric_rates(t, state[C.POSITION_NOW], 0.0, electric, hammer, live)
            keep_electric(moved(electric, later - t, rates), state)
        state[C.TIME], state[C.ROOT], state[C.VELOCITY] = later, w, v
        rate_in_backstop(state, setup)
        switch = M.EDGE if later == t_next else M.NO_SWITCH
    else:
        touching = w == 0.0 and int(state[C.STARTED]) != M.BACKSTOP
        unit = 1.0
        if int(state[C.STARTED]) != M.BACKSTOP:
            state[C.STARTED] = M.BACKSTOP
            unit = contact_unit(v, control)
            state[C.STEP] = state[C.CONTACT_STEP] * unit
        switch, end, h, electric = advance_contact(
            (t, w, v, kv),
            state[C.STEP],
            t_next,
            hammer,
            driven(setup.train.live, electric_of(state)),
            control,
        )
        state[C.STEP] = h
        if touching:
            state[C.CONTACT_STEP] = h / unit
        state[C.TIME], state[C.ROOT], state[C.VELOCITY], state[C.ROOT_RATE] = end
        keep_electric(electric, state)
        w = end[1]
    state[C.POSITION_NOW] = hammer[POSITION] - w * w
    return switch


@inlined
def reverse(state: State, setup: Setup) -> None:
    """Update mode, local maximum and memory when the velocity has become zero inside the pack."""
    mode, peak, memory = reversed_mode(
        state[C.TIME],
        state[C.POSITION_NOW],
        int(state[C.MODE]),
        state[C.PEAK],
        state[C.MEMORY_NOW],
        setup.hammer,
        driven(setup.train.live, electric_of(state)),
    )
    state[C.MODE], state[C.PEAK], state[C.MEMORY_NOW] = mode, peak, memory


@inlined
def set_off(state: State, setup: Setup, nodes: Any) -> bool:
    """Determine the direction in which an armature at rest begins to slide, against dry friction.

    Returns whether the armature stays at rest after all, on the unloading branch that begins at its position.
    """
    mode, a = int(state[C.MODE]), state[C.ACCELERATION]
    kept = 1.0 if a > 0.0 else -1.0
    stays = False
    if MEMORY and mode in BRANCHES:
        if not goes_on_in(a, mode):
            reverse(state, setup)
            if a > 0.0 and int(state[C.MODE]) == M.UNLOADING:
                accelerate_at_rest(state, setup)
                limit = hold_limit(setup.hammer)
                stays = abs(state[C.ACCELERATION]) <= limit
                if state[C.ACCELERATION] > limit:
                    state[C.MODE] = M.LOADING
        if int(state[C.MODE]) != M.LOADING:
            kept = state[C.PEAK]
    else:
        state[C.MEMORY_NOW] = kept
    renew_node(nodes, int(state[C.USED]), int(state[C.MODE]), kept)
    if not stays:
        accelerate(state, setup)
    return stays


@inlined
def wait(state: State, setup: Setup, t_next: float, still: float, nodes: Any) -> int:
    """Advance the time of an armature at rest; return the event that ends the rest, or `HOLDS`.

    `still` is the result of `stillness`.
    """
    mode, t, x = int(state[C.MODE]), state[C.TIME], state[C.POSITION_NOW]
    time_scale = setup.control[0] / setup.control[1]
    pause = t_next - t
    if state[C.FIRST] < state[C.LAST] and not HAS_CIRCUIT:
        pause = min(pause, state[C.WAIT])
    held = 0.0 if is_on_stop(mode) else still
    if FRICTION:
        held = hold_limit(setup.hammer)
    least, most = least_at_rest(mode, held), most_at_rest(mode, held)
    if not is_on_stop(mode):
        relabel_node(nodes, int(state[C.USED]), mode_at_rest(mode))
    branch = mode_at_rest(mode) if FRICTION else mode
    law = ForceLaw(branch, state[C.MEMORY_NOW], setup.hammer, driven(setup.train.live, electric_of(state)))
    if FRICTION:
        ended, pause = friction_ends(t, x, pause, least, most, law)
        state[C.WAIT] = C.SHORTEST_WAIT * time_scale if ended else min(2.0 * pause, time_scale)
    else:
        ended, pause = rest_ends(t, x, pause, least, most, law)
        state[C.WAIT] = (
            C.SHORTEST_WAIT * time_scale
            if ended or is_on_stop(mode)
            else min(2.0 * state[C.WAIT], time_scale)
        )
    switch = M.EDGE if pause == t_next - t else M.NO_SWITCH
    state[C.TIME] = t_next if switch == M.EDGE else t + pause
    state[C.ACCELERATION] = acceleration_in(mode, 0.0, state, setup)
    if not ended and switch == M.NO_SWITCH:
        return M.HOLDS
    if ended and not FRICTION and not is_on_stop(mode) and not goes_on_in(state[C.ACCELERATION], mode):
        reverse(state, setup)
        state[C.ACCELERATION] = acceleration_in(int(state[C.MODE]), 0.0, state, setup)
    return switch


@inlined
def step_at_rest(state: State, setup: Setup, t_next: float, nodes: Any) -> int:
    """Integrate the circuit over one step with the armature at rest; return the event that ends the step."""
    mode, x = int(state[C.MODE]), state[C.POSITION_NOW]
    held = mode
    if not is_on_stop(mode):
        held = mode_at_rest(mode)
        relabel_node(nodes, int(state[C.USED]), held)
    if int(state[C.STARTED]) != held:
        state[C.STEP] = state[C.FREE_STEP]
    state[C.STARTED] = held
    law = ForceLaw(held, state[C.MEMORY_NOW], setup.hammer, driven(setup.train.live, electric_of(state)))
    start = (state[C.TIME], x, 0.0, state[C.ACCELERATION])
    switch, end, h, electric = advance(start, state[C.STEP], t_next, law, state[C.PEAK], setup.control)
    state[C.TIME], state[C.STEP] = end[0], h
    keep_electric(electric, state)
    state[C.ACCELERATION] = acceleration_in(mode, 0.0, state, setup)
    ended = switch == M.REST_ENDED and not is_on_stop(mode)
    if ended and not FRICTION and not goes_on_in(state[C.ACCELERATION], mode):
        reverse(state, setup)
    return switch


@inlined
def smooth_step(state: State, setup: Setup, t_next: float) -> tuple[int, int]:
    """Integrate over one step off the backstop; return the event that ends the step, and the run status."""
    hammer, control, bounds = setup.hammer, setup.control, setup.bounds
    mode, h = int(state[C.MODE]), state[C.STEP]
    fresh = int(state[C.STARTED]) != mode
    if fresh:
        h = state[C.PACK_STEP] if mode in (M.LOADING, M.UNLOADING) else state[C.FREE_STEP]
        state[C.STARTED] = mode
    t, x, v, a = state[C.TIME], state[C.POSITION_NOW], state[C.VELOCITY], state[C.ACCELERATION]
    h = sensible_step(h, x, v, a, mode, hammer)
    start = (t, x, v, a)
    law = ForceLaw(mode, state[C.MEMORY_NOW], hammer, driven(setup.train.live, electric_of(state)))
    switch, end, h, electric = advance(start, h, t_next, law, state[C.PEAK], control)
    left = M.OK
    outside, bound_state = left_range(start, end, law, control, bounds)
    if switch != FAILED and outside:
        end, switch, left = bound_state, M.NO_SWITCH, M.RANGE_LEFT
    state[C.TIME], state[C.POSITION_NOW], state[C.VELOCITY], state[C.ACCELERATION] = end
    state[C.STEP] = h
    keep_electric(electric, state)
    if fresh and mode == M.FREE:
        state[C.FREE_STEP] = h
    elif fresh and mode == M.LOADING:
        state[C.PACK_STEP] = h
    return switch, left
