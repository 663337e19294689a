"""Regression tests in flight and in the pack: cases in which an earlier kernel hung or was wrong.

The armature flies under a constant force, so that a free step has the maximum length and the flight
is known in closed form; contacts are compared with the reference.
"""

import math

import numpy as np
import pytest
from tests import hammers
from tests.hammers import FRONT, MASS, STOP, STROKE
from tests.oracle.integrator import reference

import printhammer as ph
from printhammer.drive.waveforms.shapes import Rectangle, Trapezoid
from printhammer.kernel.methods.landing import step_factor
from printhammer.run.contacts import Contact

PULL = 1e4
"""Deceleration of `hammers.shelf`, m/s^2."""


def edges_at(*times: float) -> ph.PulseTrain:
    """Return a drive without force that has edges at given times."""
    waveform = Rectangle(amplitude=0.0, width=2e-5, rise=0.0, decay=0.0, quantity="force")
    return ph.PulseTrain(waveform, at=list(times))


def thrown(excess: float, speed: float = 1.0) -> tuple[float, float]:
    """A state from which free flight would rise `excess` above the front of the pack."""
    return FRONT + excess - speed**2 / (2.0 * PULL), speed


def pack_contacts(motion: ph.Motion) -> list[Contact]:
    return [c for c in motion.contacts if c.surface == "pack"]


@pytest.mark.parametrize("depth", [1e-6, 1e-9, 1e-12, 1e-14, 1e-16])
@pytest.mark.parametrize("edge", [0.0, -1e-6, 1e-7, 5e-6])
def test_a_free_step_enters_and_leaves_the_pack(depth: float, edge: float) -> None:
    """A graze of any depth is found for any end of the step: an edge `edge` after the apex ends it there."""
    apex = 1.0 / PULL
    motion = ph.simulate(hammers.shelf(), edges_at(apex + edge), duration=1.5e-4, state=thrown(depth))
    assert motion.ok
    assert motion.steps < 500
    (contact,) = pack_contacts(motion)
    speed = math.sqrt(2.0 * PULL * depth)
    # The front is met to a small part of the tolerance; the slower the touch, the more time that is.
    assert contact.t_in == pytest.approx((1.0 - speed) / PULL, abs=1e-12 * STROKE / speed)
    assert contact.v_in == pytest.approx(speed, rel=1e-2)
    assert contact.t_in < contact.t_peak < contact.t_out
    assert contact.depth == pytest.approx(depth, rel=2e-2, abs=3e-20)
    assert contact.peak_force >= 0.0


@pytest.mark.parametrize("gap", [1e-6, 1e-9, 1e-12, 1e-14, 1e-16])
@pytest.mark.parametrize("edge", [0.0, -1e-6, 1e-7, 5e-6])
def test_a_near_miss_is_no_contact(gap: float, edge: float) -> None:
    motion = ph.simulate(hammers.shelf(), edges_at(1.0 / PULL + edge), duration=1.5e-4, state=thrown(-gap))
    assert motion.ok
    assert pack_contacts(motion) == []
    _times, heights = motion.maxima
    assert heights == pytest.approx([FRONT - gap], rel=1e-15, abs=2e-19)


def test_a_tangential_touch_ends() -> None:
    """The apex lies on the front to rounding: a touch and a miss are both right, but the run must end."""
    for ulps in range(-3, 4):
        x, v = thrown(0.0)
        motion = ph.simulate(
            hammers.shelf(), hammers.idle(), duration=2.5e-4, state=(x + ulps * math.ulp(x), v)
        )
        assert motion.ok
        assert motion.steps < 500
        depths = [c.depth for c in pack_contacts(motion)]
        assert len(depths) <= 1
        assert all(depth < 1e-18 for depth in depths)
        expected = FRONT - 0.5 * PULL * (1.4e-4 - 1.0 / PULL) ** 2
        assert motion.at(1.4e-4)[0][0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("x", "v"), [(FRONT, 0.0), (FRONT, 1e-9), (FRONT, -1e-9), (FRONT, 2.0), (FRONT, -2.0)]
)
@pytest.mark.parametrize("force", [-2.0, 2.0])
def test_a_start_on_the_front(force: float, x: float, v: float) -> None:
    found = hammers.compare(hammers.shelf(force), hammers.idle(), 1e-3, state=(x, v))
    assert found.motion.status == found.truth.status == "ok"
    assert found.error < 1e-9
    assert found.horizon == 1e-3
    assert found.motion.steps < 500


