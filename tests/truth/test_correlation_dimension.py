"""Correlation dimension of sets with a known dimension."""

import math

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.chaos.exponents.correlation import correlation_sums

RNG = np.random.default_rng(4)


def henon(count: int) -> np.ndarray:
    """States of x' = 1 - 1.4 x^2 + y, y' = 0.3 x, after a transient."""
    x, y, states = 0.1, 0.1, []
    for _ in range(count + 100):
        x, y = 1.0 - 1.4 * x * x + y, 0.3 * x
        states.append((x, y))
    return np.array(states[100:])


def cantor(count: int) -> np.ndarray:
    digits = RNG.integers(0, 2, (count, 30))
    return np.asarray((2.0 * digits * 3.0 ** -np.arange(1.0, 31.0)).sum(axis=1))


ANGLE = np.arange(5000) * 0.5 * (1.0 + math.sqrt(5.0)) * 2.0 * math.pi
CASES = {
    "circle": (np.column_stack([np.cos(ANGLE), np.sin(ANGLE)]), 1.0),
    "square": (RNG.uniform(size=(8000, 2)), 2.0),
    "interval": (RNG.uniform(size=6000), 1.0),
    "Cantor set": (cantor(8000), math.log(2.0) / math.log(3.0)),
    # About that; P. Grassberger and I. Procaccia (1983) have 1.21.
    "Hénon map": (henon(10_000), 1.220),
}


@pytest.mark.parametrize("name", CASES)
def test_the_interval_holds_the_dimension(name: str) -> None:
    states, exact = CASES[name]
    found = ph.correlation_dimension(states)
    assert found.low <= exact <= found.high
    assert found.dimension == pytest.approx(exact, abs=0.06)
    assert found.plateau[1] >= 8.0 * found.plateau[0] * (1.0 - 1e-12)
    assert found.high - found.low < 0.35
    assert "on a plateau" in found.message


def test_correlation_sums_are_those_counted_one_by_one() -> None:
    states, theiler = RNG.normal(size=(300, 2)), 4
    radius = np.array([0.01, 0.1, 0.5, 1.0, 10.0])
    first, second = np.triu_indices(len(states), theiler)
    distances = np.abs(states[first] - states[second]).max(axis=1)
    sums, pairs = correlation_sums(states, radius, theiler)
    assert pairs == len(first)
    np.testing.assert_allclose(sums, [(distances <= each).mean() for each in radius], rtol=1e-15)


def test_a_cycle_has_no_plateau() -> None:
    found = ph.correlation_dimension(np.tile([0.0, 0.3, 1.0], 200))
    assert math.isnan(found.dimension)
    assert "no plateau" in found.message


@pytest.mark.parametrize(
    ("states", "more", "key"),
    [
        (np.zeros(300), {}, "states"),
        (np.arange(50.0), {}, "states"),
        (np.arange(300.0), {"theiler": 200}, "theiler"),
        (np.arange(300.0), {"flat": -1.0}, "flat"),
        (np.full(300, np.nan), {}, "states"),
    ],
)
def test_what_is_refused(states: np.ndarray, more: dict[str, float], key: str) -> None:
    with refused(key):
        ph.correlation_dimension(states, **more)
