import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.oracle.integrator import reference
from tests.truth import oracles

from printhammer.drive.trains import PulseTrain, SineForce
from printhammer.drive.waveforms.shapes import HalfSine, Rectangle
from printhammer.kernel.model.laws import Laws
from printhammer.kernel.schemes_1983 import (
    CONTACT_STEP,
    FREE_STEP,
    LATE_AFTER,
    LATE_STEP,
    SchemeRun,
    integrate,
)
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.base import ROLES
from printhammer.parts.magnet.inverse_root import InverseRootMagnet
from printhammer.parts.pack.power import PowerPack
from printhammer.parts.spring.linear import PreloadSpring

MASS = 4e-4
MAGNET = InverseRootMagnet(F0=2.47, Am=0.437, Bm=0.0931)
SPRING = PreloadSpring(preload=14.3, stiffness=14.3 / 466e-6)
PACK = PowerPack(stiffness=259.0, front=203.2e-6, thickness=177.8e-6)
STOP = HertzBackstop(position=50.8e-6, stiffness=1.156e9, damping=4.175e8)
WAVEFORM = Rectangle(amplitude=0.9266, width=352e-6, rise=10.7e-6, decay=24.3e-6)
ONE_PULSE = PulseTrain(WAVEFORM)
NO_DRIVE = PulseTrain(WAVEFORM.scaled(0.0), start=1.0)
SCHEMES = {"trapezoid": 2, "runge-kutta-4": 4}


def made_of(mass: float = MASS, **parts: Any) -> SimpleNamespace:
    return SimpleNamespace(mass=mass, **{role: parts.get(role) for role in ROLES})


WHOLE = made_of(magnet=MAGNET, spring=SPRING, pack=PACK, backstop=STOP)


# What stands in for an absent part, with constants of zero, so that few sets of laws are compiled.
STAND_IN = made_of(spring=SPRING, pack=PACK, backstop=STOP)


def run(hammer: Any, drive: Any, state: tuple[float, float], t_end: float, **options: Any) -> SchemeRun:
    modules, constants = {}, {}
    origin = hammer.backstop.position if hammer.backstop else 0.0
    for role in ("magnet", "spring", "pack", "backstop"):
        part, stand_in = getattr(hammer, role), getattr(STAND_IN, role)
        law = part or stand_in
        modules[role] = law.module if law else ""
        constants[role] = np.array(law.packed(origin) if law else ()) * bool(part)
    return integrate(
        Laws(**modules, absent="printhammer.parts.absent"),
        constants,
        drive.kernel_arrays(),
        mass=hammer.mass,
        front=hammer.pack.front if hammer.pack else math.inf,
        position=hammer.backstop.position if hammer.backstop else -math.inf,
        state=state,
        t_end=t_end,
        **options,
    )


def orders(errors: list[float]) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_order_in_free_flight_under_a_half_sine_of_current(scheme: str) -> None:
    hammer = made_of(magnet=MAGNET, spring=SPRING)
    drive = PulseTrain(HalfSine(amplitude=1.1, width=4e-4))
    start, t_end = (150e-6, 0.3), 3.2e-4
    exact = reference(hammer, drive, t_end, state=start, tolerance=1e-15)
    errors = []
    for scale in (4.0, 2.0, 1.0, 0.5):
        ended = run(hammer, drive, start, t_end, scheme=scheme, scale=scale)
        assert ended.status == "ok"
        assert ended.t[-1] == t_end
        assert ended.t.size == round(t_end / (FREE_STEP * scale)) + 1
        errors.append(abs(ended.x[-1] - exact.x[-1]))
    np.testing.assert_allclose(orders(errors), SCHEMES[scheme], atol=0.25)
    assert orders(errors)[-1] == pytest.approx(SCHEMES[scheme], abs=0.06)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_order_on_a_linear_oscillator(scheme: str) -> None:
    mass, stiffness, frequency, t_end = 0.02, 3e5, 900.0, 4e-3
    hammer = made_of(mass, spring=PreloadSpring(preload=0.0, stiffness=stiffness))
    rate = 2.0 * math.pi * frequency
    exact = oracles.LinearMotion(mass, 0.0, stiffness, 0.0, 40.0, rate, 0.3, 0.0, 1e-3, -2.0)
    errors = []
    for scale in (2.0, 1.0, 0.5, 0.25):
        ended = run(hammer, SineForce(40.0, frequency, 0.3), (1e-3, -2.0), t_end, scheme=scheme, scale=scale)
        x, v = exact.at(t_end)
        errors.append(math.hypot(ended.x[-1] - x, (ended.v[-1] - v) / math.sqrt(stiffness / mass)))
    np.testing.assert_allclose(orders(errors), SCHEMES[scheme], atol=0.15)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_the_steps_follow_the_schedule(scheme: str, scale: float) -> None:
    rest = reference(WHOLE, NO_DRIVE, 1e-9).x[0]
    ended = run(WHOLE, ONE_PULSE, (rest, 0.0), 4e-3, scheme=scheme, scale=scale)
    steps, inside = np.diff(ended.t), ended.x < STOP.position
    expected = np.array([FREE_STEP, CONTACT_STEP, LATE_STEP]) * scale
    kind = np.argmin(np.abs(steps[:-1, None] - expected), axis=1)
    np.testing.assert_allclose(steps[:-1], expected[kind], rtol=1e-9)
    assert set(kind) == {0, 1, 2}
    assert not inside[:-2][kind == 0].any()
    assert not inside[1:-1][kind == 0].any()
    assert inside[:-2][kind == 2].all()
    late = ended.t[:-2][kind == 2][0]
    since = ended.t[:-2][~inside[:-2] & (ended.t[:-2] < late)][-1]
    assert late - since == pytest.approx(LATE_AFTER, abs=2.0 * CONTACT_STEP)


