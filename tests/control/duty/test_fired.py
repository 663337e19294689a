"""Heat of one dot of a hammer, from its circuit or its current."""

import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.control.duty import heat_of


def test_a_driver_heats_a_warm_coil_as_the_circuit_says() -> None:
    relay = ph.load("relay-5v")
    heat = heat_of(relay)
    warm = relay.replace("coil.temperature", 60.0)
    motion = ph.simulate(warm, ph.PulseTrain(warm.waveform, at=[0.0]), duration=0.2, ledger=True)
    assert heat.at(60.0) == pytest.approx(motion.energy.copper_loss, rel=1e-3)
    # On the rail for long, a relay draws what its resistance allows.
    assert heat.at(60.0) < heat.at(40.0) < heat.at(20.0)
    assert heat.at(20.0) < 5.0**2 / 70.0 * relay.waveform.width


def test_a_current_that_is_kept_up_heats_a_warm_coil_more(hammer: ph.Hammer) -> None:
    heat = heat_of(hammer.replace("coil.resistance", "4 ohm"))
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=[0.0]))
    from scipy.integrate import trapezoid

    assert heat.at(20.0) == pytest.approx(4.0 * trapezoid(motion.current**2, motion.t), rel=1e-3)
    assert heat.at(100.0) == pytest.approx(heat.at(20.0) * (1.0 + 80.0 * 3.93e-3), rel=1e-12)
    duty = ph.thermal_duty(heat, "10 K/W", 91.0)
    assert duty.limit_heat == heat.at(91.0)


def test_without_a_resistance_there_is_no_heat(hammer: ph.Hammer) -> None:
    with refused("coil.resistance"):
        heat_of(hammer)


def test_a_driver_is_not_on_longer_than_there_is_time() -> None:
    # 20 ms on for one dot: 50 dots a second leave no pause, however cool the coil stays.
    relay = ph.load("relay-5v")
    heat = heat_of(relay)
    assert heat.most == pytest.approx(1.0 / relay.waveform.width, rel=1e-12)
    assert ph.thermal_duty(heat, "0.1 K/W", 91.0).rate.tolist() == [heat.most]
    assert ph.thermal_duty(heat, "1000 K/W", 91.0).rate[0] < heat.most
    with refused("burst", value="188 Hz"):
        ph.thermal_duty(heat, "0.1 K/W", 91.0, burst=["188 Hz"])


def test_dots_whose_currents_overlap_are_named() -> None:
    """A pulse heats the coil more if the current of the preceding pulse has not decayed."""
    relay = ph.load("relay-5v")
    heat = heat_of(relay)
    assert relay.waveform.width < heat.lasts
    for rate, is_more in ((0.9 * heat.apart, False), (heat.most, True)):
        train = ph.PulseTrain(relay.waveform, rate=rate, pulses=6)
        motion = ph.simulate(relay, train, duration=1.0, ledger=True)
        assert (motion.energy.copper_loss > 1.02 * 6.0 * heat.at(20.0)) == is_more
    for resistance, is_named in (("0.1 K/W", True), ("1000 K/W", False)):
        assert ("overlap" in str(ph.thermal_duty(heat, resistance, 91.0))) == is_named
