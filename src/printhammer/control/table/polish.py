"""All entries of a table made right: those of short histories first, since they come before the others."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.table.draft import histories_of_length
from printhammer.control.table.histories import REST, History, number_of
from printhammer.control.table.newton import solve

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.control.table.draft import Cells, Draft
    from printhammer.support.arrays import BoolArray, FloatArray, IntArray

GOOD: Final = 1e-4  # Deviation, in parts of the limits, from which on an entry is left as it is
LEAST_OF_WIDEST: Final = 0.3  # Least width, in parts of the largest one
# Deviation, in parts of the limits, above which an entry is made less wrong in all patterns
ROUGH: Final = 0.2
_STEP: Final = 0.5e-6  # Difference of times from which derivatives are taken, s


def polish(draft: Draft) -> None:
    """Improve all entries of a draft in place; that from rest stays as it is.

    The draft has a first guess for every history.
    """
    task = draft.task
    for known in range(1, task.gaps + 1):
        level = histories_of_length(task, known)
        for history in level if known > 1 else []:
            parent = (*history[: known - 1], *[REST] * (task.gaps - known + 1))
            guess = draft.values[:4, :, number_of(parent, task.reach)]
            draft.values[:4, :, number_of(history, task.reach)] = guess
        _polish_level(draft, level)
    # Entries that come before others may have changed since they were judged.
    draft.judge()
    task.report()


def _polish_level(draft: Draft, level: Sequence[History]) -> None:
    """Improve the entries of some histories at all rates; what is printed from rest stays as it is.

    At first each entry is made right in the pattern that begins with it: where all dots before are right, it
    is right in all others as well. Where that cannot be, it is made less wrong in all.
    """
    settled = draft.task.single.settled
    cells = [
        (row, history)
        for row, rate in enumerate(draft.rates.tolist())
        for history in level
        if history[0] / rate <= settled
    ]
    _solve(draft, cells, dense=False)
    draft.judge(level)
    if not cells:
        return
    rows, columns = draft.places(cells)
    rough = [cells[k] for k in np.flatnonzero(draft.deviation[rows, columns] > ROUGH).tolist()]
    if not rough:
        return
    before = draft.values.copy()
    _solve(draft, rough, dense=True)
    draft.judge(level)
    rows, columns = draft.places(rough)
    worse = ~(draft.deviation[rows, columns] < before[4, rows, columns])
    draft.values[:, rows[worse], columns[worse]] = before[:, rows[worse], columns[worse]]


def _solve(draft: Draft, cells: Cells, *, dense: bool) -> None:
    if not cells:
        return
    task = draft.task
    rows, columns = draft.places(cells)
    gap = np.array([history[0] for _row, history in cells]) / draft.rates[rows]
    first = task.earliest(*draft.brakes[:, rows, columns])

    def measure(now: FloatArray, active: IntArray, shifts: FloatArray) -> FloatArray:
        # Dots before the last one may have the same history.
        draft.timing[:, rows, columns] = now.T
        off = draft.last_dots([cells[k] for k in active.tolist()], now[active], shifts, dense=dense)
        task.report()
        return off

    def bounded(now: FloatArray, active: IntArray, stepped: BoolArray) -> None:
        on = active[stepped]
        now[on, 0] = np.clip(now[on, 0], -task.latest(now[on, 1]), gap[on] - first[on])

    draft.timing[:, rows, columns] = solve(
        measure,
        draft.timing[:, rows, columns].T,
        steps=(_STEP, _STEP),
        good=GOOD,
        least=LEAST_OF_WIDEST * task.widest,
        most=task.widest,
        bounded=bounded,
    ).T
