"""Bifurcation and grazing curves of impact oscillators against closed forms.

The bouncing ball and the linear oscillator of `tests.truth.impact_orbits`, followed from either end of a
curve and through either constant; a linear oscillator that touches a pack.
"""

import math

import numpy as np
import pytest
from tests.truth.impact_orbits import BouncingBall, DampedImpacts, LinearImpacts

import printhammer as ph
from printhammer.chaos import BifurcationCurve, Branch
from printhammer.chaos.curves.stability_chart import StabilityChart, stability_chart
from printhammer.errors import InputError

SHARP = 1e-9
TURN = 2.0 * math.pi
MASS, GRAVITY, FREQUENCY = 1e-3, 9.80665, 50.0
WEIGHT = MASS * GRAVITY
RESTITUTIONS = (0.55, 0.9)


def bounces(restitution: float, gamma: float, width: float = 0.08) -> Branch:
    """The branch of a ball that bounces once per period, near a bifurcation."""
    case = BouncingBall(GRAVITY, restitution, FREQUENCY)
    hammer = ph.Hammer.build(
        MASS,
        spring={"law": "preload", "preload": -WEIGHT, "stiffness": 0.0},
        backstop={"law": "rigid", "position": 0.0, "restitution": restitution},
    )
    return ph.continuation(
        hammer,
        "drive.amplitude",
        ((1.0 - width) * gamma * WEIGHT, (1.0 + width) * gamma * WEIGHT),
        drive=ph.SineForce(gamma * WEIGHT, case.frequency),
        state=case.state(gamma, 0.5 / case.frequency),
        phase=0.5,
        most=40,
    )


def ball_curve(kind: str, restitution: float) -> BifurcationCurve:
    """The fold or doubling in the plane of force and restitution, traced from a given restitution."""
    case = BouncingBall(GRAVITY, restitution, FREQUENCY)
    branch = bounces(restitution, 1.02 * case.fold if kind == "fold" else 0.99 * case.doubling)
    return ph.bifurcation_curve(
        branch,
        "backstop.restitution",
        RESTITUTIONS,
        event=kind,
        first=(0.05 * WEIGHT, 2.0 * WEIGHT),
    )


def limit(kind: str, restitution: float) -> float:
    case = BouncingBall(GRAVITY, restitution, FREQUENCY)
    return case.fold if kind == "fold" else case.doubling


@pytest.fixture(scope="module")
def curves() -> dict[str, BifurcationCurve]:
    return {kind: ball_curve(kind, 0.8) for kind in ("fold", "period doubling")}


@pytest.mark.parametrize("kind", ["fold", "period doubling"])
def test_a_bouncing_ball_bifurcates_where_it_should(kind: str, curves: dict[str, BifurcationCurve]) -> None:
    curve = curves[kind]
    assert sorted(curve.second[[0, -1]]) == list(RESTITUTIONS)
    exact = [limit(kind, e) for e in curve.second]
    np.testing.assert_allclose(curve.first / WEIGHT, exact, rtol=SHARP)
    multiplier = 1.0 if kind == "fold" else -1.0
    assert np.abs(curve.multipliers - multiplier).min(axis=1).max() < SHARP
    np.testing.assert_allclose(np.prod(curve.multipliers, axis=1).real, curve.second**2, rtol=SHARP)
    # The section is at the impact, which the ball leaves with g T / 2 less the velocity of the table.
    up = 0.5 * GRAVITY / FREQUENCY
    speeds = up - up * (1.0 - curve.second) / (1.0 + curve.second)
    np.testing.assert_allclose(curve.state[:, 1], speeds, rtol=1e-8)
    cosines = math.pi * (1.0 - curve.second) / (1.0 + curve.second) / exact
    np.testing.assert_allclose(np.cos(TURN * curve.phase), cosines, atol=1e-7)
    assert set(curve.contacts) == {"B"}
    assert curve.limits.all()


@pytest.mark.parametrize("kind", ["fold", "period doubling"])
def test_a_curve_is_the_same_from_another_start(kind: str, curves: dict[str, BifurcationCurve]) -> None:
    again = ball_curve(kind, 0.6)
    for e in (0.55, 0.63, 0.8, 0.87):
        ((one, _),), ((other, _),) = (each.at("backstop.restitution", e) for each in (curves[kind], again))
        assert one == pytest.approx(other, rel=1e-11)
        assert one / WEIGHT == pytest.approx(limit(kind, e), rel=SHARP)
        ((back, at),) = curves[kind].at("drive.amplitude", one)
        assert (back, at) == (pytest.approx(one, rel=1e-14), pytest.approx(e, rel=1e-10))


