"""Recurrence plots and recurrence quantification analysis of a series of states.

The recurrence matrix has a point at (i, j) where the states i and j lie within a threshold of each other. Its
diagonal lines are stretches during which the motion repeats an earlier stretch; its vertical lines are
stretches during which the motion stays in place. The quantities are defined by N. Marwan, M. C. Romano, M.
Thiel and J. Kurths, Phys. Rep. 438 (2007) 237, section 3.5.
"""

from __future__ import annotations

import math
from typing import Final, SupportsIndex

import numpy as np
import numpy.typing as npt

from printhammer.chaos.strobe.points import Strobe, points_of
from printhammer.chaos.strobe.verdict import AGREEMENT
from printhammer.drive.input import read_array, read_count
from printhammer.errors import InputError
from printhammer.results import Result, column, scalar
from printhammer.run.regime import Regime
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

MOST: Final = 4096
"""Largest number of states of a recurrence plot, whose matrix then has 16 million points; arbitrary."""

RATE: Final = 0.05
"""Default recurrence rate, used if neither a threshold nor a rate is given; arbitrary."""

SHORTEST: Final = 2
"""Default length of the shortest line, in points; a line has two points by definition."""

_ROWS: Final = 256  # Rows of the distance matrix computed at once, which bounds the memory; arbitrary


class Recurrence(Result):
    """Recurrence plot of a series of states, and its quantification."""

    matrix: BoolArray = column(
        "1", "whether two states lie within the threshold of each other", "i j", name="recurs", dtype=np.int8
    )
    threshold: float = scalar("1", "largest distance of recurrent states", more="in units of the scales")
    theiler: int = scalar(
        "1",
        "Theiler window: pairs of states less than this many steps apart are excluded",
        more="1 excludes the main diagonal only",
    )
    shortest: int = scalar("1", "length of the shortest line, in points")
    rate: float = scalar("1", "fraction of the counted pairs that recur")
    determinism: float = scalar(
        "1", "fraction of the recurrent pairs that lie on diagonal lines", more="nan if no pair recurs"
    )
    mean_diagonal: float = scalar("1", "mean length of the diagonal lines", more="nan without such lines")
    longest_diagonal: int = scalar(
        "1",
        "length of the longest diagonal line, 0 without a line",
        more="without the main diagonal; the inverse is the divergence",
    )
    entropy: float = scalar("nat", "entropy of the lengths of the diagonal lines")
    laminarity: float = scalar(
        "1", "fraction of the points that lie on vertical lines", more="including the main diagonal"
    )
    trapping: float = scalar("1", "mean length of the vertical lines", more="nan without such lines")
    longest_vertical: int = scalar("1", "length of the longest vertical line, 0 without a line")

    @property
    def title(self) -> str:
        """Title of the result: "recurrence plot"."""
        return "recurrence plot"

    @property
    def quantities(self) -> dict[str, float]:
        """Quantities of the recurrence quantification analysis, by name."""
        names = (
            *("rate", "determinism", "mean_diagonal", "longest_diagonal", "entropy"),
            *("laminarity", "trapping", "longest_vertical"),
        )
        return {name: getattr(self, name) for name in names}


def recurrence(
    states: npt.ArrayLike | Strobe | Regime,
    *,
    threshold: float | None = None,
    rate: float | None = None,
    scales: npt.ArrayLike | None = None,
    theiler: SupportsIndex = 1,
    shortest: SupportsIndex = SHORTEST,
) -> Recurrence:
    """Compute the recurrence plot of a series of states, or of strobe points.

    Parameters
    ----------
    states : array, Strobe or Regime
        One row, or one number, per state; at most 4096 states. Displacement, velocity and pack memory of
        strobe points are used. For a regime, a thousand points are computed after a thousand firings.
    threshold : float, optional
        Largest distance between two recurrent states, in units of the scales. The distance is the largest
        difference of a component.
    rate : float, optional
        Recurrence rate from which the threshold is computed, instead of `threshold`; 0.05 if neither is
        given. The actual rate is larger if many distances are equal, or if strobe points agree within the
        tolerance of the classification.
    scales : array, optional
        Scales of the components; by default the half-widths of the window of a strobe, and 1 for other
        states.
    theiler : int, optional
        Theiler window: pairs of states less than this many steps apart are excluded, so that a slow motion
        does not count as a recurrence.
    shortest : int, optional
        Length of the shortest line, in points.

    Returns
    -------
    Recurrence
        The matrix and its quantification.

    Raises
    ------
    InputError
        There are too many or too few states, a state is not finite (e.g. because a run ended early), both
        threshold and rate are given, or the number of scales is not that of the components of a state.
    """
    points = points_of(states, {})
    rows, units = rows_of(points, scales, MOST)
    # States of a settled train differ only by rounding, which the threshold must exceed.
    floor = AGREEMENT if isinstance(points, Strobe) and scales is None else 0.0
    count = len(rows)
    apart, least = read_count(theiler, "theiler"), read_count(shortest, "shortest")
    if apart >= count:
        raise InputError.of("theiler", apart, f"less than the number of states, {count}", written=str(apart))
    if threshold is not None and rate is not None:
        raise InputError("threshold and rate", key="threshold", expected="one of them")
    scaled = rows / units
    distances = _distances(scaled)
    if threshold is None:
        threshold = max(_threshold(distances, apart, RATE if rate is None else rate), floor)
    elif not (math.isfinite(threshold) and threshold >= 0.0):
        raise InputError.of("threshold", threshold, "a number, not negative")
    return counted(distances <= threshold, float(threshold), apart, least)


