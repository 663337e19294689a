"""All roots of a scalar function on an interval, to full double precision.

The function is smooth between the points of a grid. The search looks for sign changes, and for pairs of roots
between grid points, and bisects each bracket down to neighbouring floating-point numbers.

`bisected` and `find_roots` are plain functions, which can be compiled: they call ``function(x, about)`` and
write to arrays. `bisect` and `roots` are their counterparts for functions of one number.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

_PIECES: Final = 16  # Number of subintervals per round of refinement; arbitrary
_ROUNDS: Final = 16  # Number of rounds: 16^16 subintervals resolve all bits of a double
_PROBE: Final = 1e-6  # Distance of a probe from a root at a grid point, as a fraction of the cell; arbitrary
_SLOPE: Final = 1e-3  # Step of the slope at the ends of a cell, as a fraction of the cell; arbitrary
# Largest length of an interval of zeros that counts as one root, since rounding widens a root; arbitrary
_FLAT: Final = 1e-12


MOST_POINTS: Final = 3
"""Largest number of evaluations per grid point, since a root on the grid has a probe on either side."""


@dataclass(frozen=True)
class Root:
    """Root of a function, with the sign of the function on either side, -1 or 1, or 0 outside the grid."""

    x: float
    before: int
    after: int


def bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Find a root by bisection of a bracket with a sign change.

    Returns
    -------
    The float next to the sign change at which the absolute value of the function is smaller.
    """
    return bisected(_call, function, low, high)


def roots(function: Callable[[float], float], grid: Sequence[float]) -> list[Root]:
    """Find the roots of a function on an ascending grid.

    Intervals where the function is NaN are skipped, as are intervals longer than 1e-12 where the function is
    zero, which contain no isolated root. Two roots between neighbouring grid points are found, unless they
    lie closer together than about 1e-8 of the grid spacing; of three roots only one is found.
    """
    room = MOST_POINTS * len(grid)
    found = np.empty((room, 3))
    count = find_roots(_call, function, grid, len(grid), [0.0] * room, [0.0] * room, found)
    isolated = [Root(x, int(before), int(after)) for x, before, after in found[:count].tolist()]
    return sorted(isolated, key=lambda root: root.x)


def _call(x: float, function: Callable[[float], float]) -> float:
    return function(x)


def bisected(function: Any, about: Any, low: float, high: float) -> float:
    """Find a root of ``function(x, about)`` by bisection; see `bisect`."""
    at_low, at_high = function(low, about), function(high, about)
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return low if abs(at_low) <= abs(at_high) else high
        value = function(middle, about)
        if value == 0.0:
            return middle
        if (value > 0.0) == (at_low > 0.0):
            low, at_low = middle, value
        else:
            high, at_high = middle, value


def find_roots(function: Any, about: Any, grid: Any, count: int, places: Any, values: Any, found: Any) -> int:
    """Find the roots of ``function(x, about)`` on an ascending grid; see `roots`.

    Parameters
    ----------
    function, about
        Function and its second argument.
    grid : float64 array
        Points of the grid.
    count : int
        Number of points.
    places, values : float64 array, shape (3 count,)
        Working space.
    found : float64 array, shape (3 count, 3)
        Root, and sign of the function before and after the root; 0 at an end of the grid.

    Returns
    -------
    int
        Number of roots.
    """
    points = with_probes(function, about, grid, count, places, values)
    roots_found, first = 0, 0
    for k in range(points + 1):
        if k == points or math.isnan(values[k]):
            if first < k:
                roots_found = in_stretch(function, about, places, values, first, k - 1, found, roots_found)
            first = k + 1
    return roots_found


def with_probes(function: Any, about: Any, grid: Any, count: int, places: Any, values: Any) -> int:
    """Evaluate a function on a grid and at probes on both sides of grid points that are roots.

    The points are written to `places`, and the values of the function to `values`.

    Returns
    -------
    int
        Number of points written to `places` and `values`.
    """
    n = 0
    for k in range(count):
        x = grid[k]
        value = function(x, about)
        if value == 0.0 and k > 0:
            places[n] = x - _PROBE * (x - grid[k - 1])
            values[n] = function(places[n], about)
            n += 1
        places[n], values[n] = x, value
        n += 1
        if value == 0.0 and k + 1 < count:
            places[n] = x + _PROBE * (grid[k + 1] - x)
            values[n] = function(places[n], about)
            n += 1
    return n


def in_stretch(
    function: Any, about: Any, places: Any, values: Any, begin: int, last: int, found: Any, count: int
) -> int:
    """Append the roots between the points `begin` and `last` to `found`; return the new number of roots.

    `begin` and `last` are indices in `places` and `values`, between which no value is NaN; `count` is the
    previous number of roots.
    """
    k = begin
    while k <= last:
        x, value = places[k], values[k]
        if value == 0.0:
            first = k
            while k < last and values[k + 1] == 0.0:
                k += 1
            alone = places[k] - places[first] <= _FLAT and not (first == begin and k == last)
            if alone:
                before = sign_of(values[first - 1]) if first > begin else 0.0
                after = sign_of(values[k + 1]) if k < last else 0.0
                count = put_root(found, count, places[begin + (first + k - 2 * begin) // 2], before, after)
        elif k < last:
            end, after = places[k + 1], values[k + 1]
            sign = sign_of(value)
            if value * after < 0.0:
                count = put_root(found, count, bisected(function, about, x, end), sign, sign_of(after))
            elif after != 0.0:
                best, height = dip_of(function, about, x, value, end, after)
                if height < 0.0:
                    count = put_root(found, count, bisected(function, about, x, best), sign, -sign)
                    count = put_root(found, count, bisected(function, about, best, end), -sign, sign)
                elif height == 0.0:
                    count = put_root(found, count, best, sign, sign)
        k += 1
    return count


def dip_of(
    function: Any, about: Any, low: float, at_low: float, high: float, at_high: float
) -> tuple[float, float]:
    """Search for a dip to zero between two points at which the function has the same sign.

    The height is the value of the function times its sign at the two points.

    Returns
    -------
    tuple of float
        Point with the smallest height, and this height: positive if the function does not reach zero.
    """
    sign = sign_of(at_low)
    step = _SLOPE * (high - low)
    if sign * (function(low + step, about) - at_low) >= 0.0:
        return low, 1.0
    if sign * (function(high - step, about) - at_high) >= 0.0:
        return low, 1.0
    left, right = low, high
    for _ in range(_ROUNDS):
        lowest, highest, k = math.inf, -math.inf, 0
        for piece in range(_PIECES + 1):
            height = sign * function(left + (right - left) * piece / _PIECES, about)
            highest = max(highest, height)
            if height < lowest:
                lowest, k = height, piece
        best = left + (right - left) * k / _PIECES
        # Refine only where the smallest height is at most half of the largest.
        if lowest <= 0.0 or lowest > highest - lowest:
            return best, lowest
        width = right - left
        left, right = left + width * max(k - 1, 0) / _PIECES, left + width * min(k + 1, _PIECES) / _PIECES
    return left, 1.0


def put_root(found: Any, count: int, x: float, before: float, after: float) -> int:
    """Append a root, with the signs of the function on both sides, to `found`; return the new root count."""
    found[count, 0], found[count, 1], found[count, 2] = x, before, after
    return count + 1


def sign_of(value: float) -> float:
    """Return the sign of a number: -1, 0 or 1."""
    if value > 0.0:
        return 1.0
    return -1.0 if value < 0.0 else 0.0
