"""Iterative learning control of the entries of a compensation table, from the posterior of a unit.

After stage s the corrections u of the entries become (Bristow, Tharayil and Alleyne, *IEEE Control Systems
Magazine* 26(3), 2006)

    u(s+1) = Q u(s) - L e(u(s)),    Q = 1 - forgetting,

where e contains the deviations of force and arrival of all dots of a line. The sensor measures one or two
noisy numbers per dot, so e is estimated: the mean deviation of the posterior modes when they print with these
entries, plus a fraction a of the model error, which is the difference between measured and predicted readings
beyond the noise. L = G+ is the regularised pseudo-inverse of G, the sensitivity of e to the entries for the
most probable hammer; dots with large deviations have a larger weight. Simulated hammers cost no paper: on
them the law is iterated until it converges (norm-optimal learning control by Newton's method).

Convergence: the difference of two corrections does not grow if no eigenvalue of Q - L (G + a (G' - G))
exceeds 1 in absolute value, where G' is the sensitivity of the unit. G' is unknown; a starts at 1 and is
halved until the condition holds for samples of the posterior.

`Adjustable` defines which entries of a table a learner may change, and within which bounds.
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
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.strategy import (
    LEAD_IN,
    SLOTS,
    STEPS,
    cycle_with_lead_in,
    row_of_dots,
    slots_of,
)
from printhammer.support.arrays import BoolArray, FloatArray, IntArray
from printhammer.support.threads import together

if TYPE_CHECKING:
    from printhammer.control.learning.lines import Press, Printing

STEP: Final = 1e-6  # Unit of the corrections, s; arbitrary
_LARGEST: Final = 25.0  # Largest change of an entry after a stage, in units of `STEP`; arbitrary
# Allowance, s, for a unit that leaves the pack later than the nominal hammer; no pulse is fired earlier;
# arbitrary
MARGIN: Final = 20e-6
_LEAST: Final = 0.5  # Smallest width of a pulse, as a fraction of the nominal width; arbitrary
_LEAST_BRAKE: Final = 0.05  # Smallest width of a brake pulse, as a fraction of the nominal width; arbitrary
ADVANCE, WIDTH, DELAY, BRAKE = range(4)


class OpenLoop(NamedTuple):
    """Open-loop drive, the same pulse at every slot, as table settings and waveform."""

    settings: FloatArray
    pulse: Waveform


@dataclass(frozen=True)
class Adjustable:
    """Table entries that are learned: advance and width of print pulses, and width of brake pulses.

    Settings are arrays of shape (4, entries): advance, width, brake delay and brake width of each table
    entry, s. Corrections, arrays of shape (..., inputs) in units of `STEP`, are added to the settings `base`,
    which are tuned for the hammer of `task` with its driver. `rate` is the slot rate, Hz.
    """

    task: Task
    rate: float
    base: FloatArray
    own: OpenLoop | None = None
    """Open loop with the hammer's own pulse; None if the task uses that pulse or the pulse has no width."""

    @cached_property
    def inputs(self) -> IntArray:
        """Row and column of each learned input in the array of table settings, shape (2, inputs)."""
        numbers = [number_of(each, self.task.reach) for each in histories(self.task.gaps, self.task.reach)]
        cells = [(row, number) for row in (ADVANCE, WIDTH) for number in numbers]
        cells += [(BRAKE, number) for number in numbers if self.base[BRAKE, number] > 0.0]
        return np.array(cells).T

    @property
    def open_loop(self) -> FloatArray:
        """Table settings of the open loop: the same pulse at every slot, without advance or brake pulse."""
        settings = np.zeros_like(self.base)
        settings[WIDTH] = self.task.width
        return settings

    @property
    def loops(self) -> list[OpenLoop]:
        """Open-loop drives to compare a table with: the task's pulse and, if any, the hammer's own pulse."""
        plain = OpenLoop(self.open_loop, self.task.pulse)
        return [plain] if self.own is None else [plain, self.own]

    def limited(self, before: FloatArray, change: FloatArray) -> FloatArray:
        """Return the corrections `before` + `change`, reduced where a setting would exceed its bounds."""
        after = before + np.clip(change, -_LARGEST, _LARGEST)
        rows, columns = self.inputs
        return np.asarray((self._clip(self._raw(after)) - self.base)[rows, columns] / STEP)

    def started_from(self, base: FloatArray) -> Adjustable:
        """Return a copy whose base settings are the table settings `base`, clipped to all bounds."""
        # Unlike entries of the first table, entries of this table may not stay beyond a bound.
        strict, own = base.copy(), base.copy()
        strict[ADVANCE] = -np.inf
        own[ADVANCE] = np.maximum(own[ADVANCE], -self.task.latest(own[WIDTH]))
        return replace(self, base=replace(self, base=strict)._clip(own))

    def settings(self, corrections: FloatArray) -> FloatArray:
        """Return the table settings that result from adding `corrections` to the base settings."""
        shared = shared_numbers(self.task.gaps, self.task.reach)
        return np.asarray(self._raw(corrections)[:, shared])

    def _raw(self, corrections: FloatArray) -> FloatArray:
        settings = self.base.copy()
        settings[self.inputs[0], self.inputs[1]] += STEP * corrections
        return settings

    def _clip(self, settings: FloatArray) -> FloatArray:
        """Clip settings to the current limit, and to firing times after the armature has left the pack."""
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


