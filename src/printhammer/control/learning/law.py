"""The learning law: from what is believed of a unit to the entries of its table.

After stage s the corrections u of the entries become

    u(s+1) = Q u(s) - L e(u(s)),    Q = 1 - forgetting,

where e holds how far force and arrival of all dots of a line are off. That is iterative learning control,
from run to run. What the sensor shows is one number a dot, or two, with noise; e is therefore what the
hammers that are believed in print with these entries, in the mean over the modes, and a part a of what
readings of the line differ from that, as far as noise does not explain it: of what the laws of the model do
not hold. L = G+, where G is the sensitivity of e to the entries, of the most probable hammer, and G+ its
regularised inverse, in which dots that are far off count for more. On hammers that are believed in nothing
has to be printed: there the law is followed until it leads no further (Newton's method of norm-optimal
learning control).

Convergence: corrections that differ come together, or at least not apart, where no eigenvalue of Q - L (G +
a (G' - G)) is beyond 1 in absolute value, G' being the sensitivity of the unit. It is not known; a, 1
otherwise, is halved until this holds for hammers that are held for possible.

What a learner may change of a table, and within which bounds.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from printhammer.control.learning.belief import Belief
from printhammer.control.learning.lines import LINE, Rung, Surrogate
from printhammer.control.learning.production import Production
from printhammer.control.table.drive import (
    COLUMNS,
    histories,
    histories_of,
    number_of,
    of_force,
    shared_numbers,
    with_pulse,
)
from printhammer.control.table.task import Task
from printhammer.control.table.tuning import tune
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.long_patterns import STEPS, row_of_dots
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.strategy import LEAD_IN, SLOTS, cycle_with_lead_in, slots_of
from printhammer.support.arrays import BoolArray, FloatArray, IntArray
from printhammer.support.threads import together

if TYPE_CHECKING:
    from printhammer.control.learning.lines import Press, Printing

STEP: Final = 1e-6  # Unit of the corrections, s
_LARGEST: Final = 25.0  # Largest change of an entry after a stage, in this unit
# How much later than the nominal hammer a unit may leave the pack; no pulse is fired before that, s
MARGIN: Final = 20e-6
_LEAST: Final = 0.5  # Least width of a pulse, in parts of that of the hammer
_LEAST_BRAKE: Final = 0.05  # Least width of a brake pulse, likewise
ADVANCE, WIDTH, DELAY, BRAKE = range(4)


class OpenLoop(NamedTuple):
    """A pulse that is fired at every slot: its settings (4, entries), and its waveform."""

    settings: FloatArray
    pulse: Waveform


@dataclass(frozen=True)
class Adjustable:
    """The entries of a table that are learned: advance, width, and brake where there is one.

    `base` (4, entries) are the settings that corrections are added to, at a rate, Hz, as times after the
    slots of a hammer with its driver, s. Corrections are arrays (..., inputs), in units of `STEP`.
    """

    task: Task
    rate: float
    base: FloatArray
    own: OpenLoop | None = None
    """The open loop of the hammer's own pulse; None if the pulse of the task is that, or it has no width."""

    @cached_property
    def inputs(self) -> IntArray:
        """Row and column in the settings of each input, shape (2, inputs)."""
        numbers = [number_of(each, self.task.reach) for each in histories(self.task.gaps, self.task.reach)]
        cells = [(row, number) for row in (ADVANCE, WIDTH) for number in numbers]
        cells += [(BRAKE, number) for number in numbers if self.base[BRAKE, number] > 0.0]
        return np.array(cells).T

    @property
    def open_loop(self) -> FloatArray:
        """The settings of the open loop, (4, entries): the same pulse at every slot."""
        settings = np.zeros_like(self.base)
        settings[WIDTH] = self.task.width
        return settings

    @property
    def loops(self) -> list[OpenLoop]:
        """The open loops that there are: that of the pulse of the task, and of the hammer's own."""
        plain = OpenLoop(self.open_loop, self.task.pulse)
        return [plain] if self.own is None else [plain, self.own]

    def limited(self, before: FloatArray, change: FloatArray) -> FloatArray:
        """Return corrections (inputs,) after a change, such that the settings keep to all bounds."""
        after = before + np.clip(change, -_LARGEST, _LARGEST)
        rows, columns = self.inputs
        return np.asarray((self._bounded(self._raw(after)) - self.base)[rows, columns] / STEP)

    def started_from(self, base: FloatArray) -> Adjustable:
        """Return the entries of another table, (4, entries), moved to where they keep to all bounds."""
        # No entry has the right to stay beyond a bound.
        strict, own = base.copy(), base.copy()
        strict[ADVANCE] = -np.inf
        own[ADVANCE] = np.maximum(own[ADVANCE], -self.task.latest(own[WIDTH]))
        return replace(self, base=replace(self, base=strict)._bounded(own))

    def settings(self, corrections: FloatArray) -> FloatArray:
        """Return the settings with corrections (inputs,), shape (4, entries)."""
        shared = shared_numbers(self.task.gaps, self.task.reach)
        return np.asarray(self._raw(corrections)[:, shared])

    def _raw(self, corrections: FloatArray) -> FloatArray:
        settings = self.base.copy()
        settings[self.inputs[0], self.inputs[1]] += STEP * corrections
        return settings

    def _bounded(self, settings: FloatArray) -> FloatArray:
        """Keep to the bound of the current, and to no pulse before the armature has left the pack."""
        task, base = self.task, self.base
        settings[WIDTH] = np.clip(settings[WIDTH], _LEAST * task.width, task.widest)
        brake = np.clip(settings[BRAKE], _LEAST_BRAKE * task.width, task.widest)
        settings[BRAKE] = np.where(base[BRAKE] > 0.0, brake, 0.0)
        for history in histories(task.gaps, task.reach):
            place = number_of(history, task.reach)
            settings[ADVANCE, place] = max(
                settings[ADVANCE, place],
                min(-float(task.latest(settings[WIDTH, place])), base[ADVANCE, place]),
            )
            if history[0]:
                clear = 0.0 if base[BRAKE, place] > 0.0 else MARGIN
                first = float(task.earliest(settings[DELAY, place], settings[BRAKE, place])) + clear
                most = max(history[0] / self.rate - first, base[ADVANCE, place])
                if base[BRAKE, place] > 0.0:
                    most = min(most, history[0] / self.rate - first)
                settings[ADVANCE, place] = min(settings[ADVANCE, place], most)
        return settings


