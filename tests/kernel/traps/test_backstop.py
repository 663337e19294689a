"""Regression tests at the backstop: cases in which an earlier kernel hung or was wrong."""

import math

import numpy as np
import pytest
from tests import hammers
from tests.hammers import FRONT, MASS, STOP, STROKE
from tests.oracle.integrator import reference
from tests.truth import oracles

import printhammer as ph
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Trapezoid
from printhammer.run.contacts import Contact

PULL = 1e4
"""Acceleration of `hammers.shelf` with 4 N, m/s^2."""


def edges_at(*times: float) -> ph.PulseTrain:
    """Return a drive without force that has edges at given times."""
    waveform = Rectangle(amplitude=0.0, width=2e-5, rise=0.0, decay=0.0, quantity="force")
    return ph.PulseTrain(waveform, at=list(times))


def falling(depth: float, speed: float = 1.0) -> tuple[float, float]:
    """A state from which free flight under +4 N would dip `depth` below the backstop's position."""
    return STOP - depth + speed**2 / (2.0 * PULL), -speed


def touches(motion: ph.Motion) -> list[Contact]:
    return [c for c in motion.contacts if c.surface == "backstop" and not c.initial]


@pytest.mark.parametrize("depth", [1e-6, 1e-9, 1e-12, 1e-14, 1e-16])
@pytest.mark.parametrize("edge", [0.0, -1e-6, 1e-7, 5e-6])
def test_a_free_step_dips_into_the_backstop_and_out(depth: float, edge: float) -> None:
    motion = ph.simulate(
        hammers.shelf(4.0), edges_at(1.0 / PULL + edge), duration=1.5e-4, state=falling(depth)
    )
    assert motion.ok
    assert motion.steps < 500
    (contact,) = touches(motion)
    speed = math.sqrt(2.0 * PULL * depth)
    assert contact.t_in == pytest.approx((1.0 - speed) / PULL, abs=1e-12 * STROKE / speed)
    assert contact.v_in == pytest.approx(-speed, rel=1e-2)
    assert contact.t_out is not None
    assert contact.t_in < contact.t_peak < contact.t_out
    if depth < 1e-7:
        # Deeper, the backstop pushes back as hard as the drive.
        assert contact.depth == pytest.approx(depth, rel=2e-2, abs=3e-20)


@pytest.mark.parametrize("gap", [1e-6, 1e-9, 1e-12, 1e-14, 1e-16])
@pytest.mark.parametrize("edge", [0.0, -1e-6, 1e-7, 5e-6])
def test_a_near_miss_of_the_backstop_is_no_contact(gap: float, edge: float) -> None:
    motion = ph.simulate(
        hammers.shelf(4.0), edges_at(1.0 / PULL + edge), duration=1.5e-4, state=falling(-gap)
    )
    assert motion.ok
    assert touches(motion) == []


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("depth", [1e-9, 1e-14, -1e-9, -1e-14])
def test_a_graze_of_a_rigid_backstop(depth: float, restitution: float) -> None:
    hammer = hammers.made_of(
        spring=hammers.preload(4.0), pack=hammers.power(), backstop=hammers.rigid(restitution)
    )
    with hammers.interpreted():
        motion = ph.simulate(hammer, edges_at(1.0 / PULL), duration=1.5e-4, state=falling(depth))
    assert motion.ok
    assert len(touches(motion)) == (1 if depth > 0.0 else 0)
    assert motion.x.min() >= STOP


def test_a_tangential_touch_of_the_backstop_ends() -> None:
    for ulps in range(-3, 4):
        x, v = falling(0.0)
        state = x + ulps * math.ulp(x), v
        motion = ph.simulate(hammers.shelf(4.0), hammers.idle(), duration=2e-4, state=state)
        assert motion.ok
        assert motion.steps < 500
        assert all(c.depth < 1e-18 for c in touches(motion))
        expected = STOP + 0.5 * PULL * (1.4e-4 - 1.0 / PULL) ** 2
        assert motion.at(1.4e-4)[0][0] == pytest.approx(expected, rel=1e-12)


SLIGHT = [0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-7, -1e-7, 2.0, -2.0]


