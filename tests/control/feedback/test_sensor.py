"""The position sensor: noise that depends only on seed, run and sample; quantisation; delay."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.control.feedback.sensor import PositionSensor, normal, run_key

STROKE = 150e-6


def test_noise_depends_on_seed_run_and_sample_only() -> None:
    runs = np.array([run_key((0, 1), 1e3), run_key((0, 2), 1e3), run_key((0, 1), 1.1e3)], dtype=np.uint64)
    numbers = np.arange(100, 160)
    whole = normal(7, runs[:, np.newaxis], numbers[np.newaxis, :])
    for row, run in enumerate(runs):
        for place in (0, 17, 59):
            alone = normal(7, np.array([run]), numbers[place : place + 1])
            assert alone[0] == whole[row, place]
    assert len(np.unique(whole)) == whole.size
    assert not np.array_equal(whole, normal(8, runs[:, np.newaxis], numbers[np.newaxis, :]))


def test_noise_is_normal_and_white() -> None:
    values = normal(0, np.array([[run_key((0,), 1e3)]], dtype=np.uint64), np.arange(200_000)[np.newaxis, :])[
        0
    ]
    assert abs(values.mean()) < 5.0 / np.sqrt(values.size)
    assert values.std() == pytest.approx(1.0, abs=5.0 / np.sqrt(2.0 * values.size))
    assert abs(np.mean(values[1:] * values[:-1])) < 5.0 / np.sqrt(values.size)
    assert np.mean(np.abs(values) < 1.0) == pytest.approx(0.6827, abs=0.006)


@given(
    st.floats(0.0, 1e-3),
    st.floats(0.0, 2e-3),
    st.floats(0.0, 1e-4),
    st.floats(1e-6, 2e-5),
    st.integers(1, 80),
)
def test_no_sample_is_used_before_it_is_in(
    since: float, until: float, delay: float, interval: float, most: int
) -> None:
    sensor = PositionSensor(delay=delay, interval=interval)
    numbers = sensor.numbers(np.array([since]), np.array([until]), most)[0]
    assert numbers.shape == (most,)
    used = numbers[numbers >= 0]
    slack = 2e-6 * interval
    assert (used * interval <= until - delay + slack).all()
    assert (used * interval >= since - slack).all()
    assert (np.diff(used) == 1).all()


def test_a_perfect_sensor_shows_the_truth_and_a_coarse_one_its_steps() -> None:
    x = np.linspace(50e-6, 200e-6, 31)[np.newaxis, :]
    numbers = np.arange(31)[np.newaxis, :]
    runs = np.array([3], dtype=np.uint64)
    assert np.array_equal(PositionSensor(noise=0.0, step=0.0).read(x, numbers, runs, STROKE), x)
    coarse = PositionSensor(noise=0.0, step=0.125).read(x, numbers, runs, STROKE) / (0.125 * STROKE)
    assert np.allclose(coarse, np.round(coarse), rtol=0.0, atol=1e-9)
    assert np.abs(coarse * 0.125 * STROKE - x).max() <= 0.5 * 0.125 * STROKE * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"noise": -0.1}, "sensor"),
        ({"delay": float("nan")}, "sensor"),
        ({"interval": 0.0}, "sensor"),
        ({"step": float("inf")}, "sensor"),
        ({"seed": -1}, "seed"),
        ({"seed": 1.5}, "seed"),
    ],
)
def test_bad_sensors_are_refused(change: dict[str, float], key: str) -> None:
    with refused(key):
        dataclasses.replace(PositionSensor(), **change)
