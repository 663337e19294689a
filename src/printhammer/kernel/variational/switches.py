"""Jumps of the tangent columns at switching events and edges of the drive: the saltation matrices.

A neighbouring motion meets a switching event slightly earlier or later, and obeys the other force law in
between. A constant may also move a surface or an edge, or change the law of an impact. The derivation is in
docs/tangent.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    END,
    FRONT,
    INVERSE_MASS,
    MAGNET,
    PACK,
    POSITION,
    Train,
)
from printhammer.kernel.model.transitions import AT_FRONT, AT_PEAK, JUMPS, NO_JUMP, TURN
from printhammer.kernel.variational.layout import (
    BACKSTOP_LOSS,
    COIL,
    DRIVE,
    ENERGIES,
    ENERGY,
    PACK_LOSS,
    PEAK,
)
from printhammer.kernel.variational.slopes import CENTRAL, OFFSETS, WEIGHTS

if TYPE_CHECKING:
    from printhammer.kernel.methods.quadrature import powers
    from printhammer.kernel.model.circuit import driven, electric_rates
    from printhammer.kernel.model.forces import (
        Hammer,
        acceleration,
        backstop_acceleration,
        hold_limit,
        value_at,
    )
    from printhammer.kernel.model.laws import (
        ELECTRIC_ROW,
        FORCE_DRIVE,
        FORCED,
        FRICTION,
        HAS_CIRCUIT,
        HAS_DAMPING,
        HAS_PACK,
        MEMORY,
        RIGID,
        RIGID_FRONT,
        backstop_rebound,
        magnet_force,
        pack_rebound,
    )
    from printhammer.kernel.model.pulses import Drive, drive_value, piece_value
    from printhammer.kernel.single.resample import branch_of, is_held, memory_of
    from printhammer.kernel.variational.circuit import current_slopes, electric_at_node, main_row
    from printhammer.kernel.variational.forcing import (
        field_changes,
        force_with_value,
        friction_change,
        pack_change,
        rebound_change,
    )
    from printhammer.kernel.variational.layout import Setting
    from printhammer.kernel.variational.slopes import field_at, field_slope, pack_slopes

SPEED_SPACING = 1e-3
"""Step size of the impact speed for the derivative of the rebound velocity, as a fraction of the speed."""
NEAR = 1e-9
"""Smallest distance of a reversal from the old local maximum, as a fraction of the indentation, at which the
reversal is differentiable."""

RELEASED = 1e-6
"""Largest relative difference of force and static friction at which the force has ended a rest; otherwise an
edge of the drive or the end of the run has ended the rest. In a circuit, releases are located to 2e-8."""
RELEASE_SPACING = 1e-3
"""Step size of the time for the rate of the force at a release, as a fraction of the rest."""


@compiled
def acceleration_at(node: Any, mode: int, kept: float, v: float, hammer: Hammer, drive: Drive) -> float:
    """Return the acceleration [m/s^2] at the position of a node, with the force law of `mode`.

    `v` is the velocity [m/s], `kept` the memory as stored in a node.
    """
    if mode == M.BACKSTOP:
        return backstop_acceleration(node[0], 0.0, v, hammer, drive)
    return acceleration(node[0], node[1], v, mode, memory_of(mode, kept, hammer), hammer, drive)


@compiled
def powers_at(node: Any, mode: int, kept: float, v: float, hammer: Hammer, drive: Drive) -> Any:
    """Return the powers [W] at a node with the force law of `mode`, in the order of the energy rows.

    The backstop is taken as uncompressed; `v` and `kept` are as for `acceleration_at`.
    """
    return powers(node[0], node[1], v, 0.0, mode, memory_of(mode, kept, hammer), hammer, drive)


@compiled
def add_energies(columns: Any, k: int, later: float, before: Any, behind: Any) -> None:
    """Add (before - behind) * later to the energy rows: the effect of a delay of an event by `later` [s].

    `before` and `behind` are the powers [W] before and after the event.
    """
    for i in range(ENERGIES):
        columns[ENERGY + i, k] += (before[i] - behind[i]) * later


@inlined
def rebound_at(front: bool, v_in: float, hammer: Hammer) -> float:
    """Return the velocity [m/s] after an impact on a rigid surface: the pack's front or the backstop."""
    if RIGID_FRONT and front:
        return pack_rebound(hammer[PACK:BACKSTOP_PART], v_in)
    return backstop_rebound(hammer[BACKSTOP_PART:MAGNET], v_in)


@compiled
def is_rebound(node: Any, after: Any) -> bool:
    """Whether two nodes are the states before and after an impact on a rigid surface."""
    v_in, v_out = node[2], after[2]
    turned = (RIGID and v_in < 0.0 <= v_out) or (RIGID_FRONT and v_in > 0.0 >= v_out)
    return turned and node[0] == after[0] and int(node[3]) == M.FREE


