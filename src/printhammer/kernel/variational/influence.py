"""What constants do to the rates of a motion: the variational equations with a forcing term.

A column is the change of the motion, all at one time, with one constant of the hammer or the drive: of
displacement [m], velocity [m/s], latest local maximum in the pack [m], and of the energies [J] that coil and
drive force have given and pack and backstop have taken. With a_c the slope of the acceleration with the
constant at a fixed state

    d(dx)/dt = dv,    d(dv)/dt = a_x dx + a_v dv + a_p dp + a_c,

and each energy grows by the change of its power. In the backstop, with w = sqrt(b - x) and dt = 2 w ds, the
force is a function of w, whose change at a fixed place is that of its position b: 2 w dw = db - dx. The
derivation is in docs/tangent.md.

Constants are changed where the laws read them: row 4 + j of `varied` is the array of the hammer's constants
with j times `SPACING` of the change, so that a part need not state what its constants do.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model.layout import BACKSTOP_PART, FRONT, INVERSE_MASS, MAGNET, PACK, POSITION, SPRING
from printhammer.kernel.model.modes import BACKSTOP, LOADING, RELOADING, UNLOADING
from printhammer.kernel.model.pulses import LIVE_WIDTH
from printhammer.kernel.model.slopes import (
    BACKWARD,
    CENTRAL,
    FORWARD,
    OFFSETS,
    POINTS,
    ROOT_SPACING,
    WEIGHTS,
)
from printhammer.kernel.model.slopes import SPEED_SPACING as VELOCITY_SPACING
from printhammer.kernel.variational.variation import FIRST_COLUMN, MEMORIES, STAGE, STAGES, START, A, B

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import Hammer, pack_force
    from printhammer.kernel.model.laws import (
        BACKSTOP_PULLS,
        FORCE_DRIVE,
        HAS_BACKSTOP,
        HAS_PACK,
        MEMORY,
        PACK_PULLS,
        backstop_elastic,
        backstop_energy,
        backstop_switch,
        backstop_viscous,
        magnet_force,
        pack_memory,
        pack_switch,
        spring_force,
    )
    from printhammer.kernel.model.pulses import Drive, drive_value
    from printhammer.kernel.model.slopes import (
        contact_force,
        contact_slopes,
        field_at,
        field_slope,
        memory_slope,
        pack_slopes,
    )

SPACING = 1e-3
"""Share of a constant, or of its scale, by which it is changed to see what it does."""
MIDDLE = 4
"""Row of `varied` with the constants as they are."""
VARIED = 9
"""Rows of `varied`: five points to either side."""
ENERGIES = 4
FIELD_MOVES, PACK_MOVES, BACKSTOP_MOVES = 1, 2, 4
"""Bits of `of_hammer`: which laws a column changes; mass and position of the backstop are no law's."""
ROWS = 3 + ENERGIES
"""Rows of a column: displacement, velocity, latest local maximum, energies."""
CHANGING = 2 + ENERGIES
"""Of these, the number that change between switches."""
DELAYED = 5
"""Numbers kept for each pulse under way: delay of its piece, changes of p0 to p3."""

Given = Any
"""Tuple (varied, moves, of_hammer, live_moves, memories, value_spacing): shapes (n, 9, h), (n, h), (n,), (n,
5 f), (n, 9); the last is by how much the drive is moved to see what it does to the force."""


def width(columns: int) -> int:
    """Return the length of the rows of the working space."""
    return max(FIRST_COLUMN + CHANGING * columns, 5)


