"""Checks of the run loop before and after a step: initial mode, step size, range of the displacement."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model import modes as M
from printhammer.kernel.model.layout import (
    BACKSTOP_PART,
    FRONT,
    MAGNET,
    PACK,
    POSITION,
    Control,
    ForceLaw,
)

if TYPE_CHECKING:
    from printhammer.kernel.methods.landing import State, land_on_level, level_switch
    from printhammer.kernel.model.forces import Hammer, acceleration
    from printhammer.kernel.model.laws import (
        BACKSTOP_PULLS,
        HAS_BACKSTOP,
        HAS_PACK,
        MEMORY,
        RELOAD_ALONG_UNLOADING,
        RIGID,
        RIGID_FRONT,
        backstop_switch,
        pack_memory,
    )
    from printhammer.kernel.model.pulses import Drive


@compiled
def first_mode(x: float, v: float, a: float, hammer: Hammer) -> int:
    """Return the mode of an initial state with the acceleration `a` [m/s^2] in free flight.

    An armature that moves out of a pack with memory starts on the unloading branch from its displacement.
    """
    if HAS_BACKSTOP:
        b = hammer[POSITION]
        if x < b and not RIGID:
            if (
                not BACKSTOP_PULLS
                and backstop_switch(hammer[BACKSTOP_PART:MAGNET], math.sqrt(b - x), v) <= 0.0
            ):
                return M.BACKSTOP_RELEASED
            return M.BACKSTOP
        if x <= b and RIGID and v <= 0.0:
            return M.RESTING if v == 0.0 and a < 0.0 else M.FREE
        if x == b and (v < 0.0 or (v == 0.0 and a < 0.0)):
            return M.BACKSTOP
    if RIGID_FRONT:
        rests = x >= hammer[FRONT] and v == 0.0 and a > 0.0
        return M.RESTING_FRONT if rests else M.FREE
    if HAS_PACK and x >= hammer[FRONT]:
        if x > hammer[FRONT] and v < 0.0 and MEMORY:
            return M.UNLOADING
        if x > hammer[FRONT] or v > 0.0:
            return M.LOADING
    return M.FREE


@compiled
def time_to_level(distance: float, v: float, a: float) -> float:
    """Return the time [s] to cover `distance` >= 0 [m] at constant acceleration; infinity if never."""
    if v <= 0.0 and a <= 0.0:
        return math.inf
    under_root = v * v + 2.0 * a * distance
    if under_root < 0.0:
        return math.inf
    root = math.sqrt(under_root)
    if v > 0.0:
        return 2.0 * distance / (v + root)
    return (root - v) / a


@compiled
def sensible_step(h: float, x: float, v: float, a: float, mode: int, hammer: Hammer) -> float:
    """Limit the step `h` [s] to 1.02 times the estimated time to reach the backstop or the pack front."""
    if HAS_BACKSTOP and mode == M.FREE:
        height = x - hammer[POSITION]
        if height > 0.0:
            h = min(h, 1.02 * time_to_level(height, -v, -a))
        elif height == 0.0 and v > 0.0 and a < 0.0:
            h = min(h, -2.04 * v / a)
    if HAS_PACK and mode == M.FREE and x < hammer[FRONT]:
        h = min(h, 1.02 * time_to_level(hammer[FRONT] - x, v, a))
    if RIGID_FRONT and mode == M.FREE and x == hammer[FRONT] and v < 0.0 and a > 0.0:
        h = min(h, -2.04 * v / a)
    return h


@compiled
def out_of_bounds(x: float, bounds: Any) -> int:
    """Return the status OK, RANGE_LEFT or RUNAWAY for a displacement `x` [m].

    `bounds` is as in :class:`printhammer.kernel.single.carry.Setup`.
    """
    if not (bounds[0] <= x <= bounds[1]):
        return M.RANGE_LEFT
    if abs(x - bounds[2]) > bounds[3]:
        return M.RUNAWAY
    return M.OK


@compiled
def left_range(start: State, end: State, law: ForceLaw, control: Control, bounds: Any) -> tuple[bool, State]:
    """Return whether a step leaves the allowed range of displacement, even briefly, and a state.

    The state is that at the bound or, if the step stays inside, at the end of the step.
    """
    h = end[0] - start[0]
    for side in range(2):
        bound = bounds[side]
        sign = 1.0 if side == 1 else -1.0
        # A backstop inside the range keeps the armature away from the lower bound.
        if math.isinf(bound) or h <= 0.0 or (HAS_BACKSTOP and side == 0 and law.mode == M.FREE):
            continue
        if start[1] == bound and sign * end[1] > sign * bound:
            return True, start
        code, fraction, upper = level_switch(start, end, h, bound, sign, law, control)
        if code == M.REACHED_FRONT:
            return True, land_on_level(start, h, fraction, upper, bound, sign, law, control)
    return out_of_bounds(end[1], bounds) == M.RANGE_LEFT, end


@compiled
def failure(x: float, v: float, bounds: Any, control: Control) -> int:
    """Return the status of a run whose steps are too short: RANGE_LEFT near a bound, else STEP_UNDERFLOW."""
    near = 0.05 * control[0]
    if (x - bounds[0] < near and v <= 0.0) or (bounds[1] - x < near and v >= 0.0):
        return M.RANGE_LEFT
    return M.STEP_UNDERFLOW


@compiled
def reversed_mode(
    t: float, x: float, mode: int, peak: float, memory: float, hammer: Hammer, drive: Drive
) -> tuple[int, float, float]:
    """Return next mode, latest local maximum [m] and its memory value after a reversal inside the pack."""
    if mode == M.LOADING:
        if acceleration(t, x, 0.0, M.LOADING, memory, hammer, drive) > 0.0:
            return M.LOADING, peak, memory
        return M.UNLOADING, x, pack_memory(hammer[PACK:BACKSTOP_PART], x)
    if mode == M.RELOADING:
        return M.UNLOADING, peak, memory
    if RELOAD_ALONG_UNLOADING:
        again = acceleration(t, x, 0.0, M.UNLOADING, memory, hammer, drive) > 0.0
        return (M.RELOADING if again else M.UNLOADING), peak, memory
    # As printed in the paper, the loading branch is the stronger branch below the peak. The armature moves in
    # again only if the other forces overcome the loading force; otherwise this point is a new local maximum.
    if acceleration(t, x, 0.0, M.LOADING, memory, hammer, drive) > 0.0:
        return M.LOADING, peak, memory
    return M.UNLOADING, x, pack_memory(hammer[PACK:BACKSTOP_PART], x)


@compiled
def kick_into_backstop(t: float, a: float, t_next: float, control: Control) -> tuple[float, float, float]:
    """Return time, w and velocity shortly after a touch with zero velocity, neglecting the contact force.

    The integrator cannot start from w = v = 0, where the regularised equations are stationary.
    """
    depth = 1e-15 * control[0]
    pause = min(math.sqrt(2.0 * depth / -a), t_next - t)
    return t + pause, math.sqrt(-0.5 * a) * pause, a * pause


@compiled
def contact_unit(v: float, control: Control) -> float:
    """Return the scale of the regularised variable s for a touch at `v`, proportional to |v|^-0.6 (Hertz)."""
    speed = max(abs(v), 1e-6 * control[1])
    return float(math.sqrt(control[0]) / (control[1] ** 0.4 * speed**0.6))
