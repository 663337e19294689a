"""Segment tables: the representation of every waveform in the kernel.

A table is a float64 array of shape (segments + 1, 6) with rows ``[start, kind, p0, p1, p2, p3]``. With tau
the time since the firing and s = tau - start, a segment's value is

====  ==================================  ================================
kind  value                               used by
====  ==================================  ================================
0     p0 + s (p1 + s (p2 + s p3))         plateaus, ramps, sampled records
1     p0 + p1 exp(-p2 s)                  rise and decay of a coil current
2     p0 + p1 sin(p2 s + p3)              half sine, sinusoidal force
4     p0, a voltage; thresholds p2, p3    supply on, with a chopper
5     0; decays against p0                supply off
6     p0, the initial voltage             reservoir
====  ==================================  ================================

The first row starts at 0, starts ascend strictly, and the last row ``[end, 0, 0, 0, 0, 0]`` marks the end of
the support (possibly infinite); the value is zero before time 0, at the end and after it. Values are
right-continuous at every start.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from typing import Final

import numpy as np
import numpy.typing as npt

from printhammer.drive.tables import ROWS, fill_table, largest_value
from printhammer.support.arrays import FloatArray

POLYNOMIAL: Final = 0
EXPONENTIAL: Final = 1
SINE: Final = 2
END: Final = 3
"""Kind of the end row of a segment table when several tables are stacked in one array for the kernel."""
SWITCHED: Final = 4
"""Kind of a driver's segment with the supply on; the value is the supply voltage p0."""
DECAY: Final = 5
"""Kind of a driver's segment with the supply off; the value is 0."""
RESERVOIR: Final = 6
"""Kind of a driver's segment in which a reservoir feeds the coil."""
COLUMNS: Final = 6  # Number of columns of a table

_KEPT: Final = 1024  # Number of cached segment tables; arbitrary
_CHUNK: Final = 1024  # Number of intervals evaluated at once, which bounds the memory; arbitrary
_REFINED: Final = 16  # Number of intervals with the largest samples, which are refined; arbitrary
_ROUNDS: Final = 9  # Rounds of refinement, so that a maximum is located to 1e-9 of the interval


def table(rows: Iterable[Sequence[float]], end: float) -> FloatArray:
    """Build a read-only segment table, shape (segments + 1, 6).

    Segments that have zero duration due to rounding are removed.

    Rows ``(start, kind, p0, p1, p2, p3)`` are in ascending order of start; a first start above 0 gets a zero
    segment before it. `end` is the end of the support, s; ``inf`` for a drive that never ends.
    """
    listed = [[float(entry) for entry in row] for row in rows]
    if listed and listed[0][0] > 0.0:
        listed.insert(0, [0.0] * COLUMNS)
    listed.append([float(end), 0.0, 0.0, 0.0, 0.0, 0.0])
    kept = [row for row, after in itertools.pairwise(listed) if row[0] < after[0]]
    result = np.array([*kept, listed[-1]], dtype=np.float64)
    result.flags.writeable = False
    return result


def stacked(tables: Sequence[FloatArray]) -> tuple[list[int], FloatArray]:
    """Concatenate segment tables for the kernel in order of pulse duration, with end rows marked.

    Returns
    -------
    tuple
        In this order: for each table of `tables`, the index of its first row in the stacked rows; the stacked
        rows, shape (all rows, 6), read-only.
    """
    order = sorted(range(len(tables)), key=lambda number: float(tables[number][-1, 0]))
    begins, row = [0] * len(tables), 0
    for number in order:
        begins[number] = row
        row += len(tables[number])
    pieces = np.concatenate([tables[number] for number in order])
    pieces[[begins[number] + len(tables[number]) - 1 for number in order], 1] = END
    pieces.flags.writeable = False
    return begins, pieces


