"""Closed forms through the compiled kernel at tolerance 1e-12, to 1e-9."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests import hammers
from tests.hammers import FRONT, MASS, STOP, THICKNESS
from tests.truth import oracles

import printhammer as ph

TIGHT = 1e-12
CLOSE = 1e-9


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log10(low), math.log10(high)).map(lambda power: 10.0**power)


def alone(mass: float, stiffness: float, damping: float = 0.0, pack: float = 259.0) -> ph.Hammer:
    """Pack and backstop, without a force between them."""
    return hammers.made_of(
        mass,
        spring=hammers.preload(0.0),
        pack=hammers.power(pack),
        backstop=hammers.hertz(stiffness, damping),
    )


@settings(max_examples=60)
@given(mass=decades(1e-6, 1.0), stiffness=decades(1e-1, 1e7), speed=decades(1e-3, 1e2))
def test_the_pack_alone(mass: float, stiffness: float, speed: float) -> None:
    exact = oracles.pack_rebound(mass, stiffness, THICKNESS, speed)
    duration = 1.1 * (1e-6 / speed + exact.loading_time + exact.unloading_time)
    motion = ph.simulate(
        alone(mass, 1e9, pack=stiffness),
        hammers.idle(),
        duration=duration,
        state=(FRONT - 1e-6, speed),
        tolerance=TIGHT,
    )
    assert motion.ok
    contact = motion.contacts[0]
    assert contact.surface == "pack"
    assert contact.t_out is not None
    assert -contact.v_out / contact.v_in == pytest.approx(math.sqrt(3.7 / 12.0), rel=CLOSE)
    turn = max(motion.maxima[0])
    assert turn - contact.t_in == pytest.approx(exact.loading_time, rel=CLOSE)
    assert contact.t_out - turn == pytest.approx(exact.unloading_time, rel=CLOSE)
    assert contact.depth == pytest.approx(exact.indentation, rel=CLOSE)
    lost = 0.5 * mass * (speed**2 - exact.speed_out**2)
    assert contact.loss == pytest.approx(lost, rel=CLOSE)
    assert motion.dots[0].loading_work == pytest.approx(0.5 * mass * speed**2, rel=CLOSE)


@settings(max_examples=60)
@given(mass=decades(1e-6, 1.0), stiffness=decades(1e5, 1e12), speed=decades(1e-2, 1e2), z=decades(1e-4, 1e2))
def test_the_backstop_alone(mass: float, stiffness: float, speed: float, z: float) -> None:
    """z = (l/k) v_in; the times from quadrature along the speed."""
    damping = z * stiffness / speed
    time_in, time_out = oracles.backstop_times(mass, stiffness, damping, speed)
    motion = ph.simulate(
        alone(mass, stiffness, damping),
        hammers.idle(),
        duration=1e-6 / speed + 1.01 * (time_in + time_out),
        state=(STOP + 1e-6, -speed),
        tolerance=TIGHT,
    )
    assert motion.ok
    # A deep contact leaves time to reach the pack afterwards.
    contact = motion.contacts[0]
    assert contact.t_out is not None
    assert contact.v_out / speed == pytest.approx(oracles.backstop_speed_ratio(z), rel=CLOSE)
    depth = oracles.backstop_indentation(mass, stiffness, damping, speed)
    assert contact.depth == pytest.approx(depth, rel=CLOSE)
    assert contact.t_out - contact.t_in == pytest.approx(time_in + time_out, rel=CLOSE)
    assert contact.loss == pytest.approx(0.5 * mass * (speed**2 - contact.v_out**2), rel=1e-8)


@settings(max_examples=40)
@given(mass=decades(1e-6, 1.0), stiffness=decades(1e5, 1e12), speed=decades(1e-3, 1e2))
def test_undamped_hertz_contact(mass: float, stiffness: float, speed: float) -> None:
    duration = oracles.hertz_duration(mass, stiffness, speed)
    motion = ph.simulate(
        alone(mass, stiffness),
        hammers.idle(),
        duration=1e-6 / speed + 1.01 * duration,
        state=(STOP + 1e-6, -speed),
        tolerance=TIGHT,
    )
    # A deep contact leaves time to reach the pack afterwards.
    contact = motion.contacts[0]
    assert contact.t_out is not None
    assert contact.v_out == pytest.approx(speed, rel=CLOSE)
    assert contact.t_out - contact.t_in == pytest.approx(duration, rel=CLOSE)
    assert duration == pytest.approx(2.9432 * contact.depth / speed, rel=1e-4)


def test_the_linear_impact_oscillator() -> None:
    mass, stiffness, frequency = 0.02, 3000.0, 95.0
    oscillator = oracles.Oscillator(
        mass, stiffness, 40.0, 2.0 * math.pi * frequency, 0.3, surface=-1e-3, restitution=0.7
    )
    pieces, touches = oscillator.run(0.0, 0.0, 0.2)
    hammer = hammers.made_of(
        mass,
        spring=hammers.preload(3.0, stiffness),
        pack=hammers.power(front=0.5),
        backstop=hammers.rigid(0.7, -1e-3),
    )
    times = np.linspace(0.0, 0.2, 401)
    motion = ph.simulate(
        hammer,
        ph.SineForce(40.0, frequency, 0.3),
        duration=0.2,
        state=(0.0, 0.0),
        times=times,
        tolerance=1e-14,
    )
    got = [(c.t_in, c.v_in) for c in motion.contacts]
    assert len(touches) > 8
    np.testing.assert_allclose(got, touches, rtol=CLOSE)
    exact = np.array([oracles.piece_at(pieces, t) for t in times])
    np.testing.assert_allclose(motion.x, exact[:, 0], rtol=0.0, atol=1e-9 * np.ptp(exact[:, 0]))


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.6, 0.9, 0.99])
def test_all_bounces_of_a_ball_in_finite_time(restitution: float) -> None:
    """Infinitely many bounces, then rest: times and speeds are geometric series."""
    pull, speed = 1e4, 1.0
    hammer = hammers.made_of(
        spring=hammers.preload(-pull * MASS), pack=hammers.power(), backstop=hammers.rigid(restitution)
    )
    end = oracles.bouncing_end(restitution, pull, speed)
    motion = ph.simulate(hammer, hammers.idle(), duration=end + 1e-3, state=(STOP, -speed), tolerance=TIGHT)
    assert motion.ok
    bounces = [c for c in motion.contacts if not c.initial]
    for n, bounce in enumerate(bounces[:60]):
        before = 2.0 * speed / pull * sum(restitution**k for k in range(1, n + 1))
        assert bounce.t_in == pytest.approx(before, rel=CLOSE, abs=1e-15)
        assert bounce.v_in == pytest.approx(-speed * restitution**n, rel=CLOSE, abs=1e-10)
    assert bounces[-1].t_out is None
    # The bounces left out are lower than 1e-12 of the stroke.
    left_out = math.sqrt(8.0 * 1e-12 * (FRONT - STOP) / pull) / max(1.0 - restitution, 1e-9)
    assert -1e-12 <= end - bounces[-1].t_in <= left_out
    x, v = motion.at(motion.end)
    assert (x[0], v[0]) == (STOP, 0.0)
    assert motion.energy.backstop_loss == pytest.approx(0.5 * MASS * speed**2, rel=1e-9)


@pytest.mark.parametrize(
    ("force", "speed"), [(2.0, 1.5), (2.0, 1.25), (12.0, 4.3), (40.0, 1.5), (130.0, 1.5)]
)
def test_the_pack_under_a_constant_force(force: float, speed: float) -> None:
    exact, speed_out = oracles.pack_under_force(MASS, 259.0, THICKNESS, force, speed, 8)
    motion = ph.simulate(
        hammers.shelf(force), hammers.idle(), duration=2e-3, state=(FRONT, speed), tolerance=TIGHT
    )
    tops = [u for kind, u in exact if kind == "peak"]
    troughs = [u for kind, u in exact if kind == "trough"]
    # A trough that is at once a new maximum is no local maximum of the motion.
    real = [u for u in tops if u not in troughs]
    _times, heights = motion.maxima
    inside = heights[heights > FRONT] - FRONT
    np.testing.assert_allclose(inside[: len(real)], real, rtol=CLOSE)
    contact = next(c for c in motion.contacts if c.surface == "pack")
    if speed_out is None:
        assert contact.depth == pytest.approx(max(tops), rel=CLOSE)
    else:
        assert contact.v_out == pytest.approx(-speed_out, rel=CLOSE)