def test_a_curve_ends_at_the_bounds_of_either_constant() -> None:
    branch = bounces(0.8, 1.02 * limit("fold", 0.8))
    low, high = 0.9 * limit("fold", 0.8) * WEIGHT, 1.3 * limit("fold", 0.8) * WEIGHT
    curve = ph.bifurcation_curve(branch, "backstop.restitution", (0.3, 0.9), event="fold", first=(low, high))
    assert [stop.reason for stop in curve.stops] == ["bound", "bound"]
    assert sorted(curve.first[[0, -1]]) == [pytest.approx(low), pytest.approx(high)]
    # Gamma = pi (1 - e) / (1 + e) solved for e.
    share = np.sort(curve.first[[0, -1]])[::-1] / WEIGHT / math.pi
    np.testing.assert_allclose(np.sort(curve.second[[0, -1]]), (1.0 - share) / (1.0 + share), rtol=SHARP)
    assert curve.message.count("is the bound") == 2
    short = ph.bifurcation_curve(branch, "backstop.restitution", (0.3, 0.9), event="fold", most=1)
    assert [stop.reason for stop in short.stops] == ["length", "length"]
    assert short.message.count("the maximum number of steps is reached at backstop.restitution") == 2
    with pytest.raises(InputError, match=r"expected drive\.amplitude or backstop"):
        short.at("mass", 1.0)


def test_the_chart_of_the_ball() -> None:
    case = BouncingBall(GRAVITY, 0.8, FREQUENCY)
    branch = bounces(0.8, 0.5 * (case.fold + case.doubling), 0.9)
    steps: list[tuple[int, int]] = []
    chart = stability_chart(
        branch,
        "backstop.restitution",
        (0.75, 0.85),
        grid=(0, 0),
        progress=lambda *step: steps.append(step),
    )
    assert isinstance(chart, StabilityChart)
    assert chart.refused == ()
    assert [curve.kind for curve in chart.curves] == ["fold", "period doubling"]
    for curve in chart.curves:
        assert curve.limits.all()
        assert (curve.second.min(), curve.second.max()) == (0.75, 0.85)
    assert "1 of fold, 1 of period doubling" in chart.message
    assert steps[-1][0] == steps[-1][1]
    data = chart.to_dataset()
    count = max(len(curve) for curve in chart.curves)
    assert data["first"].shape == data["limits"].shape == (2, count)
    for row, curve in enumerate(chart.curves):
        np.testing.assert_array_equal(data["first"].values[row, : len(curve)], curve.first)
        assert np.isnan(data["second"].values[row, len(curve) :]).all()
        exact = [limit(curve.kind, e) for e in curve.second]
        np.testing.assert_allclose(curve.first / WEIGHT, exact, rtol=SHARP)
    for bad, options, sentence in (
        (branch, {"first": ("mass", 1.0, 2.0)}, "expected no first parameter and no firing options with it"),
        (branch.regime, {}, "first is missing"),
        (branch, {"bounds": (0.85, 0.9)}, "expected a range around the hammer's own"),
        (branch, {"second": "drive.amplitude"}, "expected another constant than that of the branch"),
    ):
        arguments = {"second": "backstop.restitution", "bounds": (0.75, 0.85), "grid": (0, 0), **options}
        with pytest.raises(InputError, match=sentence):
            stability_chart(bad, **arguments)  # type: ignore[arg-type]


def test_grazing_of_an_undamped_oscillation_at_a_rigid_stop() -> None:
    # F / (w^2 - 1) is the amplitude; 1 : 2 and 2 : 3 of the free oscillations are resonances of passages.
    case = LinearImpacts(1.7, -0.1, 0.8)
    hammer = ph.Hammer.build(
        1.0,
        spring={"law": "preload", "preload": 0.1, "stiffness": 1.0},
        backstop={"law": "rigid", "position": -0.1, "restitution": 0.8},
    )
    force = 0.9 * case.grazing
    branch = ph.continuation(
        hammer,
        "drive.amplitude",
        (0.8 * case.grazing, 1.2 * case.grazing),
        drive=ph.SineForce(force, 1.7 / TURN, phase=0.5 * math.pi),
        state=(0.0, -case.gain(force) * 1.7),
        phase=0.25,
    )
    curve = ph.bifurcation_curve(branch, "rate", (1.2 / TURN, 1.9 / TURN), event="last", first=(0.01, 0.4))
    omega = TURN * curve.second
    np.testing.assert_allclose(curve.first, 0.1 * (omega**2 - 1.0), rtol=0.0, atol=1e-11)
    # The orbit without the touch is neutral: it turns by the free oscillation in a period of the force.
    turned = np.exp(1j * TURN / omega)
    np.testing.assert_allclose(curve.multipliers.sum(axis=1).real, 2.0 * turned.real, atol=SHARP)
    np.testing.assert_allclose(np.abs(curve.multipliers), 1.0, atol=SHARP)
    # There x = -0.1 = -F / (w^2 - 1), so that the acceleration is w^2 times 0.1.
    np.testing.assert_allclose(curve.coefficient, 1.8 * np.sqrt(0.2) * omega, rtol=SHARP)
    assert curve.surface == "backstop"
    # Where sin(2 pi n / w) is zero: n = 2 at 4 / 3, n = 3 at 6 / 4 and 6 / 5.
    found = {(point.kind, point.passages): TURN * point.second for point in curve.points}
    assert found == {
        ("resonant grazing", 2): pytest.approx(4.0 / 3.0, abs=1e-8),
        ("resonant grazing", 3): pytest.approx(1.5, abs=1e-8),
    }
    assert [point.message for point in curve.points].count("resonant grazing of 2 passages") == 1


