"""Prior of a learner: nominal hammer, variability of the production, and sensor errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.learning.lines import DrivenLine, Press, Rung
from printhammer.control.learning.sensor import ImpactSensor
from printhammer.control.table.task import Task
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Judgement
from printhammer.printing.rates.variability import Variability
from printhammer.run.ensemble import DotTable
from printhammer.support.arrays import FloatArray
from printhammer.support.threads import together

if TYPE_CHECKING:
    from printhammer.control.learning.lines import Printing

SCALE: Final = 0.01
"""Prior standard deviation of the relative gain error of a sensor; arbitrary."""

OFFSET: Final = 25e-6
"""Prior standard deviation of the offset of a sensor's times, s, used if the sensor has no `offset`.

Arbitrary; for comparison, sound takes 20 us for 7 mm of air before a microphone."""


@dataclass(frozen=True)
class Production:
    """Model of production variability: maps rows of deviations to hammers and to their sensor readings.

    A row contains, in prior standard deviations, the deviations of the constants, followed by the errors of
    the sensor: gain of the times, gain of the forces if forces are measured, offset of the times.
    """

    task: Task
    rate: float
    variability: Variability
    sensor: ImpactSensor

    @property
    def nominal(self) -> Hammer:
        """Nominal hammer with its driver."""
        return self.task.hammers[0]

    @cached_property
    def constants(self) -> int:
        """Number of constants that vary."""
        return len(self.variability.constants(self.nominal))

    @property
    def size(self) -> int:
        """Length of a parameter row: number of varying constants plus number of sensor errors."""
        return self.constants + self.measured + 1

    @property
    def offset(self) -> float:
        """Prior standard deviation of the offset of the sensor's times, s."""
        return OFFSET if self.sensor.offset is None else self.sensor.offset

    @property
    def measured(self) -> int:
        """Number of readings per dot: 1, or 2 with forces."""
        return 1 if self.sensor.force is None else 2

    @property
    def noise(self) -> FloatArray:
        """Standard deviations of a time and, if measured, a force reading, normalised by the limits."""
        limits = self.task.limits
        return np.array([self.sensor.noise / limits.arrival, (self.sensor.force or 0.0) / limits.force])[
            : self.measured
        ]

    def hammers(self, rows: FloatArray) -> list[Hammer | None]:
        """Build hammers from parameter rows, shape (M, size); None for a row with invalid constants."""
        return self.variability.hammers(self.nominal, rows[:, : self.constants])

    def press(self, hammers: Sequence[Hammer]) -> Press:
        """Return a simulator of test pulses and test lines for hammers, at the slot rate `rate`."""
        return Press(self.task, self.rate, hammers)

    def readings(
        self, rows: FloatArray, rungs: Sequence[Rung], lines: Sequence[DrivenLine]
    ) -> Printing[FloatArray]:
        """Predict the readings of test pulses and test lines for M parameter rows, shape (M, size).

        A row of the result contains the impact times of all dots and then, if measured, their forces, both
        divided by the limits; NaN for a lost dot.
        """
        hammers = self.hammers(rows)
        there = [k for k, hammer in enumerate(hammers) if hammer is not None]
        press = self.press([hammer for hammer in hammers if hammer is not None])
        count = sum(rung.dots for rung in rungs) + sum(len(line.slots) for line in lines)
        shown = np.full((len(rows), 2, count), np.nan)
        if there:
            single = self.task.single.nominal
            parts = [press.order_ladder(rungs)] if rungs else []
            parts += [
                _readings_of(
                    press.order_line([line.settings] * len(there), line.slots, [line.pulse] * len(there)),
                    single.force,
                )
                for line in lines
            ]
            told = yield from together(parts)
            shown[there] = np.concatenate([np.stack(part, axis=1) for part in told], axis=2)
        limits = self.task.limits
        shown /= np.array([limits.arrival, limits.force])[:, None]
        own = rows[:, self.constants :]
        shown[:, : self.measured] *= 1.0 + SCALE * own[:, : self.measured, None]
        shown[:, 0] += self.offset / limits.arrival * own[:, -1:]
        return np.asarray(shown[:, : self.measured].reshape(len(rows), -1))


def _readings_of(
    line: Printing[tuple[DotTable, Judgement]], force: float
) -> Printing[tuple[FloatArray, FloatArray]]:
    """Run the print job `line`; return the flight times [s] and the peak forces, divided by `force` [N]."""
    dots, _judgement = yield from line
    return dots.flight_time, dots.peak_force / force
