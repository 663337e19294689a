"""Status of runs: vanishing quantities, coinciding edges of the drive, end of the range of a law."""

import numpy as np
import pytest
from tests import hammers

import printhammer as ph
from printhammer.drive.waveforms.shapes import Sampled
from printhammer.parts.damping import ViscousDamping
from printhammer.parts.spring.linear import PreloadSpring


def test_a_motion_that_has_died_out_goes_on_to_its_end() -> None:
    # 1000 time constants: the displacement falls below the least double whose square is none.
    hammer = hammers.made_of(
        mass=1e-3,
        spring=PreloadSpring(preload=0.0, stiffness=250.0),
        damping=ViscousDamping(coefficient=1.0),
    )
    with hammers.interpreted():
        motion = ph.simulate(hammer, hammers.idle(), duration=2.0, state=(1e-3, 0.0), points=2)
    assert motion.status == "ok"
    assert motion.end == 2.0
    assert abs(motion.x[-1]) < 1e-100


VOICE_COIL = {
    "magnet": {"law": "moving-coil", "constant": 5.0},
    "spring": {"law": "preload", "preload": 0.0, "stiffness": 250.0},
    "damping": {"law": "viscous", "coefficient": 1.0},
    "coil": {"resistance": "8 ohm", "inductance": "1 mH"},
    "waveform": {"shape": "rail", "voltage": "12 V", "width": "2 ms", "decay": "diode"},
}


def test_a_voice_coil_that_has_come_to_rest_goes_on_to_its_end() -> None:
    # The damping of 1 N s/m and a time constant of at most 4 ms leave nothing of 1e-150 after 1.4 s.
    hammer = ph.Hammer.build(1e-3, **VOICE_COIL)
    with hammers.interpreted():
        motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=2.0, points=2)
        assert motion.status == "ok"
        assert motion.end == 2.0
        assert abs(motion.x[-1]) < 1e-150
        assert abs(motion.current[-1]) < 1e-150


def test_a_shorted_turn_whose_current_has_died_out_goes_on_to_its_end() -> None:
    relay = ph.load("relay-5v").replace({"coil.turn_resistance": "200 ohm", "coil.leakage": "5 mH"})
    with hammers.interpreted():
        motion = ph.simulate(relay, ph.PulseTrain(relay.waveform), duration=0.6, points=2)
        assert motion.status == "ok"
        assert motion.end == 0.6
        assert abs(motion.current[-1]) < 1e-100


@pytest.mark.parametrize("samples", [41, 401])
@pytest.mark.parametrize("rate", [800.0, 1000.0, 1200.0])
def test_knots_of_overlapping_records_may_coincide(rate: float, samples: int) -> None:
    times = np.linspace(0.0, 4e-3, samples)
    record = 0.8 * np.exp(-times / 1.2e-3) * -np.expm1(-times / 0.15e-3)
    record[-1] = 0.0
    drive = ph.PulseTrain(Sampled.from_samples(times, record), rate=rate, pulses=30)
    motion = ph.simulate(ph.load("hendriks-1983"), drive, points=2)
    assert motion.status == "ok"
    assert len(motion.dots) == 30
    # Knots of one firing fall on those of another, but for rounding.
    knots = np.sort(np.add.outer(drive.times, times).ravel())
    gaps = np.diff(knots)
    assert ((gaps > 0.0) & (gaps < 1e-15 * knots[1:])).any()


@pytest.mark.parametrize(("turn", "leakage"), [("50 ohm", "1 mH"), ("200 ohm", "5 mH")])
def test_a_gap_that_closes_behind_a_shorted_turn_is_a_status(turn: str, leakage: str) -> None:
    relay = ph.load("relay-5v").replace(
        {"coil.turn_resistance": turn, "coil.leakage": leakage, "pack.stiffness": "1 N/m"}
    )
    motion = ph.simulate(relay, ph.PulseTrain(relay.waveform), duration=0.05)
    assert motion.status == "range left"
    assert np.isfinite(motion.x).all()
    assert np.isfinite([motion.end, motion.v[-1], motion.current[-1]]).all()
    assert relay.magnet.domain[1] == pytest.approx(motion.x[-1], abs=1e-9)


@pytest.mark.parametrize(("turn", "leakage"), [("50 ohm", "1 mH"), ("200 ohm", "5 mH")])
def test_a_gap_that_closes_without_a_pack_is_a_status(turn: str, leakage: str) -> None:
    changed = {"coil.turn_resistance": turn, "coil.leakage": leakage, "pack": None}
    relay = ph.load("relay-5v").replace(changed)
    # Machine code divides by zero without a warning.
    with hammers.interpreted(), np.errstate(divide="ignore", invalid="ignore"):
        motion = ph.simulate(relay, ph.PulseTrain(relay.waveform), duration=0.05)
        assert motion.status == "range left"
        assert np.isfinite(motion.x).all()
        assert relay.magnet.domain[1] == pytest.approx(motion.x[-1], abs=1e-9)
