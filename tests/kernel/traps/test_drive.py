"""Regression tests for edges of the drive, restarts, large currents and ends of a run."""

import math

import numpy as np
import pytest
from tests import hammers
from tests.hammers import FRONT, STOP, STROKE

import printhammer as ph
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle, Trapezoid
from printhammer.run.problem import TOLERANCE, Problem

BLOCK = Rectangle(amplitude=14.0, width=2e-4, rise=0.0, decay=0.0, quantity="force")


def nothing(width: float = 2e-5) -> Rectangle:
    return Rectangle(amplitude=0.0, width=width, rise=0.0, decay=0.0, quantity="force")


def run(drive: ph.PulseTrain, duration: float = 1.5e-3) -> ph.Motion:
    times = np.linspace(0.0, duration, 301)
    return ph.simulate(hammers.shelf(), drive, duration=duration, times=times)


def check_record(motion: ph.Motion) -> None:
    """Check the record of a run: every event lies inside its step."""
    hammer, end = motion.hammer, motion.end
    times = motion.step_times
    assert (np.diff(times) >= 0.0).all()
    assert times[0] == motion.start
    assert np.isfinite(motion.x).all()
    assert np.isfinite(motion.v).all()
    last: dict[str, float] = {}
    for contact in motion.contacts:
        surface = hammer.front if contact.surface == "pack" else hammer.position
        assert contact.t_in in times
        assert contact.t_in >= last.get(contact.surface, 0.0)
        out = end if contact.t_out is None else contact.t_out
        assert contact.t_in <= contact.t_peak <= out
        last[contact.surface] = out
        if not contact.initial:
            x, _v = motion.at(contact.t_in)
            assert x[0] == pytest.approx(surface, abs=1e-15)
            assert (contact.v_in > 0.0) == (contact.surface == "pack")
        if contact.t_out is not None and contact.v_out != 0.0:
            assert (contact.v_out < 0.0) == (contact.surface == "pack")


@pytest.mark.parametrize("ulps", [0, 1, 2, 1000])
def test_one_pulse_that_begins_where_another_ends(ulps: int) -> None:
    """Two adjacent blocks equal one block of twice the length, even if the edges differ by an ulp."""
    start = 2e-4
    for _ in range(ulps):
        start = math.nextafter(start, 1.0)
    whole = run(ph.PulseTrain(BLOCK.model_copy(update={"width": 4e-4})))
    parts = run(ph.PulseTrain(BLOCK, at=[0.0, start]))
    check_record(parts)
    np.testing.assert_allclose(parts.x, whole.x, rtol=0.0, atol=1e-9 * STROKE)
    assert len(parts.contacts) == len(whole.contacts)


@pytest.mark.parametrize(
    "which", ["pack in", "pack peak", "pack out", "backstop in", "backstop peak", "backstop out"]
)
@pytest.mark.parametrize("ulps", [-1, 0, 1])
def test_an_edge_at_the_very_instant_of_a_switch(which: str, ulps: int) -> None:
    """An edge without a jump, at a switch or an ulp away from a switch, has no effect."""
    state = STOP, 2.0
    thrown = ph.simulate(hammers.shelf(), ph.PulseTrain(nothing()), duration=1e-3, state=state)
    surface, when = which.split()
    contact = next(c for c in thrown.contacts if c.surface == surface and not c.initial)
    time = {"in": contact.t_in, "out": contact.t_out, "peak": contact.t_peak}[when]
    assert time is not None
    if ulps:
        time = math.nextafter(time, ulps * math.inf)
    cut = ph.simulate(
        hammers.shelf(), ph.PulseTrain(nothing(), at=[time]), duration=1e-3, state=state, times=thrown.t
    )
    check_record(cut)
    assert time in cut.step_times
    assert len(cut.contacts) == len(thrown.contacts)
    np.testing.assert_allclose(cut.x, thrown.x, rtol=0.0, atol=1e-9 * STROKE)


@pytest.mark.parametrize("which", ["pack in", "pack out", "backstop in", "backstop out"])
def test_a_pulse_fired_at_the_very_instant_of_a_switch(which: str) -> None:
    state = STOP, 2.0
    thrown = ph.simulate(hammers.shelf(), ph.PulseTrain(nothing()), duration=1e-3, state=state)
    surface, when = which.split()
    contact = next(c for c in thrown.contacts if c.surface == surface and not c.initial)
    time = {"in": contact.t_in, "out": contact.t_out}[when]
    found = hammers.compare(hammers.shelf(), ph.PulseTrain(BLOCK, at=[time]), 1e-3, state=state)
    check_record(found.motion)
    assert found.error < 1e-8
    assert len(found.touches("pack")[0]) == len(found.touches("pack")[1])
    if which == "pack in":
        # Fired at the touch: the contact belongs to this firing, after no flight at all.
        dot = found.motion.dots[0]
        assert not dot.struck or dot.flight_time == pytest.approx(0.0, abs=1e-15)


