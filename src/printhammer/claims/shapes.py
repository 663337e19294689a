"""Numbers read off a motion or a set of points: largest values, rank correlation."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.support.arrays import FloatArray

_POINTS: Final = 4001
_ZOOMS: Final = 6


def largest(function: Callable[[FloatArray], FloatArray], start: float, end: float) -> float:
    """Return the largest value of a function of time, on grids ever closer about the largest."""
    best = -np.inf
    for _ in range(_ZOOMS if end > start else 1):
        grid = np.linspace(start, end, _POINTS)
        values = function(grid)
        top = int(np.argmax(values))
        best = max(best, float(values[top]))
        start, end = grid[max(top - 1, 0)], grid[min(top + 1, _POINTS - 1)]
    return best


def falling(values: Sequence[float]) -> bool:
    """Whether each value is below the one before."""
    return all(after < before for before, after in itertools.pairwise(values))


def rank_correlation(first: Sequence[float], second: Sequence[float]) -> float | None:
    """Return Spearman's rank correlation, ties at their mean rank; None where it is not defined."""
    if len(first) < 2 or len(set(first)) < 2 or len(set(second)) < 2:
        return None
    a, b = _ranks(first), _ranks(second)
    a, b = a - a.mean(), b - b.mean()
    return float(np.sum(a * b) / np.sqrt(np.sum(a * a) * np.sum(b * b)))


def _ranks(values: Sequence[float]) -> FloatArray:
    data = np.asarray(values, dtype=np.float64)
    below, equal = data[:, np.newaxis] > data, data[:, np.newaxis] == data
    return np.asarray(below.sum(axis=1) + 0.5 * equal.sum(axis=1), dtype=np.float64)


def spread(values: Sequence[float]) -> float:
    """Largest less smallest."""
    return max(values) - min(values)
