"""The oracle for lists of forces and contacts against closed forms, all derived in the docstrings here."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq
from tests.oracle.list_laws import (
    Constant,
    Contact,
    Damping,
    Drive,
    Friction,
    Piece,
    Spring,
    Stop,
    System,
    gravity,
)
from tests.oracle.list_steps import Run
from tests.oracle.lists import simulate

CLOSE = 1e-11
G = 9.80665


def kinds(run: Run) -> list[tuple[str, str]]:
    return [(event.kind, event.name) for event in run.events]


def balance(run: Run, v: float) -> float:
    """Return the kinetic energy gained minus the sum of all works, as a fraction of the largest work."""
    _x, last = run.at([run.steps[-1].end])
    stops = [run.lost[stop.name] for stop in run.system.stops]
    gained = 0.5 * run.system.mass * (float(last[0]) ** 2 - v**2)
    works = list(run.work.values())
    return abs(gained - sum(works) + sum(stops)) / max(map(abs, [*works, *stops]))


def crossing(matrix: np.ndarray, z: np.ndarray, place: float, grid: float) -> tuple[float, np.ndarray]:
    """First time after the start at which the affine motion z' = matrix z, z = (x, v, 1), passes a place."""
    step = expm(matrix * grid)
    t, state = grid, step @ z
    side = state[0] - place
    while (state[0] - place) * side > 0.0:
        t, state = t + grid, step @ state
    root = float(brentq(lambda s: (expm(matrix * s) @ z)[0] - place, t - grid, t, xtol=1e-18, rtol=1e-15))
    return root, expm(matrix * root) @ z


@pytest.mark.parametrize("damping", [0.0, 0.3])
@pytest.mark.parametrize("mirrored", [False, True])
def test_a_contact_spring_and_then_a_stiffer_pole(damping: float, mirrored: bool) -> None:
    """Between events the motion is affine: matrix exponentials of (x, v, 1), stage by stage."""
    mass, force, k0 = 1e-3, 0.6, 200.0
    pole, blade = Contact("pole", "front", 0.5e-3, 4e5), Contact("blade", "front", 0.3e-3, 2e3)
    z, t, expected = np.array([0.0, 0.2, 1.0]), 0.0, []
    stages = [
        ([], blade, "touch"),
        ([blade], pole, "touch"),
        ([blade, pole], pole, "leave"),
        ([blade], blade, "leave"),
    ]
    for closed, contact, kind in stages:
        k = k0 + sum(part.stiffness for part in closed)
        f = force + sum(part.stiffness * part.position for part in closed)
        matrix = np.array([[0.0, 1.0, 0.0], [-k / mass, -damping / mass, f / mass], [0.0, 0.0, 0.0]])
        time, z = crossing(matrix, z, contact.position, 0.05 * math.sqrt(mass / k))
        t += time
        expected.append((t, kind, contact.name, z[1]))

    sign, side = (-1.0, "back") if mirrored else (1.0, "front")
    contacts = tuple(Contact(c.name, side, sign * c.position, c.stiffness) for c in (pole, blade))
    forces = (Spring(k0), Constant(sign * force), Damping(damping))
    run = simulate(System(mass, forces, contacts=contacts), 0.0, sign * 0.2, 1.001 * t)
    assert kinds(run)[:4] == [(kind, name) for _t, kind, name, _v in expected]
    np.testing.assert_allclose([event.time for event in run.events[:4]], [e[0] for e in expected], rtol=CLOSE)
    np.testing.assert_allclose(
        [sign * event.v for event in run.events[:4]], [e[3] for e in expected], rtol=CLOSE
    )
    assert all(abs(run.lost[name]) < 1e-12 * 1e-4 for name in ("pole", "blade"))
    assert balance(run, 0.2) < CLOSE


@pytest.mark.parametrize("loss", [0.2, 1.5])
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_rebound_from_a_hunt_crossley_contact(exponent: float, loss: float) -> None:
    """m v dv/dd = -k d^p (1 + c v): v/c - ln(1 + c v)/c² is the same at touch and leave, for every p."""
    speed, mass = 0.8, 2e-3

    def value(v: float) -> float:
        return v / loss - math.log1p(loss * v) / loss**2

    rebound = brentq(lambda u: value(-u) - value(speed), 0.0, 0.999999 / loss, xtol=1e-17, rtol=1e-15)
    contact = Contact("pad", "front", 1e-3, 1e4 * 1e3 ** (exponent - 1.0), exponent, loss)
    run = simulate(System(mass, contacts=(contact,)), 0.0, speed, 0.03)
    assert kinds(run) == [("touch", "pad"), ("leave", "pad")]
    assert run.events[1].v == pytest.approx(-rebound, rel=CLOSE)
    assert run.lost["pad"] == pytest.approx(0.5 * mass * (speed**2 - rebound**2), rel=CLOSE)


