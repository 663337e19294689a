"""What is printed while a table is learned: a ladder of pulses from rest, and a line at the rate.

Learning simulates many hammers, a few at a time; learners and what they do at once place their orders
together, and all of these are run as one ensemble. What a hammer prints does not depend on that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias, TypeVar

import numpy as np

from printhammer.control.learning.ladder import Rung
from printhammer.control.pulses import of_width
from printhammer.control.table.drive import Settings, pulses_of, sequence
from printhammer.control.table.task import Task
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Judgement, judge
from printhammer.printing.dots.nominal import WAIT
from printhammer.printing.dots.strategy import cycle_with_lead_in, slot_times, slots_of
from printhammer.run.ensemble import DotTable, Ensemble
from printhammer.support.arrays import BoolArray, FloatArray
from printhammer.support.threads import Work, answered

if TYPE_CHECKING:
    T = TypeVar("T")
    Printing: TypeAlias = "Work[Order, Printed, T]"

_MOST: Final = 4096  # Hammers in an ensemble

LINE: Final = slots_of(cycle_with_lead_in(5, 0))
"""Slots of the test line: the de Bruijn cycle of order 5, in which every history of two gaps occurs."""


class Order(NamedTuple):
    """What hammers are to print."""

    hammers: Sequence[Hammer]  # (M,)
    drives: Sequence[PulseSequence]  # One each
    end: float  # s


class Printed(NamedTuple):
    """What they have printed."""

    dots: DotTable  # (M, most firings of any)
    ok: BoolArray  # Which runs went as asked, (M,)


@dataclass(frozen=True)
class Press:
    """Hammers with their driver, and what they print at a rate, Hz: they are units, or stand for some."""

    task: Task
    rate: float
    hammers: Sequence[Hammer]

    def ladder(self, rungs: Sequence[Rung]) -> tuple[FloatArray, FloatArray]:
        """Return flight times, s, and forces in parts of the nominal one, of the dots of rungs, (M, dots)."""
        return printed(self.order_ladder(rungs), self.task)

    def line(self, settings: Sequence[FloatArray], slots: Sequence[int] = LINE) -> tuple[DotTable, Judgement]:
        """Print a line, each hammer with its settings (4, entries); return dots, and how far off they are."""
        return printed(self.order_line(settings, slots), self.task)

    def order_ladder(self, rungs: Sequence[Rung]) -> Printing[tuple[FloatArray, FloatArray]]:
        """Return what `ladder` returns; asks for it to be printed."""
        task, count = self.task, len(self.hammers)
        drives = []
        for rung in rungs:
            parts = ((0.0, rung.first), (rung.later, rung.second))[: rung.dots]
            pulses = [of_width(task.pulse, part * task.width) for _at, part in parts]
            drives.append(PulseSequence(pulses, at=[at for at, _part in parts]))
        hammers = [hammer for hammer in self.hammers for _ in rungs]
        ((dots, _ok),) = yield [Order(hammers, drives * count, WAIT + max(rung.later for rung in rungs))]
        times, forces = (
            np.concatenate(
                [each.reshape(count, len(rungs), -1)[:, k, : rung.dots] for k, rung in enumerate(rungs)],
                axis=1,
            )
            for each in (dots.flight_time, dots.peak_force / task.single.nominal.force)
        )
        return times, forces

    def order_line(
        self, settings: Sequence[FloatArray], slots: Sequence[int] = LINE
    ) -> Printing[tuple[DotTable, Judgement]]:
        """Return what `line` returns; asks for it to be printed."""
        task, due = self.task, slot_times(slots, self.rate)
        known: dict[tuple[float, float, float], Waveform] = {}
        drives: dict[int, PulseSequence] = {}
        for own in settings:
            if id(own) not in drives:
                pulses = pulses_of(Settings(*own), task.gaps, task.reach, slots, self.rate)
                drives[id(own)] = sequence(pulses, task.pulse, known)
        end = float(due[-1]) + WAIT
        ((dots, ok),) = yield [Order(self.hammers, [drives[id(own)] for own in settings], end)]
        shape = len(self.hammers), len(slots)
        wanted, times = np.ones(shape, np.bool_), np.broadcast_to(due, shape)
        return dots, judge(dots, wanted, times, task.single.nominal, task.limits, ok)


def printed(work: Printing[T], task: Task) -> T:
    """Do a work to its end, and print what it asks for."""
    return answered(work, partial(_run, tolerance=task.tolerance, threads=task.threads))


def _run(orders: Sequence[Order], tolerance: float, threads: int | None) -> list[Printed]:
    """Print what is ordered, in few ensembles."""
    done: list[Printed] = []
    while len(done) < len(orders):
        batch: list[Order] = []
        count = 0
        for order in orders[len(done) :]:
            if batch and count + len(order.hammers) > _MOST:
                break
            batch.append(order)
            count += len(order.hammers)
        result = Ensemble(
            [hammer for order in batch for hammer in order.hammers],
            [drive for order in batch for drive in order.drives],
            np.repeat([order.end for order in batch], [len(order.hammers) for order in batch]),
            tolerance=tolerance,
        ).run(dots=True, threads=threads)
        assert result.dots is not None
        first = 0
        for order in batch:
            own = slice(first, first + len(order.hammers))
            firings = max((len(drive.times) for drive in order.drives), default=0)
            parts = {name: values[own, :firings] for name, (_, values) in result.dots.entries().items()}
            done.append(Printed(DotTable(**parts), result.ok[own]))
            first = own.stop
    return done
