"""Value of the drive between two edges as one formula: the sum of a cubic, two exponentials and a sine.

Exponentials of equal rate and sines of equal frequency are combined, so that the cost of an evaluation does
not depend on the number of active pulses.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.compiling import compiled, inlined
from printhammer.kernel.lanes import layout as R

if TYPE_CHECKING:
    from printhammer.kernel.lanes import math as lane_math
    from printhammer.kernel.model.laws import CUBIC, EXPONENTIALS, SINE


@inlined
def drive_value(t: float, drive: Any) -> float:
    """Evaluate the combined formula of all active pulses at time `t` [s]; return amperes or newtons."""
    s = t - drive[0]
    value = drive[1]
    if EXPONENTIALS > 0:
        value += drive[2] * lane_math.exp(-drive[9] * s)
    if EXPONENTIALS > 1:
        value += drive[3] * lane_math.exp(-drive[10] * s)
    if CUBIC:
        value += s * (drive[4] + s * (drive[5] + s * drive[6]))
    if SINE:
        value += drive[7] * lane_math.sin(drive[11] * s + drive[8])
    return float(value)


@compiled
def add_up(t: float, live: Any, rates: Any, pool: Any, lane: int) -> None:
    """Combine the active pulses at time `t` [s] into one formula in the drive rows of a lane.

    `live` holds the active waveform pieces. `rates` holds the rates of the two exponentials [1/s] and the
    angular frequency of the sine [rad/s].
    """
    c0, c1, c2, c3 = 0.0, 0.0, 0.0, 0.0
    first, second, along, across = 0.0, 0.0, 0.0, 0.0
    i = 1
    for _ in range(int(live[0])):
        s = (t - live[i]) - live[i + 1]
        kind = live[i + 2]
        p0, p1, p2, p3 = live[i + 3], live[i + 4], live[i + 5], live[i + 6]
        if kind == 0.0:
            c0 += p0 + s * (p1 + s * (p2 + s * p3))
            c1 += p1 + s * (2.0 * p2 + 3.0 * s * p3)
            c2 += p2 + 3.0 * s * p3
            c3 += p3
        elif kind == 1.0:
            c0 += p0
            if p2 == rates[0]:
                first += p1 * math.exp(-p2 * s)
            else:
                second += p1 * math.exp(-p2 * s)
        else:
            c0 += p0
            along += p1 * math.cos(p2 * s + p3)
            across += p1 * math.sin(p2 * s + p3)
        i += 7
    at = R.DRIVE * R.BLOCK + lane
    pool[at] = t
    pool[at + R.BLOCK] = c0
    pool[at + 2 * R.BLOCK] = first
    pool[at + 3 * R.BLOCK] = second
    if CUBIC or SINE:
        pool[at + 4 * R.BLOCK] = c1
        pool[at + 5 * R.BLOCK] = c2
        pool[at + 6 * R.BLOCK] = c3
        pool[at + 7 * R.BLOCK] = math.sqrt(along * along + across * across)
        pool[at + 8 * R.BLOCK] = math.atan2(across, along)