def counted(matrix: BoolArray, threshold: float, theiler: int, shortest: int) -> Recurrence:
    """Quantify the diagonal and vertical lines of a symmetric recurrence matrix.

    Diagonals less than `theiler` points from the main diagonal, and lines of fewer than `shortest` points,
    are excluded; `threshold` is the distance from which the matrix was computed.
    """
    count = len(matrix)
    # The matrix is symmetric: one half of it contains all diagonal lines.
    diagonals = np.sort(
        np.concatenate([run_lengths(matrix.diagonal(k)) for k in range(theiler, count)] or [np.zeros(0, int)])
    )
    verticals = np.sort(np.concatenate([run_lengths(column) for column in matrix.T]))
    points = int(diagonals.sum())
    pairs = (count - theiler) * (count - theiler + 1) // 2
    lines, upright = diagonals[diagonals >= shortest], verticals[verticals >= shortest]
    shares = np.unique(lines, return_counts=True)[1] / max(lines.size, 1)
    return Recurrence(
        matrix=matrix,
        threshold=threshold,
        theiler=theiler,
        shortest=shortest,
        rate=points / pairs,
        determinism=float(lines.sum() / points) if points else math.nan,
        mean_diagonal=float(lines.mean()) if lines.size else math.nan,
        longest_diagonal=int(lines.max(initial=0)),
        entropy=float(-(shares * np.log(shares)).sum()) if lines.size else 0.0,
        laminarity=float(upright.sum() / verticals.sum()),
        trapping=float(upright.mean()) if upright.size else math.nan,
        longest_vertical=int(upright.max(initial=0)),
    )


def run_lengths(points: BoolArray) -> IntArray:
    """Compute the lengths of the runs of True values in a boolean array, in order."""
    steps = np.diff(np.concatenate([[0], points.astype(np.int8), [0]]))
    return np.asarray(np.flatnonzero(steps == -1) - np.flatnonzero(steps == 1), dtype=np.int64)


def _distances(scaled: FloatArray) -> FloatArray:
    """Compute the maximum-norm distances between all pairs of scaled states, one row per state."""
    count = len(scaled)
    distances = np.empty((count, count))
    for first in range(0, count, _ROWS):
        some = scaled[first : first + _ROWS, np.newaxis] - scaled[np.newaxis]
        distances[first : first + _ROWS] = np.abs(some).max(axis=2)
    return distances


def _threshold(distances: FloatArray, theiler: int, rate: float) -> float:
    """Find the smallest distance threshold whose recurrence rate is at least `rate`.

    Pairs of states less than `theiler` steps apart are excluded.
    """
    if not 0.0 < rate <= 1.0:
        raise InputError.of("rate", rate, "a fraction of all pairs, above 0 and up to 1")
    pairs = distances[np.triu_indices(len(distances), theiler)]
    wanted = max(math.ceil(rate * pairs.size), 1) - 1
    return float(np.partition(pairs, wanted)[wanted])


def rows_of(
    states: npt.ArrayLike | Strobe, scales: npt.ArrayLike | None, most: int
) -> tuple[FloatArray, FloatArray]:
    """Return states as an array with one row per state, and the scales of their components.

    Raises InputError if there are more than `most` states, a state is not finite, or the scales are invalid.
    """
    if isinstance(states, Strobe):
        rows = np.column_stack([states.x, states.v, states.memory])
        units = states.window.half_widths[[0, 1, 0]]
        if not np.isfinite(rows).all():
            raise InputError(
                f"states: the run ended early ({states.status})", key="states", expected="a complete run"
            )
    else:
        rows = read_array(states, "states", "numbers, one row per state")
        rows = rows[:, np.newaxis] if rows.ndim == 1 else rows
        if rows.ndim != 2:
            raise InputError(
                f"states: an array of shape {rows.shape}", key="states", expected="one row per state"
            )
        units = np.ones(rows.shape[1])
    if not 2 <= len(rows) <= most:
        raise InputError(f"states: {len(rows)} states", key="states", expected=f"2 to {most}")
    if not np.isfinite(rows).all():
        raise InputError("states: not all are finite", key="states", expected="finite numbers")
    if scales is not None:
        units = np.asarray(scales, dtype=np.float64)
    if units.shape != (rows.shape[1],) or not (np.isfinite(units) & (units > 0.0)).all():
        raise InputError.of("scales", scales, f"{rows.shape[1]} positive numbers")
    return rows, units
