"""One step of every lane of a block, for each pool: branch-free loops that the compiler vectorises.

A step that meets the tolerance and cannot contain a switching event is accepted at once; other steps are
handled by :mod:`printhammer.kernel.lanes.events`. The Bernstein coefficients of the quintic (position) and
the cubic (velocity) bound the curve, and show whether a step may contain an event.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.lanes import layout as R
from printhammer.kernel.lanes.layout import BLOCK
from printhammer.kernel.model.layout import ForceLaw
from printhammer.kernel.model.modes import FREE, LOADING, UNLOADING

if TYPE_CHECKING:
    from printhammer.kernel.methods.dop853 import contact_step, time_step
    from printhammer.kernel.methods.nystrom8 import nystrom_step
    from printhammer.kernel.model.forces import acceleration, backstop_acceleration
    from printhammer.kernel.model.laws import HAS_DAMPING, backstop_elastic

    State = tuple[float, float, float, float]

PHASE_LIMIT = 2.0
"""Largest phase advance [rad] of the contact oscillation in one step, as in the scalar kernel."""


@inlined
def four_at(pool: Any, at: int) -> Any:
    """Return four consecutive rows of a lane as a tuple; `at` is the index of the first row in its pool."""
    return pool[at], pool[at + BLOCK], pool[at + 2 * BLOCK], pool[at + 3 * BLOCK]


@inlined
def twelve_at(pool: Any, at: int) -> Any:
    """Return twelve consecutive rows of a lane as a tuple; `at` is the index of the first row in its pool."""
    return four_at(pool, at) + four_at(pool, at + 4 * BLOCK) + four_at(pool, at + 8 * BLOCK)


@inlined
def drive_at(pool: Any, i: int) -> Any:
    """Return the drive of a lane as a tuple: coefficients and rates, as `drive_value` expects them."""
    return twelve_at(pool, R.DRIVE * BLOCK + i)


@inlined
def hammer_at(pool: Any, i: int) -> Any:
    """Return the constants of a lane's hammer as a tuple, in the layout of lanes."""
    at = R.HAMMER * BLOCK + i
    last = pool[at + 24 * BLOCK], pool[at + 25 * BLOCK], pool[at + 26 * BLOCK]
    return twelve_at(pool, at) + twelve_at(pool, at + 12 * BLOCK) + last


@inlined
def factor(ratio: float) -> float:
    """Return the size of the next step divided by the size of the latest step, from 0.2 to 5.

    `ratio` is the error of the latest step as a multiple of the tolerance; it may be NaN or infinite.
    """
    f = 0.85 / math.sqrt(math.sqrt(math.sqrt(max(ratio, 1e-7))))
    f = min(5.0, max(0.2, f))
    return f if ratio < 1e6 else 0.2


@inlined
def settle(
    pool: Any, i: int, start: State, h: float, end: State, ratio: float, sure: bool, edge: bool, outside: bool
) -> None:
    """Accept or reject a step of a lane; store its results, the next step size and the event flags.

    `ratio` is the error as a multiple of the tolerance. The flags state whether the step cannot contain a
    switching event (`sure`), ends at an edge of the drive (`edge`), or may exceed a bound (`outside`).
    """
    t, x, v, a = start
    t1, x1, v1, a1 = end
    small = ratio <= 1.0
    sure = sure and pool[R.LANDING * BLOCK + i] == 0.0
    valid = small and sure
    following = h * factor(ratio)
    pool[R.OLD_T * BLOCK + i] = t
    pool[R.OLD_X * BLOCK + i] = x
    pool[R.OLD_V * BLOCK + i] = v
    pool[R.OLD_A * BLOCK + i] = a
    pool[R.NEW_T * BLOCK + i] = t1
    pool[R.NEW_X * BLOCK + i] = x1
    pool[R.NEW_V * BLOCK + i] = v1
    pool[R.NEW_A * BLOCK + i] = a1
    pool[R.LENGTH * BLOCK + i] = h
    pool[R.FOLLOWING * BLOCK + i] = following
    pool[R.T * BLOCK + i] = t1 if valid else t
    pool[R.X * BLOCK + i] = x1 if valid else x
    pool[R.V * BLOCK + i] = v1 if valid else v
    pool[R.A * BLOCK + i] = a1 if valid else a
    pool[R.H * BLOCK + i] = following
    first = pool[R.FIRST * BLOCK + i]
    pool[R.FIRST * BLOCK + i] = following if (small and first == 0.0) else first
    steps = pool[R.STEPS * BLOCK + i] + 1.0
    pool[R.STEPS * BLOCK + i] = steps
    scale = pool[R.CONTROL * BLOCK + i] / pool[(R.CONTROL + 1) * BLOCK + i]
    event = R.SWITCH if (small and not sure) else 0.0
    event += R.SAMPLED if (valid and t1 >= pool[R.SAMPLE * BLOCK + i]) else 0.0
    event += R.AT_EDGE if (valid and edge) else 0.0
    most = pool[R.MOST_STEPS * BLOCK + i]
    # Compare times, since step sizes in backstop contact are in s and not in seconds.
    most = min(most, R.MANY_STEPS) if abs(t1 - t) < R.SHORT * abs(t1) else most
    stuck = not (small or following > 1e-14 * scale) or steps > most
    event = R.STUCK if (stuck or (small and outside)) else event
    pool[R.EVENT * BLOCK + i] = event