def test_many_coinciding_edges() -> None:
    """The width is a multiple of the period, so that edges coincide all along the train."""
    drive = ph.PulseTrain(BLOCK.scaled(0.2), period=2.5e-5, pulses=40)
    found = hammers.compare(hammers.shelf(), drive, 2.5e-3, state=(STOP, 0.0))
    check_record(found.motion)
    assert drive.overlapping >= 8
    assert found.error < 1e-8
    assert found.horizon > 1e-3


def test_twenty_pulses_at_once() -> None:
    hammer = hammers.crude()
    waveform = hammers.waveforms(0.06, "current")["rectangle"]
    drive = ph.PulseTrain(waveform, period=2e-5, pulses=60)
    assert drive.overlapping >= 20
    found = hammers.compare(hammer, drive, 2.5e-3)
    check_record(found.motion)
    assert found.motion.status == "ok"
    assert found.error < 1e-8
    # The current that the kernel sums is the drive's own.
    np.testing.assert_allclose(found.motion.current, drive.value(found.motion.t), rtol=1e-13, atol=1e-15)
    assert any(c.surface == "pack" for c in found.motion.contacts)


def test_a_pulse_at_zero_and_one_much_later() -> None:
    drive = ph.PulseTrain(BLOCK, at=[0.0, 0.2])
    motion = ph.simulate(hammers.shelf(), drive, duration=0.204)
    single = ph.simulate(hammers.shelf(), ph.PulseTrain(BLOCK, at=[0.0]), duration=4e-3)
    check_record(motion)
    times = np.linspace(0.0, 4e-3, 101)
    x, _v = motion.at(times)
    y, _v = motion.at(np.minimum(0.2 + times, motion.end))
    np.testing.assert_allclose(x, single.at(times)[0], rtol=0.0, atol=1e-14)
    # At rest again long before, so the second cycle is the first one.
    np.testing.assert_allclose(y, x, rtol=0.0, atol=1e-8 * STROKE)
    assert [dot.struck for dot in motion.dots] == [True, True]


