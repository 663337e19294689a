"""Pulses as plain functions of numbers and arrays: values of a segment table, and firing times.

A plain function allocates nothing and raises nothing, so that it can be compiled as an entry point, see
`printhammer.run.plain.entries`. Segment tables are described in `printhammer.drive.segments`.
"""

from __future__ import annotations

import math
from typing import Any, Final

EXPONENTIAL: Final = 1.0
SINE: Final = 2.0
SWITCHED: Final = 4.0
DECAY: Final = 5.0
"""Kinds of segments that have a formula of their own."""


def fill_firings(rate: float, marks: Any, pattern: bool, times: Any) -> int:
    """Write the firing times of a train to `times`, s, ascending; return their number.

    Slot k is fired if ``marks[k]`` is not 0; its time is k times the period, or, in a `pattern`, k divided by
    the `rate`, Hz, which may differ by rounding.
    """
    count = 0
    period = 1.0 / rate
    for k in range(len(marks)):
        if marks[k] != 0:
            times[count] = k / rate if pattern else k * period
            count += 1
    return count


def segment_value(kind: float, p0: float, p1: float, p2: float, p3: float, s: float) -> float:
    """Return the value of a segment, A, N or V, `s` seconds after its start."""
    if kind == EXPONENTIAL:
        return p0 + p1 * math.exp(-p2 * s)
    if kind == SINE:
        return p0 + p1 * math.sin(p2 * s + p3)
    if kind == DECAY:
        return 0.0
    if kind >= SWITCHED:
        return p0
    return p0 + s * (p1 + s * (p2 + s * p3))


def fill_values(table: Any, times: Any, values: Any) -> None:
    """Evaluate a segment table, shape (rows, 6), at ascending times since the firing, s; write the values.

    Values are right-continuous; the value is 0 before 0 and from the end of the table on.
    """
    row = 0
    last = len(table) - 1
    for k in range(len(times)):
        while row < last and table[row + 1, 0] <= times[k]:
            row += 1
        values[k] = 0.0
        if row < last and times[k] >= 0.0:
            s = times[k] - table[row, 0]
            values[k] = segment_value(
                table[row, 1], table[row, 2], table[row, 3], table[row, 4], table[row, 5], s
            )
