"""The tangent flow against differences of runs, for all kinds of parts, drives and contacts.

Runs of tolerance 1e-13, central differences extrapolated after Richardson, touches faster than 1 mm/s.
"""

from pathlib import Path

import numpy as np
import pytest
from tests import hammers
from tests.hammers import (
    BACKSTOPS,
    MAGNETS,
    PACKS,
    SPRINGS,
    STOP,
    Draw,
    crude,
    drives,
    idle,
    interpreted,
    made_of,
)
from tests.oracle.integrator import reference
from tests.tangents import SHARP, before_slow_touches, deviation, richardson, scaled

import printhammer as ph
from printhammer.derivatives.states import TangentMap, tangent_map
from printhammer.hammer.equilibrium import rest_state
from printhammer.kernel.model.modes import (
    BACKSTOP,
    BACKSTOP_RELEASED,
    FREE,
    LOADING,
    PACK_RELEASED,
    RELOADING,
    UNLOADING,
)
from printhammer.run.problem import Problem

WANTED = 1e-6
MOVING = STOP + 20e-6, -0.4


@pytest.mark.parametrize("end", [0.15e-3, 0.3e-3, 0.4e-3, 0.45e-3, 0.55e-3, 0.8e-3, 1.0e-3, 1.3e-3])
def test_a_single_pulse(end: float) -> None:
    """The end lies in flight, in the pack on both branches, in the backstop, or between rebounds."""
    hammer = crude()
    assert deviation(hammer, ph.PulseTrain(hammer.waveform), 0.0, end) < WANTED


@pytest.mark.parametrize("period", [1.35e-3, 1.05e-3, 0.8e-3])
def test_trains(period: float) -> None:
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform, period=period, pulses=3)
    end = before_slow_touches(hammer, drive, 2.4e-3)
    assert end > 1.2e-3
    assert deviation(hammer, drive, 0.0, end, size=1e-5) < WANTED


@pytest.mark.parametrize(
    ("start", "branch"), [(0.3e-3, LOADING), (0.36e-3, UNLOADING), (0.5e-3, FREE), (0.56e-3, BACKSTOP)]
)
@pytest.mark.parametrize(
    ("end", "branch_at_end"), [(0.42e-3, UNLOADING), (0.73e-3, BACKSTOP), (0.79e-3, FREE)]
)
def test_from_contact_to_contact(start: float, branch: int, end: float, branch_at_end: int) -> None:
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform)
    if start > end:
        start, branch = 0.2e-3, FREE
    found = tangent_map(hammer, drive, start, end, tolerance=SHARP)
    assert (found.branch_at_start, found.branch_at_end) == (branch, branch_at_end)
    assert found.matrix.shape == (2 + (branch_at_end == UNLOADING), 2 + (branch == UNLOADING))
    assert deviation(hammer, drive, start, end) < WANTED


def test_starts_inside_contacts() -> None:
    """Runs start behind the backstop position and beyond the pack front."""
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform)
    rest = rest_state(hammer)
    front = hammers.FRONT
    for state in ((rest, 0.2), (rest + 1e-6, -0.1), (front + 20e-6, 1.0), (front + 60e-6, -0.3)):
        assert deviation(hammer, drive, 0.0, 0.5e-3, state) < WANTED


@pytest.mark.parametrize("end", [0.4e-3, 0.8e-3, 1.9e-3])
def test_differences_of_the_reference(end: float) -> None:
    """Against the independent reference: two pulses, the second during the settle-out."""
    hammer = crude()
    drive = ph.PulseTrain(hammer.waveform, at=[0.0, 1.1e-3])
    rest = rest_state(hammer)
    units = np.array([hammers.STROKE, 2.0])

    def at_end(move: np.ndarray) -> np.ndarray:
        run = reference(
            hammer, drive, end, state=(rest + move[0], move[1]), times=np.array([0.0, end]), tolerance=1e-14
        )
        return np.array([run.x[-1], run.v[-1]])

    columns = []
    for j in range(2):

        def difference(step: float, j: int = j) -> np.ndarray:
            move = step * units * np.eye(2)[j]
            return (at_end(move) - at_end(-move)) / (2.0 * step * units[j])

        columns.append(richardson(difference, 1e-4, 4, units))
    truth = scaled(np.array(columns).T, (units[0], units[1]))
    found = scaled(tangent_map(hammer, drive, 0.0, end, tolerance=SHARP).matrix[:2], (units[0], units[1]))
    assert np.linalg.norm(found - truth) < WANTED * np.linalg.norm(truth)


