import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from printhammer.chaos import strobes
from printhammer.chaos.strobe.scan import CLOSER, LARGEST_MULTIPLIER, largest_multiplier, scan
from printhammer.chaos.strobe.train import Train, run_trains
from printhammer.chaos.strobe.verdict import AGREEMENT, LAST
from printhammer.run.effort import Effort
from printhammer.run.problem import TOLERANCE
from printhammer.run.regime import Regime

if TYPE_CHECKING:
    import printhammer as ph


def multiplier(hammer: "ph.Hammer", period: float, count: int) -> float:
    train = Train.of(Regime.of(hammer, period=period), 200)
    (states,), _ = run_trains([train], np.arange(100, 201), None, Effort())
    return largest_multiplier(train, states, count, TOLERANCE)


def test_what_is_left_over_stays_within_what_a_verdict_asks_for() -> None:
    assert CLOSER * AGREEMENT / (1.0 - LARGEST_MULTIPLIER) <= AGREEMENT * (1.0 + 1e-12)


@pytest.mark.parametrize(("period", "count"), [(1.25e-3, 1), (0.95e-3, 1), (1.35e-3, 2)])
def test_the_multiplier_of_a_cycle_is_the_growth_along_it(
    hammer: "ph.Hammer", period: float, count: int
) -> None:
    (found,) = strobes(hammer, [period], points=1, firings=(201, 600), every_exponent=True)
    assert found.verdict.period == count
    # The mean of the logarithms of a finite number of firings differs by what the ends are worth.
    growth = math.log(multiplier(hammer, period, count)) / count
    assert growth == pytest.approx(found.verdict.exponent, abs=0.05)


def test_the_multiplier_is_how_fast_a_train_settles(hammer: "ph.Hammer") -> None:
    period, scale = 1.25e-3, np.array([25.4e-6, 0.635])
    (found,) = strobes(hammer, [period], points=40, transient=20, verdict=False)
    apart = np.linalg.norm(np.diff(np.column_stack([found.x, found.v]) / scale, axis=0), axis=1)
    slope = np.polyfit(np.arange(len(apart)), np.log(apart), 1)[0]
    assert slope == pytest.approx(math.log(multiplier(hammer, period, 1)), abs=1e-3)


def test_a_scan_stops_where_a_train_has_settled(hammer: "ph.Hammer") -> None:
    told: list[tuple[int, int]] = []
    found = scan(hammer, [3e-3, 1.3e-3], progress=lambda done, total: told.append((done, total)))
    assert [verdict.name for verdict in found] == ["period-1", "period-1"]
    assert all(verdict.last < LAST for verdict in found)
    assert all(verdict.distance <= CLOSER * AGREEMENT for verdict in found)
    assert told[-1] == (2, 2)


@pytest.mark.slow
def test_a_scan_finds_what_the_long_way_finds(hammer: "ph.Hammer") -> None:
    # Around both onsets of chaos, periodic windows and trains that settle slowly among them.
    periods = [*np.arange(1270, 1355, 10) * 1e-6, *np.arange(850, 1250, 50) * 1e-6]
    long_way = [found.verdict.name for found in strobes(hammer, periods, points=1)]
    assert [verdict.name for verdict in scan(hammer, periods)] == long_way
    assert len(set(long_way)) >= 3


def test_without_exponents_a_train_without_a_period_is_left_undecided(hammer: "ph.Hammer") -> None:
    (found,) = scan(hammer, [0.8e-3], exponents=False)
    assert found.name == "undecided"
    assert "not computed" in found.reason
