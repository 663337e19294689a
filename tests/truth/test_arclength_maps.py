"""Continuation of maps whose curves of fixed points and branch points are known in closed form."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from tests.errors import refused

from printhammer.chaos.continuation.arclength import Curve, Steps, follow
from printhammer.chaos.continuation.branch_points import BranchPoint, birth_of, follow_doubled, points_of
from printhammer.chaos.continuation.crossings import CROSSINGS, follow_crossing
from printhammer.chaos.continuation.fixed_points import Corrector, MapFamily, MapValue

STEPS = Steps(precision=1e-12, most=200)
SHARP = 1e-9


def logistic(u: Any, p: float) -> MapValue:
    """x -> p x (1 - x)."""
    x = u[0]
    return MapValue(
        np.array([p * x * (1.0 - x)]), np.array([[p * (1.0 - 2.0 * x)]]), np.array([x * (1.0 - x)])
    )


def henon(b: float) -> MapFamily:
    """x -> 1 - p x^2 + y, y -> b x."""

    def family(u: Any, p: float) -> MapValue:
        x, y = u
        jacobian = np.array([[-2.0 * p * x, 1.0], [b, 0.0]])
        return MapValue(np.array([1.0 - p * x * x + y, b * x]), jacobian, np.array([-x * x, 0.0]))

    return family


def delayed_logistic(u: Any, p: float) -> MapValue:
    """x -> p x (1 - y), y -> x."""
    x, y = u
    jacobian = np.array([[p * (1.0 - y), -p * x], [1.0, 0.0]])
    return MapValue(np.array([p * x * (1.0 - y), x]), jacobian, np.array([x * (1.0 - y), 0.0]))


def ring(u: Any, p: float) -> MapValue:
    """Return the image under a map whose fixed points lie on the unit circle of state and parameter."""
    return MapValue(u + 0.3 * (1.0 - u * u - p * p), np.array([[1.0 - 0.6 * u[0]]]), np.array([-0.6 * p]))


def iterated(family: MapFamily, times: int) -> MapFamily:
    """A map iterated a number of times, with its derivatives by the chain rule and its sequence of labels."""

    def repeated(u: Any, p: float) -> MapValue:
        image, jacobian, slope = u, np.eye(len(u)), np.zeros(len(u))
        labels: list[Any] = []
        for _ in range(times):
            value = family(image, p)
            if value.trouble:
                return MapValue.none(len(u), value.trouble)
            image, labels = value.image, [*labels, value.label]
            jacobian, slope = value.jacobian @ jacobian, value.jacobian @ slope + value.slope
        return MapValue(image, jacobian, slope, tuple(labels))

    return repeated


def places(family: MapFamily, curve: Curve, scales: Any) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {}
    for point in points_of(family, curve, scales, STEPS.precision):
        assert point.sharp
        found.setdefault(point.kind, []).append(point.parameter)
    return found


def curve_of(family: MapFamily, state: Any, p: float, bounds: tuple[float, float], **how: Any) -> Curve:
    return follow(family, state, p, scales=np.ones(len(state) + 1), bounds=bounds, steps=STEPS, **how)


def test_logistic_map() -> None:
    curve = curve_of(logistic, [0.6], 2.5, (0.5, 4.0))
    for node in curve.nodes:
        assert node.state[0] == pytest.approx(1.0 - 1.0 / node.parameter, abs=1e-11)
        assert node.multipliers[0] == pytest.approx(2.0 - node.parameter, abs=1e-10)
        assert node.stable == (1.0 < node.parameter < 3.0)
    assert [stop.reason for stop in curve.stops] == ["bound", "bound"]
    assert [stop.parameter for stop in curve.stops] == [0.5, 4.0]
    assert [curve.nodes[0].parameter, curve.nodes[-1].parameter] == [0.5, 4.0]
    found = places(logistic, curve, [1.0, 1.0])
    assert found.keys() == {"period doubling", "transcritical"}
    assert found["period doubling"] == [pytest.approx(3.0, abs=SHARP)]
    # x = 0 is the other curve, and crosses at p = 1.
    assert found["transcritical"] == [pytest.approx(1.0, abs=1e-8)]


def test_logistic_map_doubled() -> None:
    curve = curve_of(logistic, [0.6], 2.5, (2.0, 4.0))
    (point,) = points_of(logistic, curve, [1.0, 1.0], STEPS.precision)
    twice = iterated(logistic, 2)
    doubled = follow_doubled(twice, point, scales=[1.0, 1.0], bounds=(2.0, 4.0), steps=STEPS)
    for node in doubled.nodes:
        p, x = node.parameter, node.state[0]
        # The orbit of period 2: p^2 x^2 - p (p + 1) x + p + 1 = 0, with the multiplier 4 + 2 p - p^2.
        assert p * p * x * x - p * (p + 1.0) * x + p + 1.0 == pytest.approx(0.0, abs=1e-10)
        assert node.multipliers[0] == pytest.approx(4.0 + 2.0 * p - p * p, abs=1e-9)
    assert places(twice, doubled, [1.0, 1.0]) == {
        "period doubling": [pytest.approx(1.0 + math.sqrt(6.0), abs=SHARP)]
    }


def test_a_doubled_orbit_ends_where_it_is_born() -> None:
    half = Corrector(logistic, [1.0, 1.0], STEPS.precision)
    twice = iterated(logistic, 2)
    p = 3.4
    x = (p + 1.0 + math.sqrt((p - 3.0) * (p + 1.0))) / (2.0 * p)
    curve = curve_of(twice, [x], p, (2.0, 3.44), watch=lambda here, ahead: birth_of(half, here, ahead))
    assert [stop.reason for stop in curve.stops] == ["period doubling", "bound"]
    assert curve.nodes[0].parameter == pytest.approx(3.0, abs=SHARP)
    assert curve.nodes[0].state[0] == pytest.approx(2.0 / 3.0, abs=SHARP)
    assert points_of(twice, curve, [1.0, 1.0], STEPS.precision) == []


def test_logistic_map_of_period_three_begins_at_a_fold() -> None:
    thrice = iterated(logistic, 3)
    curve = curve_of(thrice, [0.16], 3.84, (3.0, 4.0))
    found = places(thrice, curve, [1.0, 1.0])
    assert found["fold"] == [pytest.approx(1.0 + math.sqrt(8.0), abs=SHARP)]
    assert len(found["period doubling"]) == 1


@settings(max_examples=6, deadline=None)
@given(b=st.floats(min_value=0.05, max_value=0.9))
def test_henon_map(b: float) -> None:
    family = henon(b)
    p = 0.1
    x = (-(1.0 - b) + math.sqrt((1.0 - b) ** 2 + 4.0 * p)) / (2.0 * p)
    curve = curve_of(family, [x, b * x], p, (-1.0, 3.0))
    found = places(family, curve, [1.0] * 3)
    fold, doubling = -((1.0 - b) ** 2) / 4.0, 3.0 * (1.0 - b) ** 2 / 4.0
    assert found["fold"] == [pytest.approx(fold, abs=SHARP)]
    assert found["period doubling"] == [pytest.approx(doubling, abs=SHARP)]
    assert "Neimark-Sacker" not in found
    points = points_of(family, curve, [1.0] * 3, STEPS.precision)
    (point,) = [point for point in points if point.kind == "period doubling"]
    twice = iterated(family, 2)
    doubled = follow_doubled(twice, point, scales=[1.0] * 3, bounds=(-1.0, 3.0), steps=STEPS)
    second = (1.0 - b) ** 2 + (1.0 + b) ** 2 / 4.0
    assert places(twice, doubled, [1.0] * 3)["period doubling"] == [pytest.approx(second, abs=SHARP)]


def test_delayed_logistic_map_has_a_torus() -> None:
    curve = curve_of(delayed_logistic, [0.3, 0.3], 1.5, (1.2, 3.0))
    (point,) = points_of(delayed_logistic, curve, [1.0] * 3, STEPS.precision)
    assert point.kind == "Neimark-Sacker"
    assert point.parameter == pytest.approx(2.0, abs=SHARP)
    np.testing.assert_allclose(point.node.state, [0.5, 0.5], atol=SHARP)
    # Sixth roots of 1.
    np.testing.assert_allclose(np.angle(point.node.multipliers[0]) ** 2, (math.pi / 3.0) ** 2, rtol=1e-8)


def test_a_neutral_saddle_is_no_torus() -> None:
    def saddle(u: Any, p: float) -> MapValue:
        # Multipliers 3 and p; their product is 1 at p = 1/3.
        return MapValue(np.array([3.0 * u[0], p * u[1]]), np.diag([3.0, p]), np.array([0.0, u[1]]))

    curve = curve_of(saddle, [0.0, 0.0], 0.2, (0.1, 0.9))
    assert points_of(saddle, curve, [1.0] * 3, STEPS.precision) == []


@pytest.mark.parametrize("start", [0.0, 0.6, -0.8])
def test_a_closed_curve_is_recognised(start: float) -> None:
    curve = curve_of(ring, [math.sqrt(1.0 - start * start)], start, (-2.0, 2.0))
    assert curve.closed
    assert [stop.reason for stop in curve.stops] == ["closed", "closed"]
    radii = [math.hypot(node.state[0], node.parameter) for node in curve.nodes]
    np.testing.assert_allclose(radii, 1.0, atol=1e-11)
    angles = np.unwrap([math.atan2(node.state[0], node.parameter) for node in curve.nodes])
    assert abs(angles[-1] - angles[0]) == pytest.approx(2.0 * math.pi, abs=1e-9)
    folds = sorted(places(ring, curve, [1.0, 1.0])["fold"])
    assert folds == [pytest.approx(-1.0, abs=SHARP), pytest.approx(1.0, abs=SHARP)]


@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e3])
def test_places_do_not_depend_on_units(scale: float) -> None:
    def other(u: Any, p: float) -> MapValue:
        value = logistic(u / scale, p)
        return MapValue(scale * value.image, value.jacobian, scale * value.slope)

    curve = follow(other, [0.6 * scale], 2.5, scales=[scale, 1.0], bounds=(2.0, 4.0), steps=STEPS)
    assert places(other, curve, [scale, 1.0]) == {"period doubling": [pytest.approx(3.0, abs=SHARP)]}


def cubic(u: Any, p: float) -> MapValue:
    """x -> x + 0.2 (p x - x^3): x = 0 and x^2 = p meet in a pitchfork at p = 0."""
    (x,) = u
    return MapValue(
        np.array([x + 0.2 * (p * x - x**3)]), np.array([[1.0 + 0.2 * (p - 3.0 * x * x)]]), np.array([0.2 * x])
    )


def tilted(a: float, b: float) -> MapFamily:
    """In the plane: x -> x + 0.1 (x - a p) (x - b p), y -> y / 2 + x, whose two lines meet at p = 0."""

    def family(u: Any, p: float) -> MapValue:
        x, y = u
        image = np.array([x + 0.1 * (x - a * p) * (x - b * p), 0.5 * y + x])
        jacobian = np.array([[1.0 + 0.1 * (2.0 * x - (a + b) * p), 0.0], [1.0, 0.5]])
        return MapValue(image, jacobian, np.array([-0.1 * ((a + b) * x - 2.0 * a * b * p), 0.0]))

    return family


def crossed(family: MapFamily, curve: Curve, scales: Any) -> tuple[BranchPoint, Curve]:
    """The crossing point of a curve, and the curve that crosses."""
    (point,) = [
        point for point in points_of(family, curve, scales, STEPS.precision) if point.kind in CROSSINGS
    ]
    bounds = (-2.0, 2.0)
    return point, follow_crossing(family, point.node, scales=scales, bounds=bounds, steps=STEPS)


def test_a_pitchfork_from_both_of_its_curves() -> None:
    level = curve_of(cubic, [0.0], -1.0, (-2.0, 2.0))
    point, bent = crossed(cubic, level, [1.0, 1.0])
    assert point.kind == "pitchfork"
    assert point.parameter == pytest.approx(0.0, abs=1e-8)
    for node in bent.nodes:
        assert node.state[0] ** 2 == pytest.approx(node.parameter, abs=1e-9)
    assert [stop.parameter for stop in bent.stops] == [2.0, 2.0]
    assert bent.nodes[0].state[0] * bent.nodes[-1].state[0] == pytest.approx(-2.0)
    # From the bent curve it is the same pitchfork, and no fold beside it.
    (again,) = points_of(cubic, bent, [1.0, 1.0], STEPS.precision)
    assert again.kind == "pitchfork"
    _point, back = crossed(cubic, bent, [1.0, 1.0])
    assert all(node.state[0] == pytest.approx(0.0, abs=1e-10) for node in back.nodes)
    assert sorted(stop.parameter for stop in back.stops) == [-2.0, 2.0]


@settings(max_examples=8, deadline=None)
@given(a=st.floats(min_value=-2.0, max_value=0.5), apart=st.floats(min_value=0.3, max_value=2.0))
@example(a=0.453125, apart=0.375)
def test_a_transcritical_point_of_two_lines(a: float, apart: float) -> None:
    family, b = tilted(a, a + apart), a + apart
    curve = curve_of(family, [-a, -2.0 * a], -1.0, (-2.0, 2.0))
    point, other = crossed(family, curve, [1.0] * 3)
    assert point.kind == "transcritical"
    assert point.parameter == pytest.approx(0.0, abs=1e-7)
    for node in other.nodes:
        assert node.state == pytest.approx([b * node.parameter, 2.0 * b * node.parameter], abs=1e-9)
    assert {stop.parameter for stop in other.stops} == {-2.0, 2.0}


def test_a_fold_has_no_other_curve() -> None:
    curve = curve_of(ring, [1.0], 0.0, (-2.0, 2.0))
    point = points_of(ring, curve, [1.0, 1.0], STEPS.precision)[0]
    assert point.kind == "fold"
    with refused("parameter"):
        follow_crossing(ring, point.node, scales=[1.0, 1.0], bounds=(-2.0, 2.0), steps=STEPS)
