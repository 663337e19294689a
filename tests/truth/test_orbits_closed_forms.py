"""Periodic orbits against closed forms: the Hénon map, the damped and the linear impact oscillator."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.hammers import MASS, interpreted, made_of, preload, rigid
from tests.truth.impact_orbits import BouncingBall

import printhammer as ph
from printhammer.chaos import Orbits, orbit
from printhammer.chaos.orbits.collection import fewest_missing, index_sums
from printhammer.chaos.orbits.newton import Images, close_orbits
from printhammer.chaos.orbits.orbit import multipliers_of
from printhammer.chaos.orbits.search import shortest
from printhammer.parts.pack.dashpot import DashpotPack
from printhammer.run.regime import Regime

A, B = 1.4, 0.3
ONE = np.ones(2)


def henon(states: np.ndarray, firings: np.ndarray) -> Images:
    """Iterate the Hénon map x' = 1 - a x^2 + y, y' = b x; return images and their derivatives."""
    found = Images.empty(len(states))
    for i, (state, count) in enumerate(zip(states, firings, strict=True)):
        (x, y), matrix = state, np.eye(2)
        for _ in range(count):
            matrix = np.array([[-2.0 * A * x, 1.0], [B, 0.0]]) @ matrix
            x, y = 1.0 - A * x * x + y, B * x
        found.states[i], found.jacobians[i], found.smooth[i] = (x, y), matrix, True
    return found


def henon_cycle(period: int) -> np.ndarray:
    """Return both fixed points, or the one orbit of period 2, from quadratic equations."""
    if period == 1:
        return np.roots([A, 1.0 - B, -1.0])
    return np.roots([A * A, -A * (1.0 - B), (1.0 - B) ** 2 - A])


@pytest.mark.parametrize(("period", "segments"), [(1, 1), (2, 1), (2, 2)])
def test_newton_finds_the_orbits_of_the_henon_map(period: int, segments: int) -> None:
    x = henon_cycle(period)
    # Two fixed points, or the two points of the orbit of period 2.
    before = x if period == 1 else x[::-1]
    exact = np.column_stack([x, B * before])
    starts = exact[:, np.newaxis] if segments == 1 else np.stack([exact, exact[::-1]], axis=1)
    guesses = starts + 0.02
    firings = np.full((2, segments), period // segments)
    found = close_orbits(henon, guesses, firings, ONE, goal=1e-15, enough=1e-13, iterations=40)
    for closing, start in zip(found, starts, strict=True):
        assert closing.closed
        np.testing.assert_allclose(closing.states, start, rtol=0.0, atol=1e-13)
        expected = np.linalg.eigvals(henon(start[:1], np.array([period])).jacobians[0])
        mine = multipliers_of(closing.jacobians)
        np.testing.assert_allclose(sorted(mine.real), sorted(expected), rtol=1e-11)
        assert np.prod(mine) == pytest.approx((-B) ** period, rel=1e-12)


def test_a_repeated_fixed_point_is_no_orbit_of_period_two() -> None:
    x = henon_cycle(1)
    guess = np.array([[[x[0], B * x[0]]] * 2]) + 1e-3
    (closing,) = close_orbits(
        henon, guess, np.ones((1, 2), int), ONE, goal=1e-15, enough=1e-13, iterations=40
    )
    assert closing.closed
    assert shortest(closing, ONE).firings.tolist() == [1]


def test_where_there_is_no_orbit_newton_says_so() -> None:
    def shifted(states: np.ndarray, _firings: np.ndarray) -> Images:
        """A map without fixed points: x' = x + 1 + x^2."""
        found = Images.empty(len(states))
        found.states[:] = states + 1.0 + states**2
        found.jacobians[:] = np.eye(2) * (1.0 + 2.0 * states[:, np.newaxis])
        return found

    (closing,) = close_orbits(
        shifted, np.array([[[0.4, 0.7]]]), np.ones((1, 1), int), ONE, goal=1e-12, enough=1e-9, iterations=60
    )
    assert not closing.closed
    assert closing.reason in ("comes no closer", "too many iterations")
    assert closing.residual >= 1.0