@compiled
def pass_rebound(node: Any, after: Any, columns: Any, setting: Setting) -> None:
    """Propagate the tangent columns through an impact on a rigid surface."""
    hammer, drive, forcing = setting.hammer, driven(setting.drive, electric_at_node(after)), setting.forcing
    v_in, v_out = node[2], after[2]
    front = RIGID_FRONT and v_in > 0.0
    surface, loss = (FRONT, PACK_LOSS) if front else (POSITION, BACKSTOP_LOSS)
    spacing = SPEED_SPACING * abs(v_in)
    slope = (
        8.0 * (rebound_at(front, v_in + spacing, hammer) - rebound_at(front, v_in - spacing, hammer))
        - (rebound_at(front, v_in + 2.0 * spacing, hammer) - rebound_at(front, v_in - 2.0 * spacing, hammer))
    ) / (12.0 * spacing)
    before_it, behind_it = (node[4], after[4]) if FRICTION else (0.0, 0.0)
    a = acceleration(node[0], node[1], v_in, M.FREE, before_it, hammer, drive)
    # Only a damping force makes the accelerations before and after the impact differ.
    jump = acceleration(node[0], node[1], v_out, M.FREE, behind_it, hammer, drive) - a if HAS_DAMPING else 0.0
    for k in range(columns.shape[1]):
        if FORCED:
            columns[0, k] -= forcing.moves[k, surface]
        earlier = columns[0, k] / v_in
        if FORCED:
            before = powers_at(node, M.FREE, before_it, v_in, hammer, drive)
            behind = powers_at(node, M.FREE, behind_it, v_out, hammer, drive)
            add_energies(columns, k, -earlier, before, behind)
            columns[loss, k] += v_in * (columns[1, k] - a * earlier) / hammer[INVERSE_MASS]
        columns[0, k] = earlier * v_out
        columns[1, k] = slope * columns[1, k] + (1.0 - slope) * a * earlier
        if HAS_DAMPING:
            columns[1, k] += jump * earlier
        if FORCED:
            columns[1, k] += rebound_change(front, v_in, k, forcing)
            columns[loss, k] -= v_out * (columns[1, k] - (a + jump) * earlier) / hammer[INVERSE_MASS]
            # The energy lost at the impact is proportional to the mass.
            lost = 0.5 * (v_in * v_in - v_out * v_out) / hammer[INVERSE_MASS]
            columns[loss, k] -= lost * forcing.moves[k, INVERSE_MASS] / hammer[INVERSE_MASS]
            columns[0, k] += forcing.moves[k, surface]


@compiled
def pass_reversal(node: Any, after: Any, mode: int, following: int, columns: Any, setting: Setting) -> bool:
    """Propagate the tangent columns through a reversal in the pack.

    Return whether the motion is differentiable there. The energy rows do not jump, since all powers are zero
    at zero velocity.
    """
    hammer, drive = setting.hammer, driven(setting.drive, electric_at_node(after))
    before = acceleration_at(after, mode, node[4], 0.0, hammer, drive)
    behind = acceleration_at(after, following, after[4], 0.0, hammer, drive)
    # If the reversal is at the old maximum, the motion meets the maximum with zero velocity.
    if before == 0.0 or (mode == M.RELOADING and node[4] - after[1] <= NEAR * (node[4] - hammer[FRONT])):
        return False
    new_peak = following == M.UNLOADING and (mode == M.LOADING or after[4] != node[4])
    for k in range(columns.shape[1]):
        columns[1, k] *= behind / before
        if new_peak:
            columns[PEAK, k] = columns[0, k]
        elif following == M.LOADING:
            columns[PEAK, k] = 0.0
    return True


@compiled
def pass_level(
    node: Any, after: Any, mode: int, following: int, jump: int, columns: Any, setting: Setting
) -> bool:
    """Propagate the tangent columns across a surface or the old local maximum in the pack.

    Return whether the motion is differentiable there.
    """
    hammer, drive, forcing = setting.hammer, driven(setting.drive, electric_at_node(after)), setting.forcing
    v = after[2]
    if v == 0.0:
        return False
    before = acceleration_at(after, mode, node[4], v, hammer, drive)
    behind = acceleration_at(after, following, after[4], v, hammer, drive)
    for k in range(columns.shape[1]):
        level = columns[PEAK, k] if jump == AT_PEAK else 0.0
        if FORCED and jump != AT_PEAK:
            level = forcing.moves[k, FRONT if jump == AT_FRONT else POSITION]
        ahead = columns[0, k] - level
        if FORCED:
            powers_before = powers_at(after, mode, node[4], v, hammer, drive)
            powers_behind = powers_at(after, following, after[4], v, hammer, drive)
            add_energies(columns, k, -ahead / v, powers_before, powers_behind)
        columns[1, k] += (behind - before) * ahead / v
        columns[PEAK, k] = 0.0
    return True