RUNS: Final = (1, 1, 2, 4, 8, 24)  # Number of runs of each stage; arbitrary
GATE: Final = 3.0  # Deviations are clipped at this multiple of the limits; arbitrary
_DAMPING: Final = 1e-3
"""Regularisation of G+: mean square normalised deviation that costs as much as one `STEP`; arbitrary."""
_STEEP: Final = 2.0  # Weight of the quartic term of the objective relative to the quadratic term; arbitrary
_SIZES: Final = (1.0, 0.5, 0.2)  # Step fractions of the line search; arbitrary
_NEWTON: Final = 10  # Iteration limit of the law on simulated hammers after a stage; arbitrary
BAD: Final = 10.0  # Arbitrary
"""Final objective of a stage (`Update.left`) above which the learner tries another starting table."""

_SLOW: Final = 0.85
"""Largest ratio of successive objective values with which the iteration continues; arbitrary."""
_LEAST_LAW: Final = 1e-2  # Lower bound of the fraction a of the model error that is corrected; arbitrary
_OTHERS: Final = 4  # Number of posterior samples on which the convergence condition is checked; arbitrary
_ALIKE: Final = 24  # Number of posterior samples on which table and open loops are compared; arbitrary
_GAIN: Final = 0.02
"""Smallest mean gain, as a fraction of the dots, at which a table is used; arbitrary."""
SURE: Final = 0.9
"""Smallest fraction of posterior samples that have to favour an open loop for its choice; arbitrary."""

TRIED: Final = slots_of(cycle_with_lead_in(6, 0))
"""Slots of the line on which corrections are evaluated in simulation: the de Bruijn cycle of order 6."""


def _judged_slots() -> tuple[int, ...]:
    """List the slots of the test pattern: the test cycle with its lead-in, and rows of dots from rest."""
    slots = slots_of(cycle_with_lead_in())
    for step in STEPS:
        slots += tuple(slots[-1] + 1 + SLOTS + slot for slot in row_of_dots(step))
    return slots


PRINTED: Final = _judged_slots()
"""Slots of the pattern on which tables are tested: the cycle with its lead-in, and rows of 200 slots, each
from rest.
"""

_BRIEF: Final = 24  # Number of slots of a row of `COMPARED`; arbitrary


def _compared_slots() -> tuple[int, ...]:
    """List the slots of the line that compares open loops: the short cycle, and short rows from rest."""
    slots = LINE
    for step in STEPS:
        slots += tuple(slots[-1] + 1 + SLOTS + slot for slot in range(0, _BRIEF, step))
    return slots