def test_a_hertz_contact_lasts_as_long_as_the_beta_function_says() -> None:
    """∫ dd / sqrt(v² - (4 k / 5 m) d^2.5) over both ways is (4/5) B(2/5, 1/2) d_max / v."""
    mass, k, speed = 1e-3, 3e7, 0.5
    deepest = (1.25 * mass * speed**2 / k) ** 0.4
    lasts = 0.8 * math.gamma(0.4) * math.gamma(0.5) / math.gamma(0.9) * deepest / speed
    run = simulate(System(mass, contacts=(Contact("ball", "back", 0.0, k, 1.5),)), 1e-4, -speed, 2e-3)
    touch, leave = run.events
    assert leave.time - touch.time == pytest.approx(lasts, rel=CLOSE)
    assert leave.v == pytest.approx(speed, rel=CLOSE)


def test_a_kelvin_voigt_contact_is_cut_before_it_pulls() -> None:
    """d = (v/w) e^(-δt) sin(w t) up to the cut at k d = -b d', that is tan(w t) = -b w/(k - b δ)."""
    mass, k, b, speed = 1e-3, 1e4, 1.0, 0.5
    delta, omega = b / (2.0 * mass), math.sqrt(k / mass - (b / (2.0 * mass)) ** 2)
    cut = (math.pi - math.atan2(b * omega, k - b * delta)) / omega
    depth = speed / omega * math.exp(-delta * cut) * math.sin(omega * cut)
    rate = (
        speed
        / omega
        * math.exp(-delta * cut)
        * (omega * math.cos(omega * cut) - delta * math.sin(omega * cut))
    )
    system = System(mass, contacts=(Contact("pad", "front", 0.0, k, damping=b),))
    run = simulate(system, -1e-4, speed, 3e-3)
    assert kinds(run) == [("touch", "pad"), ("cut", "pad"), ("leave", "pad")]
    touch, event, leave = run.events
    assert event.time - touch.time == pytest.approx(cut, rel=CLOSE)
    assert (event.x, event.v) == (pytest.approx(depth, rel=CLOSE), pytest.approx(rate, rel=CLOSE))
    assert leave.time - event.time == pytest.approx(-depth / rate, rel=1e-10)
    assert run.lost["pad"] == pytest.approx(0.5 * mass * (speed**2 - rate**2), rel=CLOSE)


def test_a_contact_is_cut_when_a_stop_inside_it_reverses_the_velocity() -> None:
    """With k d < b e v at the stop the contact would pull, so the mass leaves at the speed e v."""
    pad = Contact("pad", "front", 0.0, 10.0, damping=0.5)
    system = System(1e-3, contacts=(pad,), stops=(Stop("pole", "front", 1e-4, 0.5),))
    run = simulate(system, -1e-4, 0.4, 2e-3)
    assert kinds(run) == [("touch", "pad"), ("impact", "pole"), ("cut", "pad"), ("leave", "pad")]
    _touch, impact, cut, leave = run.events
    assert (cut.time, cut.v) == (impact.time, impact.v)
    assert leave.v == impact.v
    assert leave.time - impact.time == pytest.approx(-1e-4 / impact.v, rel=CLOSE)
    assert balance(run, 0.4) < CLOSE


STATIC, KINETIC = 0.5, 0.3


def incline(angle: float, stops: tuple[Stop, ...] = ()) -> System:
    normal = math.cos(angle) * G
    return System(
        1.0, (gravity(1.0, angle, G),), friction=(Friction(KINETIC * normal, STATIC * normal),), stops=stops
    )


def test_a_block_on_an_incline_is_released_at_the_angle_of_static_friction() -> None:
    release = math.atan(STATIC)
    assert kinds(simulate(incline(release * (1.0 - 1e-14)), 1.0, 0.0, 1.0)) == [("stick", "friction")]
    run = simulate(incline(release * (1.0 + 1e-14)), 1.0, 0.0, 1.0)
    assert run.events == []
    x, v = run.at([1.0])
    pull = G * (math.sin(release) - KINETIC * math.cos(release))
    assert (x[0], v[0]) == (pytest.approx(1.0 - 0.5 * pull, rel=CLOSE), pytest.approx(-pull, rel=CLOSE))