@pytest.mark.parametrize("v", SLIGHT)
@pytest.mark.parametrize("force", [-2.0, 2.0])
def test_a_start_on_the_backstop(force: float, v: float) -> None:
    """An inward step that ends exactly on the position is a touch, not a standstill."""
    found = hammers.compare(hammers.shelf(force), hammers.idle(), 1e-3, state=(STOP, v))
    assert found.motion.status == "ok"
    assert found.error < 1e-9
    assert found.motion.steps < 1000


@pytest.mark.parametrize("v", SLIGHT)
@pytest.mark.parametrize("force", [-2.0, 2.0])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_a_start_on_a_rigid_backstop(restitution: float, force: float, v: float) -> None:
    hammer = hammers.made_of(
        spring=hammers.preload(force), pack=hammers.power(), backstop=hammers.rigid(restitution)
    )
    duration = 1e-6 if restitution == 1.0 and abs(v) < 1e-6 else 1e-3
    found = hammers.compare(hammer, hammers.idle(), duration, state=(STOP, v), scale=STROKE)
    assert found.motion.status == "ok"
    # Whether a touch 1e-23 m deep turns 1e-9 m/s round is worth 1e-8 of the stroke.
    assert found.error < 1e-8
    assert found.motion.steps < 1000


@pytest.mark.parametrize("ulps", [-2, -1, 1, 2])
@pytest.mark.parametrize("force", [-2.0, 2.0])
def test_a_start_beside_the_backstop(force: float, ulps: int) -> None:
    state = STOP + ulps * math.ulp(STOP), 0.0
    found = hammers.compare(hammers.shelf(force), hammers.idle(), 1e-3, state=state)
    assert found.motion.status == "ok"
    assert found.error < 1e-9
    assert found.motion.steps < 1000


@pytest.mark.parametrize("v", [0.0, 3.0, -3.0, 100.0, -100.0])
def test_starts_inside_the_backstop(v: float) -> None:
    duration = 1e-3 if abs(v) < 50.0 else 1e-4
    found = hammers.compare(hammers.shelf(), hammers.idle(), duration, state=(STOP - 2e-6, v), scale=STROKE)
    assert found.motion.contacts[0].initial
    assert found.motion.contacts[0].surface == "backstop"
    assert found.motion.status == "ok"
    assert found.error < 1e-8


def test_edges_inside_a_regularised_step() -> None:
    """Thirty pulses with edges inside one contact, including its deepest point and both its ends."""
    free = ph.simulate(hammers.shelf(), hammers.idle(), duration=1e-3, state=(STOP + 1e-5, -1.0))
    contact = touches(free)[0]
    assert contact.t_out is not None
    inside = np.linspace(contact.t_in, contact.t_out, 29)
    times = np.sort([*inside, contact.t_peak])
    waveform = Rectangle(amplitude=0.3, width=7e-6, rise=0.0, decay=0.0, quantity="force")
    drive = ph.PulseTrain(waveform, at=times)
    found = hammers.compare(hammers.shelf(), drive, 1e-3, state=(STOP + 1e-5, -1.0))
    assert found.motion.status == "ok"
    assert found.error < 1e-8
    assert found.horizon == 1e-3
    for edge in (times, times + 7e-6):
        assert np.isin(edge[edge < 1e-3], found.motion.step_times).all()


@pytest.mark.parametrize("width", [1e-9, 1e-12, 1e-15])
def test_very_short_pulses_inside_the_backstop(width: float) -> None:
    """A pulse much shorter than any step changes the velocity by a quarter of a metre per second."""
    impulse = 0.25 * MASS
    waveform = Rectangle(amplitude=impulse / width, width=width, rise=0.0, decay=0.0, quantity="force")
    drive = ph.PulseTrain(waveform, at=[1.5e-5])
    hammer = hammers.shelf()
    motion = ph.simulate(hammer, drive, duration=3e-4, state=(STOP + 1e-5, -1.0))
    assert motion.ok
    x, v = motion.at([np.nextafter(1.5e-5, 0.0), 1.5e-5 + 2.0 * width])
    # The backstop pushes too, some 3e5 m/s^2.
    assert v[1] - v[0] == pytest.approx(0.25, abs=1e-6 + 6e5 * width)
    assert abs(x[1] - x[0]) < 3.0 * width


