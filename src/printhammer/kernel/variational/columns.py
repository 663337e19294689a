"""Variational equations between two switching events, integrated together with the motion by DOP853.

A tangent column (dx, dv, dp, ...; see `printhammer.kernel.variational.layout`) is a change of the motion at
fixed time. Off the backstop

    d(dx)/dt = dv,    d(dv)/dt = a_x dx + a_v dv + a_p dp + a_c,    dp constant,

and in contact with the backstop, with w = sqrt(b - x) and dt = 2 w ds,

    d(dx)/ds = 2 w dv,    d(dv)/ds = -a_w dx + 2 w a_v dv + 2 w a_c,

which is smooth at w = 0, where a_x = -a_w / (2 w) is not. The forcing a_c occurs only in derivatives with
respect to constants; the kernel for derivatives with respect to the initial state is compiled without it. The
derivation is in docs/tangent.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.methods.dop853_tableau import FULL_A as A
from printhammer.kernel.methods.dop853_tableau import FULL_B as B
from printhammer.kernel.methods.dop853_tableau import STAGES
from printhammer.kernel.model.layout import INVERSE_MASS, POSITION
from printhammer.kernel.model.modes import BACKSTOP, LOADING, RELOADING, RESTING, UNLOADING
from printhammer.kernel.variational import layout as V

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import driven
    from printhammer.kernel.model.forces import acceleration, backstop_acceleration
    from printhammer.kernel.model.laws import CHANGING, FORCED, HAS_BACKSTOP, HAS_CIRCUIT, HAS_PACK, MEMORY
    from printhammer.kernel.variational.circuit import (
        add_circuit,
        circuit_pace,
        electric_in,
        whole_field_slope,
    )
    from printhammer.kernel.variational.forcing import add_forcing
    from printhammer.kernel.variational.layout import Setting
    from printhammer.kernel.variational.slopes import (
        contact_slopes,
        damping_slope,
        memory_slope,
        pack_slopes,
    )
    from printhammer.kernel.variational.supply import add_supply

LONGEST_PHASE = 0.75
"""Largest phase advance [rad] of an oscillating perturbation in one step."""


@compiled
def force_slopes(
    y: Any, mode: int, memory: float, peak: float, peaks: Any, setting: Setting
) -> tuple[float, float, float, float, float, float]:
    """Return the force derivatives with respect to displacement (or w), velocity and local maximum.

    `peaks` holds the memory values for local maxima around `peak`, computed by `note_memories`.

    Returns
    -------
    tuple of float
        Derivative of magnet and spring force with respect to displacement, at fixed flux linkage in a coil
        circuit; derivatives of the contact force with respect to displacement, velocity and latest local
        maximum; derivatives of the dissipative contact force with respect to displacement and velocity. In
        the backstop, all derivatives with respect to displacement except the first are multiplied by 2 w.
    """
    scales, hammer = setting.scales, setting.hammer
    if HAS_BACKSTOP and mode == BACKSTOP:
        w = y[0]
        with_w, with_v, lost_w, lost_v = contact_slopes(w, y[1], scales, hammer)
        field = whole_field_slope(hammer[POSITION] - w * w, y, setting)
        return field, -with_w, with_v, 0.0, -lost_w, lost_v
    field = whole_field_slope(y[0], y, setting)
    push_x, push_v, push_peak = 0.0, 0.0, 0.0
    if HAS_PACK and mode in (LOADING, UNLOADING, RELOADING):
        push_x, push_v = pack_slopes(y[0], y[1], mode, memory, peak, scales, hammer)
        if MEMORY and mode != LOADING:
            push_peak = memory_slope(y[0], y[1], peak, peaks, hammer)
    return field, push_x, push_v, push_peak, push_x, push_v


@compiled
def column_rates(
    rates: Any, y: Any, columns: Any, mode: int, memory: float, peak: float, peaks: Any, setting: Setting
) -> None:
    """Write to `rates` the derivatives of displacement (or w), velocity, time and tangent columns at `y`."""
    hammer, drive, scales = setting.hammer, driven(setting.drive, electric_in(y)), setting.scales
    v = y[1]
    if HAS_CIRCUIT and mode >= RESTING:
        rates[:] = 0.0
        rates[V.TIME] = 1.0
        add_circuit(rates, y, columns.shape[1], y[0], False, setting)
        if FORCED:
            add_supply(rates, y, columns.shape[1], y[0], setting)
        return
    if HAS_BACKSTOP and mode == BACKSTOP:
        pace = 2.0 * y[0]
        rates[0] = -v
        rates[1] = pace * backstop_acceleration(y[V.TIME], y[0], v, hammer, drive)
    else:
        pace = 1.0
        rates[0] = v
        rates[1] = acceleration(y[V.TIME], y[0], v, mode, memory, hammer, drive)
    rates[V.TIME] = pace
    slopes = force_slopes(y, mode, memory, peak, peaks, setting)
    x = hammer[POSITION] - y[0] * y[0] if HAS_BACKSTOP and mode == BACKSTOP else y[0]
    by_x = (pace * slopes[0] + slopes[1]) * hammer[INVERSE_MASS]
    by_v = pace * (slopes[2] + damping_slope(x, v, scales, hammer)) * hammer[INVERSE_MASS]
    by_peak = slopes[3] * hammer[INVERSE_MASS]
    for k in range(columns.shape[1]):
        j = V.FIRST_COLUMN + CHANGING * k
        rates[j] = pace * y[j + 1]
        rates[j + 1] = by_x * y[j] + by_v * y[j + 1] + by_peak * columns[V.PEAK, k]
    if HAS_CIRCUIT:
        add_circuit(rates, y, columns.shape[1], x, True, setting)
        if FORCED:
            add_supply(rates, y, columns.shape[1], x, setting)
    if FORCED:
        add_forcing(rates, y, columns, mode, memory, slopes, setting)


@compiled
def longest_step(mode: int, memory: float, peak: float, work: Any, setting: Setting) -> float:
    """Return the largest step from the state in row START of `work` that resolves a small perturbation.

    Near rest, a perturbation may grow or oscillate while the motion is slow; the steps of the run, which
    resolve only the motion, may then be longer.
    """
    if HAS_CIRCUIT and mode >= RESTING:
        rate = circuit_pace(work[V.START, 0], work[V.START], setting)
        return LONGEST_PHASE / rate if rate > 0.0 else math.inf
    slopes = force_slopes(work[V.START], mode, memory, peak, work[V.MEMORIES], setting)
    pace = 2.0 * work[V.START, 0] if mode == BACKSTOP else 1.0
    by_x = (pace * slopes[0] + slopes[1]) * setting.hammer[INVERSE_MASS]
    place = work[V.START, 0]
    x = setting.hammer[POSITION] - place * place if mode == BACKSTOP else place
    by_v = slopes[2] + damping_slope(x, work[V.START, 1], setting.scales, setting.hammer)
    by_v *= pace * setting.hammer[INVERSE_MASS]
    rate = max(math.sqrt(abs(pace * by_x)), abs(by_v))
    if HAS_CIRCUIT:
        rate = max(rate, pace * circuit_pace(x, work[V.START], setting))
    return LONGEST_PHASE / rate if rate > 0.0 else math.inf


@compiled
def column_step(
    length: float, columns: Any, work: Any, mode: int, memory: float, peak: float, setting: Setting
) -> None:
    """Integrate state and tangent columns over one step of `length` from row START of `work`.

    The length is a time [s] or, in backstop contact, an increment of the regularised time s.
    """
    count = V.FIRST_COLUMN + CHANGING * columns.shape[1]
    if HAS_CIRCUIT:
        count = work.shape[1]
    start, y, peaks = work[V.START], work[V.STAGE], work[V.MEMORIES]
    for stage in range(STAGES):
        for i in range(count):
            y[i] = start[i]
        for j in range(stage):
            share = length * A[stage, j]
            for i in range(count):
                y[i] += share * work[j, i]
        column_rates(work[stage], y, columns, mode, memory, peak, peaks, setting)
    for j in range(STAGES):
        share = length * B[j]
        for i in range(count):
            start[i] += share * work[j, i]


@compiled
def take_in(work: Any, columns: Any) -> None:
    """Copy the rows of the tangent columns that change between switching events to row START of `work`."""
    for k in range(columns.shape[1]):
        j = V.FIRST_COLUMN + CHANGING * k
        for i in range(V.STATE):
            work[V.START, j + i] = columns[i, k]
        for i in range(CHANGING - V.STATE):
            work[V.START, j + V.STATE + i] = columns[V.ENERGY + i, k]


@compiled
def bring_back(work: Any, columns: Any) -> None:
    """Copy the rows that `take_in` has copied to row START of `work` back to the tangent columns."""
    for k in range(columns.shape[1]):
        j = V.FIRST_COLUMN + CHANGING * k
        for i in range(V.STATE):
            columns[i, k] = work[V.START, j + i]
        for i in range(CHANGING - V.STATE):
            columns[V.ENERGY + i, k] = work[V.START, j + V.STATE + i]
