"""Bifurcation curves of the damped impact oscillator against an independent solver.

x'' + 0.04 x' + x = -1 + F cos(w t), rigid stop at 0 with the restitution 0.9, orbits with one impact in two
periods of the force. The doublings at w = 0.81 and 0.95001 and the fold at 0.799 are published values.
"""

import functools
import math
from pathlib import Path

import numpy as np
import pytest
from tests.errors import refused
from tests.strobe_maps import strobe_map
from tests.truth.damped_impacts import Array, DampedImpacts, newton

import printhammer as ph
from printhammer.chaos import BifurcationCurve, Branch
from printhammer.chaos.continuation.fixed_points import MapValue
from printhammer.chaos.curves.systems import ImpactSystem
from printhammer.run.regime import Regime

CASE = DampedImpacts()
TURN = 2.0 * math.pi
BOUNDS = (0.79 / TURN, 0.99 / TURN)
FORCES = (0.2, 0.6)
MULTIPLIER = {"fold": 1.0, "period doubling": -1.0}


def oscillator() -> ph.Hammer:
    return ph.Hammer.build(
        1.0,
        spring={"law": "preload", "preload": 1.0, "stiffness": 1.0},
        damping={"law": "viscous", "coefficient": CASE.damping},
        backstop={"law": "rigid", "position": 0.0, "restitution": CASE.restitution},
    )


def sine(omega: float, force: float) -> ph.SineForce:
    return ph.SineForce(force, omega / TURN, phase=0.5 * math.pi)


@functools.cache
def branch_of(omega: float, force: float, guess: tuple[float, float], width: float, most: int) -> Branch:
    """The branch through the orbit with one impact in two periods; its section is half a period later."""
    (impact,) = orbit = CASE.orbit(omega, force, [guess], 2)
    phase = float(impact[0]) + math.pi
    return ph.continuation(
        oscillator(),
        "drive.amplitude",
        ((1.0 - width) * force, (1.0 + width) * force),
        drive=sine(omega, force),
        state=tuple(CASE.state(omega, force, orbit, phase)),
        firings=2,
        phase=phase / TURN % 1.0,
        most=most,
    )


def at_rest(omega: float, force: float) -> Branch:
    """The branch of the oscillation without impact, up to its grazing."""
    return ph.continuation(
        oscillator(),
        "drive.amplitude",
        (0.05, 0.5),
        drive=sine(omega, force),
        state=tuple(CASE.forced(omega, force, 0.0)),
        firings=1,
        most=40,
    )


@pytest.fixture(scope="module")
def counted() -> tuple[BifurcationCurve, int]:
    """The doubling curve, and the number of evaluations of the map that it took."""
    calls = 0
    evaluate = ImpactSystem.__call__

    def evaluated(system: ImpactSystem, whole: Array, other: float) -> MapValue:
        nonlocal calls
        calls += 1
        return evaluate(system, whole, other)

    branch = branch_of(0.85, 0.325, (3.19, 0.34), 0.02, 10)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ImpactSystem, "__call__", evaluated)
        curve = ph.bifurcation_curve(branch, "rate", BOUNDS, event="period doubling", first=FORCES)
    return curve, calls


@pytest.fixture(scope="module")
def doubling(counted: tuple[BifurcationCurve, int]) -> BifurcationCurve:
    return counted[0]


@pytest.fixture(scope="module")
def fold() -> BifurcationCurve:
    branch = branch_of(0.796, 0.3645, (3.05, 0.7), 0.002, 60)
    return ph.bifurcation_curve(branch, "rate", BOUNDS, event="fold", first=FORCES)


@pytest.fixture(scope="module")
def grazing() -> BifurcationCurve:
    return ph.bifurcation_curve(at_rest(0.85, 0.2), "rate", BOUNDS, event="last", first=(0.01, 0.6))


def solved(curve: BifurcationCurve, place: int) -> Array:
    omega = TURN * curve.second[place]
    guess = (TURN * curve.phase[place], curve.state[place, 1] / CASE.restitution, curve.first[place])
    return CASE.bifurcation(omega, MULTIPLIER[curve.kind], guess, 2)


def test_the_strobe_map_of_a_damped_oscillator_has_the_derivative_of_its_impacts() -> None:
    omega, force = 0.81, 0.35
    orbit = CASE.orbit(omega, force, [(3.2, 0.14)], 2)
    phase = float(orbit[0, 0]) + math.pi
    regime = Regime.of(oscillator(), drive=sine(omega, force), phase=phase / TURN % 1.0)
    image = strobe_map(regime, CASE.state(omega, force, orbit, phase), firings=2)
    exact = CASE.monodromy(omega, force, orbit, 2)
    assert np.trace(image.jacobian) == pytest.approx(np.trace(exact), abs=1e-9)
    assert np.linalg.det(image.jacobian) == pytest.approx(CASE.product(omega, 1, 2), rel=1e-10)


