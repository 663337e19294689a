"""Periodic motions of the oracle for lists under friction and between two stops, against closed forms."""

import math

import numpy as np
import pytest
from tests.oracle.den_hartog import DenHartog
from tests.oracle.list_laws import Damping, Drive, Friction, Piece, Spring, Stop, System
from tests.oracle.list_steps import Run
from tests.oracle.lists import simulate
from tests.oracle.two_stops import TwoStops

CLOSE = 1e-11


def kinds(run: Run) -> list[tuple[str, str]]:
    return [(event.kind, event.name) for event in run.events]


class DenHartogRun(DenHartog):
    """The motion without stops, computed by the oracle."""

    def run(self, a: float, static: float, cycles: float) -> tuple[Run, float, float]:
        x0, phase = self.motion(a)
        piece = Piece(0.0, math.inf, amplitude=a, rate=self.beta, phase=phase + 0.5 * math.pi)
        friction = Friction(self.f, static)
        system = System(1.0, (Spring(1.0),), (Drive((piece,)),), (friction,), length=1.0)
        return simulate(system, x0, 0.0, cycles * 2.0 * math.pi / self.beta), x0, phase


@pytest.mark.parametrize("beta", [0.42, 0.7, 1.4, 2.5])
def test_den_hartog_motion(beta: float) -> None:
    exact = DenHartogRun(beta, 0.3)
    a = 1.1 * exact.boundary
    run, x0, phase = exact.run(a, 0.3, 5.0)
    assert run.events == []
    t = np.linspace(0.0, math.pi / beta, 9)
    t_late = t + 4.0 * 2.0 * math.pi / beta
    wave = 0.3 * (1.0 - np.cos(t) - beta * exact.big_u * np.sin(t)) + a * exact.big_v * np.cos(
        beta * t + phase
    )
    np.testing.assert_allclose(run.at(t)[0], wave, atol=CLOSE * x0)
    np.testing.assert_allclose(run.at(t_late)[0], wave, atol=10.0 * CLOSE * x0)
    assert run.work["friction"] == pytest.approx(-0.3 * 5.0 * 4.0 * x0, rel=CLOSE)
    assert run.work["drive"] == pytest.approx(0.3 * 5.0 * 4.0 * x0, rel=10.0 * CLOSE)


@pytest.mark.parametrize("beta", [0.38, 0.42, 0.7, 1.4, 2.5])
def test_den_hartog_boundary_of_motion_without_stops(beta: float) -> None:
    exact = DenHartogRun(beta, 0.3)
    free, _x0, _phase = exact.run(exact.boundary * (1.0 + 1e-8), 0.3, 3.0)
    assert free.events == []
    stopped, _x0, _phase = exact.run(exact.boundary * (1.0 - 1e-8), 0.3, 1.0)
    assert stopped.times("stick")
    assert exact.big_s > 1.01 if beta < 0.5 else exact.big_s < 1.0 + 1e-12


@pytest.mark.parametrize("beta", [0.7, 1.4])
def test_a_larger_static_force_moves_the_boundary(beta: float) -> None:
    """At a turn the other forces are x0 β²; they must exceed the static force (Shaw 1986)."""
    exact, static = DenHartogRun(beta, 0.3), 0.45
    boundary = math.hypot(static / beta**2, 0.3 * exact.big_u) / abs(exact.big_v)
    assert exact.run(boundary * (1.0 + 1e-9), static, 3.0)[0].events == []
    assert exact.run(boundary * (1.0 - 1e-9), static, 0.1)[0].events[0].kind == "stick"


PAIRS = [
    TwoStops(0.0, 0.0, 9.0, 2.0, 0.6),
    TwoStops(0.0, 0.0, 2.0, 2.0, 0.6),
    TwoStops(0.0, 0.3, 9.0, 2.0, 0.6),
    TwoStops(1.0, 0.0, 6.0, 2.2, 0.5),
    TwoStops(1.0, 0.2, 5.0, 1.7, 0.8),
]
"""The orbit of the second is stable."""