def test_both_complete_the_cycle_and_runge_kutta_is_the_better() -> None:
    exact = reference(WHOLE, ONE_PULSE, 4e-3, tolerance=1e-14)
    start = (float(exact.x[0]), 0.0)
    errors = {}
    for scheme in SCHEMES:
        ended = run(WHOLE, ONE_PULSE, start, 4e-3, scheme=scheme)
        assert ended.status == "ok"
        errors[scheme] = np.abs(ended.x - exact.at(ended.t)[0]).max()
    assert errors["runge-kutta-4"] < errors["trapezoid"] < 3e-5
    fine = run(WHOLE, ONE_PULSE, start, 1e-3, scheme="runge-kutta-4", scale=0.02)
    assert np.abs(fine.x - exact.at(fine.t)[0]).max() < 1e-8


def test_large_steps_break_runge_kutta_first() -> None:
    start = (float(reference(WHOLE, NO_DRIVE, 1e-9).x[0]), 0.0)
    status = {scheme: run(WHOLE, ONE_PULSE, start, 4e-3, scheme=scheme, scale=6.0) for scheme in SCHEMES}
    assert status["trapezoid"].status == "ok"
    assert status["runge-kutta-4"].status == "diverged"
    assert status["runge-kutta-4"].t[-1] < 4e-3
    assert np.isfinite(status["runge-kutta-4"].x).all()


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_pack_alone(scheme: str) -> None:
    exact = oracles.pack_rebound(MASS, PACK.stiffness, PACK.thickness, 1.5)
    ended = run(made_of(pack=PACK), NO_DRIVE, (PACK.front, 1.5), 4e-4, scheme=scheme, scale=0.02)
    assert ended.v[-1] == pytest.approx(-exact.speed_out, rel=2e-4)
    assert ended.x.max() - PACK.front == pytest.approx(exact.indentation, rel=2e-4)


def test_reloading_along_the_unloading_curve() -> None:
    hammer = made_of(spring=PreloadSpring(preload=40.0, stiffness=0.0), pack=PACK)
    options = {"scheme": "runge-kutta-4", "scale": 0.02}
    along, jumping = (
        run(hammer, NO_DRIVE, (PACK.front, 1.5), 1e-3, reload_along_unloading=choice, **options)
        for choice in (True, False)
    )
    later = along.t > 5e-4
    assert along.x[later].max() == pytest.approx(along.x.max(), rel=1e-5)
    assert jumping.x[later].max() < jumping.x.max() - 1e-6
    turns, _ = oracles.pack_under_force(MASS, PACK.stiffness, PACK.thickness, 40.0, 1.5, 2)
    for ended in (along, jumping):
        assert ended.x.max() - PACK.front == pytest.approx(turns[0][1], rel=1e-5)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_backstop_alone(scheme: str) -> None:
    exact = oracles.backstop_speed_ratio(STOP.l / STOP.k * 0.5) * 0.5
    ended = run(
        made_of(backstop=STOP), NO_DRIVE, (STOP.position - 1e-12, -0.5), 1e-4, scheme=scheme, scale=0.1
    )
    assert ended.v[-1] == pytest.approx(exact, rel=1e-3)


def test_a_rigid_backstop_rebounds() -> None:
    stop = RigidBackstop(position=0.0, restitution=0.6)
    ended = run(made_of(backstop=stop), NO_DRIVE, (1e-5, -0.5), 1e-4, rigid=True)
    assert ended.v[-1] == pytest.approx(0.3, rel=1e-9)
    assert ended.x.min() == 0.0


@pytest.mark.parametrize("overlap", ["add", "replace"])
def test_the_drive_acts_as_it_says(overlap: str) -> None:
    force = Rectangle(amplitude=2.0, width=352e-6, rise=10.7e-6, decay=24.3e-6, quantity="force")
    drive = PulseTrain(force, at=[0.0, 3.3e-4, 5e-4], overlap=overlap)
    exact = reference(made_of(), drive, 2e-3, state=(0.0, 0.0))
    ended = run(made_of(), drive, (0.0, 0.0), 2e-3, scheme="runge-kutta-4", scale=0.05)
    assert ended.v[-1] == pytest.approx(exact.v[-1], rel=3e-3)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_step_ends_at_each_of_many_close_firings(scheme: str) -> None:
    """At least three steps per firing, even if the short steps alone would divide the run into fewer."""
    drive = PulseTrain(WAVEFORM.scaled(0.0), at=2.5 * CONTACT_STEP * np.arange(1, 401))
    start = (STOP.position - 5e-6, 0.0)
    ended = run(WHOLE, drive, start, 1e-3, scheme=scheme, reading="firings")
    assert ended.status == "ok"
    assert (ended.x < STOP.position).all()
    assert np.isin(drive.times[:-1], ended.t).all()
    assert ended.t.size == 3 * drive.times.size + 1


def test_leaving_the_range_of_a_law_is_a_status() -> None:
    hammer = made_of(magnet=MAGNET)
    for scheme, status in (("trapezoid", "newton failed"), ("runge-kutta-4", "diverged")):
        ended = run(hammer, NO_DRIVE, (40e-6, -3.0), 1e-3, scheme=scheme)
        assert ended.status == status
        assert 0.0 < ended.x[-1] < 40e-6


@pytest.mark.parametrize("bad", [{"scheme": "euler"}, {"scale": 0.0}, {"scale": math.nan}])
def test_bad_arguments_are_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="expected"):
        run(WHOLE, NO_DRIVE, (60e-6, 0.0), 1e-3, **bad)
