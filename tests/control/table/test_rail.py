"""A table for a hammer with a rail driver: its widths are switch-on times of the rail."""

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.control.pulses import of_width
from printhammer.control.table.drive import brake_of, print_pulse
from printhammer.drive.waveforms.drivers import PeakAndHold, Rail
from printhammer.drive.waveforms.shapes import Chain

RATE = 1275.0
SLOTS = (0, 1, 2, 4, 5, 8, 9, 10)


@pytest.fixture(scope="module")
def hammer() -> ph.Hammer:
    """The paper's hammer with a rail driver that gives about the current of its pulse."""
    coil = {"resistance": 28.6, "inductance": "6.547 mH"}
    rail = {"shape": "rail", "voltage": 100.0, "width": "177.24 us", "decay_resistance": "159.1 ohm"}
    return ph.load("hendriks-1983-1").replace({"coil": coil, "waveform": rail})


def test_dots_are_like_that_of_the_single_pulse(hammer: ph.Hammer) -> None:
    table = ph.tune(hammer, rate=RATE, history=1)
    assert table.deviation.max() < 0.1
    single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=2e-3).dots[0]
    motion = ph.simulate(hammer, table.strategy(hammer)(hammer, [SLOTS], RATE)[0])
    force = np.array([dot.peak_force for dot in motion.dots], dtype=float)
    assert np.abs(force / single.peak_force - 1.0).max() < 0.02
    assert motion.current.max() <= table.largest_current


def test_the_bound_is_one_of_the_current_in_the_coil(hammer: ph.Hammer) -> None:
    pulse, widest = print_pulse(hammer, 2.0)
    motion = ph.simulate(hammer, ph.PulseTrain(of_width(pulse, widest)), duration=1e-3, points=4001)
    assert motion.current.max() == pytest.approx(1.998, abs=1e-3)
    with refused("waveform"):
        ph.tune(hammer, rate=RATE, largest_current=1.5)


def test_a_brake_shorter_than_the_peak_time_is_the_full_supply() -> None:
    pulse = PeakAndHold(
        voltage=38.0, width=260e-6, decay="rail", peak_time=1e-4, hold_upper=2.0, hold_lower=1.6
    )
    assert brake_of(pulse, 5e-5) == Rail(voltage=38.0, width=5e-5, decay="rail")
    assert brake_of(pulse, 2e-4) == of_width(pulse, 2e-4)


def test_a_chain_of_drivers_is_one_output_stage(hammer: ph.Hammer) -> None:
    rail = Rail(voltage=100.0, width=1e-4, source_resistance=2.0)
    chain = Chain(parts=((0.0, rail), (5e-4, of_width(rail, 3e-5))))
    assert chain.replaces
    assert chain.support == pytest.approx(5.3e-4)
    assert chain.supply() == rail.supply()
    train = ph.PulseTrain(rail, at=[0.0, 1e-4])
    parts = Chain(parts=((0.0, rail), (1e-4, rail)))
    both = [ph.simulate(hammer, drive, duration=5e-4, points=51) for drive in (train, ph.PulseTrain(parts))]
    np.testing.assert_allclose(both[0].current, both[1].current, atol=1e-9)
    with refused("parts[1]"):
        Chain(parts=((0.0, rail), (9e-5, rail)))
