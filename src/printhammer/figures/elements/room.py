"""Where on a panel there is room for a label or an insert: away from the curves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from matplotlib.axes import Axes

    from printhammer.support.arrays import FloatArray

CURVE: Final = "curve:"
"""Beginning of the label of every line that counts as a curve."""

_SPACING: Final = 0.004


def occupied(ax: Axes) -> FloatArray:
    """Return points on the curves of a panel, fractions of the axes, shape (n, 2).

    They are so close that no label fits between two of them.
    """
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    every = [np.empty((0, 2))]
    for line in ax.lines:
        if not str(line.get_label()).startswith(CURVE):
            continue
        x = (np.asarray(line.get_xdata(), dtype=np.float64) - left) / (right - left)
        y = (np.asarray(line.get_ydata(), dtype=np.float64) - bottom) / (top - bottom)
        known = np.isfinite(x) & np.isfinite(y)
        x, y = np.clip(x[known], -1.0, 2.0), np.clip(y[known], -1.0, 2.0)
        length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        at = np.linspace(0.0, length[-1], max(2, int(length[-1] / _SPACING)))
        every.append(np.column_stack([np.interp(at, length, x), np.interp(at, length, y)]))
    return np.concatenate(every)


def freest(
    points: FloatArray, size: tuple[float, float], corners: Iterable[tuple[float, float]]
) -> tuple[tuple[float, float], int]:
    """Return the first of several places for a box that no point lies in, or the one with the fewest points.

    Points, shape (n, 2), width and height of the box, and its lower left corner at each place, best place
    first, are fractions of the axes. With the corner comes the number of points covered there.
    """
    width, height = size
    best: tuple[float, float] = (0.0, 0.0)
    fewest = -1
    for left, bottom in corners:
        inside = (points[:, 0] > left) & (points[:, 0] < left + width)
        inside &= (points[:, 1] > bottom) & (points[:, 1] < bottom + height)
        count = int(inside.sum())
        if fewest < 0 or count < fewest:
            best, fewest = (left, bottom), count
        if count == 0:
            break
    return best, fewest