def evaluate(segments: FloatArray, t: npt.ArrayLike, fired: npt.ArrayLike = 0.0) -> FloatArray:
    """Evaluate a segment table at times t for pulses fired at the times ``fired``.

    Both arrays, in s, are broadcast together. Values are right-continuous; an edge lies at the rounded sum of
    the firing time and the start of its segment, as in the kernel. NaN yields NaN.
    """
    time, fire = np.broadcast_arrays(np.asarray(t, dtype=np.float64), np.asarray(fired, dtype=np.float64))
    starts = segments[:, 0]
    last = len(starts) - 1
    tau = time - fire
    index = np.searchsorted(starts, tau, side="right") - 1
    # (fired + start) - fired may round below start; comparing with the edges avoids that.
    late = (index < last) & (fire + starts[np.minimum(index + 1, last)] <= time)
    index = np.where(late, index + 1, index)
    early = (index >= 0) & (fire + starts[np.maximum(index, 0)] > time)
    index = np.where(early, index - 1, index)
    active = (index >= 0) & (index < last) & np.isfinite(tau)
    _, kind, p0, p1, p2, p3 = np.moveaxis(segments[np.where(active, index, last)], -1, 0)
    # The parameters of a driver's segment are limits and resistances, not coefficients of a polynomial.
    p0 = np.where(kind == DECAY, 0.0, p0)
    p1, p2, p3 = (np.where(kind >= SWITCHED, 0.0, each) for each in (p1, p2, p3))
    s = np.where(active, np.maximum(tau - starts[np.where(active, index, 0)], 0.0), 0.0)
    polynomial = p0 + s * (p1 + s * (p2 + s * p3))
    exponential = p0 + p1 * np.exp(np.where(kind == EXPONENTIAL, -p2 * s, 0.0))
    sine = p0 + p1 * np.sin(p2 * s + p3)
    value = np.where(kind == EXPONENTIAL, exponential, np.where(kind == SINE, sine, polynomial))
    value = np.where(active, value, 0.0)
    return np.where(np.isnan(tau), np.nan, value)


@lru_cache(maxsize=_KEPT)
def filled(shape: int, fields: tuple[float, ...]) -> FloatArray:
    """Build the segment table of a waveform of a given shape, read-only.

    `shape` is a code of `printhammer.drive.tables`, and `fields` the constants of the shape, in order of
    declaration.
    """
    rows = np.empty((ROWS, COLUMNS))
    result = rows[: fill_table(shape, fields, rows)].copy()
    result.flags.writeable = False
    return result


def largest(segments: FloatArray) -> float:
    """Return the largest absolute value that a segment table takes or approaches."""
    return largest_value(segments)


def largest_sum(edges: FloatArray, value: Callable[[FloatArray], FloatArray]) -> float:
    """Find the largest absolute value of a sum of pulses; `value` evaluates the sum at times, s.

    `edges` are the ascending start and end times of all segments, s, at least two; between them the sum is
    smooth. Each interval is sampled, densely near its start, where exponentials vary; the intervals with the
    largest samples are refined until the position of the maximum is known to 1e-9 of the interval.
    """
    fractions = np.union1d(np.linspace(0.0, 1.0, 33), np.geomspace(1e-6, 1.0, 31))
    starts, ends = edges[:-1], np.nextafter(edges[1:], -np.inf)
    sampled = np.empty(len(starts))
    for k in range(0, len(starts), _CHUNK):
        part = slice(k, k + _CHUNK)
        grid = starts[part, np.newaxis] + (ends - starts)[part, np.newaxis] * fractions
        sampled[part] = np.abs(value(np.minimum(grid, ends[part, np.newaxis]))).max(axis=1)
    best = float(sampled.max())
    highest = np.argsort(sampled)[-_REFINED:]
    every, first, last = np.arange(len(highest)), starts[highest], ends[highest, np.newaxis]
    grid = np.minimum(first[:, np.newaxis] + (ends[highest] - first)[:, np.newaxis] * fractions, last)
    for _ in range(_ROUNDS):
        heights = np.abs(value(grid))
        best = max(best, float(heights.max()))
        top = heights.argmax(axis=1)
        low, high = grid[every, np.maximum(top - 1, 0)], grid[every, np.minimum(top + 1, grid.shape[1] - 1)]
        grid = np.minimum(np.linspace(low, high, 33, axis=1), last)
    return best
