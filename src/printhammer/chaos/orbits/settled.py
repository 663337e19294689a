"""Period to which a motion has settled, from its states or, if the states are ambiguous, by Newton's method.

States that agree q firings apart do not prove a period q. Near a period doubling the states alternate about
an orbit that they approach with a multiplier close to -1: states two firings apart agree long before states
one firing apart do. Near an unstable orbit, and near the birth of a stable orbit, states move so slowly that
they seem stationary. Therefore the states alone prove a period q only if

- states q firings apart agree as closely as the noise of the runs allows, and
- states q / p firings apart are well apart, for all primes p that divide q, and their distance no longer
  shrinks; cycles caused by the adaptive steps of the integrator are far smaller.

Otherwise the period is the smallest divisor d of q for which Newton's method finds a stable orbit of d
firings that lies close to the states and that the states approach.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from printhammer.chaos.orbits.newton import ExactMaps, close_orbits
from printhammer.chaos.orbits.orbit import multipliers_of
from printhammer.chaos.strobe.map import MAP_EFFORT
from printhammer.results import Declared, part
from printhammer.run.regime import Regime
from printhammer.support.arrays import BoolArray, FloatArray

AGREES: Final = 1e-8
"""Distance, in half-widths of the strobe window, up to which two states are considered equal; arbitrary."""

DISTINCT: Final = 1e-3  # Arbitrary
"""Distance, in half-widths of the strobe window, above which two states differ by more than noise."""

LIES_ON: Final = 1e-6  # Arbitrary
"""Distance from a stable orbit, in half-widths, within which a state lies on the orbit up to noise."""

NEAR: Final = 0.1
"""Distance from the states, in half-widths, within which an orbit of fewer firings is sought; arbitrary."""

_SHRINKS: Final = 1e-5
"""Smallest relative decrease at which a distance is considered to shrink; arbitrary."""
_NOISE: Final = 1e-9  # Arbitrary
"""Smallest decrease at which a distance is considered to shrink, in half-widths of the strobe window."""
_GOAL: Final = 1e-13
"""Residual at which Newton's method stops, in half-widths of the strobe window; arbitrary."""
_ENOUGH: Final = 1e-9  # Arbitrary
"""Residual accepted when Newton's method stagnates, in half-widths of the strobe window."""
_ITERATIONS: Final = 20  # Iteration limit of Newton's method; arbitrary

NO_ORBIT: Final = "Newton's method finds no stable orbit of {} there that the states approach"


class Settled(Declared):
    """Orbit to which a motion has settled, or the reason why the motion is undecided."""

    period: int | None = part("firings after which the orbit repeats; None if undecided")
    states: FloatArray = part(
        "displacement [m] and velocity [m/s] at the firings of the orbit, shape (period, 2)"
    )
    multiplier: float = part(
        "largest absolute value of a Floquet multiplier; NaN if Newton's method was not used",
        default=math.nan,
    )
    reason: str = part("reason if undecided; else empty", default="")


def shown(points: FloatArray, period: int) -> BoolArray:
    """Return the mask of the motions whose states alone prove the period `period`, without Newton's method.

    `points`, shape (n, m, k), are the states of n motions at m successive firings; their k components are
    divided by the scales.
    """
    _early, late = _apart(points, period, period)
    clear = np.asarray(late <= AGREES)
    for divisor in _largest_divisors(period):
        clear &= ~_shrinking(points, divisor, period) & (_apart(points, divisor, period)[1] >= DISTINCT)
    return clear


