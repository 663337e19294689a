"""One run of one hammer: the loop over steps, switches and edges of the drive."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import entry, inlined
from printhammer.kernel.methods.crossing import STILL
from printhammer.kernel.methods.landing import FAILED
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.circuit import BLOCKED, SOURCE, UNTIL
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    FRONT,
    MAGNET,
    PACK,
    POSITION,
    Control,
    ForceLaw,
    Train,
)
from printhammer.kernel.model.transitions import FOLLOWING
from printhammer.kernel.single import carry as C

if TYPE_CHECKING:
    from printhammer.kernel.methods.contact import advance_contact, contact_rate
    from printhammer.kernel.methods.landing import advance
    from printhammer.kernel.model.circuit import (
        Electric,
        driven,
        electric_at_rest,
        electric_rates,
        electric_with,
        enter_piece,
        is_quiet,
        moved,
        next_path,
        path_of,
        take_path,
    )
    from printhammer.kernel.model.forces import Hammer, acceleration
    from printhammer.kernel.model.laws import HAS_CIRCUIT, RIGID, backstop_rebound, pack_memory
    from printhammer.kernel.model.pulses import pass_edges
    from printhammer.kernel.single.around import (
        contact_unit,
        failure,
        first_mode,
        kick_into_backstop,
        left_range,
        out_of_bounds,
        reversed_mode,
        sensible_step,
    )
    from printhammer.kernel.single.record import (
        add_node,
        carry_contact,
        close_contact,
        note_circuit,
        open_contact,
        relabel_node,
    )
    from printhammer.kernel.single.rest import goes_on_in, rest_ends

BRANCHES = (M.UNLOADING, M.LOADING, M.RELOADING)
"""Modes inside the pack in which an armature may rest."""

STUCK = 1000
"""Steps in a row that do not move time after which a run is given up."""

WAIT = 0.005
"""Shortest wait, in characteristic times, before a resting armature is looked at again."""


@inlined
def kept_in(mode: int, w: float, peak: float) -> float:
    """Return what a node keeps of the state beside displacement and velocity."""
    return w if mode == M.BACKSTOP else (peak if mode in (M.UNLOADING, M.RELOADING) else 0.0)


@inlined
def electric_at_start(x: float, hammer: Hammer, carry: Any, live: Any) -> Electric:
    """Return the electric state in which a run begins or goes on, the current on its path."""
    if HAS_CIRCUIT:
        if carry[C.STATE] == C.GOES_ON:
            take_path(live, carry[C.PATH], carry[C.UNTIL])
            return carry[C.ELECTRIC], carry[C.ELECTRIC + 1], carry[C.ELECTRIC + 2]
        if carry[C.WITH_CURRENT] == 0.0:
            take_path(live, BLOCKED, math.inf)
            return electric_at_rest(x, hammer)
        current, turn, reservoir = carry[C.ELECTRIC], carry[C.ELECTRIC + 1], carry[C.ELECTRIC + 2]
        take_path(live, BLOCKED if current == 0.0 else SOURCE, math.inf)
        return electric_with(x, current, turn, reservoir, hammer)
    return ()


@inlined
def keep_electric(electric: Electric, carry: Any, live: Any) -> None:
    """Keep the electric state for the run to go on."""
    if HAS_CIRCUIT:
        for j in range(3):
            carry[C.ELECTRIC + j] = electric[j]
        carry[C.PATH] = path_of(live)
        carry[C.UNTIL] = live[live.size - UNTIL]


@entry
def run(
    train: Any,
    hammer: Hammer,
    t: float,
    x: float,
    v: float,
    t_end: float,
    control: Control,
    bounds: Any,
    max_steps: int,
    nodes: Any,
    contacts: Any,
    carry: Any,
) -> tuple[int, int, int, int]:
    """Integrate from state (`t`, `x`, `v`) to time `t_end`, or go on from where a run paused.

    Parameters
    ----------
    train : tuple
        A plain tuple of the fields of :class:`printhammer.kernel.model.layout.Train`.
    hammer : float64 array
        See :mod:`printhammer.kernel.model.layout`.
    t, x, v, t_end : float
        Initial time [s], displacement [m], velocity [m/s], and the end of the run [s].
    control : tuple of float
        Scales of displacement and velocity, allowances of the two error estimates.
    bounds : tuple of float
        Lowest and highest displacement, origin and farthest distance from it [m].
    max_steps : int
        Largest number of steps.
    nodes : float64 array, shape (any, 5), with a coil circuit (any, 9)
    contacts : float64 array, shape (any, 7)
        Filled with the record, see `printhammer.kernel.single.record`. The first node of a run that goes on
        is the last one before the pause; a contact that was open then is the first contact and keeps its row,
        its number of the node before it is negative.
    carry : float64 array, shape (30,)
        See :mod:`printhammer.kernel.single.carry`; `t`, `x` and `v` are not looked at where a run goes on.

    Returns
    -------
    tuple
        Status, and the numbers of nodes, contacts and steps; the first two may exceed the arrays' lengths.
    """
    train = Train(*train)
    live = train.live
    electric = electric_at_start(x, hammer, carry, live)
    drive = driven(live, electric)
    used = 0
    touched = 0
    steps = 0
    status = M.OK
    time_scale = control[0] / control[1]
    still = STILL * control[1] / time_scale
    memory = 0.0
    peak = x
    w = 0.0
    kv = 0.0
    pause_after = carry[C.PAUSE_AFTER]
    if carry[C.STATE] == C.GOES_ON:
        mode, peak, memory = int(carry[C.MODE]), carry[C.PEAK], carry[C.MEMORY_NOW]
        t, x, v, a = carry[C.TIME], carry[C.POSITION_NOW], carry[C.VELOCITY], carry[C.ACCELERATION]
        w, kv = carry[C.ROOT], carry[C.ROOT_RATE]
        h, h_free, h_pack = carry[C.STEP], carry[C.FREE_STEP], carry[C.PACK_STEP]
        h_contact = carry[C.CONTACT_STEP]
        started, entered = int(carry[C.STARTED]), carry[C.ENTERED] != 0.0
        wait, stuck, t_before = carry[C.WAIT], int(carry[C.STUCK]), carry[C.TIME_BEFORE]
        first, last, edge = int(carry[C.FIRST]), int(carry[C.LAST]), carry[C.EDGE]
        steps = int(carry[C.STEPS])
        touched = carry_contact(contacts, mode)
    else:
        first, last, edge = pass_edges(t, train, 0, 0)
        if HAS_CIRCUIT:
            electric = enter_piece(t, x, electric, hammer, live)
            drive = driven(live, electric)
        a = acceleration(t, x, v, M.FREE, memory, hammer, drive)
        mode = first_mode(x, v, a, hammer)
        if carry[C.STATE] == C.ON_BRANCH:
            mode, peak = int(carry[C.MODE]), carry[C.PEAK]
        if mode in (M.UNLOADING, M.RELOADING):
            memory = pack_memory(hammer[PACK:BACKSTOP_PART], peak)
        h_free = 0.02 * time_scale
        h_pack = 0.005 * time_scale
        h_contact = 0.05
        h = h_pack if mode in (M.LOADING, M.UNLOADING) else h_free
        if mode in (M.LOADING, M.UNLOADING, M.RELOADING):
            touched = open_contact(contacts, touched, M.PACK_SURFACE, t, v, 0, True)
        elif mode in (M.BACKSTOP, M.BACKSTOP_RELEASED, M.RESTING):
            touched = open_contact(contacts, touched, M.BACKSTOP_SURFACE, t, v, 0, True)
        if mode in (M.BACKSTOP, M.BACKSTOP_RELEASED):
            w = math.sqrt(hammer[POSITION] - x)
        a = acceleration(t, x, v, mode, memory, hammer, drive)
        started = mode
        entered = True
        wait = WAIT * time_scale
        stuck = 0
        t_before = t - time_scale
    used = add_node(nodes, used, t, x, v, mode, kept_in(mode, w, peak))
    if HAS_CIRCUIT:
        note_circuit(nodes, used, electric, path_of(live))
    while t < t_end and status == M.OK:
        if used >= pause_after and mode in (M.FREE, M.BACKSTOP):
            status = M.PAUSED
            break
        t_next = min(edge, t_end)
        if HAS_CIRCUIT:
            t_next = min(t_next, live[live.size - UNTIL])
        if t_next <= t:
            first, last, edge = pass_edges(t, train, first, last)
            if HAS_CIRCUIT:
                electric = enter_piece(t, x, electric, hammer, live)
                drive = driven(live, electric)
                note_circuit(nodes, used, electric, path_of(live))
            a = acceleration(t, x, v, mode, memory, hammer, drive)
            entered = True
            continue
        if mode == M.RESTING and a > 0.0:
            close_contact(contacts, touched, t, 0.0)
            mode = M.FREE
            relabel_node(nodes, used, M.FREE)
        steps += 1
        if steps > max_steps:
            status = M.STEP_LIMIT
            break
        stands = t == t_before
        if HAS_CIRCUIT:
            stands = t - t_before <= 1e-14 * time_scale
        stuck = stuck + 1 if stands else 0
        t_before = t
        if stuck > STUCK:
            status = M.STEP_UNDERFLOW
            break
        switch, left = M.NO_SWITCH, M.OK
        if mode == M.BACKSTOP:
            if entered:
                kv = contact_rate(w, v, t, hammer, drive)
                entered = False
            idle = first == last
            if HAS_CIRCUIT:
                idle = is_quiet(t, x, time_scale, electric, hammer, live)
            if w > 0.0 and idle and abs(v) <= 1e-14 * control[1] and abs(kv) <= 0.1 * still * 2.0 * w:
                relabel_node(nodes, used, M.HELD)
                t = t_next
                switch = M.EDGE
            elif w == 0.0 and v == 0.0:
                before = t
                t, w, v = kick_into_backstop(t, a, t_next, control)
                if HAS_CIRCUIT:
                    rates = electric_rates(before, x, 0.0, electric, hammer, live)
                    electric = moved(electric, t - before, rates)
                    drive = driven(live, electric)
                kv = contact_rate(w, v, t, hammer, drive)
                switch = M.EDGE if t == t_next else M.NO_SWITCH
            else:
                touching = w == 0.0 and started != M.BACKSTOP
                unit = 1.0
                if started != M.BACKSTOP:
                    started = M.BACKSTOP
                    unit = contact_unit(v, control)
                    h = h_contact * unit
                switch, end, h, electric = advance_contact((t, w, v, kv), h, t_next, hammer, drive, control)
                if touching:
                    h_contact = h / unit
                t, w, v, kv = end
            x = hammer[POSITION] - w * w
        elif (mode == M.RESTING or (v == 0.0 and abs(a) <= still and mode in BRANCHES)) and not (
            HAS_CIRCUIT and not is_quiet(t, x, time_scale, electric, hammer, live)
        ):
            pause = t_next - t
            if first < last and not HAS_CIRCUIT:
                pause = min(pause, wait)
            least, most = (-math.inf, 0.0) if mode == M.RESTING else (-still, still)
            if mode != M.RESTING:
                relabel_node(nodes, used, M.HELD_LOADING if mode == M.LOADING else M.HELD_UNLOADING)
            law = ForceLaw(mode, memory, hammer, drive)
            ended, pause = rest_ends(t, x, pause, least, most, law)
            wait = WAIT * time_scale if ended or mode == M.RESTING else min(2.0 * wait, time_scale)
            switch = M.EDGE if pause == t_next - t else M.NO_SWITCH
            t = t_next if switch == M.EDGE else t + pause
            a = acceleration(t, x, 0.0, mode, memory, hammer, drive)
            if not ended and switch == M.NO_SWITCH:
                # The node at which the rest began holds on.
                continue
            if ended and mode != M.RESTING and not goes_on_in(a, mode):
                mode, peak, memory = reversed_mode(t, x, mode, peak, memory, hammer, drive)
                a = acceleration(t, x, 0.0, mode, memory, hammer, drive)
        elif HAS_CIRCUIT and (mode == M.RESTING or (v == 0.0 and abs(a) <= still and mode in BRANCHES)):
            # The current changes under an armature at rest.
            held = mode
            if mode != M.RESTING:
                held = M.HELD_LOADING if mode == M.LOADING else M.HELD_UNLOADING
                relabel_node(nodes, used, held)
            if started != held:
                h = h_free
            started = held
            law = ForceLaw(held, memory, hammer, drive)
            switch, end, h, electric = advance((t, x, 0.0, a), h, t_next, law, peak, control)
            t = end[0]
            drive = driven(live, electric)
            a = acceleration(t, x, 0.0, mode, memory, hammer, drive)
            if switch == M.REST_ENDED and mode != M.RESTING and not goes_on_in(a, mode):
                mode, peak, memory = reversed_mode(t, x, mode, peak, memory, hammer, drive)
        else:
            if started != mode:
                h = h_pack if mode in (M.LOADING, M.UNLOADING) else h_free
            fresh = started != mode
            started = mode
            h = sensible_step(h, x, v, a, mode, hammer)
            start = (t, x, v, a)
            law = ForceLaw(mode, memory, hammer, drive)
            switch, end, h, electric = advance(start, h, t_next, law, peak, control)
            outside, bound_state = left_range(start, end, law, control, bounds)
            if switch != FAILED and outside:
                end, switch, left = bound_state, M.NO_SWITCH, M.RANGE_LEFT
            t, x, v, a = end
            if fresh and mode == M.FREE:
                h_free = h
            elif fresh and mode == M.LOADING:
                h_pack = h
        if switch == FAILED:
            status = failure(x, v, bounds, control)
            break
        status = left if left != M.OK else out_of_bounds(x, bounds)
        entered = entered or switch != M.NO_SWITCH
        if HAS_CIRCUIT:
            drive = driven(live, electric)
        if switch == M.EDGE:
            first, last, edge = pass_edges(t, train, first, last)
            if HAS_CIRCUIT:
                electric = enter_piece(t, x, electric, hammer, live)
                drive = driven(live, electric)
            a = acceleration(t, x, v, mode, memory, hammer, drive)
            if mode == M.BACKSTOP:
                kv = contact_rate(w, v, t, hammer, drive)
        elif HAS_CIRCUIT and switch in (M.CIRCUIT, M.REST_ENDED):
            if switch == M.CIRCUIT:
                electric = next_path(t, x, electric, hammer, live)
                drive = driven(live, electric)
            a = acceleration(t, x, v, mode, memory, hammer, drive)
            if mode == M.BACKSTOP:
                kv = contact_rate(w, v, t, hammer, drive)
        elif switch != M.NO_SWITCH:
            if switch == M.REACHED_BACKSTOP:
                touched = open_contact(contacts, touched, M.BACKSTOP_SURFACE, t, v, used, False)
                if RIGID:
                    used = add_node(nodes, used, t, x, v, M.FREE, 0.0)
                    if HAS_CIRCUIT:
                        note_circuit(nodes, used, electric, path_of(live))
                    v = backstop_rebound(hammer[BACKSTOP_PART:MAGNET], v)
                    a = acceleration(t, x, v, M.FREE, memory, hammer, drive)
                    if a < 0.0 and v * v <= -2.0 * a * 1e-12 * control[0]:
                        v = 0.0
                        mode = M.RESTING
                    else:
                        close_contact(contacts, touched, t, v)
                else:
                    mode = FOLLOWING[mode, switch]
                    w = 0.0
            elif switch == M.REACHED_FRONT:
                v = max(v, 0.0)
                # A touch without velocity opens a contact only if the armature is pushed on.
                if v > 0.0 or acceleration(t, x, v, M.FREE, memory, hammer, drive) > 0.0:
                    touched = open_contact(contacts, touched, M.PACK_SURFACE, t, v, used, False)
                    mode = FOLLOWING[mode, switch]
            elif switch == M.REVERSAL:
                if x <= hammer[FRONT]:
                    close_contact(contacts, touched, t, v)
                    mode = M.FREE
                else:
                    mode, peak, memory = reversed_mode(t, x, mode, peak, memory, hammer, drive)
            elif switch in (M.LEFT_FRONT, M.LEFT_BACKSTOP):
                close_contact(contacts, touched, t, v)
                x = hammer[POSITION] if switch == M.LEFT_BACKSTOP else hammer[FRONT]
                mode = FOLLOWING[mode, switch]
                if switch == M.LEFT_BACKSTOP and v <= 0.0:
                    v = 0.0
                    if acceleration(t, x, v, M.FREE, memory, hammer, drive) < 0.0:
                        touched = open_contact(contacts, touched, M.BACKSTOP_SURFACE, t, v, used, False)
                        mode = M.BACKSTOP
                        w = 0.0
            else:
                mode = FOLLOWING[mode, switch]
                if mode == M.BACKSTOP:
                    w = math.sqrt(max(hammer[POSITION] - x, 0.0))
            a = acceleration(t, x, v, mode, memory, hammer, drive)
        used = add_node(nodes, used, t, x, v, mode, kept_in(mode, w, peak))
        if HAS_CIRCUIT:
            note_circuit(nodes, used, electric, path_of(live))
    keep_electric(electric, carry, live)
    carry[C.STATE] = C.GOES_ON
    carry[C.MODE], carry[C.PEAK], carry[C.MEMORY_NOW] = mode, peak, memory
    carry[C.TIME], carry[C.POSITION_NOW], carry[C.VELOCITY], carry[C.ACCELERATION] = t, x, v, a
    carry[C.ROOT], carry[C.ROOT_RATE] = w, kv
    carry[C.STEP], carry[C.FREE_STEP], carry[C.PACK_STEP], carry[C.CONTACT_STEP] = (
        h,
        h_free,
        h_pack,
        h_contact,
    )
    carry[C.STARTED], carry[C.ENTERED] = started, entered
    carry[C.WAIT], carry[C.STUCK], carry[C.TIME_BEFORE] = wait, stuck, t_before
    carry[C.FIRST], carry[C.LAST], carry[C.EDGE], carry[C.STEPS] = first, last, edge, steps
    return status, used, touched, steps
