"""The window of a run: the last dot of a slow device is struck in every verb."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from tests import hammers

import printhammer as ph
from printhammer.control.learning.lines import Press, Rung
from printhammer.control.table.task import Task, single_of
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.damping import ViscousDamping
from printhammer.parts.pack.dashpot import DashpotPack
from printhammer.parts.spring.linear import PreloadSpring
from printhammer.printing.dots.nominal import nominal, single_pulses
from printhammer.printing.dots.trial import Case, attempt
from printhammer.printing.page.pattern import Pattern
from printhammer.run.effort import Effort
from printhammer.run.plain.posing import CYCLE
from printhammer.run.waits import waits_of
from printhammer.run.window import Single, is_enough, last_wait, least_wait, stays_away, wait_of
from printhammer.sweep.members import Base, Maker


def device(flight: float, way: float = 1e-3, held: float = 1.0, pull: float = 0.5) -> ph.Hammer:
    """A mass that a half-sine force throws onto a pack: `flight` is about the flight time, s, `way` in m.

    The spring holds it with a force, N. While it flies the spring takes back half a `pull` of the way: the
    weaker, the later the return, the stronger, the slower the touch.
    """
    mass = held * flight * flight / (pull * way)
    width = 0.3 * flight
    speed = way * (1.0 + 0.5 * pull) / (flight - 0.5 * width)
    return ph.Hammer.build(
        mass,
        spring=PreloadSpring(preload=-held, stiffness=0.1 * held / way),
        pack=DashpotPack(stiffness=200.0 * held / way, damping=0.5 * mass / flight, front=way),
        backstop=RigidBackstop(position=0.0, restitution=0.3),
        waveform=HalfSine(
            amplitude=0.5 * math.pi * (mass * speed / width + held), width=width, quantity="force"
        ),
    )


def test_the_hammer_of_the_paper_keeps_its_four_milliseconds() -> None:
    hammer = ph.load("hendriks-1983")
    assert wait_of(hammer) == CYCLE == 4e-3
    units = [hammer.replace({"mass": factor * hammer.mass}) for factor in (0.8, 1.0, 1.2, 1.5)]
    assert waits_of(units, [hammer.waveform] * len(units)).tolist() == [CYCLE] * len(units)


def test_a_slow_device_is_waited_for_until_it_has_struck_and_settled() -> None:
    relay, printer = ph.load("relay-5v"), ph.load("hendriks-1983")
    single = nominal(relay)
    wait = wait_of(relay)
    assert wait >= least_wait(relay.waveform) == CYCLE + relay.waveform.width
    assert wait >= 3.0 * single.flight_time
    motion = ph.simulate(relay, ph.PulseTrain(relay.waveform))
    assert motion.end == wait
    assert abs(motion.x[-1] - relay.rest) < 0.05 * (relay.front - relay.rest)
    many = single_pulses([relay, printer])
    assert [each.flight_time for each in many if each] == pytest.approx(
        [single.flight_time, nominal(printer).flight_time], rel=1e-6
    )
    assert waits_of([relay, printer], [relay.waveform, printer.waveform]).tolist() == [wait, wait_of(printer)]


def test_a_window_holds_three_flights_though_the_armature_rests_before() -> None:
    relay = ph.load("relay-5v")
    flight, rest = 5e-3, relay.rest
    for wait, enough in ((14e-3, False), (16e-3, True)):
        assert is_enough(relay, Single(True, flight, rest, 0.0), wait) is enough
    away = rest + 0.1 * (relay.front - rest)
    assert not is_enough(relay, Single(True, flight, away, 0.0), 16e-3)
    assert not is_enough(relay, Single(True, flight, rest, 0.1 * (relay.front - rest) / flight), 16e-3)


def test_the_relay_strikes_at_every_firing_on_its_map() -> None:
    relay = ph.load("relay-5v")
    chart = ph.frequency_map(relay, [20.0], pulses=3, times=64)
    assert chart["struck"].values.all()
    # The map shows the touch of the last firing.
    touch = float(chart["fired_at"].values[0, -1] + chart["flight_time"].values[0, -1])
    last = ph.simulate(relay, ph.PulseTrain(relay.waveform, rate=20.0, pulses=3)).dots[-1]
    assert touch == pytest.approx(last.fired_at + last.flight_time, abs=1e-6)
    assert float(chart["time"].values[-1]) > touch


def test_a_device_that_does_not_strike_or_settle_is_not_waited_for_without_end() -> None:
    bouncing = device(1e-3).replace({"backstop.restitution": 1.0, "pack.front": 0.1})
    push = bouncing.waveform.scaled(4.0)
    assert CYCLE < wait_of(bouncing, push) < 1.1
    free = hammers.made_of(spring=PreloadSpring(preload=0.0, stiffness=100.0))
    assert last_wait(free, push) <= wait_of(free, push) < 2.0 * last_wait(free, push)
    for hammer in (bouncing, free):
        motion = ph.simulate(hammer, ph.PulseTrain(push))
        assert "not at rest" in motion.unsettled
        assert motion.unsettled in json.loads(motion.to_json())["unsettled"]
        assert "at the end" in str(motion.summary())
        assert "longer run" in str(motion.summary())
        assert not ph.simulate(hammer, ph.PulseTrain(push), duration="1 ms").unsettled


def oscillators(count: int) -> Iterator[tuple[float, float, float, float, float]]:
    """Mass, kg, damping, N s/m, stiffness, N/m, of linear oscillators; force [N] and width [s] of a pulse."""
    random = np.random.default_rng(38)
    for _ in range(count):
        mass, time, quality, width = 10.0 ** random.uniform([-4.0, -4.0, -1.0, -4.0], [-1.0, -1.5, 1.5, -1.5])
        stiffness = mass / time**2
        yield mass, math.sqrt(mass * stiffness) / quality, stiffness, random.uniform(0.1, 5.0), width


def test_a_linear_oscillator_is_waited_for_until_its_exact_motion_has_settled() -> None:
    at_bound = 0
    for mass, damping, stiffness, force, width in oscillators(15):
        hammer = hammers.made_of(
            mass,
            spring=PreloadSpring(preload=0.0, stiffness=stiffness),
            damping=ViscousDamping(coefficient=damping),
        )
        push = Rectangle(amplitude=force, width=width, rise=0.0, decay=0.0, quantity="force")
        wait, least = wait_of(hammer, push), least_wait(push)
        assert waits_of([hammer, hammer], [push, push]).tolist() == [wait, wait]
        # Displacement and velocity of the exact motion during and after the force.
        system = np.array([[0.0, 1.0], [-stiffness / mass, -damping / mass]])
        away = np.array([force / stiffness, 0.0])
        thrown = [away - expm(system * t) @ away for t in np.linspace(0.0, width, 400)]
        after = np.linspace(0.0, wait - width, 4000)
        step, state = expm(system * after[1]), thrown[-1]
        swung = [state, *(state := step @ state for _ in after[1:])]
        times = np.concatenate([np.linspace(0.0, width, 400), width + after])
        x, v = np.concatenate([thrown, swung]).T

        def is_at_rest(end: float, part: float, x: Any = x, v: Any = v, times: Any = times) -> bool:
            reach = np.abs(x[times <= end]).max()
            at = np.searchsorted(times, end * (1.0 - 1e-12))
            return bool(abs(x[at]) <= part * reach and abs(v[at]) * end / 3.0 <= part * reach)

        if wait >= last_wait(hammer, push) and not is_at_rest(wait, 0.049):
            at_bound += 1
            assert ph.simulate(hammer, ph.PulseTrain(push)).unsettled
        else:
            assert is_at_rest(wait, 0.051)
        if wait > least:
            assert not is_at_rest(0.5 * wait, 0.04)
    assert 0 < at_bound < 12


def listed(random: np.random.Generator, *, dry: bool) -> tuple[ph.Hammer, HalfSine]:
    """A mass between a backstop and a contact spring, with weight and friction but no pack; its pulse."""
    mass, stiffness = 10.0 ** random.uniform([-4.0, 1.0], [-2.0, 3.0])
    way = 10.0 ** random.uniform(-4.0, -2.5)
    held = 0.2 * stiffness * way + 2.0 * mass * 9.81
    # Dry friction may exceed the force of the spring, and hold the armature anywhere.
    kinetic = random.uniform(0.1, 1.2) * held
    viscous = ViscousDamping(coefficient=0.3 * math.sqrt(mass * stiffness))
    hammer = hammers.made_of(
        mass,
        spring=PreloadSpring(preload=-held, stiffness=stiffness),
        backstop=RigidBackstop(position=0.0, restitution=random.uniform(0.0, 0.7)),
        damping=None if dry else viscous,
    )
    make = {"law": "linear", "side": "front", "position": 0.6 * way, "stiffness": 10.0 * stiffness}
    guide = {"law": "friction", "kinetic": kinetic, "static": 1.2 * kinetic}
    listed = {"force.weight": {"law": "gravity", "angle": "60 deg"}, "contact.make": make}
    time = math.sqrt(2.0 * mass * way / (4.0 * held))
    push = HalfSine(amplitude=5.0 * held, width=time, quantity="force")
    return hammer.replace({**listed, **({"force.guide": guide} if dry else {})}), push


@pytest.mark.slow
@pytest.mark.parametrize("dry", [False, True])
def test_a_device_with_contacts_and_without_a_pack_is_waited_for(dry: bool) -> None:
    random = np.random.default_rng(3801)
    for _ in range(25):
        hammer, push = listed(random, dry=dry)
        motion = ph.simulate(hammer, ph.PulseTrain(push))
        assert motion.ok
        if motion.unsettled:
            assert motion.end >= last_wait(hammer, push)
            continue
        longer = ph.simulate(hammer, ph.PulseTrain(push), duration=4.0 * motion.end)
        reach = np.abs(longer.x - hammer.rest).max()
        place = longer.x[-1]
        assert dry or place == pytest.approx(hammer.rest, abs=1e-3 * reach)
        assert np.abs(longer.x[longer.t >= motion.end] - place).max() <= 0.1 * reach


def press(hammer: ph.Hammer, rate: float) -> Press:
    """Return a simulator of the test prints of a learner."""
    single = single_of(hammer, hammer.waveform, 1e-7)
    asked = {"gaps": 1, "reach": 1, "spread": [], "largest": 2.0, "widest": 1.0, "wait": 0.0, "brake": False}
    task = Task(
        hammers=[hammer],
        pulse=hammer.waveform,
        single=single,
        limits=ph.Limits(),
        effort=Effort(tolerance=1e-7, threads=1),
        report=lambda: None,
        **asked,  # type: ignore[arg-type]
    )
    return Press(task, rate, [hammer])


def struck_everywhere(hammer: ph.Hammer) -> dict[str, list[int]]:
    """The dots of three firings, far apart, as simulated by every verb."""
    rate = 1.0 / (3.0 * wait_of(hammer))
    train = ph.PulseTrain(hammer.waveform, rate=rate, pulses=3)
    trial = attempt([Case(hammer, nominal(hammer), rate)], [(0, 1, 2)], limits=ph.Limits(), threads=1)
    chart = ph.frequency_map(hammer, [rate], pulses=3, times=16, threads=1)
    report = ph.quality(hammer, rate, pattern="111")
    safe = ph.safe_rate(hammer, first=rate, last=rate, step=rate, long=False, threads=1)
    base = Base(
        hammer=hammer,
        drive={"train": {"rate": f"{rate!r} Hz", "pulses": 3}},
        waveform=None,
        folder=Path(),
        state=(None, None),
        duration=None,
        tolerance=2e-11,
        axes=(),
    )
    _which, members = Maker(base).members(np.zeros((1, 0)), 1)
    assert members.ends[0] == Maker(base).member([]).end
    swept = ph.Ensemble(members.hammers, members.drives, members.ends).run(dots=True, threads=1).dots
    assert swept is not None
    page = ph.print_page(hammer, Pattern("row", np.ones((1, 3), bool)), rate, threads=1)
    learner = press(hammer, rate)
    entries = np.zeros((4, 2))
    entries[1] = hammer.waveform.width  # type: ignore[union-attr]
    line, _judged = learner.line([entries], (0, 1, 2))
    ladder, _force = learner.ladder([Rung(1.0), Rung(1.0, 1.0 / rate)])
    return {
        "run": [int(dot.struck) for dot in ph.simulate(hammer, train, points=2).dots],
        "print": trial.dots.struck[0].astype(int).tolist(),
        "report": [1 - int(lost) for lost in report.lost],
        "map": chart["struck"].values[0].astype(int).tolist(),
        "sweep": swept.struck[0].astype(int).tolist(),
        "safe rate": [1, 1, 1 - int(safe.lost.sum())],
        "page": [1 - int(lost) for lost in page.lost],
        "line of a learner": line.struck[0].astype(int).tolist(),
        "ladder of a learner": np.isfinite(ladder[0]).astype(int).tolist(),
    }


def devices(count: int, seed: int = 33) -> Iterator[ph.Hammer]:
    """Random devices with flights from 0.1 to 60 ms: driven by a force, or shipped and rescaled in time."""
    random = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    for number in range(count):
        if number % 2:
            yield device(between(1e-4, 60e-3), between(1e-4, 1e-2), between(0.1, 20.0), between(0.05, 1.6))
            continue
        name = str(random.choice(["dot-peen", "braille-embosser", "relay-5v", "pinball-coil"]))
        shipped = ph.load(name)
        slow = between(1e-4, 60e-3) / nominal(shipped).flight_time
        # Times of all that moves, currents that rise and contacts that last are multiplied by `slow`.
        powers = {
            "mass": 2,
            "waveform.width": 1,
            "pack.damping": 1,
            "coil.resistance": -1,
            "waveform.voltage": -1,
        }
        changed = {key: slow**power * shipped.constants[key].si for key, power in powers.items()}
        changed["backstop.restitution"] = random.uniform(0.1, 0.6)
        changed["spring.preload"] = random.uniform(0.8, 1.2) * shipped.constants["spring.preload"].si
        yield shipped.replace(changed)


def strikes_everywhere(hammer: ph.Hammer) -> None:
    struck = struck_everywhere(hammer)
    assert all(all(each) for each in struck.values()), (hammer.name, struck)


def test_a_fast_and_a_slow_device_strike_the_same_dots_everywhere() -> None:
    for flight in (1e-4, 60e-3):
        strikes_everywhere(device(flight))


@pytest.mark.slow
def test_random_devices_strike_the_same_dots_everywhere() -> None:
    # 300 were tried once; half of these are shipped devices in other times, behind their rails.
    for hammer in devices(16):
        strikes_everywhere(hammer)


def test_an_armature_latched_on_a_rigid_front_is_not_at_rest() -> None:
    """Only an armature held by dry friction is at rest away from its rest position."""
    hammer = ph.Hammer.build(
        1e-3,
        spring={"law": "cubic", "stiffness": -1e3, "cubic": 0.0, "center": 0.5e-3},
        pack={"law": "rigid", "front": 1e-3, "restitution": 0.2},
        backstop={"law": "rigid", "position": 0.0, "restitution": 0.2},
        waveform={"shape": "half-sine", "amplitude": "3 N", "width": 2e-3},
    )
    with hammers.interpreted():
        motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform))
        assert (motion.x[-1], motion.v[-1]) == (1e-3, 0.0)
        assert "0.001 m from its rest position" in motion.unsettled
        # No longer run can help.
        assert "longer run" not in str(motion.summary())


@pytest.mark.parametrize("name", ["pot-magnet", "relay-5v", "pinball-flipper", "hendriks-1983"])
def test_an_armature_that_stays_away_after_a_pulse_is_described(name: str) -> None:
    """Only the pot magnet has no spring; ten windows later its armature still rests at the pole."""
    hammer = ph.load(name)
    long = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=10.0 * wait_of(hammer))
    assert hammer.front is not None
    away = abs(long.x[-1] - hammer.rest) / (hammer.front - hammer.rest)
    assert bool(away > 0.99) is (name == "pot-magnet")
    assert bool(stays_away(hammer)) is bool(away > 0.01)
