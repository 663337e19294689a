"""Derivatives of the coil circuit with respect to constants: forcing of electric rows, moving edges.

At a fixed state and time, the rates of the electric state depend on the resistances, the voltages and the
current at a given flux linkage. If an edge moves to a later time, the rates before the edge apply for longer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import called, compiled
from printhammer.kernel.model.circuit import BACKWARD, BLOCKED, CHOPPED
from printhammer.kernel.model.layout import (
    CAPACITANCE,
    CHARGED,
    CHARGING,
    COILS,
    DECAY_PIECE,
    DIODE,
    END,
    RESERVOIR_PIECE,
    RESISTANCE,
    SERIES,
    SWITCHED_PIECE,
    TURN_RESISTANCE,
    Train,
)
from printhammer.kernel.variational import layout as V

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import (
        coil_current,
        electric_rates,
        kind_of,
        magnetising_current,
        path_of,
        source_of,
    )
    from printhammer.kernel.model.laws import CHANGING, ELECTRIC_ROW
    from printhammer.kernel.variational.circuit import (
        coil_change_of,
        current_change,
        electric_at_node,
        electric_in,
        hold_linkage,
    )
    from printhammer.kernel.variational.forcing import drive_change
    from printhammer.kernel.variational.layout import Forcing, Setting


@compiled
def source_changes(t: float, live: Any, k: int, forcing: Forcing) -> tuple[float, float]:
    """Return the derivatives of the source voltage and the series resistance with respect to constant k."""
    moves, pulse = forcing.moves, forcing.live_moves[k]
    kind, path = kind_of(live), path_of(live)
    if kind == SWITCHED_PIECE:
        if path == CHOPPED:
            return -moves[k, DIODE], 0.0
        return pulse[1], pulse[2]
    if kind == DECAY_PIECE:
        return (pulse[1] if path == BACKWARD else -pulse[1]), pulse[2]
    if kind == RESERVOIR_PIECE:
        return 0.0, pulse[2]
    return (drive_change(t, live, pulse) if live[0] > 0.0 else 0.0), moves[k, SERIES]


@called
def add_supply(rates: Any, y: Any, count: int, x: float, setting: Setting) -> None:
    """Add the effect of constants to the `rates` of the electric rows of the tangent columns at `y`."""
    hammer, live, forcing = setting.hammer, setting.drive, setting.forcing
    moves, pace, t, electric = forcing.moves, rates[V.TIME], y[V.TIME], electric_in(y)
    has_turn, blocked = hammer[TURN_RESISTANCE] > 0.0, path_of(live) == BLOCKED
    reservoir = kind_of(live) == RESERVOIR_PIECE and not blocked
    resistance = hammer[RESISTANCE] + source_of(t, electric, hammer, live)[1]
    coil = coil_current(x, electric, hammer, live)
    around = magnetising_current(x, electric, hammer, live) - coil
    voltage_rate = electric_rates(t, x, y[1], electric, hammer, live)[2]
    for k in range(count):
        e = V.FIRST_COLUMN + CHANGING * (k + 1) - V.ELECTRICS
        change = coil_change_of(x, electric, live, k, forcing)
        turn_rate = 0.0
        if has_turn:
            turn_rate = -moves[k, TURN_RESISTANCE] * around
            turn_rate -= hammer[TURN_RESISTANCE] * (current_change(x, electric, live, k, forcing) - change)
        rate = turn_rate
        if not blocked:
            voltage, series = source_changes(t, live, k, forcing)
            rate = voltage - (moves[k, RESISTANCE] + series) * coil - resistance * change
        rates[e] += pace * rate
        rates[e + 1] += pace * turn_rate
        if hammer[CAPACITANCE] > 0.0:
            left = hammer[CHARGED] - electric[2]
            flow = (moves[k, CHARGED] - left * moves[k, CHARGING] / hammer[CHARGING]) / hammer[CHARGING]
            if reservoir:
                flow -= moves[k, COILS] * coil + hammer[COILS] * change
            flow -= voltage_rate * moves[k, CAPACITANCE]
            rates[e + 2] += pace * flow / hammer[CAPACITANCE]


@compiled
def latest_edge(t: float, train: Train, first: int, last: int) -> tuple[int, int]:
    """Return pulse and piece indices of the latest edge not yet passed by `pass_edges`; (-1, -1) if none."""
    pulse, begun = -1, -1
    for p in range(first, last):
        piece = train.under_way[p]
        while train.pieces[piece, 1] != END and train.firings[p] + train.pieces[piece + 1, 0] <= t:
            piece += 1
            pulse, begun = p, piece
    while last < train.firings.size and train.firings[last] <= t:
        pulse, begun = last, train.begins[last]
        last += 1
    return pulse, begun


@compiled
def rates_at(node: Any, setting: Setting) -> tuple[float, float, float]:
    """Return the time derivatives of the electric state at a node, for the present drive in `setting`."""
    return electric_rates(node[0], node[1], node[2], electric_at_node(node), setting.hammer, setting.drive)


@called
def move_edge(node: Any, before: Any, pulse: int, piece: int, columns: Any, setting: Setting) -> None:
    """Propagate the columns through an edge of the driver whose time depends on constants.

    `before` holds the time derivatives of the electric state before the edge; `pulse` and `piece` are the
    indices that `latest_edge` returns.
    """
    live, forcing = setting.drive, setting.forcing
    behind = rates_at(node, setting)
    off_time = kind_of(live) == SWITCHED_PIECE and live[7] < 0.0
    until = ELECTRIC_ROW + V.ELECTRICS
    for k in range(columns.shape[1]):
        later = forcing.fire_moves[k, pulse] + forcing.piece_moves[k, piece, 0]
        for i in range(V.ELECTRICS):
            columns[ELECTRIC_ROW + i, k] += (before[i] - behind[i]) * later
        columns[until, k] = later - forcing.live_moves[k, 4] if off_time else 0.0
    hold_linkage(node[1], columns, path_of(live), setting)