@compiled
def rate_at_release(node: Any, after: Any, mode: int, memory: float, setting: Setting) -> float:
    """Return the time derivative of the acceleration [m/s^3] of an armature at rest, at the end of a rest."""
    hammer, live, electric = setting.hammer, setting.drive, electric_at_node(after)
    t, x = after[0], after[1]
    if HAS_CIRCUIT:
        _by_x, by_linkage, force = current_slopes(x, electric, hammer, live)
        linkage_rate = electric_rates(t, x, 0.0, electric, hammer, live)[main_row(hammer) - ELECTRIC_ROW]
        return float(force * by_linkage * linkage_rate * hammer[INVERSE_MASS])
    spacing = RELEASE_SPACING * min(t - node[0], setting.scales[0] / setting.scales[1])
    rate = 0.0
    for i in range(4):
        at = t + OFFSETS[CENTRAL, i] * spacing
        rate += WEIGHTS[CENTRAL, i] * acceleration(at, x, 0.0, mode, memory, hammer, live)
    return float(rate / spacing)


@compiled
def pass_release(node: Any, after: Any, columns: Any, setting: Setting) -> bool:
    """Propagate the tangent columns through the end of a rest under dry friction.

    Return whether the motion is differentiable there. The rest ends at a time that depends on the position of
    the armature and on constants, or at an edge of the drive, see `leave_at_edge`.
    """
    hammer, drive = setting.hammer, driven(setting.drive, electric_at_node(after))
    mode, memory = int(node[3]), memory_of(int(node[3]), node[4], setting.hammer)
    held = acceleration_at(after, mode, node[4], 0.0, hammer, drive)
    if abs(held) < (1.0 - RELEASED) * hold_limit(hammer):
        return True
    rate = rate_at_release(node, after, mode, memory, setting)
    if rate * held <= 0.0:
        return False
    t, value = after[0], value_at(after[0], after[1], hammer, drive)
    by_x = field_slope(after[1], 0.0, value, setting.scales, setting.bounds, hammer)
    by_linkage = 0.0
    if HAS_CIRCUIT:
        current_x, current_linkage, force = current_slopes(
            after[1], electric_at_node(after), hammer, setting.drive
        )
        by_x, by_linkage = by_x + force * current_x, force * current_linkage
    by_front = 0.0
    if HAS_PACK and mode == M.HELD_LOADING:
        by_front = -pack_slopes(after[1], 0.0, M.LOADING, memory, node[4], setting.scales, hammer)[0]
        by_x -= by_front
    behind = acceleration_at(after, branch_of(int(after[3])), after[4], 0.0, hammer, drive)
    for k in range(columns.shape[1]):
        change = by_x * columns[0, k]
        if HAS_CIRCUIT:
            change += by_linkage * columns[main_row(hammer), k]
        if FORCED:
            forcing = setting.forcing
            with_value = force_with_value(after[1], value, hammer, drive, forcing)
            change += field_changes(t, after[1], value, with_value, k, drive, setting)[0]
            static = friction_change(1.0, k, forcing)
            change -= static if held > 0.0 else -static
            if HAS_PACK and mode == M.HELD_LOADING:
                change += pack_change(after[1], 0.0, M.LOADING, k, forcing)
                change += by_front * forcing.moves[k, FRONT]
        columns[1, k] = behind * change * hammer[INVERSE_MASS] / rate
    # On an unloading branch the force depends on the latest maximum, too.
    return mode != M.HELD_UNLOADING


@compiled
def pass_friction(node: Any, after: Any, columns: Any, setting: Setting) -> tuple[bool, bool]:
    """Propagate the columns through a stop, a release or a reversal under dry friction.

    Returns
    -------
    tuple
        Whether the node is one of these events, and whether the motion is differentiable there.
    """
    mode, following = int(node[3]), int(after[3])
    if MEMORY and (is_held(mode) or is_held(following)) and branch_of(following) == M.UNLOADING:
        # The armature is at rest at the maximum at which a new unloading branch begins.
        for k in range(columns.shape[1]):
            columns[PEAK, k] = columns[0, k] if after[4] == after[1] else columns[PEAK, k]
    if is_held(following):
        for k in range(columns.shape[1]):
            columns[1, k] = 0.0
        return True, True
    # Without forcing and circuit, the columns are zero on a rigid stop.
    if is_held(mode) or ((FORCED or HAS_CIRCUIT) and mode >= M.RESTING > following):
        return True, pass_release(node, after, columns, setting)
    if mode == following and node[4] * after[4] < 0.0 and after[2] == 0.0:
        return True, pass_reversal(node, after, mode, following, columns, setting)
    return False, True