@pytest.mark.parametrize("angle", [0.3, 0.7])
def test_a_block_thrown_up_an_incline_stays_there_or_slides_back(angle: float) -> None:
    speed, up = 2.0, G * (math.sin(angle) + KINETIC * math.cos(angle))
    down = G * (math.sin(angle) - KINETIC * math.cos(angle))
    run = simulate(incline(angle, (Stop("foot", "back", 0.0, 0.0),)), 0.0, speed, 3.0)
    height = speed**2 / (2.0 * up)
    if math.tan(angle) <= STATIC:
        assert kinds(run) == [("stick", "friction")]
        expected = speed / up
        assert run.events[0].x == pytest.approx(height, rel=CLOSE)
    else:
        assert kinds(run) == [("rest", "foot")]
        expected = speed / up + math.sqrt(2.0 * height / down)
        assert run.lost["foot"] == pytest.approx(down * height, rel=CLOSE)
        assert run.work["friction"] == pytest.approx(-KINETIC * G * math.cos(angle) * 2.0 * height, rel=CLOSE)
    assert run.events[0].time == pytest.approx(expected, rel=CLOSE)


@pytest.mark.parametrize("kinetic", [0.7, 1.0])
def test_a_ramp_releases_a_mass_at_its_static_force(kinetic: float) -> None:
    """From Fs/r on x = (Fs - Fk) s²/2m + r s³/6m; with Fs = Fk the accelerating force begins at zero."""
    mass, rate = 0.2, 3.0
    drive = Drive((Piece(0.1, 0.9, slope=rate),))
    system = System(mass, drives=(drive,), friction=(Friction(kinetic, 1.0),))
    run = simulate(system, 0.0, 0.0, 0.9)
    assert kinds(run) == [("stick", "friction"), ("release", "friction")]
    release = 0.1 + 1.0 / rate
    assert run.events[1].time == pytest.approx(release, rel=CLOSE)
    s = 0.9 - release
    x, v = run.at([0.9])
    assert x[0] == pytest.approx(((1.0 - kinetic) * s**2 / 2.0 + rate * s**3 / 6.0) / mass, rel=CLOSE)
    assert v[0] == pytest.approx(((1.0 - kinetic) * s + rate * s**2 / 2.0) / mass, rel=CLOSE)


@pytest.mark.parametrize("static", [1.0, 1.9, 2.4])
def test_free_decay_under_friction(static: float) -> None:
    """A half swing takes π/w and costs 2 Fk/k; the mass stays where k |x| <= Fs first (Lorenz 1924)."""
    mass, k, kinetic, start = 0.5, 200.0, 1.0, 0.0631
    run = simulate(
        System(mass, (Spring(k),), friction=(Friction(kinetic, static),), length=0.1), start, 0.0, 5.0
    )
    swings, place = 0, start
    while k * abs(place) > static:
        place, swings = -math.copysign(abs(place) - 2.0 * kinetic / k, place), swings + 1
    assert kinds(run) == [("stick", "friction")]
    assert run.events[0].time == pytest.approx(swings * math.pi * math.sqrt(mass / k), rel=CLOSE)
    assert run.events[0].x == pytest.approx(place, rel=CLOSE)
    travel = sum(2.0 * start - 2.0 * (2 * n + 1) * kinetic / k for n in range(swings))
    assert run.work["friction"] == pytest.approx(-kinetic * travel, rel=CLOSE)
    x, v = run.at([4.99])
    assert (x[0], v[0]) == (run.events[0].x, 0.0)


@pytest.mark.parametrize("friction", [0.0, 1.5])
@pytest.mark.parametrize("restitution", [0.3, 0.8])
def test_bounces_end_after_a_geometric_series(restitution: float, friction: float) -> None:
    """Up with (W + Fk)/m, down with (W - Fk)/m: speeds shrink by e sqrt(down/up) a flight."""
    weight, mass, height = 4.0, 0.1, 2e-3
    up, down = (weight + friction) / mass, (weight - friction) / mass
    floor = Stop("floor", "back", 0.0, restitution)
    parts = (Friction(friction, friction),) if friction else ()
    run = simulate(System(mass, (Constant(-weight),), stops=(floor,), friction=parts), height, 0.0, 3.0)
    speed = restitution * math.sqrt(2.0 * down * height)
    flights = speed * (1.0 / up + 1.0 / math.sqrt(up * down)) / (1.0 - restitution * math.sqrt(down / up))
    assert {kind for kind, _name in kinds(run)[:-1]} == {"impact"}
    assert kinds(run)[-1] == ("rest", "floor")
    assert run.events[-1].time == pytest.approx(math.sqrt(2.0 * height / down) + flights, rel=CLOSE)
    assert balance(run, 0.0) < CLOSE


