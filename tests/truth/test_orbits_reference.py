"""Periodic orbits of a hammer, stable and unstable, re-integrated with the independent reference.

The reference starts at time 0, without earlier pulses: trains whose pulses end before the next firing,
or are cut off by it, need no earlier pulses.
"""

import numpy as np
import pytest
from tests.hammers import CRUDE
from tests.oracle.integrator import ReferenceRun, reference

import printhammer as ph
from printhammer.chaos import Orbit, Orbits

TIGHT = 1e-14


def found_at(period: float, overlap: str, longest: int, starts: int) -> Orbits:
    """Search from few starts, without branches; tests/chaos/orbits tests what a search finds."""
    found = ph.orbits(
        ph.load(CRUDE),
        period=period,
        overlap=overlap,
        longest=longest,
        starts=starts,
        guesses=12,
        follow=0,
    )
    hammer = found.regime.hammer
    assert found.regime.memory == 1 or period > hammer.waveform.support
    return found


@pytest.fixture(scope="module")
def slow() -> Orbits:
    return found_at(1.3e-3, "add", 1, 50)


@pytest.fixture(scope="module")
def strange() -> Orbits:
    return found_at(1.05e-3, "add", 2, 50)


@pytest.fixture(scope="module")
def cut() -> Orbits:
    return found_at(0.6e-3, "replace", 2, 30)


def truth(orbit: Orbit, state: np.ndarray | None = None) -> ReferenceRun:
    """Integrate one period with the reference, from a section or from another state."""
    regime = orbit.regime
    assert orbit.phase == 0.0
    drive = ph.PulseTrain(
        regime.fired, period=regime.period, pulses=orbit.firings + 1, overlap=regime.overlap
    )
    start = orbit.section if state is None else state
    times = regime.period * np.arange(orbit.firings + 1)
    return reference(regime.hammer, drive, float(times[-1]), state=tuple(start), tolerance=TIGHT, times=times)


def check(orbit: Orbit) -> None:
    """The orbit closes in the reference, with the same states and contacts."""
    scales = orbit.regime.window.half_widths
    run = truth(orbit)
    assert run.status == "ok"
    growth = max(1.0, abs(orbit.multipliers[0]))
    wrong = np.abs(np.column_stack([run.x, run.v])[:-1] - np.column_stack([orbit.x, orbit.v])) / scales
    assert wrong.max() < 1e-8 * growth
    assert np.abs(np.array([run.x[-1], run.v[-1]]) - orbit.section)[0] / scales[0] < 1e-8 * growth
    assert np.abs(np.array([run.x[-1], run.v[-1]]) - orbit.section)[1] / scales[1] < 1e-8 * growth
    for surface, count in (("pack", orbit.pack_contacts), ("backstop", orbit.backstop_contacts)):
        theirs = [event.time for event in run.events if event.kind == f"{surface}-touch"]
        mine = [contact.t_in for contact in orbit.contacts if contact.surface == surface]
        assert len(theirs) == len(mine) == count
        np.testing.assert_allclose(mine, theirs, rtol=0.0, atol=1e-8 * growth * orbit.regime.period)


def differences(orbit: Orbit, step: float) -> np.ndarray:
    """Derivative of the state after a period with respect to the initial state, by central differences."""
    columns = []
    for spacing in step * orbit.regime.window.half_widths * np.eye(2):
        ends = [truth(orbit, orbit.section + sign * spacing) for sign in (1.0, -1.0)]
        states = [np.array([run.x[-1], run.v[-1]]) for run in ends]
        columns.append((states[0] - states[1]) / (2.0 * spacing.sum()))
    return np.column_stack(columns)


def check_multipliers(orbit: Orbit) -> None:
    """Richardson-extrapolated differences, relative to the larger multiplier."""
    matrix = (4.0 * differences(orbit, 1e-4) - differences(orbit, 2e-4)) / 3.0
    theirs = np.linalg.eigvals(matrix)
    theirs = theirs[np.argsort(-np.abs(theirs))]
    np.testing.assert_allclose(orbit.multipliers, theirs, rtol=0.0, atol=1e-6 * max(1.0, abs(theirs[0])))


@pytest.mark.slow
def test_stable_orbits_and_the_saddle_between_them(slow: Orbits) -> None:
    assert slow.counts == {"stable": 2, "saddle": 1}
    for orbit in slow:
        check(orbit)
        check_multipliers(orbit)


@pytest.mark.slow
def test_unstable_orbits_of_a_strange_train(strange: Orbits) -> None:
    assert {orbit.firings for orbit in strange} == {1, 2}
    for orbit in strange:
        assert orbit.kind == "saddle"
    # The reference takes seconds for each orbit.
    for orbit in [orbit for orbit in strange if abs(orbit.multipliers[0]) < 100.0][:3]:
        check(orbit)
    check_multipliers(min(strange, key=lambda orbit: abs(orbit.multipliers[0])))


@pytest.mark.slow
def test_orbits_of_a_fast_train(cut: Orbits) -> None:
    checked = [orbit for orbit in cut if orbit.phase == 0.0 and abs(orbit.multipliers[0]) < 100.0]
    assert len(checked) >= 2
    for orbit in checked[:3]:
        check(orbit)
    check_multipliers(checked[0])
