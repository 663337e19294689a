"""What constants do at the switches of a run and at the edges of its drive.

The jumps of the columns of `printhammer.kernel.variational.influence` where a constant moves a surface, an
edge or the law of an impact; derived in docs/tangent.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model.layout import BACKSTOP_PART, END, FRONT, INVERSE_MASS, MAGNET, POSITION
from printhammer.kernel.model.modes import (
    BACKSTOP,
    BACKSTOP_RELEASED,
    FREE,
    HELD,
    HELD_LOADING,
    HELD_UNLOADING,
    LOADING,
    PACK_RELEASED,
    RELOADING,
    RESTING,
    UNLOADING,
)
from printhammer.kernel.model.slopes import CENTRAL, OFFSETS, POINTS, WEIGHTS
from printhammer.kernel.variational.influence import BACKSTOP_MOVES, DELAYED, ENERGIES, MIDDLE, SPACING

if TYPE_CHECKING:
    from printhammer.kernel.methods.quadrature import powers
    from printhammer.kernel.model.forces import Hammer
    from printhammer.kernel.model.laws import FORCE_DRIVE, HAS_PACK, backstop_rebound, magnet_force
    from printhammer.kernel.model.pulses import Drive, drive_value
    from printhammer.kernel.model.slopes import field_at
    from printhammer.kernel.single.resample import branch_of, memory_of
    from printhammer.kernel.variational.influence import Given
    from printhammer.kernel.variational.tangent import is_rebound, pass_level, pass_rebound, pass_reversal


@compiled
def add_energies(columns: Any, k: int, later: float, before: Any, behind: Any) -> None:
    """Let the powers [W] `before` a switch last longer by `later` [s], and those `behind` it less long."""
    for i in range(ENERGIES):
        columns[3 + i, k] += (before[i] - behind[i]) * later


@compiled
def powers_at(node: Any, mode: int, kept: float, v: float, hammer: Hammer, drive: Drive) -> Any:
    """Return the powers [W] at a node under the law of `mode`; the backstop is not compressed there."""
    return powers(node[0], node[1], v, 0.0, mode, memory_of(mode, kept, hammer), hammer, drive)


@compiled
def pass_impact(node: Any, after: Any, columns: Any, hammer: Hammer, drive: Drive, given: Given) -> None:
    """Carry the columns through an impact on a rigid backstop."""
    varied, moves, of_hammer, _live_moves, _memories, _spacing = given
    v_in, v_out = node[2], after[2]
    value = drive_value(node[0], drive)
    force = field_at(node[1], value, hammer) + (value if FORCE_DRIVE else 0.0)
    a = force * hammer[INVERSE_MASS]
    lost = 0.5 * (v_in * v_in - v_out * v_out) / hammer[INVERSE_MASS]
    before = powers_at(node, FREE, 0.0, v_in, hammer, drive)
    behind = powers_at(node, FREE, 0.0, v_out, hammer, drive)
    for k in range(columns.shape[1]):
        columns[0, k] -= moves[k, POSITION]
        later = -columns[0, k] / v_in
        add_energies(columns, k, later, before, behind)
        columns[6, k] += v_in * (columns[1, k] + a * later) / hammer[INVERSE_MASS]
        columns[6, k] -= lost * moves[k, INVERSE_MASS] / hammer[INVERSE_MASS]
    pass_rebound(node, after, columns, hammer, drive)
    for k in range(columns.shape[1]):
        later = -columns[0, k] / v_out if v_out > 0.0 else 0.0
        if of_hammer[k] & BACKSTOP_MOVES:
            change = 0.0
            for i in range(POINTS[CENTRAL]):
                c = varied[k, MIDDLE + int(OFFSETS[CENTRAL, i])][BACKSTOP_PART:MAGNET]
                change += WEIGHTS[CENTRAL, i] * backstop_rebound(c, v_in)
            columns[1, k] += change / SPACING
        columns[6, k] -= v_out * (columns[1, k] + a * later) / hammer[INVERSE_MASS]
        columns[0, k] += moves[k, POSITION]


@compiled
def pass_surface(
    node: Any,
    after: Any,
    mode: int,
    following: int,
    place: int,
    columns: Any,
    hammer: Hammer,
    drive: Drive,
    given: Given,
) -> bool:
    """Carry the columns through a touch, a leaving or the old maximum; tell whether differentiable.

    `place` is that of the surface among the constants, negative for the old maximum.
    """
    moves = given[1]
    v = after[2]
    if v == 0.0:
        return False
    before = powers_at(after, mode, node[4], v, hammer, drive)
    behind = powers_at(after, following, after[4], v, hammer, drive)
    for k in range(columns.shape[1]):
        if place >= 0:
            columns[0, k] -= moves[k, place]
        ahead = columns[0, k] - (columns[2, k] if place < 0 else 0.0)
        add_energies(columns, k, -ahead / v, before, behind)
    smooth = pass_level(node, after, mode, following, columns, hammer, drive)
    if place >= 0:
        for k in range(columns.shape[1]):
            columns[0, k] += moves[k, place]
    return smooth


@compiled
def pass_switch(node: Any, after: Any, columns: Any, hammer: Hammer, drive: Drive, given: Given) -> bool:
    """Carry the columns through the switch at the node `after`, if it is one; tell whether differentiable."""
    if is_rebound(node, after):
        pass_impact(node, after, columns, hammer, drive, given)
        return True
    mode, following = branch_of(int(node[3])), branch_of(int(after[3]))
    mode = BACKSTOP if mode == HELD else mode
    following = BACKSTOP if following == HELD else following
    in_pack = HAS_PACK and mode in (LOADING, UNLOADING, RELOADING)
    if in_pack and following in (LOADING, UNLOADING, RELOADING):
        if mode == following and (mode != UNLOADING or node[4] == after[4]):
            return True
        if mode == RELOADING and following == LOADING:
            return pass_surface(node, after, mode, following, -1, columns, hammer, drive, given)
        # The velocity is zero, and so are all powers.
        return pass_reversal(node, after, mode, following, columns, hammer, drive)
    at_pack = (mode == FREE and following == LOADING) or (
        following == FREE and (in_pack or mode == PACK_RELEASED)
    )
    at_backstop = (mode == FREE and following == BACKSTOP) or (
        following == FREE and mode in (BACKSTOP, BACKSTOP_RELEASED)
    )
    if at_pack or at_backstop:
        place = FRONT if at_pack else POSITION
        return pass_surface(node, after, mode, following, place, columns, hammer, drive, given)
    return True


@compiled
def piece_value(t: float, fired: float, piece: int, pieces: Any) -> float:
    """Return the value [A or N] of one piece of a pulse fired at time `fired` [s]."""
    if pieces[piece, 1] == END:
        return 0.0
    s = (t - fired) - pieces[piece, 0]
    kind, p0, p1 = pieces[piece, 1], pieces[piece, 2], pieces[piece, 3]
    p2, p3 = pieces[piece, 4], pieces[piece, 5]
    if kind == 1.0:
        return float(p0 + p1 * math.exp(-p2 * s))
    if kind == 0.0:
        return float(p0 + s * (p1 + s * (p2 + s * p3)))
    return float(p0 + p1 * math.sin(p2 * s + p3))


@compiled
def pass_edge(
    node: Any,
    value: float,
    change: float,
    pulse: int,
    piece: int,
    columns: Any,
    hammer: Hammer,
    fire_moves: Any,
    piece_moves: Any,
) -> float:
    """Carry the columns through one edge at which the drive jumps by `change`; return its value after it."""
    new = value + change
    mode = int(node[3])
    if change == 0.0 or mode in (RESTING, HELD, HELD_LOADING, HELD_UNLOADING):
        return new
    x, v = node[1], node[2]
    force = field_at(x, new, hammer) - field_at(x, value, hammer) + (change if FORCE_DRIVE else 0.0)
    for k in range(columns.shape[1]):
        later = fire_moves[k, pulse] + piece_moves[k, piece, 0]
        columns[1, k] -= force * hammer[INVERSE_MASS] * later
        if FORCE_DRIVE:
            columns[4, k] -= change * v * later
        else:
            old_pull = magnet_force(hammer[MAGNET:], x, value)
            columns[3, k] -= (magnet_force(hammer[MAGNET:], x, new) - old_pull) * v * later
    return new


@compiled
def pass_moving_edges(
    node: Any,
    firings: Any,
    begins: Any,
    pieces: Any,
    replace: bool,
    under_way: Any,
    first: int,
    last: int,
    columns: Any,
    hammer: Hammer,
    drive: Drive,
    fire_moves: Any,
    piece_moves: Any,
) -> None:
    """Carry the columns through all edges of the drive at a node, which `pass_edges` has not passed yet."""
    t = node[0]
    value = drive_value(t, drive)
    for p in range(first, last):
        piece = under_way[p]
        while pieces[piece, 1] != END:
            piece += 1
            if firings[p] + pieces[piece, 0] > t:
                break
            change = piece_value(t, firings[p], piece, pieces) - piece_value(t, firings[p], piece - 1, pieces)
            value = pass_edge(node, value, change, p, piece, columns, hammer, fire_moves, piece_moves)
    while last < firings.size and firings[last] <= t:
        change = piece_value(t, firings[last], begins[last], pieces)
        if replace:
            change -= value
        value = pass_edge(node, value, change, last, begins[last], columns, hammer, fire_moves, piece_moves)
        last += 1


@compiled
def set_live_moves(
    first: int, last: int, pieces: Any, under_way: Any, fire_moves: Any, piece_moves: Any, live_moves: Any
) -> None:
    """Rewrite the changes of the pieces under way, in the order in which `pass_edges` has them."""
    for k in range(fire_moves.shape[0]):
        j = 0
        for p in range(first, last):
            piece = under_way[p]
            if pieces[piece, 1] == END:
                continue
            live_moves[k, j] = fire_moves[k, p] + piece_moves[k, piece, 0]
            for i in range(4):
                live_moves[k, j + 1 + i] = piece_moves[k, piece, 2 + i]
            j += DELAYED