@pytest.mark.parametrize("pair", [(0.3 + 0.4j, 0.3 - 0.4j), (-2.5, 1e-9), (3.0, -0.2), (0.0, 0.0)])
def test_multipliers_of_a_product(pair: tuple[complex, complex]) -> None:
    rng = np.random.default_rng(5)
    base, other = rng.normal(size=(2, 2)), rng.normal(size=(2, 2))
    (large, small) = pair
    core = (
        np.array([[large.real, large.imag], [-large.imag, large.real]])
        if isinstance(large, complex)
        else np.diag([large, small])
    )
    product = base @ core @ np.linalg.inv(base)
    factors = np.array([other, product @ np.linalg.inv(other)])
    found = multipliers_of(factors)
    np.testing.assert_allclose(found, pair, rtol=1e-6, atol=1e-15)


def oscillator(stop: float, restitution: float) -> ph.Hammer:
    return ph.Hammer.build(
        "1 kg",
        name="linear impact oscillator",
        spring={"law": "preload", "preload": -1.0 * stop, "stiffness": "1 N/m"},
        backstop={"law": "rigid", "position": stop, "restitution": restitution},
    )


def one_impact_orbit(omega: float, stop: float, e: float) -> tuple[tuple[float, float], np.ndarray, float]:
    """The orbit of x'' + x = cos(omega t) with one impact per period: state at t = 0, multipliers, speed.

    With g = 1 / (1 - omega^2), T = 2 pi / omega and the impact at t0, x = A cos(t - t0) + B sin(t - t0)
    + g cos(omega t). Position and velocity just after t0 and just before t0 + T give A and B as multiples
    of the speed V after the impact, and g cos(omega t0), g sin(omega t0); their squares a quadratic for V
    (S. W. Shaw and P. J. Holmes, J. Sound Vib. 90 (1983) 129).
    """
    g, period = 1.0 / (1.0 - omega**2), 2.0 * math.pi / omega
    p = (1.0 + e) / (2.0 * e * math.tan(0.5 * period))
    q = (1.0 - e) / (2.0 * e * omega)
    speed = float(np.roots([p * p + q * q, -2.0 * stop * p, stop * stop - g * g]).max())
    phi = math.atan2(speed * q / g, (stop - speed * p) / g) % (2.0 * math.pi)
    t0, a, b = phi / omega, speed * p, speed * (1.0 + e) / (2.0 * e)
    inside = t0 + np.linspace(0.0, period, 4001)[1:-1]
    assert (a * np.cos(inside - t0) + b * np.sin(inside - t0) + g * np.cos(omega * inside) > stop).all()
    late = period - t0
    state = a * math.cos(late) + b * math.sin(late) + g, b * math.cos(late) - a * math.sin(late)
    force = math.cos(phi) - stop
    impact = np.array([[-e, 0.0], [-(1.0 + e) * force * e / speed, -e]])
    flight = np.array([[math.cos(period), math.sin(period)], [-math.sin(period), math.cos(period)]])
    return state, np.linalg.eigvals(flight @ impact), speed


@pytest.mark.parametrize(
    ("omega", "stop", "e", "kind"),
    [(2.6, -0.1, 0.8, "saddle"), (2.6, 0.0, 0.5, "stable"), (1.7, -0.2, 0.6, "stable")],
)
def test_the_linear_impact_oscillator(omega: float, stop: float, e: float, kind: str) -> None:
    state, multipliers, speed = one_impact_orbit(omega, stop, e)
    drive = ph.SineForce("1 N", omega / (2.0 * math.pi), phase="90 deg")
    regime = Regime.of(oscillator(stop, e), drive=drive)
    found = orbit(regime, (state[0] + 1e-3, state[1] - 1e-3))
    assert found.ok
    assert found.kind == kind
    assert found.firings == 1
    np.testing.assert_allclose([found.x[0], found.v[0]], state, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(multipliers), atol=1e-9)
    assert np.prod(found.multipliers).real == pytest.approx(e * e, rel=1e-9)
    assert found.backstop_contacts == 1
    assert found.pack_contacts == 0
    assert found.dots == ()
    (impact,) = found.contacts
    assert impact.v_out == pytest.approx(speed, rel=1e-10)
    assert impact.v_in == pytest.approx(-speed / e, rel=1e-10)
    # What the force gives, the impact takes.
    lost = 0.5 * (1.0 - e * e) * (speed / e) ** 2
    assert found.energy.backstop_loss == pytest.approx(lost, rel=1e-9)
    assert found.energy.drive_work == pytest.approx(lost, rel=1e-9)


