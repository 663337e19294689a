"""Run of one hammer: the loop over steps, switching events and edges of the drive."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import entry, inlined
from printhammer.kernel.methods.landing import FAILED
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.circuit import UNTIL
from printhammer.kernel.model.layout import BACKSTOP_PART, PACK, POSITION, Train
from printhammer.kernel.single import carry as C
from printhammer.kernel.single.carry import Setup

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import driven, enter_piece
    from printhammer.kernel.model.forces import (
        acceleration,
        hold_limit,
        is_on_stop,
        least_at_rest,
        most_at_rest,
    )
    from printhammer.kernel.model.laws import FRICTION, HAS_CIRCUIT, pack_memory
    from printhammer.kernel.model.pulses import pass_edges
    from printhammer.kernel.single.around import failure, first_mode, out_of_bounds
    from printhammer.kernel.single.phases import (
        State,
        accelerate,
        electric_at_start,
        electric_of,
        keep_electric,
        keep_path,
        note_path,
        note_state,
        pass_edge,
    )
    from printhammer.kernel.single.record import (
        carry_contact,
        close_contact,
        open_contact,
        relabel_node,
    )
    from printhammer.kernel.single.steps import take_step
    from printhammer.kernel.single.switches import after_step

COINCIDENT = 1e-15
"""Relative time difference up to which two edges of the drive are treated as simultaneous."""

STUCK = 1000
"""Maximum number of consecutive steps that do not advance the time; arbitrary."""


@inlined
def begin(state: State, setup: Setup, contacts: Any) -> None:
    """Initialise a run: set mode, initial step sizes, first edge of the drive and any open contact."""
    train, hammer = setup.train, setup.hammer
    time_scale = setup.control[0] / setup.control[1]
    t, x, v = state[C.TIME], state[C.POSITION_NOW], state[C.VELOCITY]
    state[C.FIRST], state[C.LAST], state[C.EDGE] = pass_edges(t, train, 0, 0)
    if HAS_CIRCUIT:
        keep_electric(enter_piece(t, x, electric_of(state), hammer, train.live), state)
    a = acceleration(t, x, v, M.FREE, 0.0, hammer, driven(setup.train.live, electric_of(state)))
    mode, peak, memory = first_mode(x, v, a, hammer), x, 0.0
    if state[C.STATE] == C.ON_BRANCH:
        mode, peak = int(state[C.MODE]), state[C.PEAK]
    if mode in (M.UNLOADING, M.RELOADING):
        memory = pack_memory(hammer[PACK:BACKSTOP_PART], peak)
    elif FRICTION and v != 0.0:
        memory = math.copysign(1.0, v)
    state[C.MODE], state[C.PEAK], state[C.MEMORY_NOW] = mode, peak, memory
    state[C.FREE_STEP], state[C.PACK_STEP] = 0.02 * time_scale, 0.005 * time_scale
    state[C.CONTACT_STEP] = 0.05
    state[C.STEP] = state[C.PACK_STEP] if mode in (M.LOADING, M.UNLOADING) else state[C.FREE_STEP]
    if mode in (M.LOADING, M.UNLOADING, M.RELOADING, M.RESTING_FRONT):
        state[C.TOUCHED] = open_contact(contacts, 0, M.PACK_SURFACE, t, v, 0, True)
    elif mode in (M.BACKSTOP, M.BACKSTOP_RELEASED, M.RESTING):
        state[C.TOUCHED] = open_contact(contacts, 0, M.BACKSTOP_SURFACE, t, v, 0, True)
    state[C.ROOT], state[C.ROOT_RATE] = 0.0, 0.0
    if mode in (M.BACKSTOP, M.BACKSTOP_RELEASED):
        state[C.ROOT] = math.sqrt(hammer[POSITION] - x)
    accelerate(state, setup)
    state[C.STARTED], state[C.ENTERED] = mode, 1.0
    state[C.WAIT], state[C.STUCK], state[C.TIME_BEFORE] = C.SHORTEST_WAIT * time_scale, 0.0, t - time_scale
    state[C.STEPS] = 0.0


@inlined
def count_step(state: State, setup: Setup) -> int:
    """Count the next step of a run; return `OK`, STEP_LIMIT or STEP_UNDERFLOW.

    STEP_LIMIT is returned after too many steps, STEP_UNDERFLOW after too many steps without progress in time.
    """
    time_scale = setup.control[0] / setup.control[1]
    t, before = state[C.TIME], state[C.TIME_BEFORE]
    state[C.STEPS] += 1.0
    if state[C.STEPS] > setup.max_steps:
        return M.STEP_LIMIT
    stands = t == before
    if HAS_CIRCUIT:
        stands = t - before <= 1e-14 * time_scale
    state[C.STUCK] = state[C.STUCK] + 1.0 if stands else 0.0
    state[C.TIME_BEFORE] = t
    return M.STEP_UNDERFLOW if state[C.STUCK] > STUCK else M.OK


@entry
def run(posed: Any, t_end: float, nodes: Any, contacts: Any, state: Any) -> tuple[int, int, int, int]:
    """Integrate the motion to time `t_end` [s], from the initial state or from the latest pause.

    Parameters
    ----------
    posed : tuple
        The fields of :class:`printhammer.kernel.single.carry.Setup` as a plain tuple, with the fields of
        :class:`printhammer.kernel.model.layout.Train` as its first element.
    t_end : float
        End of the run [s].
    nodes : float64 array, shape (any, 5), with a coil circuit (any, 9)
    contacts : float64 array, shape (any, 7)
        Filled with the record; see `printhammer.kernel.single.record`. After a pause, the first node is the
        last node before the pause; a contact that was open at the pause stays in row 0, with a negative
        node index.
    state : float64 array, shape (32,)
        State of the run; see :mod:`printhammer.kernel.single.carry`.

    Returns
    -------
    tuple
        Status, and the numbers of nodes, contacts and steps; the numbers of nodes and contacts may exceed
        the lengths of the arrays.
    """
    setup = Setup(Train(*posed[0]), posed[1], posed[2], posed[3], posed[4])
    live, hammer = setup.train.live, setup.hammer
    state[C.USED], state[C.TOUCHED] = 0.0, 0.0
    keep_electric(electric_at_start(state[C.POSITION_NOW], setup.hammer, state, live), state)
    if state[C.STATE] == C.GOES_ON:
        state[C.TOUCHED] = carry_contact(contacts, int(state[C.MODE]))
    else:
        begin(state, setup, contacts)
    note_state(state, setup, nodes)
    status = M.OK
    while state[C.TIME] < t_end and status == M.OK:
        mode = int(state[C.MODE])
        if state[C.USED] >= state[C.PAUSE_AFTER] and mode in (M.FREE, M.BACKSTOP):
            status = M.PAUSED
            break
        t_next = min(state[C.EDGE], t_end)
        if HAS_CIRCUIT:
            t_next = min(t_next, live[live.size - UNTIL])
        if 0.0 < t_next - state[C.TIME] <= COINCIDENT * t_next:
            # No step is taken between edges that differ only by rounding; the drive changes at the later
            # edge.
            state[C.TIME] = t_next
            after_step(M.EDGE, state, setup, nodes, contacts)
            note_state(state, setup, nodes)
            continue
        if t_next <= state[C.TIME]:
            pass_edge(state, setup)
            note_path(state, setup, nodes)
            accelerate(state, setup)
            state[C.ENTERED] = 1.0
            continue
        held = hold_limit(hammer) if FRICTION else 0.0
        a = state[C.ACCELERATION]
        if is_on_stop(mode) and (a < least_at_rest(mode, held) or a > most_at_rest(mode, held)):
            close_contact(contacts, int(state[C.TOUCHED]), state[C.TIME], 0.0)
            state[C.MODE] = M.FREE
            relabel_node(nodes, int(state[C.USED]), M.FREE)
        status = count_step(state, setup)
        if status != M.OK:
            break
        switch, left = take_step(state, setup, t_next, nodes)
        if switch == M.HOLDS:
            continue
        if switch == FAILED:
            status = failure(state[C.POSITION_NOW], state[C.VELOCITY], setup.bounds, setup.control)
            break
        status = left if left != M.OK else out_of_bounds(state[C.POSITION_NOW], setup.bounds)
        if switch != M.NO_SWITCH:
            state[C.ENTERED] = 1.0
        after_step(switch, state, setup, nodes, contacts)
        note_state(state, setup, nodes)
    keep_path(state, live)
    state[C.STATE] = C.GOES_ON
    return status, int(state[C.USED]), int(state[C.TOUCHED]), int(state[C.STEPS])
