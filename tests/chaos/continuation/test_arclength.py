from typing import Any

import numpy as np
import pytest
from tests.errors import refused

from printhammer.chaos.continuation.arclength import Steps, Stop, follow
from printhammer.chaos.continuation.branch_points import points_of
from printhammer.chaos.continuation.fixed_points import MapValue, Node

ONE = np.ones(2)


def line(u: Any, p: float) -> MapValue:
    """One fixed point, u = p, with the multiplier 0.5."""
    label = "low" if p < 0.3 else ("middle" if p < 0.7 else "high")
    return MapValue(u + 0.5 * (p - u), np.array([[0.5]]), np.array([0.5]), label)


def test_changes_of_the_label_are_located_in_order() -> None:
    curve = follow(line, [0.0], 0.0, scales=ONE, bounds=(0.0, 1.0))
    found = points_of(line, curve, ONE, 1e-11)
    assert [point.kind for point in found] == ["change", "change"]
    assert [point.labels for point in found] == [("low", "middle"), ("middle", "high")]
    assert [point.parameter for point in found] == [
        pytest.approx(0.3, abs=1e-9),
        pytest.approx(0.7, abs=1e-9),
    ]
    for point in found:
        assert curve.nodes[point.after].parameter <= point.parameter <= curve.nodes[point.after + 1].parameter


def test_two_changes_in_one_step_are_both_found() -> None:
    steps = Steps(first=3.0, largest=3.0)
    curve = follow(line, [0.0], 0.0, scales=ONE, bounds=(0.0, 1.0), steps=steps)
    assert len(curve.nodes) == 2
    assert len(points_of(line, curve, ONE, 1e-11)) == 2


def test_a_map_without_a_value_ends_the_curve_with_its_reason() -> None:
    def half(u: Any, p: float) -> MapValue:
        return MapValue.none(1, "range left") if p > 0.5 else line(u, p)

    curve = follow(half, [0.0], 0.0, scales=ONE, bounds=(-1.0, 1.0))
    assert [stop.reason for stop in curve.stops] == ["bound", "no value"]
    assert "range left" in curve.stops[1].sentence
    assert curve.nodes[-1].parameter == pytest.approx(0.5, abs=1e-6)


def test_a_curve_that_ends_is_lost_where_it_ends() -> None:
    def torn(u: Any, p: float) -> MapValue:
        return line(u, p) if p < 0.5 else MapValue(u + 1.0, np.eye(1), np.zeros(1))

    curve = follow(torn, [0.0], 0.0, scales=ONE, bounds=(-1.0, 1.0))
    assert curve.stops[1].reason == "lost"
    assert curve.stops[1].parameter == pytest.approx(0.5, abs=1e-6)


def test_too_many_steps_are_told() -> None:
    curve = follow(line, [0.0], 0.0, scales=ONE, bounds=(-9.0, 9.0), steps=Steps(most=5), directions="up")
    assert [stop.reason for stop in curve.stops] == ["not asked", "length"]
    assert len(curve.nodes) == 6


def test_a_curve_that_a_watch_ends_at_its_last_node_has_that_node_once() -> None:
    def watch(here: Node, ahead: Node) -> Stop | None:
        return Stop("here", here.parameter, here.state, "", here) if ahead.parameter > 0.5 else None

    curve = follow(line, [0.0], 0.0, scales=ONE, bounds=(-0.1, 1.0), watch=watch)
    assert curve.stops[1].reason == "here"
    parameters = [node.parameter for node in curve.nodes]
    assert parameters[-1] == pytest.approx(0.5, abs=1e-6)
    assert (np.diff(parameters) > 0.0).all()


def test_a_watch_may_end_a_curve_between_two_nodes() -> None:
    def watch(here: Node, ahead: Node) -> Stop | None:
        return Stop("far enough", 0.4, ahead.state, "far enough", here) if ahead.parameter > 0.4 else None

    curve = follow(line, [0.0], 0.0, scales=ONE, bounds=(-0.1, 1.0), watch=watch)
    assert curve.stops[1].reason == "far enough"
    assert curve.nodes[-1].parameter <= 0.4


def test_lengths_grow_along_the_curve() -> None:
    curve = follow(line, [0.5], 0.5, scales=ONE, bounds=(0.0, 1.0))
    arcs = [node.arc for node in curve.nodes]
    assert np.all(np.diff(arcs) > 0.0)
    assert 0.0 in arcs
    np.testing.assert_allclose([arcs[0], arcs[-1]], [-np.sqrt(0.5), np.sqrt(0.5)], rtol=1e-9)


@pytest.mark.parametrize(
    ("how", "key"),
    [
        ({"bounds": (1.0, 2.0)}, "parameter"),
        ({"bounds": (0.0, 0.0)}, "parameter"),
        ({"bounds": (-1.0, 1.0), "scales": [1.0, 0.0]}, "scales"),
    ],
)
def test_bad_input(how: dict[str, Any], key: str) -> None:
    with refused(key):
        follow(line, [0.0], 0.0, **{"scales": ONE, **how})


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"first": 0.0}, "steps"),
        ({"smallest": 1.0}, "steps"),
        ({"largest": float("inf")}, "steps"),
        ({"most": 0}, "most"),
    ],
)
def test_bad_steps(wrong: dict[str, Any], key: str) -> None:
    with refused(key):
        Steps(**wrong)


def test_no_fixed_point_near_the_start_is_told() -> None:
    def moved(u: Any, p: float) -> MapValue:
        return MapValue(u + 1.0, np.eye(1), np.zeros(1))

    with refused("parameter"):
        follow(moved, [0.0], 0.0, scales=ONE, bounds=(-1.0, 1.0))


def leaping(u: Any, p: float) -> MapValue:
    """The fixed point 0, whose multiplier jumps from 0.5 to -300 at p = 0.4."""
    multiplier = 0.5 if p < 0.4 else -300.0
    return MapValue(multiplier * u, np.array([[multiplier]]), np.array([0.0]))


def test_a_curve_does_not_leap_to_another() -> None:
    curve = follow(leaping, [0.0], 0.0, scales=ONE, bounds=(0.0, 1.0))
    assert curve.stops[1].reason == "jump"
    assert curve.stops[1].parameter == pytest.approx(0.4, abs=1e-6)
    assert "converges to another" in curve.stops[1].sentence


def test_an_end_within_a_step_is_come_to_closely() -> None:
    def ends(here: Node, ahead: Node) -> Stop | None:
        if ahead.parameter < 0.55:
            return None
        return Stop("over", here.parameter, here.state, "it is over", here)

    curve = follow(line, [0.0], 0.0, scales=ONE, bounds=(0.0, 1.0), watch=ends)
    assert curve.nodes[-1].parameter == pytest.approx(0.55, abs=1e-6)
