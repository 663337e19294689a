"""Units that are calibrated side by side, each by a learner of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from printhammer.control.learning.ladder import DOTS
from printhammer.control.learning.law import PRINTED, RUNS, LearningLaw
from printhammer.control.learning.learner import Learner
from printhammer.control.learning.lines import LINE, Press, printed
from printhammer.control.table.drivers import with_pulse
from printhammer.support.works import together

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.control.learning.sensor import ImpactSensor
    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.judging import Judgement
    from printhammer.support.arrays import BoolArray


class Progress(NamedTuple):
    """Where units stand after some dots each: what they print on the cycle, and on the last test line."""

    dots: int
    cycle: Judgement
    line: Judgement
    learned: BoolArray  # Which units print with the table that is learned, not in an open loop


def calibrate(
    law: LearningLaw,
    units: Sequence[Hammer],
    sensor: ImpactSensor,
    report: Callable[[], None] = lambda: None,
) -> tuple[list[Learner], list[Progress]]:
    """Let a learner calibrate each of some units, hammers in which the pulse of the nominal one is fired.

    A unit prints the same every time that it prints the same; so what one run of a stage prints, all do, and
    only the readings differ. `report` is called after each stage.
    """
    task = law.entries.task
    press = Press(task, law.entries.rate, [with_pulse(unit, task.pulse) for unit in units])
    flights, forces = press.ladder(law.rungs)
    learners = [Learner(law) for _ in units]
    single = task.single.nominal
    run, history = 0, []

    def record(line: Judgement) -> None:
        cycle = press.line([learner.printed for learner in learners], PRINTED)[1]
        state = np.array([learner.learned for learner in learners])
        history.append(
            Progress(
                run * (DOTS + len(LINE)),
                cycle,
                line,
                state,
            )
        )

    for number, runs in enumerate(RUNS):
        dots, judgement = press.line([learner.settings for learner in learners])
        if not number:
            record(judgement)
        for _ in range(runs):
            for unit, learner in enumerate(learners):
                rungs = sensor.read(flights[unit], forces[unit], unit, 2 * run)
                line = sensor.read(
                    dots.flight_time[unit], dots.peak_force[unit] / single.force, unit, 2 * run + 1
                )
                learner.see(rungs, line)
            run += 1
        printed(together([learner.learn() for learner in learners]), task)
        record(judgement)
        report()
    return learners, history