RUNS: Final = (1, 1, 2, 4, 8, 24)  # Number of runs of each stage
GATE: Final = 3.0  # Deviation, in parts of the limits, beyond which one counts as this
_DAMPING: Final = 1e-3  # Of the inverse of G: mean square of deviations, in parts of the limits, per `STEP`
_STEEP: Final = 2.0  # By how much more what is far off counts, for each square of the limits
_SIZES: Final = (1.0, 0.5, 0.2)  # Parts of a change that are tried
_NEWTON: Final = 10  # How often, at most, the law is applied to the hammer that is believed in, after a stage
BAD: Final = 10.0
"""What is left over, as `Update` has it, beyond which another start is tried."""

_SLOW: Final = 0.85  # Part of the badness of the time before below which it pays to go on
_LEAST_LAW: Final = 1e-2  # Least part of what is not explained that is put right
_OTHERS: Final = 4  # Number of probable hammers for which corrections must not move apart
_ALIKE: Final = 24  # Number of probable hammers that decide whether the table is used
_GAIN: Final = 0.02  # Least share of the dots that the table gains in the mean over these
TRIED: Final = slots_of(cycle_with_lead_in(6, 0))
"""Slots of the line that corrections are tried on, on hammers that are believed in: the cycle of order 6."""


def _judged_slots() -> tuple[int, ...]:
    """Return the slots of the cycle with its lead-in and, each from rest, of the rows of dots."""
    slots = slots_of(cycle_with_lead_in())
    for step in STEPS:
        slots += tuple(slots[-1] + 1 + SLOTS + slot for slot in row_of_dots(step))
    return slots


PRINTED: Final = _judged_slots()
"""Slots on which tables are judged: the cycle after its lead-in, and rows of 200 slots, each from rest."""

JUDGED: Final = np.asarray(PRINTED) >= LEAD_IN
"""Mask of the dots that count, (dots,)."""

IN_CYCLE: Final = np.asarray(PRINTED)[JUDGED] < LEAD_IN + 2**SLOTS
"""Mask of the dots of the cycle among these, (counted dots,)."""


class Verdict(NamedTuple):
    """Comparison of a table with the open loops on the hammers believed in."""

    gains: bool  # Whether the table is better than both open loops
    loop: OpenLoop  # The open loop that is used otherwise
    multiplier: float  # Largest absolute multiplier of rows printed with the table; NaN if no row is periodic
    expected: float  # Mean fraction of dots within limits, with the drive that is used
    certainty: float  # Fraction of the hammers that print every dot within limits with it


class Update(NamedTuple):
    """Result of a stage."""

    corrections: FloatArray  # (inputs,)
    contraction: float  # Largest eigenvalue of Q - L (G + a (G' - G))
    verdict: Verdict
    left: float  # Deviations that remain on the hammers believed in, squared, as fractions of the limits


class _Unit(NamedTuple):
    """What is believed of a unit, as hammers that print."""

    hammers: Sequence[Hammer]  # The most probable first
    weights: FloatArray  # Their probabilities
    more: FloatArray  # How far dots are off beyond that, (2 dots,)


