"""All roots of a scalar function on an interval, to full double precision.

The function is smooth between the points of a grid. The search looks for sign changes, and for pairs of roots
between grid points, and bisects each bracket down to neighbouring floating-point numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

_PIECES: Final = 16  # Number of subintervals per round of refinement; arbitrary
_ROUNDS: Final = 16  # Number of rounds: 16 rounds of 16 subintervals exhaust the bits of a float
_PROBE: Final = 1e-6  # Distance of a probe from a root at a grid point, as a fraction of the cell; arbitrary
_SLOPE: Final = 1e-3  # Step of the slope at the ends of a cell, as a fraction of the cell; arbitrary
# Rounding turns a root into a short stretch of zeros.
_FLAT: Final = 1e-12


@dataclass(frozen=True)
class Root:
    """Root of a function, with the sign of the function on either side: -1 or 1; 0 at an end of the grid."""

    x: float
    before: int
    after: int


def bisect(function: Callable[[float], float], low: float, high: float) -> float:
    """Find a root by bisection of a bracket with a sign change.

    Returns
    -------
    The float next to the sign change at which the absolute value of the function is smaller.
    """
    at_low, at_high = function(low), function(high)
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return low if abs(at_low) <= abs(at_high) else high
        value = function(middle)
        if value == 0.0:
            return middle
        if (value > 0.0) == (at_low > 0.0):
            low, at_low = middle, value
        else:
            high, at_high = middle, value


def roots(function: Callable[[float], float], grid: Sequence[float]) -> list[Root]:
    """Find the roots of a function on an ascending grid.

    Intervals where the function is NaN are skipped, as are intervals longer than 1e-12 where the function is
    zero, which contain no isolated root. Two roots between neighbouring grid points are found, unless they
    lie closer together than about 1e-8 of the grid spacing; of three roots only one is found.
    """
    isolated: list[Root] = []
    points = _with_probes(function, grid)
    for first, last in _stretches([value for _, value in points]):
        isolated += _in_stretch(function, points[first : last + 1])
    return sorted(isolated, key=lambda root: root.x)


def _with_probes(function: Callable[[float], float], grid: Sequence[float]) -> list[tuple[float, float]]:
    """Evaluate a function on the grid, and beside grid points that are roots, for the signs on both sides."""
    points: list[tuple[float, float]] = []
    for k, x in enumerate(grid):
        value = function(x)
        if value == 0.0 and k > 0:
            before = x - _PROBE * (x - grid[k - 1])
            points.append((before, function(before)))
        points.append((x, value))
        if value == 0.0 and k + 1 < len(grid):
            after = x + _PROBE * (grid[k + 1] - x)
            points.append((after, function(after)))
    return points


def _stretches(values: Sequence[float]) -> Iterator[tuple[int, int]]:
    """Split the grid into runs of points without NaN; yield the first and last index of each run."""
    start = None
    for k, value in enumerate([*values, math.nan]):
        if math.isnan(value):
            if start is not None:
                yield start, k - 1
            start = None
        elif start is None:
            start = k


def _in_stretch(function: Callable[[float], float], points: Sequence[tuple[float, float]]) -> list[Root]:
    isolated = []
    last = len(points) - 1
    k = 0
    while k <= last:
        x, value = points[k]
        if value == 0.0:
            first = k
            while k < last and points[k + 1][1] == 0.0:
                k += 1
            alone = points[k][0] - points[first][0] <= _FLAT and not (first == 0 and k == last)
            if alone:
                before = points[first - 1][1] if first > 0 else 0.0
                after = points[k + 1][1] if k < last else 0.0
                isolated.append(Root(points[(first + k) // 2][0], _sign(before), _sign(after)))
        elif k < last:
            end, after = points[k + 1]
            if value * after < 0.0:
                isolated.append(Root(bisect(function, x, end), _sign(value), _sign(after)))
            elif after != 0.0:
                isolated += _pair(function, points[k], points[k + 1])
        k += 1
    return isolated


def _pair(
    function: Callable[[float], float], start: tuple[float, float], end: tuple[float, float]
) -> list[Root]:
    """Search for a pair of roots between two points at which the function has the same sign."""
    (low, at_low), (high, at_high) = start, end
    sign = _sign(at_low)
    step = _SLOPE * (high - low)
    if sign * (function(low + step) - at_low) >= 0.0 or sign * (function(high - step) - at_high) >= 0.0:
        return []
    left, right = low, high
    for _ in range(_ROUNDS):
        grid = [left + (right - left) * k / _PIECES for k in range(_PIECES + 1)]
        values = [sign * function(x) for x in grid]
        k = min(range(_PIECES + 1), key=values.__getitem__)
        best, height = grid[k], values[k]
        if height < 0.0:
            return [
                Root(bisect(function, low, best), sign, -sign),
                Root(bisect(function, best, high), -sign, sign),
            ]
        if height == 0.0:
            return [Root(best, sign, sign)]
        # Sample a dip that reaches zero far below its rims.
        if height > max(values) - height:
            return []
        left, right = grid[max(k - 1, 0)], grid[min(k + 1, _PIECES)]
    return []


def _sign(value: float) -> int:
    return (value > 0.0) - (value < 0.0)
