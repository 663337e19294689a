"""Rates between the rates of a table: where the table is no good there, more rates are put in between."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.compensation import COLUMNS, CompensationTable
from printhammer.control.table.histories import REST, number_of, shared_numbers
from printhammer.control.table.polish import VALUES, Work, level_of, look_at, polish
from printhammer.control.table.search import BAD, searched
from printhammer.control.table.ways import costs, solved, ways_of

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

HALVINGS: Final = 3
"""How often the step between two rates is halved at most."""

BETWEEN: Final = 0.5
"""Deviation between two rates, in parts of the limits, from which on there is one more between them."""


def table_of(work: Work, largest: float) -> CompensationTable:
    """Return a table in the making as a table.

    Raises
    ------
    InputError
        Its values make no table.
    """
    shared = shared_numbers(work.gaps, work.reach)
    values: dict[str, Any] = {name: getattr(work, name)[:, shared] for name in VALUES}
    return CompensationTable(
        hammer=work.hammers[0].name,
        fingerprint=work.hammers[0].fingerprint,
        rates=work.rates,
        gaps=work.gaps,
        reach=work.reach,
        largest_current=largest,
        **values,
    )


def refined(work: Work, largest: float, told: Callable[[], None], *, brake: bool) -> Work:
    """Put rates between those of a table where it is not good enough halfway between two of them.

    Such places are where the way to fire a dot changes. The new entries follow that of the rate below or that
    of the rate above, whichever is the better one; where neither is good, another one is looked for.

    Parameters
    ----------
    work : Work
        A table that is done at its rates.
    largest : float
        Bound on the current, A.
    told : callable
        Called after each step of the work.
    brake : bool
        Whether brake pulses may be used.

    Returns
    -------
    Work
        With more rates.
    """
    # Rates at which every dot is printed from rest need nothing.
    steps = np.arange(work.rates.size - 1)
    lower = steps[1.0 / work.rates[steps + 1] <= work.single.settled]
    wanted = set(work.rates[lower].tolist())
    for _ in range(HALVINGS):
        lower = np.flatnonzero(np.isin(work.rates, list(wanted)))
        lower = lower[lower < work.rates.size - 1]
        if not lower.size:
            break
        halfway = _halfway(work, lower, largest)
        told()
        bad = np.flatnonzero(~(halfway.deviation.max(axis=1) <= BETWEEN))
        lower = lower[bad]
        if not lower.size:
            break
        more = _tuned(work, lower, told, brake=brake)
        wanted = {*work.rates[lower].tolist(), *more.rates.tolist()}
        work = _joined(work, more)
    return work


def _halfway(work: Work, lower: npt.NDArray[np.int64], largest: float) -> Work:
    """Return what the table says halfway between some rates and those above them, and how good that is."""
    table = table_of(work, largest)
    rates = 0.5 * (work.rates[lower] + work.rates[lower + 1])
    told = [table.at(float(rate)) for rate in rates]
    values: dict[str, Any] = {name: np.array([getattr(one, name) for one in told]) for name in COLUMNS}
    found = replace(work, rates=rates, deviation=np.zeros((rates.size, table.advance.shape[1])), **values)
    for known in range(1, work.gaps + 1):
        look_at(found, level_of(found, known))
    return found


def _tuned(work: Work, lower: npt.NDArray[np.int64], told: Callable[[], None], *, brake: bool) -> Work:
    """Return tuned rows halfway between some rates and those above them."""
    rates = 0.5 * (work.rates[lower] + work.rates[lower + 1])
    values: dict[str, Any] = {name: getattr(work, name)[lower] for name in VALUES}
    found = replace(work, rates=rates, **values)
    for gap in range(1, work.reach + 1):
        periods = gap / rates
        near = np.flatnonzero(periods <= work.single.settled)
        if not near.size:
            continue
        column = number_of((gap, *[REST] * (work.gaps - 1)), work.reach)
        cells = [
            (
                float(periods[row]),
                float(work.brake_delay[side, column]),
                float(work.brake_width[side, column]),
                float(periods[row] - work.advance[side, column]),
                float(work.width[side, column]),
            )
            for row in near.tolist()
            for side in (lower[row], lower[row] + 1)
        ]
        ways = solved(work, ways_of(cells))
        cost = costs(work, ways).reshape(-1, 2)
        for place, row in enumerate(near.tolist()):
            best = ways.some([2 * place + int(cost[place].argmin())])
            if not cost[place].min() <= BAD:
                # Neither goes on from its rate to here; perhaps there is one more.
                more = searched(work, float(periods[row]), brake=brake)
                if more.size and more.cost.min() < cost[place].min():
                    best = more.some([int(more.cost.argmin())])
            found.advance[row, column] = best.period[0] - best.fired[0]
            found.width[row, column] = best.width[0]
            found.brake_delay[row, column] = best.delay[0]
            found.brake_width[row, column] = best.brake[0]
    polish(found, told)
    return found


def _joined(work: Work, more: Work) -> Work:
    """Return the rows of both in the order of their rates."""
    rates = np.concatenate([work.rates, more.rates])
    order = np.argsort(rates, kind="stable")
    values: dict[str, Any] = {
        name: np.concatenate([getattr(work, name), getattr(more, name)])[order] for name in VALUES
    }
    return replace(work, rates=rates[order], **values)