@pytest.mark.parametrize(
    ("name", "omega", "published", "digits"),
    [
        ("doubling", 0.81, 0.34753340, 5e-9),
        ("doubling", 0.95001, 0.44844, 5e-6),
        ("fold", 0.799, 0.36283620, 5e-9),
    ],
)
def test_published_points_lie_on_the_curves(
    name: str, omega: float, published: float, digits: float, request: pytest.FixtureRequest
) -> None:
    curve: BifurcationCurve = request.getfixturevalue(name)
    ((force, rate),) = curve.at("rate", omega / TURN)
    assert rate == omega / TURN
    assert force == pytest.approx(published, abs=digits)
    near = int(np.argmin(np.abs(curve.second - rate)))
    guess = solved(curve, near)
    exact = CASE.bifurcation(omega, MULTIPLIER[curve.kind], guess, 2)
    assert force == pytest.approx(exact[2], abs=1e-9)


def test_fifty_points_of_the_curves(doubling: BifurcationCurve, fold: BifurcationCurve) -> None:
    rng = np.random.default_rng(1)
    both = [(curve, place) for curve in (doubling, fold) for place in range(len(curve))]
    chosen = [both[k] for k in rng.permutation(len(both))[:50]]
    for curve, place in chosen:
        omega = TURN * curve.second[place]
        if curve.state[place, 1] < 1e-3:
            # The speed vanishes at the end of the curve, and the solver of the test divides by it.
            assert curve.first[place] == pytest.approx(CASE.grazing(omega), abs=1e-5)
            continue
        assert solved(curve, place)[2] == pytest.approx(curve.first[place], abs=1e-10)
        product = np.prod(curve.multipliers[place]).real
        assert product == pytest.approx(CASE.product(omega, 1, 2), abs=1e-10)


def test_both_curves_reach_from_the_resonant_grazing_to_a_bound(
    doubling: BifurcationCurve, fold: BifurcationCurve
) -> None:
    # Two periods are five half oscillations of its own there.
    omega = 0.8 * CASE.own
    assert CASE.resonance(omega, 2) == pytest.approx(0.0, abs=1e-14)
    for curve, bound in ((doubling, BOUNDS[1]), (fold, BOUNDS[0])):
        assert sorted(stop.reason for stop in curve.stops) == ["bound", "grazing"]
        (point,) = curve.points
        assert (point.kind, point.passages) == ("resonant grazing", 2)
        assert point.second == pytest.approx(omega / TURN, abs=1e-10)
        assert point.first == pytest.approx(CASE.grazing(omega), abs=1e-10)
        assert bound in (curve.second[0], curve.second[-1])
        assert "resonant grazing of 2 passages" in curve.message


def test_grazing_of_the_free_oscillation(grazing: BifurcationCurve) -> None:
    exact = [CASE.grazing(TURN * rate) for rate in grazing.second]
    np.testing.assert_allclose(grazing.first, exact, atol=1e-11)
    assert sorted(grazing.second[[0, -1]]) == sorted(BOUNDS)
    points = {point.passages: point for point in grazing.points}
    assert set(points) == {2, 3}
    assert {point.kind for point in grazing.points} == {"resonant grazing"}
    for passages, omega in ((2, 0.8 * CASE.own), (3, 6.0 / 7.0 * CASE.own)):
        assert points[passages].second == pytest.approx(omega / TURN, abs=1e-9)
    # The velocity that a touch of depth h adds is (1 + e) sqrt(2 a h), a the acceleration at the stop.
    for phase, force, root in zip(grazing.phase, grazing.first, grazing.coefficient, strict=True):
        acceleration = 1.0 + force * math.cos(TURN * phase)
        assert root == pytest.approx(1.9 * math.sqrt(2.0 * acceleration), rel=1e-9)


def test_sides_of_a_grazing_on_which_orbits_exist(grazing: BifurcationCurve) -> None:
    # Without the touch below the grazing; with one touch in two periods below or above it, by the resonance.
    np.testing.assert_array_equal(grazing.sides[:, 0], -1)
    inner = np.abs(grazing.second - 0.8 * CASE.own / TURN) > 1e-6
    expected = np.where(grazing.second < 0.8 * CASE.own / TURN, -1, 1)
    np.testing.assert_array_equal(grazing.sides[inner, 2], expected[inner])
    for omega in (0.795, 0.82):
        # The nearest orbit of the solver, with a slow impact, exists there.
        graze = CASE.grazing(omega)
        place = int(np.argmin(np.abs(grazing.second - omega / TURN)))
        row = np.array([[TURN * grazing.phase[place], 0.01]])

        def equations(z: Array, omega: float = omega) -> Array:
            return CASE.misses(omega, z[1], np.array([[z[0], 0.01]]), 2)

        force = newton(equations, np.array([row[0, 0], graze]))[1]
        assert np.sign(force - graze) == grazing.sides[place, 2]


