"""Binary search for the cell of a packed table, for laws that are splines."""

from __future__ import annotations

from typing import Any


def cell_of(c: Any, first: int, knots: int, at: float) -> int:
    """Return the index of the cell that contains `at`; the knots are c[first:first + knots]."""
    low = 0
    high = knots - 1
    while high - low > 1:
        middle = (low + high) // 2
        if c[first + middle] <= at:
            low = middle
        else:
            high = middle
    return low
