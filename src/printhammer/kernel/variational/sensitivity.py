"""What constants do to a recorded run: the columns of `influence` carried through its steps.

Through switches and edges of the drive :mod:`printhammer.kernel.variational.influence_switches` carries them.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, entry
from printhammer.kernel.model.layout import FRONT, INVERSE_MASS, POSITION
from printhammer.kernel.model.modes import (
    BACKSTOP,
    BACKSTOP_RELEASED,
    FREE,
    HELD,
    HELD_LOADING,
    HELD_UNLOADING,
    LOADING,
    RELOADING,
    RESTING,
    UNLOADING,
)
from printhammer.kernel.variational.influence import (
    BACKSTOP_MOVES,
    CHANGING,
    ENERGIES,
    FIELD_MOVES,
    PACK_MOVES,
    ROWS,
)
from printhammer.kernel.variational.variation import FIRST_COLUMN, GRADING, MEMORIES, START

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import Hammer
    from printhammer.kernel.model.laws import (
        FORCE_DRIVE,
        HAS_BACKSTOP,
        HAS_PACK,
        MEMORY,
    )
    from printhammer.kernel.model.pulses import Drive, drive_value, edges_at, pass_edges
    from printhammer.kernel.model.slopes import (
        contact_slopes,
        field_at,
        field_slope,
        note_memories,
        pack_slopes,
    )
    from printhammer.kernel.single.resample import branch_of, memory_of
    from printhammer.kernel.variational.influence import (
        Given,
        contact_changes,
        drive_change,
        field_changes,
        force_with_value,
        influence_step,
        note_changed_memories,
        pack_change,
        stored_change,
    )
    from printhammer.kernel.variational.influence_switches import (
        pass_moving_edges,
        pass_switch,
        set_live_moves,
    )
    from printhammer.kernel.variational.variation import (
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
    with_x, _with_v = pack_slopes(x, 0.0, LOADING, 0.0, x, scales, hammer)
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
    if HAS_BACKSTOP and mode == BACKSTOP_RELEASED:
        # What the backstop still stores is lost as it creeps back: in closed form, not as (b - x)^1.5.
        for k in range(columns.shape[1]):
            columns[6, k] += stored_change(work[START, 0], columns[0, k], k, hammer, varied, moves, of_hammer)
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
            note_memories(work[MEMORIES], kept, hammer)
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
    if HAS_BACKSTOP and mode == BACKSTOP_RELEASED:
        for k in range(columns.shape[1]):
            columns[6, k] -= stored_change(work[START, 0], columns[0, k], k, hammer, varied, moves, of_hammer)


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
    begins: Any,
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
    nodes, firings, begins, pieces, replace, under_way, live, hammer
        As recorded and given in :func:`printhammer.kernel.single.run.run`.
    scales, bounds : tuple of float
        As in :func:`printhammer.kernel.variational.tangent.tangent`.
    varied, moves : float64 arrays, shapes (n, 9, h) and (n, h)
        The hammer's constants moved by -4 to 4 times `SPACING` of their changes, and the changes.
    of_hammer : int64 array, shape (n,)
        Which laws a column changes, sum of the bits of :mod:`printhammer.kernel.variational.influence`.
    fire_moves, piece_moves : float64 arrays, shapes (n, f) and (n, m, 6)
        Changes of the firing times [s] and of the waveforms' tables.
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
    first, last, _edge = edges_at(nodes[0, 0], firings, begins, pieces, replace, under_way, live)
    set_live_moves(first, last, pieces, under_way, fire_moves, piece_moves, live_moves)
    for i in range(count):
        if due == marks.size:
            return smooth
        node = nodes[i]
        after = nodes[min(i + 1, count - 1)]
        final = i + 1 == count
        t_end = after[0]
        if due > 0:
            pass_moving_edges(
                node, firings, begins, pieces, replace, under_way, first, last, columns, hammer, live,
                fire_moves, piece_moves,
            )  # fmt: skip
        first, last, _edge = pass_edges(
            node[0], firings, begins, pieces, replace, under_way, first, last, live
        )
        set_live_moves(first, last, pieces, under_way, fire_moves, piece_moves, live_moves)
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
