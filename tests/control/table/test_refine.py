"""Refinement of the rates of a table where the table exceeds the limits."""

import numpy as np
import pytest
from tests.control.table.test_tuning import quick

import printhammer as ph
from printhammer.control.table import tuning
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import COLUMNS

pytestmark = pytest.mark.slow

GRID = np.array([100.0, 1840.0, 1900.0])
"""Rates of a table; from the second to the third one the way to fire a dot changes."""

MIDDLE = 1870.0


def tuned(halvings: int) -> CompensationTable:
    """Tune a table on a rate grid, refined up to a number of times where the table is not perfect."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tuning, "_all_rates", lambda _single, _scale: GRID)
        patch.setattr(tuning, "HALVINGS", halvings)
        patch.setattr(tuning, "BETWEEN", 0.0)
        return ph.tune(quick(), history=1)


@pytest.fixture(scope="module")
def coarse() -> CompensationTable:
    return tuned(0)


@pytest.fixture(scope="module")
def fine() -> CompensationTable:
    return tuned(1)


def test_a_rate_is_put_in_the_middle(coarse: CompensationTable, fine: CompensationTable) -> None:
    assert coarse.rates.tolist() == GRID.tolist()
    # Between the first two every dot at the lower one is from rest, but not at the upper one.
    assert np.setdiff1d(fine.rates, GRID).tolist() == [970.0, MIDDLE]


def test_the_rates_that_were_there_stay_as_they_were(
    coarse: CompensationTable, fine: CompensationTable
) -> None:
    kept = np.isin(fine.rates, GRID)
    assert all(np.array_equal(getattr(fine, name)[kept], getattr(coarse, name)) for name in COLUMNS)


def test_it_is_better_there(coarse: CompensationTable, fine: CompensationTable) -> None:
    nominal = [ph.Perturbation()]
    reports = [
        ph.judge_table(quick(), table, rates=[MIDDLE], perturbations=nominal) for table in (coarse, fine)
    ]
    before, after = (report.force[1].max() for report in reports)
    assert after < before
    assert reports[1].passed[1].all()
