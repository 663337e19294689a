"""Damped Newton's method for a periodic orbit of a strobe map, and a test for motions settled to the orbit.

The unknowns are the states at successive firings, as in `printhammer.chaos.orbits.newton`: the image of each
state has to be the next state, and the image of the last state the first state. The caller computes images at
the trial states, with their derivatives, and calls `improve`, until the iteration converges or fails.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.model.layout import CAPACITANCE, FRONT, TURN_RESISTANCE
from printhammer.kernel.model.modes import HELD_UNLOADING, RELOADING, UNLOADING
from printhammer.kernel.readout.section import DISTINCT, mean_apart

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import MEMORY

TRY, CLOSED, FAILED = range(3)
"""Outcomes of `improve`: the map must be evaluated at the trial states; converged; failed."""

APPROACHES, GOES_ON, NO_DERIVATIVE = 1, 0, -1
"""Outcomes of `has_settled`: motion settled to the orbit; not settled; map not differentiable there."""

GOAL, ENOUGH, ITERATIONS = 1e-13, 1e-9, 20
"""Residual at which the iteration stops, residual that is accepted if it stops decreasing, and iteration
limit; the same constants as in `printhammer.chaos.orbits.settled`."""
LONGEST_STEP, LEAST_SHARE = 1.0, 2.0**-7
"""Longest Newton step, in half-widths of the window, and smallest damping factor; as in
`printhammer.chaos.orbits.newton`."""
NEAR, LIES_ON = 0.1, 1e-6
"""Distances from an orbit, in half-widths of the strobe window, within which the orbit is sought, and within
which a state lies on the orbit; as in `printhammer.chaos.orbits.settled`."""
STILL_COIL = 1e-9
"""Current, relative to a typical current, below which the coil is treated as currentless; as in
`printhammer.chaos.strobe.map`."""

TRIED, SHARE, RESIDUAL, SMOOTH = range(4)
"""Indices of `search`: number of map evaluations, damping factor, residual, differentiability flag."""

IMAGE = 7
"""Number of columns of an image: displacement, m, velocity, m/s, the four elements of the derivative by
rows, and 1 if the motion is differentiable."""

ORBIT = 10
"""Number of columns of an orbit: trial state, accepted state and step direction, two columns each, and the
derivative of the map by rows, four columns; all in half-widths of the window."""


def write_guess(states: Any, scales: Any, period: int, count: int, orbit: Any, trial: Any) -> int:
    """Write an initial guess of an orbit of `count` firings; return 1, or 0 if no such orbit is near.

    If the states alternate about the orbit, their mean is closer to the orbit than any single state.

    Parameters
    ----------
    states, scales
        As for `printhammer.kernel.readout.section.write_distances`.
    period, count : int
        Number of firings after which the states repeat, and number of firings of the orbit, a divisor of
        `period`.
    orbit : float64 array, shape (count, 10)
        Output; see `ORBIT`.
    trial : float64 array, shape (count, 2)
        Trial states, m and m/s.
    """
    if count < period and mean_apart(states, scales, count, period, True) > NEAR:
        return 0
    n = states.shape[0]
    for i in range(count):
        for k in range(2):
            total = 0.0
            for turn in range(period // count):
                total += states[n - period + turn * count + i, k]
            trial[i, k] = total / (period // count)
            orbit[i, k] = trial[i, k] / scales[k]
    return 1


def write_image(
    start: Any, ends: Any, current: float, columns: Any, smooth: float, hammer: Any, image: Any
) -> int:
    """Write the image of a state after one firing; return 1 if (x, v) is the complete state.

    Parameters
    ----------
    start : float64 array, shape (2,)
        Displacement [m] and velocity [m/s] at the start.
    ends : float64 array, shape (2, any)
        States at both ends; see `printhammer.kernel.variational.layout.Carried`.
    current : float
        Coil current at the end as a fraction of a typical current.
    columns : float64 array, shape (any, 2)
        Derivatives of the state at the end with respect to displacement and velocity at the start.
    smooth : float
        1 if the motion is differentiable.
    hammer : float64 array
        Constants of the hammer.
    image : float64 array, shape (7,)
        Output; see `IMAGE`.
    """
    image[0], image[1] = ends[1, 0], ends[1, 1]
    for row in range(2):
        for column in range(2):
            image[2 + 2 * row + column] = columns[row, column]
    image[6] = smooth
    memory = False
    if MEMORY:
        memory = True
    if memory and start[1] <= 0.0 and start[0] > hammer[FRONT]:
        return 0
    if not ends[1, 2] >= 0.0:
        return 0
    for mode in (UNLOADING, RELOADING, HELD_UNLOADING):
        if ends[1, 2] == mode:
            return 0
    return 1 if abs(current) <= STILL_COIL else 0


def improve(images: Any, usable: bool, scales: Any, orbit: Any, trial: Any, search: Any) -> int:
    """Accept or reject the trial states by their images, and write the next trial states.

    Parameters
    ----------
    images : float64 array, shape (m, 7)
        Images of the trial states; see `IMAGE`.
    usable : bool
        Whether (x, v) is the complete state in all images. If (x, v) is incomplete for the initial guess, the
        orbit counts as not differentiable.
    scales : float64 array
        Half-widths of the strobe window, m and m/s.
    orbit : float64 array, shape (m, 10)
        See `ORBIT`.
    trial : float64 array, shape (m, 2)
        Trial states, m and m/s.
    search : float64 array, shape (4,)
        Zeros before the first call; see `TRIED`.

    Returns
    -------
    int
        Outcome, such as `TRY`.
    """
    m = images.shape[0]
    residual = 0.0 if usable else math.inf
    for i in range(m):
        for k in range(2):
            gap = abs(images[i, k] / scales[k] - orbit[(i + 1) % m, k])
            if not gap <= residual:
                residual = gap if usable and math.isfinite(gap) else math.inf
    first, share = search[TRIED] == 0.0, search[SHARE]
    search[TRIED] += 1.0
    if first or residual < search[RESIDUAL] * (1.0 - 0.1 * share):
        accept(images, scales, orbit, search)
        if not usable:
            search[SMOOTH] = 0.0
        search[RESIDUAL] = residual
        search[SHARE] = 1.0 if first else min(2.0 * share, 1.0)
        if not math.isfinite(residual) or not is_aimed(images, scales, orbit):
            return FAILED
    else:
        search[SHARE] = 0.5 * share
        if search[RESIDUAL] <= ENOUGH:
            return CLOSED
        if search[SHARE] < LEAST_SHARE:
            return FAILED
    if search[RESIDUAL] <= GOAL:
        return CLOSED
    if search[TRIED] > ITERATIONS:
        return CLOSED if search[RESIDUAL] <= ENOUGH else FAILED
    for i in range(m):
        for k in range(2):
            orbit[i, k] = orbit[i, 2 + k] + search[SHARE] * orbit[i, 4 + k]
            trial[i, k] = orbit[i, k] * scales[k]
    return TRY


def accept(images: Any, scales: Any, orbit: Any, search: Any) -> None:
    """Store the trial states as accepted states, with the derivatives of the map; arrays as for `improve`."""
    search[SMOOTH] = 1.0
    for i in range(images.shape[0]):
        for row in range(2):
            orbit[i, 2 + row] = orbit[i, row]
            for column in range(2):
                element = images[i, 2 + 2 * row + column]
                orbit[i, 6 + 2 * row + column] = element * scales[column] / scales[row]
        if not images[i, 6] > 0.0:
            search[SMOOTH] = 0.0


def is_aimed(images: Any, scales: Any, orbit: Any) -> bool:
    """Write the clipped Newton step of each state to `orbit`; return False if the linear system is singular.

    The step d_i of state i obeys d_(i+1) = J_i d_i + e_i, with the derivative J_i of the map and the defect
    e_i: image minus next state. Once around the orbit, d_0 = M d_0 + c, the linear system. All steps are
    scaled so that the longest is at most `LONGEST_STEP`. Arrays as for `improve`.
    """
    m = images.shape[0]
    a, b, c, d = 1.0, 0.0, 0.0, 1.0
    p, q = 0.0, 0.0
    for i in range(m):
        ahead = (i + 1) % m
        xx, xv, vx, vv = orbit[i, 6], orbit[i, 7], orbit[i, 8], orbit[i, 9]
        e = images[i, 0] / scales[0] - orbit[ahead, 2]
        f = images[i, 1] / scales[1] - orbit[ahead, 3]
        a, b, c, d = xx * a + xv * c, xx * b + xv * d, vx * a + vv * c, vx * b + vv * d
        p, q = xx * p + xv * q + e, vx * p + vv * q + f
    determinant = (1.0 - a) * (1.0 - d) - b * c
    if determinant == 0.0 or not math.isfinite(determinant):
        return False
    u, w = ((1.0 - d) * p + b * q) / determinant, (c * p + (1.0 - a) * q) / determinant
    size = 0.0
    for i in range(m):
        orbit[i, 4], orbit[i, 5] = u, w
        size = max(size, abs(u), abs(w))
        e = images[i, 0] / scales[0] - orbit[(i + 1) % m, 2]
        f = images[i, 1] / scales[1] - orbit[(i + 1) % m, 3]
        u, w = orbit[i, 6] * u + orbit[i, 7] * w + e, orbit[i, 8] * u + orbit[i, 9] * w + f
    if not math.isfinite(size):
        return False
    factor = LONGEST_STEP / size if size > LONGEST_STEP else 1.0
    for i in range(m):
        orbit[i, 4] *= factor
        orbit[i, 5] *= factor
    return True


def largest_multiplier(orbit: Any) -> float:
    """Return the larger absolute value of the two Floquet multipliers, from trace and determinant.

    `orbit`, shape (m, 10), is described by `ORBIT`.
    """
    a, b, c, d = 1.0, 0.0, 0.0, 1.0
    determinant = 1.0
    for i in range(orbit.shape[0]):
        xx, xv, vx, vv = orbit[i, 6], orbit[i, 7], orbit[i, 8], orbit[i, 9]
        a, b, c, d = xx * a + xv * c, xx * b + xv * d, vx * a + vv * c, vx * b + vv * d
        determinant *= xx * vv - xv * vx
    half = 0.5 * (a + d)
    inside = half * half - determinant
    if inside < 0.0:
        return math.hypot(half, math.sqrt(-inside))
    return abs(half) + math.sqrt(inside)


def has_settled(states: Any, scales: Any, orbit: Any, search: Any, outcome: int, out: Any) -> int:
    """Decide from Newton's method whether a motion has settled to the orbit; see `APPROACHES`.

    Parameters
    ----------
    states : float64 array, shape (n, any)
        States at successive firings: displacement [m], velocity [m/s] and more columns, which are ignored.
    scales : float64 array
        Half-widths of the strobe window, m and m/s, in the first two elements.
    orbit : float64 array, shape (m, 10)
        See `ORBIT`.
    search : float64 array, shape (4,)
        See `TRIED`.
    outcome : int
        Last outcome of `improve`.
    out : float64 array, shape (1,)
        Output: largest absolute value of a Floquet multiplier.
    """
    for i in range(orbit.shape[0]):
        for k in range(6, 10):
            if not math.isfinite(orbit[i, k]):
                return NO_DERIVATIVE
    if not search[SMOOTH] > 0.0:
        return NO_DERIVATIVE
    out[0] = largest_multiplier(orbit)
    if outcome != CLOSED or not out[0] < 1.0:
        return GOES_ON
    within = max(LIES_ON, DISTINCT * (1.0 - out[0]))
    return APPROACHES if is_approaching(states, scales, orbit, within) else GOES_ON


def gap_at(states: Any, scales: Any, orbit: Any, block: int, shift: int) -> float:
    """Return the largest distance between the states of one period and an orbit shifted by `shift` firings.

    `block` is the index of the period in `states`; an incomplete period at the start of `states` is not
    counted. Arrays as for `has_settled`; differences are divided by `scales`, the half-widths of the window.
    """
    count = orbit.shape[0]
    begin = states.shape[0] % count + block * count
    gap = 0.0
    for i in range(count):
        for k in range(2):
            there = orbit[(i - shift + count) % count, 2 + k]
            gap = max(gap, abs(states[begin + i, k] / scales[k] - there))
    return gap


def is_approaching(states: Any, scales: Any, orbit: Any, lies_on: float) -> bool:
    """Whether states lie on an orbit or approach it; see `printhammer.chaos.orbits.settled`.

    Arrays as for `has_settled`. States lie on the orbit if their distance, in half-widths of the strobe
    window, is at most `lies_on`.
    """
    count = orbit.shape[0]
    blocks = states.shape[0] // count
    shift, least = 0, math.inf
    for k in range(count):
        last = gap_at(states, scales, orbit, blocks - 1, k)
        if last < least:
            shift, least = k, last
    part = max(blocks // 4, 1)
    early, late = 0.0, 0.0
    for k in range(part):
        early += gap_at(states, scales, orbit, k, shift) / part
        late += gap_at(states, scales, orbit, blocks - part + k, shift) / part
    plane = states[:, :2]
    begin = mean_apart(plane, scales, count, count, False)
    end = mean_apart(plane, scales, count, count, True)
    slower = min(1.0, math.sqrt(end / begin)) if begin > 0.0 else 0.0
    return late <= lies_on or (late <= NEAR and late < slower * early)


def is_planar(hammer: Any) -> int:
    """Whether displacement and velocity are the complete state at a section without coil current.

    False if the coil has a shorted turn or the supply has a capacitor.
    """
    return 0 if hammer[TURN_RESISTANCE] > 0.0 or hammer[CAPACITANCE] > 0.0 else 1