@inlined
def step_ratio(pool: Any, i: int, error_x: float, error_v: float) -> float:
    """Return the error estimate of a step off the backstop as a multiple of the tolerance; may be NaN."""
    ratio_x = abs(error_x) / pool[R.CONTROL * BLOCK + i]
    ratio_v = abs(error_v) / pool[(R.CONTROL + 1) * BLOCK + i]
    # The sum propagates a NaN of either ratio, which the maximum may not.
    worst = max(ratio_x, ratio_v) + 0.0 * (ratio_x + ratio_v)
    allowance = R.CONTROL + 3 if HAS_DAMPING else R.CONTROL + 2
    return float(worst / pool[allowance * BLOCK + i])


@inlined
def time_to_level(distance: float, v: float, a: float) -> float:
    """Return the time [s] to cover `distance` >= 0 [m] at constant acceleration; infinity if never."""
    under_root = v * v + 2.0 * a * distance
    root = math.sqrt(max(under_root, 0.0))
    fast = v > 0.0
    time = (2.0 * distance if fast else root - v) / (v + root if fast else a)
    return time if (under_root >= 0.0 and (fast or a > 0.0)) else math.inf


@inlined
def start_at(pool: Any, i: int) -> State:
    """Return time, position, velocity and acceleration of a lane; in backstop contact, t, w, v and dv/ds."""
    return pool[i], pool[R.X * BLOCK + i], pool[R.V * BLOCK + i], pool[R.A * BLOCK + i]


@inlined
def timed_step(pool: Any, i: int, start: State, h: float, law: ForceLaw) -> tuple[float, State, float, bool]:
    """Advance a lane off the backstop by `h` [s], or to the next edge of the drive if that is earlier.

    Returns
    -------
    tuple
        Length of the step, state at its end, error as a multiple of the tolerance, and whether the step ends
        at the edge.
    """
    t, x, v, a = start
    left = pool[R.NEXT * BLOCK + i] - t
    edge = h >= left
    h = left if edge else h
    if HAS_DAMPING:
        x1, v1, a1, error_x, error_v = time_step(t, x, v, a, h, law)
    else:
        x1, v1, a1, error_x, error_v = nystrom_step(t, x, v, a, h, law)
    t1 = pool[R.NEXT * BLOCK + i] if edge else t + h
    return h, (t1, x1, v1, a1), step_ratio(pool, i, error_x, error_v), edge


@compiled
def free_block(pool: Any, begin: int) -> None:
    """Advance each lane of a block by one step in free flight."""
    pool = pool[begin:]
    for i in range(BLOCK):
        start = start_at(pool, i)
        _t, x, v, a = start
        hammer = hammer_at(pool, i)
        h = pool[R.H * BLOCK + i]
        h = min(h, 1.02 * time_to_level(x - hammer[R.POSITION], -v, -a))
        h = min(h, 1.02 * time_to_level(hammer[R.FRONT] - x, v, a))
        law = ForceLaw(FREE, 0.0, hammer, drive_at(pool, i))
        h, end, ratio, edge = timed_step(pool, i, start, h, law)
        _t1, x1, v1, a1 = end
        c1 = x + 0.2 * h * v
        c2 = c1 + 0.2 * h * (v + 0.25 * h * a)
        c4 = x1 - 0.2 * h * v1
        c3 = c4 - 0.2 * h * (v1 - 0.25 * h * a1)
        low = min(c1, c2, c3, c4, x1)
        high = max(c1, c2, c3, c4, x1)
        sure = low > hammer[R.POSITION] and high < hammer[R.FRONT]
        outside = max(min(low, x1), min(x, hammer[R.POSITION])) <= pool[R.LOWEST * BLOCK + i]
        outside = outside or min(high, hammer[R.FRONT]) >= pool[R.HIGHEST * BLOCK + i]
        settle(pool, i, start, h, end, ratio, sure, edge, outside)