def test_rest_in_the_backstop_for_a_second_takes_few_steps() -> None:
    hammer = hammers.crude()
    motion = ph.simulate(hammer, hammers.idle("current"), duration=1.0)
    assert motion.ok
    assert motion.steps < 10_000
    x, v = motion.at([0.0, 0.3, 1.0])
    assert np.ptp(x) < 1e-15
    assert np.abs(v).max() < 1e-12
    assert len(motion.contacts) == 1
    assert motion.contacts[0].t_out is None


def test_rest_under_a_current_that_does_not_lift_is_bounded() -> None:
    """A constant current shifts the rest state; the oscillation decays, and no contact ends."""
    hammer = hammers.crude()
    drive = ph.PulseTrain(Trapezoid(amplitude=0.1, rise=1e-3, width=0.1, fall=1e-3))
    motion = ph.simulate(hammer, drive, duration=0.11)
    assert motion.ok
    assert motion.steps < 100_000
    assert len(motion.contacts) == 1
    late, _v = motion.at(np.linspace(0.09, 0.1, 7))
    assert np.ptp(late) < 1e-15
    # Equilibrium with 0.1 A, between that of no current and the position.
    pressed = [e.x for e in ph.equilibria(hammer, 0.1) if e.surface == "backstop" and e.stable]
    assert late[-1] == pytest.approx(pressed[0], abs=1e-15)
    end, _v = motion.at(0.11)
    assert end[0] == pytest.approx(ph.rest_state(hammer), abs=1e-15)


def test_rest_on_a_rigid_backstop_for_a_second_is_bounded() -> None:
    hammer = hammers.made_of(spring=hammers.preload(-4.0), pack=hammers.power(), backstop=hammers.rigid(0.5))
    motion = ph.simulate(hammer, ph.SineForce(3.0, 50.0), duration=0.05)
    assert motion.ok
    assert len(motion.step_times) < 20
    assert np.ptp(motion.x) == 0.0
    still = ph.simulate(hammer, hammers.idle(), duration=1.0)
    assert still.ok
    assert still.steps < 100
    assert np.ptp(still.x) == 0.0


RELEASES = {
    "jump down": (2.0, Rectangle(amplitude=-5.0, width=1e-3, rise=0.0, decay=0.0, quantity="force"), 0.0),
    "decay": (2.0, Rectangle(amplitude=-5.0, width=1e-3, rise=1e-5, decay=2e-5, quantity="force"), 0.0),
    "ramp": (2.0, Trapezoid(amplitude=-5.0, rise=0.0, width=1e-3, fall=1e-4, quantity="force"), 0.0),
    "jump up": (-2.0, Rectangle(amplitude=5.0, width=1e-3, rise=0.0, decay=0.0, quantity="force"), 2e-4),
    "rise": (-2.0, Rectangle(amplitude=5.0, width=1e-3, rise=1e-5, decay=2e-5, quantity="force"), 2e-4),
    "half sine": (-2.0, HalfSine(amplitude=5.0, width=1e-3, quantity="force"), 2e-4),
    "jump to nothing": (
        0.0,
        Rectangle(amplitude=-5.0, width=1e-3, rise=0.0, decay=0.0, quantity="force"),
        0.0,
    ),
}


@pytest.mark.parametrize("how", RELEASES)
def test_release_from_a_rigid_backstop(how: str) -> None:
    """The armature leaves when the force changes sign, even if the force jumps."""
    force, waveform, start = RELEASES[how]
    hammer = hammers.made_of(
        spring=hammers.preload(force, 1e3), pack=hammers.power(front=1e-2), backstop=hammers.rigid(0.5)
    )
    drive = ph.PulseTrain(waveform, at=[start])
    found = hammers.compare(hammer, drive, 4e-3, state=(STOP, 0.0), sensitive=True)
    assert found.motion.status == "ok"
    assert found.error < 1e-9
    moved = np.abs(found.truth.x - STOP).max() > STROKE
    assert moved == (how != "jump to nothing")


