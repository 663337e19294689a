"""What is kept of one stretch of a run: dots, strobes and samples, taken from its record.

A strobe is the whole state at an instant: displacement [m], velocity [m/s], mode, and what the mode
remembers, the latest local maximum in the pack [m].
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model.layout import FRONT, Train
from printhammer.kernel.model.modes import LOADING, PACK_SURFACE, RELOADING, UNLOADING

if TYPE_CHECKING:
    from printhammer.kernel.model.circuit import coil_current, turn_current
    from printhammer.kernel.model.forces import Hammer, pack_force
    from printhammer.kernel.model.laws import HAS_CIRCUIT, MEMORY
    from printhammer.kernel.model.pulses import edges_at, pass_edges
    from printhammer.kernel.single.resample import (
        branch_of,
        drive_at,
        drive_in_step,
        peaks_of,
        state_in_step,
    )

DOT_WIDTH = 6
"""Columns of a dot: pack contacts, time and velocity in, time out, depth, peak force."""

STROBE_WIDTH = 4
"""Columns of a strobe: displacement, velocity, mode, memory; with a coil circuit `ELECTRIC_WIDTH` more."""

ELECTRIC_WIDTH = 3
"""Columns of an electric state: currents in coil and shorted turn [A], voltage of the reservoir [V]."""


@compiled
def firing_before(t: float, firings: Any) -> int:
    """Return the number of the latest firing at or before time `t` [s], -1 if there is none."""
    low, high = 0, firings.size
    while low < high:
        middle = (low + high) // 2
        if firings[middle] <= t:
            low = middle + 1
        else:
            high = middle
    return low - 1


@compiled
def clear_dots(dots: Any) -> None:
    """Make all dots lost ones."""
    for i in range(dots.shape[0]):
        dots[i, 0] = 0.0
        for j in range(1, DOT_WIDTH):
            dots[i, j] = np.nan


@compiled
def deepest_node(contact: Any, nodes: Any, hammer: Hammer) -> tuple[float, float]:
    """Return largest depth [m] and force [N] of a contact with a pack whose reversals are nodes."""
    i = int(contact[5])
    highest = nodes[i, 1]
    while i + 1 < nodes.shape[0] and not nodes[i, 0] >= contact[3]:
        i += 1
        highest = max(highest, nodes[i, 1])
    return highest - hammer[FRONT], -pack_force(highest, 0.0, LOADING, 0.0, hammer)


@compiled
def note_dots(
    dots: Any,
    contacts: Any,
    nodes: Any,
    train: Train,
    hammer: Hammer,
) -> None:
    """Enter the pack contacts of a stretch into the dots of its member."""
    for row in range(contacts.shape[0]):
        contact = contacts[row]
        if contact[0] != PACK_SURFACE or contact[6] != 0.0:
            continue
        fired = firing_before(contact[1], train.firings)
        if fired < 0:
            continue
        dots[fired, 0] += 1.0
        if dots[fired, 0] > 1.0:
            continue
        if MEMORY:
            depth, force = deepest_node(contact, nodes, hammer)
        else:
            _t, depth, force = peaks_of(contact, nodes, train, hammer)
        dots[fired, 1] = contact[1]
        dots[fired, 2] = contact[2]
        dots[fired, 3] = contact[3]
        dots[fired, 4] = depth
        dots[fired, 5] = force


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
    """Fill strobes and samples from the numbers `strobe` and `sample` on, as far as a stretch goes.

    An instant at which a stretch ends belongs to the next one, if there is one. Returns the numbers of the
    first strobe and sample that are left.
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
        displacement, velocity, _w = state_in_step(
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
                live, electric = drive_in_step(due, nodes[i], hammer, drive)
                strobes[strobe, STROBE_WIDTH] = coil_current(displacement, electric, hammer, live)
                strobes[strobe, STROBE_WIDTH + 1] = turn_current(displacement, electric, hammer, live)
                strobes[strobe, STROBE_WIDTH + 2] = electric[2]
            strobe += 1


@compiled
def blank_states(strobes: Any, strobe: int, strobe_end: int, x: Any, sample: int, sample_end: int) -> None:
    """Put NaN where a run ended before."""
    for i in range(strobe, strobe_end):
        for j in range(strobes.shape[1]):
            strobes[i, j] = np.nan
    for i in range(sample, sample_end):
        x[i] = np.nan