def test_a_search_finds_the_orbit_of_the_linear_impact_oscillator() -> None:
    omega, stop, e = 2.6, -0.1, 0.8
    drive = ph.SineForce("1 N", omega / (2.0 * math.pi), phase="90 deg")
    found = ph.orbits(oscillator(stop, e), drive=drive, longest=1, starts=60, guesses=8)
    state, multipliers, _speed = one_impact_orbit(omega, stop, e)
    assert len(found) == 1
    np.testing.assert_allclose([found[0].x[0], found[0].v[0]], state, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(np.sort(found[0].multipliers.real), np.sort(multipliers), atol=1e-9)


def test_a_damped_oscillator() -> None:
    # The armature is always in the pack, whose front lies 1 m behind; a constant force makes up for that.
    mass, c, k, force, omega = MASS, 1.5, 3e4, 5.0, 1.2e4
    hammer = made_of(pack=DashpotPack(stiffness=k, damping=c, front=-1.0, pull=True), spring=preload(k))
    regime = Regime.of(hammer, drive=ph.SineForce(force, omega / (2.0 * math.pi)))
    with interpreted():
        found = orbit(regime, (0.0, 0.0))
    response = force / complex(k - mass * omega**2, c * omega)
    period = 2.0 * math.pi / omega
    rate = complex(-0.5 * c / mass, math.sqrt(k / mass - (0.5 * c / mass) ** 2))
    assert found.ok
    np.testing.assert_allclose([found.x[0], found.v[0]], [response.imag, omega * response.real], atol=1e-9)
    expected = np.exp([rate * period, rate.conjugate() * period])
    np.testing.assert_allclose(np.sort_complex(found.multipliers), np.sort_complex(expected), atol=1e-9)


@pytest.mark.parametrize("gamma", [0.8, 1.1])
def test_a_search_finds_both_orbits_of_the_bouncing_ball(gamma: float) -> None:
    """From the hammer and its drive alone: there is no pack that would bound the search."""
    exact = BouncingBall(gravity=9.80665, restitution=0.8, frequency=50.0)
    ball = made_of(backstop=rigid(0.8, position=0.0), spring=preload(-MASS * exact.gravity))
    drive = ph.SineForce(gamma * MASS * exact.gravity, exact.frequency)
    # More starts would find these orbits too.
    found = ph.orbits(ball, drive=drive, longest=1, starts=128, follow=0)
    sums = np.array([one.multipliers.sum().real for one in found])
    products = np.array([one.multipliers.prod().real for one in found])
    for stable in (True, False):
        near = np.abs(sums - exact.trace(gamma, stable)) < 1e-6
        assert products[near] == pytest.approx([exact.restitution**2], rel=1e-6)


def test_indices_of_all_orbits_add_up_to_one() -> None:
    # A doubling: two firings see a saddle with the multiplier 1.44, and the orbit born there twice.
    flip, born = (1, np.array([-1.2, 0.1], complex)), (2, np.array([0.5, 1e-4], complex))
    assert index_sums([flip, born], 2) == {1: 1, 2: 1}
    assert index_sums([flip], 2) == {1: 1, 2: -1}
    # A fold adds a saddle and a node; a spiral counts as a node does, whether it winds in or out.
    pair = [(1, np.array([2.0, 0.1], complex)), (1, np.array([1.1 + 0.5j, 1.1 - 0.5j]))]
    assert index_sums([(1, np.array([0.3j, -0.3j])), *pair], 1) == {1: 1}


@given(st.lists(st.tuples(st.integers(1, 4), st.floats(-3.0, 3.0)), max_size=8), st.data())
def test_indices_never_ask_for_more_orbits_than_are_missing(
    made: list[tuple[int, float]], data: st.DataObject
) -> None:
    """Remove orbits from a complete list: one attractor, and pairs that folds add."""
    multipliers = [(count, abs(size) + 1.01) for count, size in made]
    pairs = [(count, np.array([end, 0.0], complex)) for count, size in multipliers for end in (0.5, size)]
    complete = [(1, np.array([0.2, 0.1], complex)), *pairs]
    assert set(index_sums(complete, 4).values()) == {1}
    kept = data.draw(st.lists(st.booleans(), min_size=len(complete), max_size=len(complete)))
    listed = [orbit for orbit, keep in zip(complete, kept, strict=True) if keep]
    missing = fewest_missing(index_sums(listed, 4))
    assert missing <= len(complete) - len(listed)
    # Orbits of three firings without their partners.
    assert fewest_missing({1: 1, 2: 1, 3: 10}) == 3


def orbits_of_a_ball(longest: int) -> Orbits:
    """Search for orbits with a limited number of firings of a ball on a table that vibrates at 60 Hz."""
    ball = ph.load("tufillaro-1992")
    force = ph.SineForce(1.1705e-4 * (2.0 * math.pi * 60.0) ** 2 * ball.mass, 60.0)
    return ph.orbits(ball, drive=force, longest=longest)


@pytest.fixture(scope="module")
def up_to_three() -> Orbits:
    return orbits_of_a_ball(3)


@pytest.mark.slow
def test_a_longer_search_finds_what_a_shorter_one_does(up_to_three: Orbits) -> None:
    one = orbits_of_a_ball(1)
    assert len(one) == 7
    assert one.indices == {1: 1}
    assert one.incomplete == ()
    for own in one:
        gaps = [abs(own.x[0] - o.x[0]) / 1e-4 + abs(own.v[0] - o.v[0]) for o in up_to_three if o.firings == 1]
        assert min(gaps) < 1e-7
    # An independent search found this one.
    assert any(orbit.multipliers[0].real == pytest.approx(-93.48, abs=0.01) for orbit in up_to_three)


@pytest.mark.slow
def test_orbits_near_chatter_are_found_near_others(up_to_three: Orbits) -> None:
    """Newton's method from a fine grid of states, with exact flights of the ball, finds these orbits."""
    exact = {509.707: (8.637200107e-06, 1.9766846923e-03), -1023.899: (8.365746153e-06, 5.8140712776e-03)}
    for multiplier, (x, v) in exact.items():
        of_three = [own for own in up_to_three if own.firings == 3]
        gaps = [(np.abs(own.x - x) / 1e-4 + np.abs(own.v - v)).min() for own in of_three]
        near = of_three[int(np.argmin(gaps))]
        assert min(gaps) < 1e-7
        assert near.multipliers[0].real == pytest.approx(multiplier, rel=1e-5)


@pytest.mark.slow
def test_mirror_images_of_orbits_are_found() -> None:
    force = ph.SineForce(0.3, 1.0 / (2.0 * math.pi), phase="90 deg")
    found = ph.orbits(ph.load("duffing-holmes"), drive=force, longest=1, starts=128, guesses=8)
    assert found.indices == {1: 1}
    states = []
    for own in found:
        assert own.phase == found[0].phase
        motion = own.motion()
        (x,), (v,) = motion.at(motion.start + 0.5 * own.regime.period)
        states.append((own.section, np.array([-x, -v])))
    for _state, mirror in states:
        assert min(np.abs(mirror - state).max() for state, _other in states) < 1e-6