@compiled
def drive_change(t: float, drive: Drive, delayed: Any) -> float:
    """Return the change of the drive [A or N] at a fixed time; `delayed` is a row of `live_moves`."""
    total = 0.0
    i, j = 1, 0
    for _ in range(int(drive[0])):
        s = (t - drive[i]) - drive[i + 1]
        kind, p1, p2, p3 = drive[i + 2], drive[i + 4], drive[i + 5], drive[i + 6]
        d0, d1, d2, d3 = delayed[j + 1], delayed[j + 2], delayed[j + 3], delayed[j + 4]
        if kind == 1.0:
            left = math.exp(-p2 * s)
            total += d0 + left * (d1 - p1 * s * d2)
            rate = -p1 * p2 * left
        elif kind == 0.0:
            total += d0 + s * (d1 + s * (d2 + s * d3))
            rate = p1 + s * (2.0 * p2 + s * 3.0 * p3)
        else:
            turn = p2 * s + p3
            total += d0 + d1 * math.sin(turn) + p1 * math.cos(turn) * (d2 * s + d3)
            rate = p1 * p2 * math.cos(turn)
        total -= rate * delayed[j]
        i += LIVE_WIDTH
        j += DELAYED
    return total


@compiled
def force_with_value(x: float, value: float, spacing: float, hammer: Hammer) -> float:
    """Return the slope of magnet and drive force with the drive: N/A, or 1 for a drive that is a force."""
    if FORCE_DRIVE:
        return 1.0
    # One-sided where a measured table ends.
    for turn in range(3):
        side = (CENTRAL + turn) % 3
        total = 0.0
        for i in range(POINTS[side]):
            total += WEIGHTS[side, i] * magnet_force(hammer[MAGNET:], x, value + OFFSETS[side, i] * spacing)
        if not math.isnan(total):
            return total / spacing
    return math.nan


@compiled
def field_changes(x: float, value: float, k: int, varied: Any) -> tuple[float, float]:
    """Return the changes [N] of magnet and spring force, and of that part of it which the current makes."""
    current = 0.0 if FORCE_DRIVE else value
    total, coil = 0.0, 0.0
    for i in range(POINTS[CENTRAL]):
        other = varied[k, MIDDLE + int(OFFSETS[CENTRAL, i])]
        magnet = magnet_force(other[MAGNET:], x, current)
        total += WEIGHTS[CENTRAL, i] * (magnet + spring_force(other[SPRING:PACK], x))
        if current != 0.0:
            coil += WEIGHTS[CENTRAL, i] * (magnet - magnet_force(other[MAGNET:], x, 0.0))
    return total / SPACING, coil / SPACING


@compiled
def note_changed_memories(memories: Any, peak: float, varied: Any, moves: Any, of_hammer: Any) -> None:
    """Fill `memories` with what the unloading branch needs of `peak` [m], at a fixed depth."""
    for k in range(of_hammer.size):
        if of_hammer[k] & PACK_MOVES:
            for j in range(VARIED):
                at = peak + (j - MIDDLE) * SPACING * moves[k, FRONT]
                memories[k, j] = pack_memory(varied[k, j][PACK:BACKSTOP_PART], at)


@compiled
def pack_change(x: float, v: float, mode: int, k: int, varied: Any, front: float, memories: Any) -> float:
    """Return the change [N] of the force of the pack at a fixed depth, its front moving by `front`."""
    side = CENTRAL
    if not PACK_PULLS and mode == LOADING:
        ahead, behind = varied[k, MIDDLE + 2], varied[k, MIDDLE - 2]
        if pack_switch(ahead[PACK:BACKSTOP_PART], x + 2.0 * SPACING * front, v) <= 0.0:
            side = BACKWARD
        elif pack_switch(behind[PACK:BACKSTOP_PART], x - 2.0 * SPACING * front, v) <= 0.0:
            side = FORWARD
    total = 0.0
    for i in range(POINTS[side]):
        away = OFFSETS[side, i]
        j = MIDDLE + int(away)
        at = x + away * SPACING * front
        total += WEIGHTS[side, i] * pack_force(at, v, mode, memories[k, j], varied[k, j])
    return float(total / SPACING)