def pair_run(pair: TwoStops, phase: float, speed: float, cycles: float) -> Run:
    piece = Piece(0.0, math.inf, amplitude=pair.amplitude, rate=pair.rate, phase=phase + 0.5 * math.pi)
    stops = (Stop("left", "back", -1.0, pair.restitution), Stop("right", "front", 1.0, pair.restitution))
    forces = (Spring(pair.stiffness), Damping(pair.damping))
    system = System(1.0, forces, (Drive((piece,)),), stops=stops, length=1.0)
    return simulate(system, -1.0, speed, (cycles + 0.1) * 2.0 * math.pi / pair.rate)


@pytest.mark.parametrize("pair", PAIRS)
def test_symmetric_orbit_between_two_stops(pair: TwoStops) -> None:
    """Impacts occur every half cycle; a small change of the start grows by the derivative of the map."""
    half, restitution = math.pi / pair.rate, pair.restitution
    orbits = [orbit for orbit in pair.orbits() if kinds(pair_run(pair, *orbit, 1.0))[0][1] == "right"]
    assert orbits
    for phase, speed in orbits:
        run = pair_run(pair, phase, speed, 2.0)
        assert kinds(run) == [("impact", "right"), ("impact", "left")] * 2
        times = np.array([event.time for event in run.events])
        np.testing.assert_allclose(times, half * np.arange(1, 5), rtol=CLOSE)
        assert run.events[-1].v == pytest.approx(speed, rel=CLOSE)
        hit = 0.5 * (speed / restitution) ** 2 * (1.0 - restitution**2)
        assert run.lost["left"] == pytest.approx(2.0 * hit, rel=CLOSE)
        assert run.lost["right"] == pytest.approx(2.0 * hit, rel=CLOSE)
        _x, last = run.at([run.steps[-1].end])
        gained = 0.5 * (float(last[0]) ** 2 - speed**2)
        assert sum(run.work.values()) - 4.0 * hit == pytest.approx(gained, abs=CLOSE * 4.0 * hit)

        tangent = pair.half_cycle(phase, speed)
        # After four impacts the change is about 1e-4 at most; times and speeds are exact to some 1e-14.
        step = min(1e-5, 1e-4 / float(np.abs(np.linalg.eigvals(tangent)).max()) ** 4)
        moved = pair_run(pair, phase, speed + step, 2.0)
        back = pair_run(pair, phase, speed - step, 2.0)
        change = np.array([0.0, 2.0 * step])
        for plus, minus, sign in zip(moved.events, back.events, [-1.0, 1.0] * 2, strict=True):
            change = tangent @ change
            found = [plus.time - minus.time, sign * (plus.v - minus.v)]
            np.testing.assert_allclose(found, change, rtol=1e-7, atol=1e-7 * float(np.abs(change).max()))


def test_symmetric_orbit_of_an_impact_pair() -> None:
    """x'' = A cos(w t + φ): integrating twice over half a cycle gives cos φ - κ sin φ = d w²/2A.

    κ = (π/2) (1 + e)/(1 - e), v = -2 e A sin φ/(w (1 - e)), d the play.
    """
    amplitude, rate, restitution = PAIRS[0].amplitude, PAIRS[0].rate, PAIRS[0].restitution
    kappa = 0.5 * math.pi * (1.0 + restitution) / (1.0 - restitution)
    turn = math.acos(2.0 * rate**2 / (2.0 * amplitude) / math.hypot(1.0, kappa))
    expected = []
    for sign in (1.0, -1.0):
        phase = sign * turn - math.atan(kappa)
        expected.append(
            (phase, -2.0 * restitution * amplitude * math.sin(phase) / (rate * (1.0 - restitution)))
        )
    positive = sorted((phase % (2.0 * math.pi), speed) for phase, speed in expected if speed > 0.0)
    found = sorted((phase % (2.0 * math.pi), speed) for phase, speed in PAIRS[0].orbits())
    np.testing.assert_allclose(found, positive, rtol=1e-13)


