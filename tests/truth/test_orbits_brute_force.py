"""Search for orbits against a brute force: Newton's method from random states, with another integrator."""

import math
from typing import Any

import numpy as np
import pytest

import printhammer as ph
from printhammer.chaos import Orbits
from printhammer.chaos.orbits.stages import Search

FORCE = 0.3
STARTS, STEPS, ITERATIONS = 4500, 160, 40


def strobe(states: np.ndarray, firings: int) -> tuple[np.ndarray, np.ndarray]:
    """Strobe map of Duffing's equation with two wells, and its derivative, by the classical RK method.

    States have the shape (2, n), derivatives the shape (2, 2, n).
    """

    def slope(t: float, rows: np.ndarray) -> np.ndarray:
        x, v, *columns = rows
        stiffness = 1.0 - 3.0 * x * x
        result = np.empty_like(rows)
        result[0], result[1] = v, FORCE * math.cos(t) + x - x**3 - 0.2 * v
        for k in (0, 1):
            result[2 + k], result[4 + k] = columns[2 + k], stiffness * columns[k] - 0.2 * columns[2 + k]
        return result

    one, zero = np.ones(states.shape[1]), np.zeros(states.shape[1])
    rows, h = np.array([*states, one, zero, zero, one]), 2.0 * math.pi / STEPS
    for step in range(firings * STEPS):
        t = step * h
        first = slope(t, rows)
        second = slope(t + 0.5 * h, rows + 0.5 * h * first)
        third = slope(t + 0.5 * h, rows + 0.5 * h * second)
        fourth = slope(t + h, rows + h * third)
        rows = rows + h / 6.0 * (first + 2.0 * (second + third) + fourth)
    return rows[:2], rows[2:].reshape(2, 2, -1)


def brute_force(firings: int) -> list[np.ndarray]:
    """Find orbits by Newton's method from random states; return one state of each orbit of that period."""
    rng = np.random.default_rng(firings)
    states = np.array([rng.uniform(-1.8, 1.8, STARTS), rng.uniform(-1.2, 1.2, STARTS)])
    settled = []
    for _ in range(ITERATIONS):
        images, derivative = strobe(states, firings)
        # Most states settle within a dozen iterations.
        there = np.abs(images - states).max(axis=0) < 1e-11
        settled.append(states[:, there])
        images, states, ((a, b), (c, d)) = images[:, ~there], states[:, ~there], derivative[..., ~there]
        x, v = images - states
        det = (a - 1.0) * (d - 1.0) - b * c
        step = np.array([b * v - (d - 1.0) * x, c * x - (a - 1.0) * v]) / det
        states = states + step * 0.5 / np.maximum(np.abs(step).max(axis=0), 0.5)
        # Newton's method does not return from states far away, where the integration overflows.
        states = states[:, (np.abs(states) < 3.0).all(axis=0)]
    states = np.hstack([*settled, states])
    states = states[:, np.abs(strobe(states, firings)[0] - states).max(axis=0) < 1e-9]
    divisors = [count for count in range(1, firings) if firings % count == 0]
    found: list[np.ndarray] = []
    seen = np.empty((2, 0))
    for state in states.T:
        if seen.size and np.abs(seen - state[:, np.newaxis]).max(axis=0).min() < 1e-5:
            continue
        orbit = [state]
        for _ in range(firings - 1):
            orbit.append(strobe(orbit[-1][:, np.newaxis], 1)[0][:, 0])
        seen = np.column_stack([seen, *orbit])
        if all(np.abs(orbit[count] - state).max() > 1e-5 for count in divisors):
            found.append(state)
    return found


@pytest.fixture(scope="module")
def orbits() -> Orbits:
    """Orbits of up to three firings of Duffing's equation with two wells; mirror images add no hits."""
    reflect, images = Search._reflect, 0

    def checked(search: Search, fast: Any, different: list[Any], begin: int) -> int:
        nonlocal images
        before = [known.hits for known in different]
        count = reflect(search, fast, different, begin)
        # Mirror images are not independent guesses, on which the estimate of the coverage rests.
        assert [known.hits for known in different] == before + [0] * (count - len(before))
        images += count - len(before)
        return count

    drive = ph.SineForce(FORCE, 1.0 / (2.0 * math.pi), phase="90 deg")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Search, "_reflect", checked)
        found = ph.orbits(ph.load("duffing-holmes"), drive=drive, longest=3)
    assert images > 0
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("firings", "least"), [(1, 3), (2, 10), (3, 20)])
def test_a_brute_force_finds_no_further_orbit(orbits: Orbits, firings: int, least: int) -> None:
    listed = [own for own in orbits if own.firings == firings]
    found = brute_force(firings)
    assert len(found) >= least
    for x, v in found:
        assert min(np.maximum(abs(own.x - x), abs(own.v - v)).min() for own in listed) < 1e-5


@pytest.mark.slow
def test_the_indices_of_the_listed_orbits_add_up_to_one(orbits: Orbits) -> None:
    """The list includes two mirror pairs of saddles, with multipliers of 719 and 2131, whose index is -1."""
    assert orbits.indices == {1: 1, 2: 1, 3: 1}
    assert len(orbits) == 57
    assert sum(orbits.hits) <= len(orbits) + orbits.repeats
    assert orbits.incomplete == ()
    multipliers = [own.multipliers[0].real for own in orbits]
    for expected in (718.8952, 2130.9476):
        assert sum(abs(value / expected - 1.0) < 1e-5 for value in multipliers) == 2
