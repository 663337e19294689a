"""Coil circuit in the variational equations: derivatives of the currents and of the electric state.

At a fixed flux linkage the current depends on the displacement by di/dx = -emf / L and di/d lambda = 1 / L,
with L the differential inductance; the force depends on both through the current. While no current flows in a
coil without a shorted turn, the magnet sets the flux linkage, which is then not a state variable. The
derivation is in docs/tangent.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import called, compiled, inlined
from printhammer.kernel.model.circuit import BLOCKED, CHOPPED, SOURCE
from printhammer.kernel.model.layout import (
    CAPACITANCE,
    CHARGING,
    COILS,
    COUPLED,
    CURRENT_SCALE,
    ELECTRIC,
    INDUCTANCE,
    INVERSE_MASS,
    LEAKAGE,
    MAGNET,
    RESERVOIR_PIECE,
    RESISTANCE,
    SWITCHED_PIECE,
    TURN_RESISTANCE,
)
from printhammer.kernel.variational import layout as V
from printhammer.kernel.variational.slopes import CENTRAL, OFFSETS, POINTS, WEIGHTS

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import (
        Electric,
        current_at,
        driven,
        electric_rates,
        fastest_rate,
        kind_of,
        linkage_at,
        path_of,
        source_of,
        take_path,
    )
    from printhammer.kernel.model.forces import Hammer, value_at
    from printhammer.kernel.model.laws import (
        CHANGING,
        ELECTRIC_ROW,
        FORCED,
        HAS_CIRCUIT,
        magnet_emf,
        magnet_force,
        magnet_inductance,
    )
    from printhammer.kernel.variational.layout import Forcing, Setting
    from printhammer.kernel.variational.slopes import field_slope

CURRENT_SPACING = 1e-3
"""Step of difference quotients with respect to current, as a fraction of the current scale."""


@inlined
def electric_in(y: Any) -> Electric:
    """Return the electric state stored in a row of the working space; empty without a circuit."""
    if HAS_CIRCUIT:
        i = y.size - V.ELECTRICS
        return y[i], y[i + 1], y[i + 2]
    return ()


@inlined
def electric_at_node(node: Any) -> Electric:
    """Return the electric state stored in a node of the record; empty without a circuit."""
    if HAS_CIRCUIT:
        return node[ELECTRIC], node[ELECTRIC + 1], node[ELECTRIC + 2]
    return ()


@inlined
def main_linkage(electric: Electric, hammer: Hammer) -> float:
    """Return the main flux linkage [Wb], without leakage, from the electric state."""
    return float(electric[1] if hammer[TURN_RESISTANCE] > 0.0 else electric[0])


@inlined
def main_row(hammer: Hammer) -> int:
    """Return the row of a tangent column that holds the main flux linkage, without leakage."""
    return int(ELECTRIC_ROW + int(hammer[TURN_RESISTANCE] > 0.0))


@inlined
def couples(hammer: Hammer, live: Any) -> bool:
    """Whether the flux linkage can drive a current, in the coil or in a shorted turn."""
    return path_of(live) != BLOCKED or hammer[TURN_RESISTANCE] > 0.0


@compiled
def force_with_current(x: float, current: float, hammer: Hammer) -> float:
    """Return the derivative of the magnet force with respect to current [N/A]."""
    if hammer[COUPLED] != 0.0:
        return float(magnet_emf(hammer[MAGNET:], x, current))
    # A law without linked flux need not define the derivative; use differences, one-sided at the end of a
    # table.
    spacing = CURRENT_SPACING * hammer[CURRENT_SCALE]
    for turn in range(3):
        side = (CENTRAL + turn) % 3
        total = 0.0
        for i in range(POINTS[side]):
            total += WEIGHTS[side, i] * magnet_force(hammer[MAGNET:], x, current + OFFSETS[side, i] * spacing)
        if not math.isnan(total):
            return float(total / spacing)
    return math.nan


@called
def current_slopes(x: float, electric: Electric, hammer: Hammer, live: Any) -> tuple[float, float, float]:
    """Return the derivatives of the magnetising current, and of the magnet force with respect to current.

    Returns
    -------
    tuple of float
        Derivatives of the magnetising current with respect to displacement [A/m] and main flux linkage
        [A/Wb], and of the magnet force with respect to current [N/A].
    """
    if not couples(hammer, live):
        return 0.0, 0.0, 0.0
    current = current_at(x, main_linkage(electric, hammer), hammer)
    inductance, emf = hammer[INDUCTANCE], 0.0
    if hammer[COUPLED] != 0.0:
        inductance += magnet_inductance(hammer[MAGNET:], x, current)
        emf = magnet_emf(hammer[MAGNET:], x, current)
    return -emf / inductance, 1.0 / inductance, force_with_current(x, current, hammer)


@inlined
def whole_field_slope(x: float, y: Any, setting: Setting) -> float:
    """Return the derivative of magnet and spring force with respect to displacement, at fixed flux linkage.

    The derivative is in N/m; `y` is a row of the working space.
    """
    scales, bounds, hammer, live, _forcing = setting
    value = value_at(y[V.TIME], x, hammer, driven(live, electric_in(y)))
    field = field_slope(x, y[1], value, scales, bounds, hammer)
    if HAS_CIRCUIT:
        with_x, _with_linkage, force = current_slopes(x, electric_in(y), hammer, live)
        return field + force * with_x
    return field


@inlined
def coil_change(dx: float, linkage: float, turn: float, slopes: Any, hammer: Hammer, live: Any) -> float:
    """Return the change of the coil current [A] for given changes of displacement and flux linkages.

    `dx`, `linkage` and `turn` are the changes of the displacement [m] and of the flux linkages of coil and
    shorted turn [Wb]; `slopes` is the result of `current_slopes`.
    """
    if path_of(live) == BLOCKED:
        return 0.0
    if hammer[TURN_RESISTANCE] > 0.0:
        return float((linkage - turn) / hammer[LEAKAGE])
    return float(slopes[0] * dx + slopes[1] * linkage)


@called
def current_change(x: float, electric: Electric, live: Any, k: int, forcing: Forcing) -> float:
    """Return the derivative of the magnetising current with respect to constant k, at a fixed state."""
    varied = forcing.varied
    hammer = varied[k, V.MIDDLE]
    if not forcing.of_hammer[k] & V.CIRCUIT_MOVES or not couples(hammer, live):
        return 0.0
    total, linkage = 0.0, main_linkage(electric, hammer)
    for i in range(POINTS[CENTRAL]):
        other = varied[k, V.MIDDLE + int(OFFSETS[CENTRAL, i])]
        total += WEIGHTS[CENTRAL, i] * current_at(x, linkage, other)
    return float(total / V.SPACING)


@compiled
def coil_change_of(x: float, electric: Electric, live: Any, k: int, forcing: Forcing) -> float:
    """Return the derivative of the coil current with respect to constant k, at a fixed state."""
    hammer = forcing.varied[k, V.MIDDLE]
    if path_of(live) == BLOCKED:
        return 0.0
    if hammer[TURN_RESISTANCE] > 0.0:
        current = (electric[0] - electric[1]) / hammer[LEAKAGE]
        return float(-current * forcing.moves[k, LEAKAGE] / hammer[LEAKAGE])
    return current_change(x, electric, live, k, forcing)


@compiled
def linkage_change(x: float, k: int, forcing: Forcing) -> float:
    """Return the derivative of the flux linkage at zero current with respect to constant k."""
    if not forcing.of_hammer[k] & V.CIRCUIT_MOVES:
        return 0.0
    total = 0.0
    for i in range(POINTS[CENTRAL]):
        other = forcing.varied[k, V.MIDDLE + int(OFFSETS[CENTRAL, i])]
        total += WEIGHTS[CENTRAL, i] * linkage_at(x, 0.0, other)
    return float(total / V.SPACING)


@called
def add_circuit(rates: Any, y: Any, count: int, x: float, moves: bool, setting: Setting) -> None:
    """Write to `rates` the derivatives of the electric state and of the electric rows of `count` columns.

    The effect of the electric rows on the velocity is added to the velocity rows, except if `moves` is false,
    i.e. while the armature is held at rest. `y` is a row of the working space.
    """
    hammer, live = setting.hammer, setting.drive
    electric, pace, t = electric_in(y), rates[V.TIME], y[V.TIME]
    now = electric_rates(t, x, y[1], electric, hammer, live)
    for i in range(V.ELECTRICS):
        rates[y.size - V.ELECTRICS + i] = pace * now[i]
    slopes = current_slopes(x, electric, hammer, live)
    has_turn = hammer[TURN_RESISTANCE] > 0.0
    blocked, reservoir = path_of(live) == BLOCKED, kind_of(live) == RESERVOIR_PIECE
    resistance = hammer[RESISTANCE] + source_of(t, electric, hammer, live)[1]
    for k in range(count):
        j = V.FIRST_COLUMN + CHANGING * k
        e = j + CHANGING - V.ELECTRICS
        dx, linkage, turn, voltage = y[j], y[e], y[e + 1], y[e + 2]
        main = turn if has_turn else linkage
        coil = coil_change(dx, linkage, turn, slopes, hammer, live)
        turn_rate = 0.0
        if has_turn:
            turn_rate = -hammer[TURN_RESISTANCE] * (slopes[0] * dx + slopes[1] * main - coil)
        rate = turn_rate if blocked else -resistance * coil
        if reservoir and not blocked:
            rate += voltage
        voltage_rate = 0.0
        if hammer[CAPACITANCE] > 0.0:
            voltage_rate = -voltage / hammer[CHARGING] - (hammer[COILS] * coil if reservoir else 0.0)
            voltage_rate /= hammer[CAPACITANCE]
        if moves:
            rates[j + 1] += pace * slopes[2] * slopes[1] * main * hammer[INVERSE_MASS]
        rates[e], rates[e + 1], rates[e + 2] = pace * rate, pace * turn_rate, pace * voltage_rate


@compiled
def circuit_pace(x: float, y: Any, setting: Setting) -> float:
    """Return the largest rate of the linearised coil circuit and reservoir [1/s], which limits the step."""
    hammer, live, electric = setting.hammer, setting.drive, electric_in(y)
    rate = fastest_rate(x, electric, hammer, live)
    if hammer[CAPACITANCE] > 0.0:
        softness = current_slopes(x, electric, hammer, live)[1]
        rate = max(rate, math.sqrt(hammer[COILS] * softness / hammer[CAPACITANCE]))
        rate = max(rate, 1.0 / (hammer[CHARGING] * hammer[CAPACITANCE]))
    return float(rate)


@compiled
def hold_linkage(x: float, columns: Any, path: float, setting: Setting) -> None:
    """Set the flux-linkage rows of the tangent columns from the displacement rows if `path` is blocked.

    While no coil current flows, the flux linkage follows from the displacement or from the shorted turn. The
    rows of an absent shorted turn or reservoir are set to zero.
    """
    hammer = setting.hammer
    has_turn = hammer[TURN_RESISTANCE] > 0.0
    for k in range(columns.shape[1]):
        if not has_turn:
            columns[ELECTRIC_ROW + 1, k] = 0.0
        if hammer[CAPACITANCE] == 0.0:
            columns[ELECTRIC_ROW + 2, k] = 0.0
        if path == BLOCKED and has_turn:
            columns[ELECTRIC_ROW, k] = columns[ELECTRIC_ROW + 1, k]
        elif path == BLOCKED:
            emf = magnet_emf(hammer[MAGNET:], x, 0.0) if hammer[COUPLED] != 0.0 else 0.0
            columns[ELECTRIC_ROW, k] = emf * columns[0, k]
            if FORCED:
                columns[ELECTRIC_ROW, k] += linkage_change(x, k, setting.forcing)


@compiled
def threshold_change(live: Any, k: int, forcing: Forcing) -> float:
    """Return the derivative, with respect to constant k, of the coil current that ends a conduction path.

    On its present path through the driver, the coil current flows until it reaches a threshold of the
    chopper; the derivative is that of this threshold, or 0 without a chopper.
    """
    if kind_of(live) != SWITCHED_PIECE:
        return 0.0
    if path_of(live) == SOURCE:
        return float(forcing.live_moves[k, 3])
    return float(forcing.live_moves[k, 4]) if live[7] >= 0.0 else 0.0


@called
def pass_path(node: Any, after: Any, columns: Any, setting: Setting) -> bool:
    """Propagate the tangent columns through a change of the conduction path of the coil current.

    Return whether the motion is differentiable there. The coil current and all forces are continuous at the
    change; only the rate of the coil's flux linkage jumps.
    """
    hammer, live, forcing = setting.hammer, setting.drive, setting.forcing
    before, behind = node[ELECTRIC + 3], after[ELECTRIC + 3]
    if before == behind:
        return True
    t, x, v = after[0], after[1], after[2]
    electric = electric_at_node(after)
    rates = electric_rates(t, x, v, electric, hammer, live)
    off_time = kind_of(live) == SWITCHED_PIECE and live[7] < 0.0
    ends = off_time and behind == SOURCE
    slopes = current_slopes(x, electric, hammer, live)
    current_rate = coil_change(v, rates[0], rates[1], slopes, hammer, live)
    if before != BLOCKED and not ends and current_rate == 0.0:
        return False
    take_path(live, behind, math.inf)
    others = electric_rates(t, x, v, electric, hammer, live)
    take_path(live, before, math.inf)
    until = ELECTRIC_ROW + V.ELECTRICS
    for k in range(columns.shape[1]):
        later = 0.0
        if ends:
            later, columns[until, k] = columns[until, k], 0.0
        elif before != BLOCKED:
            linkage, turn = columns[ELECTRIC_ROW, k], columns[ELECTRIC_ROW + 1, k]
            ahead = coil_change(columns[0, k], linkage, turn, slopes, hammer, live)
            if FORCED:
                ahead += coil_change_of(x, electric, live, k, forcing) - threshold_change(live, k, forcing)
            later = -ahead / current_rate
            if off_time and behind == CHOPPED:
                columns[until, k] = later
                if FORCED:
                    columns[until, k] -= forcing.live_moves[k, 4]
        for i in range(V.ELECTRICS):
            columns[ELECTRIC_ROW + i, k] += (rates[i] - others[i]) * later
    hold_linkage(x, columns, behind, setting)
    return True


@compiled
def pass_edge_of_driver(after: Any, columns: Any, setting: Setting) -> None:
    """Propagate the tangent columns through an edge of the drive whose time does not vary."""
    for k in range(columns.shape[1]):
        columns[ELECTRIC_ROW + V.ELECTRICS, k] = 0.0
    hold_linkage(after[1], columns, after[ELECTRIC + 3], setting)