@pytest.mark.parametrize("ulps", [-2, -1, 1, 2])
@pytest.mark.parametrize("force", [-2.0, 2.0])
def test_a_start_beside_the_front(force: float, ulps: int) -> None:
    state = FRONT + ulps * math.ulp(FRONT), 0.0
    found = hammers.compare(hammers.shelf(force), hammers.idle(), 1e-3, state=state)
    assert found.motion.status == "ok"
    assert found.error < 1e-9
    assert found.motion.steps < 500


@pytest.mark.parametrize("depth", [1e-16, 1e-17, 1e-18, 1e-19])
def test_a_reversal_at_the_very_front_has_no_negative_root(depth: float) -> None:
    """At a peak of some 1e-13 of the thickness, q = S rmax^-8.3 is near 1e108 and r may round below zero."""
    motion = ph.simulate(hammers.shelf(), hammers.idle(), duration=2.5e-4, state=thrown(depth, 0.2))
    assert motion.ok
    assert motion.steps < 500
    assert all(np.isfinite(force).all() for force in motion.force.values())
    assert np.isfinite([c.peak_force for c in pack_contacts(motion)]).all()
    assert motion.energy.pack_loss < 1e-20


@pytest.mark.parametrize("ratio", [math.nan, math.inf, 1e300])
def test_a_step_without_a_finite_error_is_shortened(ratio: float) -> None:
    assert step_factor(ratio) == 0.2


def test_a_nan_error_estimate_is_no_small_error() -> None:
    """Beyond x = 0 the magnet's law is NaN: stages there must not be accepted, nor repeated without end."""
    hammer = hammers.made_of(magnet=hammers.MAGNETS["inverse-root"], spring=hammers.SPRINGS["linear"])
    times = np.linspace(0.0, 2e-3, 301)
    with hammers.interpreted():
        motion = ph.simulate(hammer, hammers.idle("current"), duration=2e-3, state=(60e-6, -0.5), times=times)
        assert np.isfinite(motion.x).all()
    assert motion.status == "range left"
    assert "left the range" in motion.message
    assert (motion.x > 0.0).all()
    truth = reference(hammer, hammers.idle("current"), 2e-3, state=(60e-6, -0.5), times=motion.t)
    assert truth.status == "range left"
    # The reference ends a nanometre before the singularity.
    assert motion.end == pytest.approx(truth.end, rel=1e-4)
    before = motion.t < 0.99 * truth.end
    np.testing.assert_allclose(motion.x[before], truth.x[before], rtol=0.0, atol=1e-8 * STROKE)


@pytest.mark.parametrize(
    ("force", "speed", "goes_in"),
    [(12.0, 1.5, False), (40.0, 1.5, False), (130.0, 1.5, False), (2.0, 1.25, True), (12.0, 4.3, True)],
)
def test_reversals_inside_the_pack_from_below(force: float, speed: float, goes_in: bool) -> None:
    """The wire enters again if the force exceeds the loading branch; else the trough is a new maximum."""
    hammer = hammers.shelf(force)
    found = hammers.compare(hammer, hammers.idle(), 6e-4, state=(FRONT, speed))
    events = found.truth.events
    troughs = [i for i, event in enumerate(events) if event.kind == "pack-trough"]
    at_once = [events[i + 1].time == events[i].time for i in troughs if i + 1 < len(events)]
    # Each case must be of the kind that it stands for.
    assert at_once
    assert at_once[0] is not goes_in
    assert found.motion.status == "ok"
    assert found.error < 1e-8
    assert found.horizon > 4e-4


