import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from printhammer.chaos.strobe.verdict import (
    AGREEMENT,
    LARGEST_PERIOD,
    SIGNIFICANT,
    period_of,
    repeats,
    verdict,
)
from printhammer.derivatives.states import Exponent, standard_error

RANDOM = np.random.default_rng(64)
ONES = np.ones(3)
GROWING = Exponent(0.5, 0.1, -2.0, 1e-3, np.full(10, 0.5), True, "ok")


def branches(states: np.ndarray) -> np.ndarray:
    return np.zeros(len(states), np.int64)


def cycle(period: int, count: int, noise: float) -> np.ndarray:
    """Noisy states that repeat after `period` firings; no two states of a period are close to each other."""
    angle = 2.0 * np.pi * np.arange(count) / period
    states = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    return states + RANDOM.uniform(-0.5, 0.5, states.shape) * noise


@given(st.integers(1, LARGEST_PERIOD), st.floats(0.0, 0.99 * AGREEMENT))
def test_the_period_of_a_cycle_is_found_through_noise(period: int, noise: float) -> None:
    states = cycle(period, 1000, noise)
    assert period_of(repeats(states, branches(states), ONES)) == period


def test_a_longer_cycle_has_no_period() -> None:
    states = cycle(LARGEST_PERIOD + 1, 1000, 0.0)
    assert period_of(repeats(states, branches(states), ONES)) is None


@pytest.mark.parametrize("component", [0, 1, 2])
def test_every_component_counts_in_units_of_its_scale(component: int) -> None:
    states = np.zeros((100, 3))
    states[::2, component] = 3.0
    scales = np.array([1.0, 1.0, 1.0])
    scales[component] = 6.0
    found = repeats(states, branches(states), scales)
    assert found[0] == pytest.approx(0.5)
    assert found[1] == 0.0


def test_one_state_that_differs_is_enough() -> None:
    states = np.zeros((1000, 3))
    states[617, 1] = 1.01 * AGREEMENT
    assert period_of(repeats(states, branches(states), ONES)) is None
    assert repeats(states, branches(states), ONES) == pytest.approx(1.01 * AGREEMENT)


def test_states_on_different_branches_do_not_agree() -> None:
    states = np.zeros((100, 3))
    by_turns = np.arange(100) % 2 + 1
    found = repeats(states, by_turns, ONES)
    assert np.isinf(found[::2]).all()
    assert period_of(found) == 2


def test_a_period_is_seen_at_least_twice() -> None:
    states = cycle(20, 39, 0.0)
    assert period_of(repeats(states, branches(states), ONES)) is None
    states = cycle(20, 40, 0.0)
    assert period_of(repeats(states, branches(states), ONES)) == 20


def test_states_that_are_not_known_agree_with_nothing() -> None:
    states = np.zeros((100, 3))
    states[50:] = np.nan
    assert np.isinf(repeats(states, branches(states), ONES)).all()


def test_a_period_needs_no_exponent() -> None:
    found = verdict(np.array([1.0, 1e-9, 1.0, 1e-10]), (1001, 2000), 1e-11, None)
    assert (found.name, found.period, found.nearest, found.distance) == ("period-2", 2, 2, 1e-9)
    assert not found.strange
    assert "states 2 firings apart agree to 1.0e-09" in found.evidence
    assert "firings 1001 to 2000, tolerance 1e-11" in found.evidence


def test_strange_is_no_period_and_growth() -> None:
    distances = np.array([1.0, 0.3, 0.7])
    found = verdict(distances, (1001, 2000), 1e-11, GROWING)
    assert (found.name, found.period, found.nearest, found.distance) == ("strange", None, 2, 0.3)
    assert found.strange
    assert "+0.5 ± 0.1 per firing" in found.evidence


@pytest.mark.parametrize(
    ("exponent", "reason"),
    [
        (replace(GROWING, standard_error=0.5 / SIGNIFICANT), "3 standard errors"),
        (replace(GROWING, value=-0.5), "3 standard errors"),
        (replace(GROWING, standard_error=math.inf), "3 standard errors"),
        (replace(GROWING, smooth=False), "a touch without velocity"),
        (replace(GROWING, value=math.nan, status="range left"), "range left"),
        (None, "not computed"),
    ],
)
def test_everything_else_is_undecided_with_a_reason(exponent: Exponent | None, reason: str) -> None:
    found = verdict(np.array([1.0, 0.3]), (1001, 2000), 1e-11, exponent)
    assert found.name == str(found) == "undecided"
    assert reason in found.reason


def test_a_run_that_stopped_is_undecided() -> None:
    found = verdict(np.full(64, np.inf), (1001, 2000), 1e-11, None, "runaway")
    assert (found.name, found.nearest) == ("undecided", None)
    assert found.reason == "the run ended before firing 2000: runaway"
    assert "no period" not in found.evidence
    told = found.as_dict()
    assert told["distance"] is None
    assert told["exponent_per_firing"] is None


def test_the_logistic_map_is_strange_at_its_end() -> None:
    # x -> 4 x (1 - x) has the exponent ln 2 (S. Ulam and J. von Neumann, 1947).
    x = np.empty(3000)
    x[0] = 0.1234
    for k in range(len(x) - 1):
        x[k + 1] = 4.0 * x[k] * (1.0 - x[k])
    growth = np.log(np.abs(4.0 - 8.0 * x[1000:]))
    exponent = Exponent(float(growth.mean()), standard_error(growth), -math.inf, 1.0, growth, True, "ok")
    assert exponent.value == pytest.approx(math.log(2.0), abs=3.0 * exponent.standard_error)
    states = np.column_stack([x[1000:], x[1000:], np.zeros(2000)])
    assert verdict(repeats(states, branches(states), ONES), (1001, 3000), 0.0, exponent).strange


@pytest.mark.parametrize(("a", "period"), [(2.9, 1), (3.2, 2), (3.5, 4), (3.55, 8), (3.83, 3)])
def test_the_logistic_map_before_its_end_is_periodic(a: float, period: int) -> None:
    x = np.empty(3000)
    x[0] = 0.1234
    for k in range(len(x) - 1):
        x[k + 1] = a * x[k] * (1.0 - x[k])
    states = np.column_stack([x[1000:], x[1000:], np.zeros(2000)])
    found = verdict(repeats(states, branches(states), ONES), (1001, 3000), 0.0, None)
    assert found.name == f"period-{period}"
