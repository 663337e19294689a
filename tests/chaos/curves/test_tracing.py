"""Bifurcation curves: continuation past a change of section, starting points, events on a curve."""

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests import known_maps
from tests.known_maps import CUBIC, HENON, NAMES, SHIFT, Array, Map, standing_in

from printhammer.chaos.continuation.arclength import Steps
from printhammer.chaos.curves.bifurcation_curve import BifurcationCurve, curve_of
from printhammer.chaos.curves.stability_chart import _Chart
from printhammer.chaos.curves.starts import Start
from printhammer.chaos.curves.systems import GRAZING
from printhammer.chaos.curves.tracing import PRECISION, CurveTracer, Traced
from printhammer.chaos.strobe.map import Image
from printhammer.errors import InputError
from printhammer.run.regime import Regime

STEPS = Steps(most=100, precision=PRECISION)
PLANE = known_maps.plane((-1.0, 3.0), (-0.4, 0.4))
BEGIN = known_maps.start("period doubling", (2.0 / 3.0, 0.0), 0.75, PLANE)


def henon() -> Traced:
    with standing_in(HENON):
        return CurveTracer(PLANE, "period doubling", STEPS).trace(BEGIN, 0.0, 1)


@pytest.mark.parametrize(("beyond", "sign"), [(0.2, 1.0), (-0.25, -1.0)])
def test_a_curve_goes_on_at_another_section(beyond: float, sign: float) -> None:
    """Only the map at the first section is undefined beyond a value of the second constant."""
    image = known_maps.image_by(HENON)

    def image_of(at: Regime, state: Array, firings: int, tolerance: float, **options: Any) -> Image:
        whole = image(at, state, firings, tolerance, **options)
        gone = at.phase == 0.0 and sign * (at.value(NAMES[1]) - beyond) > 0.0
        return dataclasses.replace(whole, status="stopped") if gone else whole

    def quiet(at: Regime, state: Array, *_: Any) -> tuple[Regime, Array]:
        late = abs(at.value(NAMES[1])) > 0.1
        return (dataclasses.replace(at, phase=0.5), state) if late else (at, state)

    with standing_in(HENON), pytest.MonkeyPatch.context() as patch:
        for module in ("systems", "normal_forms"):
            patch.setattr(f"printhammer.chaos.curves.{module}.image_of", image_of)
        for module in ("tracing", "normal_forms"):
            patch.setattr(f"printhammer.chaos.curves.{module}.quiet_section", quiet)
        traced = CurveTracer(PLANE, "period doubling", STEPS).trace(BEGIN, 0.0, 1)
    assert [stop.reason for stop in traced.stops] == ["bound", "bound"]
    assert len(traced.pieces) == 2
    second = np.array([place.second for place in traced.places])
    assert (np.diff(second) > 0.0).all()
    assert (second[0], second[-1]) == (-0.4, 0.4)
    first = np.array([place.first - SHIFT for place in traced.places])
    np.testing.assert_allclose(first, 0.75 * (1.0 - second) ** 2, rtol=0.0, atol=1e-9)
    phases = np.array([place.phase for place in traced.places])
    np.testing.assert_array_equal(phases == 0.5, sign * (second - beyond) > 0.0)
    # Arcs and tangents go on in the same direction.
    assert all(node.tangent[-1] > 0.0 for node in traced.nodes)


def test_where_there_is_no_other_section_the_curve_ends() -> None:
    image = known_maps.image_by(HENON)

    def image_of(at: Regime, state: Array, firings: int, tolerance: float, **options: Any) -> Image:
        whole = image(at, state, firings, tolerance, **options)
        return dataclasses.replace(whole, status="stopped") if at.value(NAMES[1]) > 0.2 else whole

    with standing_in(HENON), pytest.MonkeyPatch.context() as patch:
        patch.setattr("printhammer.chaos.curves.systems.image_of", image_of)
        traced = CurveTracer(PLANE, "period doubling", STEPS).trace(BEGIN, 0.0, 1)
    assert traced.stops[0].reason == "bound"
    assert traced.stops[1].parameter == pytest.approx(0.2, abs=1e-5)
    assert "there is no strobe map: stopped" in traced.stops[1].sentence


def test_starts_that_lead_nowhere_are_refused() -> None:
    away = Map(lambda u, p, r: [u[0] + 1.0, 0.5 * u[1]], lambda u, p, r: [[1.0, 0.0], [0.0, 0.5]])
    with (
        standing_in(away),
        pytest.raises(InputError, match=r"fold at drive\.amplitude = 20\.75 N: there is no"),
    ):
        CurveTracer(PLANE, "fold", STEPS).trace(dataclasses.replace(BEGIN, kind="fold"), 0.0, 1)
    with standing_in(HENON), pytest.raises(InputError, match="the orbit comes near no surface"):
        CurveTracer(PLANE, GRAZING, STEPS).trace(dataclasses.replace(BEGIN, kind=GRAZING), 0.0, 1)


def curve() -> BifurcationCurve:
    traced = henon()
    with standing_in(HENON):
        return curve_of(PLANE, traced, (0, 0), 1)


def test_an_event_lies_on_a_curve_or_not() -> None:
    branch: Any = SimpleNamespace(
        regime=PLANE.regime,
        parameter=NAMES[0],
        bounds=PLANE.bounds[0],
        firings=1,
        tolerance=PLANE.tolerance,
    )

    def event(b: float, away: float = 0.0, kind: str = "period doubling") -> Start:
        x = 2.0 / (3.0 * (1.0 - b))
        return known_maps.start(kind, (x + away, b * x), 0.75 * (1.0 - b) ** 2, PLANE)

    doubling = curve()
    with standing_in(HENON):
        for b in (-0.37, 0.0, 0.123, 0.4):
            chart = _Chart(branch, NAMES[1], PLANE.bounds[1], STEPS)
            chart.value = b
            assert chart.is_on(doubling, event(b))
            assert not chart.is_on(doubling, event(b, kind="fold"))
            # Another orbit at the same constants is another bifurcation.
            assert not chart.is_on(doubling, event(b, away=0.3 * PLANE.scales[0]))
            chart.value = b + 0.2
            assert not chart.is_on(doubling, event(b))


def test_two_events_on_one_curve_are_followed_once() -> None:
    """Both folds of the cubic map lie on one curve, which turns at the cusp."""
    plane = known_maps.plane((-4.0, 4.0), (-1.0, 3.5))
    branch: Any = SimpleNamespace(
        regime=plane.regime.with_(NAMES[1], 3.0),
        parameter=NAMES[0],
        bounds=plane.bounds[0],
        firings=1,
        tolerance=plane.tolerance,
    )
    chart = _Chart(branch, NAMES[1], plane.bounds[1], Steps(most=200, precision=PRECISION))
    one, two = (known_maps.start("fold", (x, 0.0), -2.0 * x**3, plane) for x in (1.0, -1.0))
    with standing_in(CUBIC):
        followed = chart.curve(one)
        assert isinstance(followed, BifurcationCurve)
        assert chart.is_on(followed, one)
        assert chart.is_on(followed, two)
        refused = chart.curve(dataclasses.replace(one, kind=GRAZING))
    assert [point.kind for point in followed.points] == ["cusp"]
    # A start is followed as what it is.
    assert isinstance(refused, str)
    assert "comes near no surface" in refused