def test_no_drive_array_is_too_short() -> None:
    """A thousand overlapping pulses, all active at once."""
    waveform = Trapezoid(amplitude=0.014, rise=1e-5, width=3e-4, fall=1e-5, quantity="force")
    drive = ph.PulseTrain(waveform, period=2e-7, pulses=1000)
    motion = run(drive, 1e-3)
    assert motion.ok
    np.testing.assert_allclose(motion.force["drive"], drive.value(motion.t), rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("shape", ["rectangle", "half-sine", "sharp", "trapezoid"])
@pytest.mark.parametrize("amplitude", [9.0, -3.0])
def test_currents_beyond_the_one_that_bucks_all_of_the_pull(shape: str, amplitude: float) -> None:
    """Am - Bm I changes sign at 4.7 A: the pull grows again beyond."""
    hammer = hammers.crude()
    magnet = hammer.magnet
    assert amplitude < 0.0 or magnet.Am - magnet.Bm * amplitude < 0.0
    waveform = hammers.waveforms(amplitude, "current")[shape]
    found = hammers.compare(hammer, ph.PulseTrain(waveform, period=1.1e-3, pulses=2), 2e-3)
    check_record(found.motion)
    assert found.motion.status == found.truth.status
    assert found.error < 1e-8
    magnet_force = magnet.F0 - (magnet.Am - magnet.Bm * found.motion.current) ** 2 / np.sqrt(found.motion.x)
    np.testing.assert_allclose(found.motion.force["magnet"], magnet_force, rtol=1e-12, atol=1e-12)


def test_replaced_pulses_leave_nothing_behind() -> None:
    """With "replace", a firing cuts off the preceding pulse, including its tail."""
    waveform = Rectangle(amplitude=14.0, width=2e-4, rise=2e-5, decay=5e-5, quantity="force")
    drive = ph.PulseTrain(waveform, at=[0.0, 2.2e-4, 2.9e-4, 1e-3], overlap="replace")
    found = hammers.compare(hammers.shelf(), drive, 2e-3)
    check_record(found.motion)
    assert found.error < 1e-8
    np.testing.assert_allclose(
        found.motion.force["drive"], drive.value(found.motion.t), rtol=1e-12, atol=1e-12
    )


def switches(motion: ph.Motion) -> list[tuple[str, float]]:
    """All switches after which the motion depends on the state alone, without a remembered peak."""
    found = []
    for contact in motion.contacts:
        if not contact.initial:
            found.append((f"{contact.surface} in", contact.t_in))
        if contact.t_out is not None:
            found.append((f"{contact.surface} out", contact.t_out))
        if contact.surface == "pack":
            found.append(("pack peak", contact.t_peak))
    return found


@pytest.mark.parametrize(
    "hammer", ["current", "force", "rigid", pytest.param("dashpot", marks=pytest.mark.slow)]
)
def test_a_run_restarted_exactly_on_a_switch_goes_on(hammer: str) -> None:
    """A run restarted from its state at each switch and each edge gives the same motion."""
    end = 1.9e-3
    if hammer == "current":
        subject = hammers.crude()
        drive = ph.PulseTrain(hammers.waveforms(1.2, "current")["rectangle"], period=0.7e-3, pulses=2)
    else:
        drive = ph.PulseTrain(BLOCK, period=0.7e-3, pulses=2)
        backstop = hammers.rigid(0.6) if hammer == "rigid" else hammers.BACKSTOPS["elastomer"]
        parts = {"rigid": hammers.power(), "dashpot": hammers.PACKS["dashpot"]}
        subject = hammers.shelf()
        if hammer != "force":
            subject = hammers.made_of(spring=hammers.preload(-4.0), pack=parts[hammer], backstop=backstop)
    whole = ph.simulate(subject, drive, duration=end)
    check_record(whole)
    leaving = [(c.t_peak, c.t_out) for c in whole.contacts if c.surface == "pack"]
    edges = drive.times[:, np.newaxis] + drive.segments()[:, 0]
    # On its way out of the pack the armature remembers the peak, which a new start does not.
    free = [("edge", t) for t in edges.ravel() if not any(peak <= t < out for peak, out in leaving)]
    cuts = switches(whole) + free
    kinds = {kind for kind, _ in cuts}
    assert len(free) >= 2
    assert {"pack in", "pack out", "pack peak", "backstop in", "backstop out"} <= kinds
    x_end, v_end = whole.at(end)
    for kind, time in cuts:
        if not time < end:
            continue
        x, v = (float(value[0]) for value in whole.at(time))
        if kind == "pack peak" and hammer != "dashpot":
            v = 0.0
        record = Problem(subject, drive, (x, v), time, TOLERANCE).run(end)
        assert record.status_name == "ok", kind
        assert len(record.nodes) < 3000, kind
        assert record.nodes[-1, 1] == pytest.approx(x_end[0], abs=2e-8 * STROKE), (kind, time)
        assert record.nodes[-1, 2] == pytest.approx(v_end[0], abs=1e-6), (kind, time)


def test_a_restart_just_before_a_rigid_impact_meets_it_once() -> None:
    hammer = hammers.made_of(spring=hammers.preload(-4.0), pack=hammers.power(), backstop=hammers.rigid(0.6))
    whole = ph.simulate(hammer, hammers.idle(), duration=1e-4, state=(STOP + 1e-5, -1.0))
    impact = next(c for c in whole.contacts if not c.initial)
    again = ph.simulate(hammer, hammers.idle(), duration=1e-5, state=(STOP, impact.v_in))
    assert again.ok
    assert len(again.contacts) == 1
    assert again.at(1e-5)[0][0] == pytest.approx(whole.at(impact.t_in + 1e-5)[0][0], abs=1e-15)


def test_an_armature_that_runs_away() -> None:
    hammer = hammers.made_of(
        spring=hammers.preload(1.0, -1e5), pack=hammers.power(stiffness=1e-6), backstop=hammers.hertz()
    )
    motion = ph.simulate(hammer, hammers.idle(), duration=1.0, state=(FRONT, 1.0))
    assert motion.status == "runaway"
    assert "ran away" in motion.message
    assert motion.end < 0.1
    assert np.isfinite(motion.x).all()


def test_a_run_that_takes_too_many_steps_is_a_status(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("printhammer.run.problem.MAX_STEPS", 50)
    motion = run(ph.PulseTrain(BLOCK))
    assert motion.status == "step limit"
    assert "needed more than 50 steps" in motion.message
    assert 0.0 < motion.end < 1.5e-3
    assert motion.t[-1] <= motion.end


def test_a_high_frequency_force_misses_nothing() -> None:
    """A slow flight under 50 kHz: dozens of extrema, each step resolved."""
    hammer = hammers.shelf(-0.5)
    drive = ph.SineForce(20.0, 5e4, 0.3)
    found = hammers.compare(hammer, drive, 6e-4, state=(STOP + 6e-5, 0.3))
    check_record(found.motion)
    assert found.error < 1e-8
    for surface in ("pack", "backstop"):
        mine, theirs = found.touches(surface)
        assert len(mine) == len(theirs)
    half = HalfSine(amplitude=20.0, width=1e-5, quantity="force")
    train = ph.PulseTrain(half, period=2e-5, pulses=30)
    found = hammers.compare(hammer, train, 6e-4, state=(STOP + 6e-5, 0.3))
    assert found.error < 1e-8
