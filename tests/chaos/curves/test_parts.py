"""Components of bifurcation curves, tested separately: systems, normal forms, points, results."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests import known_maps
from tests.errors import refused
from tests.known_maps import CUBIC, HENON, NAMES, SHIFT, UNITS, standing_in

from printhammer.chaos.continuation.arclength import Steps
from printhammer.chaos.curves import bifurcation_curve as module
from printhammer.chaos.curves.bifurcation_curve import BifurcationCurve, curve_of, settled_plane
from printhammer.chaos.curves.codimension import resonance_test
from printhammer.chaos.curves.normal_forms import MOST_PERIODS, grazing_sides, root_coefficient
from printhammer.chaos.curves.starts import start_of
from printhammer.chaos.curves.systems import TESTS, CurvePoint, MultiplierSystem, check_two
from printhammer.chaos.curves.tracing import PRECISION, CurveTracer, Traced
from printhammer.errors import InputError
from printhammer.results import reopen

Bounds = tuple[float, float]


def henon_curve(b: Bounds = (-0.3, 0.3), a: Bounds = (-1.0, 3.0), most: int = 50) -> BifurcationCurve:
    """The doubling of the fixed point of the Hénon map."""
    plane = known_maps.plane(a, b)
    begin = known_maps.start("period doubling", (2.0 / 3.0, 0.0), 0.75, plane)
    with standing_in(HENON):
        tracer = CurveTracer(plane, "period doubling", Steps(most=most, precision=PRECISION))
        return curve_of(plane, tracer.trace(begin, 0.0, 1), (0, 0), 1)


@pytest.mark.parametrize("kind", list(TESTS))
@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(0.1, 2.0), st.floats(-0.9, 0.9))
def test_the_system_of_a_map_and_its_derivative(kind: str, x: float, y: float, a: float, b: float) -> None:
    """Residual of det(J - m I) or det(J) - 1, and its derivative, evaluated directly."""
    plane = known_maps.plane((-9.0, 9.0), (-9.0, 9.0))
    system = MultiplierSystem(plane, kind)
    with standing_in(HENON):
        value = system(np.array([*(UNITS * [x, y]), a + SHIFT]), b)
    trace, determinant = -2.0 * a * x, -b
    test = {
        "fold": 1.0 - trace + determinant,
        "period doubling": 1.0 + trace + determinant,
        "Neimark-Sacker": determinant - 1.0,
    }[kind]
    scale = plane.scales[2]
    image = UNITS * [1.0 - a * x * x + y, b * x]
    np.testing.assert_allclose(value.image[:2], image, rtol=1e-12, atol=1e-12)
    assert value.image[2] == pytest.approx(a + SHIFT + scale * test, abs=1e-11)
    own = {"fold": (2.0, 1.0), "period doubling": (-2.0, 1.0), "Neimark-Sacker": (0.0, 0.0)}[kind][0]
    exact = np.array(
        [
            [-2.0 * a * x, UNITS[0] / UNITS[1], -UNITS[0] * x * x],
            [UNITS[1] / UNITS[0] * b, 0.0, 0.0],
            [scale * own * a / UNITS[0], 0.0, 1.0 + scale * own * x],
        ]
    )
    # Differences over 1e-6 of the scales.
    np.testing.assert_allclose(value.jacobian, exact, rtol=1e-4, atol=1e-4)
    slope = {"fold": -1.0, "period doubling": -1.0, "Neimark-Sacker": -1.0}[kind] * scale
    np.testing.assert_allclose(value.slope, [0.0, UNITS[1] * x, slope], rtol=1e-4, atol=1e-4)


def test_multipliers_of_a_place_are_sorted_by_size() -> None:
    def place(matrix: Any) -> CurvePoint:
        return CurvePoint(1.0, 2.0, np.zeros(2), 0.0, np.array(matrix, np.float64), "")

    assert place([[0.5, 0.0], [0.0, -2.0]]).multipliers.tolist() == [-2.0, 0.5]
    pair = place([[0.0, -1.0], [1.0, 0.0]]).multipliers
    assert sorted(pair.imag) == pytest.approx([-1.0, 1.0])
    assert math.isnan(place(np.eye(2)).acceleration)


def test_a_constant_is_not_followed_against_itself() -> None:
    check_two("rate", "mass")
    for first, second in (("mass", "mass"), ("rate", "period"), ("period", "rate")):
        with pytest.raises(InputError, match="expected another constant than that of the branch"):
            check_two(first, second)


def test_impossible_constants_end_a_curve() -> None:
    hammer = known_maps.regime().hammer
    regime = dataclasses.replace(known_maps.regime(), hammer=hammer)
    plane = dataclasses.replace(known_maps.plane((-1.0, 1.0), (-1.0, 1.0)), regime=regime)
    negative = dataclasses.replace(plane, names=("drive.amplitude", "mass"))
    with standing_in(HENON):
        value = MultiplierSystem(negative, "fold")(np.array([0.0, 0.0, SHIFT]), -1.0)
    assert "mass" in value.trouble


@given(st.integers(1, 4), st.floats(0.1, 3.0), st.floats(0.2, 1.2))
def test_a_rotation_is_resonant_after_half_turns(passages: int, angle: float, decay: float) -> None:
    turn = decay * np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    exact = decay**passages * math.sin(passages * angle)
    assert resonance_test(passages)(turn) == pytest.approx(exact, abs=1e-9)


def rigid_plane() -> Any:
    """Stability chart of an oscillator with a rigid backstop."""
    import printhammer as ph

    plane = known_maps.plane((-1.0, 1.0), (-1.0, 1.0))
    hammer = ph.Hammer.build(
        1.0,
        spring={"law": "preload", "preload": 0.0, "stiffness": 1.0},
        backstop={"law": "rigid", "position": -0.1, "restitution": 0.7},
    )
    return dataclasses.replace(plane, regime=dataclasses.replace(plane.regime, hammer=hammer))


def touch(matrix: Any, slope: Any, acceleration: float = 2.0) -> CurvePoint:
    flat = np.array(slope, np.float64)
    return CurvePoint(SHIFT, 0.0, np.zeros(2), 0.0, np.array(matrix), "", flat, acceleration)


def test_the_root_of_a_touch() -> None:
    place = touch(np.eye(2) * 0.5, [1.0, 0.0])
    assert root_coefficient(rigid_plane(), place) == pytest.approx(1.7 * math.sqrt(2.0 * 2.0))
    # Nothing turns back without an acceleration away from the backstop, nor without restitution.
    assert math.isnan(root_coefficient(rigid_plane(), touch(np.eye(2), [1.0, 0.0], -1.0)))
    assert math.isnan(root_coefficient(known_maps.plane((-1.0, 1.0), (-1.0, 1.0)), place))
    assert grazing_sides(rigid_plane(), touch(np.eye(2), [1.0, 0.0], -1.0)) == (0,) * (MOST_PERIODS + 1)


@given(st.floats(0.1, 0.9), st.floats(-0.9, -0.1) | st.floats(0.1, 0.9), st.floats(0.1, 2.0), st.booleans())
def test_sides_of_a_grazing_by_iteration(high: float, low: float, shear: float, up: bool) -> None:
    """Orbits of the map u -> A (u + (0, root sqrt(depth))) + slope move, found by trying both sides.

    A Nordmark map: with one touch in n periods, sqrt(depth) = 1 and the depth of second order.
    """
    matrix = np.array([[high, shear], [0.0, low]])
    slope = np.array([1.0 if up else -1.0, 0.3])
    sides = grazing_sides(rigid_plane(), touch(matrix, slope))
    # Without the touch: the fixed point of u -> A u + slope move stays off the surface, above 0.
    free = np.linalg.solve(np.eye(2) - matrix, slope)
    assert sides[0] == np.sign(free[0])
    kick = np.array([0.0, root_coefficient(rigid_plane(), touch(matrix, slope))])
    for periods in range(1, MOST_PERIODS + 1):
        # u_0 = (0, v): after the kick n passages lead back to it; unknown are v and the move.
        def back(v: float, move: float, periods: int = periods) -> tuple[np.ndarray, list[float]]:
            u, heights = np.array([0.0, v]) + kick, []
            for _ in range(periods):
                u = matrix @ u + slope * move
                heights.append(float(u[0]))
            return u - [0.0, v], heights

        rest = back(0.0, 0.0)[0]
        system = np.column_stack([back(1.0, 0.0)[0] - rest, back(0.0, 1.0)[0] - rest])
        if abs(np.linalg.det(system)) < 1e-6:
            continue
        v, move = np.linalg.solve(system, -rest)
        miss, heights = back(float(v), float(move))
        assert np.abs(miss).max() < 1e-6 * max(1.0, abs(v), abs(move))
        inner = heights[:-1]
        # An orbit that touches again, or exists only at the grazing itself, as for opposite multipliers.
        if min(abs(height) for height in (*inner, move)) < 1e-9:
            continue
        exists = all(height > 0.0 for height in inner)
        assert sides[periods] == (np.sign(move) if exists else 0)


def test_crossings_of_a_curve_are_solved_for() -> None:
    plane = known_maps.plane((-4.0, 4.0), (-1.0, 3.5))
    begin = known_maps.start("fold", (1.0, 0.0), -2.0, plane)
    with standing_in(CUBIC):
        traced = CurveTracer(plane, "fold", Steps(most=200, precision=PRECISION)).trace(begin, 3.0, 1)
        assert isinstance(traced, Traced)
        for which, value, count in ((0, SHIFT + 1.0, 1), (1, 1.5, 2), (1, -0.5, 0), (0, SHIFT + 3.9, 0)):
            places = traced.crossings(which, value)
            assert len(places) == count
            for place in places:
                p, r = place.first - SHIFT, place.second
                assert p**2 == pytest.approx(4.0 / 27.0 * r**3, abs=1e-9)
                assert (place.first, place.second)[which] == pytest.approx(value, rel=1e-14)


def test_a_curve_ends_where_it_leaves_the_plane_or_the_steps_are_used_up() -> None:
    curve = henon_curve(a=(0.6, 1.0))
    assert [stop.reason for stop in curve.stops] == ["bound", "bound"]
    ends = curve.first[[0, -1]] - SHIFT
    assert sorted(ends) == [pytest.approx(0.6), pytest.approx(1.0)]
    # In order along the curve, and none beyond its end.
    assert abs(np.sign(np.diff(curve.first)).sum()) == len(curve) - 1
    np.testing.assert_allclose(curve.second[[0, -1]], 1.0 - np.sqrt(ends / 0.75), atol=1e-9)
    assert f"{NAMES[0]} = 21 N is the bound" in curve.message
    short = henon_curve(most=2)
    assert len(short) == 5
    assert "the maximum number of steps is reached at" in short.message


def test_a_curve_is_begun_at_any_of_its_points_from_a_file(tmp_path: Path) -> None:
    curve = henon_curve()
    curve.save(tmp_path / "curve.nc")
    curve.save(tmp_path / "curve.json")
    regime = known_maps.regime()
    last = len(curve) - 1
    for name in ("curve.nc", "curve.json"):
        path = tmp_path / name
        for asked, number in ((None, 0), (0, 0), ("first", 0), ("last", last), (3, 3), (last, last)):
            begin = start_of(path, asked, regime)
            assert (begin.kind, begin.first, begin.firings) == ("period doubling", NAMES[0], 1)
            assert (begin.value, begin.other) == (curve.first[number], curve.second[number])
            assert begin.state.tolist() == curve.state[number].tolist()
            assert begin.bounds == curve.bounds[0]
            assert begin.regime.phase == curve.phase[number]
            assert begin.tolerance == curve.tolerance
        for asked in (last + 1, "fold", -2):
            with pytest.raises(InputError, match=f"expected a point of the curve from 0 to {last}"):
                start_of(path, asked, regime)
        with refused("regime", file=path) as caught:
            start_of(path, 0, None)
        assert "expected a regime (hammer and drive) in addition to the file" in str(caught.value)
        other = dataclasses.replace(regime, hammer=regime.hammer.replace("mass", 2.0))
        with pytest.raises(InputError, match="hammer_fingerprint = "):
            start_of(path, 0, other)


def test_what_a_curve_says_and_saves(tmp_path: Path) -> None:
    curve = henon_curve()
    assert curve.title.startswith("period doubling of period-1 orbits of")
    assert f"supercritical at {len(curve)} of {len(curve)}" in str(curve.summary())
    assert curve.provenance
    curve.save(tmp_path / "curve.nc")
    opened = reopen(tmp_path / "curve.nc")
    for name in ("first", "second", "phase", "coefficient"):
        np.testing.assert_array_equal(opened.dataset[name].values, getattr(curve, name))
    np.testing.assert_array_equal(opened.dataset["multiplier_real"].values, curve.multipliers.real)
    np.testing.assert_array_equal(opened.dataset["settled"].values, [[-1]])
    assert opened.attributes["names"] == list(NAMES)
    assert "is the bound" in opened.attributes["first_end"]


def test_a_stable_side_is_told_from_the_other_multiplier() -> None:
    curve = henon_curve()
    assert curve.limits.all()
    both = curve.multipliers.copy()
    both[::2, 0], both[::2, 1] = -1.5, -1.0
    other = dataclasses.replace(curve, multipliers=both)
    np.testing.assert_array_equal(other.limits, np.arange(len(curve)) % 2 == 1)
    signs = np.resize([1.0, -2.0, np.nan], len(curve))
    words = dataclasses.replace(curve, coefficient=signs).criticality
    assert words[:3] == ("supercritical", "subcritical", "")
    assert set(dataclasses.replace(curve, kind="fold").criticality) == {""}


def test_the_plane_of_trains_from_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows are values of the second constant, columns of the first; a run that stops counts as -1."""
    regime = known_maps.regime()
    asked: list[tuple[float, float]] = []

    class States:
        def __init__(self, first: float, second: float) -> None:
            self.status = "stopped" if second > 0.5 else "ok"
            self.period = round(first - SHIFT) or None

        def distances(self, _train: Any) -> None: ...

        def settled(self, _train: Any, _distances: Any) -> Any:
            return self if self.period != 2 else None

    def run_trains(trains: Any, _judged: Any, _ticks: None, effort: Any) -> Any:
        assert effort.threads == 1
        pairs = [(each.value(NAMES[0]), each.value(NAMES[1])) for each in trains]
        asked.extend(pairs)
        return [States(*pair) for pair in pairs], None

    monkeypatch.setattr(module, "run_trains", run_trains)
    monkeypatch.setattr(module.Train, "of", lambda at, _firings: at)
    bounds = ((SHIFT, SHIFT + 3.0), (0.0, 1.0))
    (first, second), settled = settled_plane(regime, NAMES, bounds, (4, 3), 1)
    np.testing.assert_array_equal(first, SHIFT + np.arange(4.0))
    np.testing.assert_array_equal(second, [0.0, 0.5, 1.0])
    assert asked == [(a, b) for b in second for a in first]
    np.testing.assert_array_equal(settled, [[0, 1, 0, 3], [0, 1, 0, 3], [-1, -1, -1, -1]])
    with pytest.raises(InputError, match="expected two numbers of values, not negative"):
        settled_plane(regime, NAMES, bounds, (-1, 3), 1)
