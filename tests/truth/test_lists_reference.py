"""Random hammer files with lists of forces and contacts, against the oracle for lists.

The oracle knows a contact as a mode with events; the kernel integrates the sum of all elastic contacts. A run
is compared as long as a start moved by 1e-12 of the stroke changes the displacement by less than 1e-10.
"""

import math

import numpy as np
import pytest
from tests.hammers import DRAWS
from tests.oracle.list_laws import Constant, Contact, Drive, Friction, Piece, Spring, Stop, System, gravity
from tests.oracle.list_steps import Run
from tests.oracle.lists import simulate

import printhammer as ph
from printhammer.run.motion import Motion

MANY, FEWER = 25 * DRAWS // 2, 10 * DRAWS  # Random lists of each seed of the slow tests
END = 6e-3
STROKE = 1e-3


def draw(
    rng: np.random.Generator, *, dry: bool = False, front: bool = False, lossy: bool = False
) -> tuple[ph.Hammer, ph.PulseTrain, System]:
    """Return a hammer with a rigid backstop at 0, its drive, and the same system for the oracle.

    With `dry`, the hammer has dry friction; with `front`, also a rigid stop on the paper side; with `lossy`,
    most of its contacts are damped.
    """

    def log(low: float, high: float) -> float:
        return float(low * (high / low) ** rng.random())

    mass, restitution, angle = 1e-3, float(rng.uniform(0.1, 0.9)), float(rng.uniform(-1.5, 1.5))
    preload, stiffness, amplitude, width = -log(0.05, 0.5), log(50.0, 1e3), log(1.0, 6.0), log(0.5e-3, 2e-3)
    hammer = ph.Hammer.build(
        mass,
        spring={"law": "preload", "preload": preload, "stiffness": stiffness},
        backstop={"law": "rigid", "position": 0.0, "restitution": restitution},
        waveform={"shape": "half-sine", "amplitude": f"{amplitude!r} N", "width": width},
    )
    terms: dict[str, dict[str, object]] = {"force.weight": {"law": "gravity", "angle": angle}}
    forces: list[Spring | Constant] = [Spring(stiffness, preload), gravity(mass, angle)]
    if rng.random() < 0.5:
        k, cubic, center = log(10.0, 500.0), log(1e6, 1e8), float(rng.uniform(0.0, STROKE))
        terms["force.cubic"] = {"law": "cubic", "stiffness": k, "cubic": cubic, "center": center}
        forces.append(Spring(k, 0.0, center, cubic))
    contacts = []
    for i in range(int(rng.integers(1, 5))):
        side = "back" if rng.random() < 0.25 else "front"
        position = float(rng.uniform(0.02, 0.3) if side == "back" else rng.uniform(0.3, 1.0)) * STROKE
        exponent = 1.5 if rng.random() < 0.5 else 1.0
        k = log(1e3, 1e6) * (1e4**0.5 if exponent == 1.5 else 1.0)
        law = "hertz" if exponent == 1.5 else "linear"
        terms[f"contact.c{i}"] = {"law": law, "side": side, "position": position, "stiffness": k}
        loss = log(0.02, 2.0) if lossy and rng.random() < 0.8 else 0.0
        if loss:
            terms[f"contact.c{i}"]["damping"] = loss
        contacts.append(Contact(f"c{i}", side, position, k, exponent, loss))
    frictions = []
    if dry:
        kinetic = log(0.1, 1.0)
        static = kinetic * (1.0 if rng.random() < 0.3 else float(rng.uniform(1.0, 2.5)))
        terms["force.guide"] = {"law": "friction", "kinetic": kinetic, "static": static}
        frictions.append(Friction(kinetic, static))
        if rng.random() < 0.3:
            terms["force.seal"] = {"law": "friction", "kinetic": 0.05}
            frictions.append(Friction(0.05, 0.05, "seal"))
    stops = [Stop("backstop", "back", 0.0, restitution)]
    if front:
        place, bounce = float(rng.uniform(0.5, 1.0)) * STROKE, float(rng.uniform(0.0, 0.9))
        hammer = hammer.replace("pack", {"law": "rigid", "front": place, "restitution": bounce})
        stops.append(Stop("front", "front", place, bounce))
    for key, term in terms.items():
        hammer = hammer.replace(key, term)
    period, pulses = width + log(0.2e-3, 2e-3), 3
    pieces = tuple(
        Piece(n * period, n * period + width, amplitude=amplitude, rate=math.pi / width)
        for n in range(pulses)
    )
    system = System(
        mass, tuple(forces), (Drive(pieces),), tuple(frictions), contacts=tuple(contacts), stops=tuple(stops)
    )
    return hammer, ph.PulseTrain(hammer.waveform, period=period, pulses=pulses), system