COMPARED: Final = _compared_slots()
"""Slots of the line that a unit prints once in each open loop, for the choice of the open loop: the cycle of
the test line, and rows of 24 slots, each from rest."""

JUDGED: Final = np.asarray(PRINTED) >= LEAD_IN
"""Mask of the dots of `PRINTED` that are evaluated, shape (dots,): all except the lead-in."""

IN_CYCLE: Final = np.asarray(PRINTED)[JUDGED] < LEAD_IN + 2**SLOTS
"""Mask of the dots of the cycle among the evaluated dots, shape (evaluated dots,)."""


class Verdict(NamedTuple):
    """Outcome of comparing a compensation table with open-loop drive on posterior samples."""

    gains: bool  # Whether the table is better than both open-loop drives
    loop: OpenLoop  # Open-loop drive to use if the table is not better
    multiplier: float  # Largest absolute multiplier of rows printed with the table; NaN if no row is periodic
    expected: float  # Mean fraction of dots within limits, with the drive that is used
    certainty: float  # Fraction of the samples that print every dot within limits with the drive that is used
    # Fraction of the samples that print no fewer dots in `loop` than in another open loop; NaN if no
    # posterior explains the readings in both
    loop_certainty: float


class Update(NamedTuple):
    """Result of a learning stage: corrections, contraction factor, comparison with open loop, objective."""

    corrections: FloatArray  # (inputs,)
    contraction: float  # Largest eigenvalue of Q - L (G + a (G' - G))
    verdict: Verdict
    left: float  # Objective after the stage: squared deviations normalised by the limits, with a quartic term


class _Unit(NamedTuple):
    """Hammers at the posterior modes of a unit's constants, their weights, and the model error."""

    hammers: Sequence[Hammer]  # Hammers with the constants of the modes, the most probable first
    weights: FloatArray  # Posterior probabilities of the modes
    more: FloatArray  # Deviations due to the model error, (2 dots,)