@pytest.mark.parametrize("restitution", [0.3, 0.6])
def test_bounds_of_stable_symmetric_orbits_of_an_impact_pair(restitution: float) -> None:
    """The half-cycle map has determinant e² and trace 2e + (1 + e) q, q = -(π/2) (1 - e) cot φ.

    Its multiplier is -1 (two unsymmetric orbits are born) at q = -(1 + e), that is cot φ = 4 κ/π², and 1 (the
    orbit ends) at cot φ = -1/κ; with D = d w²/2A = cos φ - κ sin φ these are the bounds of D below.
    """
    e, rate = restitution, 2.0
    kappa = 0.5 * math.pi * (1.0 + e) / (1.0 - e)
    c = 4.0 * kappa / math.pi**2
    bounds = (kappa - c) / math.hypot(1.0, c), math.hypot(1.0, kappa)

    def pair(ratio: float) -> TwoStops:
        return TwoStops(0.0, 0.0, rate**2 / ratio, rate, e)

    def radii(ratio: float) -> list[float]:
        maps = [pair(ratio).half_cycle(*orbit) for orbit in pair(ratio).orbits()]
        assert [float(np.linalg.det(m)) for m in maps] == pytest.approx([e**2] * len(maps), rel=1e-10)
        return sorted(float(np.abs(np.linalg.eigvals(m)).max()) for m in maps)

    assert radii(bounds[0] * (1.0 + 1e-6))[0] < 1.0 < radii(bounds[0] * (1.0 - 1e-6))[0]
    assert radii(bounds[1] * (1.0 - 1e-6))[0] < 1.0
    assert pair(bounds[1] * (1.0 + 1e-6)).orbits() == []

    uneven = []
    for ratio in (1.2 * bounds[0], 0.9 * bounds[0]):
        phase, speed = min(
            pair(ratio).orbits(),
            key=lambda orbit: float(np.abs(pair(ratio).multipliers(*orbit)).max()),
        )
        times = [event.time for event in pair_run(pair(ratio), phase, speed + 1e-3, 50.0).events]
        uneven.append(abs(times[-1] - 2.0 * times[-2] + times[-3]))
        assert times[-1] - times[-3] == pytest.approx(2.0 * math.pi / rate, abs=1e-4)
    assert uneven[0] < 1e-6
    assert uneven[1] > 1e-2


@pytest.mark.parametrize("beta", [0.42, 0.7, 1.4])
def test_multipliers_of_den_hartog_motion(beta: float) -> None:
    """The map from turn to turn has determinant d = (x0 β² - f)/(x0 β² + f) and trace -(1 + d) cos(π/β).

    A change (dx, dt) at a turn is dx, -a dt of the motion, a its acceleration just after the turn; after half
    a cycle a velocity dv moves the next turn by -dv/a. So |λ|² = d < 1: stable, marginal only where β = 1/n
    (Shaw, J. Sound Vib. 108 (1986) 305; Csernák, Stépán & Shaw, Nonlinear Dyn. 50 (2007) 93).
    """
    exact = DenHartogRun(beta, 0.3)
    a = 1.3 * exact.boundary
    run, x0, _phase = exact.run(a, 0.3, 2.0)
    d = (x0 * beta**2 - 0.3) / (x0 * beta**2 + 0.3)
    trace = -(1.0 + d) * math.cos(math.pi / beta)
    start, cycle, step = 0.4 * math.pi / beta, 2.0 * math.pi / beta, 1e-5
    x, v = run.at([start])
    columns = []
    for change in ((step, 0.0), (0.0, step)):
        ends = [
            np.array(
                simulate(run.system, x[0] + s * change[0], v[0] + s * change[1], start + cycle, start).at(
                    [start + cycle]
                )
            )
            for s in (1.0, -1.0)
        ]
        columns.append((ends[0] - ends[1])[:, 0] / (2.0 * step))
    monodromy = np.array(columns).T
    assert np.linalg.det(monodromy) == pytest.approx(d**2, rel=1e-7)
    assert np.trace(monodromy) == pytest.approx(trace**2 - 2.0 * d, abs=1e-7)
