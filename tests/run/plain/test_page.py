"""Preparation of a run by a page: machine code of the entry points, compared with `Problem`."""

import math

import numpy as np
import pytest

import printhammer as ph
from printhammer.drive.trains import Drive
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.statics import MOST_PLACES, RESTS
from printhammer.run.plain.entries import compiled, numbers_of
from printhammer.run.plain.page import FITS, REFUSALS
from printhammer.run.problem import Problem
from printhammer.run.window import wait_of
from printhammer.support.arrays import FloatArray
from printhammer.support.roots import MOST_POINTS

ROLES = ("body", "damping", "spring", "pack", "backstop", "coil", "magnet")


def drive_of(hammer: Hammer) -> Drive:
    """Return the drive of a device: its pulse, or for an oscillator a sinusoidal force."""
    return ph.PulseTrain(hammer.waveform, rate=20.0, pulses=3) if hammer.waveform else ph.SineForce(0.3, 0.2)


def about_of(drive: Drive) -> FloatArray:
    about = np.empty(14)
    compiled("pulse")(drive.waveform.code, np.array(drive.waveform.numbers()), np.empty((8, 6)), about)
    return about


def posed(hammer: Hammer, drive: Drive) -> tuple[FloatArray, FloatArray, float, FloatArray]:
    """Constants, limits, rest position, and control with bounds, as computed by a page."""
    problem = Problem(hammer, drive, (hammer.rest, 0.0), 0.0, 2e-11)
    laws, numbers = problem.laws, numbers_of(hammer)
    constants, ends = np.zeros(problem.constants.size), np.empty(2)
    arrays = [np.array(numbers[role][1]) for role in ROLES]
    assert compiled("constants", laws)(*arrays, constants, ends) == constants.size
    limits = np.array(numbers["limits"][1])
    limits[:2] = ends
    room, out = MOST_POINTS * MOST_PLACES, np.empty(4)
    work = (np.empty(MOST_PLACES), np.empty((2, room)), np.empty((room, 3)))
    assert compiled("rest", laws)(constants, limits, *work, out) == RESTS
    rest, about = float(out[0]), about_of(drive)
    if laws.circuit:
        assert compiled("supply", laws)(constants, limits, about, out) == FITS
    quantity = float(("current", "force", "voltage").index(drive.quantity))
    period, start, scales = drive.period or math.nan, np.array([rest, 0.0]), np.empty(8)
    compiled("scales", laws)(constants, limits, quantity, about[2], period, start, 2e-11, scales)
    return constants, limits, rest, scales


def valve() -> Hammer:
    """Voice coil between two rigid stops; its law has neither a range nor a pack force."""
    return ph.Hammer.build(
        1e-3,
        magnet={"law": "moving-coil", "constant": 2.0},
        coil={"resistance": 4.0, "inductance": 5e-4},
        spring={"law": "preload", "preload": -0.1, "stiffness": 100.0},
        pack={"law": "rigid", "front": 1e-3, "restitution": 0.5},
        backstop={"law": "rigid", "position": 0.0, "restitution": 0.5},
        waveform={"shape": "rail", "voltage": "2 V", "width": "10 ms"},
    )


@pytest.mark.parametrize("name", ["hendriks-1983-1", "dot-peen", "duffing-holmes", "valve"])
def test_a_page_poses_the_problem_of_python(name: str) -> None:
    hammer = valve() if name == "valve" else ph.load(name)
    drive = drive_of(hammer)
    problem = Problem(hammer, drive, (hammer.rest, 0.0), 0.0, 2e-11)
    constants, _limits, rest, scales = posed(hammer, drive)
    used = problem.constants != 0.0
    np.testing.assert_allclose(constants[used], problem.constants[used], rtol=1e-15)
    assert rest == pytest.approx(hammer.rest, rel=1e-14, abs=1e-17)
    np.testing.assert_allclose(scales, [*problem.control, *problem.bounds], rtol=1e-14)


def test_a_page_finds_the_window_of_a_device() -> None:
    hammer = ph.load("hendriks-1983-1")
    assert hammer.waveform is not None
    assert hammer.front is not None
    drive = ph.PulseTrain(hammer.waveform)
    about, out = about_of(drive), np.empty(1)
    assert compiled("window")(about, hammer.rest, hammer.front, out) == 1
    problem = Problem(hammer, drive, (hammer.rest, 0.0), 0.0, 5e-7)
    wait, places = out[0], np.array([hammer.rest, hammer.front, *problem.scales, out[0]])
    while True:
        record = problem.run(wait)
        if compiled("is_window")(record.status, record.contacts, record.nodes, places, wait, out):
            break
        wait *= 2.0
    assert wait == wait_of(hammer)


def test_a_refusal_states_its_number() -> None:
    hammer = ph.load("hendriks-1983-1").replace("magnet.F0", "40 N")
    problem = Problem(hammer, drive_of(hammer), (1e-4, 0.0), 0.0, 2e-11)
    numbers = numbers_of(hammer)
    constants, ends, out = np.zeros(problem.constants.size), np.empty(2), np.empty(4)
    compiled("constants", problem.laws)(*(np.array(numbers[role][1]) for role in ROLES), constants, ends)
    limits = np.array([*ends, *numbers["limits"][1][2:]])
    room = MOST_POINTS * MOST_PLACES
    work = (np.empty(MOST_PLACES), np.empty((2, room)), np.empty((room, 3)))
    code = compiled("rest", problem.laws)(constants, limits, *work, out)
    with pytest.raises(ph.InputError) as refused:
        _ = hammer.rest
    wrong, expected = REFUSALS["rest"][code]
    assert wrong.format(*out) in str(refused.value)
    assert refused.value.expected == expected
