"""Operate, release and bounce times of contacts against closed forms and against the sampled motion."""

import math
from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused
from tests.hammers import interpreted

import printhammer as ph
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Trapezoid
from printhammer.results.summary import Facts
from printhammer.run.switching.timings import Timing, off_after

MASS, FORCE, GAP, STIFFNESS = 1e-3, 2.0, 0.4e-3, 2e4


def slider(preload: float = 0.5) -> ph.Hammer:
    """Mass on a rigid stop with a constant spring force toward the stop, and a make contact on its way."""
    return ph.Hammer.build(MASS).replace(
        {
            "spring": {"law": "preload", "preload": -preload, "stiffness": 0.0},
            "backstop": {"law": "rigid", "position": 0.0, "restitution": 0.3},
            "contact.no": {"law": "linear", "side": "front", "position": GAP, "stiffness": STIFFNESS},
        }
    )


def pulse(width: float) -> Trapezoid:
    return Trapezoid(amplitude=FORCE, quantity="force", rise=0.0, width=width, fall=0.0)


def facts_of(motion: ph.Motion) -> dict[str, str]:
    (facts,) = [each for each in motion.summary() if isinstance(each, Facts)]
    return dict(facts.known)


def test_a_make_contact_bounces_as_in_the_closed_form() -> None:
    """Constant force, elastic contact: flights of a parabola, contacts of a sine about a shifted centre."""
    preload = 0.5
    net = FORCE - preload
    motion = ph.simulate(slider(preload), ph.PulseTrain(pulse(8e-3)), duration=8e-3, tolerance=1e-13)
    first, speed = math.sqrt(2.0 * MASS * GAP / net), math.sqrt(2.0 * net * GAP / MASS)
    omega = math.sqrt(STIFFNESS / MASS)
    closed = 2.0 * (math.pi - math.atan(speed / omega * STIFFNESS / net)) / omega
    cycle = closed + 2.0 * speed * MASS / net
    bounces = math.floor((8e-3 - first) / cycle)
    # Energy: K d^2 / 2 = F (x0 + d).
    depth = (net + math.sqrt(net**2 + 2.0 * STIFFNESS * net * GAP)) / STIFFNESS
    (timing,) = motion.timings
    assert bounces > 2
    assert (timing.contact, timing.kind, timing.firing) == ("no", "make", 0)
    assert timing.operate_time == pytest.approx(first, abs=1e-11)
    assert timing.operate_bounce == pytest.approx(bounces * cycle, abs=1e-10)
    assert timing.largest_force == pytest.approx(STIFFNESS * depth, rel=1e-9)
    assert timing.release_time is timing.release_bounce is None


def test_a_break_contact_opens_as_in_the_closed_form() -> None:
    """A break contact helps to lift the armature: a sine about the shifted equilibrium until it opens."""
    preload, place, stiffness = 0.5, 0.05e-3, 8e3
    hammer = slider(preload).replace(
        "contact.nc", {"law": "linear", "side": "back", "position": place, "stiffness": stiffness}
    )
    motion = ph.simulate(hammer, ph.PulseTrain(pulse(3e-3)), duration=20e-3, tolerance=1e-13)
    make, rest = motion.timings
    centre = (FORCE - preload + stiffness * place) / stiffness
    assert rest.kind == "break"
    expected = math.acos(1.0 - place / centre) / math.sqrt(stiffness / MASS)
    assert rest.operate_time == pytest.approx(expected, abs=1e-11)
    assert rest.largest_force == pytest.approx(stiffness * place, rel=1e-12)
    assert rest.final_force == pytest.approx(stiffness * place, rel=1e-12)
    assert make.kind == "make"
    assert make.final_force == pytest.approx(max(STIFFNESS * (motion.at(3e-3)[0][0] - GAP), 0.0), abs=1e-9)


def sampled(motion: ph.Motion, contact: str, side: str, position: float) -> tuple[list[float], list[float]]:
    """Return the times at which a contact closes and opens, from the motion sampled each 0.2 us."""
    t = np.arange(motion.start, motion.end, 2e-7)
    x = motion.at(t)[0]
    closed = x > position if side == "front" else x < position
    change = np.diff(closed.astype(int))
    return t[:-1][change > 0].tolist(), t[:-1][change < 0].tolist()


