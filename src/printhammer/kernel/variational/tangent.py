"""The tangent flow along a recorded run: variations carried from step to step and through all switches.

At a switch the variation jumps, because a neighbouring motion meets it a little earlier or later and spends
that time under the other law; the derivation is in docs/tangent.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, entry
from printhammer.kernel.model.layout import BACKSTOP_PART, FRONT, MAGNET, POSITION
from printhammer.kernel.model.modes import (
    BACKSTOP,
    BACKSTOP_RELEASED,
    FREE,
    HELD,
    LOADING,
    PACK_RELEASED,
    RELOADING,
    UNLOADING,
)
from printhammer.kernel.variational.variation import START

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import Hammer, acceleration, backstop_acceleration
    from printhammer.kernel.model.laws import HAS_PACK, MEMORY, RIGID, backstop_rebound
    from printhammer.kernel.model.pulses import Drive, edges_at, pass_edges
    from printhammer.kernel.single.resample import branch_of, memory_of
    from printhammer.kernel.variational.variation import begin_step, vary

SPEED_SPACING = 1e-3
"""Share of the speed of an impact by which it is moved to see what a rebound makes of it."""
NEAR = 1e-9
"""Share of an indentation by which a reversal must miss the old maximum to be told from one at it."""

# Places in `track`.
DUE = 0
"""Number of the next mark."""
SMOOTH = 1
"""Whether the map is differentiable so far, 1 or 0."""
GROWN = 2
"""From here on: logarithms of growth since the latest mark."""


@compiled
def acceleration_at(node: Any, mode: int, kept: float, v: float, hammer: Hammer, drive: Drive) -> float:
    """Return the acceleration [m/s^2] at a node under the law of `mode`."""
    if mode == BACKSTOP:
        return backstop_acceleration(node[0], 0.0, v, hammer, drive)
    return acceleration(node[0], node[1], v, mode, memory_of(mode, kept, hammer), hammer, drive)


@compiled
def is_rebound(node: Any, after: Any) -> bool:
    """Tell whether two nodes are the two sides of an impact on a rigid backstop."""
    return RIGID and node[0] == after[0] and int(node[3]) == FREE and node[2] < 0.0 and after[2] >= 0.0


@compiled
def pass_rebound(node: Any, after: Any, columns: Any, hammer: Hammer, drive: Drive) -> None:
    """Carry the columns through an impact on a rigid backstop."""
    c = hammer[BACKSTOP_PART:MAGNET]
    v_in, v_out = node[2], after[2]
    spacing = -SPEED_SPACING * v_in
    slope = (
        8.0 * (backstop_rebound(c, v_in + spacing) - backstop_rebound(c, v_in - spacing))
        - (backstop_rebound(c, v_in + 2.0 * spacing) - backstop_rebound(c, v_in - 2.0 * spacing))
    ) / (12.0 * spacing)
    a = acceleration(node[0], node[1], v_in, FREE, 0.0, hammer, drive)
    for k in range(columns.shape[1]):
        earlier = columns[0, k] / v_in
        columns[0, k] = earlier * v_out
        columns[1, k] = slope * columns[1, k] + (1.0 - slope) * a * earlier


@compiled
def pass_reversal(
    node: Any, after: Any, mode: int, following: int, columns: Any, hammer: Hammer, drive: Drive
) -> bool:
    """Carry the columns through a reversal inside the pack; tell whether that is differentiable."""
    before = acceleration_at(after, mode, node[4], 0.0, hammer, drive)
    behind = acceleration_at(after, following, after[4], 0.0, hammer, drive)
    # Along the unloading curve: the old maximum is met without velocity.
    if before == 0.0 or (mode == RELOADING and node[4] - after[1] <= NEAR * (node[4] - hammer[FRONT])):
        return False
    new_peak = following == UNLOADING and (mode == LOADING or after[4] != node[4])
    for k in range(columns.shape[1]):
        columns[1, k] *= behind / before
        if new_peak:
            columns[2, k] = columns[0, k]
        elif following == LOADING:
            columns[2, k] = 0.0
    return True


@compiled
def pass_level(
    node: Any, after: Any, mode: int, following: int, columns: Any, hammer: Hammer, drive: Drive
) -> bool:
    """Carry the columns through a touch, a leaving or the old maximum; tell whether differentiable."""
    v = after[2]
    if v == 0.0:
        return False
    before = acceleration_at(after, mode, node[4], v, hammer, drive)
    behind = acceleration_at(after, following, after[4], v, hammer, drive)
    for k in range(columns.shape[1]):
        ahead = columns[0, k] - (columns[2, k] if mode == RELOADING else 0.0)
        columns[1, k] += (behind - before) * ahead / v
        columns[2, k] = 0.0
    return True


@compiled
def pass_node(node: Any, after: Any, columns: Any, hammer: Hammer, drive: Drive) -> bool:
    """Carry the columns through the switch at the node `after`, if it is one; tell whether differentiable."""
    if is_rebound(node, after):
        pass_rebound(node, after, columns, hammer, drive)
        return True
    mode, following = branch_of(int(node[3])), branch_of(int(after[3]))
    mode = BACKSTOP if mode == HELD else mode
    following = BACKSTOP if following == HELD else following
    in_pack = HAS_PACK and mode in (LOADING, UNLOADING, RELOADING)
    if in_pack and following in (LOADING, UNLOADING, RELOADING):
        if mode == following and (mode != UNLOADING or node[4] == after[4]):
            return True
        if mode == RELOADING and following == LOADING:
            return pass_level(node, after, mode, following, columns, hammer, drive)
        return pass_reversal(node, after, mode, following, columns, hammer, drive)
    touches = mode == FREE and following in (LOADING, BACKSTOP)
    leaves = following == FREE and (in_pack or mode in (PACK_RELEASED, BACKSTOP, BACKSTOP_RELEASED))
    if touches or leaves:
        return pass_level(node, after, mode, following, columns, hammer, drive)
    # Edges of the drive lie at fixed times; where a contact lets go or takes hold its force is zero.
    return True


@compiled
def orthonormalise(columns: Any, scales: Any, grown: Any) -> None:
    """Make the columns orthogonal and of length one, in units of `scales`; add what was taken to `grown`.

    Gram-Schmidt; a column of which nothing is left is replaced and counts as shrunk without bound.
    """
    for k in range(columns.shape[1]):
        columns[0, k] /= scales[0]
        columns[1, k] /= scales[1]
        columns[2, k] /= scales[0]
        for j in range(k):
            shared = 0.0
            for i in range(3):
                shared += columns[i, j] * columns[i, k]
            for i in range(3):
                columns[i, k] -= shared * columns[i, j]
        length = math.sqrt(columns[0, k] ** 2 + columns[1, k] ** 2 + columns[2, k] ** 2)
        if length > 0.0:
            grown[k] += math.log(length)
            for i in range(3):
                columns[i, k] /= length
        else:
            grown[k] = -math.inf
            # Across the column before it, or along x.
            columns[0, k] = -columns[1, k - 1] if k > 0 else 1.0
            columns[1, k] = columns[0, k - 1] if k > 0 else 0.0
            columns[2, k] = 0.0
    for k in range(columns.shape[1]):
        columns[0, k] *= scales[0]
        columns[1, k] *= scales[1]
        columns[2, k] *= scales[0]


@compiled
def note_mark(
    found: Any, track: Any, node: Any, initial: Any, columns: Any, work: Any, hammer: Hammer
) -> None:
    """Enter state and growth at a mark in its row of `found`; at the first mark the columns begin."""
    mode = int(node[3])
    row = int(track[DUE])
    remembers = HAS_PACK and MEMORY and branch_of(mode) in (UNLOADING, RELOADING)
    place = work[START, 0]
    found[row, 0] = hammer[POSITION] - place * place if mode == BACKSTOP else place
    found[row, 1], found[row, 2] = work[START, 1], mode
    found[row, 3] = node[4] if remembers else 0.0
    for k in range(columns.shape[1]):
        if row == 0:
            columns[0, k], columns[1, k] = initial[0, k], initial[1, k]
            columns[2, k] = initial[2, k] if remembers else 0.0
            track[GROWN + k] = 0.0
        found[row, 4 + k] = track[GROWN + k]
        track[GROWN + k] = 0.0
    track[DUE] += 1.0


@compiled
def scale_or_note(factor: float, renormalise: bool, columns: Any, scales: Any, grown: Any) -> None:
    """Put a factor, given by its logarithm, back into the columns, or note it with their growth."""
    if renormalise:
        for k in range(columns.shape[1]):
            grown[k] += factor
        orthonormalise(columns, scales, grown)
    elif factor != 0.0:
        for k in range(columns.shape[1]):
            for i in range(3):
                columns[i, k] *= math.exp(factor)


@entry
def tangent(
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
    marks: Any,
    renormalise: bool,
    ended: bool,
    initial: Any,
    columns: Any,
    work: Any,
    track: Any,
    found: Any,
) -> None:
    """Carry columns along a stretch of a run, from the first mark to the last.

    Parameters
    ----------
    nodes, firings, begins, pieces, replace, under_way, live, hammer
        As recorded and given in :func:`printhammer.kernel.single.run.run`.
    scales : tuple of float
        Scales of displacement and velocity.
    bounds : tuple of float
        As in :func:`printhammer.kernel.single.run.run`.
    marks : float64 array, shape (m,)
        Ascending times [s]; at an instant of a switch: after it.
    renormalise : bool
        Whether to make the columns orthonormal at every node and to note their growth instead.
    ended : bool
        Whether the run ends with the stretch; otherwise a mark at its end belongs to the next one.
    initial : float64 array, shape (3, n)
        Variations of displacement, velocity and latest local maximum at the first mark.
    columns : float64 array, shape (3, n)
        Those at the end of the stretch or at the last mark.
    work : float64 array, shape (15, 5 or more)
        Working space, see :mod:`printhammer.kernel.variational.variation`.
    track : float64 array, shape (2 + n,)
        Zeros, but one at place 1, before the first stretch; what is needed to go on afterwards.
    found : float64 array, shape (m, 4 + n)
        Displacement, velocity, mode and latest local maximum at the marks, and the logarithms of the growth
        of the columns since the mark before.
    """
    count = nodes.shape[0]
    first, last, _edge = edges_at(nodes[0, 0], firings, begins, pieces, replace, under_way, live)
    grown = track[GROWN:]
    for i in range(count):
        due = int(track[DUE])
        if due == marks.size:
            return
        node = nodes[i]
        after = nodes[min(i + 1, count - 1)]
        final = i + 1 == count
        t_end = after[0]
        first, last, _edge = pass_edges(
            node[0], firings, begins, pieces, replace, under_way, first, last, live
        )
        begin_step(node, work)
        # A mark at the time of several nodes belongs to the last of them.
        while due < marks.size and (marks[due] < t_end or (final and ended and marks[due] == t_end)):
            factor = vary(marks[due], node, after, columns, work, scales, bounds, hammer, live)
            scale_or_note(factor, renormalise, columns, scales, grown)
            note_mark(found, track, node, initial, columns, work, hammer)
            due += 1
        if due in (0, marks.size) or final:
            continue
        factor = vary(t_end, node, after, columns, work, scales, bounds, hammer, live)
        if not pass_node(node, after, columns, hammer, live):
            track[SMOOTH] = 0.0
        scale_or_note(factor, renormalise, columns, scales, grown)
