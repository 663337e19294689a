"""Multipliers of rows, from differences in an ensemble, against those of orbits from the tangent flow."""

import numpy as np
import pytest
from scipy.optimize import root
from tests.errors import refused

import printhammer as ph
from printhammer.chaos.strobe.map import image_of
from printhammer.derivatives.rows import DOTS, leading, row_multipliers
from printhammer.run.effort import Effort
from printhammer.run.regime import Regime

TIGHT = Effort(1e-11)


def rows_of(hammer: ph.Hammer, rates: list[float]) -> list[ph.PulseTrain]:
    return [ph.PulseTrain(hammer.waveform, rate=rate, pulses=DOTS) for rate in rates]


@pytest.fixture(scope="module")
def shipped() -> ph.Hammer:
    return ph.load("hendriks-1983-1")


def by_tangent_flow(hammer: ph.Hammer, rate: float) -> float:
    """Return the leading multiplier of the fixed point of the strobe map nearest to a row from rest."""
    regime = Regime.of(hammer, rate=rate)
    row = ph.PulseTrain(hammer.waveform, rate=rate, pulses=DOTS)
    motion = ph.simulate(hammer, row, times=row.times[-2:], duration=DOTS / rate)
    scales = np.array([1e-4, 0.1])
    start = np.array([motion.x.mean(), motion.v.mean()]) / scales
    closed = root(lambda z: image_of(regime, z * scales, 1, 1e-12, contacts=False).state / scales - z, start)
    assert closed.success
    values = np.linalg.eigvals(image_of(regime, closed.x * scales, 1, 1e-12, contacts=False).jacobian)
    return float(max(values, key=abs).real)


def test_they_are_those_of_the_tangent_flow_stable_or_not(shipped: ph.Hammer) -> None:
    rates = [600.0, 840.0, 1275.0]
    found = row_multipliers([shipped] * 3, rows_of(shipped, rates), TIGHT)
    exact = [by_tangent_flow(shipped, rate) for rate in rates]
    np.testing.assert_allclose(found, exact, rtol=2e-4)
    assert abs(exact[0]) < 1.0 < -exact[1]


def test_a_slow_row_forgets(shipped: ph.Hammer) -> None:
    (found,) = row_multipliers([shipped], rows_of(shipped, [50.0]), TIGHT)
    assert abs(found) < 1e-3


def test_signs_and_sizes() -> None:
    turn = np.array([[0.0, -0.5], [0.5, 0.0]])
    matrices = np.array([np.diag([0.2, -1.5]), np.diag([0.9, 0.1]), turn, np.full((2, 2), np.nan)])
    np.testing.assert_allclose(leading(matrices), [-1.5, 0.9, 0.5, np.nan])


def test_short_rows_are_refused(shipped: ph.Hammer) -> None:
    with refused("drive"):
        row_multipliers([shipped], [ph.PulseTrain(shipped.waveform, rate=500.0, pulses=3)], TIGHT)


def test_a_relay_at_rest_on_its_stop_forgets() -> None:
    """Its bounces are smaller than the error of a table's run, or it rests, with no lower neighbour in x."""
    relay = ph.load("relay-5v")
    short = ph.PulseTrain(relay.waveform.model_copy(update={"width": 10e-3}), rate=30.0, pulses=DOTS)
    rows = [ph.PulseTrain(relay.waveform, rate=30.0, pulses=DOTS), short]
    for closed in (False, True):
        found = row_multipliers([relay] * 2, rows, Effort(5e-7), firing=2, closed=closed)
        assert (np.abs(found) < 1e-2).all()