@pytest.mark.parametrize("seed", range(6))
def test_timings_agree_with_the_sampled_motion(seed: int) -> None:
    rng = np.random.default_rng(seed)
    hammer = slider(rng.uniform(0.2, 0.8)).replace(
        {
            "backstop.restitution": rng.uniform(0.2, 0.7),
            "contact.nc": {"law": "linear", "side": "back", "position": 0.03e-3, "stiffness": 3e3},
        }
    )
    width = rng.uniform(1e-3, 3e-3)
    motion = ph.simulate(hammer, ph.PulseTrain(pulse(width), period=40e-3, pulses=2), duration=80e-3)
    assert len(motion.timings) == 4
    for timing in motion.timings:
        side, place = ("front", GAP) if timing.contact == "no" else ("back", 0.03e-3)
        closed, opened = sampled(motion, timing.contact, side, place)
        forth, back = (closed, opened) if side == "front" else (opened, closed)
        on = 40e-3 * timing.firing
        forth = [time for time in forth if on <= time < on + 40e-3]
        back = [time for time in back if max(on + width, forth[0]) <= time < on + 40e-3]
        forth = [time for time in forth if time < min(back, default=math.inf)]
        assert timing.switched_off == pytest.approx(on + width, abs=1e-12)
        assert timing.operate_time == pytest.approx(forth[0] - on, abs=3e-7)
        assert timing.operate_bounce == pytest.approx(forth[-1] - forth[0], abs=5e-7)
        if back:
            assert timing.release_time == pytest.approx(back[0] - on - width, abs=3e-7)
            assert timing.release_bounce == pytest.approx(back[-1] - back[0], abs=5e-7)
        else:
            # The contact has thrown the armature back before switch-off.
            assert timing.release_time is timing.release_bounce is None
            assert timing.final_force == 0.0
    assert "release" not in facts_of(motion)
    rests = [timing for timing in motion.timings if timing.contact == "nc"]
    assert max(timing.release_bounce for timing in rests) > 0.1e-3


def test_a_break_contact_is_pressed_where_the_armature_strikes_its_backstop() -> None:
    """The rebound from a rigid backstop is no zero of the velocity, but the deepest point of the contact."""
    hammer = slider().replace(
        "contact.nc", {"law": "linear", "side": "back", "position": 0.03e-3, "stiffness": 3e3}
    )
    motion = ph.simulate(hammer, ph.PulseTrain(pulse(1e-3)), duration=40e-3)
    pressed = [each for each in motion.closings if each.contact == "nc"]
    assert len(pressed) > 2
    assert all(each.peak_force == pytest.approx(3e3 * 0.03e-3, rel=1e-12) for each in pressed)


def test_a_latched_contact_is_reset_by_a_reversed_pulse() -> None:
    """Friction latches the mass at its front stop; force, friction and contact spring then push it back."""
    kinetic, place, far, stiffness = 0.2, GAP, 0.5e-3, 1e3
    hammer = slider(0.0).replace(
        {
            "pack": {"law": "rigid", "front": far, "restitution": 0.3},
            "contact.no.stiffness": stiffness,
            "contact.nc": {"law": "linear", "side": "back", "position": 0.05e-3, "stiffness": 500.0},
            "backstop.restitution": 0.7,
            "force.guide": {"law": "friction", "kinetic": kinetic, "static": 0.3},
        }
    )
    back = Trapezoid(amplitude=-FORCE, quantity="force", rise=0.0, width=5e-3, fall=0.0)
    drive = ph.PulseSequence([pulse(5e-3), back, pulse(5e-3)], at=[0.0, 20e-3, 40e-3])
    motion = ph.simulate(hammer, drive, duration=60e-3, state=(0.0, 0.0), tolerance=1e-13)
    assert motion.state_at(19e-3)[:2] == (far, 0.0)
    assert motion.state_at(39e-3)[:2] == (0.0, 0.0)
    make, rest = motion.timings[:3], motion.timings[3:]
    for each in (make, rest):
        assert [timing.operate_time is None for timing in each] == [False, True, False]
        assert [timing.reset_time is None for timing in each] == [True, False, True]
        assert [timing.release_time for timing in each] == [None] * 3
    centre = (FORCE - kinetic) / stiffness
    expected = math.acos(centre / (centre + far - place)) / math.sqrt(stiffness / MASS)
    assert make[1].reset_time == pytest.approx(expected, abs=1e-11)
    assert make[1].reset_bounce == 0.0
    closed, _opened = sampled(motion, "nc", "back", 0.05e-3)
    closed = [time for time in closed if time > 20e-3]
    assert len(closed) > 1
    assert rest[1].reset_time == pytest.approx(closed[0] - 20e-3, abs=3e-7)
    assert rest[1].reset_bounce == pytest.approx(closed[-1] - closed[0], abs=5e-7)
    said = facts_of(motion)["contact no"]
    assert "reversed pulse" in said
    assert "never" not in said
    assert motion.plot(picture="timings")


