"""Motion: independent of the output grid, repeatable; contacts and dots agree with dense samples."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest
from tests import hammers
from tests.errors import refused
from tests.hammers import FRONT, STOP, STROKE

import printhammer as ph
from printhammer.drive.waveforms.shapes import Rectangle

PULSE = Rectangle(amplitude=14.0, width=3e-4, rise=0.0, decay=0.0, quantity="force")


@pytest.fixture(scope="module")
def motion() -> ph.Motion:
    hammer = hammers.crude()
    drive = ph.PulseTrain(hammers.waveforms(1.2, "current")["rectangle"], period=1.1e-3, pulses=3)
    return ph.simulate(hammer, drive, ledger=True)


def test_nothing_depends_on_the_output_grid(motion: ph.Motion) -> None:
    """Bit-identical states at the same instants, requested in any company and order."""
    rng = np.random.default_rng(5)
    times = rng.uniform(0.0, motion.end, 400)
    x, v = motion.at(times)
    for other in (
        ph.simulate(motion.hammer, motion.drive, times=np.sort(times)),
        ph.simulate(motion.hammer, motion.drive, points=2),
        ph.simulate(motion.hammer, motion.drive, points=77),
    ):
        y, w = other.at(times)
        assert x.tobytes() == y.tobytes()
        assert v.tobytes() == w.tobytes()
        assert other.contacts == motion.contacts
        assert other.dots == motion.dots
        assert other.energy == motion.energy
        assert other.steps == motion.steps
    grid = ph.simulate(motion.hammer, motion.drive, times=np.sort(times))
    order = np.argsort(times)
    assert grid.x.tobytes() == x[order].tobytes()
    for name, values in motion.forces_at(times).items():
        assert values[order].tobytes() == grid.force[name].tobytes()
    one_by_one = np.array([motion.at(t)[0][0] for t in times[:50]])
    assert one_by_one.tobytes() == x[:50].tobytes()


def fingerprint(motion: ph.Motion) -> str:
    digest = hashlib.sha256(motion.x.tobytes() + motion.v.tobytes() + motion.step_times.tobytes())
    digest.update(repr((motion.contacts, motion.dots, motion.energy)).encode())
    return digest.hexdigest()


SCRIPT = """
from tests import hammers
from tests.run.test_motion import fingerprint
import printhammer as ph
hammer = hammers.crude()
print(fingerprint(ph.simulate(hammer, ph.PulseTrain(hammer.waveform, period=1.3e-3, pulses=2), points=500)))
"""


def test_same_input_same_bits() -> None:
    hammer = hammers.crude()
    drive = ph.PulseTrain(hammer.waveform, period=1.3e-3, pulses=2)
    here = {fingerprint(ph.simulate(hammer, drive, points=500)) for _ in range(2)}
    there = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True, env=dict(os.environ)
    )
    assert here == {there.stdout.strip()}


def test_contacts_are_where_dense_samples_are_inside(motion: ph.Motion) -> None:
    times = np.linspace(0.0, motion.end, 200_003)[1:-1]
    x, _v = motion.at(times)
    for surface, inside in (("pack", x > FRONT), ("backstop", x < STOP)):
        covered = np.zeros(times.size, bool)
        for contact in motion.contacts:
            if contact.surface != surface:
                continue
            out = motion.end if contact.t_out is None else contact.t_out
            here = (times > contact.t_in) & (times < out)
            covered |= here
            deep = x[here] - FRONT if surface == "pack" else STOP - x[here]
            assert contact.depth >= deep.max() * (1.0 - 1e-12)
            assert contact.depth == pytest.approx(deep.max(), rel=1e-5)
        # Within a sample of a switch either side is right.
        odd = np.flatnonzero(covered != inside)
        near = [c.t_in for c in motion.contacts] + [c.t_out for c in motion.contacts if c.t_out is not None]
        for index in odd:
            assert np.abs(times[index] - np.array(near)).min() < 1e-11


def test_peak_forces_and_losses_are_those_of_dense_samples(motion: ph.Motion) -> None:
    for contact in motion.contacts:
        if contact.t_out is None or contact.initial:
            continue
        times = np.linspace(contact.t_in, contact.t_out, 20_001)
        forces = motion.forces_at(times)
        pushing = -forces["pack"] if contact.surface == "pack" else forces["backstop"] + forces["damping"]
        assert contact.peak_force == pytest.approx(pushing.max(), rel=1e-5)
        assert contact.peak_force >= pushing.max() * (1.0 - 1e-10)
        _x, v = motion.at(times)
        power = -(forces["pack"] if contact.surface == "pack" else forces["damping"]) * v
        assert contact.loss == pytest.approx(np.trapezoid(power, times), rel=1e-4)


def test_the_forces_add_up_to_the_acceleration(motion: ph.Motion) -> None:
    edges = np.concatenate([motion.step_times, motion.drive.times])
    times = np.linspace(1e-6, motion.end - 1e-6, 997)
    step = 1e-8
    clear = np.array([np.abs(edges - t).min() > 2.0 * step for t in times])
    times = times[clear]
    _x, before = motion.at(times - step)
    _x, after = motion.at(times + step)
    total = motion.forces_at(times)["total"]
    scale = np.abs(total).max()
    np.testing.assert_allclose(motion.hammer.mass * (after - before) / (2.0 * step), total, atol=1e-5 * scale)


def test_largest_maxima_between_firings(motion: ph.Motion) -> None:
    fired = [*motion.drive.times, motion.end]
    for index in range(3):
        times = np.linspace(fired[index], fired[index + 1], 100_001)
        x, _v = motion.at(times)
        found = motion.peak_after(index)
        assert found is not None
        assert found[1] == pytest.approx(x.max(), rel=1e-9)
        assert found[0] == pytest.approx(times[np.argmax(x)], abs=2.0 * (times[1] - times[0]))
    with refused("firing"):
        motion.peak_after(3)


def test_strobe(motion: ph.Motion) -> None:
    times, x, v = motion.strobe
    np.testing.assert_array_equal(times, motion.drive.times)
    y, w = motion.at(times)
    assert x.tobytes() == y.tobytes()
    assert v.tobytes() == w.tobytes()


def test_a_time_outside_is_refused(motion: ph.Motion) -> None:
    for time in (-1e-9, motion.end * 1.001, np.nan):
        with refused("t"):
            motion.at([0.0, time])


def test_the_ledger_closes(motion: ph.Motion) -> None:
    ledger = motion.energy
    assert abs(ledger.residual) < 1e-8 * ledger.throughput
    assert ledger.coil_work > 0.0
    assert ledger.drive_work == 0.0
    packs = sum(c.loss for c in motion.contacts if c.surface == "pack")
    stops = sum(c.loss for c in motion.contacts if c.surface == "backstop")
    assert ledger.pack_loss == pytest.approx(packs, rel=1e-12)
    assert ledger.backstop_loss == pytest.approx(stops, rel=1e-12)


def fired(times: list[float], state: tuple[float, float] = (STOP, 0.0), duration: float = 2e-3) -> ph.Motion:
    return ph.simulate(hammers.shelf(), ph.PulseTrain(PULSE, at=times), duration=duration, state=state)


def test_a_dot_is_the_first_contact_after_its_firing() -> None:
    motion = fired([0.0, 1.2e-3])
    packs = [c for c in motion.contacts if c.surface == "pack"]
    assert [dot.struck for dot in motion.dots] == [True, True]
    for dot in motion.dots:
        first = next(c for c in packs if c.t_in >= dot.fired_at)
        assert first.firing == dot.index
        assert dot.flight_time == first.t_in - dot.fired_at
        assert (dot.impact_speed, dot.peak_force, dot.indentation) == (
            first.v_in,
            first.peak_force,
            first.depth,
        )
        assert dot.contact_time == first.t_out - first.t_in
        assert dot.net_loss == first.loss


def test_a_flight_longer_than_the_period() -> None:
    """The contact belongs to the latest firing before it; the firing that was in flight lost its dot."""
    alone = fired([0.0]).dots[0]
    assert alone.flight_time is not None
    second = 0.8 * alone.flight_time
    dots = fired([0.0, second]).dots
    assert [dot.struck for dot in dots] == [False, True]
    assert dots[0].flight_time is None
    assert dots[0].extra_contacts == 0
    assert dots[1].flight_time < 0.3 * alone.flight_time


def test_a_contact_open_at_a_firing_belongs_to_the_dot_before() -> None:
    alone = next(c for c in fired([0.0]).contacts if c.surface == "pack")
    assert alone.t_out is not None
    motion = fired([0.0, 0.5 * (alone.t_in + alone.t_out)], duration=3e-3)
    packs = [c for c in motion.contacts if c.surface == "pack"]
    assert packs[0].firing == 0
    assert motion.dots[0].struck
    assert motion.dots[0].contact_time == packs[0].t_out - packs[0].t_in
    assert all(c.firing == 1 for c in packs[1:])
    assert motion.dots[1].struck == (len(packs) > 1)


def test_extra_contacts() -> None:
    """Pressed by a long pulse, the wire returns to the pack before the next firing."""
    motion = ph.simulate(hammers.shelf(0.5), ph.PulseTrain(PULSE), duration=4e-3, state=(FRONT - 1e-5, 2.0))
    packs = [c for c in motion.contacts if c.surface == "pack"]
    assert len(packs) >= 2
    assert [c.extra for c in packs] == [False] + [True] * (len(packs) - 1)
    assert motion.dots[0].extra_contacts == len(packs) - 1


def test_a_contact_open_at_the_start_makes_no_dot() -> None:
    motion = fired([1e-3], state=(FRONT + 2e-5, 0.0))
    assert motion.contacts[0].initial
    assert motion.contacts[0].firing is None
    assert motion.dots[0].struck
    assert motion.dots[0].flight_time > 0.0


def test_firings_after_the_end_have_no_dots() -> None:
    assert len(fired([0.0, 1e-3, 5e-3], duration=2e-3).dots) == 2


def test_provenance_names_what_the_motion_comes_from(motion: ph.Motion) -> None:
    told = motion.provenance
    assert told["hammer_fingerprint"] == motion.hammer.fingerprint
    assert told["drive_fingerprint"] == motion.drive.fingerprint
    assert told["status"] == "ok"
    assert float(told["tolerance"]) < 1e-9
    assert STROKE > 0.0
