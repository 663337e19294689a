"""The drive at an instant, and the instants at which one of its pieces begins or ends.

A drive is n firing times and one waveform, a table of pieces ``[start, kind, p0, p1, p2, p3]`` of which the
last row holds the end of support. With s the time since the start of the piece: kind 0 is a cubic p0 + s (p1
+ s (p2 + s p3)), kind 1 an exponential p0 + p1 exp(-p2 s), kind 2 a sine p0 + p1 sin(p2 s + p3). The pieces
under way are known by their numbers, not by comparing times, so that an instant exactly on an edge belongs to
the piece that begins there.

While a run goes on, the pieces under way are kept side by side in one array ``live``: their number, then
seven values each, ``[firing, start, kind, p0, p1, p2, p3]``. It is rewritten at every edge; all the force sum
needs is in it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from printhammer.kernel.compiling import compiled, inlined

Drive = Any
"""The array ``live``."""

LIVE_WIDTH = 7


@compiled
def sum_of_pulses(t: float, drive: Drive) -> float:
    """Return the sum of at least one pulse under way."""
    total = 0.0
    i = 1
    for _ in range(int(drive[0])):
        s = (t - drive[i]) - drive[i + 1]
        kind = drive[i + 2]
        if kind == 1.0:
            total += drive[i + 3] + drive[i + 4] * math.exp(-drive[i + 5] * s)
        elif kind == 0.0:
            total += drive[i + 3] + s * (drive[i + 4] + s * (drive[i + 5] + s * drive[i + 6]))
        else:
            total += drive[i + 3] + drive[i + 4] * math.sin(drive[i + 5] * s + drive[i + 6])
        i += LIVE_WIDTH
    return total


@inlined
def drive_value(t: float, drive: Drive) -> float:
    """Return the sum of all pulses under way at time `t` [s]: amperes or newtons."""
    if drive[0] == 0.0:
        return 0.0
    return sum_of_pulses(t, drive)


@compiled
def pass_edges(
    t: float, firings: Any, pieces: Any, replace: bool, under_way: Any, first: int, last: int, live: Drive
) -> tuple[int, int, float]:
    """Begin and end all pieces whose edge is not after time `t` [s] and rewrite `live`.

    Pulses `first` to `last` - 1 are under way, pulse p in the piece ``under_way[p]``. With `replace`, a
    firing cuts off the pulses before it.

    Returns
    -------
    tuple
        The new `first` and `last`, and the time of the next edge [s], infinity if there is none.
    """
    final = pieces.shape[0] - 1
    while last < firings.size and firings[last] <= t:
        under_way[last] = 0
        last += 1
        if replace:
            first = last - 1
    edge = firings[last] if last < firings.size else np.inf
    for p in range(first, last):
        while under_way[p] < final and firings[p] + pieces[under_way[p] + 1, 0] <= t:
            under_way[p] += 1
        if under_way[p] < final:
            edge = min(edge, firings[p] + pieces[under_way[p] + 1, 0])
    while first < last and under_way[first] == final:
        first += 1
    i = 1
    for p in range(first, last):
        live[i] = firings[p]
        for j in range(6):
            live[i + 1 + j] = pieces[under_way[p], j]
        i += LIVE_WIDTH
    live[0] = last - first
    return first, last, edge


@compiled
def edges_at(
    t: float, firings: Any, pieces: Any, replace: bool, under_way: Any, live: Drive
) -> tuple[int, int, float]:
    """Do as `pass_edges` does from the start, but leave out the pulses that ended before time `t` [s]."""
    oldest = t - pieces[pieces.shape[0] - 1, 0]
    low, high = 0, firings.size
    while low < high:
        middle = (low + high) // 2
        if firings[middle] < oldest:
            low = middle + 1
        else:
            high = middle
    # One more than needed: a pulse may end at `t` by rounding.
    low = max(low - 1, 0)
    return pass_edges(t, firings, pieces, replace, under_way, low, low, live)
