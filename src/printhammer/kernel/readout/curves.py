"""Curves of a run for a picture: the times of their points, and their values as rows of float32."""

from __future__ import annotations

import math
from typing import Any

DISPLACEMENT, VELOCITY, DRIVEN, VOLTAGE = range(4)
"""Rows of displacement [m], velocity [m/s], current in the coil [A] or force of the drive [N], voltage
across the coil [V] (0 without a circuit)."""
MAGNET, SPRING, PACK, BACKSTOP, DAMPING, DRAG, DRIVE, TOTAL = range(4, 12)
"""Rows of the forces [N] named in `printhammer.run.motion.FORCES`."""
CURVES = 12
"""Number of rows of the curves."""


def write_times(nodes: Any, fewest: int, most: int, out: Any) -> int:
    """Write the times of a curve's points [s], dense where the steps are short; return their number.

    Every step is divided into parts no longer than 1 / `fewest` of the duration of the run, and into at least
    three parts if there are fewer than `fewest` steps. If there are more than `most` nodes, only `most` nodes
    are used, evenly spaced by index. The length of `out` must be at least `fewest` + 3 times the number of
    nodes.
    """
    last = nodes.shape[0] - 1
    used = min(last + 1, most)
    spacing = last / (used - 1) if used > 1 else 0.0
    span = nodes[last, 0] - nodes[0, 0]
    least = 3 if used - 1 < fewest else 1
    count = 0
    begin = nodes[0, 0]
    for number in range(1, used):
        node = last if number == used - 1 else int(number * spacing)
        step = nodes[node, 0] - begin
        parts = least
        if span > 0.0:
            parts = max(math.ceil(step * fewest / span), least)
        for k in range(parts):
            out[count] = begin + k / parts * step
            count += 1
        begin = nodes[node, 0]
    out[count] = nodes[last, 0]
    return count + 1


def write_curves(table: Any, force_drive: bool, out: Any, largest: Any) -> None:
    """Write the curves of a run to the rows of `out`, float32, shape (`CURVES`, n).

    `table` is the result of `resample` at the n times; `force_drive` states whether the drive is a force. The
    largest absolute value of the drive is written to `largest`, shape (1,).
    """
    circuit = table.shape[1] > 10
    peak = 0.0
    for i in range(table.shape[0]):
        driven = table[i, 10] if circuit else table[i, 2]
        peak = max(peak, abs(driven))
        push = table[i, 2] if force_drive else 0.0
        total = 0.0
        for k in range(6):
            out[MAGNET + k, i] = table[i, 3 + k]
            total += table[i, 3 + k]
        out[DISPLACEMENT, i] = table[i, 0]
        out[VELOCITY, i] = table[i, 1]
        out[DRIVEN, i] = driven
        out[VOLTAGE, i] = table[i, 11] if circuit else 0.0
        out[DRIVE, i] = push
        out[TOTAL, i] = total + push
    largest[0] = peak