@pytest.mark.parametrize("depth", [1e-11, 1e-12, 1e-13, 1e-15])
@pytest.mark.parametrize("pack", ["power", "curve"])
def test_a_contact_that_is_hardly_one(pack: str, depth: float) -> None:
    """A very light touch of a pack leaves the flow as it is without a pack.

    Thrown back from where a fall from the depth comes by, the armature comes to that depth.
    """
    parts = {"magnet": MAGNETS["inverse-root"], "spring": SPRINGS["linear"], "backstop": BACKSTOPS["hertz"]}
    free, struck = made_of(**parts), made_of(**parts, pack=PACKS[pack])
    drive = idle("current")
    with interpreted():
        fall = ph.simulate(free, drive, duration=0.1e-3, state=(hammers.FRONT + depth, 0.0), tolerance=SHARP)
        state = float(fall.x[-1]), -float(fall.v[-1])
        motion = ph.simulate(struck, drive, duration=0.2e-3, state=state, tolerance=SHARP)
        assert [contact.surface for contact in motion.contacts] == ["pack"]
        found, wanted = (tangent_map(hammer, drive, 0.0, 0.2e-3, state=state) for hammer in (struck, free))
    np.testing.assert_allclose(found.matrix, wanted.matrix, rtol=WANTED)


CASES = [
    ("inverse-root", "linear", "dashpot", "hertz", "train", 0.0, 0.6e-3),
    ("", "preload", "dashpot", "hertz", "train", 0.0, 0.85e-3),
    ("", "linear", "dashpot-pull", "rigid", "overlap", 0.0, 0.9e-3),
    ("inverse-root", "linear", "dashpot-pull", "hertz", "replace", 0.2e-3, 0.75e-3),
    ("", "preload", "curve", "hertz", "replace", 0.0, 1.0e-3),
    ("", "", "curve", "", "replace", 0.1e-3, 0.6e-3),
    ("", "linear", "curve", "elastomer", "sampled", 0.0, 0.9e-3),
    ("", "", "power", "", "trapezoid", 0.0, 0.8e-3),
    ("", "preload", "power", "rigid", "sharp", 0.0, 1.0e-3),
    ("inverse-root", "linear", "power", "rigid", "half-sine", 0.0, 0.7e-3),
    ("inverse-root", "", "curve", "rigid", "sampled", 0.02e-3, 0.12e-3),
    ("", "preload", "power", "elastomer", "half-sine", 0.0, 0.7e-3),
    ("inverse-root", "preload", "power", "elastomer-pull", "single", 0.0, 0.3e-3),
    ("", "linear", "dashpot", "hertz-no-pull", "sine", 0.2e-3, 1.1e-3),
    ("inverse-root", "linear", "power", "hertz-no-pull", "train", 0.0, 0.6e-3),
    ("table", "linear", "power", "hertz", "half-sine", 0.0, 0.5e-3),
    ("table", "", "dashpot", "hertz", "overlap", 0.1e-3, 0.5e-3),
]


def hammer_of(magnet: str, spring: str, pack: str, backstop: str, folder: Path) -> ph.Hammer:
    chosen = hammers.magnet_table(folder) if magnet == "table" else MAGNETS[magnet]
    return made_of(magnet=chosen, spring=SPRINGS[spring], pack=PACKS[pack], backstop=BACKSTOPS[backstop])


def drive_of(magnet: str, name: str) -> ph.PulseTrain | ph.SineForce:
    return drives("current" if magnet else "force")[name]