@dataclass(frozen=True)
class LearningLaw:
    """What a learner knows: the production, the ladder, and what to do with readings. Nothing of a unit."""

    entries: Adjustable
    production: Production
    forgetting: float
    # Share of the probable hammers that may print fewer dots with the table than in an open loop
    doubt: float
    seed: int
    rungs: tuple[Rung, ...]
    # How readings depend on the constants, of the ladder and of a line in an open loop, times before forces
    shown: tuple[Surrogate, ...]
    rows: FloatArray  # Constants of simulated hammers, (members, size): where a search may begin
    seen: FloatArray  # Their readings, (members, readings)
    first: OpenLoop  # The better open loop in the mean over the production

    def update(self, belief: Belief, corrections: FloatArray, unexplained: FloatArray) -> Printing[Update]:
        """Return what is done after a stage; asks for what the hammers believed in print.

        `unexplained` (2, dots) is by how much arrival and force of the dots of the line are off beyond what
        is believed, in parts of the limits.
        """
        modes = self.production.hammers(np.array([mode.mean for mode in belief.modes]))
        there = np.array([hammer is not None for hammer in modes])
        weights = belief.weights[there] / belief.weights[there].sum()
        unit = _Unit([each for each in modes if each is not None], weights, self._by_history(unexplained))
        probable = belief.draw(_ALIKE, self.seed)
        alike = [each for each in self.production.hammers(probable) if each is not None]
        keep = 1.0 - self.forgetting
        (off,), slopes, *others = yield from together(
            [
                self._expected(unit, [corrections]),
                *(self._slopes(each, corrections) for each in (unit.hammers[0], *alike[:_OTHERS])),
            ]
        )
        gain = _gain(off, slopes)
        others = [gain @ other for other in others]
        own = keep * np.eye(len(corrections)) - gain @ slopes

        def largest(part: float) -> float:
            moved = [own - part * (other - gain @ slopes) for other in others]
            return float(max(np.abs(np.linalg.eigvals(each)).max() for each in moved))

        part = 1.0
        while largest(part) > 1.0 and part > _LEAST_LAW:
            part *= 0.5
        contraction, unit = largest(part), unit._replace(more=part * unit.more)
        left, found = yield from self._followed(unit, keep * corrections)
        if left > BAD and corrections.any():
            # The table that learning starts from may lead to where what was learned does not.
            other = yield from self._followed(unit, 0.0 * corrections)
            left, found = min((left, found), other, key=lambda end: end[0])
        verdict = yield from self._compared(alike, found)
        return Update(found, contraction, verdict, left)

    def started_anew(self, belief: Belief) -> LearningLaw | None:
        """Return the same law, starting from a table that is tuned for the hammer believed in.

        Its dots from rest are made as hard as those of the nominal hammer, and arrive when those do. There is
        none where no table prints every dot.
        """
        task = self.entries.task
        (hammer,) = self.production.hammers(belief.modes[0].mean[None])
        if hammer is None:
            return None
        with suppress(InputError):
            single = task.single.nominal
            driven = with_pulse(hammer, task.pulse)
            struck = of_force(driven, task.pulse, single.force, 0.5 * task.width, task.widest)
            table = tune(
                struck,
                rate=self.entries.rate,
                history=task.gaps,
                reach=task.reach,
                limits=task.limits,
                brake=task.brake,
                largest_current=task.largest,
                effort=task.effort,
            )
            base = np.array([getattr(table, name)[0] for name in COLUMNS])
            sooner = nominal(struck, tolerance=task.effort.tolerance).flight_time - single.flight_time
            base[ADVANCE] += sooner
            base[DELAY] = np.where(base[DELAY] > 0.0, np.maximum(base[DELAY] - sooner, task.brake_from), 0.0)
            return replace(self, entries=self.entries.started_from(base))
        return None

    def _followed(self, unit: _Unit, corrections: FloatArray) -> Printing[tuple[float, FloatArray]]:
        """Return to which corrections the law leads, and what they leave."""
        best = np.inf, corrections
        for _ in range(_NEWTON):
            (off,), slopes = yield from together(
                [self._expected(unit, [corrections]), self._slopes(unit.hammers[0], corrections)]
            )
            change = -_gain(off, slopes) @ off
            tried = [self.entries.limited(corrections, size * change) for size in _SIZES]
            expected = yield from self._expected(unit, tried)
            left = [_badness(each) for each in expected]
            k = int(np.argmin(left))
            before, corrections = best[0], tried[k]
            best = min(best, (left[k], corrections), key=lambda end: end[0])
            if left[k] > _SLOW * before:
                break
        return best

    def _by_history(self, unexplained: FloatArray) -> FloatArray:
        """Return what a line shows of the histories of the dots of `TRIED`, (2 dots,)."""
        task = self.entries.task
        shown, wanted = (histories_of(slots, task.gaps, task.reach)[:-1] for slots in (LINE, TRIED))
        sums = np.zeros((2, shown.max() + 1))
        for sums_of, values in zip(sums, unexplained, strict=True):
            np.add.at(sums_of, shown, values)
        return np.asarray((sums / np.maximum(np.bincount(shown), 1))[:, wanted]).ravel()

    def _off(self, hammers: Sequence[Hammer], corrections: Sequence[FloatArray]) -> Printing[FloatArray]:
        """Return how far arrival and force of `TRIED` are off, in parts of the limits, (M, 2 dots)."""
        press, limits = self.production.press(hammers), self.entries.task.limits
        known = {id(row): self.entries.settings(row) for row in corrections}
        _dots, judgement = yield from press.order_line([known[id(row)] for row in corrections], TRIED)
        off = judgement.arrival_deviation / limits.arrival, judgement.force_deviation / limits.force
        return np.clip(np.nan_to_num(np.concatenate(off, axis=1), nan=GATE), -GATE, GATE)

    def _expected(self, unit: _Unit, corrections: Sequence[FloatArray]) -> Printing[FloatArray]:
        """Return how far dots are off in the mean over what is believed, (M, 2 dots)."""
        hammers = [hammer for _ in corrections for hammer in unit.hammers]
        rows = [row for row in corrections for _ in unit.hammers]
        off = yield from self._off(hammers, rows)
        by_hammer = off.reshape(len(corrections), len(unit.hammers), -1)
        return np.asarray(np.einsum("m,kmd->kd", unit.weights, by_hammer) + unit.more)

    def _slopes(self, hammer: Hammer, corrections: FloatArray) -> Printing[FloatArray]:
        """Return how far dots move with each input, (2 dots, inputs)."""
        rows = [corrections, *(corrections + np.eye(len(corrections)))]
        off = yield from self._off([hammer] * len(rows), rows)
        return np.asarray((off[1:] - off[0]).T)

    def _compared(self, alike: Sequence[Hammer], corrections: FloatArray) -> Printing[Verdict]:
        """Compare a table with the open loops on probable hammers.

        The table gains if these print more dots with it than in either open loop, and none of them, but for
        doubt, prints fewer, or has a row in which errors grow from dot to dot.
        """
        press, settings = self.production.press(alike), self.entries.settings(corrections)
        table = yield from order_good(press, [settings] * len(alike))
        others = yield from order_loops(press, self.entries)
        shares = np.array([good.mean(axis=1) for good in others])
        growth = press.multipliers(settings)
        steady = bool(np.quantile(np.nan_to_num(growth), 1.0 - self.doubt) <= 1.0)
        gains = steady and self._leads(table.mean(axis=1), shares)
        # The open loop that is better over the production, unless no likely unit loses with the other.
        loops = self.entries.loops
        chosen = next(k for k, loop in enumerate(loops) if loop.pulse is self.first.pulse)
        chosen = next((k for k in range(len(loops)) if self._leads(shares[k], shares[[chosen]])), chosen)
        good = table if gains else others[chosen]
        every = float(good.all(axis=1).mean())
        return Verdict(gains, loops[chosen], float(np.fmax.reduce(growth)), float(good.mean()), every)

    def _leads(self, share: FloatArray, others: FloatArray) -> bool:
        """Whether hammers (M,) print more dots in the mean than in other ways (ways, M), and none fewer."""
        harmless = np.quantile(share - others.max(axis=0), self.doubt) >= 0.0
        return bool(harmless and share.mean() - others.mean(axis=1).max() >= _GAIN)


