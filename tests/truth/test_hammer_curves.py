"""Curves of the paper's hammer in (rate, damping) and (rate, pulse width), by another Newton solver."""

import numpy as np
import pytest
from tests.strobe_maps import strobe_map
from tests.truth.damped_impacts import Array, newton

import printhammer as ph
from printhammer.chaos import BifurcationCurve, Branch
from printhammer.run.regime import Regime

SIGN = {"fold": -1.0, "period doubling": 1.0}
WIDE = ("500 Hz", "1200 Hz")


@pytest.fixture(scope="module")
def branch() -> Branch:
    return ph.continuation(ph.load("hendriks-1983-1"), "rate", ("735 Hz", "770 Hz"), rate="745 Hz", most=120)


def solved(curve: BifurcationCurve, place: int) -> float:
    """The rate at which the orbit has the multiplier 1 or -1, at a fixed second constant."""
    phase = float(curve.phase[place])
    regime = Regime.of(curve.regime.hammer, rate=float(curve.first[place]), phase=phase)
    regime = regime.with_(curve.names[1], float(curve.second[place]))
    scales = np.array([*regime.window.half_widths, regime.rate])
    start = np.array([*curve.state[place], curve.first[place]]) / scales

    def equations(z: Array) -> Array:
        x, v, rate = z * scales
        image = strobe_map(regime.with_("rate", float(rate)), (x, v), contacts=False)
        test = float(np.linalg.det(image.jacobian + SIGN[curve.kind] * np.eye(2)))
        return np.append(image.state / scales[:2] - z[:2], test)

    # From beside the point, not from it.
    return float(newton(equations, start + np.array([1e-5, -1e-5, 1e-7]))[2] * scales[2])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "second", "low", "high"),
    [
        ("fold", "backstop.damping", "1.4e10 N*s/m^2.5", "7e10 N*s/m^2.5"),
        ("period doubling", "backstop.damping", "3.3e10 N*s/m^2.5", "5e10 N*s/m^2.5"),
        ("fold", "waveform.width", "120 us", "260 us"),
        ("period doubling", "waveform.width", "150 us", "190 us"),
    ],
)
def test_points_of_the_hammer(branch: Branch, kind: str, second: str, low: str, high: str) -> None:
    curve = ph.bifurcation_curve(branch, second, (low, high), event=kind, first=WIDE)
    rng = np.random.default_rng(3)
    for place in rng.choice(len(curve), 6, replace=False):
        assert solved(curve, int(place)) == pytest.approx(curve.first[place], rel=1e-9)
    if (kind, second) == ("fold", "backstop.damping"):
        # Both folds of the branch are one loop between two cusps.
        assert [stop.reason for stop in curve.stops] == ["closed", "closed"]
        assert [point.kind for point in curve.points].count("cusp") == 2
        for point in curve.points:
            assert abs(point.multipliers[0] - 1.0) < 1e-6