@compiled
def pass_node(node: Any, after: Any, columns: Any, setting: Setting) -> bool:
    """Propagate the tangent columns through any event at the node `after`.

    Return whether the motion is differentiable there.
    """
    if is_rebound(node, after):
        pass_rebound(node, after, columns, setting)
        return True
    if FRICTION:
        passed, smooth = pass_friction(node, after, columns, setting)
        if passed:
            return smooth
    mode, following = branch_of(int(node[3])), branch_of(int(after[3]))
    jump = JUMPS[mode, following]
    if jump == NO_JUMP or (mode == following and node[4] == after[4]):
        return True
    if jump == TURN:
        return pass_reversal(node, after, mode, following, columns, setting)
    return pass_level(node, after, mode, following, jump, columns, setting)


@compiled
def value_of_piece(t: float, fired: float, piece: int, pieces: Any) -> float:
    """Return the value [A or N] at time `t` of one waveform piece of a pulse fired at time `fired` [s]."""
    if pieces[piece, 1] == END:
        return 0.0
    return piece_value(pieces[piece], 1, (t - fired) - pieces[piece, 0])


@compiled
def pass_edge(
    node: Any, value: float, change: float, pulse: int, piece: int, columns: Any, setting: Setting
) -> float:
    """Propagate the columns through an edge of the drive; return the drive value after the edge.

    The drive value [A or N] jumps from `value` by `change`; `pulse` and `piece` identify the edge.
    """
    hammer, forcing = setting.hammer, setting.forcing
    new = value + change
    if HAS_CIRCUIT:
        for k in range(columns.shape[1]):
            later = forcing.fire_moves[k, pulse] + forcing.piece_moves[k, piece, 0]
            columns[ELECTRIC_ROW, k] -= change * later
        return new
    mode = int(node[3])
    if change == 0.0 or mode >= M.RESTING:
        return new
    x, v = node[1], node[2]
    force = field_at(x, new, hammer) - field_at(x, value, hammer) + (change if FORCE_DRIVE else 0.0)
    for k in range(columns.shape[1]):
        later = forcing.fire_moves[k, pulse] + forcing.piece_moves[k, piece, 0]
        columns[1, k] -= force * hammer[INVERSE_MASS] * later
        if FORCE_DRIVE:
            columns[DRIVE, k] -= change * v * later
        else:
            old_pull = magnet_force(hammer[MAGNET:], x, value)
            columns[COIL, k] -= (magnet_force(hammer[MAGNET:], x, new) - old_pull) * v * later
    return new


@inlined
def is_departure(before: Any, node: Any) -> bool:
    """Whether a rest on a rigid stop or under friction ended at a node; `before` is the preceding node."""
    mode = int(before[3])
    return mode >= M.RESTING and (FRICTION or mode != M.HELD) and int(node[3]) < M.RESTING


@compiled
def leave_at_edge(node: Any, pulse: int, piece: int, columns: Any, setting: Setting) -> None:
    """Propagate the columns through the edge of the drive that has just ended a rest.

    Until the edge, the stop or friction balances the other forces, so that a shift of the edge shifts the
    later motion by the same time.
    """
    hammer, drive, forcing = setting.hammer, driven(setting.drive, electric_at_node(node)), setting.forcing
    a = acceleration_at(node, int(node[3]), node[4], 0.0, hammer, drive)
    for k in range(columns.shape[1]):
        columns[1, k] = -a * (forcing.fire_moves[k, pulse] + forcing.piece_moves[k, piece, 0])


@compiled
def pass_moving_edges(node: Any, train: Train, first: int, last: int, columns: Any, setting: Setting) -> None:
    """Propagate the columns through all drive edges at a node; the edge times may depend on the constants.

    Must be called before `pass_edges`: `train`, `first` and `last` still describe the pulses that are active
    before the edges.
    """
    firings, begins, pieces, replace, under_way, live = train
    t = node[0]
    value = drive_value(t, live)
    for p in range(first, last):
        piece = under_way[p]
        while pieces[piece, 1] != END:
            piece += 1
            if firings[p] + pieces[piece, 0] > t:
                break
            change = value_of_piece(t, firings[p], piece, pieces)
            change -= value_of_piece(t, firings[p], piece - 1, pieces)
            value = pass_edge(node, value, change, p, piece, columns, setting)
    while last < firings.size and firings[last] <= t:
        change = value_of_piece(t, firings[last], begins[last], pieces)
        if replace:
            change -= value
        value = pass_edge(node, value, change, last, begins[last], columns, setting)
        last += 1
