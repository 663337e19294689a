"""Settling and wear against bounces with a closed form."""

import math

import pytest
from scipy.optimize import brentq
from tests.hammers import MASS, STOP, hertz, interpreted, made_of, preload, rigid

import printhammer as ph
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.printing.dots.settling import SETTLED, settle, wear_of

PUSH = 12.0
WIDTH = 150e-6


@pytest.mark.parametrize(("restitution", "weight"), [(0.6, 4.0), (0.3, 7.0)])
def test_bounces_under_a_constant_force(restitution: float, weight: float) -> None:
    """Thrown up by a rectangular force, the mass falls back and bounces: heights fall as e^2n."""
    hammer = made_of(spring=preload(-weight), backstop=rigid(restitution))
    kick = Rectangle(amplitude=PUSH, width=WIDTH, rise=0.0, decay=0.0, quantity="force")
    found = settle(hammer, kick)

    up, down = (PUSH - weight) / MASS, weight / MASS
    thrown = up * WIDTH
    height = 0.5 * up * WIDTH**2 + thrown**2 / (2.0 * down)
    landing = WIDTH + thrown / down + math.sqrt(2.0 * height / down)
    speed = math.sqrt(2.0 * down * height)
    bounces = [n for n in range(1, 50) if restitution ** (2 * n) > SETTLED]
    assert found.rebounds == len(bounces)
    assert found.highest == pytest.approx(restitution**2, rel=1e-9)
    assert found.restitution == pytest.approx(restitution, rel=1e-12)
    whole = sum(2.0 * restitution**n * speed / down for n in bounces[:-1])
    last = restitution ** bounces[-1]
    drop = height * (last**2 - SETTLED)
    end = landing + whole + last * speed / down + math.sqrt(2.0 * drop / down)
    assert found.settle_out == pytest.approx(end, rel=1e-9)
    assert found.wear.largest_speed == pytest.approx(speed, rel=1e-9)
    assert found.wear.largest_force is None
    # From rest to rest all that the force gave is lost at the backstop.
    assert found.wear.loss == pytest.approx(PUSH * 0.5 * up * WIDTH**2, rel=1e-6)
    # A geometric series: each touch turns m v (1 + e), and v falls by e from touch to touch.
    assert found.wear.impulse == pytest.approx(
        MASS * speed * (1.0 + restitution) / (1.0 - restitution), rel=1e-3
    )


@pytest.mark.parametrize("damping", [1e8, 4.175e8, 2e9])
def test_one_touch_of_a_damped_backstop(damping: float) -> None:
    """A free contact obeys z - ln(1 + z) = -(y + ln(1 - y)), z = (l/k) v_in and y = (l/k) v_out."""
    stiffness, v_in = 1.156e9, 0.8
    hammer = made_of(backstop=hertz(stiffness, damping))
    idle = ph.PulseTrain(Rectangle(amplitude=0.0, width=1e-6, rise=0.0, decay=0.0, quantity="force"))
    with interpreted():
        motion = ph.simulate(hammer, idle, duration=1e-3, state=(STOP + 20e-6, -v_in))
        wear = wear_of(motion)
    z = damping / stiffness * v_in
    y = brentq(lambda y: z - math.log1p(z) + y + math.log1p(-y), 1e-12, min(z, 1.0 - 1e-12), xtol=1e-15)
    v_out = y * stiffness / damping
    assert wear.touches == 1
    assert wear.impulse == pytest.approx(MASS * (v_in + v_out), rel=1e-8)
    assert wear.loss == pytest.approx(0.5 * MASS * (v_in**2 - v_out**2), rel=1e-8)
    assert wear.largest_speed == pytest.approx(v_in, rel=1e-12)
