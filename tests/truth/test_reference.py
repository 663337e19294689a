"""The slow oracle against closed forms, against other methods, and against itself."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import RectBivariateSpline
from tests.oracle.integrator import ReferenceRun, _Run, horizon, reference
from tests.oracle.series import ORDER
from tests.truth import oracles

from printhammer.drive.trains import PulseTrain, SineForce
from printhammer.drive.waveforms.shapes import Rectangle
from printhammer.parts.backstop.elastomer import ElastomerBackstop
from printhammer.parts.backstop.hertz import HertzBackstop
from printhammer.parts.backstop.rigid import RigidBackstop
from printhammer.parts.base import ROLES
from printhammer.parts.magnet.inverse_root import InverseRootMagnet
from printhammer.parts.magnet.table import TableMagnet
from printhammer.parts.pack.dashpot import DashpotPack
from printhammer.parts.pack.power import PowerPack
from printhammer.parts.spring.linear import LinearSpring, PreloadSpring

MASS = 4e-4
MAGNET = InverseRootMagnet(F0=2.47, Am=0.437, Bm=0.0931)
SPRING = LinearSpring(Bs=14.3, As=466e-6)
PACK = PowerPack(stiffness=259.0, front=203.2e-6, thickness=177.8e-6)
STOP = HertzBackstop(position=50.8e-6, stiffness=1.156e9, damping=4.175e8)
WAVEFORM = Rectangle(amplitude=0.9266, width=352e-6, rise=10.7e-6, decay=24.3e-6)


def made_of(mass: float = MASS, **parts: Any) -> SimpleNamespace:
    """A hammer composed of parts, in the form that the reference reads."""
    return SimpleNamespace(mass=mass, **{role: parts.get(role) for role in ROLES})


WHOLE = made_of(magnet=MAGNET, spring=SPRING, pack=PACK, backstop=STOP)
ONE_PULSE = PulseTrain(WAVEFORM)
NO_DRIVE = PulseTrain(WAVEFORM.scaled(0.0), start=1.0)


def kinds(run: ReferenceRun) -> list[str]:
    return [event.kind for event in run.events]


@pytest.mark.parametrize("speed", [1e-3, 1.5, 40.0])
@pytest.mark.parametrize(("mass", "stiffness"), [(4e-4, 259.0), (2e-2, 3e4)])
def test_the_pack_alone(mass: float, stiffness: float, speed: float) -> None:
    exact = oracles.pack_rebound(mass, stiffness, PACK.thickness, speed)
    pack = PACK.model_copy(update={"stiffness": stiffness})
    run = reference(made_of(mass, pack=pack), NO_DRIVE, 0.9, state=(PACK.front - 1e-6, speed))
    assert kinds(run) == ["pack-touch", "pack-peak", "pack-leave"]
    touch, peak, leave = run.events
    assert touch.time == pytest.approx(1e-6 / speed, rel=1e-11)
    assert peak.x - PACK.front == pytest.approx(exact.indentation, rel=1e-11)
    assert peak.time - touch.time == pytest.approx(exact.loading_time, rel=1e-10)
    assert leave.time - peak.time == pytest.approx(exact.unloading_time, rel=1e-10)
    assert leave.v == pytest.approx(-exact.speed_out, rel=1e-11)


@pytest.mark.parametrize("speed", [1e-4, 0.3, 2.0, 30.0])
@pytest.mark.parametrize("damping", [0.0, 1e6, 4e8])
def test_the_backstop_alone(damping: float, speed: float) -> None:
    k = 1.156e9
    stop = STOP.model_copy(update={"damping": damping})
    run = reference(made_of(backstop=stop), NO_DRIVE, 0.9, state=(STOP.position, -speed))
    ratio = oracles.backstop_speed_ratio(damping / k * speed) if damping else 1.0
    time_in, time_out = oracles.backstop_times(MASS, k, damping, speed)
    leave = run.events[-1]
    assert kinds(run) == ["backstop-leave"]
    assert leave.v == pytest.approx(ratio * speed, rel=2e-10)
    assert leave.time == pytest.approx(time_in + time_out, rel=1e-10)
    deepest = STOP.position - run.at(time_in)[0][0]
    assert deepest == pytest.approx(oracles.backstop_indentation(MASS, k, damping, speed), rel=1e-10)
    if damping == 0.0:
        assert leave.time == pytest.approx(oracles.hertz_duration(MASS, k, speed), rel=1e-10)


def test_the_rigid_impact_oscillator() -> None:
    mass, stiffness, frequency = 0.02, 3000.0, 95.0
    oscillator = oracles.Oscillator(
        mass, stiffness, 40.0, 2.0 * math.pi * frequency, 0.3, surface=-1e-3, restitution=0.7
    )
    pieces, touches = oscillator.run(0.0, 0.0, 0.2)
    hammer = made_of(
        mass,
        spring=PreloadSpring(preload=3.0, stiffness=stiffness),
        backstop=RigidBackstop(position=-1e-3, restitution=0.7),
    )
    times = np.linspace(0.0, 0.2, 101)
    run = reference(hammer, SineForce(40.0, frequency, 0.3), 0.2, state=(0.0, 0.0), times=times)
    got = [(event.time, event.v) for event in run.events if event.kind == "backstop-touch"]
    assert len(touches) > 8
    np.testing.assert_allclose(got, touches, rtol=1e-9)
    exact = np.array([oracles.piece_at(pieces, t) for t in times])
    np.testing.assert_allclose(run.x, exact[:, 0], rtol=0.0, atol=1e-12)


def test_the_oscillator_with_a_dashpot() -> None:
    mass, stiffness, frequency, front = 0.02, 3000.0, 95.0, 1e-3
    oscillator = oracles.Oscillator(
        mass,
        stiffness,
        40.0,
        2.0 * math.pi * frequency,
        0.3,
        surface=front,
        contact_stiffness=2e5,
        contact_damping=20.0,
    )
    pieces, touches = oscillator.run(0.0, 0.0, 0.2)
    hammer = made_of(
        mass,
        spring=PreloadSpring(preload=0.0, stiffness=stiffness),
        pack=DashpotPack(stiffness=2e5, damping=20.0, front=front),
    )
    times = np.linspace(0.0, 0.2, 101)
    run = reference(hammer, SineForce(40.0, frequency, 0.3), 0.2, state=(0.0, 0.0), times=times)
    got = [(event.time, event.v) for event in run.events if event.kind == "pack-touch"]
    assert len(touches) > 8
    np.testing.assert_allclose(got, touches, rtol=1e-9)
    exact = np.array([oracles.piece_at(pieces, t) for t in times])
    np.testing.assert_allclose(run.x, exact[:, 0], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.9])
def test_bounces_on_a_rigid_backstop_end(restitution: float) -> None:
    hammer = made_of(
        spring=PreloadSpring(preload=-4.0, stiffness=0.0),
        backstop=RigidBackstop(position=0.0, restitution=restitution),
    )
    run = reference(hammer, NO_DRIVE, 0.1, state=(0.0, -1.0))
    assert kinds(run)[-1] == "backstop-stick"
    pull = 4.0 / MASS
    end = oracles.bouncing_end(restitution, pull, 1.0)
    # Bounces lower than 1e-16 m are left out.
    left_out = oracles.bouncing_end(restitution, pull, math.sqrt(2.0 * pull * 1e-16) / max(restitution, 0.1))
    assert -1e-15 <= end - run.events[-1].time <= left_out
    assert run.x[-1] == 0.0
    assert run.v[-1] == 0.0


def test_release_from_a_rigid_backstop() -> None:
    hammer = made_of(
        spring=PreloadSpring(preload=-4.0, stiffness=0.0),
        backstop=RigidBackstop(position=0.0, restitution=0.5),
    )
    run = reference(hammer, SineForce(8.0, 50.0), 2.5e-3, state=(0.0, 0.0))
    assert kinds(run) == ["backstop-stick", "backstop-release"]
    # 8 sin(100 pi t) reaches 4 at a twelfth of the period.
    start, rate = 1.0 / 600.0, 100.0 * math.pi
    assert run.events[-1].time == pytest.approx(start, rel=1e-9)
    s = 2.5e-3 - start
    speed = (8.0 * (math.cos(rate * start) - math.cos(rate * 2.5e-3)) / rate - 4.0 * s) / MASS
    assert run.v[-1] == pytest.approx(speed, rel=1e-9)


@pytest.mark.parametrize("force", [2.0, 40.0, 130.0])
def test_held_in_the_pack(force: float) -> None:
    exact, speed_out = oracles.pack_under_force(MASS, PACK.stiffness, PACK.thickness, force, 1.5, 14)
    hammer = made_of(spring=PreloadSpring(preload=force, stiffness=0.0), pack=PACK)
    run = reference(hammer, NO_DRIVE, 2e-3, state=(PACK.front, 1.5), tolerance=1e-13)
    assert (speed_out is None) == (force > 2.0)
    got = [(event.kind, event.x - PACK.front) for event in run.events if event.kind != "pack-leave"]
    assert len(got) >= len(exact)
    for (kind, u), (exact_kind, exact_u) in zip(got, exact, strict=False):
        assert kind == f"pack-{exact_kind}"
        assert u == pytest.approx(exact_u, rel=1e-10)
    if speed_out is not None:
        leave = next(event for event in run.events if event.kind == "pack-leave")
        assert leave.v == pytest.approx(-speed_out, rel=1e-10)


def test_reloading_along_the_unloading_curve_loses_nothing() -> None:
    pack = PACK.model_copy(update={"reloading": "unloading-curve"})
    hammer = made_of(spring=PreloadSpring(preload=40.0, stiffness=0.0), pack=pack)
    run = reference(hammer, NO_DRIVE, 2e-3, state=(PACK.front, 1.5), tolerance=1e-15)
    turns = [event.x for event in run.events]
    assert kinds(run)[:4] == ["pack-peak", "pack-trough"] * 2
    assert len(turns) > 8
    np.testing.assert_allclose(turns[2::2], turns[0], rtol=1e-12)
    np.testing.assert_allclose(turns[3::2], turns[1], rtol=1e-12)


@pytest.mark.parametrize("excess", [1e-13, 1e-9, -1e-13, -1e-9])
def test_a_grazing_touch_is_found(excess: float) -> None:
    pull, speed = 1e4, 1.0
    hammer = made_of(spring=PreloadSpring(preload=-pull * MASS, stiffness=0.0), pack=PACK)
    start = PACK.front + excess - speed**2 / (2.0 * pull)
    run = reference(hammer, NO_DRIVE, 1.5e-4, state=(start, speed))
    assert kinds(run) == (["pack-touch", "pack-peak", "pack-leave"] if excess > 0.0 else [])
    if excess > 0.0:
        touch = (speed - math.sqrt(2.0 * pull * excess)) / pull
        assert run.events[0].time == pytest.approx(touch, rel=1e-9)


def test_free_flight_keeps_its_energy() -> None:
    hammer = made_of(magnet=MAGNET, spring=SPRING, backstop=STOP)
    run = reference(hammer, NO_DRIVE, 1e-3, state=(60e-6, 1.2), times=np.linspace(0.0, 2e-4, 50))
    travel = run.x - STOP.position
    potential = 2.0 * MAGNET.Am**2 * np.sqrt(run.x) - MAGNET.F0 * run.x
    potential += SPRING.Bs * (0.5 * travel / SPRING.As - 1.0) * travel
    energy = 0.5 * MASS * run.v**2 + potential
    np.testing.assert_allclose(energy, energy[0], rtol=0.0, atol=1e-15 * np.ptp(potential) / 1e-3)


def _force(x: float, v: float, current: float, pack: float) -> float:
    """Sum of equations (3) to (7), as printed; ``pack`` is the force of the pack."""
    total = MAGNET.F0 - (MAGNET.Am - MAGNET.Bm * current) ** 2 / math.sqrt(x)
    total += SPRING.Bs - SPRING.Bs / SPRING.As * (x - STOP.position) + pack
    if x < STOP.position:
        total += (STOP.k - STOP.l * v) * (STOP.position - x) ** 1.5
    return total


def test_every_step_solves_the_equation_of_motion() -> None:
    run = reference(WHOLE, ONE_PULSE, 4e-3)
    assert run.status == "ok"
    peaks = [event for event in run.events if event.kind == "pack-peak"]
    assert len(peaks) == 1
    r_max = (peaks[0].x - PACK.front) / PACK.thickness
    fastest = float(np.abs(run.v).max())
    for step in run.steps:
        y, v = np.polynomial.Polynomial(step.y), np.polynomial.Polynomial(step.v)
        s = 0.99 * step.length / step.h
        time, x, speed = step.t + step.h * s, step.ref + y(s), v(s)
        r = max(x - PACK.front, 0.0) / PACK.thickness
        pack = -PACK.stiffness * (r**2.7 if time < peaks[0].time else r_max**-8.3 * r**11)
        current = float(ONE_PULSE.value(time))
        defect = MASS * v.deriv()(s) / step.h - _force(x, speed, current, pack)
        # The error grows like the last term, so its slope is ORDER times itself over the step; the terms
        # left out are worth a few times the last one.
        assert abs(defect) * step.length < 10.0 * ORDER * 1e-12 * MASS * fastest, (time, x, speed)
        assert y.deriv()(s) / step.h == pytest.approx(speed, rel=1e-9, abs=1e-9)


def test_tolerances_agree() -> None:
    times = np.linspace(0.0, 4e-3, 400)
    coarse, usual, fine = (
        reference(WHOLE, ONE_PULSE, 4e-3, tolerance=tolerance, times=times)
        for tolerance in (1e-10, 1e-12, 1e-15)
    )
    assert np.abs(coarse.x - fine.x).max() < 1e-11
    assert np.abs(usual.x - fine.x).max() < 2e-14
    assert horizon(WHOLE, ONE_PULSE, 4e-3, times) == 4e-3


def _second_method(t_end: float, times: np.ndarray) -> np.ndarray:
    """The single pulse by SciPy's DOP853, mode by mode, with switches located by its own root finder."""
    state, t, r_max = np.array([reference(WHOLE, ONE_PULSE, 1e-9).x[0] * 1e3, 0.0]), 0.0, math.nan
    out = np.full(times.size, math.nan)
    mode = "stop"
    edges = [WAVEFORM.width, WAVEFORM.width + 27.6310211159 * WAVEFORM.decay, t_end]
    front, stop = PACK.front * 1e3, STOP.position * 1e3
    # Millimetres and milliseconds, so that one absolute tolerance serves both.
    while t < t_end:
        edge = min(e for e in edges if e > t)

        def slope(
            time: float, y: np.ndarray, mode: str = mode, r_max: float = r_max, edge: float = edge
        ) -> list[float]:
            r = max(y[0] * 1e-3 - PACK.front, 0.0) / PACK.thickness
            pack = 0.0
            if mode == "load":
                pack = -PACK.stiffness * r**2.7
            elif mode == "curve":
                pack = -PACK.stiffness * r_max**-8.3 * r**11
            current = float(ONE_PULSE.value(min(time * 1e-3, edge * (1.0 - 1e-15))))
            return [y[1], _force(y[0] * 1e-3, y[1], current, pack) / MASS * 1e-3]

        rules = {
            "free": [(lambda t, y: y[0] - front, 1.0, "load"), (lambda t, y: y[0] - stop, -1.0, "stop")],
            "load": [(lambda t, y: y[1], -1.0, "curve")],
            "curve": [(lambda t, y: y[0] - front, -1.0, "free")],
            "stop": [(lambda t, y: y[0] - stop, 1.0, "free")],
        }[mode]
        events = []
        for rule, direction, _ in rules:
            rule.terminal, rule.direction = True, direction  # type: ignore[attr-defined]
            events.append(rule)
        solution = solve_ivp(
            slope,
            (t * 1e3, edge * 1e3),
            state,
            method="DOP853",
            rtol=1e-13,
            atol=1e-15,
            max_step=2e-3,
            events=events,
            dense_output=True,
        )
        inside = (times >= t) & (times <= solution.t[-1] * 1e-3)
        out[inside] = solution.sol(times[inside] * 1e3)[0] * 1e-3
        t, state = solution.t[-1] * 1e-3, solution.y[:, -1].copy()
        if solution.status == 0:
            t = edge
        for found, (_, _, following) in zip(solution.t_events, rules, strict=True):
            if found.size:
                r_max = (state[0] * 1e-3 - PACK.front) / PACK.thickness if mode == "load" else r_max
                mode = following
                if mode == "curve":
                    state[1] = 0.0
                else:
                    # On the surface exactly, or the same switch would be found again.
                    state[0] = {"load": front, "stop": stop}.get(mode, state[0])
    return out