@compiled
def contact_changes(w: float, v: float, k: int, varied: Any) -> tuple[float, float]:
    """Return the changes [N] of the force of the backstop and of its viscous part, at a fixed compression."""
    side = CENTRAL
    if not BACKSTOP_PULLS:
        if backstop_switch(varied[k, MIDDLE + 2][BACKSTOP_PART:MAGNET], w, v) <= 0.0:
            side = BACKWARD
        elif backstop_switch(varied[k, MIDDLE - 2][BACKSTOP_PART:MAGNET], w, v) <= 0.0:
            side = FORWARD
    elastic, viscous = 0.0, 0.0
    for i in range(POINTS[side]):
        c = varied[k, MIDDLE + int(OFFSETS[side, i])][BACKSTOP_PART:MAGNET]
        elastic += WEIGHTS[side, i] * backstop_elastic(c, w)
        viscous += WEIGHTS[side, i] * backstop_viscous(c, w, v)
    return (elastic + viscous) / SPACING, viscous / SPACING


@compiled
def viscous_slopes(w: float, v: float, scales: Any, hammer: Hammer) -> tuple[float, float]:
    """Return the slopes of the viscous force of the backstop with w [N/m^0.5] and velocity [N s/m]."""
    c = hammer[BACKSTOP_PART:MAGNET]
    w = max(w, 0.0)
    spacing = ROOT_SPACING * max(w, 1e-2 * math.sqrt(scales[0]))
    side = CENTRAL if w >= 2.0 * spacing else FORWARD
    if not BACKSTOP_PULLS and side == CENTRAL:
        if backstop_switch(c, w - 2.0 * spacing, v) <= 0.0:
            side = FORWARD
        elif backstop_switch(c, w + 2.0 * spacing, v) <= 0.0:
            side = BACKWARD
    with_w = 0.0
    for i in range(POINTS[side]):
        with_w += WEIGHTS[side, i] * backstop_viscous(c, w + OFFSETS[side, i] * spacing, v)
    with_w /= spacing
    spacing = VELOCITY_SPACING * scales[1]
    side = CENTRAL
    if not BACKSTOP_PULLS:
        if backstop_switch(c, w, v + 2.0 * spacing) <= 0.0:
            side = BACKWARD
        elif backstop_switch(c, w, v - 2.0 * spacing) <= 0.0:
            side = FORWARD
    with_v = 0.0
    for i in range(POINTS[side]):
        with_v += WEIGHTS[side, i] * backstop_viscous(c, w, v + OFFSETS[side, i] * spacing)
    return with_w, with_v / spacing


@compiled
def stored_change(
    x: float, dx: float, k: int, hammer: Hammer, varied: Any, moves: Any, of_hammer: Any
) -> float:
    """Return the change of the energy [J] stored in the backstop at place `x`, which changes by `dx`."""
    w = math.sqrt(max(hammer[POSITION] - x, 0.0))
    change = backstop_elastic(hammer[BACKSTOP_PART:MAGNET], w) * (moves[k, POSITION] - dx)
    if of_hammer[k] & BACKSTOP_MOVES:
        for i in range(POINTS[CENTRAL]):
            c = varied[k, MIDDLE + int(OFFSETS[CENTRAL, i])][BACKSTOP_PART:MAGNET]
            change += WEIGHTS[CENTRAL, i] * backstop_energy(c, w) / SPACING
    return float(change)


