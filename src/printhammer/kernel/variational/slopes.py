"""Derivatives of the force laws by fourth-order differences that do not cross a kink of a law.

A part need not define derivatives of its laws. Inside the range of a law, the five-point formula is central;
at an end of the range, at a surface and beside a kink, it is one-sided. The step sizes below make truncation
and rounding errors about equal, near 1e-12 of the derivative. M. Abramowitz and I. A. Stegun, *Handbook of
Mathematical Functions* (1964), table 25.2.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    FRONT,
    MAGNET,
    MOST_LEVELS,
    PACK,
    SPRING,
)
from printhammer.kernel.model.modes import LOADING

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import Hammer, pack_force, viscous_force
    from printhammer.kernel.model.laws import (
        BACKSTOP_PULLS,
        FORCE_DRIVE,
        FORCED,
        HAS_DAMPING,
        LEVELS,
        MEMORY,
        PACK_PULLS,
        VISCOUS,
        backstop_elastic,
        backstop_switch,
        backstop_viscous,
        magnet_force,
        pack_memory,
        pack_switch,
        pack_unloading,
        spring_force,
        spring_level,
        spring_switch,
        spring_viscous,
    )

FIELD_SPACING = 2e-4
"""Step size for magnet and spring force, as a fraction of the displacement scale."""
NEAR_END = 1e-3
"""Limit of the step size, as a fraction of the distance to an end of the range, where the law may be
singular."""
NEAR_KINK = 1e-2
"""Limit of the step size, as a fraction of the distance to a kink of the spring law; arbitrary."""
DEPTH_SPACING = 3e-4
"""Step size in the pack, as a fraction of the depth, since the law may contain high powers of the depth."""
LEAST_DEPTH_SPACING = 1e-7
"""Smallest step size in the pack or near a kink, as a fraction of the displacement scale."""
ROOT_SPACING = 1e-3
"""Step size of w in backstop contact, as a fraction of w, or of 1/100 of the root of the displacement scale
if larger."""
SPEED_SPACING = 1e-3
"""Step size of the velocity, as a fraction of the velocity scale."""

BACKWARD, CENTRAL, FORWARD = 0, 1, 2
"""Rows of the five-point formulas in `OFFSETS` and `WEIGHTS`."""
OFFSETS = np.array([[0.0, -1.0, -2.0, -3.0, -4.0], [-2.0, -1.0, 1.0, 2.0, 0.0], [0.0, 1.0, 2.0, 3.0, 4.0]])
WEIGHTS = (
    np.array([[25.0, -48.0, 36.0, -16.0, 3.0], [1.0, -8.0, 8.0, -1.0, 0.0], [-25.0, 48.0, -36.0, 16.0, -3.0]])
    / 12.0
)
POINTS = np.array([5, 4, 5])


@inlined
def field_at(x: float, value: float, hammer: Hammer) -> float:
    """Return the sum of magnet and spring force [N] for a drive value; a drive force is not included."""
    current = 0.0 if FORCE_DRIVE else value
    return magnet_force(hammer[MAGNET:], x, current) + spring_force(hammer[SPRING:PACK], x)


@compiled
def smooth_bounds(node: Any, after: Any, bounds: Any, hammer: Hammer) -> Any:
    """Return four displacements [m]: the range of the laws, and the interval without a kink around a step.

    The step, from `node` to `after`, crosses no kink of the spring law, but may begin or end on a kink.
    `bounds` holds the range of the laws.
    """
    low, high = bounds[0], bounds[1]
    if LEVELS:
        for k in range(MOST_LEVELS):
            level = spring_level(hammer[SPRING:PACK], float(k))
            if math.isinf(level):
                break
            first, last = node[1] - level, after[1] - level
            if first > 0.0 or last > 0.0 or (first == 0.0 and last == 0.0 and node[2] >= 0.0):
                low = max(low, level)
            else:
                high = min(high, level)
    return bounds[0], bounds[1], low, high


@compiled
def field_slope(x: float, v: float, value: float, scales: Any, bounds: Any, hammer: Hammer) -> float:
    """Return the derivative of magnet and spring force with respect to displacement [N/m].

    The spring force includes its dissipative part, at the velocity `v` [m/s]; `value` is the drive value.
    `scales` holds the scales of displacement and velocity; `bounds` is the result of `smooth_bounds`.
    """
    to_end = min(x - bounds[0], bounds[1] - x)
    spacing = min(FIELD_SPACING * scales[0], NEAR_END * max(to_end, NEAR_END * scales[0]))
    low, high = bounds[2], bounds[3]
    if LEVELS:
        # Beyond a kink, the law may contain a fractional power of the distance from the kink.
        to_kink = min(x - low, high - x)
        spacing = min(spacing, max(NEAR_KINK * to_kink, LEAST_DEPTH_SPACING * scales[0]))
    # Round the step so that x + spacing is exact, as the difference formula assumes.
    spacing = (x + spacing) - x
    side = CENTRAL
    if x - 2.0 * spacing < low:
        side = FORWARD
    elif x + 2.0 * spacing > high:
        side = BACKWARD
    total = 0.0
    for k in range(POINTS[side]):
        at = x + OFFSETS[side, k] * spacing
        total += WEIGHTS[side, k] * field_at(at, value, hammer)
        if VISCOUS:
            total += WEIGHTS[side, k] * spring_viscous(hammer[SPRING:PACK], at, v)
    return float(total / spacing)


@compiled
def damping_slope(x: float, v: float, scales: Any, hammer: Hammer) -> float:
    """Return the derivative of damping and dissipative spring forces with respect to velocity [N s/m]."""
    if not HAS_DAMPING:
        return 0.0
    spacing = SPEED_SPACING * scales[1]
    side = CENTRAL
    if VISCOUS:
        c = hammer[SPRING:PACK]
        number = spring_switch(c, v)
        if spring_switch(c, v + 2.0 * spacing) * number <= 0.0:
            side = BACKWARD
        elif spring_switch(c, v - 2.0 * spacing) * number <= 0.0:
            side = FORWARD
    total = 0.0
    for k in range(POINTS[side]):
        at = v + OFFSETS[side, k] * spacing
        total += WEIGHTS[side, k] * viscous_force(x, at, hammer)
    return float(total / spacing)


@compiled
def pack_slopes(
    x: float, v: float, mode: int, memory: float, peak: float, scales: Any, hammer: Hammer
) -> tuple[float, float]:
    """Return the derivatives of the pack force with respect to displacement [N/m] and velocity [N s/m].

    On an unloading branch, the step size is limited by the depth of its local maximum `peak`: the branch
    contains so high a power of the depth that, in a shallow contact, points far beyond the maximum would
    dominate.
    """
    front = hammer[FRONT]
    x = max(x, front)
    least = LEAST_DEPTH_SPACING * scales[0]
    if MEMORY and mode != LOADING:
        least = min(least, DEPTH_SPACING * (peak - front))
    spacing = max(DEPTH_SPACING * (x - front), least)
    spacing = (x + spacing) - x
    if spacing == 0.0:
        return 0.0, 0.0
    side = CENTRAL if x - front >= 2.0 * spacing else FORWARD
    if not PACK_PULLS and mode == LOADING and side == CENTRAL:
        c = hammer[PACK:BACKSTOP_PART]
        if pack_switch(c, x - 2.0 * spacing, v) <= 0.0:
            side = FORWARD
        elif pack_switch(c, x + 2.0 * spacing, v) <= 0.0:
            side = BACKWARD
    with_x = 0.0
    for k in range(POINTS[side]):
        with_x += WEIGHTS[side, k] * pack_force(x + OFFSETS[side, k] * spacing, v, mode, memory, hammer)
    with_x /= spacing
    if MEMORY:
        return with_x, 0.0
    spacing = SPEED_SPACING * scales[1]
    side = CENTRAL
    if not PACK_PULLS and mode == LOADING:
        c = hammer[PACK:BACKSTOP_PART]
        if pack_switch(c, x, v - 2.0 * spacing) <= 0.0:
            side = FORWARD
        elif pack_switch(c, x, v + 2.0 * spacing) <= 0.0:
            side = BACKWARD
    with_v = 0.0
    for k in range(POINTS[side]):
        with_v += WEIGHTS[side, k] * pack_force(x, v + OFFSETS[side, k] * spacing, mode, memory, hammer)
    return with_x, with_v / spacing


@inlined
def peak_spacing(peak: float, hammer: Hammer) -> float:
    """Return the shift [m] of the local maximum in difference quotients of the unloading force."""
    return float((peak + DEPTH_SPACING * (peak - hammer[FRONT])) - peak)


@compiled
def note_memories(memories: Any, peak: float, hammer: Hammer) -> None:
    """Write the memory values of the pack law for five local maxima around `peak` [m] to `memories`."""
    spacing = peak_spacing(peak, hammer)
    for k in range(5):
        memories[k] = pack_memory(hammer[PACK:BACKSTOP_PART], peak + OFFSETS[CENTRAL, k] * spacing)


@compiled
def memory_slope(x: float, v: float, peak: float, memories: Any, hammer: Hammer) -> float:
    """Return the derivative of the unloading force at (`x`, `v`) with respect to the local maximum [N/m]."""
    spacing = peak_spacing(peak, hammer)
    if spacing == 0.0:
        return 0.0
    total = 0.0
    for k in range(POINTS[CENTRAL]):
        total += WEIGHTS[CENTRAL, k] * pack_unloading(hammer[PACK:BACKSTOP_PART], x, v, memories[k])
    return total / spacing


@inlined
def contact_force(w: float, v: float, hammer: Hammer) -> float:
    """Return the total (elastic plus viscous) backstop force [N] at compression ``w**2`` [m]."""
    c = hammer[BACKSTOP_PART:MAGNET]
    return backstop_elastic(c, w) + backstop_viscous(c, w, v)


@compiled
def contact_slopes(w: float, v: float, scales: Any, hammer: Hammer) -> tuple[float, float, float, float]:
    """Return the derivatives of the backstop force with respect to w [N/m^0.5] and velocity [N s/m].

    The third and fourth values are the derivatives of the viscous force; without forcing they are not
    computed.
    """
    c = hammer[BACKSTOP_PART:MAGNET]
    w = max(w, 0.0)
    spacing = ROOT_SPACING * max(w, 1e-2 * np.sqrt(scales[0]))
    side = CENTRAL if w >= 2.0 * spacing else FORWARD
    if not BACKSTOP_PULLS and side == CENTRAL:
        if backstop_switch(c, w - 2.0 * spacing, v) <= 0.0:
            side = FORWARD
        elif backstop_switch(c, w + 2.0 * spacing, v) <= 0.0:
            side = BACKWARD
    with_w, viscous_w = 0.0, 0.0
    for k in range(POINTS[side]):
        at = w + OFFSETS[side, k] * spacing
        with_w += WEIGHTS[side, k] * contact_force(at, v, hammer)
        if FORCED:
            viscous_w += WEIGHTS[side, k] * backstop_viscous(c, at, v)
    with_w /= spacing
    if FORCED:
        viscous_w /= spacing
    spacing = SPEED_SPACING * scales[1]
    side = CENTRAL
    if not BACKSTOP_PULLS:
        if backstop_switch(c, w, v + 2.0 * spacing) <= 0.0:
            side = BACKWARD
        elif backstop_switch(c, w, v - 2.0 * spacing) <= 0.0:
            side = FORWARD
    with_v, viscous_v = 0.0, 0.0
    for k in range(POINTS[side]):
        at = v + OFFSETS[side, k] * spacing
        with_v += WEIGHTS[side, k] * contact_force(w, at, hammer)
        if FORCED:
            viscous_v += WEIGHTS[side, k] * backstop_viscous(c, w, at)
    if FORCED:
        viscous_v /= spacing
    return with_w, with_v / spacing, viscous_w, viscous_v
