"""Integrals of power along a recorded run: the terms of the energy ledger, each integrated separately.

Each integration step is integrated by eight-point Gauss-Legendre quadrature; the state at each point is
computed by a shortened step of the integrator. In the backstop, the integration variable is the regularised
time s (dt = 2 w ds), in which the power is smooth at touch and at separation.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, entry
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.circuit import BLOCKED, CHOPPED
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    CAPACITANCE,
    CHARGED,
    CHARGING,
    COILS,
    DECAY_PIECE,
    FRONT,
    INVERSE_MASS,
    MAGNET,
    MOST_LEVELS,
    PACK,
    POSITION,
    RESERVOIR_PIECE,
    RESISTANCE,
    SPRING,
    TURN_RESISTANCE,
    Train,
)

if TYPE_CHECKING:
    from printhammer.kernel.methods.contact import contact_rate, s_at
    from printhammer.kernel.methods.dop853 import contact_end
    from printhammer.kernel.model.circuit import (
        coil_current,
        driven,
        kind_of,
        magnetising_current,
        path_of,
        source_of,
    )
    from printhammer.kernel.model.forces import Hammer, friction, pack_force, value_at, viscous_force
    from printhammer.kernel.model.laws import (
        FORCE_DRIVE,
        FRICTION,
        HAS_CIRCUIT,
        RIGID_FRONT,
        VISCOUS,
        backstop_energy,
        backstop_viscous,
        magnet_force,
        spring_level,
    )
    from printhammer.kernel.model.pulses import Drive, edges_at, pass_edges
    from printhammer.kernel.single.resample import drive_at, memory_of, state_in_step

POINTS = (
    0.9602898564975363,
    0.7966664774136267,
    0.525532409916329,
    0.1834346424956498,
)
"""Positive points of the eight-point Gauss-Legendre quadrature."""
WEIGHTS = (
    0.10122853629037626,
    0.22238103445337448,
    0.31370664587788727,
    0.362683783378362,
)
"""Weights of the `POINTS` of the eight-point Gauss-Legendre quadrature."""


@compiled
def powers(
    t: float, x: float, v: float, w: float, mode: int, memory: float, hammer: Hammer, drive: Drive
) -> tuple[float, float, float, float, float]:
    """Return five powers [W]: of coil, drive force, and losses in pack, backstop and damping."""
    value = value_at(t, x, hammer, drive)
    coil = 0.0
    force = 0.0
    if FORCE_DRIVE:
        force = value * v
    else:
        c = hammer[MAGNET:]
        coil = (magnet_force(c, x, value) - magnet_force(c, x, 0.0)) * v
    pack = -pack_force(x, v, mode, memory, hammer) * v
    backstop = 0.0
    if mode == M.BACKSTOP:
        backstop = -backstop_viscous(hammer[BACKSTOP_PART:MAGNET], w, v) * v
    damping = -viscous_force(x, v, hammer) * v
    if FRICTION:
        damping -= friction(mode, memory, hammer) * v
    return coil, force, pack, backstop, damping


@compiled
def electric_powers(t: float, x: float, hammer: Hammer, drive: Drive) -> tuple[float, float, float, float]:
    """Return four powers [W]: of the supply, and of the losses in coil, driver and shorted turn.

    Losses in the supply's internal resistance and in the diodes are counted as driver losses.
    """
    live, electric = drive
    current = coil_current(x, electric, hammer, live)
    turn = 0.0
    if hammer[TURN_RESISTANCE] > 0.0:
        around = magnetising_current(x, electric, hammer, live) - current
        turn = hammer[TURN_RESISTANCE] * around * around
    supply, driver = 0.0, 0.0
    if hammer[CAPACITANCE] > 0.0:
        # Count the share of one coil in a reservoir that several coils share.
        charging = (hammer[CHARGED] - electric[2]) / hammer[CHARGING]
        supply += hammer[CHARGED] * charging / hammer[COILS]
        driver += hammer[CHARGING] * charging * charging / hammer[COILS]
    if path_of(live) == BLOCKED:
        return supply, 0.0, driver, turn
    voltage, series = source_of(t, electric, hammer, live)
    kind = kind_of(live)
    if kind == DECAY_PIECE:
        supply += live[6] * voltage * current
        driver -= (1.0 - live[6]) * voltage * current
    elif path_of(live) == CHOPPED:
        driver -= voltage * current
    elif kind != RESERVOIR_PIECE:
        supply += voltage * current
    driver += series * current * current
    return supply, hammer[RESISTANCE] * current * current, driver, turn


@compiled
def energy_behind(x: float, hammer: Hammer) -> float:
    """Return the elastic energy [J] stored in the backstop at displacement `x` [m]; 0 off the backstop."""
    return backstop_energy(hammer[BACKSTOP_PART:MAGNET], math.sqrt(max(hammer[POSITION] - x, 0.0)))


@compiled
def kink_side(node: Any, after: Any, hammer: Hammer) -> float:
    """Return 1 if a step off the backstop begins on a kink of the spring law, -1 if it ends on one, else 0.

    Beyond the kink, the dissipative force of a contact may be a fractional power of the distance, hence of
    the time. As a function of the square root of the time since, or until, the kink, the power is smooth.
    """
    if int(node[3]) == M.BACKSTOP:
        return 0.0
    side = 0.0
    for k in range(MOST_LEVELS):
        level = spring_level(hammer[SPRING:PACK], float(k))
        if math.isinf(level):
            break
        if node[1] == level:
            return 1.0
        if after[1] == level:
            side = -1.0
    return side


@entry
def quadratures(
    steps: Any,
    starts: Any,
    ends: Any,
    nodes: Any,
    train: Any,
    hammer: Hammer,
    out: Any,
) -> None:
    """Integrate the powers over n intervals of a run; write work and losses [J] to the rows of `out`.

    The columns of `out`, shape (n, 5), are the work of the coil, the work of the drive force, and the losses
    in pack, backstop and damping. With a coil circuit, `out` has the shape (n, 9); the four additional
    columns are the work of the supply and the losses in coil, driver and shorted turn.

    Parameters
    ----------
    steps : int64 array, shape (n,)
        Index of the node at which the step of each interval begins; ascending.
    starts, ends : float64 array, shape (n,)
        Start and end time of each interval [s], inside its step.
    nodes, train, hammer
        As in :func:`printhammer.kernel.single.resample.resample`.
    """
    train = Train(*train)
    first, last = 0, 0
    for row in range(steps.size):
        i = steps[row]
        if row == 0:
            first, last, _edge = edges_at(nodes[i, 0], train)
        t0, x0, v0, mode, kept = nodes[i, 0], nodes[i, 1], nodes[i, 2], int(nodes[i, 3]), nodes[i, 4]
        first, last, _edge = pass_edges(t0, train, first, last)
        for j in range(out.shape[1]):
            out[row, j] = 0.0
        if i + 1 < nodes.shape[0] and nodes[i + 1, 0] == t0 and nodes[i + 1, 1] == x0:
            # Two nodes at the same time and place are the two sides of an impact on a rigid surface.
            lost = 0.5 * (v0 * v0 - nodes[i + 1, 2] * nodes[i + 1, 2]) / hammer[INVERSE_MASS]
            if RIGID_FRONT and x0 == hammer[FRONT]:
                out[row, 2] = lost
            else:
                out[row, 3] = lost if mode != M.BACKSTOP and x0 != hammer[FRONT] else 0.0
            continue
        resting = mode >= M.RESTING
        if (resting and not HAS_CIRCUIT) or ends[row] <= starts[row]:
            continue
        memory = memory_of(mode, kept, hammer)
        start = drive_at(nodes[i], train.live)
        kv0 = contact_rate(kept, v0, t0, hammer, start) if mode == M.BACKSTOP else 0.0
        regular = mode == M.BACKSTOP and not (kept == 0.0 and v0 == 0.0)
        low, high = starts[row], ends[row]
        if regular:
            low = s_at(starts[row], t0, kept, v0, kv0, hammer, start)
            high = s_at(ends[row], t0, kept, v0, kv0, hammer, start)
        side = 0.0
        if VISCOUS:
            side = kink_side(nodes[i], nodes[min(i + 1, nodes.shape[0] - 1)], hammer)
            if side != 0.0:
                kink = t0 if side > 0.0 else nodes[i + 1, 0]
                low = side * math.sqrt(max(side * (starts[row] - kink), 0.0))
                high = side * math.sqrt(max(side * (ends[row] - kink), 0.0))
        for j in range(8):
            point = POINTS[j] if j < 4 else -POINTS[j - 4]
            weight = WEIGHTS[j] if j < 4 else WEIGHTS[j - 4]
            place = 0.5 * (low + high) + 0.5 * (high - low) * point
            share = 0.5 * (high - low) * weight
            if regular:
                t, w, v, _kv, electric = contact_end(t0, kept, v0, kv0, place, hammer, start)
                x = hammer[POSITION] - w * w
                share *= 2.0 * w
            else:
                t = place
                if VISCOUS and side != 0.0:
                    t = kink + side * place * place
                    share *= 2.0 * side * place
                x, v, w, electric = state_in_step(t, t0, x0, v0, mode, kept, hammer, start)
            drive = driven(train.live, electric)
            coil, force, pack, backstop, damping = powers(t, x, v, w, mode, memory, hammer, drive)
            out[row, 0] += share * coil
            out[row, 1] += share * force
            out[row, 2] += share * pack
            out[row, 3] += share * backstop
            out[row, 4] += share * damping
            if HAS_CIRCUIT:
                terms = electric_powers(t, x, hammer, drive)
                for k in range(4):
                    out[row, 5 + k] += share * terms[k]
        if mode == M.BACKSTOP_RELEASED:
            # The energy still stored in a released backstop is dissipated while the backstop recovers.
            first_x, _v, _w, _electric = state_in_step(low, t0, x0, v0, mode, kept, hammer, start)
            last_x, _v, _w, _electric = state_in_step(high, t0, x0, v0, mode, kept, hammer, start)
            out[row, 3] = energy_behind(first_x, hammer) - energy_behind(last_x, hammer)
