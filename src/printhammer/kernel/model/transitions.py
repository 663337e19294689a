"""Table of mode transitions: the mode after a switching event, and how a small variation jumps there."""

from __future__ import annotations

from typing import Final

import numpy as np

from printhammer.kernel.model import modes as M

NO_JUMP = 0
"""Kind of jump: none, because the contact force is zero where a contact starts or ceases to push."""
AT_FRONT = 1
"""Kind of jump: the displacement crosses the pack front, where the force law changes."""
AT_POSITION = 2
"""Kind of jump: the displacement crosses the backstop position, where the force law changes."""
AT_PEAK = 3
"""Kind of jump: the displacement crosses the latest local maximum in the pack, where the force law
changes."""
TURN = 4
"""Kind of jump: the velocity changes sign inside the pack, where a law with memory changes its branch."""

TRANSITIONS: Final = (
    (M.FREE, M.REACHED_BACKSTOP, M.BACKSTOP, AT_POSITION),
    (M.FREE, M.REACHED_FRONT, M.LOADING, AT_FRONT),
    (M.LOADING, M.LEFT_FRONT, M.FREE, AT_FRONT),
    (M.UNLOADING, M.LEFT_FRONT, M.FREE, AT_FRONT),
    (M.PACK_RELEASED, M.LEFT_FRONT, M.FREE, AT_FRONT),
    (M.BACKSTOP, M.LEFT_BACKSTOP, M.FREE, AT_POSITION),
    (M.BACKSTOP_RELEASED, M.LEFT_BACKSTOP, M.FREE, AT_POSITION),
    (M.RELOADING, M.REACHED_PEAK, M.LOADING, AT_PEAK),
    (M.LOADING, M.REVERSAL, M.UNLOADING, TURN),
    (M.RELOADING, M.REVERSAL, M.UNLOADING, TURN),
    # A reversal exactly at the front of the pack ends the contact; elsewhere the forces decide.
    (M.RELOADING, M.REVERSAL, M.FREE, AT_FRONT),
    (M.UNLOADING, M.REVERSAL, M.UNLOADING, TURN),
    (M.UNLOADING, M.REVERSAL, M.RELOADING, TURN),
    (M.UNLOADING, M.REVERSAL, M.LOADING, TURN),
    (M.LOADING, M.PUSH_ENDED, M.PACK_RELEASED, NO_JUMP),
    (M.PACK_RELEASED, M.PUSH_BEGAN, M.LOADING, NO_JUMP),
    (M.BACKSTOP, M.PUSH_ENDED, M.BACKSTOP_RELEASED, NO_JUMP),
    (M.BACKSTOP_RELEASED, M.PUSH_BEGAN, M.BACKSTOP, NO_JUMP),
)
"""Rows of the table: mode, switching event that ends the mode, next mode, and kind of jump of a variation."""

FOLLOWING = np.full((len(M.MODE_NAMES), M.PUSH_BEGAN + 1), -1)
"""Next mode, indexed by mode and switching event; for a reversal in the pack, the mode of outward motion."""
JUMPS = np.full((len(M.MODE_NAMES), len(M.MODE_NAMES)), NO_JUMP)
"""Kind of jump of a variation, indexed by the modes before and after an event; from unloading to unloading,
the jump applies only if the reversal is a new local maximum."""

for _mode, _switch, _following, _jump in reversed(TRANSITIONS):
    FOLLOWING[_mode, _switch] = _following
    JUMPS[_mode, _following] = _jump
