"""Printed line: position on the paper, darkness and fault of each dot.

The rules are as in `printhammer.printing.page.page` and `printhammer.printing.dots.judging` for a hammer in
open loop: each wire of each line is a run from rest, a member of an ensemble with dots and extra contacts.
"""

from __future__ import annotations

import math
from typing import Any

from printhammer.kernel.model.dots import CONTACTS, FIRING, FORCE, TIME_IN
from printhammer.kernel.model.modes import OK

X, Y, WANTED_X, WANTED_Y, DARKNESS, FAULT = range(6)
"""Columns of a dot: position and intended position [m], from the middle of slot 0 to the right and from
the topmost wire down; the fraction of light absorbed; the index of its first fault (-1 for a good dot).
NaN for a lost dot."""
FORCE_RATIO, PLACEMENT, PRINTED = range(6, 9)
"""Columns of the ratio of peak force to the single pulse's peak force, the offset from the intended position
[m], and whether the dot is on the paper."""
DOT_WIDTH = 9
NOT_RUN, LOST, EXTRA, WEAK, LATE, GOOD = 0, 1, 2, 3, 4, -1
"""Faults, as in `printhammer.printing.dots.judging.FAULTS`."""


def write_slots(slots: Any, rate: float, first: float, firings: Any) -> None:
    """Write the times [s] of `slots`, int64, to `firings`; slot 0 is at the time `first` [s]."""
    for k in range(slots.shape[0]):
        firings[k] = first + slots[k] / rate


def fault_of(ratio: float, late: float, more: float, limits: Any) -> int:
    """Return the code of the first fault of a dot on the paper; GOOD for a dot without fault.

    `ratio` is the peak force of the dot divided by the peak force of the single pulse, `late` the arrival
    time [s] relative to the single pulse, and `more` the number of extra contacts beyond those of the single
    pulse. `limits` contains the largest relative force deviation, the largest absolute deviation of the
    arrival time [s], and the largest number of extra contacts.
    """
    if more > limits[2]:
        return EXTRA
    if not abs(ratio - 1.0) <= limits[0]:
        return WEAK
    return GOOD if abs(late) <= limits[1] else LATE


def write_line(
    runs: Any,
    slots: Any,
    firings: Any,
    kept: Any,
    rate: float,
    single: Any,
    limits: Any,
    head: Any,
    dots: Any,
    extra_dots: Any,
) -> int:
    """Write one row per requested dot to `dots` and one per extra contact to `extra_dots`.

    Returns the number of extra contacts.

    Parameters
    ----------
    runs : tuple of int64 arrays, shape (n + 1,), (n,), (n,)
        Index of the first dot of each of n runs, and print line and wire of each run.
    slots, firings : int64 array, float64 array
        Slot and firing time [s] of each dot, run after run.
    kept : tuple
        Results of the ensemble: `status`, `reached`, `extra`, `dot_starts` and `dots` of
        :class:`printhammer.kernel.lanes.batch.Kept`.
    rate : float
        Slot rate [Hz].
    single : float64 array
        Peak force [N], flight time [s] and number of extra contacts of the single-pulse dot.
    limits : float64 array
        As for `fault_of`.
    head : float64 array
        Distances between slots, wires and print lines [m], and optical density of the single-pulse dot.
    dots : float64 array, shape (number of dots, `DOT_WIDTH`)
        Output.
    extra_dots : float64 array, shape (any, 2)
        Output: positions of the extra contacts on the paper [m].
    """
    starts, lines, wires = runs
    status, reached, extra, dot_starts, rows = kept
    speed = rate * head[0]
    count = 0
    for run in range(lines.shape[0]):
        begin, end = starts[run], starts[run + 1]
        down = lines[run] * head[2] + wires[run] * head[1]
        # The last dot of a run that ends early may still be open.
        known = begin
        while known < end and firings[known] <= reached[run]:
            known += 1
        if status[run] != OK and known > begin:
            known -= 1
        at = dot_starts[run]
        for dot in range(begin, end):
            row = at + dot - begin
            ratio = rows[row, FORCE] / single[0]
            late, fault = math.nan, NOT_RUN
            if dot < known:
                fault = LOST
                if rows[row, CONTACTS] > 0.0:
                    arrival = firings[dot] + (rows[row, TIME_IN] - firings[dot])
                    late = arrival - (firings[dot] + single[1])
                    fault = fault_of(ratio, late, rows[row, CONTACTS] - 1.0 - single[2], limits)
            across = slots[dot] * head[0]
            dots[dot, X], dots[dot, Y] = across + late * speed, down
            dots[dot, WANTED_X], dots[dot, WANTED_Y] = across, down
            dots[dot, DARKNESS] = 1.0 - 10.0 ** -(head[3] * ratio)
            dots[dot, FAULT] = fault
            dots[dot, FORCE_RATIO], dots[dot, PLACEMENT] = ratio, late * speed
            dots[dot, PRINTED] = 1.0 if fault not in (NOT_RUN, LOST) else 0.0
        for number in range(extra[run]):
            row = at + end - begin + number
            dot = begin + int(rows[row, FIRING])
            late = rows[row, TIME_IN] - single[1] - firings[dot]
            extra_dots[count, 0], extra_dots[count, 1] = slots[dot] * head[0] + late * speed, down
            count += 1
    return count


def write_totals(dots: Any, status: Any, out: Any) -> None:
    """Summarise the dots of a printed line in `out`, shape (11,).

    The elements are, in this order: number of good dots; numbers of dots with each of the five faults; least
    and largest force ratio, least and largest placement error [m] of the printed dots (NaN without a printed
    dot); number of runs that ended early.
    """
    for k in range(11):
        out[k] = math.nan if 6 <= k < 10 else 0.0
    for dot in range(dots.shape[0]):
        out[1 + int(dots[dot, FAULT])] += 1.0
        if dots[dot, PRINTED] == 0.0:
            continue
        for k in range(2):
            value = dots[dot, FORCE_RATIO + k]
            if not value >= out[6 + 2 * k]:
                out[6 + 2 * k] = value
            if not value <= out[7 + 2 * k]:
                out[7 + 2 * k] = value
    for run in range(status.shape[0]):
        if status[run] != OK:
            out[10] += 1.0
