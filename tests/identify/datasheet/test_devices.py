"""The shipped devices satisfy their data sheets."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import printhammer as ph
from printhammer.drive.waveforms.drivers import Rail
from printhammer.parts.magnet import reluctance as law
from printhammer.parts.spring.forces import spring_force
from printhammer.run.motion import Motion

RATED = 5.0


def closed(relay: ph.Hammer, volts: float) -> Motion:
    """Return the motion of a relay at a voltage for 100 ms."""
    return ph.simulate(relay, ph.PulseTrain(Rail(voltage=volts, width=0.1), at=[0.0]), duration=0.1)


@pytest.fixture(scope="module")
def relay() -> ph.Hammer:
    return ph.load("relay-5v")


def test_a_relay_operates_within_its_time(relay: ph.Hammer) -> None:
    motion = closed(relay, RATED)
    assert motion.status == "ok"
    dot = motion.dots[0]
    assert dot.flight_time is not None
    assert dot.flight_time < 10e-3
    assert motion.x[-1] > relay.front
    # At rest at the pole it draws its rated current.
    assert motion.current[-1] == pytest.approx(RATED / 70.0, rel=1e-3)


def test_a_relay_pulls_in_by_three_quarters_and_not_below_half(relay: ph.Hammer) -> None:
    assert closed(relay, 0.75 * RATED).x[-1] > relay.front
    assert closed(relay, 0.5 * RATED).x[-1] < relay.front


def test_a_relay_drops_out_above_a_tenth_and_below_its_pull_in(relay: ph.Hammer) -> None:
    def after(volts: float) -> float:
        """Close the relay at the rated voltage, then reduce the voltage; return the final displacement."""
        waves = [Rail(voltage=RATED, width=0.05), Rail(voltage=volts, width=0.2)]
        drive = ph.PulseSequence(waves, at=[0.0, 0.05])
        return float(ph.simulate(relay, drive, duration=0.25).x[-1])

    assert after(0.1 * RATED) < 0.1 * relay.front
    assert after(0.5 * RATED) > relay.front


@pytest.mark.parametrize(
    ("driver", "release"),
    [
        ({}, None),
        ({"decay": "zener", "decay_voltage": 24.0}, 5e-3),
        ({"decay": "zener", "decay_voltage": 100.0}, 5e-3),
    ],
)
def test_the_contacts_of_a_relay_switch_within_the_limits_of_data_sheets(
    relay: ph.Hammer, driver: dict[str, Any], release: float | None
) -> None:
    """Limits for relays of this class: operate 10 ms, bounce 4 ms, release 5 ms without a diode.

    The default driver has a diode, which delays the release; data sheets state no limit for it.
    """
    wave = Rail(voltage=RATED, width=30e-3, **driver)
    motion = ph.simulate(relay, ph.PulseTrain(wave), duration=80e-3, tolerance=1e-12)
    make, rest = motion.timings
    assert (make.kind, rest.kind) == ("make", "break")
    assert rest.operate_time < make.operate_time < 10e-3
    assert make.operate_bounce < 4e-3
    # The armature rebounds from its backstop, and lifts the break contact again.
    assert 0.0 < rest.release_bounce < 4e-3
    assert make.release_time < rest.release_time
    if release is not None:
        assert rest.release_time < release
    else:
        fast = ph.simulate(
            relay, ph.PulseTrain(Rail(voltage=RATED, width=30e-3, decay="rail")), duration=80e-3
        )
        assert make.release_time > 2.0 * fast.timings[0].release_time
    # The indentation of the pole adds to the 0.35 N of the make contact.
    assert 0.35 < make.final_force < 0.37
    assert rest.final_force == pytest.approx(0.06, rel=1e-6)


def test_the_springs_of_a_relay_press_as_before_its_contacts_were_listed(relay: ph.Hammer) -> None:
    """0.17 N toward the backstop at rest, and 0.8 N at the pole."""
    assert relay.spring is not None
    c = relay.spring.packed(0.0)
    assert spring_force(c, 0.0) == pytest.approx(-0.17, abs=1e-12)
    assert spring_force(c, 0.5e-3) == pytest.approx(-0.8, abs=1e-12)


def test_a_marker_strikes_once_while_its_pulse_lasts() -> None:
    marker = ph.load("dot-peen")
    motion = ph.simulate(marker, ph.PulseTrain(marker.waveform, period="25 ms", pulses=3), duration=0.075)
    assert [dot.extra_contacts for dot in motion.dots] == [0, 0, 0]
    assert all(dot.flight_time is not None and dot.flight_time < 4e-3 for dot in motion.dots)


def test_an_embosser_presses_one_dot_of_the_height_of_the_specification() -> None:
    embosser = ph.load("braille-embosser")
    motion = ph.simulate(embosser, ph.PulseTrain(embosser.waveform, period="50 ms", pulses=2), duration=0.1)
    assert motion.status == "ok"
    assert [dot.extra_contacts for dot in motion.dots] == [0, 0]
    assert motion.x.max() - embosser.front == pytest.approx(0.48e-3, rel=0.1)


def test_a_flipper_is_held_until_it_is_let_go() -> None:
    flipper = ph.load("pinball-flipper")
    width = flipper.waveform.width
    motion = ph.simulate(flipper, ph.PulseTrain(flipper.waveform, at=[0.0]), duration=0.3)
    held = (motion.t > 0.05) & (motion.t < width)
    assert (motion.x[held] > flipper.front).all()
    assert motion.current[held].max() < 1.7
    assert motion.x[-1] < 0.1 * flipper.front


def test_a_pinball_plunger_arrives_while_its_coil_is_fired() -> None:
    coil = ph.load("pinball-coil")
    motion = ph.simulate(coil, ph.PulseTrain(coil.waveform, at=[0.0]), duration=0.1)
    assert motion.status == "ok"
    assert motion.dots[0].flight_time < coil.waveform.width
    assert motion.current.max() < 50.0 / 4.2


def test_a_pot_magnet_meets_the_forces_and_inductances_of_its_study() -> None:
    study = np.loadtxt(
        Path(ph.__file__).parent / "identify" / "static" / "pot-magnet.csv", delimiter=",", skiprows=4
    )
    magnet = ph.load("pot-magnet").magnet
    assert magnet is not None
    c = magnet.packed(0.0)
    for gap, force, _flux, inductance in study:
        assert law.magnet_force(c, 5e-3 - gap, 1.2) == pytest.approx(force, rel=0.03)
        assert law.magnet_linkage(c, 5e-3 - gap, 1.2) / 1.2 == pytest.approx(inductance, rel=0.03)


def test_a_pot_magnet_pulls_in_on_its_rail() -> None:
    pot = ph.load("pot-magnet")
    motion = ph.simulate(pot, ph.PulseTrain(pot.waveform, at=[0.0]), duration=0.04)
    assert motion.status == "ok"
    assert motion.x[-1] > pot.front
    # Back-EMF turns the current down before the armature arrives.
    touch = motion.dots[0].flight_time
    assert motion.current[motion.t < touch].max() > 1.5 * np.interp(touch, motion.t, motion.current)


@pytest.mark.parametrize("preload", np.linspace(0.5, 3.0, 11).tolist())
def test_a_plunger_leaves_its_stop_whatever_holds_it(preload: float) -> None:
    coil = ph.load("pinball-coil").replace("spring.preload", -preload)
    motion = ph.simulate(coil, ph.PulseTrain(coil.waveform, at=[0.0]), duration=0.1)
    assert motion.status == "ok"
    assert motion.dots[0].struck


def test_a_wire_prints_with_the_current_chopped() -> None:
    wire = ph.load("impact-wire")
    motion = ph.simulate(wire, ph.PulseTrain(wire.waveform, at=[0.0]), duration="2 ms", ledger=True)
    dot = motion.dots[0]
    assert 100e-6 < dot.flight_time < 400e-6
    assert dot.extra_contacts == 0
    chopped = (motion.t > 150e-6) & (motion.t < wire.waveform.width)
    assert motion.current[chopped].max() <= 2.0 * (1.0 + 1e-9)
    assert abs(motion.energy.residual) < 1e-8 * motion.energy.throughput
