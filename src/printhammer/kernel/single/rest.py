"""Armature at rest on a rigid backstop or inside the pack: the time at which the forces end the rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model.modes import RELOADING, UNLOADING

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import acceleration
    from printhammer.kernel.model.layout import ForceLaw


@compiled
def rest_ends(
    t: float, x: float, pause: float, lowest: float, highest: float, law: ForceLaw
) -> tuple[bool, float]:
    """Decide whether the acceleration at rest leaves the range [`lowest`, `highest`] within `pause` [s].

    Returns
    -------
    tuple
        Whether the acceleration leaves the range, and the time [s] from `t` to the departure, else `pause`.
    """
    mode, memory, hammer, drive = law
    low = 0.0
    high = 0.5 * pause
    a = acceleration(t + high, x, 0.0, mode, memory, hammer, drive)
    if lowest <= a <= highest:
        low, high = high, pause
        a = acceleration(t + high, x, 0.0, mode, memory, hammer, drive)
        if lowest <= a <= highest:
            return False, pause
    while True:
        middle = 0.5 * (low + high)
        if not (t + low < t + middle < t + high):
            return True, high
        a = acceleration(t + middle, x, 0.0, mode, memory, hammer, drive)
        if lowest <= a <= highest:
            low = middle
        else:
            high = middle


@compiled
def goes_on_in(a: float, mode: int) -> bool:
    """Whether the acceleration `a` moves an armature at rest in the pack along the branch of its mode."""
    return (mode == UNLOADING and a < 0.0) or (mode == RELOADING and a > 0.0)