def test_a_run_that_ends_before_the_release_says_so() -> None:
    hammer, drive = slider(), ph.PulseTrain(pulse(1e-3))
    short = ph.simulate(hammer, drive, duration=1e-3)
    (timing,) = short.timings
    assert timing.switched_off == 1e-3
    assert timing.release_time is None
    assert "no" in facts_of(short)["release"]
    assert "release" not in facts_of(ph.simulate(hammer, drive, duration=10e-3))


def test_a_contact_that_stays_open_has_no_times() -> None:
    motion = ph.simulate(slider(3.0), ph.PulseTrain(pulse(3e-3)), duration=5e-3)
    (timing,) = motion.timings
    assert timing.operate_time is timing.operate_bounce is timing.release_time is None
    assert timing.largest_force == timing.final_force == 0.0
    assert "release" not in facts_of(motion)


def test_a_hammer_without_contacts_has_no_timings() -> None:
    motion = ph.simulate(slider().replace("contact.no", None), ph.PulseTrain(pulse(1e-3)), duration=2e-3)
    assert motion.timings == ()
    with refused("contact"):
        motion.plot(picture="timings")


@pytest.mark.parametrize(
    ("waveform", "expected"),
    [
        (pulse(2e-3), 2e-3),
        (Trapezoid(amplitude=1.0, rise=1e-3, width=2e-3, fall=3e-3), 3e-3),
        (HalfSine(amplitude=1.0, width=2e-3), 2e-3),
        (Rectangle(amplitude=1.0, rise=1e-3, width=2e-3, decay=1e-3), 2e-3),
    ],
)
def test_a_drive_is_switched_off(waveform: Trapezoid, expected: float) -> None:
    assert off_after(waveform) == pytest.approx(expected, abs=1e-15)


def test_the_picture_shows_the_state_of_each_contact(tmp_path: Path) -> None:
    hammer = slider(0.5).replace(
        "contact.nc", {"law": "linear", "side": "back", "position": 0.03e-3, "stiffness": 3e3}
    )
    motion = ph.simulate(hammer, ph.PulseTrain(pulse(3e-3)), duration=15e-3)
    panel, strip, traces = motion.plot(picture="timings").axes
    assert [label.get_text() for label in traces.get_yticklabels()] == ["nc", "no"]
    lines = {line.get_gid(): line for axes in (panel, strip, traces) for line in axes.lines}
    for contact in ("no", "nc"):
        trace = lines[f"contact {contact}"]
        high = trace.get_ydata() > np.min(trace.get_ydata())
        total = np.sum(np.diff(trace.get_xdata())[high[:-1] & high[1:]])
        own = [each for each in motion.closings if each.contact == contact]
        assert total == pytest.approx(1e3 * sum((each.t_out or motion.end) - each.t_in for each in own))
    motion.timings.save(f"{tmp_path}/timings.csv")
    assert "operate_time [s]" in (tmp_path / "timings.csv").read_text()
    assert motion.timings.kind is Timing


def test_a_sinusoidal_force_switches_nothing() -> None:
    """The summary then counts closings; a bounce time over the whole run would be meaningless."""
    hammer = ph.Hammer.build(1e-3, spring={"law": "preload", "preload": 0.0, "stiffness": 100.0}).replace(
        "contact.leaf", {"law": "linear", "side": "front", "position": 1e-4, "stiffness": 1e4}
    )
    with interpreted():
        motion = ph.simulate(hammer, ph.SineForce(0.1, 30.0), duration=0.1)
        assert len(motion.closings) > 1
        assert not motion.timings
        assert facts_of(motion)["contact leaf"].startswith(f"{len(motion.closings)} closings from")
