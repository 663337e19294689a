"""Multiplier of each history of a compensation table: error growth per dot if the history repeats.

The history of a dot lists the last gaps between dots. If these gaps are repeated endlessly, they form a
periodic pattern, in which this history occurs. The strobe map of the pattern leads from a firing to the
firing after one repetition. A repetition of n dots with the Floquet multiplier M has the dot-to-dot
multiplier sign(M) |M|^(1/n), the geometric mean over its dots. Rotations of the gaps are the same pattern.

A rest is represented by the shortest gap that counts as rest, one slot more than the reach, after which the
residual motion is largest. For equal gaps, the multiplier is the multiplier of a row; see
`printhammer.derivatives.rows`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate, cycle, islice
from typing import Final, Unpack

import numpy as np

from printhammer.control.table.compensation import CompensationTable, TableStrategy
from printhammer.control.table.drive import REST, histories, number_of, shared_numbers
from printhammer.derivatives.rows import FIRING, MORE, row_multipliers
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.strategy import Strategy
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.support.arrays import FloatArray

_PIECE: Final = 2048  # Rows per ensemble, which bounds the memory; arbitrary


@computation
def with_multipliers(
    table: CompensationTable,
    hammer: Hammer,
    *,
    unit: Hammer | None = None,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> CompensationTable:
    """Return a copy of a table with the dot-to-dot multiplier of each history, computed for its hammer.

    A table that was rounded to ticks, edited, or read from a file without multipliers has no multipliers.

    Parameters
    ----------
    table : CompensationTable
        Table with the pulses.
    hammer : Hammer
        The hammer for which the table was tuned, and whose driver generates the pulses.
    unit : Hammer, optional
        Driven hammer, if it differs from `hammer`.

    Returns
    -------
    CompensationTable
        The table with its `multiplier`, which is NaN where the pattern has no periodic orbit.
    """
    driven = hammer if unit is None else unit
    values = history_multipliers(table, TableStrategy(table, hammer), driven, effort.quiet)
    return replace(table, multiplier=values)


def history_multipliers(
    table: CompensationTable, strategy: Strategy, driven: Hammer, effort: Effort
) -> FloatArray:
    """Compute the dot-to-dot multiplier of each history at each rate, shape (rates, entries).

    `strategy` generates the drives from the entries of `table`, and `driven` is the simulated hammer.
    """
    every = histories(table.gaps, table.reach)
    patterns = sorted({repetition(history, table.reach) for history in every})
    values = np.full((len(patterns), table.rates.size), np.nan)
    cells = [(k, r) for k in range(len(patterns)) for r in range(table.rates.size)]
    for begin in range(0, len(cells), _PIECE):
        piece = cells[begin : begin + _PIECE]
        drives = [strategy(driven, [_row(patterns[k])], float(table.rates[r]))[0] for k, r in piece]
        dots = [len(patterns[k]) for k, _ in piece]
        growth = row_multipliers([driven] * len(piece), drives, effort, repeats=dots)
        values[tuple(np.array(piece).T)] = np.sign(growth) * np.abs(growth) ** (1.0 / np.array(dots))
    table_of = {history: values[patterns.index(repetition(history, table.reach))] for history in every}
    columns = {number_of(history, table.reach): row for history, row in table_of.items()}
    return np.stack([columns[number] for number in shared_numbers(table.gaps, table.reach)], axis=1)


def repetition(history: Sequence[int], reach: int) -> tuple[int, ...]:
    """Return the shortest gap sequence whose repetition contains a history, in chronological order.

    The gaps are in slots. Of all rotations, which are the same pattern, the first in lexical order is
    returned.
    """
    gaps = [reach + 1 if gap == REST else gap for gap in reversed(history)]
    size = next(n for n in range(1, len(gaps) + 1) if gaps == [gaps[k % n] for k in range(len(gaps))])
    return min(tuple(gaps[k:size] + gaps[:k]) for k in range(size))


def _row(gaps: Sequence[int]) -> tuple[int, ...]:
    """Return the slots of a row that repeats a gap sequence, as long as `row_multipliers` requires."""
    dots = FIRING + MORE * len(gaps)
    return tuple(accumulate(islice(cycle(gaps), dots - 1), initial=0))