def test_another_method_agrees() -> None:
    t_end = 0.9e-3
    times = np.linspace(0.0, t_end, 300)
    run = reference(WHOLE, ONE_PULSE, t_end, tolerance=1e-14, times=times)
    assert kinds(run).count("backstop-touch") == 4
    assert np.abs(run.x - _second_method(t_end, times)).max() < 3e-15


@pytest.mark.parametrize("pull", [False, True])
def test_an_elastomer_contact_by_another_method(pull: bool) -> None:
    k, relaxation, speed = 8e7, 2e-5, 1.0
    stop = ElastomerBackstop(position=0.0, stiffness=k, relaxation_time=relaxation, pull=pull)
    run = reference(made_of(backstop=stop), NO_DRIVE, 1e-3, state=(0.0, -speed))

    def slope(t: float, y: np.ndarray) -> list[float]:
        # Units of 10 um and 10 us; the indentation is -y[0].
        depth = max(-y[0], 0.0) * 1e-5
        force = k * (depth**1.5 - 1.5 * relaxation * math.sqrt(depth) * y[1])
        return [y[1], (force if pull else max(force, 0.0)) / MASS * 1e-5]

    def surface(t: float, y: np.ndarray) -> float:
        return float(y[0])

    surface.terminal, surface.direction = True, 1.0  # type: ignore[attr-defined]
    other = solve_ivp(
        slope, (0.0, 100.0), [0.0, -speed], method="DOP853", rtol=1e-12, atol=1e-13, events=surface
    )
    assert kinds(run) == (["backstop-leave"] if pull else ["cut", "backstop-leave"])
    assert run.events[-1].v == pytest.approx(other.y[1, -1], rel=1e-7)
    assert run.events[-1].time == pytest.approx(other.t[-1] * 1e-5, rel=1e-7)


