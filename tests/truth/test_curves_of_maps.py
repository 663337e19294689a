"""Bifurcation curves, normal forms and codimension-two points of maps known in closed form."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests import known_maps
from tests.known_maps import (
    BOGDANOV,
    BOTH,
    CUBIC,
    DELAYED,
    FLIP,
    HENON,
    NAMES,
    SHIFT,
    UNITS,
    Map,
    seen_through,
    standing_in,
)

from printhammer.chaos.continuation.arclength import Steps
from printhammer.chaos.curves.bifurcation_curve import BifurcationCurve, curve_of
from printhammer.chaos.curves.normal_forms import doubling_coefficient
from printhammer.chaos.curves.systems import CurvePoint
from printhammer.chaos.curves.tracing import PRECISION, CurveTracer

SHARP = 1e-9
Bounds = tuple[float, float]


def curve_through(
    known: Map, kind: str, u: Bounds, at: Bounds, p: Bounds, r: Bounds, firings: int = 1
) -> BifurcationCurve:
    """The curve of a map through a given state and parameters, within bounds of both parameters."""
    plane = known_maps.plane(p, r, firings)
    begin = known_maps.start(kind, u, at[0], plane)
    with standing_in(known):
        traced = CurveTracer(plane, kind, Steps(most=200, precision=PRECISION)).trace(begin, at[1], 1)
        return curve_of(plane, traced, (0, 0), 1)


def first(curve: BifurcationCurve) -> np.ndarray:
    return curve.first - SHIFT


def points(curve: BifurcationCurve) -> list[tuple[str, float, float]]:
    return [(point.kind, point.first - SHIFT, point.second) for point in curve.points]


def henon_doubling(b: float = 0.0, low: float = -0.5, high: float = 0.5) -> BifurcationCurve:
    """The doubling of the fixed point of the Hénon map, traced from a value of b."""
    x = 2.0 / (3.0 * (1.0 - b))
    at = (0.75 * (1.0 - b) ** 2, b)
    return curve_through(HENON, "period doubling", (x, b * x), at, (-1.0, 5.0), (low, high))


def lies_on(curve: BifurcationCurve, multiplier: float, other: np.ndarray) -> None:
    """Assert that one multiplier of every point is as expected, and the other multiplier as well."""
    assert np.abs(curve.multipliers - multiplier).min(axis=1).max() < SHARP
    np.testing.assert_allclose(np.prod(curve.multipliers, axis=1), multiplier * other, atol=SHARP)


def test_fold_of_the_henon_map() -> None:
    # x = 1 - a x^2 + b x has a double root.
    curve = curve_through(HENON, "fold", (2.0, 0.0), (-0.25, 0.0), (-1.0, 3.0), (-0.5, 0.5))
    b = curve.second
    assert sorted(b[[0, -1]]) == [-0.5, 0.5]
    np.testing.assert_allclose(first(curve), -0.25 * (1.0 - b) ** 2, rtol=0.0, atol=SHARP)
    x, y = (curve.state / UNITS).T
    np.testing.assert_allclose(x, 2.0 / (1.0 - b), rtol=0.0, atol=SHARP)
    np.testing.assert_allclose(y, b * x, rtol=0.0, atol=SHARP)
    lies_on(curve, 1.0, -b)
    assert curve.limits.all()
    assert curve.points == ()
    assert set(curve.criticality) == {""}
    assert np.isnan(curve.coefficient).all()


def test_doubling_of_the_henon_map() -> None:
    curve = henon_doubling()
    b = curve.second
    np.testing.assert_allclose(first(curve), 0.75 * (1.0 - b) ** 2, rtol=0.0, atol=SHARP)
    lies_on(curve, -1.0, b)
    # By hand: c = a^2 / (1 - b^2) for q = (1, -b), which the program makes 1 half-width of the window long.
    widths = curve.regime.window.half_widths
    size = (UNITS[0] / widths[0]) ** 2 + (UNITS[1] * b / widths[1]) ** 2
    exact = 0.5625 * (1.0 - b) ** 3 / (1.0 + b) / size
    np.testing.assert_allclose(curve.coefficient, exact, rtol=1e-6)
    assert set(curve.criticality) == {"supercritical"}


def test_doubling_of_two_cycles_of_the_henon_map() -> None:
    # Of the cycle x = ((1 - b) +- sqrt(4 a - 3 (1 - b)^2)) / (2 a) at a = (1 - b)^2 + (1 + b)^2 / 4.
    x, other = (0.4 + np.array([1.0, -1.0]) * np.sqrt(0.5)).tolist()
    start = (x, 0.0 * other), (1.25, 0.0)
    curve = curve_through(HENON, "period doubling", *start, (0.5, 3.0), (-0.3, 0.3), firings=2)
    b = curve.second
    assert sorted(b[[0, -1]]) == [-0.3, 0.3]
    np.testing.assert_allclose(first(curve), (1.0 - b) ** 2 + 0.25 * (1.0 + b) ** 2, rtol=0.0, atol=SHARP)
    lies_on(curve, -1.0, -(b**2))
    assert set(curve.criticality) == {"supercritical"}


@pytest.mark.parametrize("start", [-0.45, 0.2, 0.49])
def test_a_curve_does_not_depend_on_where_it_is_begun(start: float) -> None:
    one, other = henon_doubling(), henon_doubling(start)
    assert sorted(one.second[[0, -1]]) == sorted(other.second[[0, -1]]) == [-0.5, 0.5]
    with standing_in(HENON):
        for b in (-0.5, -0.31, 0.017, 0.44, 0.5):
            ((a, second),) = one.at(NAMES[1], b)
            assert second == pytest.approx(b, rel=1e-15)
            assert a - SHIFT == pytest.approx(0.75 * (1.0 - b) ** 2, abs=SHARP)
            assert other.at(NAMES[1], b)[0][0] == pytest.approx(a, abs=1e-11)
            ((same, back),) = one.at(NAMES[0], a)
            assert (same, back) == (a, pytest.approx(b, abs=1e-11))


def test_a_curve_that_turns_passes_a_value_twice() -> None:
    curve = curve_through(CUBIC, "fold", (1.0, 0.0), (-2.0, 3.0), (-4.0, 4.0), (-1.0, 3.5))
    with standing_in(CUBIC):
        both = sorted(p - SHIFT for p, _ in curve.at(NAMES[1], 3.0))
        assert both == pytest.approx([-2.0, 2.0], abs=SHARP)
        assert curve.at(NAMES[1], -0.5) == []


@pytest.mark.parametrize("turned", [0.0, 0.02, 0.4, 1.2, 1.57], ids=str)
def test_two_folds_meet_in_a_cusp(turned: float) -> None:
    """Also if the cusp points along an axis of the plane, so that one parameter does not turn."""
    axes = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    known = seen_through(CUBIC, np.eye(2), axes)
    p, r = (axes.T @ [-2.0, 3.0]).tolist()
    curve = curve_through(known, "fold", (1.0, 0.0), (p, r), (-4.0, 4.0), (-4.0, 4.0))
    over, along = axes @ np.array([first(curve), curve.second])
    np.testing.assert_allclose(over**2, 4.0 / 27.0 * along**3, rtol=0.0, atol=1e-8)
    assert over.min() < -1.0
    assert over.max() > 1.0
    assert points(curve) == [("cusp", pytest.approx(0.0, abs=1e-8), pytest.approx(0.0, abs=1e-8))]


def test_a_fold_that_turns_in_one_constant_only_has_no_cusp() -> None:
    # x -> x + p - (r - x)^2 - x^2 / 4: one fold for every p, which turns at a least p.
    known = Map(
        lambda u, p, r: [u[0] + p - r**2 - 0.25 * u[0] ** 2, 0.5 * u[1]],
        lambda u, p, r: [[1.0 - 0.5 * u[0], 0.0], [0.0, 0.5]],
    )
    curve = curve_through(known, "fold", (0.0, 0.0), (0.25, 0.5), (-1.0, 4.0), (-1.5, 1.5))
    np.testing.assert_allclose(first(curve), curve.second**2, rtol=0.0, atol=SHARP)
    assert (curve.second.min(), curve.second.max()) == (-1.5, 1.5)
    assert points(curve) == []


def test_a_fold_that_turns_has_no_cusp_where_the_other_constant_has_a_wide_range() -> None:
    # x -> x + r - p^2 - (x - p / 2)^2: a fold at x = p / 2, r = p^2; in its range p moves but little.
    known = Map(
        lambda u, p, r: [u[0] + r - p**2 - (u[0] - 0.5 * p) ** 2, 0.5 * u[1]],
        lambda u, p, r: [[1.0 - 2.0 * (u[0] - 0.5 * p), 0.0], [0.0, 0.5]],
    )
    curve = curve_through(known, "fold", (0.5, 0.0), (1.0, 1.0), (-15.0, 5000.0), (-1.0, 4.0))
    assert (first(curve).min(), first(curve).max()) == pytest.approx((-2.0, 2.0), abs=1e-8)
    assert points(curve) == []


def test_neimark_sacker_of_the_delayed_logistic_map() -> None:
    curve = curve_through(DELAYED, "Neimark-Sacker", (0.5, 0.5), (2.0, 0.0), (1.0, 8.0), (-0.5, 2.5))
    np.testing.assert_allclose(first(curve), 2.0 + curve.second, rtol=0.0, atol=SHARP)
    np.testing.assert_allclose(curve.state / UNITS, (1.0 - 1.0 / first(curve))[:, np.newaxis] * [1, 1])
    np.testing.assert_allclose(np.abs(curve.multipliers), 1.0, rtol=0.0, atol=SHARP)
    np.testing.assert_allclose(curve.multipliers.sum(axis=1), 1.0 - curve.second, rtol=0.0, atol=SHARP)
    # The case without the additional feedback: a sixth of a turn.
    with standing_in(DELAYED):
        assert curve.at(NAMES[1], 0.0)[0][0] - SHIFT == pytest.approx(2.0, abs=SHARP)
    assert curve.limits.all()
    assert curve.points == ()


def test_a_torus_ends_in_strong_resonances() -> None:
    curve = curve_through(BOGDANOV, "Neimark-Sacker", (0.0, 0.0), (0.0, 0.3), (-2.0, 2.0), (-3.0, 3.0))
    # Beyond the resonances there is no torus.
    assert (curve.second.min(), curve.second.max()) == pytest.approx((-2.0, 2.0), abs=1e-8)
    np.testing.assert_allclose(first(curve), 0.0, atol=SHARP)
    np.testing.assert_allclose(np.abs(curve.multipliers), 1.0, atol=1e-4)
    assert [stop.reason for stop in curve.stops] == ["resonance", "resonance"]
    found = {kind: (p, r) for kind, p, r in points(curve)}
    assert found == {
        "1:1 resonance": (pytest.approx(0.0, abs=1e-8), pytest.approx(2.0, abs=1e-8)),
        "1:2 resonance": (pytest.approx(0.0, abs=1e-8), pytest.approx(-2.0, abs=1e-8)),
    }


def test_resonances_on_a_fold_and_on_a_doubling() -> None:
    fold = curve_through(HENON, "fold", (2.0, 0.0), (-0.25, 0.0), (-2.0, 3.0), (-1.5, 0.5))
    close = pytest.approx(-1.0, abs=SHARP)
    assert points(fold) == [("1:1 resonance", close, close)]
    # There the coefficient of the doubling has a pole, which is no change from super- to subcritical.
    doubling = henon_doubling(low=-1.2, high=0.5)
    assert doubling.second.min() == -1.2
    assert points(doubling) == [("1:2 resonance", pytest.approx(3.0, abs=SHARP), close)]


def test_a_doubling_turns_at_a_fold() -> None:
    curve = curve_through(BOTH, "period doubling", (0.0, 0.5), (0.0, 0.25), (-1.0, 1.0), (-0.5, 0.8))
    y = curve.state[:, 1] / UNITS[1]
    np.testing.assert_allclose(first(curve), 0.0, atol=SHARP)
    np.testing.assert_allclose(curve.second, y**2, rtol=0.0, atol=SHARP)
    lies_on(curve, -1.0, 1.0 - 2.0 * y)
    near = pytest.approx(0.0, abs=1e-8)
    assert points(curve) == [("fold-flip", near, near)]
    np.testing.assert_array_equal(curve.limits, y > -5e-4)
    fold = curve_through(BOTH, "fold", (0.0, 0.0), (-0.4, 0.0), (-1.0, 1.0), (-0.5, 0.8))
    assert fold.stops[0].reason == "bound"


def test_a_doubling_turns_subcritical_where_its_coefficient_is_zero() -> None:
    curve = curve_through(FLIP, "period doubling", (0.0, 0.0), (0.0, 0.3), (-1.0, 1.0), (-2.0, 3.0))
    np.testing.assert_allclose(first(curve), 0.0, atol=SHARP)
    widths = curve.regime.window.half_widths
    exact = (curve.second**2 - 1.0) * (widths[0] / UNITS[0]) ** 2
    np.testing.assert_allclose(curve.coefficient, exact, rtol=0.0, atol=1e-6 * exact.max())
    words = {True: "supercritical", False: "subcritical"}
    assert curve.criticality == tuple(words[bool(r**2 > 1.0)] for r in curve.second)
    near = pytest.approx(0.0, abs=SHARP)
    kind = "degenerate doubling"
    assert points(curve) == [
        (kind, near, pytest.approx(-1.0, abs=1e-7)),
        (kind, near, pytest.approx(1.0, abs=1e-7)),
    ]


def coefficient_of(known: Map, u: Bounds, p: float, r: float) -> float:
    """Return the coefficient of the doubling of a fixed point."""
    plane = known_maps.plane((-9.0, 9.0), (-9.0, 9.0))
    matrix = np.array(known.derivative(np.array(u), p, r))
    place = CurvePoint(p + SHIFT, r, UNITS * np.array(u), 0.0, matrix, "")
    with standing_in(known):
        return doubling_coefficient(plane, place)


@settings(max_examples=60, deadline=None)
@given(st.floats(-0.9, 0.9), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.0, 6.28))
def test_the_coefficient_does_not_depend_on_the_coordinates(
    decay: float, square: float, cube: float, turn: float
) -> None:
    """Of x -> -x + a x^2 + b x^3 it is b + a^2 for a multiplicand of length 1, and y -> d y adds nothing."""
    known = Map(
        lambda u, p, r: [-u[0] + square * u[0] ** 2 + cube * u[0] ** 3, decay * u[1]],
        lambda u, p, r: [[-1.0 + 2.0 * square * u[0] + 3.0 * cube * u[0] ** 2, 0.0], [0.0, decay]],
    )
    widths = known_maps.regime().window.half_widths / UNITS
    # A rotation in half-widths of the window leaves the length of the eigenvector as it is.
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    turned = seen_through(known, widths[:, np.newaxis] * rotation / widths[0], np.eye(2))
    exact = (cube + square**2) * widths[0] ** 2
    found = coefficient_of(turned, (0.0, 0.0), 0.0, 0.0)
    # A coefficient near 0 beside large derivatives may not be known.
    scale = (abs(cube) + square**2) * widths[0] ** 2
    assert np.isnan(found) or found == pytest.approx(exact, abs=1e-5 * scale + 1e-7)
    assert np.isfinite(found) or abs(exact) < 0.1 * scale + 1e-6


def test_no_coefficient_where_no_multiplier_is_minus_one() -> None:
    assert np.isnan(coefficient_of(HENON, (0.5, 0.05), 0.3, 0.1))
    # At a double multiplier -1 without a second eigenvector there is none.
    double = Map(lambda u, p, r: [-u[0] + u[1], -u[1]], lambda u, p, r: [[-1.0, 1.0], [0.0, -1.0]])
    assert np.isnan(coefficient_of(double, (0.0, 0.0), 0.0, 0.0))
