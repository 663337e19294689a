"""Value of the drive at a time, and the times of the edges at which its waveform pieces begin or end.

A drive consists of n firing times and the waveform of each: a table of pieces ``[start, kind, p0, p1, p2,
p3]``. The last piece, of kind `END`, holds the end of the waveform; `piece_value` defines the other kinds.
The tables of all waveforms are concatenated, the longest waveform last; a firing refers to the row at which
its table begins. Active pieces are identified by their rows, not by comparing times, so that an instant
exactly on an edge belongs to the piece that begins at the edge.

During a run, the array ``live`` holds the active pieces: their number, then seven values for each piece,
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
"""Array ``live`` of the active pieces; with a coil circuit, the tuple of ``live`` and the electric state."""

LIVE_WIDTH = 7
"""Number of elements of an active piece in ``live``: firing time and the row of the piece."""


@inlined
def piece_value(row: Any, i: int, s: float) -> float:
    """Evaluate the waveform piece [kind, p0, p1, p2, p3] at index `i` of a row at `s` [s] after its start.

    The kinds are a cubic p0 + s (p1 + s (p2 + s p3)), an exponential p0 + p1 exp(-p2 s) and a sine
    p0 + p1 sin(p2 s + p3).
    """
    kind = row[i]
    if kind == EXPONENTIAL_PIECE:
        return float(row[i + 1] + row[i + 2] * math.exp(-row[i + 3] * s))
    if kind == CUBIC_PIECE:
        return float(row[i + 1] + s * (row[i + 2] + s * (row[i + 3] + s * row[i + 4])))
    return float(row[i + 1] + row[i + 2] * math.sin(row[i + 3] * s + row[i + 4]))


@compiled
def piece_rate(row: Any, i: int, s: float) -> float:
    """Return the time derivative of a waveform piece; arguments as in `piece_value`."""
    kind, p1, p2, p3 = row[i], row[i + 2], row[i + 3], row[i + 4]
    if kind == EXPONENTIAL_PIECE:
        return float(-p1 * p2 * math.exp(-p2 * s))
    if kind == CUBIC_PIECE:
        return float(p1 + s * (2.0 * p2 + s * 3.0 * p3))
    return float(p1 * p2 * math.cos(p2 * s + p3))


@compiled
def piece_change(row: Any, i: int, s: float, changes: Any, j: int) -> float:
    """Return the linearised change of a waveform piece's value due to changes of its coefficients.

    The changes of p0 to p3 begin at `changes[j]`; the other arguments are as in `piece_value`.
    """
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
    """Return the sum of the active pulses at time `t` [s], A or N; at least one pulse must be active."""
    total = 0.0
    i = 1
    for _ in range(int(drive[0])):
        total += piece_value(drive, i + 2, (t - drive[i]) - drive[i + 1])
        i += LIVE_WIDTH
    return total


@inlined
def drive_value(t: float, drive: Drive) -> float:
    """Return the sum of all active pulses at time `t` [s], in amperes or newtons; 0 if none is active."""
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
    """Start and end all waveform pieces with edges up to time `t` [s], and rewrite `train.live`.

    Pulses before index `first` have ended; pulses from `last` on have not been fired. For a pulse p in
    between, ``under_way[p]`` is the row of its active piece, or its `END` row if the pulse p ended before an
    older pulse. With `replace`, a firing ends all earlier pulses.

    Returns
    -------
    tuple
        The new `first` and `last`, equal if no pulse is active, and the time of the next edge [s], infinity
        after the last edge.
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
    """Start and end all waveform pieces with edges up to time `t` [s], from the beginning of the train.

    Pulses that ended long before `t` are skipped. The result is that of `pass_edges`.
    """
    firings, pieces = train.firings, train.pieces
    # The last table holds the longest waveform.
    oldest = t - pieces[pieces.shape[0] - 1, 0]
    low, high = 0, firings.size
    while low < high:
        middle = (low + high) // 2
        if firings[middle] < oldest:
            low = middle + 1
        else:
            high = middle
    # Include one more pulse than necessary: due to rounding, a pulse may end exactly at `t`.
    low = max(low - 1, 0)
    return pass_edges(t, train, low, low)
