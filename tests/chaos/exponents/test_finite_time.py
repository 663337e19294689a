"""Finite-time exponents: values over segments of one train, and rejected input."""

import math

import numpy as np
import pytest
from tests.errors import refused

import printhammer as ph
from printhammer.chaos import Lyapunov

FORCE = ph.SineForce(0.3, 1.0 / (2.0 * math.pi), phase="90 deg")


@pytest.fixture(scope="module")
def train() -> Lyapunov:
    return ph.lyapunov(ph.load("duffing-holmes"), drive=FORCE, state=(0.1, 0.1), firings=2000, transient=50)


def test_means_and_scatter_of_stretches(train: Lyapunov) -> None:
    found = ph.finite_time(train, lengths=(1, 4, 20))
    np.testing.assert_array_equal(found.stretches, [2000, 500, 100])
    np.testing.assert_allclose(found.mean, train.exponents[0], rtol=1e-12)
    assert (np.diff(found.deviation) < 0.0).all()
    # Growth is forgotten soon.
    assert found.deviation[2] / found.deviation[1] == pytest.approx(math.sqrt(4 / 20), rel=0.3)
    assert found.negative[0] > 0.1
    assert found.negative[2] < found.negative[0]
    np.testing.assert_allclose(found.values[1][0], train.factors[:4, 0].mean(), rtol=1e-12)
    assert (np.diff(found.quantiles, axis=1) >= 0.0).all()
    assert found.to_dataset()["quantile"].dims == ("length", "level")
    assert found.plot().axes[0].get_xlabel().startswith("Finite-time exponent")


@pytest.mark.parametrize(
    ("lengths", "key"),
    [((), "lengths"), ((2, 1), "lengths"), ((0,), "lengths"), ((500,), "lengths")],
)
def test_what_is_refused(train: Lyapunov, lengths: tuple[int, ...], key: str) -> None:
    with refused(key):
        ph.finite_time(train, lengths=lengths)
