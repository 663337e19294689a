"""Touches of a surface in a long run: only they are kept, so that memory does not grow with its length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from printhammer.kernel.model.modes import BACKSTOP_SURFACE, PACK_SURFACE, PAUSED, STATUS_NAMES
from printhammer.kernel.single import carry
from printhammer.run.problem import MAX_STEPS, fresh_carry

if TYPE_CHECKING:
    from printhammer.run.problem import Problem
    from printhammer.support.arrays import FloatArray

Surface = Literal["pack", "backstop"]
CODES: Final = {"pack": PACK_SURFACE, "backstop": BACKSTOP_SURFACE}

_STRETCH: Final = 4096
_SURFACE, _IN, _OUT, _INITIAL = 0, 1, 3, 6
"""Columns of a contact."""


@dataclass(frozen=True)
class Touches:
    """Touches of one surface.

    Attributes
    ----------
    rows : array, shape (n, 4)
        Time, s, and velocity, m/s, at touch and at leaving; NaN for a contact that is open at the end.
    status : str
        How the run ended; "ok" also where it was ended because there were touches enough.
    reached : float
        Time that the run got to, s.
    """

    rows: FloatArray
    status: str
    reached: float


def touches_of(problem: Problem, surface: Surface, after: float, end: float, most: int) -> Touches:
    """Return the touches of a surface in a run; a contact that was open at its start is none.

    Parameters
    ----------
    problem : Problem
        The run.
    surface : str
        "pack" or "backstop".
    after : float
        Time from which on touches count, s.
    end : float
        End of the run, s.
    most : int
        Number of touches after which it ends earlier.

    Returns
    -------
    Touches
        The first of them, at most that many.
    """
    capacity = _STRETCH
    while True:
        found = _stretches(problem, CODES[surface], after, end, most, capacity)
        if found is not None:
            return found
        capacity *= 4


def _stretches(
    problem: Problem, code: int, after: float, end: float, most: int, capacity: int
) -> Touches | None:
    """Do as `touches_of` in stretches; None where one of them has more contacts than `capacity`."""
    arrays = problem.drive_arrays()
    nodes, contacts = np.empty((1, 5)), np.empty((capacity, 7))
    # A contact begins with a node, so that contacts fit; two nodes are the least that is a step.
    state = fresh_carry(max(capacity // 2, 2))
    kept: list[FloatArray] = []
    count, status = 0, PAUSED
    while status == PAUSED and count < most:
        status, _used, touched, _steps = problem.kernel.run(
            *arrays[:4],
            problem.constants,
            problem.start,
            float(problem.state[0]),
            float(problem.state[1]),
            float(end),
            problem.control,
            problem.bounds,
            MAX_STEPS,
            *arrays[4:],
            nodes,
            contacts,
            state,
        )
        if touched > capacity:
            return None
        seen = contacts[:touched]
        # A contact that is open at a pause is the first one of the next stretch.
        goes_on = status == PAUSED and touched > 0 and bool(np.isnan(seen[-1, _OUT]))
        done = seen[:-1] if goes_on else seen
        wanted = (done[:, _SURFACE] == code) & (done[:, _IN] >= after) & (done[:, _INITIAL] == 0.0)
        kept.append(done[wanted, _IN : _OUT + 2].copy())
        count += len(kept[-1])
        if goes_on:
            contacts[0] = seen[-1]
    ended = "ok" if status == PAUSED else STATUS_NAMES[status]
    return Touches(np.concatenate(kept)[:most], ended, float(state[carry.TIME]))
