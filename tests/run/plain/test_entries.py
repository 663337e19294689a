"""Plain functions as entry points: machine code gives the results of the functions, and laws are bound."""

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import printhammer as ph
from printhammer.drive import tables
from printhammer.drive.segments import END, stacked
from printhammer.drive.waveforms.shapes import SHAPES, HalfSine, Rectangle, Sine, Trapezoid, Waveform
from printhammer.kernel.compile.signatures import Plain
from printhammer.kernel.compile.specialise import specialise
from printhammer.parts.spring.linear import PreloadSpring
from printhammer.run.plain.entries import compiled
from printhammer.run.problem import Problem

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import spring_force

SPRING = 16


def pull(hammer: Any, x: float) -> float:
    return spring_force(hammer[SPRING:], x)


def fill_pulls(hammer: Any, places: Any, pulls: Any) -> int:
    """An entry point whose helper calls a law."""
    for k in range(len(places)):
        pulls[k] = pull(hammer, places[k])
    return len(places)


def test_a_law_is_bound_to_an_entry_point() -> None:
    hammer = ph.Hammer.build("2 g", spring=PreloadSpring(preload=3.0, stiffness=500.0))
    problem = Problem(hammer, ph.SineForce(1.0, 50.0), (0.0, 0.0), 0.0, 1e-9)
    plain = Plain(fill_pulls, ("f1", "f1", "f1"), 1, laws=True)
    places, pulls = np.array([0.0, 1e-3, -2e-3]), np.zeros(3)
    assert specialise(problem.laws).plain("pulls", plain)(problem.constants, places, pulls) == 3
    np.testing.assert_allclose(pulls, 3.0 - 500.0 * places, rtol=1e-15)


@pytest.mark.parametrize("pattern", [False, True])
def test_firing_times_are_those_of_a_train(pattern: bool) -> None:
    marks, rate = np.array([1, 1, 0, 1, 0, 0, 1]), 1449.2
    waveform = ph.load("hendriks-1983-1").waveform
    assert waveform is not None
    times = np.full(7, np.nan)
    if pattern:
        expected = ph.PulseTrain(waveform, at=[0.0, 1 / rate, 3 / rate, 6 / rate]).times
    else:
        marks = np.ones(7, np.int64)
        expected = ph.PulseTrain(waveform, rate=rate, pulses=7).times
    assert compiled("firings")(rate, marks, pattern, times) == len(expected)
    np.testing.assert_array_equal(times[: len(expected)], expected)


DRIVER: dict[str, Any] = {"voltage": 24.0, "width": 4e-4, "source_resistance": 0.5, "coils": 3.0}
PULSES = [
    HalfSine(amplitude=1.5, width=3e-4),
    Rectangle(amplitude=-1.5, width=3e-4, rise=1e-4, decay=0.0),
    Trapezoid(amplitude=2.0, rise=1e-5, width=1e-4, fall=2e-5),
    SHAPES["rail"](**DRIVER, decay="rail"),
    SHAPES["chopper"](**DRIVER, upper=1.0, off_time=2e-5),
    SHAPES["peak-and-hold"](**DRIVER, peak_time=1e-4, hold_upper=1.0, hold_lower=0.8, decay_resistance=5.0),
    SHAPES["capacitor"](**DRIVER, capacitance=1e-4, charging_resistance=10.0),
    SHAPES["bridge"](**DRIVER, reverse=1e-4, decay="zener", decay_voltage=30.0),
    Sine(amplitude=2.0, frequency=60.0, phase=0.3, quantity="force"),
]


@pytest.mark.parametrize("waveform", PULSES, ids=lambda waveform: waveform.shape)
def test_a_pulse_of_a_page_is_that_of_a_waveform(waveform: Waveform) -> None:
    table, about = np.full((8, 6), np.nan), np.full(14, np.nan)
    rows = compiled("pulse")(waveform.code, np.array(waveform.numbers()), table, about)
    np.testing.assert_allclose(table[:rows], stacked([waveform.segments()])[1], rtol=1e-15)
    assert table[rows - 1, 1] == END
    assert about[[tables.SUPPORT, tables.LARGEST, tables.REPLACES]].tolist() == pytest.approx(
        [waveform.support, waveform.peak, float(waveform.replaces)], rel=1e-15
    )
    assert tuple(about[7:13]) == waveform.supply()
    times = np.linspace(-1e-5, 6e-4, 100)
    values = np.empty(100)
    compiled("pulse_values")(table[:rows].copy(), times, values)
    np.testing.assert_allclose(values, waveform.value(times), rtol=1e-13, atol=1e-15)
