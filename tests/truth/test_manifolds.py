"""Manifolds of saddles: of a map with known manifolds, and of Duffing's strobe map."""

import math
from typing import Any

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import orbit
from printhammer.chaos.orbits.manifolds import Scaled, _Limits, _stable, _unstable, manifolds
from printhammer.run.regime import Regime

FORCE = ph.SineForce(0.3, 1.0 / (2.0 * math.pi), phase="90 deg")


class Bent:
    """x' = a x, y' = b y in the variables x = u - v^3, y = v - (u - v^3)^2: both manifolds of 0 are bent."""

    def __init__(self, a: float, b: float) -> None:
        self.factors = a, b

    def image(self, point: np.ndarray, firings: int) -> tuple[np.ndarray, np.ndarray]:
        u, v = point
        x = u - v**3
        y = v - x * x
        matrix = np.array([[1.0, -3.0 * v * v], [-2.0 * x, 1.0 + 6.0 * x * v * v]])
        for _ in range(firings):
            x, y = self.factors[0] * x, self.factors[1] * y
        u, v = x + (y + x * x) ** 3, y + x * x
        after = np.array([[1.0, -3.0 * v * v], [-2.0 * x, 1.0 + 6.0 * x * v * v]])
        stretched = np.diag([self.factors[0] ** firings, self.factors[1] ** firings])
        return np.array([u, v]), np.linalg.inv(after) @ stretched @ matrix


@pytest.mark.parametrize(("a", "b"), [(2.5, 0.3), (-2.5, 0.3), (40.0, -0.02), (-1.6, -0.7)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_curves_of_a_bent_saddle(a: float, b: float, side: float) -> None:
    own: Any = Bent(a, b)
    limits = _Limits(2.0, 3000, 0.02)
    out = _unstable(own, np.zeros(2), side, 1, limits)
    assert out.end == "length"
    # There y vanishes.
    u, v = out.points.T
    assert np.abs(v - (u - v**3) ** 2).max() < 1e-8
    assert (np.diff(u - v**3) * side * np.sign(u[1]) * side > 0.0).all()
    assert np.hypot(*np.diff(out.points, axis=0).T).max() <= 0.02
    inward = _stable(own, np.zeros(2), side, 1, limits)
    assert inward.end == "length"
    # x = 0 is u = v^3.
    assert np.abs(inward.points[:, 0] - inward.points[:, 1] ** 3).max() < 1e-5


class IntoSink:
    """u -> m u / (1 + (m - 1) u), v -> b v: 0 and 1 are fixed, with the multipliers m and 1 / m."""

    def image(self, point: np.ndarray, firings: int) -> tuple[np.ndarray, np.ndarray]:
        (u, v), slope = point, 1.0
        for _ in range(firings):
            below = 1.0 + 0.6 * u
            u, v, slope = 1.6 * u / below, 0.3 * v, slope * 1.6 / below**2
        return np.array([u, v]), np.diag([slope, 0.3**firings])


def test_a_manifold_ends_in_the_sink_into_which_it_runs() -> None:
    own: Any = IntoSink()
    out = _unstable(own, np.zeros(2), 1.0, 1, _Limits(2.0, 3000, 0.02))
    assert out.end == "sink"
    assert out.points[-1] == pytest.approx([1.0, 0.0], abs=1e-9)
    assert len(out.points) < 200
    assert np.hypot(*np.diff(out.points, axis=0).T).sum() == pytest.approx(1.0, abs=1e-9)


def test_both_halves_of_a_saddle_between_two_wells_end_in_their_sinks() -> None:
    force = ph.SineForce(0.01, 1.0 / (2.0 * math.pi), phase="90 deg")
    regime = Regime.of(ph.load("duffing-holmes"), drive=force)
    # The window is a hundredth of a well wide.
    wide: Any = {"length": 1e4, "points": 20_000, "spacing": 3.0}
    curves = manifolds(orbit(regime, (-0.005, 0.0005)), kinds=("unstable",), **wide)
    assert curves.ends == ("sink", "sink")
    wells = [(curves.points(number)[-1]).tolist() for number in (0, 1)]
    assert wells[0][0] * wells[1][0] < 0.0
    for x, v in wells:
        settled = ph.strobe(regime.hammer, drive=force, state=(x, v), points=1, transient=200, verdict=False)
        assert (settled.x[-1], settled.v[-1]) == pytest.approx((x, v), abs=1e-8)


@pytest.fixture(scope="module")
def curves() -> Any:
    regime = Regime.of(ph.load("duffing-holmes"), drive=FORCE)
    saddle = orbit(regime, (-0.15, 0.015))
    assert saddle.name == "period-1 saddle"
    return manifolds(saddle, length=12.0, spacing=0.05)


def test_what_lies_on_the_manifolds_of_duffings_saddle(curves: Any) -> None:
    own = Scaled(curves.orbit.regime, 1e-11)
    assert set(curves.ends) == {"length"}
    assert curves.kinds.tolist() == [0, 0, 1, 1]
    for number, kind in enumerate(curves.kinds):
        points = own.inward(curves.points(number))
        assert np.hypot(*np.diff(points, axis=0).T).max() <= 0.05
        if kind == 1:
            continue
        # A state of the stable manifold gets closer, and after a few periods it is there.
        saddle = own.inward(curves.orbit.section)
        for point in points[:: len(points) // 5]:
            there = own.image(point, 2)[0] if np.hypot(*(point - saddle)) > 1e-3 else point
            assert np.hypot(*(there - saddle)) < 0.1


def test_the_unstable_manifold_is_the_attractor(curves: Any) -> None:
    """The states of a strange motion lie along the manifold."""
    own = Scaled(curves.orbit.regime, 1e-11)
    states = ph.strobe(
        curves.orbit.regime.hammer, drive=FORCE, state=(0.1, 0.1), points=60, transient=100, verdict=False
    )
    known = np.concatenate([own.inward(curves.points(number)) for number in (2, 3)])
    points = own.inward(np.column_stack([states.x, states.v]))
    away = np.array([np.hypot(*(known - point).T).min() for point in points])
    # Layers lie beside one another, of which so much of the curve has some.
    assert np.median(away) < 0.2


def test_a_result_and_its_picture(curves: Any) -> None:
    table = curves.to_dataset()
    assert table.sizes["curves"] == 4
    assert table.length.attrs["units"] == "1"
    figure = curves.plot()
    assert "Period-1 saddle" in figure.axes[0].get_title(loc="left") + "".join(
        text.get_text() for text in figure.axes[0].texts
    )


def test_what_is_refused(curves: Any) -> None:
    with refused("kinds"):
        manifolds(curves.orbit, kinds=("odd",))
    with refused("length"):
        manifolds(curves.orbit, length=0.0)
    regime = Regime.of(ph.load("shaw-holmes-1983"), drive=ph.SineForce(0.427, 2.2 / (2 * math.pi), "90 deg"))
    with refused("orbit"):
        manifolds(orbit(regime, (0.0, 0.0)))
