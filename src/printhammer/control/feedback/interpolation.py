"""Linear interpolation in the tables of the controller, many places at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from printhammer.support.arrays import FloatArray, IntArray


def place_of(values: FloatArray, nodes: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the node below each value, and the share of the one above; nodes are evenly spaced."""
    place = (values - nodes[0]) / (nodes[1] - nodes[0])
    below = np.clip(place.astype(np.int64), 0, len(nodes) - 2)
    return below, place - below


def blend(low: FloatArray, high: FloatArray, share: FloatArray) -> FloatArray:
    """Return values between two, nearer the second one the larger its share."""
    return np.asarray((1.0 - share) * low + share * high)


def bilinear(table: FloatArray, i: IntArray, p: FloatArray, j: IntArray, q: FloatArray) -> FloatArray:
    """Return values of a table between rows i and i + 1, share p, and columns j and j + 1, share q."""
    low, high = blend(table[i, j], table[i, j + 1], q), blend(table[i + 1, j], table[i + 1, j + 1], q)
    return blend(low, high, p)


def blend_known(low: FloatArray, high: FloatArray, share: FloatArray) -> FloatArray:
    """Return values between two; where one is NaN, the other."""
    return blend(np.where(np.isnan(low), high, low), np.where(np.isnan(high), low, high), share)
