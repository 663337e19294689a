"""Run-to-run calibration of one unit from sensor readings alone: estimate, correct, decide, repeat."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from printhammer.control.learning.belief import LEVELS, Belief, Evidence, believe
from printhammer.control.learning.law import BAD, COMPARED, RUNS, LearningLaw, Verdict
from printhammer.control.learning.lines import LINE, DrivenLine
from printhammer.control.learning.sensor import Readings
from printhammer.support.arrays import FloatArray
from printhammer.support.threads import translated

if TYPE_CHECKING:
    from printhammer.control.learning.lines import Printing
    from printhammer.drive.waveforms.shapes import Waveform

# Standard deviation of the model error, normalised by the limits; arbitrary
_FLOOR: Final = 0.01
_STARTS: Final = 6  # Number of simulated hammers from which searches begin; arbitrary
_OUTLIER: Final = 6.0  # Readings farther from the median are rejected, in standard deviations; arbitrary
_FEWEST: Final = 3
"""Smallest number of readings whose median exposes an outlier, since either of two readings may be wrong."""
MISFIT: Final = 2.0
"""Largest misfit with which a table is used: RMS of the residuals, in standard deviations of the noise.

Arbitrary; units of the production have misfits of 0.7 to 1.6, whatever the offset of the sensor."""

_ERRORS: Final = 3.0  # Largest excess of the misfit over 1 of a comparison, in standard errors; arbitrary
_STARTED: Final = 3  # Maximum number of tables tuned for the most probable hammer; arbitrary
_LATE: Final = (
    2  # Stages before an unstable row leads to a new table; arbitrary, since early posteriors are wide
)


class Mean(NamedTuple):
    """Mean normalised readings of each dot over runs: a row of times and, if measured, a row of forces."""

    value: FloatArray  # Mean readings; NaN where no dot was detected
    seen: FloatArray  # Number of readings in each mean


class Learner:
    """Run-to-run calibration of the compensation table of one unit by a learning law.

    An open loop is used during the first stage. Later stages use an open loop in three cases: no hammer of
    the production explains the readings; more than a fraction `doubt` of the posterior samples would print
    fewer dots within limits with the table than in open loop, or a row in which errors grow; or the mean gain
    is below 2 % of the dots. Of the two open loops, the learner uses the loop that prints more dots over the
    production, unless the readings of the unit in both loops show that the other loop prints more.

    Parameters
    ----------
    law : LearningLaw
        Learning law, replaced by a law with another starting table if it does not converge.
    """

    def __init__(self, law: LearningLaw) -> None:
        self.law = law
        self.stage = 0
        self.corrections = np.zeros(law.entries.inputs.shape[1])
        self.belief: Belief | None = None
        self.contractions: list[float] = []
        self.verdict = _unknown(law)
        self._started = 0
        self._ladders: list[FloatArray] = []
        self._line: list[FloatArray] = []
        self._first: Mean | None = None
        self._compared: list[Mean] = []

    @property
    def finished(self) -> bool:
        """Whether all learning stages are complete."""
        return self.stage == len(RUNS)

    @property
    def settings(self) -> FloatArray:
        """Table settings of the next test line; see `Adjustable`."""
        entries = self.law.entries
        return entries.settings(self.corrections) if self.stage else entries.open_loop

    @property
    def learned(self) -> bool:
        """Whether the learned table is used for printing, rather than an open loop."""
        return self.verdict.gains

    @property
    def printed(self) -> FloatArray:
        """Table settings of the drive in use, a learned table or an open loop; see `Adjustable`."""
        return self.settings if self.learned else self.verdict.loop.settings

    @property
    def pulse(self) -> Waveform:
        """Waveform of the present drive, a learned table or open loop."""
        return self.law.entries.task.pulse if self.learned else self.verdict.loop.pulse

    @property
    def misfit(self) -> float:
        """RMS of the residuals of the readings, in standard deviations; NaN before there are readings."""
        return float("nan") if self.belief is None else self.belief.modes[0].misfit

    def see(self, ladder: Readings, line: Readings) -> None:
        """Store the sensor readings of a run, for the dots of the test pulses and of the test line."""
        self._ladders.append(self._normalise(ladder))
        self._line.append(self._normalise(line))

    def compare(self, lines: Sequence[Readings]) -> None:
        """Store the readings of the line `COMPARED`, printed once in each open loop."""
        noise = self.law.production.noise[:, None]
        self._compared = [mean([self._normalise(line)], noise) for line in lines]

    def _normalise(self, readings: Readings) -> FloatArray:
        """Divide readings by the limits; return a row of times and, if measured, a row of forces."""
        limits, shown = self.law.entries.task.limits, [readings.time]
        if self.law.production.measured > 1 and readings.force is not None:
            shown.append(readings.force)
        return np.stack(
            [each / limit for each, limit in zip(shown, (limits.arrival, limits.force), strict=False)]
        )

    def learn(self) -> Printing[None]:
        """Estimate the constants and update the table after a stage; yield the print jobs to simulate."""
        law = self.law
        noise = law.production.noise[:, None]
        line = mean(self._line, noise)
        if self._first is None:
            self._first = line
        lines = [self._first] if not self.stage else [self._first, line]
        means = [mean(self._ladders, noise), *lines]
        drives = [DrivenLine(each, law.entries.task.pulse) for each in (law.entries.open_loop, self.settings)]
        drives = drives[: len(lines)]
        self.belief = yield from self._believe(means, drives, self.belief)
        unexplained = np.zeros((2, len(LINE)))
        if self.stage:
            shown = self.belief.modes[0].predicted.reshape(law.production.measured, -1)[:, -len(LINE) :]
            unexplained[: len(shown)] = _model_error(
                line.value - shown, noise / np.sqrt(np.maximum(line.seen, 1.0))
            )
        update = yield from law.update(self.belief, self.corrections, unexplained)
        # If rows are unstable with these pulses, a table tuned for the unit may have other pulses.
        grows = update.verdict.multiplier > 1.0 and self.stage >= _LATE
        if (update.left > BAD or grows) and self._started < _STARTED:
            self._started += 1
            other = law.started_anew(self.belief)
            if other is not None:
                fresh = np.zeros(other.entries.inputs.shape[1])
                again = yield from other.update(self.belief, fresh, unexplained)
                if (again.verdict.gains, -again.left) > (update.verdict.gains, -update.left):
                    self.law, update = other, again
        self.corrections, self.verdict = update.corrections, update.verdict
        if self.misfit > MISFIT:
            # A posterior that does not explain the readings is no basis for a decision.
            self.verdict = _unknown(law)
        elif self._compared and not self.verdict.gains:
            loops = [DrivenLine(loop.settings, loop.pulse, COMPARED) for loop in law.entries.loops]
            both = yield from self._believe([*means, *self._compared], [*drives, *loops], self.belief)
            if is_explained(both):
                self.verdict = yield from law.choose_loop(both, self.verdict)
        self.contractions.append(update.contraction)
        self._line = []
        self.stage += 1

    def _believe(
        self, means: Sequence[Mean], drives: Sequence[DrivenLine], before: Belief | None
    ) -> Printing[Belief]:
        """Estimate the constants from averaged readings of the test pulses and of one test line per drive."""
        law = self.law
        measured = law.production.measured
        value = np.concatenate([each.value for each in means], axis=1)
        count = np.concatenate([each.seen for each in means], axis=1)
        noise = np.hypot(law.production.noise[:, None] / np.sqrt(np.maximum(count, 1.0)), _FLOOR)
        rough = np.array([each.rest for each in law.shown]).reshape(measured, -1)
        # Later lines have the surrogate residuals of the line in open loop, repeated.
        line = rough[:, -len(LINE) :]
        rough = np.concatenate([rough, *[line] * -(-value.shape[1] // len(LINE))], axis=1)
        rough = rough[:, : value.shape[1]]
        evidence = Evidence(value.ravel(), noise.ravel(), rough.ravel())

        def predict(asked: list[FloatArray]) -> Printing[list[FloatArray]]:
            shown = yield from law.production.readings(np.concatenate(asked), law.rungs, drives)
            return np.split(shown, np.cumsum([len(rows) for rows in asked])[:-1])

        # Searches start at the simulated hammers whose readings are nearest, at the coarsest level.
        known = law.seen.shape[1] // measured
        shown = slice(None), slice(known)
        off = value[shown] - law.seen.reshape(-1, measured, known)
        apart = (off / np.hypot(noise, rough)[shown]) ** 2
        places = np.argsort(np.nan_to_num(apart, nan=1.0).sum(axis=(1, 2)), kind="stable")[:_STARTS]
        modes = [] if before is None else [mode.mean for mode in before.modes]
        search = believe(evidence, list(law.rows[places]), modes)
        return (yield from translated(search, predict))


def mean(readings: Sequence[FloatArray], noise: FloatArray) -> Mean:
    """Average the normalised readings of each dot over runs; NaN readings are excluded.

    If there are at least `_FEWEST` runs, outliers are excluded too. `noise` is the standard deviation of a
    single reading.
    """
    values = np.stack(readings)
    known = np.isfinite(values)
    if len(values) >= _FEWEST:
        middle = np.nanmedian(np.where(known.any(axis=0), values, 0.0), axis=0)
        known &= np.abs(np.nan_to_num(values) - middle) <= _OUTLIER * noise
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0)
    return Mean(np.where(count > 0, total / np.maximum(count, 1), np.nan), count.astype(np.float64))


def _unknown(law: LearningLaw) -> Verdict:
    """Return the decision before the first reading: the open loop that is better over the production."""
    unknown = float("nan")
    return Verdict(False, law.first, unknown, unknown, unknown, law.alone)


def is_explained(belief: Belief) -> bool:
    """Whether the search reached the finest noise level and its mode explains the readings within noise.

    In a row in which errors hardly decay, readings are strongly nonlinear in the constants, and a search may
    end at a local optimum. The misfit is then above 1 by more than its statistical error, 1 / sqrt(2 N) for N
    readings.
    """
    mode = belief.modes[0]
    most = 1.0 + _ERRORS / math.sqrt(2.0 * mode.predicted.size)
    return mode.level == LEVELS[-1] and mode.misfit <= most


def _model_error(rest: FloatArray, noise: FloatArray) -> FloatArray:
    """Estimate the model error of each reading: its residual `rest`, reduced by the part due to noise.

    The model error is 0 where a reading is missing.
    """
    known = np.isfinite(rest).any(axis=1, keepdims=True)
    size = 1.4826 * np.nanmedian(np.where(known, np.abs(rest), 0.0), axis=1, keepdims=True)
    more = np.maximum(size**2 - noise**2, 0.0)
    return np.asarray(np.nan_to_num(rest * more / (more + noise**2)))
