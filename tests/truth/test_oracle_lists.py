"""The oracle for lists of forces and contacts against closed forms, all derived in the docstrings here."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar
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
    """Kinetic energy gained less the work of everything, as a fraction of the largest work."""
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


class DenHartog:
    """Symmetric motion without stops of x'' + x + f sgn(x') = a cos(β t + φ), from x = x0, v = 0 at t = 0.

    Half a cycle, v < 0, is x = f (1 - cos t - βU sin t) + aV cos(β t + φ), V = 1/(1 - β²), U = tan(π/2β)/β.
    x(0) = -x(π/β) = x0 and x'(0) = 0 give aV cos φ = x0 and aV sin φ = -f U, so x0² = (aV)² - (f U)².
    v < 0 in between needs x0 > f S/β², S the maximum of β (sin t + βU (cos β t - cos t))/sin β t; its limit
    at t = 0 is 1, where the other forces at the turn are f. (Den Hartog, Trans. ASME 53 (1931) 107.)
    """

    def __init__(self, beta: float, f: float) -> None:
        self.beta, self.f = beta, f
        self.big_u, self.big_v = math.tan(0.5 * math.pi / beta) / beta, 1.0 / (1.0 - beta**2)
        half = math.pi / beta
        grid = np.linspace(0.0, half, 4002)[1:-1]
        top = float(grid[np.argmax(self.ratio(grid))])
        near = (max(top - half / 4000.0, 1e-9), min(top + half / 4000.0, half - 1e-9))
        self.best = minimize_scalar(
            lambda t: -self.ratio(t), bounds=near, method="bounded", options={"xatol": 1e-12}
        )
        self.big_s = max(1.0, -float(self.best.fun))
        self.boundary = f * math.hypot(self.big_s / beta**2, self.big_u) / abs(self.big_v)

    def ratio(self, t: np.ndarray) -> np.ndarray:
        b = self.beta
        return b * (np.sin(t) + b * self.big_u * (np.cos(b * t) - np.cos(t))) / np.sin(b * t)

    def motion(self, a: float) -> tuple[float, float]:
        """Amplitude x0 and phase φ."""
        x0 = math.sqrt((a * self.big_v) ** 2 - (self.f * self.big_u) ** 2)
        return x0, math.atan2(-self.f * self.big_u / (a * self.big_v), x0 / (a * self.big_v))

    def run(self, a: float, static: float, cycles: float) -> tuple[Run, float, float]:
        x0, phase = self.motion(a)
        piece = Piece(0.0, math.inf, amplitude=a, rate=self.beta, phase=phase + 0.5 * math.pi)
        friction = Friction(self.f, static)
        system = System(1.0, (Spring(1.0),), (Drive((piece,)),), (friction,), length=1.0)
        return simulate(system, x0, 0.0, cycles * 2.0 * math.pi / self.beta), x0, phase


@pytest.mark.parametrize("beta", [0.42, 0.7, 1.4, 2.5])
def test_den_hartog_motion(beta: float) -> None:
    exact = DenHartog(beta, 0.3)
    a = 1.1 * exact.boundary
    run, x0, phase = exact.run(a, 0.3, 5.0)
    assert run.events == []
    t = np.linspace(0.0, math.pi / beta, 9)
    t_late = t + 4.0 * 2.0 * math.pi / beta
    wave = 0.3 * (1.0 - np.cos(t) - beta * exact.big_u * np.sin(t)) + a * exact.big_v * np.cos(
        beta * t + phase
    )
    np.testing.assert_allclose(run.at(t)[0], wave, atol=CLOSE * x0)
    np.testing.assert_allclose(run.at(t_late)[0], wave, atol=10.0 * CLOSE * x0)
    assert run.work["friction"] == pytest.approx(-0.3 * 5.0 * 4.0 * x0, rel=CLOSE)
    assert run.work["drive"] == pytest.approx(0.3 * 5.0 * 4.0 * x0, rel=10.0 * CLOSE)


@pytest.mark.parametrize("beta", [0.38, 0.42, 0.7, 1.4, 2.5])
def test_den_hartog_boundary_of_motion_without_stops(beta: float) -> None:
    exact = DenHartog(beta, 0.3)
    free, _x0, _phase = exact.run(exact.boundary * (1.0 + 1e-8), 0.3, 3.0)
    assert free.events == []
    stopped, _x0, _phase = exact.run(exact.boundary * (1.0 - 1e-8), 0.3, 1.0)
    assert stopped.times("stick")
    assert exact.big_s > 1.01 if beta < 0.5 else exact.big_s < 1.0 + 1e-12


@pytest.mark.parametrize("beta", [0.7, 1.4])
def test_a_larger_static_force_moves_the_boundary(beta: float) -> None:
    """At a turn the other forces are x0 β²; they must exceed the static force (Shaw 1986)."""
    exact, static = DenHartog(beta, 0.3), 0.45
    boundary = math.hypot(static / beta**2, 0.3 * exact.big_u) / abs(exact.big_v)
    assert exact.run(boundary * (1.0 + 1e-9), static, 3.0)[0].events == []
    assert exact.run(boundary * (1.0 - 1e-9), static, 0.1)[0].events[0].kind == "stick"


def symmetric_orbit(
    stiffness: float, damping: float, amplitude: float, rate: float, restitution: float
) -> list[tuple[float, float]]:
    """Phases φ and speeds v of x'' + c x' + k x = A cos(w t + φ) that go from -1 to 1 in half a cycle.

    Remove the steady response X cos(w t + θ): y(π/w) = -y(0) for both stops, y'(0) = v + X w sin θ and
    y'(π/w) = v/e - X w sin θ, with y' proportional to y by the transition matrix. So v, cos θ and sin θ are
    affine in y(0), and cos² + sin² = 1 is a quadratic equation. (Shaw, J. Appl. Mech. 52 (1985) 453; Heiman,
    Bajaj & Sherman, J. Sound Vib. 124 (1988) 55, with k = c = 0.)
    """
    response = amplitude / complex(stiffness - rate**2, damping * rate)
    size, lag = abs(response), -math.atan2(response.imag, response.real)
    m = expm(np.array([[0.0, 1.0], [-stiffness, -damping]]) * math.pi / rate)
    a = -(1.0 + m[0, 0]) / m[0, 1]
    b = m[1, 0] + m[1, 1] * a
    speed = (a + b) * restitution / (1.0 + restitution)
    # cos θ = -(1 + y)/X, sin θ = (a - speed) y/(X w).
    slope = (a - speed) / rate
    orbits = []
    for y in np.roots([1.0 + slope**2, 2.0, 1.0 - size**2]):
        if abs(y.imag) < 1e-12 and speed * y.real > 0.0:
            theta = math.atan2(slope * y.real / size, -(1.0 + y.real) / size)
            orbits.append((theta + lag, float(speed * y.real)))
    return orbits


PAIRS = [
    (0.0, 0.0, 9.0, 2.0, 0.6),
    (0.0, 0.3, 9.0, 2.0, 0.6),
    (1.0, 0.0, 6.0, 2.2, 0.5),
    (1.0, 0.2, 5.0, 1.7, 0.8),
]


def pair_run(
    pair: tuple[float, float, float, float, float], phase: float, speed: float, cycles: float
) -> Run:
    stiffness, damping, amplitude, rate, restitution = pair
    piece = Piece(0.0, math.inf, amplitude=amplitude, rate=rate, phase=phase + 0.5 * math.pi)
    stops = (Stop("left", "back", -1.0, restitution), Stop("right", "front", 1.0, restitution))
    system = System(1.0, (Spring(stiffness), Damping(damping)), (Drive((piece,)),), stops=stops, length=1.0)
    return simulate(system, -1.0, speed, (cycles + 0.1) * 2.0 * math.pi / rate)


@pytest.mark.parametrize("pair", PAIRS)
def test_symmetric_orbit_between_two_stops(pair: tuple[float, float, float, float, float]) -> None:
    """Impacts come every half cycle; a small change of the start grows as the derivative of the map says.

    At (t, v) just after an impact a change (dt, dv) is dx = -v dt, dv - a dt of the motion; it goes through
    the transition matrix, changes the time of the next impact by -dx/v and its speed by dv + a dt.
    """
    stiffness, damping, amplitude, rate, restitution = pair
    half = math.pi / rate
    orbits = [
        orbit for orbit in symmetric_orbit(*pair) if kinds(pair_run(pair, *orbit, 1.0))[0][1] == "right"
    ]
    assert orbits
    for phase, speed in orbits:
        run = pair_run(pair, phase, speed, 2.0)
        assert kinds(run) == [("impact", "right"), ("impact", "left")] * 2
        times = np.array([event.time for event in run.events])
        np.testing.assert_allclose(times, half * np.arange(1, 5), rtol=CLOSE)
        assert run.events[-1].v == pytest.approx(speed, rel=CLOSE)
        hit = 0.5 * (speed / restitution) ** 2 * (1.0 - restitution**2)
        assert run.lost["left"] == pytest.approx(2.0 * hit, rel=CLOSE)
        assert balance(run, speed) < CLOSE

        m = expm(np.array([[0.0, 1.0], [-stiffness, -damping]]) * half)
        before, force = speed / restitution, amplitude * math.cos(phase)
        after = m @ np.array([[-speed, 0.0], [-(force + stiffness - damping * speed), 1.0]])
        delay = -after[0] / before
        tangent = np.array(
            [delay, restitution * (after[1] + (-force - stiffness - damping * before) * delay)]
        )
        moved = pair_run(pair, phase, speed + 1e-6, 2.0)
        back = pair_run(pair, phase, speed - 1e-6, 2.0)
        change = np.array([0.0, 2e-6])
        for plus, minus, sign in zip(moved.events, back.events, [-1.0, 1.0] * 2, strict=True):
            change = tangent @ change
            found = [plus.time - minus.time, sign * (plus.v - minus.v)]
            np.testing.assert_allclose(found, change, rtol=1e-7, atol=1e-7 * float(np.abs(change).max()))


def test_symmetric_orbit_of_an_impact_pair() -> None:
    """x'' = A cos(w t + φ): integrating twice over half a cycle gives cos φ - κ sin φ = d w²/2A.

    κ = (π/2) (1 + e)/(1 - e), v = -2 e A sin φ/(w (1 - e)), d the play.
    """
    _k, _c, amplitude, rate, restitution = PAIRS[0]
    kappa = 0.5 * math.pi * (1.0 + restitution) / (1.0 - restitution)
    turn = math.acos(2.0 * rate**2 / (2.0 * amplitude) / math.hypot(1.0, kappa))
    expected = []
    for sign in (1.0, -1.0):
        phase = sign * turn - math.atan(kappa)
        expected.append(
            (phase, -2.0 * restitution * amplitude * math.sin(phase) / (rate * (1.0 - restitution)))
        )
    positive = sorted((phase % (2.0 * math.pi), speed) for phase, speed in expected if speed > 0.0)
    found = sorted((phase % (2.0 * math.pi), speed) for phase, speed in symmetric_orbit(*PAIRS[0]))
    np.testing.assert_allclose(found, positive, rtol=1e-13)


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
def test_energies_and_mirror_image_of_random_lists(seed: int) -> None:
    system, x, v = random_system(seed)
    run = simulate(system, x, v, 5e-3)
    assert balance(run, v) < CLOSE
    assert all(loss > -CLOSE * max(map(abs, run.work.values())) for loss in run.lost.values())
    image = simulate(mirror(system), -x, -v, 5e-3)
    assert kinds(image) == kinds(run)
    times = np.array([event.time for event in run.events])
    np.testing.assert_allclose([event.time for event in image.events], times, rtol=0.0, atol=5e-3 * CLOSE)
