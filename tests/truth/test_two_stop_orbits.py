"""Periodic motions of the shipped oscillators between two stops, against closed forms."""

import math

import numpy as np
import pytest
from tests.oracle.two_stops import TwoStops

import printhammer as ph
from printhammer.chaos import orbit
from printhammer.run.motion import Motion
from printhammer.run.regime import Regime

CASES = [
    ("impact-pair", TwoStops(0.0, 0.0, 0.5, 1.0, 0.5)),
    ("shaw-1985", TwoStops(1.0, 0.1, 1.5, 1.5, 0.8)),
    ("shaw-1985", TwoStops(1.0, 0.1, 4.0, 2.6, 0.8)),
]


def run(name: str, exact: TwoStops, amplitude: float, phase: float, speed: float, cycles: float) -> Motion:
    """Simulate from an impact at the lower stop, at a phase of the force."""
    drive = ph.SineForce(amplitude, exact.rate / (2.0 * math.pi), phase=phase + 0.5 * math.pi)
    duration = cycles * 2.0 * math.pi / exact.rate
    return ph.simulate(ph.load(name), drive, duration=duration, state=(-1.0, speed), tolerance=1e-13)


def stable(exact: TwoStops) -> tuple[float, float]:
    """Return phase and speed of the orbit with the smaller multipliers."""
    return min(exact.orbits(), key=lambda each: float(np.abs(exact.multipliers(*each)).max()))


@pytest.mark.parametrize(("name", "exact"), CASES)
def test_symmetric_orbits_repeat(name: str, exact: TwoStops) -> None:
    """Impacts alternate every half period; the drive replaces the energy lost in impacts and damping."""
    phase, speed = stable(exact)
    motion = run(name, exact, exact.amplitude, phase, speed, 5.25)
    assert [each.surface for each in motion.contacts] == ["pack", "backstop"] * 5
    times = np.array([each.t_in for each in motion.contacts])
    np.testing.assert_allclose(times, math.pi / exact.rate * np.arange(1, 11), rtol=1e-11)
    speeds = np.array([abs(each.v_out) for each in motion.contacts])
    np.testing.assert_allclose(speeds, speed, rtol=1e-11)
    loss = 0.5 * (speed / exact.restitution) ** 2 * (1.0 - exact.restitution**2)
    assert motion.energy.pack_loss == pytest.approx(5.0 * loss, rel=1e-10)
    assert motion.energy.backstop_loss == pytest.approx(5.0 * loss, rel=1e-10)
    assert abs(motion.energy.residual) < 1e-10 * motion.energy.throughput


@pytest.mark.parametrize(("name", "exact"), CASES)
def test_multipliers_of_symmetric_orbits(name: str, exact: TwoStops) -> None:
    """The multipliers over a period are the squares of those over half a period."""
    phase, speed = stable(exact)
    quarter = 0.5 * math.pi / exact.rate
    x, v = run(name, exact, exact.amplitude, phase, speed, 0.3).state_at(quarter)[:2]
    drive = ph.SineForce(exact.amplitude, exact.rate / (2.0 * math.pi), phase="90 deg")
    section = (phase + 0.5 * math.pi) / (2.0 * math.pi) % 1.0
    regime = Regime.of(ph.load(name), drive=drive, phase=section)
    found = orbit(regime, (x + 1e-4, v - 1e-4))
    assert found.ok
    np.testing.assert_allclose(found.section, (x, v), rtol=0.0, atol=1e-9)
    half = exact.half_cycle(phase, speed)
    assert found.multipliers.sum().real == pytest.approx(np.trace(half @ half), abs=1e-8)
    assert found.multipliers.prod().real == pytest.approx(np.linalg.det(half) ** 2, abs=1e-8)


@pytest.mark.parametrize(("name", "exact"), CASES)
def test_beyond_the_pitchfork_the_times_between_impacts_differ(name: str, exact: TwoStops) -> None:
    """5 % below the critical amplitude the flight times become equal, 5 % above they do not."""
    uneven = []
    for factor in (0.95, 1.05):
        amplitude = factor * exact.pitchfork
        near = TwoStops(exact.stiffness, exact.damping, amplitude, exact.rate, exact.restitution)
        phase, speed = stable(near)
        motion = run(name, exact, amplitude, phase, 1.001 * speed, 150.25)
        times = np.array([each.t_in for each in motion.contacts])[-3:]
        assert times[2] - times[0] == pytest.approx(2.0 * math.pi / exact.rate, abs=1e-6)
        uneven.append(abs(times[2] - 2.0 * times[1] + times[0]) * exact.rate)
    assert uneven[0] < 1e-6
    assert uneven[1] > 0.1


def test_the_symmetry_is_lost_at_a_pitchfork() -> None:
    """The branch of symmetric orbits crosses a branch that turns back in the amplitude."""
    exact = CASES[0][1]
    amplitude = exact.pitchfork
    drive = ph.SineForce(0.995 * amplitude, 0.5 / math.pi, phase="90 deg")
    branch = ph.continuation(
        ph.load("impact-pair"),
        "drive.amplitude",
        (0.98 * amplitude, 1.01 * amplitude),
        drive=drive,
        state=(-0.35599, 0.39041),
        phase=0.827,
    )
    assert branch.symmetry == "symmetric"
    (event,) = branch.events
    assert event.kind == "pitchfork"
    assert event.value == pytest.approx(amplitude, rel=1e-9)
    assert branch.crossing(event, most=12).symmetry == "asymmetric"
