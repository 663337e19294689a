"""A solver in the table: how it is asked for its motion, and how it is timed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.support.arrays import FloatArray


class Absent(Exception):
    """A peer that is not installed here, or does not work here; the message says why."""


@dataclass
class Entry:
    """One solver with one setting.

    Attributes
    ----------
    name : str
        Solver, method and tolerance.
    positions : callable
        Returns the displacement, m: of a single run at `printhammer.bench.problem.GRID`; of the members of
        an ensemble that are compared at `printhammer.bench.problem.ENDS`. The first call may compile.
    integrate : callable
        Does what is timed, without output.
    duration : float
        Hammer-seconds of what is timed, over all members.
    members : int
        1 for a single run; the number of runs of an ensemble.
    ours : bool
        Whether it is this program.
    """

    name: str
    positions: Callable[[], FloatArray]
    integrate: Callable[[], object]
    duration: float
    members: int = 1
    ours: bool = False
