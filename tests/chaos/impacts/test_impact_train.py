"""Statistics of impact trains with known properties."""

import math

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.chaos.impacts import autocorrelation, impact_train


def test_a_clock() -> None:
    found = impact_train(0.3 + 1e-3 * np.arange(101))
    assert found.mean == pytest.approx(1e-3)
    assert found.variation < 1e-12
    assert found.fano == 0.0
    assert found.windows == 10
    assert np.isnan(found.autocorrelation).all()
    assert found.counts.sum() == 100


def test_a_poisson_process() -> None:
    count = 20000
    times = np.cumsum(np.random.default_rng(11).exponential(2e-3, count + 1))
    found = impact_train(times, window="40 ms", lags=10)
    # Scatter of a coefficient of variation, of a variance over mean, and of an autocorrelation, five-fold.
    assert abs(found.variation - 1.0) < 5.0 / math.sqrt(count)
    assert abs(found.fano - 1.0) < 5.0 * math.sqrt(2.0 / found.windows)
    assert (np.abs(found.autocorrelation[1:]) < 5.0 / math.sqrt(count)).all()
    assert found.significant == pytest.approx(1.96 / math.sqrt(count))
    # A tenth of the exponential lies above 2.3 means.
    beyond = found.counts[found.edges[:-1] > 2e-3 * math.log(10.0)].sum()
    assert beyond == pytest.approx(count / 10, rel=0.05)


def test_alternating_intervals() -> None:
    steps = np.tile([1e-3, 3e-3], 50)
    found = impact_train(np.concatenate([[0.0], np.cumsum(steps)]), lags=6)
    assert found.mean == pytest.approx(2e-3)
    assert found.variation == pytest.approx(0.5 * math.sqrt(100 / 99))
    lag = np.arange(7)
    np.testing.assert_allclose(found.autocorrelation, (-1.0) ** lag * (100 - lag) / 100, rtol=1e-9)
    assert found.counts[0] == found.counts[-1] == 50


def test_the_autocorrelation_of_a_filtered_series() -> None:
    # x(k) = a x(k - 1) + noise has the autocorrelation a^lag.
    rng, series = np.random.default_rng(5), [0.0]
    for noise in rng.standard_normal(50000):
        series.append(0.8 * series[-1] + noise)
    np.testing.assert_allclose(autocorrelation(np.array(series), 5), 0.8 ** np.arange(6), atol=0.03)


def test_impacts_of_a_hammer(hammer: "ph.Hammer") -> None:
    # So slow that the armature is at rest before each firing.
    period = 6e-3
    touches = ph.section(hammer, surface="pack", period=period, touches=60, transient=5)
    found = impact_train(touches)
    assert found.source is touches
    assert found.hammer is hammer
    assert found.window == 10.0 * period
    np.testing.assert_array_equal(found.times, touches.t)
    assert found.mean == pytest.approx(period, rel=1e-9)
    assert found.fano == 0.0
    chart = found.to_dataset()
    assert chart.attrs["surface"] == "pack"
    np.testing.assert_array_equal(chart["interval"][1:], found.intervals)


@pytest.mark.parametrize(
    ("times", "options", "key"),
    [
        (np.arange(8.0), {}, "touches"),
        (np.zeros(20), {}, "touches"),
        (np.full(20, math.nan), {}, "touches"),
        (np.zeros((20, 2)), {}, "touches"),
        (["a"] * 20, {}, "touches"),
        (np.arange(20.0), {"window": 0.0}, "window"),
        (np.arange(20.0), {"bins": 0}, "bins"),
        (np.arange(20.0), {"lags": 0}, "lags"),
    ],
)
def test_bad_input(times: object, options: dict[str, object], key: str) -> None:
    with refused(key):
        impact_train(times, **options)
