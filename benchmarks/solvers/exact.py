"""Reference displacements, from a solver that shares no code with the kernel, up to its horizon."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from tests.oracle.integrator import reference

from benchmarks.solvers.problem import ENDS, FIRST, GRID, Task, checked, ensemble_tasks

if TYPE_CHECKING:
    from printhammer.drive.base import Drive
    from printhammer.hammer.hammer import Hammer
    from printhammer.support.arrays import FloatArray

_FINE: Final = 1e-14
_COARSE: Final = 1e-13
_APART: Final = 1e-10


@lru_cache(maxsize=2)
def single(task: Task) -> FloatArray:
    """Return the reference displacement [m] of the single run on the grid of the table."""
    return reference(task.hammer, task.drive(_pulses(task)), FIRST, tolerance=_FINE, times=GRID).x


@lru_cache(maxsize=2)
def ensemble(task: Task, members: int) -> FloatArray:
    """Return the reference displacements of the checked members, m, shape (times, members)."""
    tasks = ensemble_tasks(task, members)
    runs = [
        reference(one.hammer, one.drive(_pulses(one)), FIRST, tolerance=_FINE, times=ENDS).x
        for one in (tasks[i] for i in checked(members))
    ]
    return np.array(runs).T


def trusted(hammer: Hammer, drive: Drive, end: float, times: FloatArray, stroke: float) -> FloatArray:
    """Return the reference displacement [m] at times [s]; NaN from the horizon of the run onward.

    At the horizon, two references with the tolerances 1e-13 and 1e-14 differ by 1e-10 of the stroke; later
    comparisons are meaningless.
    """
    coarse = reference(hammer, drive, end, tolerance=_COARSE, times=times).x
    fine = reference(hammer, drive, end, tolerance=_FINE, times=times).x
    apart = ~(np.abs(coarse - fine) <= _APART * stroke)
    if apart.any():
        fine[int(np.argmax(apart)) :] = np.nan
    return fine


def _pulses(task: Task) -> int:
    return int(np.ceil(FIRST / task.period))
