"""Periods determined from states alone and with Newton's method, on maps whose orbits are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import printhammer as ph
from printhammer.chaos import orbit
from printhammer.chaos.orbits.settled import is_approaching, settled, shown
from printhammer.run.regime import Regime


def spiral(multiplier: complex, count: int, begin: float = 1e-3) -> np.ndarray:
    """Return states that converge to the origin with a complex multiplier."""
    turns = begin * multiplier ** np.arange(count)
    return np.column_stack([turns.real, turns.imag])


def cycle(period: int, count: int) -> np.ndarray:
    angle = 2.0 * np.pi * np.arange(count) / period
    return np.column_stack([np.cos(angle), np.sin(angle)])


@given(st.integers(1, 64), st.floats(0.0, 1e-10), st.integers(128, 1000))
def test_a_cycle_shows_its_period(period: int, noise: float, count: int) -> None:
    points = cycle(period, count)
    points += noise * np.random.default_rng(period).uniform(-1.0, 1.0, points.shape)
    assert shown(points[np.newaxis], period)[0]


@given(st.integers(2, 8), st.floats(1e-6, 1e-2), st.floats(1e-5, 1e-2))
def test_a_slow_approach_by_turns_shows_no_period(period: int, slow: float, begin: float) -> None:
    multiplier = (1.0 - slow) * np.exp(2j * np.pi / period)
    assert not shown(spiral(multiplier, 1000, begin)[np.newaxis], period)[0] or begin * slow < 1e-8


def test_drifting_states_show_no_period() -> None:
    # Past a fold trains creep by where the orbit was.
    points = np.column_stack([1e-7 * np.arange(1000.0), np.zeros(1000)])
    assert not shown(points[np.newaxis], 1)[0]


def test_states_approach_an_orbit_in_its_order_only() -> None:
    home = cycle(5, 5)
    points = cycle(5, 203) + spiral(-0.99, 203)
    assert is_approaching(points, home)
    assert is_approaching(points[2:], home)
    assert not is_approaching(points, home[::-1])
    assert not is_approaching(points[::-1], home[::-1])
    assert not is_approaching(points + 1e-3, home)


@pytest.mark.parametrize("period", [1, 2])
def test_a_saddle_is_no_period(period: int) -> None:
    # Of period 2, with a largest multiplier of 1.0094: trains dwell there for hundreds of firings.
    hammer = ph.load("hendriks-1983-1")
    regime = Regime.of(hammer, period=1.05e-3)
    saddle = orbit(regime, (5.24594925e-05, 0.11503261), firings=2)
    assert saddle.kind == "saddle"
    state = saddle.section + 1e-6 * regime.window.half_widths
    found = ph.strobe(regime, state=tuple(state), points=200, verdict=False)
    points = np.column_stack([found.x, found.v])
    ends_at = settled(regime, points, 2 * period, regime.window.half_widths)
    assert ends_at.period is None
    assert "no stable orbit" in ends_at.reason
