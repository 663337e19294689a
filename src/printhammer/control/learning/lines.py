"""What is printed while a table is learned: a ladder of pulses from rest, and a line at the rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.table.drive import Settings, pulses_of, sequence
from printhammer.control.widths import of_width
from printhammer.drive.sequence import PulseSequence
from printhammer.printing.dots.judging import Judgement, judge
from printhammer.printing.dots.nominal import WAIT
from printhammer.printing.dots.slots import cycle_with_lead_in, slot_times, slots_of
from printhammer.run.ensemble import DISPLAY_TOLERANCE, DotTable, Ensemble

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.learning.ladder import Rung
    from printhammer.control.table.task import Task
    from printhammer.drive.waveforms.shapes import Waveform
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

LINE: Final = slots_of(cycle_with_lead_in(5, 0))
"""Slots of the test line: the de Bruijn cycle of order 5, in which every history of two gaps occurs."""


@dataclass(frozen=True)
class Press:
    """Hammers with their driver, and what they print at a rate, Hz: they are units, or stand for some."""

    task: Task
    rate: float
    hammers: Sequence[Hammer]

    def ladder(self, rungs: Sequence[Rung]) -> tuple[FloatArray, FloatArray]:
        """Return flight times, s, and forces in parts of the nominal one, of the dots of rungs, (M, dots)."""
        task, count = self.task, len(self.hammers)
        drives = []
        for rung in rungs:
            parts = ((0.0, rung.first), (rung.later, rung.second))[: rung.dots]
            pulses = [of_width(task.pulse, part * task.width) for _at, part in parts]
            drives.append(PulseSequence(pulses, at=[at for at, _part in parts]))
        hammers = [hammer for hammer in self.hammers for _ in rungs]
        end = WAIT + max(rung.later for rung in rungs)
        dots = (
            Ensemble(hammers, drives * count, end, tolerance=task.tolerance)
            .run(dots=True, threads=task.threads)
            .dots
        )
        assert dots is not None
        times, forces = (
            np.concatenate(
                [each.reshape(count, len(rungs), -1)[:, k, : rung.dots] for k, rung in enumerate(rungs)],
                axis=1,
            )
            for each in (dots.flight_time, dots.peak_force / task.single.nominal.force)
        )
        return times, forces

    def line(self, settings: Sequence[FloatArray], slots: Sequence[int] = LINE) -> tuple[DotTable, Judgement]:
        """Print a line, each hammer with its settings (4, entries); return dots, and how far off they are."""
        task, due = self.task, slot_times(slots, self.rate)
        known: dict[tuple[float, float, float], Waveform] = {}
        drives: dict[int, PulseSequence] = {}
        for own in settings:
            if id(own) not in drives:
                pulses = pulses_of(Settings(*own), task.gaps, task.reach, slots, self.rate)
                drives[id(own)] = sequence(pulses, task.pulse, known)
        end = float(due[-1]) + WAIT
        result = Ensemble(
            self.hammers, [drives[id(own)] for own in settings], end, tolerance=DISPLAY_TOLERANCE
        ).run(dots=True, threads=task.threads)
        dots = result.dots
        assert dots is not None
        shape = len(self.hammers), len(slots)
        wanted, times = np.ones(shape, np.bool_), np.broadcast_to(due, shape)
        return dots, judge(dots, wanted, times, task.single.nominal, task.limits, result.ok)
