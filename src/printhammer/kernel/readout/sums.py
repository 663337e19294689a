"""Sums of the columns of a table: correctly rounded, and pairwise in the order of NumPy.

As in the other modules of this folder, the functions are undecorated Python, which is compiled for the web
page.
"""

from __future__ import annotations

from typing import Any

PARTIALS = 128
"""Length of the working array of both sums: enough partial sums for any exponents and any number of rows."""

_BLOCK = 128
"""Largest number of terms that NumPy adds in one loop."""


def eight_sums(table: Any, first: int, count: int, column: int) -> float:
    """Sum `count` rows, at most 128, of a column of `table`, with eight accumulators as NumPy does."""
    total = 0.0
    whole = count - count % 8
    if whole:
        a, b, c, d = (
            table[first, column],
            table[first + 1, column],
            table[first + 2, column],
            table[first + 3, column],
        )
        e, f, g, h = (
            table[first + 4, column],
            table[first + 5, column],
            table[first + 6, column],
            table[first + 7, column],
        )
        for i in range(first + 8, first + whole, 8):
            a += table[i, column]
            b += table[i + 1, column]
            c += table[i + 2, column]
            d += table[i + 3, column]
            e += table[i + 4, column]
            f += table[i + 5, column]
            g += table[i + 6, column]
            h += table[i + 7, column]
        total = ((a + b) + (c + d)) + ((e + f) + (g + h))
    for i in range(first + whole, first + count):
        total += table[i, column]
    return total


def pairwise_sum(table: Any, first: int, count: int, column: int, work: Any) -> float:
    """Sum `count` rows of a column, beginning at row `first`, in the same order as `numpy.sum`.

    Columns of more than 128 rows are halved recursively; `work`, shape (`PARTIALS`,), holds the left
    halves that wait for their right halves: first row, number of rows, whether the left sum is known, and
    that sum.
    """
    depth = 0
    while True:
        while count > _BLOCK:
            work[depth], work[depth + 1], work[depth + 2] = first, count, 0.0
            depth += 4
            count = count // 2 - count // 2 % 8
        total = eight_sums(table, first, count, column)
        while depth and work[depth - 2] == 1.0:
            depth -= 4
            total = work[depth + 3] + total
        if not depth:
            return float(total)
        work[depth - 2], work[depth - 1] = 1.0, total
        first, count = int(work[depth - 4]), int(work[depth - 3])
        half = count // 2 - count // 2 % 8
        first, count = first + half, count - half


def exact_sum(table: Any, column: int, work: Any) -> float:
    """Sum a column with a single rounding, as `math.fsum` does.

    J. R. Shewchuk, Discrete Comput. Geom. 18 (1997) 305: `work` holds partial sums that do not overlap.
    """
    used = 0
    for row in range(table.shape[0]):
        x = table[row, column]
        kept = 0
        for i in range(used):
            y = work[i]
            if abs(x) < abs(y):
                x, y = y, x
            high = x + y
            low = y - (high - x)
            if low != 0.0:
                work[kept] = low
                kept += 1
            x = high
        work[kept] = x
        used = kept + 1
    if used == 0:
        return 0.0
    used -= 1
    total, low = work[used], 0.0
    while used > 0:
        x = total
        used -= 1
        total = x + work[used]
        low = work[used] - (total - x)
        if low != 0.0:
            break
    # Round half to even: the remaining partial sums decide the direction of a tie.
    if used > 0 and ((low < 0.0 and work[used - 1] < 0.0) or (low > 0.0 and work[used - 1] > 0.0)):
        x = total + 2.0 * low
        if x - total == 2.0 * low:
            total = x
    return float(total)
