"""Drivers of a coil: segments, files, common properties, and invalid input."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.drive.file import load_drive, save_drive
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.waveforms.drivers import Bridge, Capacitor, Chopper, PeakAndHold, Rail
from printhammer.drive.waveforms.shapes import HalfSine, Waveform

if TYPE_CHECKING:
    from pathlib import Path

EACH = [
    Rail(voltage=24.0, width=2e-4, decay="zener", decay_voltage=30.0),
    Rail(voltage=24.0, width=2e-4, decay="rail", source_resistance=0.2, coils=4),
    Chopper(voltage=38.0, width=2e-4, upper=2.0, lower=1.8),
    Chopper(voltage=38.0, width=2e-4, upper=2.0, off_time=1e-5, decay_resistance=10.0),
    PeakAndHold(voltage=50.0, width=1e-2, peak_time=2e-3, hold_upper=1.0, hold_lower=0.8),
    Capacitor(voltage=80.0, width=1e-3, capacitance=1e-4, charging_resistance=1e3),
    Bridge(voltage=24.0, width=2e-4, reverse=1e-4, decay="rail"),
]


@pytest.mark.parametrize("waveform", EACH, ids=lambda w: w.shape)
def test_a_file_says_all_of_a_driver(waveform: Waveform, tmp_path: Path) -> None:
    drive = ph.PulseTrain(waveform, rate=800.0, pulses=3)
    save_drive(drive, tmp_path / "drive.toml")
    again = load_drive(tmp_path / "drive.toml")
    assert again.waveform == waveform
    assert again == drive
    assert again.fingerprint == drive.fingerprint


@pytest.mark.parametrize("waveform", EACH, ids=lambda w: w.shape)
def test_the_value_is_the_supply_s_voltage_while_it_is_on(waveform: Waveform) -> None:
    drive = ph.PulseTrain(waveform, rate=50.0, pulses=2)
    assert drive.quantity == "voltage"
    assert drive.overlap == "replace"
    voltage = getattr(waveform, "voltage", 0.0)
    with np.errstate(all="raise"):
        assert drive.value([1e-6, 0.02 + 1e-6]) == pytest.approx(voltage)
        assert drive.value([waveform.support + 1e-6, 0.0199]) == pytest.approx(0.0)
    assert drive.peak == drive.largest_pulse == voltage
    assert math.isfinite(drive.end)


def test_supplies_tell_drives_apart() -> None:
    one = ph.PulseTrain(EACH[5], rate=50.0, pulses=2)
    other = ph.PulseTrain(EACH[5].model_copy(update={"capacitance": 2e-4}), rate=50.0, pulses=2)
    assert np.array_equal(one.segments(), other.segments())
    assert one != other
    assert one.fingerprint != other.fingerprint


def test_a_sequence_has_one_supply() -> None:
    hammer = ph.load("hendriks-1983-1").replace("coil", {"resistance": "2 ohm", "inductance": "2 mH"})
    other = EACH[2].model_copy(update={"diode_voltage": 0.3})
    with refused("waveforms"):
        ph.simulate(hammer, PulseSequence([EACH[2], other], at=[0.0, 1e-3]))
    with refused("waveforms[1]"):
        PulseSequence([EACH[2], HalfSine(amplitude=1.0, width=1e-3)], at=[0.0, 1e-3])
