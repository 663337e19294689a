"""A hammer and a drive prepared for the kernel: scales, space for the record, invariance of units."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests import hammers
from tests.hammers import FRONT, MASS, STOP, STROKE, THICKNESS

import printhammer as ph
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.run import problem
from printhammer.run.problem import Problem


def scaled(length: float, time: float, mass: float) -> tuple[ph.Hammer, ph.PulseTrain]:
    """`hammers.shelf` and a pulse, in units of length, time and mass scaled by given factors."""
    force = mass * length / time**2
    hammer = hammers.made_of(
        MASS * mass,
        spring=hammers.preload(-4.0 * force, 2e4 * force / length),
        pack=hammers.power(259.0 * force, FRONT * length, THICKNESS * length),
        backstop=hammers.hertz(
            1.156e9 * force / length**1.5, 4.175e8 * force * time / length**2.5, STOP * length
        ),
    )
    waveform = Rectangle(
        amplitude=14.0 * force, width=3e-4 * time, rise=1e-5 * time, decay=2e-5 * time, quantity="force"
    )
    return hammer, ph.PulseTrain(waveform, period=1.3e-3 * time, pulses=2)


def powers(base: float, most: int) -> st.SearchStrategy[float]:
    return st.integers(-most, most).map(lambda power: base**power)


@settings(max_examples=25)
@given(length=powers(10.0, 6), time=powers(10.0, 5), mass=powers(10.0, 6))
def test_other_units_give_the_same_motion(length: float, time: float, mass: float) -> None:
    times = np.linspace(0.0, 3e-3, 101)
    one = ph.simulate(*scaled(1.0, 1.0, 1.0), times=times, duration=3e-3, state=(STOP, 0.0))
    hammer, drive = scaled(length, time, mass)
    other = ph.simulate(hammer, drive, times=times * time, duration=3e-3 * time, state=(hammer.position, 0.0))
    assert one.ok
    assert other.ok
    count = min(len(one.x), len(other.x))
    assert count >= 100
    np.testing.assert_allclose(other.x[:count] / length, one.x[:count], rtol=0.0, atol=1e-8 * STROKE)
    assert [c.surface for c in other.contacts] == [c.surface for c in one.contacts]
    assert abs(other.steps - one.steps) <= 5


def test_a_record_longer_than_the_first_room_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    hammer, drive = scaled(1.0, 1.0, 1.0)
    whole = ph.simulate(hammer, drive, duration=3e-3)
    for name in ("_NODES", "_CONTACTS"):
        if hasattr(problem, name):
            monkeypatch.setattr(problem, name, 3)
    small = ph.simulate(hammer, drive, duration=3e-3)
    np.testing.assert_array_equal(small.step_times, whole.step_times)
    assert small.contacts == whole.contacts


def test_scales_are_those_of_the_stroke() -> None:
    hammer = hammers.shelf(-4.0)
    found = Problem(hammer, hammers.block(14.0, 1e-4), (STOP, 0.0), 0.0, 1e-11)
    way, speed = found.scales
    assert way == pytest.approx(STROKE)
    assert 0.3 < speed / np.sqrt(18.0 * STROKE / MASS) < 3.0


@pytest.mark.parametrize("state", [(0.0, 0.0), (1e-3, 0.0), (0.0, 1e-6)])
def test_scales_are_positive_whatever_is_lacking(state: tuple[float, float]) -> None:
    for parts in ({}, {"spring": hammers.preload(0.0, 10.0)}, {"pack": hammers.power()}):
        found = Problem(hammers.made_of(1.0, **parts), hammers.idle(), state, 0.0, 1e-11)
        assert all(np.isfinite(scale) and scale > 0.0 for scale in found.scales)


def test_a_problem_from_another_start_is_the_one_built_there() -> None:
    """Also the units of tolerances, which depend on the state; surfaces left out are left out of one only."""
    hammer, drive = hammers.made_of(spring=hammers.preload(-4.0, 2e4), pack=hammers.power()), hammers.idle()
    first = Problem(hammer, drive, (1e-3, -0.5), 0.0, 1e-11)
    first.started((0.0, 0.3), 1e-4).leave_out("pack")
    found, built = first.started((2e-3, 0.7), 1e-3), Problem(hammer, drive, (2e-3, 0.7), 1e-3, 1e-11)
    np.testing.assert_array_equal(found.constants, built.constants)
    for name in ("state", "start", "scales", "control", "bounds", "beyond", "laws"):
        assert getattr(found, name) == getattr(built, name), name
    assert found.scales != first.scales
