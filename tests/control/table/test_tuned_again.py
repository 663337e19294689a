"""Repeated tuning of rates that exceed the limits, with candidates near the times of their neighbours."""

from typing import Any

import numpy as np
import pytest
from tests.control.table.test_tuning import quick

from printhammer.control.table import tuning
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.draft import blank

RATES = [1700.0, 1800.0, 1900.0, 2000.0]

FIRST = [0.1, 0.9, np.inf, 0.8]
"""Deviations, in parts of the limits, of the first tuning: all but one are no good."""

SECOND = {1800.0: 0.3, 1900.0: 0.7, 2000.0: 0.85}
"""Deviations of the second one: the last is worse than before."""

MARKS = {"first": 1e-6, "second": 2e-6}


@pytest.fixture(scope="module")
def asked() -> list[tuple[list[float], Any]]:
    """Calls of the tuning: rates, and the times around which candidates are searched."""
    return []


@pytest.fixture(scope="module")
def table(asked: list[tuple[list[float], Any]]) -> CompensationTable:
    def tuned(task: Any, rates: Any, *_: Any, around: Any = None, **__: Any) -> Any:
        asked.append((rates.tolist(), around))
        again = around is not None
        draft = blank(task, rates)
        advance, width = draft.timing
        width[:] = 200e-6
        off = [SECOND[rate] for rate in rates.tolist()] if again else FIRST
        draft.deviation[:, 1] = off
        advance[:, 1] = MARKS["second" if again else "first"]
        return draft

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tuning, "_tune_rows", tuned)
        return tuning.tune(quick(), rates=RATES, history=1)


def test_only_rates_that_are_no_good_are_tuned_again(
    table: CompensationTable, asked: list[tuple[list[float], Any]]
) -> None:
    assert table.rates.tolist() == RATES
    (first, near), (second, around) = asked
    assert first == RATES
    assert near is None
    assert second == RATES[1:]
    assert min(around) < 0.0 < max(around)


def test_what_is_better_is_taken(table: CompensationTable) -> None:
    assert table.deviation.max(axis=1).tolist() == [0.1, 0.3, 0.7, 0.8]
    taken = ["first", "second", "second", "first"]
    assert table.advance[:, 1].tolist() == [MARKS[one] for one in taken]