def test_a_dashpot_that_let_go_pushes_again() -> None:
    k, c, force, y0, v0 = 1e6, 20.0, 1000.0, 1e-5, -1.0
    pack = DashpotPack(stiffness=k, damping=c, front=0.0)
    hammer = made_of(spring=PreloadSpring(preload=force, stiffness=0.0), pack=pack)
    run = reference(hammer, NO_DRIVE, 1e-5, state=(y0, v0))
    pull = force / MASS
    # k y + c v = 0 during the flight with constant acceleration.
    again = np.roots([0.5 * k * pull, k * v0 + c * pull, k * y0 + c * v0]).max()
    assert kinds(run) == ["uncut"]
    assert run.events[0].time == pytest.approx(again, rel=1e-12)
    y, v = y0 + v0 * again + 0.5 * pull * again**2, v0 + pull * again
    exact = oracles.LinearMotion(MASS, c, k, force / k, 0.0, 1.0, 0.0, again, y, v).at(1e-5)
    assert run.x[-1] == pytest.approx(exact[0], rel=1e-11)
    assert run.v[-1] == pytest.approx(exact[1], rel=1e-11)


def test_balance_inside_the_pack_lasts_until_the_force_changes() -> None:
    pack = PowerPack(stiffness=259.0, front=0.0, thickness=PACK.thickness)
    hammer = made_of(spring=PreloadSpring(preload=259.0, stiffness=0.0), pack=pack)
    force = Rectangle(amplitude=5.0, width=1.0, rise=0.0, decay=0.0, quantity="force")
    drive = PulseTrain(force, start=1e-4)
    state = (PACK.thickness, 0.0)
    held = _Run(hammer, drive, state, 1e-13)
    held.mode = "rest"
    while held.t < 1.2e-4:
        held.advance(1.2e-4)
    plain = reference(hammer, drive, 1.2e-4, state=state, tolerance=1e-13)
    assert plain.at(0.9e-4) == state
    assert held.steps[0].at(0.9e-4) == state
    assert held.mode == "load"
    assert held.y - state[0] == pytest.approx(plain.x[-1] - state[0], rel=1e-9)
    assert held.y > state[0] + 1e-7


