"""Handling of the event that ends a step: edge of the drive, change of conduction path, change of mode."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import inlined
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import BACKSTOP_PART, FRONT, MAGNET, PACK, POSITION
from printhammer.kernel.model.transitions import FOLLOWING
from printhammer.kernel.single import carry as C

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import next_path
    from printhammer.kernel.model.forces import hold_limit
    from printhammer.kernel.model.laws import (
        FRICTION,
        HAS_CIRCUIT,
        RIGID,
        RIGID_FRONT,
        backstop_rebound,
        pack_rebound,
    )
    from printhammer.kernel.single.carry import Setup
    from printhammer.kernel.single.phases import (
        State,
        accelerate,
        acceleration_in,
        electric_of,
        keep_electric,
        note_node,
        pass_edge,
        rate_in_backstop,
    )
    from printhammer.kernel.single.record import close_contact, open_contact
    from printhammer.kernel.single.steps import reverse


@inlined
def after_step(switch: int, state: State, setup: Setup, nodes: Any, contacts: Any) -> None:
    """Update the run state after the switching event that ended a step; record contacts that begin or end."""
    if switch == M.EDGE:
        pass_edge(state, setup)
        accelerate(state, setup)
        if int(state[C.MODE]) == M.BACKSTOP:
            rate_in_backstop(state, setup)
    elif HAS_CIRCUIT and switch in (M.CIRCUIT, M.REST_ENDED):
        if switch == M.CIRCUIT:
            electric = next_path(
                state[C.TIME], state[C.POSITION_NOW], electric_of(state), setup.hammer, setup.train.live
            )
            keep_electric(electric, state)
        accelerate(state, setup)
        if int(state[C.MODE]) == M.BACKSTOP:
            rate_in_backstop(state, setup)
    elif switch != M.NO_SWITCH:
        if switch == M.REACHED_BACKSTOP:
            reach_backstop(state, setup, nodes, contacts)
        elif switch == M.REACHED_FRONT:
            reach_front(state, setup, nodes, contacts)
        elif FRICTION and switch == M.REVERSAL and int(state[C.MODE]) in (M.FREE, M.PACK_RELEASED):
            # The next step decides whether the armature is held, or slides back.
            state[C.VELOCITY] = 0.0
        elif switch == M.REVERSAL:
            if state[C.POSITION_NOW] <= setup.hammer[FRONT]:
                close_now(state, contacts)
                state[C.MODE] = M.FREE
            elif not FRICTION:
                reverse(state, setup)
        elif switch in (M.LEFT_FRONT, M.LEFT_BACKSTOP):
            leave(switch, state, setup, contacts)
        elif switch != M.REACHED_LEVEL:
            follow(switch, state)
            if int(state[C.MODE]) == M.BACKSTOP:
                depth = setup.hammer[POSITION] - state[C.POSITION_NOW]
                state[C.ROOT] = math.sqrt(max(depth, 0.0))
        accelerate(state, setup)


@inlined
def follow(switch: int, state: State) -> None:
    """Set the next mode after a switching event, from the table of transitions."""
    state[C.MODE] = FOLLOWING[int(state[C.MODE]), switch]


@inlined
def open_now(surface: int, state: State, contacts: Any) -> None:
    """Record the start of a contact with a surface at the present time."""
    state[C.TOUCHED] = open_contact(
        contacts,
        int(state[C.TOUCHED]),
        surface,
        state[C.TIME],
        state[C.VELOCITY],
        int(state[C.USED]),
        False,
    )


@inlined
def close_now(state: State, contacts: Any) -> None:
    """Record the end of the latest contact at the present time."""
    close_contact(contacts, int(state[C.TOUCHED]), state[C.TIME], state[C.VELOCITY])


@inlined
def reach_backstop(state: State, setup: Setup, nodes: Any, contacts: Any) -> None:
    """Update the run state at a touch of the backstop: contact or, on a rigid backstop, rebound or rest."""
    open_now(M.BACKSTOP_SURFACE, state, contacts)
    if RIGID:
        v = backstop_rebound(setup.hammer[BACKSTOP_PART:MAGNET], state[C.VELOCITY])
        rebound(v, 1.0, M.RESTING, state, setup, nodes, contacts)
    else:
        follow(M.REACHED_BACKSTOP, state)
        state[C.ROOT] = 0.0


@inlined
def rebound(
    v: float, away: float, resting: int, state: State, setup: Setup, nodes: Any, contacts: Any
) -> None:
    """Update the run state at an impact on a rigid surface, after which the velocity is `v` [m/s].

    If the forces would return the armature to the surface almost at once, the armature comes to rest in the
    mode `resting`. `away` is the direction away from the surface, 1 or -1.
    """
    hammer = setup.hammer
    note_node(M.FREE, state[C.MEMORY_NOW] if FRICTION else 0.0, state, setup, nodes)
    state[C.VELOCITY] = v
    if FRICTION:
        state[C.MEMORY_NOW] = away
    a = away * acceleration_in(M.FREE, v, state, setup)
    if FRICTION and v == 0.0:
        a = away * acceleration_in(resting, 0.0, state, setup) - hold_limit(hammer)
    if a < 0.0 and v * v <= -2.0 * a * 1e-12 * setup.control[0]:
        state[C.VELOCITY] = 0.0
        state[C.MODE] = resting
    else:
        close_now(state, contacts)


@inlined
def reach_front(state: State, setup: Setup, nodes: Any, contacts: Any) -> None:
    """Update the run state when the armature reaches the front of the pack.

    The armature rebounds from a rigid front. Otherwise a contact begins if the armature moves, or is pushed,
    into the pack.
    """
    v = max(state[C.VELOCITY], 0.0)
    state[C.VELOCITY] = v
    if RIGID_FRONT:
        open_now(M.PACK_SURFACE, state, contacts)
        v = pack_rebound(setup.hammer[PACK:BACKSTOP_PART], v)
        rebound(v, -1.0, M.RESTING_FRONT, state, setup, nodes, contacts)
        return
    # A touch with zero velocity begins a contact only if the forces push the armature into the pack.
    if v > 0.0 or acceleration_in(M.FREE, v, state, setup) > 0.0:
        open_now(M.PACK_SURFACE, state, contacts)
        follow(M.REACHED_FRONT, state)


@inlined
def leave(switch: int, state: State, setup: Setup, contacts: Any) -> None:
    """Update the run state when the armature leaves a surface, at the position of the surface."""
    hammer = setup.hammer
    close_now(state, contacts)
    state[C.POSITION_NOW] = hammer[POSITION] if switch == M.LEFT_BACKSTOP else hammer[FRONT]
    follow(switch, state)
    if FRICTION and switch == M.LEFT_FRONT:
        state[C.MEMORY_NOW] = -1.0
    if switch == M.LEFT_BACKSTOP and state[C.VELOCITY] <= 0.0:
        state[C.VELOCITY] = 0.0
        if acceleration_in(M.FREE, 0.0, state, setup) < 0.0:
            open_now(M.BACKSTOP_SURFACE, state, contacts)
            state[C.MODE] = M.BACKSTOP
            state[C.ROOT] = 0.0
