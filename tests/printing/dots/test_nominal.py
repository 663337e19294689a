"""The dot of a single pulse, waited for as long as a device takes."""

import pytest

from printhammer.drive.trains import PulseTrain
from printhammer.hammer.hammer import load
from printhammer.printing.dots.nominal import WAIT, nominal, single_pulses, wait_of
from printhammer.run.simulate import simulate


def test_a_slow_device_is_waited_for_until_its_supply_is_off() -> None:
    relay, printer = load("relay-5v"), load("impact-wire")
    assert wait_of(relay.waveform) == WAIT + relay.waveform.width
    single = nominal(relay)
    assert single.flight_time > WAIT
    (dot,) = simulate(relay, PulseTrain(relay.waveform)).dots
    assert single.flight_time == pytest.approx(dot.flight_time, rel=1e-9)
    many = single_pulses([relay, printer])
    assert [each.flight_time for each in many if each] == pytest.approx(
        [single.flight_time, nominal(printer).flight_time], rel=1e-6
    )


def test_a_current_is_waited_for_as_ever() -> None:
    assert wait_of(load("hendriks-1983").waveform) == WAIT
