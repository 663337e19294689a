"""Orbits with a rail driver: if no current flows at the firing, displacement and velocity are the state."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.errors import refused
from tests.strobe_maps import strobe_map

import printhammer as ph
from printhammer.chaos import strobes
from printhammer.chaos.strobe.map import CURRENT, Image
from printhammer.drive.waveforms.drivers import Capacitor, Rail
from printhammer.run.regime import Regime

RAIL = Rail(voltage=100.0, width=177.24e-6, decay="diode", decay_resistance=159.08)


@pytest.fixture(scope="module")
def hammer() -> ph.Hammer:
    """The paper's hammer, with a rail driver that gives its current."""
    coil = {"coil.resistance": 28.612, "coil.inductance": 6.5468e-3}
    return ph.load("hendriks-1983-1").replace({**coil, "waveform": RAIL})


def after(regime: Regime, state: list[float], firings: int) -> Image:
    return strobe_map(regime, state, firings=firings, contacts=False)


@pytest.mark.parametrize("rate", [500.0, 1200.0])
def test_the_derivative_of_the_map_is_that_of_differences(hammer: ph.Hammer, rate: float) -> None:
    regime = Regime.of(hammer, rate=rate)
    state = after(regime, [5.04e-5, 0.0], 2).state
    image = strobe_map(regime, state, contacts=False)
    assert image.ok
    for k, spacing in enumerate((1e-9, 1e-5)):
        side = spacing * np.eye(2)[k]
        near, far = (
            strobe_map(regime, state + m * side, contacts=False).state
            - strobe_map(regime, state - m * side, contacts=False).state
            for m in (1, 2)
        )
        slope = (8.0 * near - far) / (12.0 * spacing)
        assert np.abs(image.jacobian[:, k] / slope - 1.0).max() < 1e-7


def test_a_multiplier_of_an_orbit_is_the_exponent_of_its_train(hammer: ph.Hammer) -> None:
    (orbit,) = ph.orbits(hammer, rate="500 Hz", longest=1, starts=8, guesses=8, follow=0)
    assert orbit.kind == "stable"
    exponent = ph.lyapunov(hammer, rate="500 Hz", firings=100)
    assert abs(orbit.multipliers[0]) == pytest.approx(math.exp(exponent.exponents[0]), rel=1e-6)
    (points,) = strobes(hammer, ["2 ms"], points=1, firings=(101, 200))
    assert points.verdict is not None
    assert points.verdict.name == "period-1"


def test_a_current_at_the_firing_is_named(hammer: ph.Hammer) -> None:
    """A bounce induces a current through the diode: displacement and velocity are not the full state then."""
    image = strobe_map(Regime.of(hammer, rate=800.0), [5.04e-5, 0.0])
    assert image.status == CURRENT
    assert not np.isfinite(image.state).any()


def test_other_electric_states_are_refused(hammer: ph.Hammer) -> None:
    turn = hammer.replace({"coil.turn_resistance": 5.0, "coil.leakage": 1e-3})
    with refused("state"):
        ph.orbits(turn, rate="500 Hz", longest=1, starts=8)
    charged = hammer.replace(
        "waveform", Capacitor(voltage=100.0, width=177e-6, capacitance=1e-4, charging_resistance=10.0)
    )
    with refused("state"):
        ph.orbits(charged, rate="500 Hz", longest=1, starts=8)
