"""With a perfect sensor, the estimated touch is exact: for a parabola, and for the kernel."""

import numpy as np
import pytest
from tests import hammers

import printhammer as ph
from printhammer.control.feedback.flight import Expected, Flight, FreeForce, flight_from_samples
from printhammer.control.feedback.sensor import Samples


def expected(touch: float, speed: float, errors: tuple[float, float, float], count: int = 1) -> Expected:
    covariance = np.broadcast_to(np.diag(errors) ** 2, (count, 3, 3))
    return Expected(np.full(count, touch), np.full(count, speed), np.zeros(count), covariance)


def estimated(
    hammer: ph.Hammer,
    times: np.ndarray,
    shown: np.ndarray,
    before: Expected,
    drive: ph.PulseTrain,
    real: float = 1.0,
) -> Flight:
    assert hammer.front is not None
    force = FreeForce(hammer, hammer.origin, hammer.front, 2.5)

    def accelerations(x: np.ndarray, t: np.ndarray, scale: np.ndarray) -> np.ndarray:
        return force(x, (1.0 + scale) * real * drive.value(t)) / hammer.mass

    samples = Samples(times[np.newaxis], shown[np.newaxis], np.ones((1, len(times)), np.bool_), 1e-9)
    return flight_from_samples(samples, before, np.array([hammer.front]), accelerations)


def test_a_parabola() -> None:
    hammer = hammers.shelf(force=-4.0)
    touch, speed, pull = 3.1e-4, 0.9, 4.0 / hammer.mass
    times = np.arange(60) * 2e-6 + 1.4e-4
    late = times - touch
    shown = hammers.FRONT + speed * late - 0.5 * pull * late**2
    before = expected(touch + 8e-6, speed + 0.05, (5e-6, 0.1, 1e-3))
    found = estimated(hammer, times, shown, before, hammers.idle())
    assert found.touch[0] == pytest.approx(touch, abs=2e-8)
    assert found.speed[0] == pytest.approx(speed, rel=2e-3)
    state, covariance = found.at(np.array([touch - 30e-6]), lambda x, _t, _s: np.full_like(x, -pull))
    assert state[0, 0] == pytest.approx(hammers.FRONT - 30e-6 * speed - 0.5 * pull * 30e-6**2, abs=1e-8)
    assert state[0, 1] == pytest.approx(speed + 30e-6 * pull, rel=2e-3)
    # Where it was is as uncertain as a straight line carried on.
    way = float(found.reference[0]) - (touch - 30e-6)
    own = found.covariance[0]
    line = own[0, 0] - 2.0 * way * own[0, 1] + way**2 * own[1, 1]
    assert covariance[0, 0, 0] == pytest.approx(line, rel=1e-6)


def test_the_flight_of_a_hammer() -> None:
    hammer = hammers.crude()
    drive = ph.PulseTrain(hammer.waveform)
    motion = ph.simulate(hammer, drive, duration=1e-3)
    contact = next(one for one in motion.contacts if one.surface == "pack")
    times = contact.t_in - 50e-6 - np.arange(50)[::-1] * 2e-6
    shown = motion.at(times)[0]
    before = expected(contact.t_in - 6e-6, 0.95 * contact.v_in, (5e-6, 0.1, 1e-6))
    found = estimated(hammer, times, shown, before, drive)
    assert found.touch[0] == pytest.approx(contact.t_in, abs=1e-7)
    assert found.speed[0] == pytest.approx(contact.v_in, rel=2e-3)


@pytest.mark.parametrize("scale", [-0.05, 0.08])
def test_the_flight_tells_by_which_part_all_currents_are_larger(scale: float) -> None:
    hammer = hammers.crude()
    drive = ph.PulseTrain(hammer.waveform)
    motion = ph.simulate(hammer, drive.scaled(1.0 + scale), duration=1.5e-3)
    contact = next(one for one in motion.contacts if one.surface == "pack")
    times = contact.t_in - 50e-6 - np.arange(50)[::-1] * 2e-6
    shown = motion.at(times)[0]
    before = expected(contact.t_in - 6e-6, 0.95 * contact.v_in, (5e-6, 0.1, 0.1))
    found = estimated(hammer, times, shown, before, drive)
    assert found.scale[0] == pytest.approx(scale, abs=2e-3)
    assert found.touch[0] == pytest.approx(contact.t_in, abs=1e-7)


def test_noise_is_averaged_as_least_squares_do() -> None:
    hammer = hammers.shelf(force=-4.0)
    touch, speed, pull = 3.1e-4, 0.9, 4.0 / hammer.mass
    times = np.arange(60) * 2e-6 + 1.4e-4
    late = times - touch
    error = 1.5e-6
    random = np.random.default_rng(5)
    shown = hammers.FRONT + speed * late - 0.5 * pull * late**2 + error * random.normal(size=(400, 60))
    force = FreeForce(hammer, hammer.origin, hammers.FRONT, 2.0)
    touches = flight_from_samples(
        Samples(np.broadcast_to(times, shown.shape), shown, np.ones(shown.shape, np.bool_), error),
        expected(touch, speed, (1.0, 100.0, 1e-3), 400),
        np.full(400, hammers.FRONT),
        lambda x, _t, _s: force(x, np.zeros_like(x)) / hammer.mass,
    ).touch
    # The variance of a straight line, carried on to the touch.
    beyond = touch - times.mean()
    spread = error * np.sqrt((1.0 + beyond**2 / times.var()) / 60.0) / speed
    assert touches.std() == pytest.approx(spread, rel=0.15)
    assert abs(touches.mean() - touch) < 4.0 * spread / np.sqrt(400.0) + 2e-8