def test_a_backstop_that_may_not_pull_lets_go_above_k_over_l() -> None:
    stop = STOP.model_copy(update={"pull": False})
    start = STOP.position - 2e-6
    speed = 1.5 * STOP.k / STOP.l
    run = reference(made_of(backstop=stop), NO_DRIVE, 1e-5, state=(start, speed))
    assert kinds(run) == ["backstop-leave"]
    assert run.events[0].v == pytest.approx(speed, rel=1e-15)
    assert run.events[0].time == pytest.approx(2e-6 / speed, rel=1e-12)
    pulled = reference(made_of(backstop=STOP), NO_DRIVE, 1e-5, state=(start, speed))
    assert pulled.v[-1] < 0.9999 * speed


def test_rest_is_an_equilibrium_and_stays() -> None:
    run = reference(WHOLE, NO_DRIVE, 2e-3)
    x = float(run.x[0])
    assert abs(_force(x, 0.0, 0.0, 0.0)) < 1e-12
    assert np.ptp(run.x) < 1e-19


def test_leaving_the_range_of_the_magnet_is_a_status() -> None:
    magnet = MAGNET.model_copy(update={"range_max": 100e-6})
    run = reference(made_of(magnet=magnet), NO_DRIVE, 1e-3, state=(80e-6, 3.0))
    assert run.status == "range left"
    assert run.events[-1].x == pytest.approx(100e-6, rel=1e-12)
    assert np.isnan(run.at(1e-3)[0][0])


