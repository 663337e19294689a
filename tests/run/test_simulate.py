"""The entry point of simulations: invalid input, defaults, and the integrators of 1983."""

from typing import Any

import numpy as np
import pytest
from tests import hammers
from tests.errors import refused
from tests.hammers import STOP

import printhammer as ph
from printhammer.run.plain.posing import CYCLE


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"points": 1}, "points = 1: expected at least 2"),
        ({"tolerance": 0.0}, "tolerance = 0.0: expected a number from 1e-15 to 1e-05"),
        ({"tolerance": 1.0}, "tolerance = 1.0: expected a number from 1e-15 to 1e-05"),
        ({"tolerance": float("nan")}, "tolerance = nan: expected a number"),
        ({"scheme": "euler"}, "scheme = 'euler': expected one of default, trapezoid, runge-kutta-4"),
        ({"duration": 0.0}, "expected a positive number"),
        ({"duration": -1.0}, "expected a positive number"),
        ({"duration": float("inf")}, "expected a positive number"),
        ({"duration": "3 lbf"}, "lbf"),
        ({"state": (np.nan, 0.0)}, "expected two finite numbers"),
        ({"state": (-1e-6, 0.0)}, "where the laws of magnet and spring hold"),
        ({"times": []}, "times: expected ascending numbers"),
        ({"times": [1e-3, 0.0]}, "times: expected ascending numbers"),
        ({"times": [-1e-3, 0.0]}, "times: expected ascending numbers"),
    ],
)
def test_bad_arguments(options: dict[str, Any], sentence: str) -> None:
    hammer = hammers.crude()
    with pytest.raises(ph.InputError) as error:
        ph.simulate(hammer, ph.PulseTrain(hammer.waveform), **options)
    message = str(error.value)
    assert sentence in message
    assert "\n" not in message
    assert not message.endswith(".")


def test_a_drive_without_end_needs_a_duration() -> None:
    with refused("duration"):
        ph.simulate(hammers.shelf(), ph.SineForce(1.0, 100.0))


def test_a_state_behind_a_rigid_backstop() -> None:
    hammer = hammers.made_of(spring=hammers.preload(-4.0), pack=hammers.power(), backstop=hammers.rigid(0.5))
    with refused("state"):
        ph.simulate(hammer, hammers.idle(), state=(STOP - 1e-9, 0.0))


def test_no_state_of_rest_to_start_from() -> None:
    hammer = hammers.made_of(spring=hammers.preload(1.0), backstop=hammers.hertz())
    with refused("rest"):
        ph.simulate(hammer, hammers.idle())


def test_defaults() -> None:
    hammer = hammers.crude()
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=[0.0, 1e-3]))
    assert motion.end == 1e-3 + CYCLE
    assert motion.x[0] == ph.rest_state(hammer)
    assert motion.v[0] == 0.0
    assert motion.t[0] == 0.0
    assert motion.t[-1] == motion.end
    assert motion.ok
    assert motion.message == ""
    text = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration="2 ms")
    assert text.end == 2e-3


@pytest.mark.parametrize("tolerance", [1e-5, 1e-6, 1e-8])
def test_coarse_tolerances_still_meet_the_first_contact(tolerance: float) -> None:
    """Also at the largest permitted tolerance: fewer steps, a valid result."""
    hammer = hammers.crude()
    drive = ph.PulseTrain(hammer.waveform)
    fine = ph.simulate(hammer, drive)
    coarse = ph.simulate(hammer, drive, tolerance=tolerance)
    assert coarse.ok
    assert coarse.steps < fine.steps
    assert coarse.dots[0].struck
    touch = coarse.dots[0].flight_time
    assert touch is not None
    # Every step on the way may err by the tolerance.
    steps = int(np.searchsorted(coarse._record.nodes[:, 0], touch))
    assert touch == pytest.approx(fine.dots[0].flight_time, rel=steps * tolerance)


def test_a_tighter_tolerance_is_closer_to_the_truth() -> None:
    hammer = hammers.crude()
    errors = [
        hammers.compare(hammer, ph.PulseTrain(hammer.waveform), 4e-3, whole=True, tolerance=tolerance).error
        for tolerance in (1e-7, 1e-9, 1e-11, 1e-13)
    ]
    assert errors[1] < 0.2 * errors[0]
    assert errors[2] < 0.2 * errors[1]
    assert errors[3] < 0.2 * errors[2]
    assert errors[3] < 1e-11


def test_the_ledger_can_be_asked_for_at_once() -> None:
    hammer = hammers.crude()
    drive = ph.PulseTrain(hammer.waveform)
    assert ph.simulate(hammer, drive, ledger=True).energy == ph.simulate(hammer, drive).energy
