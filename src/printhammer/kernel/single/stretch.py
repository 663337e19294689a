"""Dots, strobes and samples of one segment of a run, extracted from the record of the segment.

A strobe is the complete state at a requested time: displacement [m], velocity [m/s], mode, and
the memory: the latest local maximum of displacement in the pack [m]. A sample is a displacement at a time of
the output grid.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model import dots as D
from printhammer.kernel.model.layout import FRONT, Train
from printhammer.kernel.model.modes import LOADING, RELOADING, UNLOADING

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import coil_current, turn_current
    from printhammer.kernel.model.forces import Hammer, pack_force
    from printhammer.kernel.model.laws import HAS_CIRCUIT, MEMORY
    from printhammer.kernel.model.pulses import edges_at, pass_edges
    from printhammer.kernel.single.resample import (
        branch_of,
        drive_at,
        peaks_of,
        state_in_step,
    )

STROBE_WIDTH = 4
"""Number of columns of a strobe: displacement, velocity, mode and memory. A coil circuit adds
`ELECTRIC_WIDTH` columns."""

ELECTRIC_WIDTH = 3
"""Number of electric columns of a strobe: currents in coil and shorted turn [A], reservoir voltage [V]."""


firing_before = compiled(D.firing_before)
contact_number = compiled(D.contact_number)


@compiled
def clear_dots(dots: Any) -> None:
    """Initialise the rows of dot data as lost dots: zero contacts, NaN in all other columns."""
    for i in range(dots.shape[0]):
        dots[i, D.CONTACTS] = 0.0
        for j in range(D.CONTACTS + 1, D.DOT_WIDTH):
            dots[i, j] = np.nan


@compiled
def open_dot(
    dots: Any, extra: int, surface: int, initial: bool, t: float, v: float, firings: Any
) -> tuple[int, int]:
    """Assign a contact that begins at time `t` with velocity `v` to its firing; start its row of dot data.

    Returns
    -------
    tuple
        Index of the row, or -1 if the contact belongs to no firing or the array is full; and the number of
        extra contacts, `extra` or `extra` + 1.
    """
    fired = firing_before(t, firings)
    earlier = int(dots[fired, D.CONTACTS]) if fired >= 0 else 0
    number = contact_number(surface, initial, fired, earlier)
    if number == D.NO_DOT:
        return -1, extra
    dots[fired, D.CONTACTS] = earlier + 1.0
    row = fired
    if number != D.DOT:
        row = firings.size + extra
        extra += 1
        if row >= dots.shape[0]:
            return -1, extra
        dots[row, D.FIRING] = fired
    dots[row, D.TIME_IN] = t
    dots[row, D.SPEED_IN] = v
    return row, extra


@compiled
def deepen_dot(dots: Any, row: int, x: float, hammer: Hammer) -> None:
    """Update depth and force in a row of dot data if a reversal at `x` [m] is the deepest of the contact."""
    if not dots[row, D.DEPTH] >= x - hammer[FRONT]:
        dots[row, D.DEPTH] = x - hammer[FRONT]
        dots[row, D.FORCE] = -pack_force(x, 0.0, LOADING, 0.0, hammer)


@compiled
def deepest_node(contact: Any, nodes: Any, hammer: Hammer) -> tuple[float, float]:
    """Return largest depth [m] and peak force [N] of a contact with a pack whose law has memory."""
    i = int(contact[5])
    highest = nodes[i, 1]
    while i + 1 < nodes.shape[0] and not nodes[i, 0] >= contact[3]:
        i += 1
        highest = max(highest, nodes[i, 1])
    return highest - hammer[FRONT], -pack_force(highest, 0.0, LOADING, 0.0, hammer)


@compiled
def note_dots(
    dots: Any,
    extra: int,
    contacts: Any,
    nodes: Any,
    train: Train,
    hammer: Hammer,
) -> int:
    """Write the pack contacts of one segment of a run to the rows of dot data of a member.

    Returns the number of extra contacts of the member up to the end of this segment; `extra` is the number
    before the segment.
    """
    for number in range(contacts.shape[0]):
        contact = contacts[number]
        row, extra = open_dot(
            dots, extra, int(contact[0]), contact[6] != 0.0, contact[1], contact[2], train.firings
        )
        if row < 0:
            continue
        if MEMORY:
            depth, force = deepest_node(contact, nodes, hammer)
        else:
            _t, depth, force = peaks_of(contact, nodes, train, hammer)
        dots[row, D.TIME_OUT] = contact[3]
        dots[row, D.DEPTH] = depth
        dots[row, D.FORCE] = force
    return extra


@compiled
def note_states(
    strobes: Any,
    strobe_times: Any,
    strobe: int,
    x: Any,
    grid: Any,
    sample: int,
    final: bool,
    nodes: Any,
    train: Train,
    hammer: Hammer,
) -> tuple[int, int]:
    """Compute the strobes and samples of a segment, from the indices `strobe` and `sample` on.

    A time at the end of a segment belongs to the next segment, unless this segment is `final`. Returns the
    indices of the first strobe and the first sample that remain.
    """
    n = nodes.shape[0]
    first, last, _edge = edges_at(nodes[0, 0], train)
    i = 0
    while True:
        due = np.inf
        if strobe < strobe_times.size:
            due = strobe_times[strobe]
        is_sample = sample < grid.size and grid[sample] < due
        if is_sample:
            due = grid[sample]
        if not (due < nodes[n - 1, 0] or (final and due == nodes[n - 1, 0])):
            return strobe, sample
        moved = False
        while i + 1 < n and nodes[i + 1, 0] <= due:
            i += 1
            moved = True
        if moved:
            first, last, _edge = pass_edges(nodes[i, 0], train, first, last)
        mode, kept = int(nodes[i, 3]), nodes[i, 4]
        drive = drive_at(nodes[i], train.live)
        displacement, velocity, _w, electric = state_in_step(
            due, nodes[i, 0], nodes[i, 1], nodes[i, 2], mode, kept, hammer, drive
        )
        if is_sample:
            x[sample] = displacement
            sample += 1
        else:
            strobes[strobe, 0] = displacement
            strobes[strobe, 1] = velocity
            branch = branch_of(mode)
            strobes[strobe, 2] = branch
            strobes[strobe, 3] = kept if branch in (UNLOADING, RELOADING) else 0.0
            if HAS_CIRCUIT:
                live = train.live
                strobes[strobe, STROBE_WIDTH] = coil_current(displacement, electric, hammer, live)
                strobes[strobe, STROBE_WIDTH + 1] = turn_current(displacement, electric, hammer, live)
                strobes[strobe, STROBE_WIDTH + 2] = electric[2]
            strobe += 1


@compiled
def blank_states(strobes: Any, strobe: int, strobe_end: int, x: Any, sample: int, sample_end: int) -> None:
    """Fill the remaining strobes and samples with NaN after an early end of the run.

    These are the strobes from index `strobe` to before `strobe_end`, and likewise the samples.
    """
    for i in range(strobe, strobe_end):
        for j in range(strobes.shape[1]):
            strobes[i, j] = np.nan
    for i in range(sample, sample_end):
        x[i] = np.nan
