"""What constants do to a recorded run: the columns of `influence` carried through steps, switches and edges.

A constant also moves the surfaces and the edges of the drive; the jumps that follow are derived in
docs/tangent.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compiling import compiled, entry
from printhammer.kernel.influence import (
    BACKSTOP_MOVES,
    CHANGING,
    DELAYED,
    ENERGIES,
    FIELD_MOVES,
    MIDDLE,
    PACK_MOVES,
    ROWS,
    SPACING,
)
from printhammer.kernel.layout import BACKSTOP_PART, FRONT, INVERSE_MASS, MAGNET, POSITION
from printhammer.kernel.modes import (
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
from printhammer.kernel.slopes import CENTRAL, OFFSETS, POINTS, WEIGHTS
from printhammer.kernel.variation import FIRST_COLUMN, GRADING, MEMORIES, START

if TYPE_CHECKING:
    from printhammer.kernel.forces import Hammer
    from printhammer.kernel.influence import (
        Given,
        contact_changes,
        drive_change,
        field_changes,
        force_with_value,
        influence_step,
        note_changed_memories,
        pack_change,
    )
    from printhammer.kernel.laws import (
        FORCE_DRIVE,
        HAS_BACKSTOP,
        HAS_PACK,
        MEMORY,
        backstop_rebound,
        magnet_force,
    )
    from printhammer.kernel.pulses import Drive, drive_value, edges_at, pass_edges
    from printhammer.kernel.quadrature import powers
    from printhammer.kernel.resample import branch_of, memory_of
    from printhammer.kernel.slopes import (
        contact_slopes,
        field_at,
        field_slope,
        note_memories,
        pack_slopes,
    )
    from printhammer.kernel.tangent import is_rebound, pass_level, pass_rebound, pass_reversal
    from printhammer.kernel.variation import (
        begin_step,
        held_in_backstop,
        length_in_contact,
        longest_variation_step,
    )


@compiled
def set_out(work: Any, columns: Any) -> None:
    """Put what changes between switches in row START of `work`."""
    for k in range(columns.shape[1]):
        j = FIRST_COLUMN + CHANGING * k
        work[START, j] = columns[0, k]
        work[START, j + 1] = columns[1, k]
        for i in range(ENERGIES):
            work[START, j + 2 + i] = columns[3 + i, k]


@compiled
def bring_back(work: Any, columns: Any) -> None:
    """Take it out of row START of `work`."""
    for k in range(columns.shape[1]):
        j = FIRST_COLUMN + CHANGING * k
        columns[0, k] = work[START, j]
        columns[1, k] = work[START, j + 1]
        for i in range(ENERGIES):
            columns[3 + i, k] = work[START, j + 2 + i]


@compiled
def copy(columns: Any, out: Any) -> None:
    """Put columns elsewhere."""
    for i in range(ROWS):
        for k in range(columns.shape[1]):
            out[i, k] = columns[i, k]


@compiled
def rest_in_pack(
    t: float,
    x: float,
    k: int,
    columns: Any,
    scales: Any,
    bounds: Any,
    hammer: Hammer,
    drive: Drive,
    given: Given,
) -> None:
    """Give column `k` the change of a place of rest on the loading branch; the past is forgotten."""
    varied, moves, of_hammer, live_moves, memories, spacing = given
    value = drive_value(t, drive)
    with_x, _with_v = pack_slopes(x, 0.0, LOADING, 0.0, scales, hammer)
    change = -with_x * moves[k, FRONT]
    if of_hammer[k] & FIELD_MOVES:
        change += field_changes(x, value, k, varied)[0]
    if of_hammer[k] & PACK_MOVES:
        change += pack_change(x, 0.0, LOADING, k, varied, moves[k, FRONT], memories)
    if drive[0] > 0.0:
        change += force_with_value(x, value, spacing, hammer) * drive_change(t, drive, live_moves[k])
    columns[0, k] = -change / (with_x + field_slope(x, value, scales, bounds, hammer))
    columns[1, k] = 0.0
    columns[2, k] = columns[0, k]


@compiled
def rest_in_backstop(
    pause: float, x: float, w: float, columns: Any, scales: Any, bounds: Any, hammer: Hammer, given: Given
) -> None:
    """Let the columns settle for `pause` [s] to the change of the place of rest, as a linear oscillator."""
    varied, moves, of_hammer, _live_moves, _memories, _spacing = given
    with_w, _with_v = contact_slopes(w, 0.0, scales, hammer)
    by_x = field_slope(x, 0.0, scales, bounds, hammer) - with_w / (2.0 * w)
    # Twice: the place of rest is taken out before, and put back after.
    for sign in (-1.0, 1.0):
        for k in range(columns.shape[1]):
            change = with_w * moves[k, POSITION] / (2.0 * w)
            if of_hammer[k] & FIELD_MOVES:
                change += field_changes(x, 0.0, k, varied)[0]
            if of_hammer[k] & BACKSTOP_MOVES:
                change += contact_changes(w, 0.0, k, varied)[0]
            columns[0, k] -= sign * change / by_x
        if sign < 0.0:
            factor = math.exp(held_in_backstop(pause, x, w, columns, scales, bounds, hammer))
            for k in range(columns.shape[1]):
                columns[0, k] *= factor
                columns[1, k] *= factor


@compiled
def setting_in(
    pause: float,
    t: float,
    x: float,
    columns: Any,
    hammer: Hammer,
    drive: Drive,
    given: Given,
) -> None:
    """Carry the columns through the step that only gets the regularised equations going."""
    varied, moves, of_hammer, live_moves, _memories, spacing = given
    value = drive_value(t, drive)
    force = field_at(x, value, hammer) + (value if FORCE_DRIVE else 0.0)
    for k in range(columns.shape[1]):
        change = field_changes(x, value, k, varied)[0] if of_hammer[k] & FIELD_MOVES else 0.0
        if drive[0] > 0.0:
            change += force_with_value(x, value, spacing, hammer) * drive_change(t, drive, live_moves[k])
        columns[0, k] += pause * columns[1, k]
        columns[1, k] += pause * (change * hammer[INVERSE_MASS] + force * moves[k, INVERSE_MASS])


@compiled
def carry_on(
    t_to: float,
    node: Any,
    after: Any,
    columns: Any,
    work: Any,
    scales: Any,
    bounds: Any,
    hammer: Hammer,
    drive: Drive,
    given: Given,
) -> None:
    """Carry state and columns from the time in row START of `work` to `t_to` [s], in the step from `node`."""
    t = work[START, 2]
    if t_to <= t:
        return
    varied, moves, of_hammer, _live_moves, memories, _spacing = given
    work[START, 2] = t_to
    mode, kept = int(node[3]), node[4]
    if mode == RESTING:
        for k in range(columns.shape[1]):
            columns[0, k], columns[1, k], columns[2, k] = moves[k, POSITION], 0.0, 0.0
        return
    if HAS_PACK and mode in (HELD_LOADING, HELD_UNLOADING):
        for k in range(columns.shape[1]):
            rest_in_pack(t_to, node[1], k, columns, scales, bounds, hammer, drive, given)
        return
    if HAS_BACKSTOP and mode == HELD:
        rest_in_backstop(t_to - t, node[1], kept, columns, scales, bounds, hammer, given)
        return
    if HAS_BACKSTOP and mode == BACKSTOP and work[START, 0] == 0.0 and work[START, 1] == 0.0:
        setting_in(t_to - t, t, node[1], columns, hammer, drive, given)
        return
    work[START, 2] = t
    set_out(work, columns)
    if HAS_BACKSTOP and mode == BACKSTOP:
        leaves = t_to == after[0] and int(after[3]) == FREE
        length = length_in_contact(t_to, leaves, t, work[START, 0], work[START, 1], hammer, drive)
        longest = longest_variation_step(mode, 0.0, 0.0, work, scales, bounds, hammer, drive)
        count = 1 + int(length / longest)
        for _ in range(count):
            influence_step(
                length / count, columns, work, mode, 0.0, 0.0, scales, bounds, hammer, drive, given
            )
    else:
        memory = memory_of(mode, kept, hammer)
        if HAS_PACK and MEMORY and mode in (UNLOADING, RELOADING):
            note_memories(work[MEMORIES], kept, scales, hammer)
            note_changed_memories(memories, kept, varied, moves, of_hammer)
        longest = longest_variation_step(mode, memory, kept, work, scales, bounds, hammer, drive)
        left = t_to - t
        while left > 0.0:
            length = min(left, longest)
            if HAS_PACK and mode == LOADING and work[START, 1] > 0.0:
                since = (work[START, 0] - hammer[FRONT]) / work[START, 1]
                length = min(length, max(since, GRADING * (t_to - t)))
            influence_step(length, columns, work, mode, memory, kept, scales, bounds, hammer, drive, given)
            left = 0.0 if length == left else t_to - work[START, 2]
    work[START, 2] = t_to
    bring_back(work, columns)


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
    if piece >= pieces.shape[0] - 1:
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
    final = pieces.shape[0] - 1
    value = drive_value(t, drive)
    for p in range(first, last):
        for piece in range(under_way[p] + 1, final + 1):
            if firings[p] + pieces[piece, 0] > t:
                break
            change = piece_value(t, firings[p], piece, pieces) - piece_value(t, firings[p], piece - 1, pieces)
            value = pass_edge(node, value, change, p, piece, columns, hammer, fire_moves, piece_moves)
    while last < firings.size and firings[last] <= t:
        change = piece_value(t, firings[last], 0, pieces)
        if replace:
            change -= value
        value = pass_edge(node, value, change, last, 0, columns, hammer, fire_moves, piece_moves)
        last += 1


@compiled
def set_live_moves(
    first: int, last: int, under_way: Any, fire_moves: Any, piece_moves: Any, live_moves: Any
) -> None:
    """Rewrite the changes of the pieces under way, in the order in which `pass_edges` has them."""
    for k in range(fire_moves.shape[0]):
        j = 0
        for p in range(first, last):
            piece = under_way[p]
            live_moves[k, j] = fire_moves[k, p] + piece_moves[k, piece, 0]
            for i in range(4):
                live_moves[k, j + 1 + i] = piece_moves[k, piece, 2 + i]
            j += DELAYED


@compiled
def note_seen(
    found: Any, seen: Any, row: int, node: Any, initial: Any, columns: Any, work: Any, hammer: Hammer
) -> None:
    """Enter state and columns at a mark; at the first mark the columns begin."""
    mode = int(node[3])
    remembers = HAS_PACK and MEMORY and branch_of(mode) in (UNLOADING, RELOADING)
    place = work[START, 0]
    found[row, 0] = hammer[POSITION] - place * place if mode == BACKSTOP else place
    found[row, 1], found[row, 2] = work[START, 1], mode
    found[row, 3] = node[4] if remembers else 0.0
    for k in range(columns.shape[1]):
        for i in range(ROWS):
            if row == 0:
                columns[i, k] = initial[i, k] if i < 2 or (i == 2 and remembers) else 0.0
            seen[row, i, k] = columns[i, k]


@entry
def sensitivity(
    nodes: Any,
    firings: Any,
    pieces: Any,
    replace: bool,
    under_way: Any,
    live: Any,
    hammer: Hammer,
    scales: Any,
    bounds: Any,
    varied: Any,
    moves: Any,
    of_hammer: Any,
    fire_moves: Any,
    piece_moves: Any,
    live_moves: Any,
    memories: Any,
    value_spacing: float,
    marks: Any,
    wanted: Any,
    initial: Any,
    columns: Any,
    work: Any,
    found: Any,
    seen: Any,
    passed: Any,
) -> bool:
    """Carry columns along a whole run, from the first mark to the last.

    Parameters
    ----------
    nodes, firings, pieces, replace, under_way, live, hammer
        As recorded and given in :func:`printhammer.kernel.run.run`.
    scales, bounds : tuple of float
        As in :func:`printhammer.kernel.tangent.tangent`.
    varied, moves : float64 arrays, shapes (n, 9, h) and (n, h)
        The hammer's constants moved by -4 to 4 times `SPACING` of their changes, and the changes.
    of_hammer : int64 array, shape (n,)
        Which laws a column changes, sum of the bits of :mod:`printhammer.kernel.influence`.
    fire_moves, piece_moves : float64 arrays, shapes (n, f) and (n, m + 1, 6)
        Changes of the firing times [s] and of the waveform's table.
    live_moves, memories : float64 arrays, shapes (n, 5 f) and (n, 9)
        Working space.
    value_spacing : float
        By how much the drive is moved to see what it does to the force [A or N].
    marks : float64 array, shape (m,)
        Ascending times [s]; at an instant of a switch: after it.
    wanted : int64 array, shape (q,)
        Ascending numbers of nodes.
    initial : float64 array, shape (3, n)
        Changes of displacement, velocity and latest local maximum at the first mark.
    columns, work : float64 arrays, shapes (7, n) and (15, `width`)
        Working space, zeros.
    found : float64 array, shape (m, 4)
        Displacement, velocity, mode and latest local maximum at the marks.
    seen : float64 array, shape (m, 7, n)
        The columns at the marks.
    passed : float64 array, shape (q, 2, 7, n)
        The columns at the wanted nodes before the switch there and after it.

    Returns
    -------
    bool
        Whether the motion is differentiable in between.
    """
    given = (varied, moves, of_hammer, live_moves, memories, value_spacing)
    count = nodes.shape[0]
    smooth = True
    due, asked = 0, 0
    first, last, _edge = edges_at(nodes[0, 0], firings, pieces, replace, under_way, live)
    set_live_moves(first, last, under_way, fire_moves, piece_moves, live_moves)
    for i in range(count):
        if due == marks.size:
            return smooth
        node = nodes[i]
        after = nodes[min(i + 1, count - 1)]
        final = i + 1 == count
        t_end = after[0]
        if due > 0:
            pass_moving_edges(
                node, firings, pieces, replace, under_way, first, last, columns, hammer, live, fire_moves,
                piece_moves,
            )  # fmt: skip
        first, last, _edge = pass_edges(node[0], firings, pieces, replace, under_way, first, last, live)
        set_live_moves(first, last, under_way, fire_moves, piece_moves, live_moves)
        begin_step(node, work)
        # A mark at the time of several nodes belongs to the last of them.
        while due < marks.size and (marks[due] < t_end or (final and marks[due] == t_end)):
            carry_on(marks[due], node, after, columns, work, scales, bounds, hammer, live, given)
            note_seen(found, seen, due, node, initial, columns, work, hammer)
            due += 1
        if due in (0, marks.size) or final:
            continue
        carry_on(t_end, node, after, columns, work, scales, bounds, hammer, live, given)
        asked_now = asked < wanted.size and wanted[asked] == i + 1
        if asked_now:
            copy(columns, passed[asked, 0])
        if not pass_switch(node, after, columns, hammer, live, given):
            smooth = False
        if asked_now:
            copy(columns, passed[asked, 1])
            asked += 1
    return smooth
