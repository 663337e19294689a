"""Tangent columns propagated along a recorded run, in a second pass over the nodes of its record.

Runs without derivatives therefore have no overhead.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, entry
from printhammer.kernel.model.layout import (
    CHARGED,
    CURRENT_SCALE,
    ELECTRIC,
    LINKAGE_SCALE,
    POSITION,
    RESISTANCE,
    Train,
)
from printhammer.kernel.model.modes import BACKSTOP, RELOADING, UNLOADING
from printhammer.kernel.variational.layout import (
    DUE,
    ELECTRICS,
    ENERGY,
    GROWN,
    PEAK,
    SMOOTH,
    START,
    STATE,
    Forcing,
    Setting,
)

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import take_path
    from printhammer.kernel.model.forces import Hammer
    from printhammer.kernel.model.laws import ELECTRIC_ROW, FORCED, HAS_CIRCUIT, HAS_PACK, LEVELS, MEMORY
    from printhammer.kernel.model.pulses import edges_at, pass_edges
    from printhammer.kernel.single.resample import branch_of
    from printhammer.kernel.variational.circuit import hold_linkage, pass_edge_of_driver, pass_path
    from printhammer.kernel.variational.forcing import set_live_moves
    from printhammer.kernel.variational.layout import Carried
    from printhammer.kernel.variational.slopes import smooth_bounds
    from printhammer.kernel.variational.steps import begin_step, carry
    from printhammer.kernel.variational.supply import latest_edge, move_edge, rates_at
    from printhammer.kernel.variational.switches import (
        is_departure,
        leave_at_edge,
        pass_moving_edges,
        pass_node,
    )


@compiled
def copy_columns(columns: Any, out: Any) -> None:
    """Copy all elements of a column array to another array of the same shape."""
    for i in range(columns.shape[0]):
        for k in range(columns.shape[1]):
            out[i, k] = columns[i, k]


@compiled
def unit_of(row: int, scales: Any, hammer: Hammer) -> float:
    """Return the scale of a state component, in SI units, given its row in a column without forcing."""
    if row < ENERGY:
        return float(scales[1] if row == 1 else scales[0])
    if row < ELECTRIC_ROW + 2:
        return float(hammer[LINKAGE_SCALE])
    if row == ELECTRIC_ROW + 2:
        return float(max(hammer[CHARGED], hammer[RESISTANCE] * hammer[CURRENT_SCALE]))
    return float(scales[0] / scales[1])


@compiled
def orthonormalise_with_circuit(columns: Any, scales: Any, hammer: Hammer, grown: Any) -> None:
    """Orthonormalise the columns like `orthonormalise`, including the electric components."""
    count = columns.shape[0]
    for k in range(columns.shape[1]):
        for i in range(count):
            columns[i, k] /= unit_of(i, scales, hammer)
        for j in range(k):
            shared = 0.0
            for i in range(count):
                shared += columns[i, j] * columns[i, k]
            for i in range(count):
                columns[i, k] -= shared * columns[i, j]
        square = 0.0
        for i in range(count):
            square += columns[i, k] * columns[i, k]
        grown[k] = grown[k] + 0.5 * math.log(square) if square > 0.0 else -math.inf
        for i in range(count):
            columns[i, k] = columns[i, k] / math.sqrt(square) if square > 0.0 else 0.0
        if square == 0.0:
            columns[0, k] = -columns[1, k - 1] if k > 0 else 1.0
            columns[1, k] = columns[0, k - 1] if k > 0 else 0.0
    for k in range(columns.shape[1]):
        for i in range(count):
            columns[i, k] *= unit_of(i, scales, hammer)


@compiled
def orthonormalise(columns: Any, scales: Any, grown: Any) -> None:
    """Orthonormalise the columns, scaled by `scales`; add the logarithms of their lengths to `grown`.

    The method is Gram-Schmidt. A column that depends linearly on the earlier columns is replaced, and its
    growth is set to minus infinity.
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
            # Replace it by a vector orthogonal to the preceding column, or along x if it is the first.
            columns[0, k] = -columns[1, k - 1] if k > 0 else 1.0
            columns[1, k] = columns[0, k - 1] if k > 0 else 0.0
            columns[2, k] = 0.0
    for k in range(columns.shape[1]):
        columns[0, k] *= scales[0]
        columns[1, k] *= scales[1]
        columns[2, k] *= scales[0]


@compiled
def note_mark(node: Any, initial: Any, setting: Setting, carried: Carried) -> None:
    """Store state, tangent columns and growth at an output time; at the first, initialise the columns."""
    columns, work, track, states, changes, growth, _passed = carried
    hammer = setting.hammer
    mode = int(node[3])
    row = int(track[DUE])
    remembers = HAS_PACK and MEMORY and branch_of(mode) in (UNLOADING, RELOADING)
    place = work[START, 0]
    states[row, 0] = hammer[POSITION] - place * place if mode == BACKSTOP else place
    states[row, 1], states[row, 2] = work[START, 1], mode
    states[row, 3] = node[4] if remembers else 0.0
    if HAS_CIRCUIT:
        for i in range(ELECTRICS):
            states[row, STATE + 2 + i] = work[START, work.shape[1] - ELECTRICS + i]
        states[row, STATE + 2 + ELECTRICS] = node[ELECTRIC + 3]
    for k in range(columns.shape[1]):
        if row == 0:
            for i in range(columns.shape[0]):
                columns[i, k] = initial[i, k] if i < STATE or (i == PEAK and remembers) else 0.0
            if HAS_CIRCUIT:
                for i in range(ELECTRICS):
                    columns[ELECTRIC_ROW + i, k] = initial[ENERGY + i, k]
            track[GROWN + k] = 0.0
        growth[row, k] = track[GROWN + k]
        track[GROWN + k] = 0.0
    if HAS_CIRCUIT and row == 0:
        hold_linkage(states[row, 0], columns, node[ELECTRIC + 3], setting)
    copy_columns(columns, changes[row])
    track[DUE] += 1.0