def test_a_force_table_is_followed_from_cell_to_cell() -> None:
    x, current = np.linspace(30e-6, 330e-6, 7), np.linspace(0.0, 1.2, 4)
    gap = MAGNET.Am - MAGNET.Bm * current[None, :]
    # A coarse table is far from equation (3): what counts is the spline through it.
    force = MAGNET.F0 - gap**2 / np.sqrt(x[:, None])
    hammer = made_of(
        magnet=TableMagnet.from_arrays(x, current, force), spring=SPRING, pack=PACK, backstop=STOP
    )
    spline = RectBivariateSpline(x, current, force)
    run = reference(hammer, ONE_PULSE, 2e-3, tolerance=1e-13)
    assert run.status == "ok"
    assert "pack-peak" in kinds(run)
    for step in run.steps:
        s = 0.5 * step.length / step.h
        place, _ = step.at(step.t + 0.5 * step.length)
        if not STOP.position < place < PACK.front:
            continue
        total = spline(place, ONE_PULSE.value(step.t + 0.5 * step.length))[0, 0]
        total += SPRING.Bs - SPRING.Bs / SPRING.As * (place - STOP.position)
        assert MASS * np.polynomial.Polynomial(step.v).deriv()(s) / step.h == pytest.approx(total, abs=1e-8)


@pytest.mark.parametrize("overlap", ["add", "replace"])
def test_the_drive_acts_as_it_says(overlap: str) -> None:
    drive = PulseTrain(WAVEFORM, at=[0.0, 3.3e-4, 5e-4], overlap=overlap)
    force = Rectangle(amplitude=2.0, width=352e-6, rise=10.7e-6, decay=24.3e-6, quantity="force")
    pushes = PulseTrain(force, at=[0.0, 3.3e-4, 5e-4], overlap=overlap)
    run = reference(made_of(), pushes, 2e-3, state=(0.0, 0.0))
    # The speed in the end is the impulse, here by a fine sum of the drive's own value.
    grid = (np.arange(400_000) + 0.5) * 5e-9
    impulse = 5e-9 * float(np.sum(pushes.value(grid)))
    assert run.v[-1] * MASS == pytest.approx(impulse, rel=1e-6)
    assert reference(WHOLE, drive, 1e-3).status == "ok"


def test_a_chaotic_train_has_a_horizon() -> None:
    drive = PulseTrain(WAVEFORM, period=0.8e-3, pulses=40)
    times = np.linspace(0.0, 0.032, 1601)
    first = horizon(WHOLE, drive, 0.032, times)
    assert 1e-3 < first < 0.032
