"""Contacts and dots of a run, from its record: rows with the columns named below.

A row of a contact follows from its row in the record (:mod:`printhammer.kernel.single.record`), from the
peaks that :func:`printhammer.kernel.single.resample.peaks` finds and from the energies of the steps that
:func:`printhammer.kernel.methods.quadrature.quadratures` integrates. A row of a dot follows from the first
pack contact of its firing; see :mod:`printhammer.kernel.model.dots`.
"""

from __future__ import annotations

import math
from typing import Any

from printhammer.kernel.model.dots import DOT, NO_DOT, contact_number, firing_before
from printhammer.kernel.model.modes import PACK_SURFACE
from printhammer.kernel.readout.sums import pairwise_sum

SURFACE, TIME_IN, SPEED_IN, TIME_OUT, SPEED_OUT = range(5)
"""Columns of a contact record: surface, time [s] and velocity [m/s] at touch, and time and velocity at
leaving, NaN while the contact is open."""
PEAK_TIME, DEPTH, FORCE = range(5, 8)
"""Columns of the time of the largest indentation [s], that indentation [m], and the largest force [N], NaN
on a rigid backstop."""
LOSS, FIRING, NUMBER, INITIAL = range(8, 12)
"""Columns of the energy dissipated [J], the index of the firing (-1 if none), the number of the contact among
the pack contacts of its firing (-1 for a contact of no firing), and 1 if open at the start."""
BEGIN, END = range(12, 14)
"""Columns of the first step within the contact and the step after the last step within."""
CONTACT_WIDTH = 14
"""Number of columns of a contact record."""

FIRED_AT, STRUCK, FLIGHT_TIME, IMPACT_SPEED, PEAK_FORCE, INDENTATION = range(6)
"""Columns of a dot record: firing time [s], 1 if a dot is made, flight time [s], speed at touch [m/s],
largest force [N] and indentation [m]. For a lost dot, the columns from the flight time on are NaN."""
CONTACT_TIME, LOADING_WORK, NET_LOSS, EXTRA_CONTACTS = range(6, 10)
"""Columns of the contact time [s] (NaN while open), the work up to the largest indentation [J], the energy
dissipated in the pack [J], and the number of extra contacts."""
DOT_WIDTH = 10
"""Number of columns of a dot record."""


def nodes_before(t: float, nodes: Any, included: bool) -> int:
    """Count the nodes before time `t` [s]; if `included`, also the nodes at that time."""
    low, high = 0, nodes.shape[0]
    while low < high:
        middle = (low + high) // 2
        if nodes[middle, 0] < t or (included and nodes[middle, 0] == t):
            low = middle + 1
        else:
            high = middle
    return low


def write_steps(nodes: Any, steps: Any, starts: Any, ends: Any) -> None:
    """Write `steps`, `starts` and `ends`, with which `quadratures` integrates over each step of a run."""
    for i in range(nodes.shape[0] - 1):
        steps[i], starts[i], ends[i] = i, nodes[i, 0], nodes[i + 1, 0]


def write_contacts(
    contacts: Any, nodes: Any, peaks: Any, increments: Any, firings: Any, rigid: bool, work: Any, rows: Any
) -> None:
    """Write a row of contact data for each of m contacts of a run.

    Parameters
    ----------
    contacts, nodes : float64 array, shape (m, 7), (n, any)
        Record of the run.
    peaks : float64 array, shape (m, 3)
        Result of `peaks`.
    increments : float64 array, shape (n - 1, any)
        Result of `quadratures` for each step.
    firings : float64 array
        Times of the firings [s].
    rigid : bool
        Whether the backstop is rigid.
    work : float64 array, shape (`PARTIALS`,)
        Working space.
    rows : float64 array, shape (m, `CONTACT_WIDTH`)
        Output.
    """
    last_node = nodes.shape[0] - 1
    latest, earlier = -1, 0
    for row in range(contacts.shape[0]):
        surface, t_in, t_out = int(contacts[row, 0]), contacts[row, 1], contacts[row, 3]
        initial = contacts[row, 6] != 0.0
        begin, end = int(contacts[row, 5]), last_node
        if math.isfinite(t_out):
            end = min(end, nodes_before(t_out, nodes, False))
        if t_out == t_in:
            # An impact on a rigid backstop is a step of zero duration between two nodes.
            end = min(begin + 1, last_node)
        fired = firing_before(t_in, firings)
        if fired != latest:
            latest, earlier = fired, 0
        number = contact_number(surface, initial, fired, earlier)
        if number != NO_DOT:
            earlier += 1
        hard = rigid and surface != PACK_SURFACE
        for k in range(5):
            rows[row, k] = contacts[row, k]
        rows[row, PEAK_TIME] = t_in if hard else peaks[row, 0]
        rows[row, DEPTH] = 0.0 if hard else peaks[row, 1]
        rows[row, FORCE] = math.nan if hard else peaks[row, 2]
        column = 2 if surface == PACK_SURFACE else 3
        rows[row, LOSS] = pairwise_sum(increments, begin, max(end - begin, 0), column, work)
        rows[row, FIRING] = fired
        rows[row, NUMBER] = number
        rows[row, INITIAL] = 1.0 if initial else 0.0
        rows[row, BEGIN], rows[row, END] = begin, end