def fold_of(omega: float) -> float:
    """Return the fold of the orbits of `shaw-holmes-1983` with one impact in two periods of the force.

    The squared amplitude of the force is quadratic in the A of an orbit; the fold is its minimum.
    """
    case = DampedImpacts(omega, -0.1, 0.8, 0.1, 2)
    gain = 0.1 / case.grazing
    square = (gain * case.orbit(1.0)[0]) ** 2 - 1.1**2
    return 0.1 * math.sqrt(square / (1.0 + square)) / gain


@pytest.mark.slow
def test_a_fold_of_two_periods_has_no_cusp_and_ends_at_the_resonant_grazing() -> None:
    """With wide bounds of the force, a spurious cusp was listed."""
    rate = 2.6 / TURN
    assert fold_of(2.6) == pytest.approx(0.087142997638, abs=1e-12)
    branch = ph.continuation(
        ph.load("shaw-holmes-1983"),
        "drive.amplitude",
        (0.0863, 0.0880),
        drive=ph.SineForce(0.08715, rate, phase=0.5 * math.pi),
        state=(0.06975, 0.1598),
        firings=2,
        phase=0.2649,
    )
    curve = ph.bifurcation_curve(branch, "rate", (1.2 / TURN, 2.9 / TURN), event="fold", first=(0.0005, 50.0))
    assert sorted(stop.reason for stop in curve.stops) == ["bound", "grazing"]
    (point,) = curve.points
    # Two periods of the force are one free oscillation there.
    own = math.sqrt(1.0 - 0.25 * 0.1**2)
    assert (point.kind, TURN * point.second) == ("resonant grazing", pytest.approx(2.0 * own, abs=1e-7))
    omega = TURN * curve.second
    inner = omega > 2.0 * own + 2e-3
    assert inner.sum() > 20
    np.testing.assert_allclose(curve.first[inner], [fold_of(each) for each in omega[inner]], rtol=1e-8)
    np.testing.assert_allclose(
        np.prod(curve.multipliers, axis=1).real, 0.64 * np.exp(-0.2 * TURN / omega), rtol=1e-6
    )
    # No two points are the same.
    assert np.hypot(np.diff(curve.first), np.diff(omega)).min() > 1e-7


def test_grazing_of_a_pack() -> None:
    # The same laws as in `test_continuation_impacts`, whose machine code is there.
    omega, front = 1.7, 0.1
    graze = front * (omega**2 - 1.0)
    hammer = ph.Hammer.build(
        1.0,
        spring={"law": "preload", "preload": 0.2, "stiffness": 1.0},
        pack={"law": "power", "front": front, "thickness": 0.05, "stiffness": 50.0},
        backstop={"law": "hertz", "position": -0.2, "stiffness": 1.0, "damping": 0.0},
    )
    force = 0.97 * graze
    branch = ph.continuation(
        hammer,
        "drive.amplitude",
        (0.95 * graze, 1.02 * graze),
        drive=ph.SineForce(force, omega / TURN, phase=0.5 * math.pi),
        state=(force / (1.0 - omega**2), 0.0),
        most=30,
    )
    curve = ph.bifurcation_curve(branch, "rate", (1.5 / TURN, 1.9 / TURN), event="grazing", first=(0.05, 0.4))
    assert sorted(TURN * curve.second[[0, -1]]) == [pytest.approx(1.5), pytest.approx(1.9)]
    np.testing.assert_allclose(curve.first, front * ((TURN * curve.second) ** 2 - 1.0), rtol=0.0, atol=1e-10)
    assert curve.surface == "pack"
    # The mass is farthest out half a period after the force was.
    np.testing.assert_allclose(curve.phase, 0.5, atol=1e-8)
    np.testing.assert_allclose(curve.state, [[front, 0.0]] * len(curve), atol=SHARP)
    # A pack gives way: neither a root nor sides.
    assert np.isnan(curve.coefficient).all()
    assert not curve.sides.any()
    turned = np.exp(1j * TURN / (TURN * curve.second))
    np.testing.assert_allclose(curve.multipliers.sum(axis=1).real, 2.0 * turned.real, atol=SHARP)