def test_a_doubling_is_supercritical_where_the_doubled_orbits_are_stable(doubling: BifurcationCurve) -> None:
    assert set(doubling.criticality) <= {"", "supercritical"}
    branch = branch_of(0.85, 0.325, (3.19, 0.34), 0.02, 10)
    (event,) = [event for event in branch.events if event.kind == "period doubling"]
    assert branch.doubled(event, most=4).stable[1]
    known = doubling.state[:, 1] > 0.05
    assert all(
        word == "supercritical" for word, sure in zip(doubling.criticality, known, strict=True) if sure
    )


def test_a_curve_begins_anew_from_files(tmp_path: Path, doubling: BifurcationCurve) -> None:
    branch = branch_of(0.85, 0.325, (3.19, 0.34), 0.02, 10)
    branch.save(tmp_path / "branch.nc")
    doubling.save(tmp_path / "curve.json")
    regime = Regime.of(oscillator(), drive=sine(0.85, 0.325))
    middle = int(np.argmin(np.abs(doubling.second - 0.85 / TURN)))
    for name, event in (("branch.nc", "period doubling"), ("curve.json", middle)):
        again = ph.bifurcation_curve(
            tmp_path / name, "rate", (0.84 / TURN, 0.86 / TURN), event=event, regime=regime, first=FORCES
        )
        assert sorted(again.second[[0, -1]]) == [0.84 / TURN, 0.86 / TURN]
        for force, rate in zip(again.first, again.second, strict=True):
            ((exact, _),) = doubling.at("rate", rate)
            assert force == pytest.approx(exact, abs=1e-11)


def test_bad_input_is_refused_in_one_sentence(tmp_path: Path) -> None:
    branch = branch_of(0.85, 0.325, (3.19, 0.34), 0.02, 10)
    for second, bounds, options, key in (
        (
            "rate",
            BOUNDS,
            {"event": "fold"},
            "event",
        ),
        ("rate", BOUNDS, {"event": 7}, "event"),
        ("rate", BOUNDS, {"event": "cusp"}, "event"),
        ("rate", BOUNDS, {"event": "first"}, "event"),
        ("drive.amplitude", (0.1, 0.2), {}, "second"),
        ("rate", (0.9 / TURN, 0.99 / TURN), {}, "rate"),
        ("rate", BOUNDS, {"first": (0.4, 0.5)}, "drive.amplitude"),
        ("rate", BOUNDS, {"regime": branch.regime}, "regime"),
    ):
        with refused(key):
            ph.bifurcation_curve(branch, second, bounds, **options)  # type: ignore[arg-type]
    branch.save(tmp_path / "branch.nc")
    with refused("regime"):
        ph.bifurcation_curve(tmp_path / "branch.nc", "rate", BOUNDS)
    other = Regime.of(oscillator().replace("mass", 1.1), drive=sine(0.85, 0.325))
    with refused("hammer_fingerprint"):
        ph.bifurcation_curve(tmp_path / "branch.nc", "rate", BOUNDS, regime=other)


def test_what_a_point_of_a_curve_costs(counted: tuple[BifurcationCurve, int]) -> None:
    """The cost is counted in evaluations of the map, which do not depend on the machine."""
    curve, calls = counted
    assert len(curve) < calls < 8 * len(curve)


@pytest.mark.slow
def test_twenty_branches_after_switching(doubling: BifurcationCurve) -> None:
    rng = np.random.default_rng(2)
    places = np.flatnonzero((doubling.state[:, 1] > 0.1) & (doubling.second < 0.95 / TURN))
    for place in rng.choice(places, 20, replace=False):
        omega, force = TURN * doubling.second[place], doubling.first[place]
        speed = doubling.state[place, 1] / CASE.restitution
        branch = branch_of(omega, force, (TURN * doubling.phase[place], speed), 0.001, 6)
        (event,) = [event for event in branch.events if event.kind == "period doubling"]
        doubled = branch.doubled(event, most=4)
        assert (doubled.firings, set(doubled.contacts)) == (4, {"BB"})
        for number in (1, 3):
            compared(doubled, number, omega)


def compared(branch: Branch, number: int, omega: float) -> None:
    """Two impacts in four periods, started from the orbit that the program finds."""
    orbit, force = branch.orbit(number), float(branch.values[number])
    guess = np.array([(omega * contact.t_in, -contact.v_in) for contact in orbit.contacts])
    exact = CASE.orbit(omega, force, guess, 4)
    known = branch.multipliers[number]
    # Close to its birth an orbit is known the less the nearer a multiplier is to 1.
    np.testing.assert_allclose(exact, guess, rtol=0.0, atol=1e-9 / np.abs(known - 1.0).min())
    multipliers = np.linalg.eigvals(CASE.monodromy(omega, force, exact, 4))
    np.testing.assert_allclose(np.sort_complex(multipliers), np.sort_complex(known), rtol=1e-5)
    # Two different flights, so that it is no orbit of two periods.
    way = np.diff([*exact[:, 0], exact[0, 0] + 4.0 * TURN])
    assert abs(way[1] - way[0]) > 1e-4
