"""Forcing of the variational equations: force derivatives with respect to constants, at a fixed state.

The derivative a_c of the acceleration with respect to a constant is added to the rate of dv, and the
derivative of each power to the rate of its energy. In the backstop, the force is a function of w = sqrt(b -
x), where 2 w dw = db - dx; in the pack, the force is a function of the depth. The derivation is in
docs/tangent.md. The laws are evaluated with shifted arrays of constants, so that a part need not define
derivatives.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    DAMPING,
    END,
    FRONT,
    INVERSE_MASS,
    MAGNET,
    MOST_LEVELS,
    PACK,
    POSITION,
    SPRING,
    TURN_RESISTANCE,
    Train,
)
from printhammer.kernel.model.modes import BACKSTOP, LOADING, RELOADING, UNLOADING
from printhammer.kernel.model.pulses import LIVE_WIDTH
from printhammer.kernel.variational import layout as V
from printhammer.kernel.variational.slopes import BACKWARD, CENTRAL, FORWARD, OFFSETS, POINTS, WEIGHTS

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import driven
    from printhammer.kernel.model.forces import (
        Hammer,
        friction,
        pack_force,
        slip,
        value_at,
        viscous_force,
    )
    from printhammer.kernel.model.laws import (
        BACKSTOP_PULLS,
        CHANGING,
        FORCE_DRIVE,
        FRICTION,
        HAS_BACKSTOP,
        HAS_CIRCUIT,
        HAS_DAMPING,
        HAS_PACK,
        LEVELS,
        PACK_PULLS,
        RIGID_FRONT,
        VISCOUS,
        backstop_elastic,
        backstop_energy,
        backstop_rebound,
        backstop_switch,
        backstop_viscous,
        damping_force,
        friction_force,
        magnet_force,
        pack_memory,
        pack_rebound,
        pack_switch,
        spring_force,
        spring_level,
        spring_switch,
        spring_viscous,
    )
    from printhammer.kernel.model.pulses import Drive, piece_change, piece_rate
    from printhammer.kernel.variational.circuit import (
        current_change,
        current_slopes,
        electric_in,
        force_with_current,
    )
    from printhammer.kernel.variational.layout import Forcing, Setting
    from printhammer.kernel.variational.slopes import damping_slope, field_slope


@compiled
def set_live_moves(first: int, last: int, train: Train, forcing: Forcing) -> None:
    """Write to `live_moves` the derivatives of the active waveform pieces with respect to all constants.

    The pieces are in the same order as in `pass_edges`.
    """
    fire_moves, piece_moves, live_moves = forcing.fire_moves, forcing.piece_moves, forcing.live_moves
    for k in range(fire_moves.shape[0]):
        j = 0
        for p in range(first, last):
            piece = train.under_way[p]
            if train.pieces[piece, 1] == END:
                continue
            live_moves[k, j] = fire_moves[k, p] + piece_moves[k, piece, 0]
            for i in range(4):
                live_moves[k, j + 1 + i] = piece_moves[k, piece, 2 + i]
            j += V.DELAYED


@inlined
def drive_change(t: float, drive: Drive, delayed: Any) -> float:
    """Return the derivative of the drive with respect to the constant whose `live_moves` are `delayed`."""
    total = 0.0
    i, j = 1, 0
    for _ in range(int(drive[0])):
        s = (t - drive[i]) - drive[i + 1]
        total += piece_change(drive, i + 2, s, delayed, j + 1)
        total -= piece_rate(drive, i + 2, s) * delayed[j]
        i += LIVE_WIDTH
        j += V.DELAYED
    return total


@inlined
def force_with_value(x: float, value: float, hammer: Hammer, drive: Drive, forcing: Forcing) -> float:
    """Return the derivative of magnet and drive force with respect to the drive: N/A, or 1 for a force."""
    if HAS_CIRCUIT:
        return force_with_current(x, value, hammer)
    if drive[0] == 0.0:
        return 0.0
    if FORCE_DRIVE:
        return 1.0
    # Use one-sided differences at the end of a measured table.
    spacing = forcing.value_spacing
    for turn in range(3):
        side = (CENTRAL + turn) % 3
        total = 0.0
        for i in range(POINTS[side]):
            total += WEIGHTS[side, i] * magnet_force(hammer[MAGNET:], x, value + OFFSETS[side, i] * spacing)
        if not math.isnan(total):
            return float(total / spacing)
    return math.nan


@compiled
def smooth_side(x: float, k: int, setting: Setting) -> int:
    """Select the difference formula for constant `k` that moves no kink of the spring law past `x` [m].

    If a positive shift moves a kink past `x`, the formula is BACKWARD; if a negative shift does, FORWARD.
    """
    if LEVELS:
        varied = setting.forcing.varied
        for j in range(MOST_LEVELS):
            level = spring_level(varied[k, V.MIDDLE][SPRING:PACK], float(j))
            if math.isinf(level):
                break
            beyond = setting.bounds[2] >= level
            ahead = spring_level(varied[k, V.MIDDLE + 2][SPRING:PACK], float(j)) - x
            behind = spring_level(varied[k, V.MIDDLE - 2][SPRING:PACK], float(j)) - x
            if (beyond and ahead > 0.0) or (not beyond and ahead < 0.0):
                return BACKWARD
            if (beyond and behind > 0.0) or (not beyond and behind < 0.0):
                return FORWARD
    return CENTRAL


@inlined
def field_changes(
    t: float, x: float, value: float, with_value: float, k: int, drive: Drive, setting: Setting
) -> tuple[float, float, float]:
    """Return the derivatives of total, coil and drive force with respect to constant k.

    The total is the sum of magnet, spring and drive force. The state, including any flux linkage, is fixed.
    `with_value` is the derivative of the force with respect to the drive `value`.
    """
    forcing = setting.forcing
    varied, of_hammer, live_moves = forcing.varied, forcing.of_hammer, forcing.live_moves
    if HAS_CIRCUIT:
        pulse = with_value * current_change(x, drive[1], drive[0], k, forcing)
    else:
        pulse = with_value * drive_change(t, drive, live_moves[k]) if drive[0] > 0.0 else 0.0
    total, coil = 0.0, 0.0
    current = 0.0 if FORCE_DRIVE else value
    if of_hammer[k] & V.FIELD_MOVES:
        side = smooth_side(x, k, setting)
        for i in range(POINTS[side]):
            other = varied[k, V.MIDDLE + int(OFFSETS[side, i])]
            magnet = magnet_force(other[MAGNET:], x, current)
            total += WEIGHTS[side, i] * (magnet + spring_force(other[SPRING:PACK], x))
            if current != 0.0:
                coil += WEIGHTS[side, i] * (magnet - magnet_force(other[MAGNET:], x, 0.0))
    total, coil = total / V.SPACING + pulse, coil / V.SPACING
    return (total, coil, pulse) if FORCE_DRIVE else (total, coil + pulse, 0.0)


@inlined
def damping_change(x: float, v: float, k: int, setting: Setting) -> float:
    """Return the derivative of the damping and dissipative spring forces with respect to constant k."""
    forcing = setting.forcing
    total = 0.0
    if HAS_DAMPING and forcing.of_hammer[k] & V.DAMPING_MOVES:
        for i in range(POINTS[CENTRAL]):
            c = forcing.varied[k, V.MIDDLE + int(OFFSETS[CENTRAL, i])][DAMPING:SPRING]
            total += WEIGHTS[CENTRAL, i] * damping_force(c, v)
    if VISCOUS and forcing.of_hammer[k] & V.FIELD_MOVES:
        side = smooth_side(x, k, setting)
        number = spring_switch(forcing.varied[k, V.MIDDLE][SPRING:PACK], v)
        if side == CENTRAL and spring_switch(forcing.varied[k, V.MIDDLE + 2][SPRING:PACK], v) * number <= 0.0:
            side = BACKWARD
        elif (
            side == CENTRAL and spring_switch(forcing.varied[k, V.MIDDLE - 2][SPRING:PACK], v) * number <= 0.0
        ):
            side = FORWARD
        for i in range(POINTS[side]):
            c = forcing.varied[k, V.MIDDLE + int(OFFSETS[side, i])][SPRING:PACK]
            total += WEIGHTS[side, i] * spring_viscous(c, x, v)
    return float(total / V.SPACING)


@inlined
def friction_change(rests: float, k: int, forcing: Forcing) -> float:
    """Return the derivative of the kinetic (`rests` 0) or static (1) friction with respect to constant k."""
    total = 0.0
    if forcing.of_hammer[k] & V.DAMPING_MOVES:
        for i in range(POINTS[CENTRAL]):
            c = forcing.varied[k, V.MIDDLE + int(OFFSETS[CENTRAL, i])][DAMPING:SPRING]
            total += WEIGHTS[CENTRAL, i] * friction_force(c, rests)
    return float(total / V.SPACING)


@compiled
def note_changed_memories(peak: float, forcing: Forcing) -> None:
    """Compute the memory values of the pack law for shifted constants, with a fixed depth of `peak` [m]."""
    varied, moves, of_hammer, memories = forcing.varied, forcing.moves, forcing.of_hammer, forcing.memories
    for k in range(of_hammer.size):
        if of_hammer[k] & V.PACK_MOVES:
            for j in range(V.VARIED):
                at = peak + (j - V.MIDDLE) * V.SPACING * moves[k, FRONT]
                memories[k, j] = pack_memory(varied[k, j][PACK:BACKSTOP_PART], at)


@inlined
def pack_change(x: float, v: float, mode: int, k: int, forcing: Forcing) -> float:
    """Return the derivative of the pack force with respect to constant k, at a fixed depth."""
    varied, moves, of_hammer, memories = forcing.varied, forcing.moves, forcing.of_hammer, forcing.memories
    if not of_hammer[k] & V.PACK_MOVES:
        return 0.0
    front = moves[k, FRONT]
    side = CENTRAL
    if not PACK_PULLS and mode == LOADING:
        ahead, behind = varied[k, V.MIDDLE + 2], varied[k, V.MIDDLE - 2]
        if pack_switch(ahead[PACK:BACKSTOP_PART], x + 2.0 * V.SPACING * front, v) <= 0.0:
            side = BACKWARD
        elif pack_switch(behind[PACK:BACKSTOP_PART], x - 2.0 * V.SPACING * front, v) <= 0.0:
            side = FORWARD
    total = 0.0
    for i in range(POINTS[side]):
        away = OFFSETS[side, i]
        j = V.MIDDLE + int(away)
        at = x + away * V.SPACING * front
        total += WEIGHTS[side, i] * pack_force(at, v, mode, memories[k, j], varied[k, j])
    return float(total / V.SPACING)


@inlined
def contact_changes(w: float, v: float, k: int, forcing: Forcing) -> tuple[float, float]:
    """Return derivatives of total and viscous backstop force with respect to constant k, at fixed w and v."""
    varied, of_hammer = forcing.varied, forcing.of_hammer
    if not of_hammer[k] & V.BACKSTOP_MOVES:
        return 0.0, 0.0
    side = CENTRAL
    if not BACKSTOP_PULLS:
        if backstop_switch(varied[k, V.MIDDLE + 2][BACKSTOP_PART:MAGNET], w, v) <= 0.0:
            side = BACKWARD
        elif backstop_switch(varied[k, V.MIDDLE - 2][BACKSTOP_PART:MAGNET], w, v) <= 0.0:
            side = FORWARD
    elastic, viscous = 0.0, 0.0
    for i in range(POINTS[side]):
        c = varied[k, V.MIDDLE + int(OFFSETS[side, i])][BACKSTOP_PART:MAGNET]
        elastic += WEIGHTS[side, i] * backstop_elastic(c, w)
        viscous += WEIGHTS[side, i] * backstop_viscous(c, w, v)
    return (elastic + viscous) / V.SPACING, viscous / V.SPACING


@compiled
def rebound_change(front: bool, v_in: float, k: int, forcing: Forcing) -> float:
    """Return the derivative of the velocity after an impact with respect to constant k.

    The rigid surface is the pack front if `front` is true, otherwise the backstop.
    """
    varied, of_hammer = forcing.varied, forcing.of_hammer
    change = 0.0
    if of_hammer[k] & (V.PACK_MOVES if front else V.BACKSTOP_MOVES):
        for i in range(POINTS[CENTRAL]):
            c = varied[k, V.MIDDLE + int(OFFSETS[CENTRAL, i])]
            if RIGID_FRONT and front:
                change += WEIGHTS[CENTRAL, i] * pack_rebound(c[PACK:BACKSTOP_PART], v_in)
            else:
                change += WEIGHTS[CENTRAL, i] * backstop_rebound(c[BACKSTOP_PART:MAGNET], v_in)
    return float(change / V.SPACING)


@compiled
def stored_change(x: float, dx: float, k: int, hammer: Hammer, forcing: Forcing) -> float:
    """Return the derivative of the elastic energy of the backstop with respect to constant k.

    `dx` is the derivative of the displacement `x` with respect to the constant.
    """
    varied, moves, of_hammer = forcing.varied, forcing.moves, forcing.of_hammer
    w = math.sqrt(max(hammer[POSITION] - x, 0.0))
    change = backstop_elastic(hammer[BACKSTOP_PART:MAGNET], w) * (moves[k, POSITION] - dx)
    if of_hammer[k] & V.BACKSTOP_MOVES:
        for i in range(POINTS[CENTRAL]):
            c = varied[k, V.MIDDLE + int(OFFSETS[CENTRAL, i])][BACKSTOP_PART:MAGNET]
            change += WEIGHTS[CENTRAL, i] * backstop_energy(c, w) / V.SPACING
    return float(change)


@compiled
def add_forcing(
    rates: Any, y: Any, columns: Any, mode: int, memory: float, slopes: Any, setting: Setting
) -> None:
    """Add the effect of constants to the velocity rates of the columns at `y`; write the energy rates.

    `slopes` is the result of :func:`printhammer.kernel.variational.columns.force_slopes` at `y`.
    """
    scales, bounds, hammer, live, forcing = setting
    drive = driven(live, electric_in(y))
    moves = forcing.moves
    field_x, push_x, _push_v, push_peak, loss_x, loss_v = slopes
    v, t, pace = y[1], y[V.TIME], rates[V.TIME]
    compressed = HAS_BACKSTOP and mode == BACKSTOP
    indented = HAS_PACK and mode in (LOADING, UNLOADING, RELOADING)
    w = y[0] if compressed else 0.0
    x = hammer[POSITION] - w * w if compressed else y[0]
    value = value_at(t, x, hammer, drive)
    with_value = force_with_value(x, value, hammer, drive, forcing)
    coil, coil_x = 0.0, 0.0
    if not FORCE_DRIVE and value != 0.0:
        coil = magnet_force(hammer[MAGNET:], x, value) - magnet_force(hammer[MAGNET:], x, 0.0)
        coil_x = field_x - field_slope(x, v, 0.0, scales, bounds, hammer)
    coil_linkage, main = 0.0, 0
    if HAS_CIRCUIT:
        current = current_slopes(x, electric_in(y), hammer, live)
        coil_linkage = current[2] * current[1]
        main = CHANGING - V.ELECTRICS + int(hammer[TURN_RESISTANCE] > 0.0)
    drag_x = 0.0
    if VISCOUS:
        drag_x = field_slope(x, v, 0.0, scales, bounds, hammer) - field_slope(
            x, 0.0, 0.0, scales, bounds, hammer
        )
    loss = 0.0
    if compressed:
        loss = backstop_viscous(hammer[BACKSTOP_PART:MAGNET], w, v)
    elif indented:
        loss = pack_force(x, v, mode, memory, hammer)
    for k in range(columns.shape[1]):
        j = V.FIRST_COLUMN + CHANGING * k
        dx, dv = y[j], y[j + 1]
        change, coil_change, drive_part = field_changes(t, x, value, with_value, k, drive, setting)
        e = j + V.STATE - V.ENERGY
        if HAS_DAMPING:
            drag = damping_change(x, v, k, setting)
            by_v = damping_slope(x, v, scales, hammer) * v + viscous_force(x, v, hammer)
            if FRICTION:
                drag -= slip(mode, memory) * friction_change(0.0, k, forcing)
                by_v += friction(mode, memory, hammer)
            change += drag
            rates[e + V.DAMPING_LOSS] = -pace * (drag * v + by_v * dv)
            if VISCOUS:
                rates[e + V.DAMPING_LOSS] -= pace * drag_x * dx * v
        surface, push, lost = 0.0, 0.0, 0.0
        if compressed:
            surface = moves[k, POSITION]
            push, lost = contact_changes(w, v, k, forcing)
        elif indented:
            surface = moves[k, FRONT]
            # The work on the pack is counted as loss as a whole.
            push = pack_change(x, v, mode, k, forcing)
            lost = push
        change = pace * (change + push) - (push_x + push_peak) * surface
        rates[j + 1] += change * hammer[INVERSE_MASS]
        rates[j + 1] += rates[1] * moves[k, INVERSE_MASS] / hammer[INVERSE_MASS]
        lost = pace * (lost + loss_v * dv) + loss_x * (dx - surface)
        lost += push_peak * (columns[V.PEAK, k] - surface)
        rates[e + V.COIL] = pace * ((coil_change + coil_x * dx) * v + coil * dv)
        if HAS_CIRCUIT:
            rates[e + V.COIL] += pace * coil_linkage * y[j + main] * v
        rates[e + V.DRIVE] = pace * (drive_part * v + value * dv) if FORCE_DRIVE else 0.0
        power = -lost * v - pace * loss * dv
        rates[e + V.PACK_LOSS] = power if indented else 0.0
        rates[e + V.BACKSTOP_LOSS] = power if compressed else 0.0