@compiled
def scale_or_note(factor: float, renormalise: bool, columns: Any, setting: Setting, grown: Any) -> None:
    """Multiply the columns by exp(`factor`) or, with `renormalise`, orthonormalise the columns.

    With `renormalise`, `factor` is added to the logarithms of growth, `grown`.
    """
    if renormalise:
        for k in range(columns.shape[1]):
            grown[k] += factor
        if HAS_CIRCUIT:
            orthonormalise_with_circuit(columns, setting.scales, setting.hammer, grown)
        else:
            orthonormalise(columns, setting.scales, grown)
    elif factor != 0.0:
        for k in range(columns.shape[1]):
            for i in range(columns.shape[0] if HAS_CIRCUIT else 3):
                columns[i, k] *= math.exp(factor)


@entry
def flow(
    nodes: Any,
    train: Any,
    hammer: Hammer,
    scales: Any,
    bounds: Any,
    forced_by: Any,
    marks: Any,
    wanted: Any,
    renormalise: bool,
    ended: bool,
    initial: Any,
    carried: Carried,
) -> None:
    """Propagate tangent columns along a segment of a run, from the first output time to the last.

    Parameters
    ----------
    nodes, train, hammer
        Nodes recorded by :func:`printhammer.kernel.single.run.run`, and the pulse train and parameter array
        that were passed to it.
    scales : tuple of float
        Scales of displacement [m] and velocity [m/s].
    bounds : tuple of float
        Bounds of the displacement, as in :class:`printhammer.kernel.single.carry.Setup`.
    forced_by : tuple
        Fields of :class:`printhammer.kernel.variational.layout.Forcing` as a plain tuple; empty without
        derivatives with respect to constants.
    marks : float64 array, shape (m,)
        Times at which to store the columns, ascending [s]; at a switching event, the state after the event.
    wanted : int64 array, shape (q,)
        Indices of the nodes at which to store the columns before and after the event, ascending.
    renormalise : bool
        Whether to orthonormalise the columns at every node, and record their growth.
    ended : bool
        Whether the run ends with this segment; otherwise a mark at the end belongs to the next segment.
    initial : float64 array, shape (3, n), with a circuit (6, n)
        Initial columns at the first mark: changes of displacement, velocity and latest local maximum; with a
        circuit, also of the electric state.
    carried : Carried
        Columns, working space and output arrays.
    """
    train = Train(*train)
    # Without forcing, pass an empty tuple: passing the unused arrays alone would take 10 % more time.
    forcing: Any = ()
    if FORCED:
        forcing = Forcing(*forced_by)
    setting = Setting(scales, smooth_bounds(nodes[0], nodes[0], bounds, hammer), hammer, train.live, forcing)
    columns, work, track, passed = carried.columns, carried.work, carried.track, carried.passed
    count = nodes.shape[0]
    asked = 0
    first, last, _edge = edges_at(nodes[0, 0], train)
    if FORCED:
        set_live_moves(first, last, train, forcing)
    grown = track[GROWN:]
    for i in range(count):
        due = int(track[DUE])
        if due == marks.size:
            return
        node = nodes[i]
        after = nodes[min(i + 1, count - 1)]
        final = i + 1 == count
        if LEVELS:
            setting = Setting(scales, smooth_bounds(node, after, bounds, hammer), hammer, train.live, forcing)
        t_end = after[0]
        pulse, piece = -1, -1
        if FORCED and due > 0:
            if HAS_CIRCUIT and train.replace:
                pulse, piece = latest_edge(node[0], train, first, last)
                before = rates_at(node, setting)
            elif not HAS_CIRCUIT and is_departure(nodes[max(i - 1, 0)], node):
                pulse, piece = latest_edge(node[0], train, first, last)
            else:
                pass_moving_edges(node, train, first, last, columns, setting)
        first, last, edge = pass_edges(node[0], train, first, last)
        if HAS_CIRCUIT:
            take_path(train.live, node[ELECTRIC + 3], math.inf)
        if FORCED:
            set_live_moves(first, last, train, forcing)
            if HAS_CIRCUIT and pulse >= 0:
                move_edge(node, before, pulse, piece, columns, setting)
            elif pulse >= 0:
                leave_at_edge(node, pulse, piece, columns, setting)
        begin_step(node, work)
        # A mark at a time shared by several nodes belongs to the last of these nodes.
        while due < marks.size and (marks[due] < t_end or (final and ended and marks[due] == t_end)):
            factor = carry(marks[due], node, after, columns, work, setting)
            scale_or_note(factor, renormalise, columns, setting, grown)
            note_mark(node, initial, setting, carried)
            due += 1
        if due in (0, marks.size) or final:
            continue
        factor = carry(t_end, node, after, columns, work, setting)
        asked_now = asked < wanted.size and wanted[asked] == i + 1
        if asked_now:
            copy_columns(columns, passed[asked, 0])
        if not pass_node(node, after, columns, setting):
            track[SMOOTH] = 0.0
        # The last node of an ended run already has the conduction path of the next segment: skip it.
        if HAS_CIRCUIT and not (ended and i + 2 == count):
            if t_end >= edge:
                pass_edge_of_driver(after, columns, setting)
            elif not pass_path(node, after, columns, setting):
                track[SMOOTH] = 0.0
        if asked_now:
            copy_columns(columns, passed[asked, 1])
            asked += 1
        scale_or_note(factor, renormalise, columns, setting, grown)
