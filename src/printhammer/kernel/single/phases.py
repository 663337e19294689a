"""Functions shared by the modules of the run loop: access to the run state, forces, and record."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import called, inlined
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.circuit import BLOCKED, SOURCE, UNTIL
from printhammer.kernel.single import carry as C

if TYPE_CHECKING:
    from printhammer.kernel.methods.contact import contact_rate
    from printhammer.kernel.model.circuit import (
        Electric,
        driven,
        electric_at_rest,
        electric_with,
        enter_piece,
        path_of,
        take_path,
    )
    from printhammer.kernel.model.forces import Hammer, acceleration, is_on_stop
    from printhammer.kernel.model.laws import FRICTION, HAS_CIRCUIT
    from printhammer.kernel.model.pulses import pass_edges
    from printhammer.kernel.single.carry import Setup
    from printhammer.kernel.single.record import add_node, note_circuit

State = Any


@inlined
def electric_of(state: State) -> Electric:
    """Return the electric state of a run; empty in a kernel without a circuit."""
    if HAS_CIRCUIT:
        return state[C.ELECTRIC], state[C.ELECTRIC + 1], state[C.ELECTRIC + 2]
    return ()


@inlined
def keep_electric(electric: Electric, state: State) -> None:
    """Store an electric state in the state array of the run."""
    if HAS_CIRCUIT:
        for j in range(3):
            state[C.ELECTRIC + j] = electric[j]


@inlined
def electric_at_start(x: float, hammer: Hammer, state: State, live: Any) -> Electric:
    """Return the electric state at the start or the continuation of a run.

    The conduction path of the coil current is restored in `live`.
    """
    if HAS_CIRCUIT:
        if state[C.STATE] == C.GOES_ON:
            take_path(live, state[C.PATH], state[C.UNTIL])
            return state[C.ELECTRIC], state[C.ELECTRIC + 1], state[C.ELECTRIC + 2]
        if state[C.WITH_CURRENT] == 0.0:
            take_path(live, BLOCKED, math.inf)
            return electric_at_rest(x, hammer)
        current, turn, reservoir = state[C.ELECTRIC], state[C.ELECTRIC + 1], state[C.ELECTRIC + 2]
        take_path(live, BLOCKED if current == 0.0 else SOURCE, math.inf)
        return electric_with(x, current, turn, reservoir, hammer)
    return ()


@inlined
def keep_path(state: State, live: Any) -> None:
    """Store the conduction path of the coil current in the run state, for the continuation of the run."""
    if HAS_CIRCUIT:
        state[C.PATH] = path_of(live)
        state[C.UNTIL] = live[live.size - UNTIL]


@called
def acceleration_in(mode: int, v: float, state: State, setup: Setup) -> float:
    """Return the acceleration [m/s^2] at the present position for a mode and a velocity `v` [m/s]."""
    t, x, memory = state[C.TIME], state[C.POSITION_NOW], state[C.MEMORY_NOW]
    return acceleration(t, x, v, mode, memory, setup.hammer, driven(setup.train.live, electric_of(state)))


@inlined
def accelerate(state: State, setup: Setup) -> None:
    """Update the acceleration in the run state, with the force law of the present mode."""
    state[C.ACCELERATION] = acceleration_in(int(state[C.MODE]), state[C.VELOCITY], state, setup)


@inlined
def mode_at_rest(mode: int) -> int:
    """Return the mode of an armature that has come to rest in `mode`."""
    if mode == M.LOADING:
        return M.HELD_LOADING
    if mode in (M.UNLOADING, M.RELOADING):
        return M.HELD_UNLOADING
    return mode if is_on_stop(mode) else M.HELD_FREE


@inlined
def accelerate_at_rest(state: State, setup: Setup) -> None:
    """Update the acceleration in the run state, at velocity 0 and without dry friction."""
    state[C.ACCELERATION] = acceleration_in(mode_at_rest(int(state[C.MODE])), 0.0, state, setup)


@inlined
def rate_in_backstop(state: State, setup: Setup) -> None:
    """Update dv/ds, the derivative of the velocity in the regularised variables, in the run state."""
    drive = driven(setup.train.live, electric_of(state))
    state[C.ROOT_RATE] = contact_rate(state[C.ROOT], state[C.VELOCITY], state[C.TIME], setup.hammer, drive)


@inlined
def pass_edge(state: State, setup: Setup) -> None:
    """Start and end waveform pieces with an edge at the present time; update the coil's conduction path."""
    train = setup.train
    first, last, edge = pass_edges(state[C.TIME], train, int(state[C.FIRST]), int(state[C.LAST]))
    state[C.FIRST], state[C.LAST], state[C.EDGE] = first, last, edge
    if HAS_CIRCUIT:
        electric = electric_of(state)
        electric = enter_piece(state[C.TIME], state[C.POSITION_NOW], electric, setup.hammer, train.live)
        keep_electric(electric, state)


@inlined
def note_path(state: State, setup: Setup, nodes: Any) -> None:
    """Write the electric state and the conduction path of the coil current to the record's latest node."""
    if HAS_CIRCUIT:
        note_circuit(nodes, int(state[C.USED]), electric_of(state), path_of(setup.train.live))


@inlined
def note_node(mode: int, kept: float, state: State, setup: Setup, nodes: Any) -> None:
    """Append a node to the record: the present state, and mode and memory until the next node."""
    state[C.USED] = add_node(
        nodes, int(state[C.USED]), state[C.TIME], state[C.POSITION_NOW], state[C.VELOCITY], mode, kept
    )
    note_path(state, setup, nodes)


@inlined
def note_state(state: State, setup: Setup, nodes: Any) -> None:
    """Append the present state to the record as a node, with the present mode and its memory."""
    mode = int(state[C.MODE])
    kept = state[C.MEMORY_NOW] if FRICTION else 0.0
    if mode == M.BACKSTOP:
        kept = state[C.ROOT]
    elif mode in (M.UNLOADING, M.RELOADING):
        kept = state[C.PEAK]
    note_node(mode, kept, state, setup, nodes)
