"""The learner: it is shown readings of its sensor, and nothing else of the unit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.learning.law import features
from printhammer.control.learning.lines import LADDER, LINE
from printhammer.control.learning.settings import ADVANCE
from printhammer.control.table.histories import histories_of

if TYPE_CHECKING:
    from printhammer.control.learning.law import LearningLaw
    from printhammer.control.learning.sensor import Readings
    from printhammer.support.arrays import FloatArray

_ALIKE: Final = 20  # Number of simulated hammers that look like the unit, by which the table is weighed
_GAIN: Final = 0.02  # Least share of the dots that the table gains in the mean over these


class Learner:
    """Calibrates the table of one unit from run to run, by a law.

    What is handed out is the open loop before the first stage is over, and wherever the simulated hammers
    that look most like the unit speak against the table: more of them than the doubt that is allowed would
    print fewer dots within limits with it, or there is next to nothing to gain.

    Parameters
    ----------
    law : LearningLaw
        The gains.
    """

    def __init__(self, law: LearningLaw) -> None:
        self.law = law
        self.stage = 0
        self.corrections = np.zeros(law.entries.inputs.shape[1])
        self._gains = False
        self._ladders: list[FloatArray] = []
        self._line: list[FloatArray] = []
        self._lines: list[FloatArray] = []

    @property
    def finished(self) -> bool:
        """Whether all stages are over."""
        return self.stage == len(self.law.stages)

    @property
    def settings(self) -> FloatArray:
        """What the next test line is printed with, shape (4, entries)."""
        entries = self.law.entries
        return entries.settings(self.corrections) if self.stage else entries.open_loop

    @property
    def learned(self) -> bool:
        """Whether what is handed out for printing is the table that is learned, and not the open loop."""
        return self._gains

    @property
    def printed(self) -> FloatArray:
        """What is handed out for printing, shape (4, entries)."""
        return self.settings if self.learned else self.law.entries.open_loop

    def see(self, ladder: Readings, line: Readings) -> None:
        """Take in the readings of a run: of the pulses of the ladder, repeated, and of the line."""
        if self.finished:
            return
        law, task = self.law, self.law.entries.task
        repeated = len(ladder.time) // len(LADDER)
        expected = [np.tile(each, repeated) for each in law.ladder]
        off = law.deviations(ladder.time, ladder.force, expected)
        self._ladders.append(off.reshape(len(off), repeated, len(LADDER)))
        numbers = histories_of(LINE, task.gaps, task.reach)[:-1]
        # Fired ahead of its slot, a dot may take as much longer.
        due = task.single.nominal.flight_time + self.settings[ADVANCE, numbers]
        self._line.append(law.deviations(line.time, line.force, (due, 1.0)))
        if len(self._line) == law.stages[self.stage].runs:
            self._learn()

    def _learn(self) -> None:
        law = self.law
        stage = law.stages[self.stage]
        self._lines = [*self._lines[-1:], _mean(np.stack(self._line))]
        self._line = []
        ladder = _mean(np.concatenate(self._ladders, axis=1).swapaxes(0, 1))
        evidence = features(ladder, self._lines)
        kept = (1.0 - law.forgetting) * self.corrections
        self.corrections = law.entries.limited(kept, stage.gain @ evidence)
        apart = ((stage.seen - stage.estimate @ evidence) ** 2).sum(axis=1)
        alike = np.argsort(apart, kind="stable")[:_ALIKE]
        edge = stage.edge[alike]
        self._gains = bool(np.quantile(edge, self.law.doubt) >= 0.0 and edge.mean() >= _GAIN)
        self.stage += 1


def _mean(values: FloatArray) -> FloatArray:
    """Return the mean over the first axis of what is known, NaN where nothing is."""
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=0)
    return np.asarray(np.where(known.any(axis=0), total / np.maximum(known.sum(axis=0), 1), np.nan))
