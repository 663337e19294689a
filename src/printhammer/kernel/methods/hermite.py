"""Level crossings of the quintic Hermite interpolant of a step, used to detect switching events.

Position, velocity and acceleration at both ends of a step define the quintic. The Bernstein coefficients of
the quintic bound its values (convex hull), and the coefficients of its derivative bound the number of extrema
(variation diminishing, G. Farin, *Curves and Surfaces for CAGD*, ch. 5). Six numbers therefore show whether a
step could hide two crossings. The quintic provides an initial guess; the integrator locates the event itself.
"""

from __future__ import annotations

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.model.modes import NEAR_TOUCH, NO_SWITCH, REACHED_FRONT, UNRESOLVED

MARGIN = 1e-3
"""Distance of an extremum from a level, as a fraction of the control polygon's length, below which the
extremum is located before deciding whether the quintic crosses the level."""


@compiled
def sign_changes(d0: float, d1: float, d2: float, d3: float, d4: float) -> int:
    """Return the number of sign changes in a sequence of five numbers, ignoring zeros."""
    changes = 0
    last = 0.0
    for d in (d0, d1, d2, d3, d4):
        if d != 0.0:
            if last * d < 0.0:
                changes += 1
            last = 1.0 if d > 0.0 else -1.0
    return changes


@compiled
def control_points(
    x0: float, v0: float, a0: float, x1: float, v1: float, a1: float, h: float
) -> tuple[float, float, float, float]:
    """Return the four inner Bernstein coefficients of the quintic interpolant of a step of length `h`."""
    p1 = x0 + 0.2 * h * v0
    p2 = p1 + 0.2 * h * v0 + 0.05 * h * h * a0
    p4 = x1 - 0.2 * h * v1
    p3 = p4 - 0.2 * h * v1 + 0.05 * h * h * a1
    return p1, p2, p3, p4


@inlined
def rises_through(
    x0: float, v0: float, a0: float, x1: float, v1: float, a1: float, h: float, level: float
) -> int:
    """Decide whether the quintic of a step, which starts at or below `level`, rises through the level.

    Returns
    -------
    int
        REACHED_FRONT if the quintic ends above the level after one crossing, NO_SWITCH if it has no crossing,
        NEAR_TOUCH if it ends below but its only maximum may reach the level, UNRESOLVED if it may have
        several extrema and the step must be halved.
    """
    p1, p2, p3, p4 = control_points(x0, v0, a0, x1, v1, a1, h)
    d0, d1, d2, d3, d4 = p1 - x0, p2 - p1, p3 - p2, p4 - p3, x1 - p4
    if x1 > level or (x1 == level and v1 > 0.0):
        return REACHED_FRONT if sign_changes(d0, d1, d2, d3, d4) <= 1 else UNRESOLVED
    margin = MARGIN * (abs(d0) + abs(d1) + abs(d2) + abs(d3) + abs(d4))
    if max(p1, p2, p3, p4) < level - margin:
        return NO_SWITCH
    changes = sign_changes(d0, d1, d2, d3, d4)
    if changes == 0:
        return NO_SWITCH
    if changes == 1:
        rises_first = d0 > 0.0 or (d0 == 0.0 and d1 > 0.0)
        return NEAR_TOUCH if rises_first else NO_SWITCH
    return UNRESOLVED


@compiled
def turns_down(x0: float, v0: float, a0: float, x1: float, v1: float, a1: float, h: float) -> int:
    """Decide whether the velocity of a step, zero or positive at the start, becomes negative.

    Returns
    -------
    int
        REACHED_FRONT, the code for one crossing, if the velocity ends at or below zero after one sign change,
        NO_SWITCH if it stays positive, UNRESOLVED if it may change sign more than once.
    """
    p1, p2, p3, p4 = control_points(x0, v0, a0, x1, v1, a1, h)
    changes = sign_changes(p1 - x0, p2 - p1, p3 - p2, p4 - p3, x1 - p4)
    if v1 <= 0.0:
        return REACHED_FRONT if changes <= 1 else UNRESOLVED
    return NO_SWITCH if changes == 0 else UNRESOLVED


@compiled
def position_root(
    x0: float, v0: float, a0: float, x1: float, v1: float, a1: float, h: float, level: float, upper: float
) -> float:
    """Return the fraction of a step, in (0, `upper`], at which its quintic rises through `level`."""
    p1, p2, p3, p4 = control_points(x0, v0, a0, x1, v1, a1, h)
    low, high = 0.0, upper
    s = upper * (level - x0) / (x1 - x0) if x1 != x0 else 0.5 * upper
    for _ in range(60):
        if not (low < s < high):
            s = 0.5 * (low + high)
        r = 1.0 - s
        # The last two levels of de Casteljau's algorithm give the value and the slope together.
        r4, s4 = r * r * r * r, s * s * s * s
        left = (
            r4 * x0 + 4.0 * r * r * r * s * p1 + 6.0 * r * r * s * s * p2 + 4.0 * r * s * s * s * p3 + s4 * p4
        )
        right = (
            r4 * p1 + 4.0 * r * r * r * s * p2 + 6.0 * r * r * s * s * p3 + 4.0 * r * s * s * s * p4 + s4 * x1
        )
        gap = r * left + s * right - level
        if gap > 0.0:
            high = s
        else:
            low = s
        slope = 5.0 * (right - left)
        change = gap / slope if slope != 0.0 else 2.0
        if abs(change) < 1e-12:
            break
        s -= change
    return min(max(s, low), high)


@compiled
def velocity_root(v0: float, a0: float, v1: float, a1: float, h: float) -> float:
    """Return the fraction of a step, in (0, 1], at which the cubic interpolant of the velocity falls to 0."""
    c2 = 3.0 * (v1 - v0) - h * (2.0 * a0 + a1)
    c3 = 2.0 * (v0 - v1) + h * (a0 + a1)
    # If the step starts at rest, divide out the root at the start.
    at_rest = v0 == 0.0
    low, high = 0.0, 1.0
    s = v0 / (v0 - v1) if v0 != v1 else 0.5
    for _ in range(60):
        if not (low < s < high):
            s = 0.5 * (low + high)
        if at_rest:
            value = h * a0 + s * (c2 + s * c3)
            slope = c2 + 2.0 * s * c3
        else:
            value = v0 + s * (h * a0 + s * (c2 + s * c3))
            slope = h * a0 + s * (2.0 * c2 + 3.0 * s * c3)
        if value > 0.0:
            low = s
        else:
            high = s
        change = value / slope if slope != 0.0 else 2.0
        if abs(change) < 1e-12:
            break
        s -= change
    return min(max(s, low), high)
