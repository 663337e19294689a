"""What is printed while a table is learned: a ladder of pulses from rest, and a line at the rate.

The ladder excites what the line does not: from the times of impact of pulses of different widths, force and
distance of the pack can be told apart, which one width alone confounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.table.drive import Settings, pulses_of, sequence
from printhammer.control.widths import of_width
from printhammer.drive.trains import PulseTrain
from printhammer.printing.dots.judging import Judgement, judge
from printhammer.printing.dots.nominal import WAIT
from printhammer.printing.dots.slots import cycle_with_lead_in, slot_times, slots_of
from printhammer.run.ensemble import DISPLAY_TOLERANCE, DotTable, Ensemble

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.table.task import Task
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

LADDER: Final = (0.8, 1.0, 1.3)  # Widths of the pulses from rest, in parts of that of the hammer
REPEATED: Final = 3  # How often each of them is fired in a run
LINE: Final = slots_of(cycle_with_lead_in(5, 0))
"""Slots of the test line: the de Bruijn cycle of order 5, in which every history of two gaps occurs."""

DOTS: Final = REPEATED * len(LADDER) + len(LINE)
"""Number of dots of a run."""


@dataclass(frozen=True)
class Press:
    """Hammers with their driver, and what they print at a rate, Hz: they are units, or stand for some."""

    task: Task
    rate: float
    hammers: Sequence[Hammer]

    def ladder(self) -> tuple[FloatArray, FloatArray]:
        """Return flight times, s, and forces in parts of the nominal one, of the pulses of the ladder."""
        task, count = self.task, len(self.hammers)
        pulses = [of_width(task.pulse, part * task.width) for part in LADDER]
        hammers = [hammer for hammer in self.hammers for _ in LADDER]
        drives = [PulseTrain(pulse) for _ in self.hammers for pulse in pulses]
        dots = (
            Ensemble(hammers, drives, WAIT, tolerance=task.tolerance)
            .run(dots=True, threads=task.threads)
            .dots
        )
        assert dots is not None
        force = dots.peak_force[:, 0] / task.single.nominal.force
        return dots.flight_time[:, 0].reshape(count, -1), force.reshape(count, -1)

    def line(self, settings: Sequence[FloatArray], slots: Sequence[int] = LINE) -> tuple[DotTable, Judgement]:
        """Print a line, each hammer with its settings (4, entries); return dots, and how far off they are."""
        task, due = self.task, slot_times(slots, self.rate)
        known: dict[tuple[float, float, float], Waveform] = {}
        drives = [
            sequence(pulses_of(Settings(*own), task.gaps, task.reach, slots, self.rate), task.pulse, known)
            for own in settings
        ]
        end = float(due[-1]) + WAIT
        result = Ensemble(self.hammers, drives, end, tolerance=DISPLAY_TOLERANCE).run(
            dots=True, threads=task.threads
        )
        dots = result.dots
        assert dots is not None
        shape = len(self.hammers), len(slots)
        wanted, times = np.ones(shape, np.bool_), np.broadcast_to(due, shape)
        return dots, judge(dots, wanted, times, task.single.nominal, task.limits, result.ok)

    def deviations(self, settings: Sequence[FloatArray]) -> FloatArray:
        """Return deviations of arrival and force, in parts of the limits, (M, 2, dots); NaN if lost."""
        judgement, limits = self.line(settings)[1], self.task.limits
        return np.stack(
            [judgement.arrival_deviation / limits.arrival, judgement.force_deviation / limits.force], axis=1
        )