@compiled
def loading_block(pool: Any, begin: int) -> None:
    """Advance each lane of a block by one step on the loading branch of the pack."""
    pool = pool[begin:]
    for i in range(BLOCK):
        start = start_at(pool, i)
        _t, x, v, a = start
        law = ForceLaw(LOADING, 0.0, hammer_at(pool, i), drive_at(pool, i))
        h, end, ratio, edge = timed_step(pool, i, start, pool[R.H * BLOCK + i], law)
        _t1, x1, v1, a1 = end
        sure = min(v + h * a / 3.0, v1 - h * a1 / 3.0, v1) > 0.0
        outside = max(x1, x + h * v) >= pool[R.HIGHEST * BLOCK + i]
        settle(pool, i, start, h, end, ratio, sure, edge, outside)


@compiled
def unloading_block(pool: Any, begin: int) -> None:
    """Advance each lane of a block by one step on the unloading branch of the pack."""
    pool = pool[begin:]
    for i in range(BLOCK):
        start = start_at(pool, i)
        _t, _x, v, a = start
        law = ForceLaw(UNLOADING, pool[R.MEMORY * BLOCK + i], hammer_at(pool, i), drive_at(pool, i))
        h, end, ratio, edge = timed_step(pool, i, start, pool[R.H * BLOCK + i], law)
        _t1, x1, v1, a1 = end
        sure = max(v + h * a / 3.0, v1 - h * a1 / 3.0, v1) < 0.0 and x1 > law.hammer[R.FRONT]
        if not HAS_DAMPING:
            # On the steep unloading branch, the order 6 estimate is too small by about this factor.
            ratio *= 5.0
        settle(pool, i, start, h, end, ratio, sure, edge, False)


@inlined
def stiffness(w: float, hammer: Any) -> float:
    """Return the tangent stiffness of the backstop [N/m] at compression ``w**2`` [m]."""
    stretch = 1.01 * w
    rise = backstop_elastic(hammer[R.BACKSTOP_PART : R.MAGNET], stretch) - backstop_elastic(
        hammer[R.BACKSTOP_PART : R.MAGNET], w
    )
    return float(rise / (stretch * stretch - w * w))


@compiled
def contact_block(pool: Any, begin: int) -> None:
    """Advance each lane of a block by one step in backstop contact, in regularised variables."""
    pool = pool[begin:]
    for i in range(BLOCK):
        start = start_at(pool, i)
        t, w, v, kv = start
        h = pool[R.H * BLOCK + i]
        hammer = hammer_at(pool, i)
        drive = drive_at(pool, i)
        scale_x, scale_v = pool[R.CONTROL * BLOCK + i], pool[(R.CONTROL + 1) * BLOCK + i]
        reach = (pool[R.NEXT * BLOCK + i] - t) / (2.0 * w)
        h = min(h, reach * (4.0 if v >= 0.0 else 1.01))
        limit = PHASE_LIMIT / math.sqrt(stiffness(w, hammer) * hammer[R.INVERSE_MASS]) / (2.0 * w)
        h = min(h, limit if w > 0.0 else math.inf)
        scales = (scale_x / scale_v, scale_x / (2.0 * max(w, abs(v) * h)), scale_v)
        t1, w1, v1, kv1, error = contact_step(t, w, v, kv, h, hammer, drive, scales)
        ratio = error / pool[(R.CONTROL + 3) * BLOCK + i]
        c1 = w - 0.2 * h * v
        c2 = c1 - 0.2 * h * (v + 0.25 * h * kv)
        c4 = w1 + 0.2 * h * v1
        c3 = c4 + 0.2 * h * (v1 - 0.25 * h * kv1)
        low = min(c1, c2, c3, c4, w1)
        high = max(c1, c2, c3, c4, w1)
        outside = hammer[R.POSITION] - high * high <= pool[R.LOWEST * BLOCK + i]
        sure = low > 0.0 and t1 < pool[R.NEXT * BLOCK + i]
        settle(pool, i, start, h, (t1, w1, v1, kv1), ratio, sure, False, outside)


@compiled
def lane_acceleration(pool: Any, i: int, t: float, x: float, v: float, mode: int, memory: float) -> float:
    """Return the acceleration [m/s^2] of the member in a lane at a state off the backstop."""
    return acceleration(t, x, v, mode, memory, hammer_at(pool, i), drive_at(pool, i))


@compiled
def lane_contact_rate(pool: Any, i: int, t: float, w: float, v: float) -> float:
    """Return dv/ds of the member in a lane at a state in backstop contact; s is the regularised variable."""
    return 2.0 * w * backstop_acceleration(t, w, v, hammer_at(pool, i), drive_at(pool, i))