def horizon(system: System, x: float, v: float, times: np.ndarray, truth: Run) -> int:
    """Return the number of times up to which a start moved by 1e-12 strokes gives the same motion."""
    moved = simulate(system, x + 1e-12 * STROKE, v, END)
    apart = np.abs(moved.at(times)[0] - truth.at(times)[0]) > 1e-10 * STROKE
    return int(np.argmax(apart)) if apart.any() else times.size


def check(
    seed: int, count: int, *, dry: bool = False, front: bool = False, lossy: bool = False
) -> tuple[int, int, int]:
    """Compare random hammers; return the numbers of closings, sticking phases and impacts compared."""
    kind = 1 + 2 * front + 4 * lossy
    rng = np.random.default_rng([38, seed, kind] if dry or front or lossy else [38, seed])
    closings = sticks = impacts = 0
    times = np.linspace(0.0, END, 121)
    # At 1e-12, one of 160 hammers, with 18 closings of Hertz contacts, differs by 1.1e-8 strokes.
    tolerance = 1e-13 if front else 1e-12
    for _ in range(count):
        hammer, drive, system = draw(rng, dry=dry, front=front, lossy=lossy)
        x, v = float(rng.uniform(0.05, 0.3)) * STROKE, float(rng.uniform(-0.5, 0.5))
        motion = ph.simulate(hammer, drive, duration=END, times=times, state=(x, v), tolerance=tolerance)
        truth = simulate(system, x, v, END)
        stop = horizon(system, x, v, times, truth)
        assert abs(motion.energy.residual) < 1e-8 * motion.energy.throughput
        np.testing.assert_allclose(motion.x[:stop], truth.at(times[:stop])[0], rtol=0.0, atol=1e-8 * STROKE)
        end = float(times[stop - 1])
        for contact in system.contacts:
            mine = [each for each in motion.closings if each.contact == contact.name and not each.initial]
            found = [each.t_in for each in mine if each.t_in < end]
            expected = [time for time in truth.times("touch", contact.name) if 0.0 < time < end]
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10)
            closings += len(found)
        # Bounces slower than the speed below are left to the definition of rest of either side.
        hits = [e.time for e in truth.events if e.kind == "impact" and abs(e.v) > 1e-3 and e.time < end]
        blows = [each.t_in for each in motion.contacts if abs(each.v_out or 0.0) > 1e-3 and each.t_in < end]
        np.testing.assert_allclose(blows, hits, rtol=0.0, atol=1e-10)
        impacts += len(blows)
        sticks += check_sticks(motion, truth, end)
    return closings, sticks, impacts


def check_sticks(motion: Motion, truth: Run, end: float) -> int:
    """Compare the sticking phases up to a time; return their number."""
    mine = [(each.t_in, each.t_out) for each in motion.sticks if each.t_in < end]
    found: list[tuple[float, float | None]] = []
    for event in truth.events:
        if event.kind == "stick":
            found.append((event.time, None))
        elif event.kind == "release" and found and found[-1][1] is None:
            found[-1] = (found[-1][0], event.time)
    found = [each for each in found if each[0] < end]
    assert len(mine) == len(found)
    for (t_in, t_out), (time_in, time_out) in zip(mine, found, strict=True):
        assert t_in == pytest.approx(time_in, abs=1e-10)
        if t_out is not None and t_out < end:
            assert t_out == pytest.approx(time_out, abs=1e-10)
    return len(mine)


@pytest.mark.parametrize("seed", [0, 1])
def test_random_lists(seed: int) -> None:
    assert check(seed, 6)[0] > 12


@pytest.mark.slow
@pytest.mark.parametrize("seed", [100, 101])
def test_many_random_lists(seed: int) -> None:
    """Seeds up to 119, of 50 lists each, passed when the lists were added."""
    assert check(seed, MANY)[0] > 2 * MANY


@pytest.mark.parametrize("seed", [0, 1])
def test_random_lists_with_dry_friction(seed: int) -> None:
    closings, sticks, _impacts = check(seed, 6, dry=True)
    assert closings > 0
    assert sticks > 3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [100, 101])
def test_many_random_lists_with_dry_friction(seed: int) -> None:
    closings, sticks, _impacts = check(seed, MANY, dry=True)
    assert closings > MANY
    assert sticks > MANY // 2


def test_random_lists_with_damped_contacts_and_dry_friction_between_two_stops() -> None:
    """All forces and contacts in each hammer; the slow tests draw hammers with fewer of them."""
    closings, sticks, impacts = check(4, 6, dry=True, front=True, lossy=True)
    assert closings > 6
    assert sticks > 0
    assert impacts > 5


@pytest.mark.slow
@pytest.mark.parametrize("seed", [200, 201])
def test_many_random_lists_between_two_stops(seed: int) -> None:
    assert check(seed, FEWER, dry=seed % 2 == 1, front=True)[2] > 3 * FEWER // 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", [300, 301])
def test_many_random_lists_with_damped_contacts(seed: int) -> None:
    assert check(seed, FEWER, dry=seed % 2 == 1, lossy=True)[0] > 3 * FEWER // 2
