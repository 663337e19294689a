"""Random lists of forces and contacts against an integrator that shares no code with the package."""

import functools
import math
from typing import Any

import numpy as np
import pytest
from tests.oracle import lists as oracle
from tests.oracle.list_laws import Constant, Contact, Drive, Piece, Spring, Stop, System, gravity
from tests.oracle.list_steps import Run

import printhammer as ph

SHORT, LONG = 24, 1000
EQUAL = 1e-9
"""Tolerance of times of contacts, as a fraction of the run."""


def random_case(rng: np.random.Generator) -> tuple[ph.Hammer, System, float, float]:
    """Draw a hammer, the same system for the oracle, the width of its pulse and the time scale, s."""
    mass = 10.0 ** rng.uniform(-4.0, -2.0)
    stroke = 10.0 ** rng.uniform(-4.0, -2.0)
    time = 10.0 ** rng.uniform(-3.5, -2.0)
    unit = mass * stroke / time**2
    parts: dict[str, Any] = {}
    forces: list[Any] = []
    preload, stiffness = -unit * rng.uniform(0.2, 1.0), unit / stroke * rng.uniform(0.0, 1.0)
    if rng.random() < 0.7:
        parts["spring"] = {"law": "preload", "preload": preload, "stiffness": stiffness}
        forces.append(Spring(stiffness, preload))
    else:
        parts["force.own"] = {"law": "spring", "preload": preload, "stiffness": stiffness, "position": 0.0}
        forces.append(Spring(stiffness, preload))
    if rng.random() < 0.5:
        angle = rng.uniform(-0.5, 0.5) * math.pi
        parts["force.weight"] = {"law": "gravity", "angle": angle}
        forces.append(gravity(mass, angle))
    if rng.random() < 0.5:
        push = 0.1 * unit * rng.uniform(-1.0, 1.0)
        parts["force.push"] = {"law": "constant", "force": push}
        forces.append(Constant(push))
    if rng.random() < 0.3:
        cubic = unit / stroke**3 * rng.uniform(0.0, 1.0)
        parts["force.cubic"] = {"law": "cubic", "stiffness": 0.0, "cubic": cubic, "center": 0.1 * stroke}
        forces.append(Spring(0.0, 0.0, 0.1 * stroke, cubic))
    contacts = []
    for k in range(rng.integers(1, 5)):
        side = "front" if rng.random() < 0.7 else "back"
        place = stroke * (rng.uniform(0.2, 1.0) if side == "front" else rng.uniform(0.05, 0.5))
        law, n = ("linear", 1.0) if rng.random() < 0.6 else ("hertz", 1.5)
        size = unit / stroke**n * 10.0 ** rng.uniform(-1.0, 2.5)
        parts[f"contact.c{k}"] = {"law": law, "side": side, "position": place, "stiffness": size}
        contacts.append(Contact(f"c{k}", side, place, size, n))
    restitution = rng.uniform(0.2, 0.9)
    parts["backstop"] = {"law": "rigid", "position": 0.0, "restitution": restitution}
    amplitude, width = unit * rng.uniform(2.0, 6.0), time * rng.uniform(0.5, 2.0)
    parts["waveform"] = {"shape": "rectangle", "amplitude": f"{amplitude!r} N", "width": width}
    parts["waveform"] |= {"rise": 0.0, "decay": 0.0}
    hammer = ph.Hammer.build(mass).replace(parts)
    system = System(
        mass,
        tuple(forces),
        (Drive((Piece(0.0, width, amplitude),)),),
        (),
        tuple(contacts),
        (Stop("backstop", "back", 0.0, restitution),),
        length=stroke,
        speed=stroke / time,
    )
    return hammer, system, width, time


def times_of(motion: ph.Motion, contact: Contact, name: str, until: float) -> np.ndarray:
    """Return the times of closing (`t_in`) or opening (`t_out`) of a contact, s, before a time."""
    own = [each for each in motion.closings if each.contact == contact.name]
    times = [getattr(each, name) for each in own if not (name == "t_in" and each.initial)]
    return np.array([time for time in times if time is not None and time < until])


def check_contacts(motion: ph.Motion, cruder: ph.Motion, run: Run, system: System) -> int:
    """Compare all closings until the motion comes close to rest; return the number of compared closings.

    A time may differ by ten times as much as it does between two tolerances, where the motion is sensitive.
    """
    impacts = [event for event in run.events if event.kind == "impact"]
    slow = [event.time for event in impacts if abs(event.v) < 0.05 * system.speed]
    until = min([*slow, motion.end])
    compared = 0
    for contact in system.contacts:
        for kind, name in (("touch", "t_in"), ("leave", "t_out")):
            expected = np.array([time for time in run.times(kind, contact.name) if time < until])
            found, other = (times_of(each, contact, name, until) for each in (motion, cruder))
            assert found.shape == other.shape == expected.shape, contact
            assert np.all(np.abs(found - expected) <= EQUAL * motion.end + 10.0 * np.abs(other - found))
            compared += len(found)
    places = np.linspace(0.0, 0.999 * until, 40)
    (x, v), (other, _v) = motion.at(places), cruder.at(places)
    allowed = EQUAL * (system.length + np.abs(v) * motion.end) + 10.0 * np.abs(other - x)
    assert np.all(np.abs(x - run.at(places)[0]) <= allowed)
    return compared


def compare(seed: int) -> int:
    """Compare a random case; return the number of compared closings."""
    hammer, system, width, time = random_case(np.random.default_rng(seed))
    end = width + 4.0 * time
    # Without a velocity, an elastic motion would come back to its start and graze the backstop there.
    start = (0.0, 0.1 * system.speed)
    drive = ph.PulseTrain(hammer.waveform)
    run_at = functools.partial(ph.simulate, hammer, drive, duration=end, state=start)
    motion, cruder = run_at(tolerance=1e-13), run_at(tolerance=1e-12)
    assert motion.status == "ok"
    assert abs(motion.energy.residual) <= 1e-8 * motion.energy.throughput
    run = oracle.simulate(system, *start, end)
    return check_contacts(motion, cruder, run, system)


def test_random_lists_have_the_contacts_of_the_oracle() -> None:
    assert sum(compare(seed) for seed in range(SHORT)) > SHORT


@pytest.mark.slow
def test_a_thousand_random_lists_have_the_contacts_of_the_oracle() -> None:
    assert sum(compare(seed) for seed in range(SHORT, SHORT + LONG)) > LONG