@pytest.mark.parametrize("stiffness", [1e5, 1e6, 1e9, 1e12, 1e15])
@pytest.mark.parametrize("mass", [1e-6, 4e-4, 1.0])
def test_backstops_of_all_hardnesses(stiffness: float, mass: float) -> None:
    """Thrown against the backstop without other forces: v_out = v_in after the duration of Hertz contact."""
    hammer = hammers.made_of(
        mass, spring=hammers.preload(0.0), pack=hammers.power(), backstop=hammers.hertz(stiffness)
    )
    depth = oracles.backstop_indentation(mass, stiffness, 0.0, 1.0)
    duration = 1e-4 + 3.0 * depth
    motion = ph.simulate(hammer, hammers.idle(), duration=duration, state=(STOP + 2e-5, -1.0))
    assert motion.ok
    contact = touches(motion)[0]
    assert contact.v_out == pytest.approx(1.0, rel=1e-9)
    assert contact.depth == pytest.approx(depth, rel=1e-8)
    assert contact.t_out - contact.t_in == pytest.approx(
        oracles.hertz_duration(mass, stiffness, 1.0), rel=1e-8
    )


@pytest.mark.slow
@pytest.mark.parametrize("gentle", [1e-3, 1e-6, 1e-9])
def test_a_backstop_that_may_not_pull_lets_go_once(gentle: float) -> None:
    """Damped so that v > k/l at every speed: after release there must be no chatter."""
    hammer = hammers.made_of(
        spring=hammers.preload(-2.0), pack=hammers.PACKS["dashpot"], backstop=hammers.BACKSTOPS["elastomer"]
    )
    state = STOP + gentle * 1e-2, -gentle
    with hammers.interpreted():
        found = hammers.compare(hammer, hammers.idle(), 4e-4, state=state, scale=STROKE)
    assert found.motion.status == "ok"
    assert found.error < 1e-9
    assert found.motion.steps < 2000
    forces = found.motion.force
    assert (forces["backstop"] + forces["damping"] >= -1e-12).all()


def test_the_rest_state_is_at_rest() -> None:
    """`rest_state` and the force sum of the kernel agree: a run from there stays at rest."""
    for hammer in (
        hammers.crude(),
        hammers.made_of(
            spring=hammers.SPRINGS["linear"].model_copy(update={"Bs": 1e-3}), backstop=hammers.hertz()
        ),
    ):
        if hammer.magnet is None:
            continue
        rest = ph.rest_state(hammer)
        motion = ph.simulate(hammer, hammers.idle("current"), duration=5e-3)
        assert motion.x[0] == rest
        assert np.abs(motion.x - rest).max() < 1e-15
        truth = reference(hammer, hammers.idle("current"), 5e-3)
        assert np.abs(truth.x - rest).max() < 1e-15


def test_no_stroke_at_all() -> None:
    """A pack front one micrometre in front of the backstop leaves the armature hardly any room."""
    hammer = hammers.made_of(
        spring=hammers.preload(-2.0),
        pack=hammers.power(front=STOP + 1e-6),
        backstop=hammers.hertz(damping=4e8),
    )
    drive = ph.PulseTrain(HalfSine(amplitude=14.0, width=4e-4, quantity="force"), period=6e-4, pulses=3)
    found = hammers.compare(hammer, drive, 2e-3, state=(STOP, 0.0), scale=1e-6)
    assert found.motion.status == "ok"
    assert found.error < 1e-7
    assert len(found.touches("pack")[0]) == len(found.touches("pack")[1])
    assert FRONT > STOP + 1e-6


def test_a_contact_from_rest_begins_as_a_parabola() -> None:
    """At first, the force of the backstop, k d^1.5, is negligible beside the spring."""
    hammer = ph.Hammer.build(
        1e-3,
        spring={"law": "preload", "preload": -2.0, "stiffness": 0.0},
        backstop={"law": "hertz", "position": 0.0, "stiffness": 1e8, "damping": 0.0},
    )
    drive = ph.PulseTrain(
        Trapezoid(amplitude=1.0, quantity="force", rise=0.0, width=1e-4, fall=0.0), at=[5e-3]
    )
    motion = ph.simulate(hammer, drive, duration=6e-3, state=(0.0, 0.0))
    t = np.geomspace(1e-13, 1e-9, 60)
    x, v = motion.at(t)[:2]
    np.testing.assert_allclose(x, -0.5 * 2e3 * t**2, rtol=1e-9)
    np.testing.assert_allclose(v, -2e3 * t, rtol=1e-9)