def write_loading(
    rows: Any, nodes: Any, increments: Any, work: Any, works: Any, steps: Any, starts: Any, ends: Any
) -> None:
    """Write, for each contact, the work done on the pack in the whole steps before the peak of the contact.

    The interval from the last of these steps to the peak is written as well.

    Parameters
    ----------
    rows, nodes, increments, work
        As in `write_contacts`.
    works : float64 array, shape (m,)
        Work in whole steps [J]; 0 for the backstop.
    steps : int64 array, shape (m,)
    starts, ends : float64 array, shape (m,)
        Remaining interval of each contact, up to its peak, for `quadratures`; empty if nothing remains.
    """
    for row in range(rows.shape[0]):
        begin, end = int(rows[row, BEGIN]), int(rows[row, END])
        works[row] = 0.0
        steps[row], starts[row], ends[row] = begin, nodes[begin, 0], nodes[begin, 0]
        if rows[row, SURFACE] != PACK_SURFACE:
            continue
        peak = rows[row, PEAK_TIME]
        step = min(max(nodes_before(peak, nodes, True) - 1, begin), end)
        works[row] = pairwise_sum(increments, begin, step - begin, 2, work)
        steps[row], starts[row], ends[row] = step, nodes[step, 0], nodes[step, 0]
        if step < end and peak > nodes[step, 0]:
            ends[row] = peak


def write_dots(firings: Any, t_end: float, rows: Any, works: Any, rests: Any, dots: Any) -> int:
    """Write a row of dot data for each firing up to the end of the run; return the number of dots.

    Parameters
    ----------
    firings : float64 array, shape (n,)
        Times of the firings [s].
    t_end : float
        End of the run [s].
    rows : float64 array, shape (m, `CONTACT_WIDTH`)
        Contacts of the run.
    works : float64 array, shape (m,)
    rests : float64 array, shape (m, any)
        Work done on the pack before the peak of each contact [J]: in whole steps, and in column 2 of the
        result of `quadratures` for the remaining intervals.
    dots : float64 array, shape (n, `DOT_WIDTH`)
        Output.
    """
    count = 0
    while count < firings.shape[0] and firings[count] <= t_end:
        for k in range(DOT_WIDTH):
            dots[count, k] = math.nan
        dots[count, FIRED_AT] = firings[count]
        dots[count, STRUCK], dots[count, EXTRA_CONTACTS] = 0.0, 0.0
        count += 1
    for row in range(rows.shape[0]):
        dot = int(rows[row, FIRING])
        if rows[row, NUMBER] > DOT:
            dots[dot, EXTRA_CONTACTS] += 1.0
        elif rows[row, NUMBER] == DOT:
            dots[dot, STRUCK] = 1.0
            dots[dot, FLIGHT_TIME] = rows[row, TIME_IN] - firings[dot]
            dots[dot, IMPACT_SPEED] = rows[row, SPEED_IN]
            dots[dot, PEAK_FORCE] = rows[row, FORCE]
            dots[dot, INDENTATION] = rows[row, DEPTH]
            dots[dot, CONTACT_TIME] = rows[row, TIME_OUT] - rows[row, TIME_IN]
            dots[dot, LOADING_WORK] = works[row] + rests[row, 2]
            dots[dot, NET_LOSS] = rows[row, LOSS]
    return count


def write_quality(dots: Any, count: int, out: Any) -> None:
    """Summarise the first `count` dots in `out`, shape (6,).

    The elements are, in this order: number of dots struck; number of extra contacts; least and largest peak
    force [N]; least and largest flight time [s]. Forces and times are NaN if no dot is struck.
    """
    for k in range(6):
        out[k] = 0.0 if k < 2 else math.nan
    for row in range(count):
        if dots[row, STRUCK] == 0.0:
            continue
        out[0] += 1.0
        out[1] += dots[row, EXTRA_CONTACTS]
        for k in range(2):
            value = dots[row, PEAK_FORCE if k == 0 else FLIGHT_TIME]
            if not value >= out[2 + 2 * k]:
                out[2 + 2 * k] = value
            if not value <= out[3 + 2 * k]:
                out[3 + 2 * k] = value
