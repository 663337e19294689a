"""The impact sensor: its noise is as stated, and missed impacts are NaN."""

from typing import cast

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.control.learning.production import OFFSET, Production
from printhammer.control.table.task import Task
from printhammer.printing.rates.variability import Variability

FLIGHT = np.full(20_000, 240e-6)
FORCE = np.ones(20_000)


def test_noise_is_as_stated() -> None:
    readings = ph.ImpactSensor(noise=4e-6, force=0.05).read(FLIGHT, FORCE, 0, 0)
    assert np.std(readings.time) == pytest.approx(4e-6, rel=0.03)
    assert readings.force is not None
    assert np.std(readings.force) == pytest.approx(0.05, rel=0.03)
    assert ph.ImpactSensor().read(FLIGHT, FORCE, 0, 0).force is None


def test_coloured_noise_is_as_strong_and_correlated() -> None:
    off = ph.ImpactSensor(colour=0.8).read(FLIGHT, FORCE, 0, 0).time - FLIGHT
    assert np.std(off) == pytest.approx(5e-6, rel=0.06)
    assert np.corrcoef(off[1:], off[:-1])[0, 1] == pytest.approx(0.8, abs=0.03)


def test_gain_missed_and_false_impacts() -> None:
    assert ph.ImpactSensor(noise=0.0, gain=0.02).read(FLIGHT, FORCE, 0, 0).time == pytest.approx(
        1.02 * FLIGHT
    )
    time = ph.ImpactSensor(noise=0.0, missed=0.01, false=0.02).read(FLIGHT, FORCE, 0, 0).time
    assert np.isnan(time).mean() == pytest.approx(0.01, abs=0.003)
    assert (time < 239e-6).mean() == pytest.approx(0.02, abs=0.004)
    assert not (time > 241e-6).any()


def test_a_delay_is_the_same_for_every_dot() -> None:
    assert ph.ImpactSensor(noise=0.0, delay=30e-6).read(FLIGHT, FORCE, 0, 0).time == pytest.approx(270e-6)


def test_noise_depends_on_seed_unit_and_run_only() -> None:
    sensor = ph.ImpactSensor()
    first = sensor.read(FLIGHT, FORCE, 3, 4).time
    assert (sensor.read(FLIGHT, FORCE, 3, 4).time == first).all()
    for other in (
        sensor.read(FLIGHT, FORCE, 3, 5),
        sensor.read(FLIGHT, FORCE, 2, 4),
        ph.ImpactSensor(seed=1).read(FLIGHT, FORCE, 3, 4),
    ):
        assert not (other.time == first).any()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("noise", -1.0),
        ("noise", float("nan")),
        ("force", -0.1),
        ("colour", 1.0),
        ("gain", -1.0),
        ("missed", 1.5),
        ("delay", float("inf")),
        ("offset", -1e-6),
    ],
)
def test_bad_numbers_are_refused(key: str, value: float) -> None:
    with refused(key, value):
        ph.ImpactSensor(**{key: value})  # type: ignore[arg-type]


def test_an_offset_that_is_stated_is_the_prior_of_the_learner() -> None:
    task, variability = cast("Task", None), Variability()
    for stated, prior in ((None, OFFSET), (0.0, 0.0), (3e-6, 3e-6)):
        assert Production(task, 1e3, variability, ph.ImpactSensor(offset=stated)).offset == prior