# Between them these have every part, every mode and a table; the others are slow.
QUICK = (0, 2, 6, 9, 10, 11, 12, 13, 15)


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=[] if k in QUICK else [pytest.mark.slow]) for k, case in enumerate(CASES)],
    ids=["-".join(word or "none" for word in case[:5]) for case in CASES],
)
def test_parts_and_drives(case: tuple[str, str, str, str, str, float, float], tmp_path: Path) -> None:
    magnet, spring, pack, backstop, name, start, end = case
    hammer = hammer_of(magnet, spring, pack, backstop, tmp_path)
    drive = drive_of(magnet, name)
    with interpreted():
        assert before_slow_touches(hammer, drive, end, MOVING) == end
        found = tangent_map(hammer, drive, start, end, state=MOVING, tolerance=SHARP)
        assert any(
            deviation(hammer, drive, start, end, MOVING, found, size=size, levels=levels) < WANTED
            for size, levels in ((1e-5, 2), (1e-4, 4))
        )


def test_the_cases_pass_every_mode(tmp_path: Path) -> None:
    modes = set()
    for magnet, spring, pack, backstop, name, start, end in (CASES[k] for k in QUICK):
        hammer = hammer_of(magnet, spring, pack, backstop, tmp_path)
        with interpreted():
            nodes = Problem(hammer, drive_of(magnet, name), MOVING, 0.0, SHARP).run(end).nodes
        modes |= set(nodes[nodes[:, 0] >= start, 3].astype(int))
    assert {FREE, LOADING, UNLOADING, RELOADING, PACK_RELEASED, BACKSTOP, BACKSTOP_RELEASED} <= modes


def random_hammers(seed: int, count: int) -> None:
    draw = Draw(np.random.default_rng(seed), spread=0.1)
    printing = 0
    while printing < count:
        hammer = draw()
        period = draw.rng.uniform(0.8e-3, 1.6e-3)
        drive = ph.PulseTrain(hammer.waveform, period=period, pulses=3)
        end = before_slow_touches(hammer, drive, draw.rng.uniform(0.5e-3, 2.5e-3))
        start = draw.rng.choice([0.0, draw.rng.uniform(0.0, 0.8 * end)])
        errors = (deviation(hammer, drive, start, end, size=size) for size in (1e-4, 1e-5, 1e-3, 1e-6))
        assert any(error < WANTED for error in errors)
        printing += any(
            c.surface == "pack" for c in ph.simulate(hammer, drive, duration=end, points=2).contacts
        )


def test_random_hammers() -> None:
    random_hammers(1, 12)


@pytest.mark.slow
def test_many_random_hammers() -> None:
    random_hammers(2, 150)


@pytest.mark.slow
@pytest.mark.parametrize("magnet", ["inverse-root", ""], ids=lambda name: name or "none")
@pytest.mark.parametrize("pack", PACKS, ids=lambda name: name or "none")
def test_combinations_of_parts(magnet: str, pack: str, tmp_path: Path) -> None:
    """Every triple of magnet, pack and backstop is run, with each spring in turn."""
    rng = np.random.default_rng(3)
    names, springs = list(drives("current")), list(SPRINGS)
    turn = list(PACKS).index(pack) + bool(magnet)
    compared = 0
    for number, backstop in enumerate(BACKSTOPS):
        spring = springs[(turn + number) % len(springs)]
        hammer = hammer_of(magnet, spring, pack, backstop, tmp_path)
        drive = drive_of(magnet, names[rng.integers(len(names))])
        with interpreted():
            end = before_slow_touches(hammer, drive, rng.uniform(0.2e-3, 1.2e-3), MOVING)
            found: TangentMap = tangent_map(hammer, drive, 0.0, end, state=MOVING, tolerance=SHARP)
            if not (found.ok and found.smooth):
                continue
            errors = (
                deviation(hammer, drive, 0.0, end, MOVING, found, size=size, levels=levels)
                for size, levels in ((1e-5, 2), (1e-4, 4), (1e-3, 4))
            )
            assert any(error < WANTED for error in errors)
            compared += 1
    assert compared >= 4