def order_loops(press: Press, entries: Adjustable) -> Printing[list[BoolArray]]:
    """Return which dots of `PRINTED` are within limits, (M, dots), in each open loop, as `order_good`."""
    count = len(press.hammers)
    return (
        yield from together(
            [order_good(press, [loop.settings] * count, [loop.pulse] * count) for loop in entries.loops]
        )
    )


def order_good(
    press: Press, settings: Sequence[FloatArray], pulses: Sequence[Waveform] | None = None
) -> Printing[BoolArray]:
    """Return which dots of `PRINTED` are within limits, (M, dots), those of the lead-in left out."""
    _dots, judgement = yield from press.order_line(settings, PRINTED, pulses)
    return np.asarray(judgement.good[:, JUDGED])


def _badness(off: FloatArray) -> float:
    """Return what corrections make least: the squares, and more of what is far off."""
    return float(np.sum(off**2 + _STEEP * off**4))


def _gain(off: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return L of the law, (inputs, 2 dots): the inverse of a sensitivity, weighted as by `_badness`."""
    weight = 1.0 + 2.0 * _STEEP * off**2
    normal = slopes.T @ (weight[:, None] * slopes) + _DAMPING * len(TRIED) * np.eye(slopes.shape[1])
    return np.asarray(np.linalg.solve(normal, slopes.T * weight))
