"""Rates between the rates of a table: where the table is no good there, more rates are put in between."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.control.table.draft import Draft
from printhammer.control.table.histories import REST, number_of
from printhammer.control.table.polish import polish
from printhammer.control.table.search import BAD, searched
from printhammer.control.table.ways import costs, solved, ways_of

if TYPE_CHECKING:
    from printhammer.support.arrays import IntArray

HALVINGS: Final = 3  # How often the step between two rates is halved at most
# Deviation between two rates, in parts of the limits, from which on there is one more between them
BETWEEN: Final = 0.5


def refined(draft: Draft) -> Draft:
    """Put rates between those of a table where it is not good enough halfway between two of them.

    Such places are where the way to fire a dot changes. The new entries follow that of the rate below or that
    of the rate above, whichever is the better one; where neither is good, another one is looked for.
    """
    # Rates at which every dot is printed from rest need nothing.
    lower = np.flatnonzero(1.0 / draft.rates[1:] <= draft.task.single.settled)
    wanted = set(draft.rates[lower].tolist())
    for _ in range(HALVINGS):
        lower = np.flatnonzero(np.isin(draft.rates, list(wanted)))
        lower = lower[lower < draft.rates.size - 1]
        if not lower.size:
            break
        halfway = _halfway(draft, lower)
        draft.task.report()
        lower = lower[~(halfway.worst <= BETWEEN)]
        if not lower.size:
            break
        more = _tuned(draft, lower)
        wanted = {*draft.rates[lower].tolist(), *more.rates.tolist()}
        rates = np.concatenate([draft.rates, more.rates])
        order = np.argsort(rates, kind="stable")
        values = np.concatenate([draft.values, more.values], axis=1)
        draft = Draft(draft.task, rates[order], values[:, order])
    return draft


def _halfway(draft: Draft, lower: IntArray) -> Draft:
    """Return what the table says halfway between some rates and those above them, and how good that is."""
    table = draft.table()
    rates = 0.5 * (draft.rates[lower] + draft.rates[lower + 1])
    settings = np.array([table.at(float(rate)) for rate in rates])
    values = np.concatenate([settings, np.zeros_like(settings[:, :1])], axis=1).transpose(1, 0, 2)
    halfway = Draft(draft.task, rates, values)
    halfway.judge()
    return halfway


def _tuned(draft: Draft, lower: IntArray) -> Draft:
    """Return tuned rows halfway between some rates and those above them."""
    task = draft.task
    rates = 0.5 * (draft.rates[lower] + draft.rates[lower + 1])
    halfway = Draft(task, rates, draft.values[:, lower])
    for gap in range(1, task.reach + 1):
        periods = gap / rates
        near = np.flatnonzero(periods <= task.single.settled)
        if not near.size:
            continue
        column = number_of((gap, *[REST] * (task.gaps - 1)), task.reach)
        cells = []
        for row in near.tolist():
            for side in (lower[row], lower[row] + 1):
                advance, width, delay, brake = draft.values[:4, side, column].tolist()
                cells.append((float(periods[row]), delay, brake, float(periods[row]) - advance, width))
        ways = solved(task, ways_of(cells))
        cost = costs(task, ways).reshape(-1, 2)
        for place, row in enumerate(near.tolist()):
            best = ways.take([2 * place + int(cost[place].argmin())])
            if not cost[place].min() <= BAD:
                # Neither goes on from its rate to here; perhaps there is one more.
                more = searched(task, float(periods[row]))
                if more.size and more.cost.min() < cost[place].min():
                    best = more.take([int(more.cost.argmin())])
            halfway.values[:4, row, column] = best.settings[:, 0]
    polish(halfway)
    return halfway
