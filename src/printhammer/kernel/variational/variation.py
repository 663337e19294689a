"""The variational equations between two switches, integrated together with the motion by DOP853.

A column is a variation (dx, dv, dp) of displacement [m], velocity [m/s] and latest local maximum in the pack
[m], all at one time. Off the backstop

    d(dx)/dt = dv,    d(dv)/dt = a_x dx + a_v dv + a_p dp,    dp constant,

and in the backstop, with w = sqrt(b - x) and dt = 2 w ds,

    d(dx)/ds = 2 w dv,    d(dv)/ds = -a_w dx + 2 w a_v dv,

which is smooth where a_x = -a_w / (2 w) is not. The derivation is in docs/tangent.md.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.methods import dop853_tableau as T
from printhammer.kernel.model.layout import FRONT, INVERSE_MASS, POSITION
from printhammer.kernel.model.modes import (
    ANY_SCALES,
    BACKSTOP,
    FREE,
    HELD,
    HELD_LOADING,
    HELD_UNLOADING,
    LOADING,
    RELOADING,
    RESTING,
    UNLOADING,
)

if TYPE_CHECKING:
    from printhammer.kernel.methods.contact import contact_rate
    from printhammer.kernel.methods.dop853 import contact_step
    from printhammer.kernel.model.forces import Hammer, acceleration, backstop_acceleration
    from printhammer.kernel.model.laws import HAS_BACKSTOP, HAS_PACK, MEMORY
    from printhammer.kernel.model.pulses import Drive, drive_value
    from printhammer.kernel.model.slopes import (
        contact_slopes,
        field_slope,
        memory_slope,
        note_memories,
        pack_slopes,
    )
    from printhammer.kernel.single.resample import length_of, memory_of

STAGES = 12
A = np.array(
    [[getattr(T, f"A{i:02d}_{j:02d}", 0.0) for j in range(1, STAGES + 1)] for i in range(1, STAGES + 1)]
)
B = np.array([getattr(T, f"B{j:02d}", 0.0) for j in range(1, STAGES + 1)])

START, STAGE, MEMORIES = STAGES, STAGES + 1, STAGES + 2
WORK_ROWS = STAGES + 3
"""Rows of the working space: slopes of the stages, state at the start, state at a stage, memories."""
FIRST_COLUMN = 3
"""Place of the first column in a row of the working space, after displacement or w, velocity and time."""

GRADING = 1.0 / 64.0
"""Shortest share of a step after a touch of the pack, whose slope is not smooth there."""

LONGEST_PHASE = 0.75
"""Largest phase in one step of the oscillation that a change of the state makes."""


def work_width(columns: int) -> int:
    """Return the length of the rows of the working space."""
    return max(FIRST_COLUMN + 2 * columns, 5)


@compiled
def variation_slopes(
    y: Any,
    mode: int,
    memory: float,
    peak: float,
    memories: Any,
    scales: Any,
    bounds: Any,
    hammer: Hammer,
    drive: Drive,
) -> tuple[float, float, float]:
    """Return the factors of dx, dv and dp in the rate of dv at `y`."""
    value = drive_value(y[2], drive)
    if HAS_BACKSTOP and mode == BACKSTOP:
        w = y[0]
        with_w, with_v = contact_slopes(w, y[1], scales, hammer)
        field = field_slope(hammer[POSITION] - w * w, value, scales, bounds, hammer)
        return (2.0 * w * field - with_w) * hammer[INVERSE_MASS], 2.0 * w * with_v * hammer[INVERSE_MASS], 0.0
    by_x = field_slope(y[0], value, scales, bounds, hammer)
    by_v, by_peak = 0.0, 0.0
    if HAS_PACK and mode in (LOADING, UNLOADING, RELOADING):
        pack_x, by_v = pack_slopes(y[0], y[1], mode, memory, peak, scales, hammer)
        by_x += pack_x
        if MEMORY and mode != LOADING:
            by_peak = memory_slope(y[0], y[1], peak, memories, hammer)
    return by_x * hammer[INVERSE_MASS], by_v * hammer[INVERSE_MASS], by_peak * hammer[INVERSE_MASS]


@compiled
def variation_rates(
    rates: Any,
    y: Any,
    columns: Any,
    mode: int,
    memory: float,
    peak: float,
    memories: Any,
    scales: Any,
    bounds: Any,
    hammer: Hammer,
    drive: Drive,
) -> None:
    """Fill `rates` with the rates of displacement or w, velocity, time and columns at `y`."""
    v = y[1]
    if HAS_BACKSTOP and mode == BACKSTOP:
        pace = 2.0 * y[0]
        rates[0] = -v
        rates[1] = pace * backstop_acceleration(y[2], y[0], v, hammer, drive)
    else:
        pace = 1.0
        rates[0] = v
        rates[1] = acceleration(y[2], y[0], v, mode, memory, hammer, drive)
    rates[2] = pace
    by_x, by_v, by_peak = variation_slopes(y, mode, memory, peak, memories, scales, bounds, hammer, drive)
    for k in range(columns.shape[1]):
        j = FIRST_COLUMN + 2 * k
        rates[j] = pace * y[j + 1]
        rates[j + 1] = by_x * y[j] + by_v * y[j + 1] + by_peak * columns[2, k]


@compiled
def longest_variation_step(
    mode: int,
    memory: float,
    peak: float,
    work: Any,
    scales: Any,
    bounds: Any,
    hammer: Hammer,
    drive: Drive,
) -> float:
    """Return the longest step from row START of `work` that follows a change of the state closely.

    The run's own steps follow the state: near rest, where that hardly moves, they are longer.
    """
    by_x, by_v, _by_peak = variation_slopes(
        work[START], mode, memory, peak, work[MEMORIES], scales, bounds, hammer, drive
    )
    pace = 2.0 * work[START, 0] if mode == BACKSTOP else 1.0
    rate = max(math.sqrt(abs(pace * by_x)), abs(by_v))
    return LONGEST_PHASE / rate if rate > 0.0 else math.inf


@compiled
def variation_step(
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
) -> None:
    """Take one step of `length` (s, or of the variable s in the backstop) from row START of `work`."""
    count = FIRST_COLUMN + 2 * columns.shape[1]
    start, y = work[START], work[STAGE]
    for stage in range(STAGES):
        for i in range(count):
            y[i] = start[i]
        for j in range(stage):
            share = length * A[stage, j]
            for i in range(count):
                y[i] += share * work[j, i]
        variation_rates(
            work[stage], y, columns, mode, memory, peak, work[MEMORIES], scales, bounds, hammer, drive
        )
    for j in range(STAGES):
        share = length * B[j]
        for i in range(count):
            start[i] += share * work[j, i]


@compiled
def begin_step(node: Any, work: Any) -> None:
    """Put the state at a node in row START of `work`."""
    work[START, 0] = node[4] if int(node[3]) == BACKSTOP else node[1]
    work[START, 1] = node[2]
    work[START, 2] = node[0]


@compiled
def set_out(work: Any, columns: Any) -> None:
    """Put the columns in row START of `work`."""
    for k in range(columns.shape[1]):
        work[START, FIRST_COLUMN + 2 * k] = columns[0, k]
        work[START, FIRST_COLUMN + 2 * k + 1] = columns[1, k]


@compiled
def bring_back(work: Any, columns: Any) -> None:
    """Take the columns out of row START of `work`."""
    for k in range(columns.shape[1]):
        columns[0, k] = work[START, FIRST_COLUMN + 2 * k]
        columns[1, k] = work[START, FIRST_COLUMN + 2 * k + 1]


@compiled
def forget(columns: Any) -> None:
    """Make all columns zero: what was before no longer matters."""
    for i in range(columns.shape[0]):
        for k in range(columns.shape[1]):
            columns[i, k] = 0.0


@compiled
def length_in_contact(
    t: float, leaves: bool, t0: float, w0: float, v0: float, hammer: Hammer, drive: Drive
) -> float:
    """Return the s, from a state in the backstop at time `t0`, of the time `t` [s].

    As `printhammer.kernel.single.resample.s_at`, but content with what the variation needs. Where it
    `leaves` at `t`, w = 0 is solved for in the end: the time stands still there.
    """
    kv0 = contact_rate(w0, v0, t0, hammer, drive)
    s, change = 0.0, math.inf
    t1, w1, v1, kv1 = t0, w0, v0, kv0
    for number in range(12):
        if abs(change) <= 1e-8 * s:
            break
        at_the_end = leaves and number > 0 and v1 > 0.0
        change = w1 / v1 if at_the_end else length_of(t - t1, w1, v1, kv1)
        s += change
        t1, w1, v1, kv1, _error = contact_step(t0, w0, v0, kv0, s, hammer, drive, ANY_SCALES)
    return s


@compiled
def held_in_backstop(
    pause: float, x: float, w: float, columns: Any, scales: Any, bounds: Any, hammer: Hammer
) -> float:
    """Let the columns die out for `pause` [s] about a place of rest in the backstop.

    The linear oscillator with the slopes of that place, in closed form. Returns the logarithm of a factor
    taken out of the columns.
    """
    with_w, with_v = contact_slopes(w, 0.0, scales, hammer)
    by_x = (field_slope(x, 0.0, scales, bounds, hammer) - with_w / (2.0 * w)) * hammer[INVERSE_MASS]
    by_v = with_v * hammer[INVERSE_MASS]
    half = 0.5 * by_v
    under_root = half * half + by_x
    if under_root < 0.0:
        rate = math.sqrt(-under_root)
        grown, even, odd = half * pause, math.cos(rate * pause), math.sin(rate * pause) / rate
    else:
        rate = math.sqrt(under_root)
        grown = (half + rate) * pause
        once = math.exp(-2.0 * rate * pause)
        even = 0.5 * (1.0 + once)
        odd = 0.5 * (1.0 - once) / rate if rate * pause > 1e-8 else pause
    for k in range(columns.shape[1]):
        dx, dv = columns[0, k], columns[1, k]
        columns[0, k] = (even - half * odd) * dx + odd * dv
        columns[1, k] = by_x * odd * dx + (even + half * odd) * dv
    return float(grown)


@compiled
def vary(
    t_to: float,
    node: Any,
    after: Any,
    columns: Any,
    work: Any,
    scales: Any,
    bounds: Any,
    hammer: Hammer,
    drive: Drive,
) -> float:
    """Carry state and columns from the time in row START of `work` to `t_to` [s], in the step from `node`.

    Returns the logarithm of a factor taken out of the columns.
    """
    t = work[START, 2]
    if t_to <= t:
        return 0.0
    work[START, 2] = t_to
    mode, kept = int(node[3]), node[4]
    if mode in (RESTING, HELD_LOADING, HELD_UNLOADING):
        forget(columns)
        return 0.0
    if HAS_BACKSTOP and mode == HELD:
        return held_in_backstop(t_to - t, node[1], kept, columns, scales, bounds, hammer)
    if HAS_BACKSTOP and mode == BACKSTOP and work[START, 0] == 0.0 and work[START, 1] == 0.0:
        # The step that only gets the regularised equations going.
        for k in range(columns.shape[1]):
            columns[0, k] += (t_to - t) * columns[1, k]
        return 0.0
    work[START, 2] = t
    set_out(work, columns)
    if HAS_BACKSTOP and mode == BACKSTOP:
        leaves = t_to == after[0] and int(after[3]) == FREE
        length = length_in_contact(t_to, leaves, t, work[START, 0], work[START, 1], hammer, drive)
        longest = longest_variation_step(mode, 0.0, 0.0, work, scales, bounds, hammer, drive)
        count = 1 + int(length / longest)
        for _ in range(count):
            variation_step(length / count, columns, work, mode, 0.0, 0.0, scales, bounds, hammer, drive)
    else:
        memory = memory_of(mode, kept, hammer)
        if HAS_PACK and MEMORY and mode in (UNLOADING, RELOADING):
            note_memories(work[MEMORIES], kept, hammer)
        longest = longest_variation_step(mode, memory, kept, work, scales, bounds, hammer, drive)
        left = t_to - t
        while left > 0.0:
            length = min(left, longest)
            if HAS_PACK and mode == LOADING and work[START, 1] > 0.0:
                since = (work[START, 0] - hammer[FRONT]) / work[START, 1]
                length = min(length, max(since, GRADING * (t_to - t)))
            variation_step(length, columns, work, mode, memory, kept, scales, bounds, hammer, drive)
            left = 0.0 if length == left else t_to - work[START, 2]
    work[START, 2] = t_to
    bring_back(work, columns)
    return 0.0
