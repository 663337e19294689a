"""Random states of the shipped hammers: the page gives the results of Python, up to rounding.

Runs whose masses differ by rounding, upwards or downwards, drift apart. Up to the time at which one differs
by more than 5e-13 of the range, the horizon of predictability, dots and energies have to agree to 1e-9, and
curves to single precision. Where runs drift apart, the page may take other steps than Python; the curves are
then compared at a tolerance at which the error of a run is below single precision.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.studio.node import Engine
from tests.studio.reading import STATE, drive_of

import printhammer as ph
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import SHAPES
from printhammer.hammer.hammer import Hammer, shipped
from printhammer.parts.damping import ViscousDamping
from printhammer.parts.spring.linear import PreloadSpring
from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.motion import Motion
from printhammer.run.problem import Problem
from printhammer.run.simulate import end_of_run
from printhammer.run.window import unsettled
from printhammer.studio import Shelf, bounds, live
from printhammer.studio.coil import open_constants
from printhammer.studio.controls import describe

pytestmark = pytest.mark.slow

NUDGES, DRIFT, AGREES = (5e-16, -5e-16), 5e-13, 1e-9
SINGLE, ASIDE = 1e-7, 1e-10
"""Rounding to single precision, and shift of the end of a step by rounding, as a fraction of the run."""
FINE = 1e-11
"""Tolerance at which the error of a run is far below single precision; arbitrary."""
NAME = "hendriks-1983-1"
LENGTH = 1e-15
"""Allowed difference of an indentation, m, a difference of places."""
STEEPEST = 3.0
"""Larger than the power of the indentation with which the force of any pack grows."""
THROUGHPUT = 1e-4  # Rounding moves the ends of steps, on which the sum of the works of all steps depends
WORKS = ("loading_work", "net_loss")
MOVED = {
    "mass": 1.1e-3,
    "spring.preload": -0.45,
    "spring.stiffness": 120.0,
    "force.weight.angle": 0.7,
    "force.guide.kinetic": 0.12,
    "force.guide.static": 0.25,
    "contact.make.position": 0.33e-3,
    "contact.make.stiffness": 1.3e5,
    "contact.make.damping": 0.5,
}
"""Constants of spring, forces and contacts as sliders of the page set them."""
REFUSED: list[tuple[dict[str, float], str]] = [
    ({"contact.make.position": -1e-5}, "expected a position not before backstop.position = 0 m"),
    ({"contact.second.position": 0.33e-3}, "expected another position than that of contact.make"),
    ({"force.guide.static": 0.05}, "force.guide.static = 0.05 N: expected at least force.guide.kinetic"),
]
"""Values that page and Python refuse, with what the page expects."""
FIELDS = ("flight_time", "impact_speed", "peak_force", "indentation", "contact_time", *WORKS)

State = dict[str, Any]


def random_state(name: str, rng: np.random.Generator) -> State:
    """State of a shipped hammer with changed constants, pulse and train, as set by sliders."""
    described = describe(ph.load(name))
    opening: State = {**STATE, "hammer": name, "views": [], **described["start"]}
    controls = described["constants"]
    constants = {}
    for k in rng.choice(len(controls), min(3, len(controls)), replace=False):
        control = controls[k]
        value = control["value"] * rng.uniform(0.9, 1.1)
        constants[control["key"]] = float(np.clip(value, control["low"], control["high"]))
    wave = dict(opening["waveform"] or described["waveform"])
    for key in ("amplitude", "voltage", "width"):
        if key in wave:
            wave[key] *= rng.uniform(0.8, 1.0)
    train = {"rate": rng.uniform(opening["low"], opening["high"]), "pulses": int(rng.integers(1, 10))}
    if rng.uniform() < 0.3 and wave["shape"] != "sine":
        train["pattern"] = "1" + "".join(rng.choice(["0", "1"], 4))
    return {**opening, "constants": constants, "waveform": wave, **train}


def posed(state: State) -> tuple[Hammer, Drive]:
    """Hammer and drive of a state, in Python."""
    hammer, constants = ph.load(state["hammer"]), state["constants"]
    further = open_constants(hammer)
    if state["waveform"]["quantity"] == "voltage" and "coil.resistance" in further:
        constants = {key: constant.si for key, (constant, _) in further.items()} | constants
    hammer = hammer.replace(constants) if constants else hammer
    return hammer, drive_of(state, hammer.waveform)


def run_of(state: State, nudge: float = 0.0, tolerance: float = DISPLAY_TOLERANCE) -> Motion:
    """Run of a state as in the page, with a relative change of the mass."""
    hammer, drive = posed(state)
    sine = state["waveform"]["shape"] == "sine"
    end = state["pulses"] / state["rate"] if sine else end_of_run(hammer, drive, None)
    hammer = hammer.replace({"mass": hammer.mass * (1.0 + nudge)}) if nudge else hammer
    problem = Problem(hammer, drive, (hammer.rest, 0.0), 0.0, tolerance)
    problem.max_steps = bounds.MOST_STEPS
    record = problem.run(end)
    motion = Motion(problem, record, end, record.nodes[:, 0].copy(), "default")
    motion.unsettled = "" if sine else unsettled(problem, record)
    return motion


def horizon_of(motion: Motion, others: list[Motion]) -> float:
    """Return the last of 2,000 times up to which a run differs from others by less than `DRIFT`."""
    times = np.linspace(0.0, min(run.end for run in (motion, *others)), 2000)
    states = np.stack([np.stack(run.curves_at(times)[:2]) for run in (motion, *others)])
    span = np.abs(states[0]).max(axis=1, keepdims=True)
    apart = (np.abs(states[1:] - states[0]) > DRIFT * np.maximum(span, 1e-12)).any(axis=(0, 1))
    return float(times[max(int(np.argmax(apart)) - 1, 0)]) if apart.any() else math.inf


def check_curves(motion: Motion, curve: State, horizon: float) -> None:
    """Compare the curves of a run with those of a page, which have single precision, up to a given time."""
    data = curve["data"]
    t = data["t"][data["t"] <= min(horizon, motion.end)]
    assert t.size > 1
    places, _, drive, _, forces = motion.curves_at(t)
    for name, expected in {"x": places, "drive": drive}.items():
        np.testing.assert_allclose(
            data[name][: t.size], expected, rtol=0, atol=SINGLE * np.abs(expected).max()
        )
    # A velocity at an impact, or a force at the end of a step, has one value on either side of its jump.
    ends = motion.step_times
    after = np.minimum(np.searchsorted(ends, t), len(ends) - 1)
    before = np.maximum(after - 1, 0)
    end = ends[np.where(np.abs(ends[before] - t) < np.abs(ends[after] - t), before, after)]
    end = np.where(np.abs(end - t) <= ASIDE * motion.end, end, t)
    both = np.nextafter(end, 0.0), np.minimum(np.nextafter(end, math.inf), motion.end)
    sides = [motion.curves_at(at) for at in (t, *both)]
    curves = {"v": [side[1] for side in sides]}
    curves |= {f"F {name}": [side[4][name] for side in sides] for name in forces}
    named = {name for name in data if name.startswith("F ")}
    assert named >= {f"F {name}" for name in forces if np.any(forces[name])}
    for name in ("v", *sorted(named)):
        own = curves[name]
        error = np.min(np.abs(data[name][: t.size] - own), axis=0)
        assert error.max() <= SINGLE * np.abs(own[0]).max(), name


def check_dots_before(motion: Motion, shown: State, horizon: float) -> int:
    """Compare the dots of a run that end before a time; return their number."""
    # That a dot is lost is known at the end of the run alone.
    ends = [
        dot.fired_at + (dot.flight_time or 0.0) + (dot.contact_time or 0.0) if dot.struck else motion.end
        for dot in motion.dots
    ]
    before = next((k for k, end in enumerate(ends) if end >= horizon), len(ends))
    page = shown["dots"] if math.isinf(horizon) else shown["dots"][:before]
    for dot, own in zip(motion.dots[:before], page, strict=True):
        assert own["struck"] == dot.struck
        for name in FIELDS:
            expected = getattr(dot, name)
            assert (own[name] is None) == (expected is None), name
            if expected is not None:
                # A net loss is a difference of works, an indentation one of places.
                scale = max(abs(expected), abs(dot.loading_work or 0.0) if name in WORKS else 0.0)
                within = AGREES * scale + (LENGTH if name == "indentation" else 0.0)
                if dot.indentation and dot.peak_force and name in ("peak_force", *WORKS):
                    # A dot that only just touches has force and work of an indentation that may differ.
                    of_force = STEEPEST / dot.indentation if name == "peak_force" else 1.0
                    within += of_force * dot.peak_force * LENGTH
                assert own[name] == pytest.approx(expected, rel=0.0, abs=within), name
    return before


def horizon_among(state: State, motion: Motion, tolerance: float = DISPLAY_TOLERANCE) -> float:
    """Return the horizon of a run of a state: the first of `NUDGES` to lead elsewhere ends it."""
    return horizon_of(motion, [run_of(state, nudge, tolerance) for nudge in NUDGES])


def check_state(engine: Engine, fine: Engine, state: State) -> str:
    """Compare the curves and dots of a state; return the compared quantities."""
    frames = engine.work("curves", state)
    if "refusal" in frames[0]:
        with pytest.raises(ph.InputError):
            run_of(state)
        return "refused"
    motion = run_of(state)
    horizon = horizon_among(state, motion)
    curve, shown = frames
    if math.isinf(horizon):
        check_curves(motion, curve, horizon)
    else:
        exact = run_of(state, tolerance=FINE)
        check_curves(exact, fine.work("curves", state)[0], horizon_among(state, exact, FINE))
    before = check_dots_before(motion, shown, horizon)
    if math.isfinite(horizon):
        return f"{before} dots"
    assert (curve["status"], curve["steps"]) == (motion.status, motion.steps)
    assert bool(curve["message"]) == bool(motion.message or motion.unsettled)
    check_energies(motion, shown)
    return "whole"


def check_energies(motion: Motion, shown: State) -> None:
    """Compare the energy ledger of a run with that of a page."""
    ledger = motion.energy
    for name, value in shown["energy"].items():
        expected = getattr(ledger, name)
        scale = max(abs(expected), 1e-3 * abs(ledger.throughput))
        within = (THROUGHPUT if name == "throughput" else AGREES) * scale
        assert value == pytest.approx(expected, rel=0.0, abs=within), name


def check_dots(engine: Engine, wave: dict[str, Any]) -> None:
    """Compare the dots of a pulse; the steps of the runs may differ."""
    state = {**STATE, "hammer": NAME, "waveform": wave, "rate": 900.0, "pulses": 3}
    own = engine.work("curves", state)[1]["dots"]
    for dot, other in zip(run_of(state).dots, own, strict=True):
        assert dot.struck == other["struck"]
        assert other["flight_time"] == pytest.approx(dot.flight_time, rel=1e-5)
        assert other["peak_force"] == pytest.approx(dot.peak_force, rel=1e-4)


def test_a_page_fires_records_and_drivers_of_the_coil(tmp_path: Path) -> None:
    hammer = ph.load(NAME)
    times, values = [0.0, 5e-5, 1.2e-4, 2e-4, 2.4e-4], [0.0, 1.4, 2.1, 1.6, 0.0]
    record = {"shape": "sampled", "times": times, "values": values, "quantity": "current"}
    with Engine(Shelf(hammer, only=True), tmp_path) as engine:
        check_dots(engine, record)
        check_dots(engine, {"shape": "rail", **describe(hammer)["rail"]})
        state = {**STATE, "hammer": NAME, "waveform": {**record, "times": times[::-1]}}
        (refused,) = engine.work("curves", state)
        assert "expected strictly increasing times" in refused["refusal"]


def run_in_full(hammer: Hammer, drive: Drive, nudge: float) -> Motion:
    """Run of a device at the tolerance of the page, with a mass that differs by a relative amount."""
    hammer = hammer.replace({"mass": hammer.mass * (1.0 + nudge)}) if nudge else hammer
    problem = Problem(hammer, drive, (hammer.rest, 0.0), 0.0, DISPLAY_TOLERANCE)
    record = problem.run(end_of_run(hammer, drive, None))
    return Motion(problem, record, float(record.nodes[-1, 0]), record.nodes[:, 0].copy(), "default")


@pytest.mark.parametrize(
    ("dry", "front", "damping"), [(False, False, 0.4), (True, False, None), (False, True, None)]
)
def test_a_page_follows_forces_and_contacts(
    tmp_path: Path, dry: bool, front: bool, damping: float | None
) -> None:
    contact = {"law": "hertz", "side": "front", "position": 0.3e-3, "stiffness": 1e5}
    hammer = ph.Hammer.build(1e-3, name="listed").replace(
        {
            "spring": {"law": "preload", "preload": -0.5, "stiffness": 100.0},
            "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.3},
            "force.weight": {"law": "gravity", "angle": "60 deg"},
            "contact.make": contact,
            "contact.second": {**contact, "position": 0.36e-3},
        }
    )
    if dry:
        hammer = hammer.replace("force.guide", {"law": "friction", "kinetic": 0.1, "static": 0.3})
    if damping:
        hammer = hammer.replace("contact.make.damping", damping)
    if front:
        hammer = hammer.replace("pack", {"law": "rigid", "front": 0.4e-3, "restitution": 0.6})
    assert describe(hammer)["rigid_front"] == front
    wave = {"shape": "half-sine", "amplitude": 3.0, "width": 1.5e-3, "quantity": "force"}
    state = {**STATE, "hammer": "listed", "waveform": wave, "rate": 300.0, "pulses": 3}
    moved = {key: MOVED[key] for key in MOVED if key in hammer.constants}
    with Engine(Shelf(hammer, only=True), tmp_path) as engine:
        shown = [engine.work("curves", {**state, "constants": constants}) for constants in ({}, moved)]
        refused = [engine.work("curves", {**state, "constants": {**moved, **wrong}}) for wrong, _ in REFUSED]
    drive = drive_of(state, None)
    for device, (curve, dots) in zip((hammer, hammer.replace(moved)), shown, strict=True):
        motion, *others = (run_in_full(device, drive, nudge) for nudge in (0.0, *NUDGES))
        horizon = horizon_of(motion, others)
        assert len(motion.closings) >= 2
        assert (curve["status"], curve["message"]) == ("ok", "")
        assert curve["contacts"] == describe(device)["contacts"]
        check_curves(motion, curve, horizon)
        if math.isinf(horizon):
            assert curve["steps"] == motion.steps
            check_energies(motion, dots)
    for (wrong, expected), frames in zip(REFUSED, refused, strict=True):
        if set(wrong) <= set(hammer.constants):
            assert expected in frames[0]["refusal"]
            with pytest.raises(ph.InputError):
                hammer.replace({**moved, **wrong})


def oscillators(count: int) -> list[ph.Hammer]:
    """Linear oscillators without a pack, the first without damping."""
    rng = np.random.default_rng(38)
    made = []
    for k in range(count):
        stiffness, quality = 10.0 ** rng.uniform(1.0, 4.0), 10.0 ** rng.uniform(-1.0, 1.5)
        damping = 0.0 if k == 0 else math.sqrt(1e-3 * stiffness) / quality
        made.append(
            ph.Hammer.build(
                1e-3,
                name=f"oscillator-{k}",
                spring=PreloadSpring(preload=0.0, stiffness=stiffness),
                damping=ViscousDamping(coefficient=damping),
            )
        )
    return made


def test_a_page_waits_for_an_oscillator_without_a_pack(tmp_path: Path) -> None:
    wave = {"shape": "half-sine", "amplitude": 3.0, "quantity": "force"}
    hammers, settled = oscillators(12), 0
    with Engine(Shelf(*hammers, only=True), tmp_path) as engine:
        for k, hammer in enumerate(hammers):
            width = 10.0 ** (-4.0 + k % 3)
            own = {"waveform": {**wave, "width": width}, "rate": 20.0, "pulses": 2}
            curve = engine.work("curves", {**STATE, "hammer": hammer.name, **own})[0]
            fired = SHAPES["half-sine"](amplitude=3.0, width=width, quantity="force")
            drive = ph.PulseTrain(fired, rate=20.0, pulses=2)
            motion = ph.simulate(hammer, drive, tolerance=DISPLAY_TOLERANCE)
            assert curve["status"] == "ok"
            assert curve["data"]["t"][-1] == pytest.approx(motion.end, rel=1e-12)
            assert bool(curve["message"]) == bool(motion.unsettled)
            settled += not motion.unsettled
    assert 0 < settled < 12


def test_the_page_agrees_with_python_for_500_states(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng, names = np.random.default_rng(36), shipped()
    counts: dict[str, int] = {}
    (tmp_path / "fine").mkdir()
    with Engine(Shelf(), tmp_path) as engine, monkeypatch.context() as finer:
        finer.setattr(live, "DISPLAY_TOLERANCE", FINE)
        with Engine(Shelf(), tmp_path / "fine") as fine:
            for k in range(500):
                compared = check_state(engine, fine, random_state(names[k % len(names)], rng))
                counts[compared] = counts.get(compared, 0) + 1
    assert counts["whole"] > 250
    assert counts.get("refused", 0) < 100
