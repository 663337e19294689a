"""The work of the coil against integrals in closed form and against a sum over a dense output."""

import math

import numpy as np
import pytest
from tests import hammers

import printhammer as ph
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Sampled, Waveform
from printhammer.run.energy import coil_power, squared_current


def burst() -> ph.PulseTrain:
    waveform = Rectangle(amplitude=2.0, width=350e-6, rise=30e-6, decay=25e-6)
    return ph.PulseTrain(waveform, at=[0.0, 0.55e-3, 1.6e-3, 2.1e-3])


def test_net_work_is_that_of_the_ledger() -> None:
    motion = ph.simulate(hammers.crude(), burst())
    assert motion.ok
    assert motion.coil_work.net == pytest.approx(motion.energy.coil_work, rel=1e-13)


def test_positive_work_is_the_integral_of_the_positive_power() -> None:
    motion = ph.simulate(hammers.crude(), burst(), points=400_001)
    power = coil_power(motion.hammer, motion.x, motion.v, motion.force["magnet"])
    plain = np.trapezoid(np.maximum(power, 0.0), motion.t)
    work = motion.coil_work
    assert work.given_back > 1e-2 * work.positive  # or nothing would be tested
    assert work.positive == pytest.approx(plain, rel=1e-6)
    assert work.given_back == pytest.approx(np.trapezoid(np.maximum(-power, 0.0), motion.t), rel=1e-5)


def test_an_armature_that_only_returns_takes_no_positive_work() -> None:
    hammer = hammers.crude()
    assert hammer.front is not None
    hold = ph.PulseTrain(Sampled.from_samples([0.0, 1e-4], [0.3, 0.3], interpolation="linear"))
    # Thrown back from the front, and not yet at the backstop after a tenth of a millisecond.
    motion = ph.simulate(hammer, hold, state=(hammer.front, -0.5), duration=1e-4)
    assert (motion.v < 0.0).all()
    assert motion.coil_work.positive == 0.0
    assert motion.coil_work.net < 0.0


@pytest.mark.parametrize(
    ("waveform", "expected"),
    [
        (HalfSine(amplitude=1.5, width=3e-4), 0.5 * 1.5**2 * 3e-4),
        # Decay after a sharp edge up: I^2 width, and half a decay constant of it.
        (Rectangle(amplitude=2.0, width=1e-4, rise=0.0, decay=2e-5), 4.0 * (1e-4 + 1e-5)),
        (Sampled.from_samples([0.0, 2e-4], [0.0, 3.0], interpolation="linear"), 9.0 * 2e-4 / 3.0),
    ],
)
def test_squared_current_in_closed_form(waveform: Waveform, expected: float) -> None:
    drive = ph.PulseTrain(waveform, at=[0.0, 5e-3])
    assert squared_current(drive, 0.0, 10e-3) == pytest.approx(2.0 * expected, rel=1e-11)
    assert squared_current(drive, 0.0, 4e-3) == pytest.approx(expected, rel=1e-11)


def test_heat_needs_a_resistance() -> None:
    waveform = HalfSine(amplitude=1.5, width=3e-4)
    cold = ph.simulate(hammers.crude(), ph.PulseTrain(waveform))
    warm = ph.simulate(hammers.crude().replace("coil.resistance", "4 ohm"), ph.PulseTrain(waveform))
    assert cold.coil_work.heat is None
    assert warm.coil_work.heat == pytest.approx(4.0 * 0.5 * 1.5**2 * 3e-4, rel=1e-11)


def test_a_force_does_no_work_on_the_coil() -> None:
    motion = ph.simulate(hammers.shelf(), hammers.block(8.0, 2e-4))
    assert motion.coil_work.net == motion.coil_work.positive == 0.0
    assert math.isclose(motion.coil_work.squared_current, 0.0)