@pytest.mark.slow
@pytest.mark.parametrize("reloading", ["loading-branch", "unloading-curve"])
def test_held_inside_the_pack_until_the_force_fades(reloading: str) -> None:
    """Rest inside the pack ends when the force begins to change, not later."""
    hammer = hammers.shelf(-2.0).replace("pack.reloading", reloading)
    drive = ph.PulseTrain(Trapezoid(amplitude=20.0, rise=5e-5, width=2.4e-3, fall=4e-4, quantity="force"))
    found = hammers.compare(hammer, drive, 4e-3, points=1601)
    assert found.motion.status == "ok"
    mine, theirs = found.touches("pack")
    assert len(mine) == len(theirs) >= 1
    assert found.horizon > 1.5e-3
    # Without loss the wire swings in the pack some forty times, and the error grows with each.
    assert found.error < (1e-8 if reloading == "loading-branch" else 1e-7)


def test_rest_in_the_pack_is_the_same_between_the_steps() -> None:
    """The rest state persists at all times, for any step length."""
    hammer = hammers.shelf(20.0)
    motion = ph.simulate(hammer, hammers.idle(), duration=5e-3, state=(FRONT, 0.5))
    late = np.linspace(3e-3, 5e-3, 1001)
    x, v = motion.at(late)
    assert np.ptp(x) < 1e-15
    assert np.abs(v).max() < 1e-9
    forces = motion.forces_at(late)
    np.testing.assert_allclose(forces["pack"], -20.0, rtol=1e-9)
    np.testing.assert_allclose(forces["total"], 0.0, atol=1e-8)
    assert abs(motion.energy.residual) < 1e-8 * motion.energy.throughput


def test_rest_in_the_pack_for_a_second_takes_few_steps() -> None:
    motion = ph.simulate(hammers.shelf(20.0), hammers.idle(), duration=1.0, state=(FRONT, 0.5))
    assert motion.ok
    assert motion.steps < 20_000
    (contact,) = pack_contacts(motion)
    assert contact.t_out is None
    x, _v = motion.at([0.01, 1.0])
    assert abs(x[1] - x[0]) < 1e-15


def test_fast_flights_into_the_pack() -> None:
    """An impact at 1000 m/s: the whole stroke within one time unit of the contact."""
    for state in ((FRONT, 1e3), (STOP, 1e3), (FRONT - 1e-9, 50.0)):
        found = hammers.compare(hammers.shelf(), hammers.idle(), 2e-5, state=state, scale=STROKE)
        assert found.motion.status == "ok"
        assert found.error < 1e-8
        assert len(found.touches("pack")[0]) == len(found.touches("pack")[1])


@pytest.mark.parametrize("speed", [0.0, 1.0, -1.0, 30.0, -30.0])
def test_starts_inside_the_pack(speed: float) -> None:
    """A state in the pack meets fresh paper at its own depth, as in the reference."""
    found = hammers.compare(hammers.shelf(), hammers.idle(), 4e-4, state=(FRONT + 4e-5, speed))
    assert found.motion.contacts[0].initial
    assert found.motion.status == "ok"
    assert found.error < 1e-8


def test_pack_of_all_hardnesses() -> None:
    for stiffness in (1e-2, 1.0, 1e4, 1e7):
        hammer = hammers.made_of(
            MASS, spring=hammers.preload(-2.0), pack=hammers.power(stiffness), backstop=hammers.hertz()
        )
        found = hammers.compare(hammer, hammers.idle(), 4e-4, state=(FRONT - 1e-5, 1.0))
        assert found.motion.status == "ok"
        assert found.error < 1e-8, stiffness
        assert len(found.touches("pack")[0]) == len(found.touches("pack")[1]) >= 1
