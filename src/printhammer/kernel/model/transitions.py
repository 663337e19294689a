"""Table of transitions: the mode that follows each switch, and the jump of a variation there."""

from __future__ import annotations

from typing import Final

import numpy as np

from printhammer.kernel.model import modes as M

NO_JUMP = 0
"""The force is zero where a contact releases or takes hold."""
AT_FRONT = 1
AT_POSITION = 2
AT_PEAK = 3
"""The displacement passes a level at which the law changes: a surface, or the latest local maximum."""
TURN = 4
"""The velocity passes zero, where a law with memory changes."""

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
    # A reversal on the front itself ends the contact; elsewhere the forces decide.
    (M.RELOADING, M.REVERSAL, M.FREE, AT_FRONT),
    (M.UNLOADING, M.REVERSAL, M.UNLOADING, TURN),
    (M.UNLOADING, M.REVERSAL, M.RELOADING, TURN),
    (M.UNLOADING, M.REVERSAL, M.LOADING, TURN),
    (M.LOADING, M.PUSH_ENDED, M.PACK_RELEASED, NO_JUMP),
    (M.PACK_RELEASED, M.PUSH_BEGAN, M.LOADING, NO_JUMP),
    (M.BACKSTOP, M.PUSH_ENDED, M.BACKSTOP_RELEASED, NO_JUMP),
    (M.BACKSTOP_RELEASED, M.PUSH_BEGAN, M.BACKSTOP, NO_JUMP),
)
"""Mode, switch that ends it, mode that follows, and jump of a variation."""

FOLLOWING = np.full((len(M.MODE_NAMES), M.PUSH_BEGAN + 1), -1)
"""Mode after a switch, by mode and switch; after a reversal, the mode of an armature that leaves."""
JUMPS = np.full((len(M.MODE_NAMES), len(M.MODE_NAMES)), NO_JUMP)
"""Jump between two modes; from unloading to unloading only if the local maximum is a new one."""

for _mode, _switch, _following, _jump in reversed(TRANSITIONS):
    FOLLOWING[_mode, _switch] = _following
    JUMPS[_mode, _following] = _jump