@dataclass(frozen=True)
class LearningLaw:
    """Learning law common to all units: prior, test pulses and update of corrections, without readings."""

    entries: Adjustable
    production: Production
    forgetting: float
    # Fraction of the posterior samples that may print fewer dots with the table than in open loop
    doubt: float
    seed: int
    rungs: tuple[Rung, ...]
    # Surrogates of the readings of the ladder and of a line in open loop, times before forces
    shown: tuple[Surrogate, ...]
    rows: FloatArray  # Constants of simulated hammers, (members, size): starting points of searches
    seen: FloatArray  # Readings of the simulated hammers, (members, readings)
    first: OpenLoop  # Open-loop drive with the larger mean fraction of good dots over the production

    @property
    def alone(self) -> float:
        """Certainty of the choice of open loop without readings in both: NaN, or 1 if there is only one."""
        return 1.0 if len(self.entries.loops) == 1 else float("nan")

    def update(self, belief: Belief, corrections: FloatArray, unexplained: FloatArray) -> Printing[Update]:
        """Compute the corrections after a stage; yield the test lines to print with simulated hammers.

        `unexplained`, shape (2, dots), is the model error of arrival and force of the dots of the line,
        normalised by the limits.
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
                self._mean_deviations(unit, [corrections]),
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
        left, found = yield from self._smallest_objective(unit, keep * corrections)
        if left > BAD and corrections.any():
            # Starting over from the first table may converge where the learned corrections do not.
            other = yield from self._smallest_objective(unit, 0.0 * corrections)
            left, found = min((left, found), other, key=lambda end: end[0])
        verdict = yield from self._compare(alike, found)
        return Update(found, contraction, verdict, left)

    def choose_loop(self, belief: Belief, verdict: Verdict) -> Printing[Verdict]:
        """Choose an open loop by simulation on posterior samples; return `verdict` with this choice."""
        drawn = self.production.hammers(belief.draw(_ALIKE, self.seed))
        press = self.production.press([each for each in drawn if each is not None])
        others = yield from order_loops(press, self.entries)
        loops = self.entries.loops
        usual = next(k for k, loop in enumerate(loops) if loop.pulse is self.first.pulse)
        chosen, certainty = better_loop(np.array([good.mean(axis=1) for good in others]), usual)
        good = others[chosen]
        return verdict._replace(
            loop=loops[chosen],
            expected=float(good.mean()),
            certainty=float(good.all(axis=1).mean()),
            loop_certainty=certainty,
        )

    def started_anew(self, belief: Belief) -> LearningLaw | None:
        """Return a copy of the law that starts from a table tuned for the most probable hammer.

        Width and advance of the table's pulses are adjusted so that the dots from rest of the most probable
        hammer have the force and the arrival times of the nominal dots. The result is None if no table
        prints every dot.
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

    def _smallest_objective(self, unit: _Unit, corrections: FloatArray) -> Printing[tuple[float, FloatArray]]:
        """Iterate the law on simulated hammers; return the smallest objective, with its corrections."""
        best = np.inf, corrections
        for _ in range(_NEWTON):
            (off,), slopes = yield from together(
                [self._mean_deviations(unit, [corrections]), self._slopes(unit.hammers[0], corrections)]
            )
            change = -_gain(off, slopes) @ off
            tried = [self.entries.limited(corrections, size * change) for size in _SIZES]
            expected = yield from self._mean_deviations(unit, tried)
            left = [_badness(each) for each in expected]
            k = int(np.argmin(left))
            before, corrections = best[0], tried[k]
            best = min(best, (left[k], corrections), key=lambda end: end[0])
            if left[k] > _SLOW * before:
                break
        return best

    def _by_history(self, unexplained: FloatArray) -> FloatArray:
        """Average the model error of the test line by history; return the average for each dot of `TRIED`.

        `unexplained` is as for `update`; the result contains the arrivals of all dots, then their forces.
        """
        task = self.entries.task
        shown, wanted = (histories_of(slots, task.gaps, task.reach)[:-1] for slots in (LINE, TRIED))
        sums = np.zeros((2, shown.max() + 1))
        for sums_of, values in zip(sums, unexplained, strict=True):
            np.add.at(sums_of, shown, values)
        return np.asarray((sums / np.maximum(np.bincount(shown), 1))[:, wanted]).ravel()

    def _off(self, hammers: Sequence[Hammer], corrections: Sequence[FloatArray]) -> Printing[FloatArray]:
        """Simulate the pattern `TRIED`, and return the deviations of its dots as fractions of the limits.

        Hammer k prints with the corrections k. A row of the result contains the deviations in arrival of all
        dots, then the deviations in force.
        """
        press, limits = self.production.press(hammers), self.entries.task.limits
        known = {id(row): self.entries.settings(row) for row in corrections}
        _dots, judgement = yield from press.order_line([known[id(row)] for row in corrections], TRIED)
        off = judgement.arrival_deviation / limits.arrival, judgement.force_deviation / limits.force
        return np.clip(np.nan_to_num(np.concatenate(off, axis=1), nan=GATE), -GATE, GATE)

    def _mean_deviations(self, unit: _Unit, corrections: Sequence[FloatArray]) -> Printing[FloatArray]:
        """Compute the deviations of `_off`, averaged over the posterior modes, plus the model error."""
        hammers = [hammer for _ in corrections for hammer in unit.hammers]
        rows = [row for row in corrections for _ in unit.hammers]
        off = yield from self._off(hammers, rows)
        by_hammer = off.reshape(len(corrections), len(unit.hammers), -1)
        return np.asarray(np.einsum("m,kmd->kd", unit.weights, by_hammer) + unit.more)

    def _slopes(self, hammer: Hammer, corrections: FloatArray) -> Printing[FloatArray]:
        """Compute the sensitivity G of the deviations (rows) to the corrections (columns) by differences."""
        rows = [corrections, *(corrections + np.eye(len(corrections)))]
        off = yield from self._off([hammer] * len(rows), rows)
        return np.asarray((off[1:] - off[0]).T)

    def _compare(self, alike: Sequence[Hammer], corrections: FloatArray) -> Printing[Verdict]:
        """Compare a table with open-loop drive on the hammers `alike`, samples of the posterior.

        The table is better if the samples print more dots with the table than in either open loop, and if no
        sample, except for a fraction `doubt`, prints fewer dots or has a row in which errors grow from dot to
        dot.
        """
        press, settings = self.production.press(alike), self.entries.settings(corrections)
        table = yield from order_good(press, [settings] * len(alike))
        others = yield from order_loops(press, self.entries)
        shares = np.array([good.mean(axis=1) for good in others])
        growth = press.multipliers(settings)
        steady = bool(np.quantile(np.nan_to_num(growth), 1.0 - self.doubt) <= 1.0)
        gains = steady and self._leads(table.mean(axis=1), shares)
        # The open loop that is better over the production, unless another is better on the posterior samples.
        loops = self.entries.loops
        chosen = next(k for k, loop in enumerate(loops) if loop.pulse is self.first.pulse)
        chosen = next((k for k in range(len(loops)) if self._leads(shares[k], shares[[chosen]])), chosen)
        good = table if gains else others[chosen]
        every = float(good.all(axis=1).mean())
        most = float(np.fmax.reduce(growth))
        return Verdict(gains, loops[chosen], most, float(good.mean()), every, self.alone)

    def _leads(self, share: FloatArray, others: FloatArray) -> bool:
        """Whether a drive is better than all others; `share` and `others`: fractions of good dots by sample.

        The mean gain is at least `_GAIN`, and at most a fraction `doubt` of the samples print fewer dots.
        """
        harmless = np.quantile(share - others.max(axis=0), self.doubt) >= 0.0
        return bool(harmless and share.mean() - others.mean(axis=1).max() >= _GAIN)


