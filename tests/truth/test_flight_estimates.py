"""With a perfect sensor the estimate of a touch is the touch: of a parabola, and of the kernel."""

import numpy as np
import pytest
from tests import hammers

import printhammer as ph
from printhammer.control.flight import Expected, FreeForce, touch_from_samples


def estimated(
    hammer: ph.Hammer,
    times: np.ndarray,
    shown: np.ndarray,
    expected: tuple[float, float],
    drive: ph.PulseTrain,
) -> tuple[float, float]:
    assert hammer.front is not None
    force = FreeForce(hammer, hammer.origin, hammer.front, 2.0)
    touch, speed = touch_from_samples(
        times[np.newaxis, :],
        shown[np.newaxis, :],
        np.ones((1, len(times))),
        1e-9,
        Expected(np.array([expected[0]]), np.array([expected[1]]), 5e-6, 0.1),
        hammer.front,
        lambda x, t: force(x, drive.value(t)) / hammer.mass,
    )
    return float(touch[0]), float(speed[0])


def test_a_parabola() -> None:
    hammer = hammers.shelf(force=-4.0)
    touch, speed, pull = 3.1e-4, 0.9, 4.0 / hammer.mass
    times = np.arange(60) * 2e-6 + 1.4e-4
    late = times - touch
    shown = hammers.FRONT + speed * late - 0.5 * pull * late**2
    found = estimated(hammer, times, shown, (touch + 8e-6, speed + 0.05), hammers.idle())
    assert found[0] == pytest.approx(touch, abs=2e-8)
    assert found[1] == pytest.approx(speed, rel=2e-3)


def test_the_flight_of_a_hammer() -> None:
    hammer = hammers.crude()
    drive = ph.PulseTrain(hammer.waveform)
    motion = ph.simulate(hammer, drive, duration=1e-3)
    contact = next(one for one in motion.contacts if one.surface == "pack")
    times = contact.t_in - 50e-6 - np.arange(50)[::-1] * 2e-6
    shown = motion.at(times)[0]
    found = estimated(hammer, times, shown, (contact.t_in - 6e-6, 0.95 * contact.v_in), drive)
    assert found[0] == pytest.approx(contact.t_in, abs=1e-7)
    assert found[1] == pytest.approx(contact.v_in, rel=2e-3)


def test_noise_is_averaged_as_least_squares_do() -> None:
    hammer = hammers.shelf(force=-4.0)
    touch, speed, pull = 3.1e-4, 0.9, 4.0 / hammer.mass
    times = np.arange(60) * 2e-6 + 1.4e-4
    late = times - touch
    error = 1.5e-6
    random = np.random.default_rng(5)
    shown = hammers.FRONT + speed * late - 0.5 * pull * late**2 + error * random.normal(size=(400, 60))
    force = FreeForce(hammer, hammer.origin, hammers.FRONT, 2.0)
    touches, _speeds = touch_from_samples(
        np.broadcast_to(times, shown.shape),
        shown,
        np.ones(shown.shape),
        error,
        Expected(np.full(400, touch), np.full(400, speed), 1.0, 100.0),
        hammers.FRONT,
        lambda x, _t: force(x, np.zeros_like(x)) / hammer.mass,
    )
    # The variance of a straight line, carried on to the touch.
    beyond = touch - times.mean()
    spread = error * np.sqrt((1.0 + beyond**2 / times.var()) / 60.0) / speed
    assert touches.std() == pytest.approx(spread, rel=0.15)
    assert abs(touches.mean() - touch) < 4.0 * spread / np.sqrt(400.0) + 2e-8
