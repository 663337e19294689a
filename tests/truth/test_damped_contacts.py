"""List contacts with damping: the closed form of Hunt and Crossley, tangent maps and free flight."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from tests.tangents import deviation

import printhammer as ph

MASS = 1e-3


def struck(law: str, sign: float, stiffness: float, damping: float, speed: float) -> ph.Motion:
    """Run a free mass that strikes a damped contact 0.1 mm away."""
    waveform = {"shape": "half-sine", "amplitude": "1e-9 N", "width": 1e-6}
    contact = {
        "law": law,
        "side": "front" if sign > 0.0 else "back",
        "position": sign * 1e-4,
        "stiffness": stiffness,
        "damping": damping,
    }
    hammer = ph.Hammer.build(MASS, waveform=waveform).replace("contact.wall", contact)
    drive = ph.PulseTrain(hammer.waveform, period=1e-2, pulses=1)
    return ph.simulate(hammer, drive, duration=1e-2, state=(0.0, sign * speed), tolerance=1e-12)


@pytest.mark.parametrize("law", ["linear", "hertz"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rebound_and_indentation_of_a_free_mass(law: str, sign: float) -> None:
    """Speed after impact and largest indentation follow from the first integral of the motion in contact."""
    rng = np.random.default_rng(1975)
    power = 1.5 if law == "hertz" else 1.0
    for _ in range(4):
        damping, speed = float(rng.uniform(0.05, 1.5)), float(rng.uniform(0.2, 2.0))
        stiffness = float(10.0 ** rng.uniform(4.0, 5.0)) * (100.0 if law == "hertz" else 1.0)
        motion = struck(law, sign, stiffness, damping, speed)
        (closing,) = motion.closings
        before = damping * abs(closing.v_in)
        left = before - math.log1p(before)
        after = brentq(lambda v, left=left: v + math.log1p(-v) + left, 0.0, 1.0 - 1e-12, xtol=1e-15)
        assert closing.v_out == pytest.approx(-sign * after / damping, rel=1e-10)
        indented = (power + 1.0) * MASS / stiffness * left / damping**2
        assert closing.depth == pytest.approx(indented ** (1.0 / (power + 1.0)), rel=1e-10)
        lost = 0.5 * MASS * (closing.v_in**2 - (closing.v_out or 0.0) ** 2)
        assert closing.loss == pytest.approx(lost, rel=1e-9)
        assert motion.energy.damping_loss == pytest.approx(lost, rel=1e-9)
        assert abs(motion.energy.residual) < 1e-9 * lost
        x, v = motion.at(np.linspace(closing.t_in, closing.t_out or 0.0, 20001))
        force = stiffness * np.maximum(sign * x - 1e-4, 0.0) ** power * (1.0 + damping * sign * v)
        assert closing.peak_force == pytest.approx(force.max(), rel=1e-7)
        assert closing.peak_force >= force.max() * (1.0 - 1e-12)


def test_a_contact_that_opens_faster_than_its_force_grows_back_never_pulls() -> None:
    """A pull of 5 N tears the armature from a contact whose law would give a negative force."""
    contact = {"law": "linear", "side": "front", "position": 0.0, "stiffness": 1e3, "damping": 5.0}
    hammer = ph.Hammer.build(MASS).replace("contact.wall", contact)
    hammer = hammer.replace("force.pull", {"law": "constant", "force": -5.0})
    drive = ph.SineForce(1e-9, 1.0)
    motion = ph.simulate(hammer, drive, duration=2e-3, state=(1e-3, -1.0), tolerance=1e-12)
    (closing,) = motion.closings
    # Faster than 1/chi = 0.2 m/s the force is zero, and the motion is free fall under the pull.
    fall = 0.5 * -5.0 / MASS
    t = (1.0 - math.sqrt(1.0 - 4.0 * fall * 1e-3)) / (2.0 * fall)
    assert closing.t_out == pytest.approx(t, rel=1e-9)
    assert closing.v_out == pytest.approx(-1.0 + 2.0 * fall * t, rel=1e-9)
    assert closing.loss == pytest.approx(0.5 * 1e3 * 1e-6, rel=1e-7)


@pytest.mark.parametrize(("law", "within"), [("linear", 1e-6), ("hertz", 2e-5)])
def test_tangent_maps_through_damped_contacts(law: str, within: float) -> None:
    """An armature between a damped contact and a rigid backstop, in front of which another contact closes.

    The columns use the steps of the run, which are less accurate at the touch of a Hertz contact, whether or
    not the contact is damped.
    """
    rng = np.random.default_rng(440)
    closings = 0
    for k in range(8):
        far = {"law": law, "side": "front", "position": 3e-4, "stiffness": 3e4 if law == "linear" else 3e6}
        near = {"law": "linear", "side": "back", "position": 5e-5, "stiffness": 1e3, "damping": 0.6}
        hammer = ph.Hammer.build(MASS, backstop={"law": "rigid", "position": 0.0, "restitution": 0.6})
        hammer = hammer.replace({"contact.far": {**far, "damping": 0.4}, "contact.near": near})
        hammer = hammer.replace("damping", {"law": "viscous", "coefficient": 0.05 * (k % 2)})
        drive = ph.SineForce(float(rng.uniform(0.2, 0.8)), float(rng.uniform(50.0, 200.0)))
        state, end = (1e-4, float(rng.uniform(0.2, 0.6))), float(rng.uniform(5e-3, 1.2e-2))
        closings += len(ph.simulate(hammer, drive, duration=end, state=state).closings)
        assert deviation(hammer, drive, 0.0, end, state=state, size=3e-5) < within
    assert closings > 25
