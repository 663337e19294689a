"""What a learner may change of a table, and within which bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.table.histories import histories, number_of, shared_numbers

if TYPE_CHECKING:
    from printhammer.control.table.task import Task
    from printhammer.support.arrays import FloatArray, IntArray

STEP: Final = 1e-6  # Unit of the corrections, s
_LARGEST: Final = 25.0  # Largest change of an entry after a stage, in this unit
# How much later than the nominal hammer a unit may leave the pack; no pulse is fired before that, s
MARGIN: Final = 20e-6
_LEAST: Final = 0.5  # Least width of a pulse, in parts of that of the hammer
_LEAST_BRAKE: Final = 0.05  # Least width of a brake pulse, likewise
ADVANCE, WIDTH, DELAY, BRAKE = range(4)


@dataclass(frozen=True)
class Adjustable:
    """The entries of a table that are learned: advance, width, and brake where there is one.

    `base` (4, entries) are the settings that corrections are added to, at a rate, Hz, as times after the
    slots of a hammer with its driver, s. Corrections are arrays (..., inputs), in units of `STEP`.
    """

    task: Task
    rate: float
    base: FloatArray

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
