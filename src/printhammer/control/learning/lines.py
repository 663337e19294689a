"""Test prints of a learner: test pulses (the ladder), chosen by greedy A-optimal design, and a test line.

The *ladder* is a set of pulses from rest, each called a rung: a single pulse or a pair. The impact times of
single pulses of different widths separate the strength of the coil from the distance of the pack. These times
do not depend on the stiffness of the paper, since the armature touches before the paper resists. The time of
a second impact depends on the stiffness: the second pulse of a pair catches the rebounding armature and
returns it to the paper (pump and probe). Rungs are added one at a time; each step adds the rung that most
reduces the variance of the estimated single-pulse force, averaged over the production (greedy A-optimal
design; Pukelsheim, *Optimal Design of Experiments*, 2006, chapter 6). A greedy choice can miss a better
combination of rungs.

`Surrogate` approximates a reading by a quadratic function of the constants, to plan the ladder and to start
searches. Learners are coroutines that yield print jobs; `printed` runs pending jobs in few ensembles. The
results do not depend on how jobs are grouped.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final, NamedTuple, TypeAlias, TypeVar

import numpy as np

from printhammer.control.pulses import of_width
from printhammer.control.table.drive import Settings, pulses_of, sequence
from printhammer.control.table.task import Task
from printhammer.derivatives.rows import DOTS as ROW_DOTS
from printhammer.derivatives.rows import row_multipliers
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.trains import PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Judgement, judge
from printhammer.printing.dots.strategy import cycle_with_lead_in, slot_times, slots_of
from printhammer.run.effort import Effort
from printhammer.run.ensemble import DotTable, Ensemble
from printhammer.run.simulate import simulate
from printhammer.support.arrays import BoolArray, FloatArray
from printhammer.support.threads import Work, answered

if TYPE_CHECKING:
    T = TypeVar("T")
    Printing: TypeAlias = "Work[Order, Printed, T]"

_RIDGE: Final = 1e-3
"""Ridge parameter of the regression, added to the diagonal of the normal matrix; arbitrary."""


@dataclass(frozen=True)
class Surrogate:
    """Quadratic approximation of a reading as a function of the constants, in prior standard deviations."""

    constant: float
    slope: FloatArray  # (constants,)
    curvature: FloatArray  # (constants, constants), symmetric
    rest: float  # RMS residual of the regression

    @classmethod
    def of(cls, rows: FloatArray, values: FloatArray) -> Surrogate:
        """Fit a quadratic function of the constants to the readings `values` by ridge regression.

        `rows` contains the constants of the hammers with these readings, shape (hammers, constants).
        """
        known = np.isfinite(values)
        size = rows.shape[1]
        upper = np.triu_indices(size)
        own = rows[known]
        terms = np.concatenate([np.ones((len(own), 1)), own, own[:, upper[0]] * own[:, upper[1]]], axis=1)
        normal = terms.T @ terms + _RIDGE * np.eye(terms.shape[1])
        factors = np.linalg.solve(normal, terms.T @ values[known])
        rest = values[known] - terms @ factors
        curvature = np.zeros((size, size))
        curvature[upper] = factors[size + 1 :]
        freedom = max(len(own) - terms.shape[1], 1)
        return cls(
            float(factors[0]),
            factors[1 : size + 1],
            curvature + curvature.T,
            float(np.sqrt(rest @ rest / freedom)),
        )

    def value(self, rows: FloatArray) -> FloatArray:
        """Compute the predicted reading of M hammers; `rows` are their constants, shape (M, constants)."""
        bent = 0.5 * np.einsum("mi,ij,mj->m", rows, self.curvature, rows)
        return np.asarray(self.constant + rows @ self.slope + bent)

    def gradient(self, rows: FloatArray) -> FloatArray:
        """Compute the gradient of the reading with respect to the constants, shape (M, constants)."""
        return np.asarray(self.slope + rows @ self.curvature)


DOTS: Final = 9  # Arbitrary
"""Number of dots in the ladder, the sequence of test pulses that is printed before the test lines."""

# Widths of single pulses and of both pulses of a pair, as fractions of the nominal width; arbitrary
_SINGLE: Final = (0.7, 0.85, 1.0, 1.15, 1.3, 1.45)
_FIRST: Final = (0.8, 1.0, 1.3)
"""Widths of the first pulse of a pair, as fractions of the nominal width; arbitrary."""
_SECOND: Final = (1.0, 1.3, 1.5)
"""Widths of the second pulse of a pair, as fractions of the nominal width; arbitrary."""
# Times of the second pulse after the armature has left the pack, as fractions of the flight time; arbitrary
_LATER: Final = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0, 1.2, 1.6, 2.0, 2.4)
_CLEAR: Final = 20e-6  # Allowance for a unit that leaves the pack later than the nominal hammer, s; arbitrary
_SEEN: Final = 0.97
"""Smallest fraction of simulated hammers that must print all dots of a candidate rung; arbitrary."""
_RUNS: Final = 8.0  # Number of averaged runs for which the choice of rungs is optimised; arbitrary
_POINTS: Final = 24  # Number of simulated hammers over which the design is averaged; arbitrary


class Rung(NamedTuple):
    """Single test pulse, or a pair of pulses fired `later` [s] apart; a single pulse has `later` 0.

    `first` and `second` are the widths of the pulses, as fractions of the nominal width.
    """

    first: float
    later: float = 0.0
    second: float = 1.0

    @property
    def dots(self) -> int:
        """Number of dots: 1 for a single test pulse, 2 for a pair."""
        return 2 if self.later else 1


def candidates(task: Task) -> list[Rung]:
    """List the candidate test pulses, single and paired.

    The second pulse of a pair is fired after the armature has left the pack.
    """
    hammer, widest = task.hammers[0], task.widest / task.width
    rungs = [Rung(part) for part in _SINGLE if part <= widest]
    for first in _FIRST:
        if first > widest:
            continue
        drive = PulseTrain(of_width(task.pulse, first * task.width))
        contacts = simulate(
            hammer, drive, duration=task.single.settled, tolerance=task.effort.tolerance
        ).contacts
        dot = next((contact for contact in contacts if contact.surface == "pack"), None)
        if dot is None or dot.t_out is None:
            continue
        clear = max(float(dot.t_out), first * task.width + task.faded) + _CLEAR
        rungs += [
            Rung(first, clear + part * task.single.nominal.flight_time, second)
            for second in _SECOND
            if second <= widest
            for part in _LATER
        ]
    return rungs


def choose(
    times: Mapping[Rung, FloatArray],
    line: Sequence[Surrogate],
    force: Surrogate,
    rows: FloatArray,
    noise: float,
    offset: float,
) -> list[Rung]:
    """Select test pulses with a total of `DOTS` dots by greedy A-optimal design.

    Parameters
    ----------
    times
        Candidate rungs, and the impact times of their dots over the arrival limit, shape (members, dots).
    line
        Surrogates of the impact times of a line in open loop.
    force
        Surrogate of the force of the single pulse.
    rows
        Constants of simulated hammers (members), in prior standard deviations, shape (members, constants).
    noise, offset
        Standard deviations of a single time reading and of the sensor's offset, over the arrival limit.
    """
    points, variance = rows[:_POINTS], noise**2 / _RUNS
    wanted = np.pad(force.gradient(points), ((0, 0), (0, 1)))
    same = np.full((len(points), 1), offset)

    def information(readings: Sequence[Surrogate]) -> FloatArray:
        # The surrogate's residual counts as noise: far from a solution, a search cannot resolve it.
        slopes = [
            np.hstack([each.gradient(points), same]) / np.sqrt(variance + each.rest**2) for each in readings
        ]
        return np.asarray(np.einsum("rpi,rpj->pij", slopes, slopes)) if slopes else np.zeros(())

    def unknown(known: FloatArray) -> float:
        solved = np.linalg.solve(known, wanted[:, :, None])[:, :, 0]
        return float(np.log(np.einsum("pi,pi->p", wanted, solved)).mean())

    offered = {}
    for rung, shown in times.items():
        if rung == Rung(1.0) or np.isfinite(shown).all(axis=1).mean() >= _SEEN:
            offered[rung] = information([Surrogate.of(rows, column) for column in shown.T])
    known = np.eye(rows.shape[1] + 1) + information(line)
    chosen: list[Rung] = []
    left = DOTS
    while left:
        worth = {
            rung: (unknown(known) - unknown(known + gain)) / rung.dots
            for rung, gain in offered.items()
            if rung.dots <= left
        }
        best = max(worth, key=lambda rung: worth[rung])
        known = known + offered[best]
        chosen.append(best)
        left -= best.dots
    return sorted(chosen)


_MOST: Final = 4096  # Maximum number of hammers in an ensemble; bounds the memory; arbitrary
_STEPS: Final = (1, 2)  # Slots from dot to dot in the rows whose multipliers are computed; arbitrary

LINE: Final = slots_of(cycle_with_lead_in(5, 0))
"""Slots of the test line: the de Bruijn cycle of order 5, in which every history of two gaps occurs."""


class DrivenLine(NamedTuple):
    """Test line and its drive: table settings, waveform of the pulses, and slots with a dot.

    The settings are advance, width, brake delay and brake width of each entry, s, shape (4, entries).
    """

    settings: FloatArray
    pulse: Waveform
    slots: tuple[int, ...] = LINE


class Order(NamedTuple):
    """Print job to simulate: hammers, a drive for each hammer, and the end time."""

    hammers: Sequence[Hammer]  # Hammers to simulate, (M,)
    drives: Sequence[PulseSequence]  # One drive per hammer, (M,)
    end: float  # End time of the simulation, s


class Printed(NamedTuple):
    """Result of a print job: the dots of each hammer, and a mask of the completed simulations."""

    dots: DotTable  # Dots, (M, largest number of firings of a drive)
    ok: BoolArray  # Mask of the runs that completed, (M,)


@dataclass(frozen=True)
class Press:
    """Simulator in which each of M hammers prints test pulses and test lines at the slot rate `rate` [Hz]."""

    task: Task
    rate: float
    hammers: Sequence[Hammer]

    def ladder(self, rungs: Sequence[Rung]) -> tuple[FloatArray, FloatArray]:
        """Simulate test pulses (a ladder) on every hammer.

        Returns the flight times [s] and the peak forces relative to the single pulse, shape (M, dots).
        """
        return printed(self.order_ladder(rungs), self.task)

    def line(
        self,
        settings: Sequence[FloatArray],
        slots: Sequence[int] = LINE,
        pulses: Sequence[Waveform] | None = None,
    ) -> tuple[DotTable, Judgement]:
        """Simulate a test line on every hammer; return the dots and their deviations.

        `settings` contains the table settings for each hammer, as in `DrivenLine`. `pulses` are the
        waveforms, one per hammer; the default is the pulse of the task for all hammers.
        """
        return printed(self.order_line(settings, slots, pulses), self.task)

    def multipliers(self, settings: FloatArray) -> FloatArray:
        """Compute the multiplier of rows of dots printed with table settings, one value per hammer.

        `settings` is as in `DrivenLine`. The multiplier is the larger absolute Floquet multiplier of two
        rows, one with a dot in every slot and one with a dot in every second slot; see
        `printhammer.derivatives.rows.row_multipliers`. The result is NaN if neither row is periodic.
        """
        task, count, drives = self.task, len(self.hammers), []
        for step in _STEPS:
            slots = range(0, step * ROW_DOTS, step)
            made = pulses_of(Settings(*settings), task.gaps, task.reach, slots, self.rate)
            drives += [sequence(made, task.pulse, {})] * count
        growth = row_multipliers(list(self.hammers) * len(_STEPS), drives, task.effort)
        return np.asarray(np.fmax.reduce(np.abs(growth).reshape(len(_STEPS), count)))

    def order_ladder(self, rungs: Sequence[Rung]) -> Printing[tuple[FloatArray, FloatArray]]:
        """Compute the results of `ladder` in a coroutine: yield the print job and receive its result."""
        task, count = self.task, len(self.hammers)
        drives = []
        for rung in rungs:
            parts = ((0.0, rung.first), (rung.later, rung.second))[: rung.dots]
            pulses = [of_width(task.pulse, part * task.width) for _at, part in parts]
            drives.append(PulseSequence(pulses, at=[at for at, _part in parts]))
        hammers = [hammer for hammer in self.hammers for _ in rungs]
        ((dots, _ok),) = yield [
            Order(hammers, drives * count, task.window + max(rung.later for rung in rungs))
        ]
        times, forces = (
            np.concatenate(
                [each.reshape(count, len(rungs), -1)[:, k, : rung.dots] for k, rung in enumerate(rungs)],
                axis=1,
            )
            for each in (dots.flight_time, dots.peak_force / task.single.nominal.force)
        )
        return times, forces

    def order_line(
        self,
        settings: Sequence[FloatArray],
        slots: Sequence[int] = LINE,
        pulses: Sequence[Waveform] | None = None,
    ) -> Printing[tuple[DotTable, Judgement]]:
        """Compute the results of `line` in a coroutine: yield the print job and receive its result."""
        task, due = self.task, slot_times(slots, self.rate)
        fired = [task.pulse] * len(settings) if pulses is None else pulses
        known: dict[int, dict[tuple[float, float, float], Waveform]] = {id(pulse): {} for pulse in fired}
        keys = [(id(own), id(pulse)) for own, pulse in zip(settings, fired, strict=True)]
        drives: dict[tuple[int, int], PulseSequence] = {}
        for key, own, pulse in zip(keys, settings, fired, strict=True):
            if key not in drives:
                made = pulses_of(Settings(*own), task.gaps, task.reach, slots, self.rate)
                drives[key] = sequence(made, pulse, known[id(pulse)])
        end = float(due[-1]) + task.window
        ((dots, ok),) = yield [Order(self.hammers, [drives[key] for key in keys], end)]
        shape = len(self.hammers), len(slots)
        wanted, times = np.ones(shape, np.bool_), np.broadcast_to(due, shape)
        return dots, judge(dots, wanted, times, task.single.nominal, task.limits, ok)


def printed(work: Printing[T], task: Task) -> T:
    """Run a learner's coroutine to its end: simulate the yielded print jobs, and return the result."""
    return answered(work, partial(_run, effort=task.effort))


def _run(orders: Sequence[Order], effort: Effort) -> list[Printed]:
    """Simulate print jobs in as few ensembles of at most `_MOST` hammers as possible; return the results."""
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
            tolerance=effort.tolerance,
        ).run(dots=True, threads=effort.threads)
        assert result.dots is not None
        first = 0
        for order in batch:
            own = slice(first, first + len(order.hammers))
            firings = max((len(drive.times) for drive in order.drives), default=0)
            parts = {name: values[own, :firings] for name, (_, values) in result.dots.entries().items()}
            done.append(Printed(DotTable(**parts), result.ok[own]))
            first = own.stop
    return done
