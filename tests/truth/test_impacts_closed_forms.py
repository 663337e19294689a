"""Sections with touches in closed form: a bouncing ball, and the linear impact oscillator."""

import math

import numpy as np
import pytest
from tests import hammers
from tests.hammers import MASS, STOP, interpreted, made_of
from tests.tangents import SHARP
from tests.truth import oracles

import printhammer as ph

CLOSE = 1e-9


@pytest.mark.parametrize("restitution", [0.5, 0.9])
def test_a_bouncing_ball(restitution: float) -> None:
    """Under a pull g every flight lasts 2 v/g, and every bounce multiplies the speed by e."""
    pull, speed, period, count = 1e4, 0.4, 0.05e-3, 8
    hammer = made_of(
        spring=hammers.preload(-pull * MASS), pack=hammers.power(), backstop=hammers.rigid(restitution)
    )
    with interpreted():
        found = ph.section(
            hammer,
            surface="backstop",
            period=period,
            waveform=hammers.idle().waveform,
            state=(STOP, speed),
            touches=count,
            tolerance=SHARP,
        )
    speeds = speed * restitution ** np.arange(count)
    times = np.cumsum(2.0 * speeds / pull)
    np.testing.assert_allclose(found.v, -speeds, rtol=CLOSE)
    np.testing.assert_allclose(found.v_out, restitution * speeds, rtol=CLOSE)
    np.testing.assert_allclose(found.t, times, rtol=CLOSE)
    np.testing.assert_array_equal(found.t_out, found.t)
    np.testing.assert_array_equal(found.firing, np.floor(times / period).astype(int) + 1)
    np.testing.assert_allclose(found.since, times % period, atol=CLOSE * times[-1])


def test_the_linear_impact_oscillator() -> None:
    mass, stiffness, frequency, count, skipped = 0.02, 3000.0, 95.0, 9, 3
    rate, phase, restitution = 2.0 * math.pi * frequency, 0.3, 0.7
    exact = oracles.Oscillator(mass, stiffness, 40.0, rate, phase, surface=-1e-3, restitution=restitution)
    # At the stop, 1 mm below its rest, the spring pushes with 3 N.
    hammer = made_of(
        mass,
        spring=hammers.preload(3.0, stiffness),
        pack=hammers.power(front=0.5),
        backstop=hammers.rigid(restitution, -1e-3),
    )
    _pieces, touches = exact.run(0.0, 0.0, 0.2)
    times, speeds = np.array(touches).T
    with interpreted():
        found = ph.section(
            hammer,
            drive=ph.SineForce(40.0, frequency, phase),
            state=(0.0, 0.0),
            touches=count,
            transient=skipped,
            tolerance=SHARP,
        )
    late = times >= skipped / frequency
    assert 0 < np.count_nonzero(~late) < len(times) - count
    np.testing.assert_allclose(found.t, times[late][:count], rtol=CLOSE)
    np.testing.assert_allclose(found.v, speeds[late][:count], rtol=1e-8)
    np.testing.assert_allclose(found.since, found.t % (1.0 / frequency), atol=1e-12)
    assert found.period == 1.0 / frequency
    assert found.remark == ""
