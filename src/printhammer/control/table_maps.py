"""A second dot after a first one, on a plane of firing time and width: where tables begin their search.

A dot made right leaves the hammer as every dot does. What the next dot needs is therefore a function of the
time since then, and one plane serves all rates: each of its cells is a dot at some place with some force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table_drive import of_width
from printhammer.drive_sequence import PulseSequence
from printhammer.ensemble import Ensemble

if TYPE_CHECKING:
    from printhammer.control.table_polish import Work
    from printhammer.hammer import Hammer
    from printhammer.printing.limits import Limits
    from printhammer.segments import FloatArray

STEP: Final = 5e-6
"""Step of the firing times of a plane, s."""

WIDTHS: Final = 40
"""Number of widths of a plane."""

LEAST_WIDTH: Final = 0.5
"""Least width of a plane, in parts of that of the hammer's pulse."""

ROOM: Final = 150e-6
"""How far from its slot a dot is fired at most, s."""

GUESSES: Final = 2
"""Number of cells from which a search begins."""

APART: Final = 30e-6
"""How far apart their firing times are, s: there may be one solution before a rebound and one after it."""

_PIECE: Final = 8192
_WAIT: Final = 1e-3


@dataclass(frozen=True)
class Plane:
    """Second dots: arrays of shape (firing times, widths).

    Attributes
    ----------
    fired : array
        Firing times after the slot of the first dot, s.
    widths : array
        Widths, s.
    force : array
        Deviation of the force, in parts of that of the single pulse; infinite for a lost or a doubled dot.
    arrival : array
        Touch less single-pulse flight time, s after the slot of the first dot: where a slot would have to be.
    """

    fired: FloatArray
    widths: FloatArray
    force: FloatArray
    arrival: FloatArray

    def off(self, period: float, limits: Limits) -> FloatArray:
        """Return how far each cell is off for a slot at a time after the first, in parts of the limits."""
        return np.maximum(np.abs(self.force) / limits.force, np.abs(self.arrival - period) / limits.arrival)


def plane(work: Work, hammer: Hammer, periods: FloatArray) -> Plane:
    """Compute a plane, from the time at which the armature leaves the pack on.

    Parameters
    ----------
    work : Work
        What the table is to be like, and what the single pulse does to the hammer it is for.
    hammer : Hammer
        What is driven, this hammer or another one.
    periods : array
        Times from slot to slot that are of interest, s: only firings near them are tried.
    """
    single, nominal, pulse = work.single, work.single.nominal, work.pulse
    begin = single.left
    steps = np.arange(max(0, math.floor((float(periods.max()) + ROOM - begin) / STEP) + 1))
    every = begin + STEP * steps
    near = np.abs(every[:, np.newaxis] - periods).min(axis=1, initial=math.inf) <= ROOM
    fired = every[near]
    own: Any = pulse
    widths = np.linspace(LEAST_WIDTH * own.width, work.widest, WIDTHS)
    seconds = [of_width(pulse, width) for width in widths.tolist()]
    force, arrival = np.full((2, fired.size, widths.size), np.inf)
    rows = max(1, _PIECE // widths.size)
    for start in range(0, fired.size, rows):
        times = fired[start : start + rows]
        drives = [
            PulseSequence([pulse, second], at=[0.0, time]) for time in times.tolist() for second in seconds
        ]
        result = Ensemble(
            hammer, drives, np.repeat(times + _WAIT, widths.size), tolerance=work.tolerance
        ).run(dots=True, threads=work.threads)
        dots = result.dots
        assert dots is not None
        good = result.ok & dots.struck.all(axis=1) & (dots.extra_contacts == 0).all(axis=1)
        shape = times.size, widths.size
        off = np.where(good, dots.peak_force[:, 1] / nominal.force - 1.0, np.inf)
        touched = np.where(good, dots.fired_at[:, 1] + dots.flight_time[:, 1] - nominal.flight_time, np.inf)
        force[start : start + rows] = off.reshape(shape)
        arrival[start : start + rows] = touched.reshape(shape)
    return Plane(fired, widths, force, arrival)


@dataclass(frozen=True)
class Guess:
    """A cell of a plane that comes next to what is asked.

    Attributes
    ----------
    fired, width : float
        Of the cell, s.
    off : float
        Worst deviation, in parts of the limits, of the hammer the table is made for.
    """

    fired: float
    width: float
    off: float


def guesses(planes: list[Plane], period: float, limits: Limits) -> list[Guess]:
    """Return the best cells for a slot at a time after the first, at most `GUESSES` that lie apart.

    Parameters
    ----------
    planes : list of Plane
        That of the hammer itself first, then those of others that differ a little.
    period : float
        Time from slot to slot, s.
    limits : Limits
        By which deviations are measured.
    """
    own = planes[0].off(period, limits)
    if not own.size:
        return []
    every = np.max([each.off(period, limits) for each in planes], axis=0)
    found: list[Guess] = []
    while len(found) < GUESSES and np.isfinite(every).any():
        place = np.unravel_index(int(np.argmin(every)), every.shape)
        fired, width = float(planes[0].fired[place[0]]), float(planes[0].widths[place[1]])
        found.append(Guess(fired, width, float(own[place])))
        every = np.where(np.abs(planes[0].fired - fired)[:, np.newaxis] <= APART, np.inf, every)
    return found
