"""The one table of transitions: what each switch of each mode leads to, and how a variation jumps there."""

from __future__ import annotations

from typing import Final

import numpy as np

from printhammer.kernel.model.modes import (
    BACKSTOP,
    BACKSTOP_RELEASED,
    FREE,
    LEFT_BACKSTOP,
    LEFT_FRONT,
    LOADING,
    MODE_NAMES,
    PACK_RELEASED,
    PUSH_BEGAN,
    PUSH_ENDED,
    REACHED_BACKSTOP,
    REACHED_FRONT,
    REACHED_PEAK,
    RELOADING,
    REVERSAL,
    UNLOADING,
)

NO_JUMP = 0
"""Where a contact lets go or takes hold its force is zero."""
AT_FRONT = 1
AT_POSITION = 2
AT_PEAK = 3
"""The displacement passes a level at which the law changes: a surface, or the latest local maximum."""
TURN = 4
"""The velocity passes zero, where a law with memory changes."""

TRANSITIONS: Final = (
    (FREE, REACHED_BACKSTOP, BACKSTOP, AT_POSITION),
    (FREE, REACHED_FRONT, LOADING, AT_FRONT),
    (LOADING, LEFT_FRONT, FREE, AT_FRONT),
    (UNLOADING, LEFT_FRONT, FREE, AT_FRONT),
    (PACK_RELEASED, LEFT_FRONT, FREE, AT_FRONT),
    (BACKSTOP, LEFT_BACKSTOP, FREE, AT_POSITION),
    (BACKSTOP_RELEASED, LEFT_BACKSTOP, FREE, AT_POSITION),
    (RELOADING, REACHED_PEAK, LOADING, AT_PEAK),
    (LOADING, REVERSAL, UNLOADING, TURN),
    (RELOADING, REVERSAL, UNLOADING, TURN),
    # A reversal on the front itself ends the contact; of the others, the forces tell which it is.
    (RELOADING, REVERSAL, FREE, AT_FRONT),
    (UNLOADING, REVERSAL, UNLOADING, TURN),
    (UNLOADING, REVERSAL, RELOADING, TURN),
    (UNLOADING, REVERSAL, LOADING, TURN),
    (LOADING, PUSH_ENDED, PACK_RELEASED, NO_JUMP),
    (PACK_RELEASED, PUSH_BEGAN, LOADING, NO_JUMP),
    (BACKSTOP, PUSH_ENDED, BACKSTOP_RELEASED, NO_JUMP),
    (BACKSTOP_RELEASED, PUSH_BEGAN, BACKSTOP, NO_JUMP),
)
"""Mode, the switch that ends it, the mode that follows, and how a variation jumps there."""

FOLLOWING = np.full((len(MODE_NAMES), PUSH_BEGAN + 1), -1)
"""The mode after a switch, by mode and switch; after a reversal where the wire goes out again."""
JUMPS = np.full((len(MODE_NAMES), len(MODE_NAMES)), NO_JUMP)
"""The jump between two modes; of unloading to unloading, only where the local maximum is a new one."""

for _mode, _switch, _following, _jump in reversed(TRANSITIONS):
    FOLLOWING[_mode, _switch] = _following
    JUMPS[_mode, _following] = _jump