def test_a_mass_is_pulled_off_a_stop_when_the_force_changes_its_sign() -> None:
    """A force -F cos(w t) holds up to π/2w; then x = (F/m w²) (s - sin(s)) with s = w t - π/2."""
    mass, size, rate = 0.3, 2.0, 50.0
    drive = Drive((Piece(0.0, 1.0, amplitude=-size, rate=rate, phase=0.5 * math.pi),))
    run = simulate(System(mass, drives=(drive,), stops=(Stop("floor", "back", 0.0, 0.5),)), 0.0, 0.0, 0.06)
    assert kinds(run) == [("rest", "floor"), ("release", "floor")]
    assert run.events[1].time == pytest.approx(0.5 * math.pi / rate, rel=CLOSE)
    s = rate * 0.06 - 0.5 * math.pi
    x, _v = run.at([0.06])
    assert x[0] == pytest.approx(size / (mass * rate**2) * (s - math.sin(s)), rel=1e-10)


def random_system(seed: int) -> tuple[System, float, float]:
    rng = np.random.default_rng(seed)

    def log(low: float, high: float) -> float:
        return float(low * (high / low) ** rng.random())

    contacts = []
    for i in range(int(rng.integers(1, 5))):
        side = "front" if i % 2 == 0 else "back"
        position = (1.0 if side == "front" else -1.0) * 1e-3 * rng.uniform(0.1, 0.8)
        law = [{"exponent": 1.0}, {"exponent": 1.5}, {"exponent": 2.2}][int(rng.integers(3))]
        k = log(1e3, 1e5) * 1e3 ** (law["exponent"] - 1.0)
        resistance = [{}, {"loss": log(0.1, 5.0)}, {"damping": log(0.05, 1.0)}][int(rng.integers(3))]
        contacts.append(Contact(f"contact {i}", side, float(position), k, **law, **resistance))
    stops = (Stop("front stop", "front", 1e-3, rng.uniform(0.0, 0.9)), Stop("back stop", "back", -1e-3, 0.4))
    kinetic = log(0.01, 0.3)
    pieces = (
        Piece(0.0, 2e-3, amplitude=log(0.3, 3.0), rate=log(1e3, 6e3)),
        Piece(2e-3, 5e-3, constant=rng.uniform(-1.0, 1.0), slope=rng.uniform(-300.0, 300.0)),
    )
    system = System(
        1e-3,
        (Spring(log(50.0, 500.0), cubic=log(1e6, 1e8)), Damping(log(1e-3, 1e-1)), gravity(1e-3, 0.4)),
        (Drive(pieces),),
        (Friction(kinetic, kinetic * rng.uniform(1.0, 2.0)),),
        tuple(contacts),
        stops[: int(rng.integers(0, 3))],
    )
    return system, float(rng.uniform(-1e-4, 1e-4)), float(rng.uniform(-0.5, 0.5))


def mirror(system: System) -> System:
    def other(part: Contact | Stop) -> dict[str, object]:
        return {"side": "back" if part.side == "front" else "front", "position": -part.position}

    flips = ("constant", "slope", "amplitude")
    return replace(
        system,
        forces=tuple(replace(f, size=-f.size) if isinstance(f, Constant) else f for f in system.forces),
        drives=tuple(
            Drive(tuple(replace(p, **{key: -getattr(p, key) for key in flips}) for p in drive.pieces))
            for drive in system.drives
        ),
        contacts=tuple(replace(contact, **other(contact)) for contact in system.contacts),
        stops=tuple(replace(stop, **other(stop)) for stop in system.stops),
    )


@pytest.mark.parametrize("seed", range(8))
def test_energies_restart_and_mirror_image_of_random_lists(seed: int) -> None:
    system, x, v = random_system(seed)
    run = simulate(system, x, v, 5e-3)
    assert balance(run, v) < CLOSE
    assert all(loss > -CLOSE * max(map(abs, run.work.values())) for loss in run.lost.values())
    middle = 2.3e-3
    places, speeds = run.at([middle])
    again = simulate(system, float(places[0]), float(speeds[0]), 5e-3, middle)
    late = [event for event in run.events if event.time > middle]
    found = [event for event in again.events if event.time > middle]
    assert [(event.kind, event.name) for event in found] == [(event.kind, event.name) for event in late]
    for one, other in zip(found, late, strict=True):
        assert one.time == pytest.approx(other.time, abs=5e-3 * CLOSE)
    image = simulate(mirror(system), -x, -v, 5e-3)
    assert kinds(image) == kinds(run)
    times = np.array([event.time for event in run.events])
    np.testing.assert_allclose([event.time for event in image.events], times, rtol=0.0, atol=5e-3 * CLOSE)
