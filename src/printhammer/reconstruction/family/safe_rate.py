"""The safe rate: how fast a hammer prints any pattern of dots well.

A pattern is eight slots, one period apart, each fired or not, from rest. A pattern is printed well if every
firing makes one dot, no extra contacts, with the peak force of the single pulse within a tenth and its flight
time within 50 us. The safe rate is the largest rate of a grid up to which all patterns are printed well at
every rate of the grid.

Of the 255 patterns in which anything is fired, those that begin with empty slots are others of them, later.
Only the 128 that begin with a firing are run.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.claims.context import TAIL
from printhammer.drive.trains import PulseTrain
from printhammer.run.ensemble import Ensemble

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.claims.context import Context

SLOTS: Final = 8
"""Number of slots of a pattern."""

FORCE: Final = 0.1
"""Largest deviation of a peak force from that of the single pulse, in parts of it."""

ARRIVAL: Final = 50e-6
"""Largest deviation of a flight time from that of the single pulse, s."""

STEP: Final = 5
"""Step of the grid of rates, Hz."""

FIRST: Final = 100
"""First rate of the grid, Hz: nothing is left of a pulse after a hundredth of a second."""

LAST: Final = 3000
"""Last rate of the grid, Hz."""

_TOGETHER: Final = 8


def patterns(*, later: bool = False) -> list[tuple[int, ...]]:
    """List the patterns of slots, as the numbers of the slots that are fired.

    Parameters
    ----------
    later : bool, optional
        Whether to list those too that begin with an empty slot, and so are another one, later.
    """
    every = itertools.product((False, True), repeat=SLOTS)
    found = [tuple(slot for slot, fired in enumerate(row) if fired) for row in every]
    return [slots for slots in found if slots and (later or slots[0] == 0)]


def printed_well(context: Context, rates: Sequence[float], *, later: bool = False) -> list[bool]:
    """Return for each of some rates, Hz, whether all patterns are printed well.

    Parameters
    ----------
    context : Context
        The hammer and its single pulse.
    rates : sequence of float
        Slots per second, Hz.
    later : bool, optional
        As for `patterns`.

    Returns
    -------
    list of bool
        False also where a run ends early.

    Raises
    ------
    NotMeasurableError
        The single pulse does not print.
    """
    force, flight = context.print_force, context.dot.flight_time
    fired = patterns(later=later)
    drives = [
        PulseTrain(context.waveform, at=[slot / rate for slot in slots]) for rate in rates for slots in fired
    ]
    ends = [float(drive.times[-1]) + TAIL for drive in drives]
    result = Ensemble(context.hammer, drives, ends, tolerance=context.tolerance).run(dots=True)
    dots = result.dots
    assert dots is not None
    assert flight is not None
    # A lost dot has no force and no flight time, and nothing that is compared with NaN is true.
    good = (
        dots.struck
        & (dots.extra_contacts == 0)
        & (np.abs(dots.peak_force - force) <= FORCE * force)
        & (np.abs(dots.flight_time - flight) <= ARRIVAL)
    )
    well = result.ok & (good | ~dots.fired).all(axis=1)
    return [bool(some.all()) for some in well.reshape(len(rates), len(fired))]


def safe_rate(context: Context) -> float | None:
    """Return the safe rate of a hammer, Hz; None where patterns are not printed well even at `FIRST`.

    Raises
    ------
    NotMeasurableError
        The single pulse does not print.
    """
    found: float | None = None
    grid = [float(rate) for rate in range(FIRST, LAST + 1, STEP)]
    for start in range(0, len(grid), _TOGETHER):
        rates = grid[start : start + _TOGETHER]
        for rate, well in zip(rates, printed_well(context, rates), strict=True):
            if not well:
                return found
            found = rate
    return found
