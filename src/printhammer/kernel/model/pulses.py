"""Drive at an instant, and the instants at which one of its pieces begins or ends.

A drive consists of n firing times and the waveform of each: a table of pieces ``[start, kind, p0, p1, p2,
p3]``, of which the last, of kind `END`, holds the end of support; `piece_value` defines the other kinds. The
tables of different waveforms are concatenated, the one with the longest support last; a firing refers to the
row at which its table begins. Active pieces are identified by their rows, not by comparing times, so that an
instant exactly on an edge belongs to the piece that begins there.

During a run, the active pieces are kept in one array ``live``: their number, then seven values each,
``[firing, start, kind, p0, p1, p2, p3]``. It is rewritten at every edge, and is the only data on the drive
that the force sum needs.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.model.layout import CUBIC_PIECE, END, EXPONENTIAL_PIECE, Train

Drive = Any
"""The array ``live``."""

LIVE_WIDTH = 7


@inlined
def piece_value(row: Any, i: int, s: float) -> float:
    """Return the value of a piece [kind, p0, p1, p2, p3] at place `i` of a row, at time `s` [s] in it.

    A cubic p0 + s (p1 + s (p2 + s p3)), an exponential p0 + p1 exp(-p2 s), a sine p0 + p1 sin(p2 s + p3).
    """
    kind = row[i]
    if kind == EXPONENTIAL_PIECE:
        return float(row[i + 1] + row[i + 2] * math.exp(-row[i + 3] * s))
    if kind == CUBIC_PIECE:
        return float(row[i + 1] + s * (row[i + 2] + s * (row[i + 3] + s * row[i + 4])))
    return float(row[i + 1] + row[i + 2] * math.sin(row[i + 3] * s + row[i + 4]))


@compiled
def piece_rate(row: Any, i: int, s: float) -> float:
    """Return the time derivative of a piece; see `piece_value`."""
    kind, p1, p2, p3 = row[i], row[i + 2], row[i + 3], row[i + 4]
    if kind == EXPONENTIAL_PIECE:
        return float(-p1 * p2 * math.exp(-p2 * s))
    if kind == CUBIC_PIECE:
        return float(p1 + s * (2.0 * p2 + s * 3.0 * p3))
    return float(p1 * p2 * math.cos(p2 * s + p3))


@compiled
def piece_change(row: Any, i: int, s: float, changes: Any, j: int) -> float:
    """Return the derivative of a piece, see `piece_value`, along `changes` of p0 to p3 from place `j` on."""
    kind, p1, p2, p3 = row[i], row[i + 2], row[i + 3], row[i + 4]
    d0, d1, d2, d3 = changes[j], changes[j + 1], changes[j + 2], changes[j + 3]
    if kind == EXPONENTIAL_PIECE:
        return float(d0 + math.exp(-p2 * s) * (d1 - p1 * s * d2))
    if kind == CUBIC_PIECE:
        return float(d0 + s * (d1 + s * (d2 + s * d3)))
    turn = p2 * s + p3
    return float(d0 + d1 * math.sin(turn) + p1 * math.cos(turn) * (d2 * s + d3))


@inlined
def sum_of_pulses(t: float, drive: Drive) -> float:
    """Return the sum of the active pulses, of which there is at least one."""
    total = 0.0
    i = 1
    for _ in range(int(drive[0])):
        total += piece_value(drive, i + 2, (t - drive[i]) - drive[i + 1])
        i += LIVE_WIDTH
    return total


@inlined
def drive_value(t: float, drive: Drive) -> float:
    """Return the sum of all active pulses at time `t` [s]: amperes or newtons."""
    if drive[0] == 0.0:
        return 0.0
    return sum_of_pulses(t, drive)


@compiled
def pass_edges(
    t: float,
    train: Train,
    first: int,
    last: int,
) -> tuple[int, int, float]:
    """Start and end all pieces whose edge is not after time `t` [s], and rewrite `live`.

    Pulses before `first` have ended, those from `last` on have not been fired; pulse p in between is in the
    piece ``under_way[p]``, which is the end of its table if it ended before an older pulse. With `replace`, a
    firing cuts off earlier pulses.

    Returns
    -------
    tuple
        The new `first` and `last`, equal if no pulse is under way, and the time of the next edge [s],
        infinity if there is none.
    """
    firings, begins, pieces, replace, under_way, live = train
    while last < firings.size and firings[last] <= t:
        under_way[last] = begins[last]
        last += 1
        if replace:
            first = last - 1
    edge = firings[last] if last < firings.size else np.inf
    count = 0
    i = 1
    for p in range(first, last):
        row = under_way[p]
        while pieces[row, 1] != END and firings[p] + pieces[row + 1, 0] <= t:
            row += 1
        under_way[p] = row
        if pieces[row, 1] == END:
            if p == first:
                first += 1
            continue
        edge = min(edge, firings[p] + pieces[row + 1, 0])
        live[i] = firings[p]
        for j in range(6):
            live[i + 1 + j] = pieces[row, j]
        i += LIVE_WIDTH
        count += 1
    live[0] = count
    return first, last, edge


@compiled
def edges_at(t: float, train: Train) -> tuple[int, int, float]:
    """Like `pass_edges` from the start, but without the pulses that ended before time `t` [s]."""
    firings, pieces = train.firings, train.pieces
    # The last table has the longest support.
    oldest = t - pieces[pieces.shape[0] - 1, 0]
    low, high = 0, firings.size
    while low < high:
        middle = (low + high) // 2
        if firings[middle] < oldest:
            low = middle + 1
        else:
            high = middle
    # One more than necessary: by rounding a pulse may end at `t`.
    low = max(low - 1, 0)
    return pass_edges(t, train, low, low)
