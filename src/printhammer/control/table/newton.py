"""A step of Newton's method for a dot: how firing time and width are to change."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from printhammer.support.arrays import FloatArray

LONGEST_STEP: Final = 25e-6
"""Longest change of either, s."""

_DAMPING: Final = 0.02


def changes(slopes: FloatArray, off: FloatArray, least: FloatArray, most: FloatArray) -> FloatArray:
    """Return changes of two times of a dot after which deviations are least in the mean square.

    Parameters
    ----------
    slopes : array, shape (dots, deviations, 2)
        Derivatives of the deviations after firing time, or advance, and width, 1/s.
    off : array, shape (dots, deviations)
        What they are now.
    least, most : array, shape (dots,)
        Bounds on the change of the width, s.

    Returns
    -------
    array, shape (dots, 2)
        Changes of these, s.
    """
    turned = slopes.transpose(0, 2, 1)
    # A little of what Levenberg and Marquardt do: a direction in which nothing changes is left alone.
    square = turned @ slopes + (_DAMPING / LONGEST_STEP) ** 2 * np.eye(2)
    change = -np.linalg.solve(square, turned @ off[:, :, np.newaxis])[:, :, 0]
    wider = np.clip(change[:, 1], least, most)
    along = slopes[:, :, 0]
    rest = off + slopes[:, :, 1] * wider[:, np.newaxis]
    length = np.maximum((along * along).sum(axis=1), np.finfo(np.float64).tiny)
    later = np.where(wider == change[:, 1], change[:, 0], -(along * rest).sum(axis=1) / length)
    return np.asarray(np.clip(np.column_stack([later, wider]), -LONGEST_STEP, LONGEST_STEP))
