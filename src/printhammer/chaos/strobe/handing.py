"""States with which a train goes on where another ended, and which trains may be run piece by piece."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.run.ensemble import MODE_NAMES

if TYPE_CHECKING:
    import numpy.typing as npt

    from printhammer.hammer.hammer import Hammer
    from printhammer.run.regime import Regime
    from printhammer.support.arrays import FloatArray, IntArray

State = tuple[float, float, float, float]
"""Displacement, m, velocity, m/s, branch of the pack or -1, and memory of the pack, m."""

FROM_REST: Final[State] = (math.nan, math.nan, -1.0, 0.0)
"""Row of a state that stands for a train that begins at rest, with nothing fired before."""

STRETCH: Final = 1
"""Firings that are run at a time where a train may be run piece by piece.

Time is rounded to a part of itself, and the phase of a force with it; a ball that comes to rest on a table
and leaves it again makes a hundred million times as much of that. Runs of one period each are all alike, so
that a motion that forgets its past repeats itself to the last bit.
"""

HELD_BRANCHES: Final = {
    MODE_NAMES.index(f"held on the {branch} branch"): MODE_NAMES.index(branch)
    for branch in ("loading", "unloading")
}
"""Branches of the pack on which the armature rests, and those that they are part of."""

_PACK_BRANCHES: Final = tuple(MODE_NAMES.index(name) for name in ("loading", "unloading", "reloading"))
_PACK_RELEASED: Final = MODE_NAMES.index("pack released")


def pack_branches(x: FloatArray, branch: npt.NDArray[np.integer[Any]], front: float | FloatArray) -> IntArray:
    """Return the branches of the pack on which states lie, 0 outside of it."""
    branches = np.where(x > front, branch, 0).astype(np.int64)
    for held, part_of in HELD_BRANCHES.items():
        branches[branches == held] = part_of
    return branches


def handed_on(hammer: Hammer, x: float, v: float, mode: int, memory: float) -> State:
    """Return the state with which another train goes on; `FROM_REST` where none can."""
    branch = HELD_BRANCHES.get(mode, mode)
    if mode == _PACK_RELEASED:
        return FROM_REST
    rigid = hammer.backstop is not None and hammer.backstop.law == "rigid"
    if rigid and hammer.position is not None:
        x = max(x, hammer.position)
    if branch not in _PACK_BRANCHES:
        return x, v, -1.0, 0.0
    return x, v, float(branch), memory


def forgets(regime: Regime) -> bool:
    """Tell whether displacement and velocity at a firing are all that a motion goes on from, at any time.

    So it is under a force without end, with a rigid backstop and no pack.
    """
    backstop = regime.hammer.backstop
    rigid = backstop is not None and backstop.law == "rigid"
    return regime.drive is not None and regime.hammer.pack is None and rigid