@compiled
def influence_rates(
    rates: Any,
    y: Any,
    columns: Any,
    mode: int,
    memory: float,
    peak: float,
    peaks: Any,
    scales: Any,
    bounds: Any,
    hammer: Hammer,
    drive: Drive,
    given: Given,
) -> None:
    """Fill `rates` with those of displacement or w, velocity, time and columns at `y`.

    `peaks` is what the unloading branch needs of local maxima about `peak`, as `note_memories` has it.
    """
    varied, moves, of_hammer, live_moves, memories, value_spacing = given
    v, t = y[1], y[2]
    compressed = HAS_BACKSTOP and mode == BACKSTOP
    indented = HAS_PACK and mode in (LOADING, UNLOADING, RELOADING)
    w = y[0] if compressed else 0.0
    x = hammer[POSITION] - w * w if compressed else y[0]
    pace = 2.0 * w if compressed else 1.0
    value = drive_value(t, drive)
    live = drive[0] > 0.0
    force = field_at(x, value, hammer)
    field_x = field_slope(x, value, scales, bounds, hammer)
    with_value = force_with_value(x, value, value_spacing, hammer) if live else 0.0
    coil, coil_x = 0.0, 0.0
    if FORCE_DRIVE:
        force += value
    elif value != 0.0:
        coil = magnet_force(hammer[MAGNET:], x, value) - magnet_force(hammer[MAGNET:], x, 0.0)
        coil_x = field_x - field_slope(x, 0.0, scales, bounds, hammer)
    push, with_x, with_v, with_peak = 0.0, 0.0, 0.0, 0.0
    viscous, with_w, viscous_w, viscous_v = 0.0, 0.0, 0.0, 0.0
    if compressed:
        viscous = backstop_viscous(hammer[BACKSTOP_PART:MAGNET], w, v)
        push = contact_force(w, v, hammer)
        with_w, with_v = contact_slopes(w, v, scales, hammer)
        viscous_w, viscous_v = viscous_slopes(w, v, scales, hammer)
    elif indented:
        push = pack_force(x, v, mode, memory, hammer)
        with_x, with_v = pack_slopes(x, v, mode, memory, peak, scales, hammer)
        if MEMORY and mode != LOADING:
            with_peak = memory_slope(x, v, peak, peaks, hammer)
    force += push
    rates[0] = -v if compressed else v
    rates[1] = pace * force * hammer[INVERSE_MASS]
    rates[2] = pace
    for k in range(columns.shape[1]):
        j = FIRST_COLUMN + CHANGING * k
        dx, dv = y[j], y[j + 1]
        value_change = drive_change(t, drive, live_moves[k]) if live else 0.0
        field, coil_change = 0.0, 0.0
        if of_hammer[k] & FIELD_MOVES:
            field, coil_change = field_changes(x, value, k, varied)
        change = pace * (field_x * dx + field + with_value * value_change)
        pack_power, backstop_power = 0.0, 0.0
        if compressed:
            push_change, viscous_change = 0.0, 0.0
            if of_hammer[k] & BACKSTOP_MOVES:
                push_change, viscous_change = contact_changes(w, v, k, varied)
            sink = moves[k, POSITION] - dx
            change += pace * (with_v * dv + push_change) + with_w * sink
            viscous_change = pace * (viscous_v * dv + viscous_change) + viscous_w * sink
            backstop_power = -viscous_change * v - pace * viscous * dv
        elif indented:
            front = moves[k, FRONT]
            push_change = with_x * (dx - front) + with_v * dv
            if MEMORY and mode != LOADING:
                push_change += with_peak * (columns[2, k] - front)
            if of_hammer[k] & PACK_MOVES:
                push_change += pack_change(x, v, mode, k, varied, front, memories)
            change += push_change
            pack_power = -push_change * v - push * dv
        rates[j] = pace * dv
        rates[j + 1] = change * hammer[INVERSE_MASS] + pace * force * moves[k, INVERSE_MASS]
        if FORCE_DRIVE:
            rates[j + 2] = 0.0
            rates[j + 3] = pace * (value_change * v + value * dv)
        else:
            coil_change += coil_x * dx + with_value * value_change
            rates[j + 2] = pace * (coil_change * v + coil * dv)
            rates[j + 3] = 0.0
        rates[j + 4] = pack_power
        rates[j + 5] = backstop_power


@compiled
def influence_step(
    length: float,
    columns: Any,
    work: Any,
    mode: int,
    memory: float,
    peak: float,
    scales: Any,
    bounds: Any,
    hammer: Hammer,
    drive: Drive,
    given: Given,
) -> None:
    """Take one step of `length` (s, or of the variable s in the backstop) from row START of `work`."""
    count = FIRST_COLUMN + CHANGING * columns.shape[1]
    start, y, peaks = work[START], work[STAGE], work[MEMORIES]
    for stage in range(STAGES):
        for i in range(count):
            y[i] = start[i]
        for j in range(stage):
            share = length * A[stage, j]
            for i in range(count):
                y[i] += share * work[j, i]
        influence_rates(
            work[stage], y, columns, mode, memory, peak, peaks, scales, bounds, hammer, drive, given
        )
    for j in range(STAGES):
        share = length * B[j]
        for i in range(count):
            start[i] += share * work[j, i]