def better_loop(shares: FloatArray, usual: int) -> tuple[int, float]:
    """Choose an open loop from the fraction of good dots in each loop on each sample, (loops, samples).

    The usual open loop, with index `usual`, is chosen unless another loop has a larger mean fraction and at
    least the fraction `SURE` of the samples print no fewer dots in that loop than in any other. Returns the
    index of the chosen loop, and the fraction of the samples that print no fewer dots in the chosen loop.
    """
    mean, sure = shares.mean(axis=1), (shares >= shares.max(axis=0)).mean(axis=1)
    better = (sure >= SURE) & (mean > mean[usual])
    chosen = int(np.argmax(np.where(better, mean, -np.inf))) if better.any() else usual
    return chosen, float(sure[chosen])


def order_loops(press: Press, entries: Adjustable) -> Printing[list[BoolArray]]:
    """Compute the mask of `order_good` for each open loop, in a coroutine that yields print jobs."""
    count = len(press.hammers)
    return (
        yield from together(
            [order_good(press, [loop.settings] * count, [loop.pulse] * count) for loop in entries.loops]
        )
    )


def order_good(
    press: Press, settings: Sequence[FloatArray], pulses: Sequence[Waveform] | None = None
) -> Printing[BoolArray]:
    """Compute which evaluated dots of `PRINTED` are within limits, in a coroutine that yields print jobs.

    The mask has one row per hammer of `press`.
    """
    _dots, judgement = yield from press.order_line(settings, PRINTED, pulses)
    return np.asarray(judgement.good[:, JUDGED])


def _badness(off: FloatArray) -> float:
    """Compute the objective of the learning law: sum of the squares and weighted fourth powers of `off`."""
    return float(np.sum(off**2 + _STEEP * off**4))


def _gain(off: FloatArray, slopes: FloatArray) -> FloatArray:
    """Compute the gain L of the learning law: a pseudo-inverse of the sensitivity G = `slopes`.

    The deviations `off` are weighted as in `_badness`.
    """
    weight = 1.0 + 2.0 * _STEEP * off**2
    normal = slopes.T @ (weight[:, None] * slopes) + _DAMPING * len(TRIED) * np.eye(slopes.shape[1])
    return np.asarray(np.linalg.solve(normal, slopes.T * weight))
