"""States with which a train goes on where another ended, and which trains may be run piece by piece."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.run.start import AT_REST, HELD_BRANCHES, state_to_begin

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray, IntArray

State = tuple[float, ...]
"""Displacement, m, velocity, m/s, and what belongs to a state beside them: `printhammer.run.start.Beyond`."""

NO_CURRENT: Final = AT_REST[2:]
"""The electric part of a state without current."""

FROM_REST: Final[State] = (math.nan, math.nan, *AT_REST)
"""Row of a state that stands for a train that begins at rest, with nothing fired before."""

STRETCH: Final = 1
"""Firings that are run at a time where a train may be run piece by piece.

Time is rounded to a part of itself, and the phase of a force with it; a ball that comes to rest on a table
and leaves it again makes a hundred million times as much of that. Runs of one period each are all alike, so
that a motion that forgets its past repeats itself to the last bit.
"""


def pack_branches(x: FloatArray, branch: npt.NDArray[np.integer[Any]], front: float | FloatArray) -> IntArray:
    """Return the branches of the pack on which states lie, 0 outside of it."""
    branches = np.where(x > front, branch, 0).astype(np.int64)
    for held, part_of in HELD_BRANCHES.items():
        branches[branches == held] = part_of
    return branches


def handed_on(
    hammer: Hammer, x: float, v: float, mode: int, memory: float, electric: Sequence[float] = NO_CURRENT
) -> State:
    """Return the state with which another train goes on; `FROM_REST` where none can."""
    begun = state_to_begin(hammer, x, v, mode, memory)
    return FROM_REST if begun is None else (*begun, *electric)


def forgets(regime: Regime) -> bool:
    """Tell whether displacement and velocity at a firing are all that a motion goes on from, at any time.

    So it is under a force without end, with a rigid backstop and no pack.
    """
    backstop = regime.hammer.backstop
    rigid = backstop is not None and backstop.law == "rigid"
    return regime.drive is not None and regime.hammer.pack is None and rigid
