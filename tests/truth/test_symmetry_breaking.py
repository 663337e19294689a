"""The symmetry of an orbit of Duffing's equation breaks in a pitchfork; its successors are mirror images."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import printhammer as ph
from printhammer.chaos import Branch

ANGULAR, DAMPING = 1.2, 0.2
FORCE = ph.SineForce(0.3, ANGULAR / (2.0 * math.pi))
RANGE = (0.25, 1.65)


@pytest.fixture(scope="module")
def asymmetric() -> Branch:
    """The branch through one of two orbits that are mirror images."""
    hammer = ph.load("duffing-holmes")
    where = {"drive": FORCE, "state": (0.44227198, -0.43609727), "firings": 1}
    return ph.continuation(hammer, "drive.amplitude", RANGE, most=200, **where)


@pytest.mark.slow
def test_a_branch_of_asymmetric_orbits_turns_into_its_mirror_image(asymmetric: Branch) -> None:
    assert asymmetric.symmetry == "asymmetric"
    assert [stop.parameter for stop in asymmetric.stops] == [RANGE[0], RANGE[0]]
    kinds = [event.kind for event in asymmetric.events]
    assert kinds == kinds[::-1]
    assert kinds.count("pitchfork") == 1
    values = [event.value for event in asymmetric.events]
    # The pitchfork itself is interpolated, the others are located.
    assert values == pytest.approx(values[::-1], abs=1e-9)
    # Stable from the period doubling to the pitchfork, where it turns back, and along its mirror image.
    low, high = asymmetric.stable_ranges[-1]
    assert high == pytest.approx(values[kinds.index("pitchfork")], abs=1e-4)
    assert low == pytest.approx(values[kinds.index("pitchfork") - 1], abs=1e-9)


@pytest.mark.slow
def test_the_branch_that_crosses_is_symmetric_and_loses_its_stability_there(asymmetric: Branch) -> None:
    (event,) = [event for event in asymmetric.events if event.kind == "pitchfork"]
    symmetric = asymmetric.crossing(event, most=40)
    assert symmetric.symmetry == "symmetric"
    (same,) = [event for event in symmetric.events if event.kind == "pitchfork"]
    assert same.value == pytest.approx(event.value, abs=1e-6)
    # By another integrator: half a period later the symmetric orbit is at its mirror image.
    half = math.pi / ANGULAR
    for k in (0, len(symmetric) // 2, len(symmetric) - 1):

        def rate(t: float, state: np.ndarray, force: float) -> list[float]:
            x, v = state
            return [v, x - x**3 - DAMPING * v + force * math.sin(ANGULAR * t)]

        begin = np.array([symmetric.x[k, 0], symmetric.v[k, 0]])
        end = solve_ivp(rate, (0.0, half), begin, rtol=1e-11, atol=1e-12, args=(symmetric.values[k],)).y[
            :, -1
        ]
        assert end == pytest.approx(-begin, abs=1e-7)
