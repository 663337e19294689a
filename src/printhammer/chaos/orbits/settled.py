"""The period to which a motion has settled: from its states, or by Newton's method where these do not tell.

States that agree q firings apart do not show a period q by themselves. Near a period doubling neighbours take
turns about an orbit that they approach by a multiplier close to -1: states two firings apart agree long
before those one firing apart do. Near an unstable orbit, and where a stable one is about to be born, states
move so slowly that they seem to stand. So a period q counts as shown where

- states q firings apart have come to agree as closely as the noise of the runs allows, and
- states q / p firings apart are well apart, for all primes p that divide q, and their distance does not
  shrink any more: the steps of an integrator, which follow the state, make cycles of their own, far smaller.

Where one of the two is not so, the period is the smallest divisor d of q for which Newton's method finds a
stable orbit of d firings close to the states, which these approach.
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
"""Distance of states, in half-widths of the window, up to which no more is asked for."""

DISTINCT: Final = 1e-3
"""Distance, in half-widths, from which on states are different whatever the noise of the runs."""

LIES_ON: Final = 1e-6
"""Distance from a stable orbit, in half-widths, up to which states lie on it but for the noise of runs."""

NEAR: Final = 0.1
"""Distance, in half-widths, within which states of an orbit of fewer firings are looked for."""

_SHRINKS: Final = 1e-5
_NOISE: Final = 1e-9
"""Relative and absolute change of a distance that counts as shrinking, the latter in half-widths."""
_ITERATIONS: Final = 20

NO_ORBIT: Final = "Newton's method finds no stable orbit of {} there that the states approach"


class Settled(Declared):
    """What a motion has settled to."""

    period: int | None = part("firings after which the orbit repeats; None where there is no saying")
    states: FloatArray = part("displacement, m, and velocity, m/s, at its firings, shape (period, 2)")
    multiplier: float = part(
        "largest absolute value of a Floquet multiplier; NaN where Newton's method was not asked",
        default=math.nan,
    )
    reason: str = part("why there is no saying; else empty", default="")


def shown(points: FloatArray, period: int) -> BoolArray:
    """Tell of which motions the states alone show the period, given that these agree so many firings apart.

    Points, shape (n, m, k), are the states at m successive firings, divided by the scales.
    """
    _early, late = _apart(points, period, period)
    clear = np.asarray(late <= AGREES)
    for divisor in _largest_divisors(period):
        clear &= ~_shrinking(points, divisor, period) & (_apart(points, divisor, period)[1] >= DISTINCT)
    return clear


def settled(regime: Regime, points: FloatArray, period: int, scales: FloatArray) -> Settled:
    """Find the orbit to which one motion has settled, whose states agree `period` firings apart.

    Points, shape (m, k), are displacement, m, velocity, m/s, and what else belongs to the state, at
    successive sections; the scales, shape (k,), the half-widths of the window. Where no derivative is to be
    had, because a section falls into the pack or on a touch without velocity, or a current flows there,
    the states alone decide.
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
        # About an orbit that is approached by turns the mean lies closer than any of the states.
        guess = states[-period:].reshape(-1, count, 2).mean(axis=0)
        closing = close_orbits(
            maps, guess[np.newaxis], np.ones((1, count), np.int64), plane, goal=1e-13, enough=1e-9,
            iterations=_ITERATIONS,
        )[0]  # fmt: skip
        if not np.isfinite(closing.jacobians).all() or not closing.smooth:
            return _by_states(points, scaled, period)
        largest = float(abs(multipliers_of(closing.jacobians)[0]))
        if not closing.closed or largest >= 1.0:
            continue
        if approaches(states / plane, closing.states / plane, lies_on=noise_about(largest)):
            return Settled(count, closing.states, largest)
    return Settled(None, np.zeros((0, 2)), math.nan, NO_ORBIT.format(_firings(period)))


def approaches(points: FloatArray, orbit: FloatArray, within: float = NEAR, lies_on: float = LIES_ON) -> bool:
    """Tell whether states, shape (m, 2), approach the states of an orbit in its order, or lie on it.

    Not so where they come to rest beside it: then they slow down, and their distance from it does not.
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
    """Return how far from an orbit, in half-widths, states may lie for the noise of their runs alone.

    What bounds its basin lies further away the smaller the largest multiplier is.
    """
    return max(LIES_ON, DISTINCT * (1.0 - multiplier))


def _by_states(points: FloatArray, scaled: FloatArray, period: int) -> Settled:
    """Do as `settled` without derivatives."""
    early, late = _apart(scaled, period, period)
    shrinking = [bool(_shrinking(scaled, d, period)[0]) for d in _largest_divisors(period)]
    if late[0] > max(AGREES, early[0]) or any(shrinking):
        why = "the states still move, and the orbit has no derivative by which it could be found"
        return Settled(None, np.zeros((0, 2)), math.nan, why)
    return Settled(period, points[-period:, :2].copy())


def _apart(points: FloatArray, count: int, period: int) -> tuple[FloatArray, FloatArray]:
    """Return mean distances of states `count` firings apart, early and late, over whole periods."""
    apart = np.abs(points[:, count:] - points[:, :-count]).max(axis=2)
    part = period * max(apart.shape[1] // (4 * period), 1)
    return apart[:, :part].mean(axis=1), apart[:, -part:].mean(axis=1)


def _shrinking(points: FloatArray, count: int, period: int) -> BoolArray:
    early, late = _apart(points, count, period)
    return np.asarray(early - late > _SHRINKS * early + _NOISE)


def _largest_divisors(period: int) -> list[int]:
    """Return the divisors of a number, itself apart, of which all others are divisors."""
    primes = [p for p in range(2, period + 1) if period % p == 0 and all(p % k for k in range(2, p))]
    return [period // p for p in primes]


def _firings(count: int) -> str:
    return f"{count} firing{'s' if count > 1 else ''}"
