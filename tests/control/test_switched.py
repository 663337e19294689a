"""A switched current: bounded by its levels, and the sum of what each switching does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests import hammers

import printhammer as ph
from printhammer.control.driver import Driver, driver_of
from printhammer.control.switched import Switched

EDGES = st.floats(1e-6, 1e-4)
STEPS = st.lists(st.tuples(st.floats(1e-6, 3e-4), st.floats(-2.0, 2.0)), min_size=1, max_size=8)


def switched(steps: list[tuple[float, float]], edge: float) -> Switched:
    at = np.concatenate([[0.0], np.cumsum([wait for wait, _level in steps])])
    return Switched(at=tuple(at.tolist()), levels=(*(level for _wait, level in steps), 0.0), edge=edge)


@given(STEPS, EDGES)
def test_the_current_never_exceeds_its_levels(steps: list[tuple[float, float]], edge: float) -> None:
    waveform = switched(steps, edge)
    largest = max(abs(level) for level in waveform.levels)
    assert waveform.peak <= largest * (1.0 + 1e-12)


@given(STEPS, EDGES)
def test_the_current_is_the_sum_of_what_each_switching_does(
    steps: list[tuple[float, float]], edge: float
) -> None:
    waveform = switched(steps, edge)
    times = np.linspace(0.0, waveform.at[-1] + 3.0 * edge, 97)
    total = np.zeros_like(times)
    for at, level, before in zip(waveform.at, waveform.levels, (0.0, *waveform.levels[:-1]), strict=True):
        total += (level - before) * -np.expm1(-np.maximum(times - at, 0.0) / edge)
    assert np.allclose(waveform.value(times), total, rtol=0.0, atol=1e-11)
    assert np.allclose(waveform.scaled(-0.5).value(times), -0.5 * total, rtol=0.0, atol=1e-11)


def test_a_run_may_begin_within_a_pulse() -> None:
    waveform = Switched(at=(10e-6, 50e-6), levels=(-1.0, 0.0), edge=20e-6, initial=2.0)
    assert waveform.value([0.0])[0] == 2.0
    assert waveform.value([10e-6])[0] == pytest.approx(2.0 * np.exp(-0.5))


def test_the_driver_is_as_fast_as_the_hammers_own_decay() -> None:
    hammer = hammers.crude()
    assert driver_of(hammer) == Driver(2.0, hammer.waveform.decay)
    assert driver_of(hammer, 1.5, 5e-6) == Driver(1.5, 5e-6)
    with pytest.raises(ph.InputError, match="current of the driver"):
        Driver(0.0, 1e-6)
    with pytest.raises(ph.InputError, match="edge of the driver"):
        Driver(2.0, -1e-6)
