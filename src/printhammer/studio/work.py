"""Limits on work: computations expected to take long are refused, and slow ones cancelled with a message.

The run of a state ends after `bounds.MOST_STEPS`. Ensembles have no such limit; a few of their runs are
tested one by one with a limit beforehand, and again as soon as a constant has changed by `bounds.ALIKE`.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

from printhammer.errors import InputError
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.studio import bounds, compiling
from printhammer.studio.pictures.engine import limited_run
from printhammer.studio.states.coil import open_constants
from printhammer.studio.states.controls import fields_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.drive.trains import Drive
    from printhammer.run.motion import Motion
    from printhammer.studio.states.state import State

STEP_LIMIT: Final = "step limit"
"""Status of a run that exceeded its step limit."""


class GivenUp(Exception):
    """Raised to stop a job because a newer state has arrived."""


class Patience:
    """Time limit of the computation of one view, checked at intervals.

    Parameters
    ----------
    newer : callable
        Whether a newer state has arrived.
    what : str
        Name of the view, for the error message.
    seconds : float, optional
        Time limit.
    """

    def __init__(self, newer: Callable[[], bool], what: str, seconds: float = bounds.PATIENCE) -> None:
        self._newer = newer
        self._what = what
        self._seconds = seconds
        compiling.measure()
        self._begun = time.monotonic() - compiling.seconds()

    @property
    def spent(self) -> float:
        """Elapsed time of the computation, s, without compilation, which happens only once."""
        return time.monotonic() - compiling.seconds() - self._begun

    def check(self, more: float = 0.0) -> None:
        """Raise unless work may continue: no newer state, and time left for the next `more` seconds.

        Raises
        ------
        GivenUp
            A newer state has arrived.
        InputError
            The work takes too long.
        """
        if self._newer():
            raise GivenUp
        if self.spent + more > self._seconds:
            raise InputError(
                f"{self._what} would take more than {self._seconds:g} s for this hammer", key="seconds"
            )

    def progress(self, _done: int, _all: int) -> None:
        """Call `check`, as a progress callback of a computation."""
        self.check()


def try_out(
    state: State,
    drive: Drive,
    end: float,
    what: str,
    tolerance: float = DISPLAY_TOLERANCE,
    *,
    through: bool = False,
    most: int = 0,
) -> Motion:
    """Simulate a drive once with a step limit, as a test of the cost of a view that needs many such runs.

    The default limit is `bounds.MOST_MAP_STEPS`.

    Raises
    ------
    InputError
        The run exceeds the limit, or with `through` does not complete.
    """
    most = most or bounds.MOST_MAP_STEPS
    motion = limited_run(state.changed, drive, end, most, tolerance)
    if motion.status == STEP_LIMIT:
        raise InputError(
            f"{what} would take more than {most} steps for this hammer", key=what, expected="fewer"
        )
    if through and motion.status != "ok":
        raise InputError(f"{what}: {motion.message}", key=what)
    return motion


def alike(one: State, other: State) -> bool:
    """Whether the frequency-time maps of two states need about the same computation time."""
    keys = ("hammer", "text", "pulses", "pattern", "overlap", "low", "high")
    if any(getattr(one, key) != getattr(other, key) for key in keys):
        return False
    mine, theirs = dict(one.constants), dict(other.constants)
    own = {key: constant.si for key, (constant, _) in open_constants(one.base).items()}
    own |= {key: constant.si for key, constant in one.base.constants.items()}
    pairs = [(mine.get(key, own[key]), theirs.get(key, own[key])) for key in {*mine, *theirs}]
    if one.waveform != other.waveform:
        waves = fields_of(one.fired), fields_of(other.fired)
        if waves[0].keys() != waves[1].keys():
            return False
        for name, value in waves[0].items():
            if isinstance(value, float) and isinstance(waves[1][name], float):
                pairs.append((value, waves[1][name]))
            elif value != waves[1][name]:
                return False
    return all(near(*pair) for pair in pairs)


def near(one: float, other: float) -> bool:
    """Whether two numbers are equal, or have the same sign and a ratio below `bounds.ALIKE`."""
    return one == other or (one * other > 0.0 and 1.0 / bounds.ALIKE < one / other < bounds.ALIKE)
