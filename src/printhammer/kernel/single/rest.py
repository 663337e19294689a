"""Armature at rest on a rigid backstop or inside the pack: the time at which the forces end the rest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from printhammer.kernel.compile.compiling import compiled
from printhammer.kernel.model.modes import RELOADING, UNLOADING

if TYPE_CHECKING:
    from printhammer.kernel.model.forces import acceleration
    from printhammer.kernel.model.layout import ForceLaw

BENT = 1e-3
"""Deviation of the acceleration from a parabola, as a fraction of the range that dry friction holds, above
which a pause is halved; arbitrary."""
SPACINGS = (0.05, 0.005, 0.0005)
"""Spacings of the samples that locate an extremum of the acceleration, as fractions of a pause; arbitrary."""


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
    return True, moment_of_end(t, x, low, high, lowest, highest, law)


@compiled
def moment_of_end(
    t: float, x: float, low: float, high: float, lowest: float, highest: float, law: ForceLaw
) -> float:
    """Return the time [s] from `t`, between `low` and `high`, at which the acceleration leaves its range."""
    mode, memory, hammer, drive = law
    while True:
        middle = 0.5 * (low + high)
        if not (t + low < t + middle < t + high):
            return high
        a = acceleration(t + middle, x, 0.0, mode, memory, hammer, drive)
        if lowest <= a <= highest:
            low = middle
        else:
            high = middle


@compiled
def friction_ends(
    t: float, x: float, pause: float, lowest: float, highest: float, law: ForceLaw
) -> tuple[bool, float]:
    """Decide like `rest_ends`, but also detect an excursion of the acceleration between two samples.

    The pause is halved until a parabola through three samples describes the acceleration; the returned time
    is then shorter than `pause`. The extremum of the acceleration, located by parabolas through ever closer
    samples, is another sample.
    """
    mode, memory, hammer, drive = law
    size = highest - lowest
    if math.isinf(size):
        size = highest if math.isinf(lowest) else -lowest
    start = acceleration(t, x, 0.0, mode, memory, hammer, drive)
    while True:
        half = acceleration(t + 0.5 * pause, x, 0.0, mode, memory, hammer, drive)
        end = acceleration(t + pause, x, 0.0, mode, memory, hammer, drive)
        quarter = acceleration(t + 0.25 * pause, x, 0.0, mode, memory, hammer, drive)
        bent = abs(quarter - 0.375 * start - 0.75 * half + 0.125 * end)
        if bent <= BENT * size or not t + 0.25 * pause > t:
            break
        pause *= 0.5
    curvature, slope = start - 2.0 * half + end, 4.0 * half - 3.0 * start - end
    vertex = -0.25 * slope / curvature if curvature != 0.0 else 0.0
    for spacing in SPACINGS:
        if not -spacing < vertex < 1.0 + spacing:
            break
        before = acceleration(t + (vertex - spacing) * pause, x, 0.0, mode, memory, hammer, drive)
        middle = acceleration(t + vertex * pause, x, 0.0, mode, memory, hammer, drive)
        behind = acceleration(t + (vertex + spacing) * pause, x, 0.0, mode, memory, hammer, drive)
        if before - 2.0 * middle + behind != 0.0:
            vertex += 0.5 * spacing * (before - behind) / (before - 2.0 * middle + behind)
    for share in (vertex, 1.0):
        if 0.0 < share <= 1.0:
            a = acceleration(t + share * pause, x, 0.0, mode, memory, hammer, drive)
            if not lowest <= a <= highest:
                return True, moment_of_end(t, x, 0.0, share * pause, lowest, highest, law)
    return False, pause


@compiled
def goes_on_in(a: float, mode: int) -> bool:
    """Whether the acceleration `a` moves an armature at rest in the pack along the branch of its mode."""
    return (mode == UNLOADING and a < 0.0) or (mode == RELOADING and a > 0.0)