def settled(regime: Regime, points: FloatArray, period: int, scales: FloatArray) -> Settled:
    """Determine the settled orbit of a motion whose states agree `period` firings apart.

    `points`, shape (m, k), are the states at m successive sections: displacement [m], velocity [m/s] and, if
    k > 2, further components. The scales, shape (k,), are the half-widths of the strobe window and a typical
    value of each further component. The states alone decide if the strobe map has no derivative, because the
    armature is in the pack or touches a surface without velocity at a section, or because a current flows
    there.
    """
    scaled = (points / scales)[np.newaxis]
    plane, states = scales[:2], points[:, :2]
    divisors = [d for d in range(1, period + 1) if period % d == 0]
    for count in divisors:
        if shown(scaled, count)[0]:
            return Settled(count, states[-count:].copy())
    if not regime.is_planar:
        return _by_states(points, scaled, period)
    maps = ExactMaps(regime, MAP_EFFORT.alone)
    for count in divisors:
        if count < period and _apart(scaled, count, period)[1][0] > NEAR:
            continue
        # If the states alternate about the orbit, their mean is closer to the orbit than any single state.
        guess = states[-period:].reshape(-1, count, 2).mean(axis=0)
        closing = close_orbits(
            maps, guess[np.newaxis], np.ones((1, count), np.int64), plane, goal=_GOAL, enough=_ENOUGH,
            iterations=_ITERATIONS,
        )[0]  # fmt: skip
        if not np.isfinite(closing.jacobians).all() or not closing.smooth:
            return _by_states(points, scaled, period)
        largest = float(abs(multipliers_of(closing.jacobians)[0]))
        if not closing.closed or largest >= 1.0:
            continue
        if is_approaching(states / plane, closing.states / plane, lies_on=noise_about(largest)):
            return Settled(count, closing.states, largest)
    return Settled(None, np.zeros((0, 2)), math.nan, NO_ORBIT.format(_firings(period)))


def is_approaching(
    points: FloatArray, orbit: FloatArray, within: float = NEAR, lies_on: float = LIES_ON
) -> bool:
    """Whether successive states, shape (m, 2), lie on a periodic orbit, shape (q, 2), or converge to it.

    States lie on the orbit up to the distance `lies_on`, and may converge to it from a distance of up to
    `within`, both in half-widths of the strobe window. False if the states converge to a point off the orbit:
    the differences of successive states then shrink, but the distance from the orbit does not.
    """
    count = len(orbit)
    whole = points[len(points) % count :].reshape(-1, count, 2)
    gaps = [np.abs(whole - np.roll(orbit, shift, axis=0)).max(axis=(1, 2)) for shift in range(count)]
    gap = min(gaps, key=lambda row: float(row[-1]))
    part = max(len(gap) // 4, 1)
    late, early = float(gap[-part:].mean()), float(gap[:part].mean())
    begin, end = (float(row[0]) for row in _apart(points[np.newaxis], count, count))
    slower = min(1.0, math.sqrt(end / begin)) if begin > 0.0 else 0.0
    return late <= lies_on or (late <= within and late < slower * early)


def noise_about(multiplier: float) -> float:
    """Compute the largest distance from a stable orbit that integration errors may cause.

    The distance, in half-widths of the strobe window, grows as the largest absolute multiplier of the orbit
    falls, since the basin boundary is then farther away.
    """
    return max(LIES_ON, DISTINCT * (1.0 - multiplier))


def _by_states(points: FloatArray, scaled: FloatArray, period: int) -> Settled:
    """Determine the settled orbit from the states alone, without derivatives of the strobe map.

    `points` are the states, `scaled` the same states divided by the scales, with a leading axis.
    """
    early, late = _apart(scaled, period, period)
    shrinking = [bool(_shrinking(scaled, d, period)[0]) for d in _largest_divisors(period)]
    if late[0] > max(AGREES, early[0]) or any(shrinking):
        why = "the states still move, and Newton's method needs a derivative that does not exist"
        return Settled(None, np.zeros((0, 2)), math.nan, why)
    return Settled(period, points[-period:, :2].copy())


def _apart(points: FloatArray, count: int, period: int) -> tuple[FloatArray, FloatArray]:
    """Compute the mean distance of states `count` firings apart, early and late in each motion.

    `points` are scaled states, shape (n, m, k). The two means are taken over whole periods of `period`
    firings, at the start and at the end of the motion, each about a quarter of its length.
    """
    apart = np.abs(points[:, count:] - points[:, :-count]).max(axis=2)
    part = period * max(apart.shape[1] // (4 * period), 1)
    return apart[:, :part].mean(axis=1), apart[:, -part:].mean(axis=1)


def _shrinking(points: FloatArray, count: int, period: int) -> BoolArray:
    early, late = _apart(points, count, period)
    return np.asarray(early - late > _SHRINKS * early + _NOISE)


def _largest_divisors(period: int) -> list[int]:
    """Return the maximal proper divisors of `period`: its quotients by each of its prime factors."""
    primes = [p for p in range(2, period + 1) if period % p == 0 and all(p % k for k in range(2, p))]
    return [period // p for p in primes]


def _firings(count: int) -> str:
    return f"{count} firing{'s' if count > 1 else ''}"
