"""The problem that all solvers integrate: the frozen hammer and a train with the period 1.35 ms."""

from __future__ import annotations

from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.results import Declared, part, scalar

if TYPE_CHECKING:
    from printhammer.drive.trains import PulseTrain
    from printhammer.hammer.hammer import Hammer

PERIOD: Final = 1.35e-3
"""Time between firings, s."""
FIRST: Final = 3e-3
"""Time over which errors are measured, s."""
GRID: Final = np.linspace(0.0, FIRST, 3001)
"""Times at which errors are measured, s."""


class Task(Declared):
    """Benchmark problem: a hammer with the laws of the paper, fired at a constant rate, from rest."""

    hammer: Hammer = part("the hammer")
    period: float = scalar("s", "time between firings", default=PERIOD)

    @cached_property
    def rest(self) -> float:
        """Displacement at rest, m."""
        from printhammer.hammer.equilibrium import rest_state

        return rest_state(self.hammer)

    def drive(self, pulses: int) -> PulseTrain:
        """Return the drive with `pulses` firings."""
        from printhammer.drive.trains import PulseTrain

        assert self.hammer.waveform is not None
        return PulseTrain(self.hammer.waveform, period=self.period, pulses=pulses)


@lru_cache(maxsize=1)
def frozen() -> Task:
    """Return the problem of the benchmark, with the hammer that is never changed."""
    from printhammer.hammer.hammer import load

    return Task(load(Path(__file__).with_name("frozen-hammer.toml")))


MEMBERS: Final = 512
"""Number of members of an ensemble in the table."""
CHECKED: Final = 8
"""Number of evenly spaced members that are compared with the reference."""
ENDS: Final = np.linspace(3e-4, FIRST, 10)
"""Times at which ensemble members are compared with the reference, s."""


def ensemble_tasks(task: Task, members: int) -> list[Task]:
    """Return copies of the problem with evenly spaced periods, from 0.9 to 1.1 times its period."""
    return [Task(task.hammer, task.period * factor) for factor in np.linspace(0.9, 1.1, members).tolist()]


def checked(members: int) -> list[int]:
    """Return the indices of the members that are compared with the reference."""
    return [int(i) for i in np.linspace(0, members - 1, min(CHECKED, members)).round()]
