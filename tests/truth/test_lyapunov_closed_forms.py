"""Exponents, dimensions and tests for chaos, for systems with analytic results."""

import math
from itertools import pairwise

import numpy as np
import pytest
from tests import hammers
from tests.hammers import MASS, interpreted, made_of
from tests.tangents import SHARP

import printhammer as ph
from printhammer.chaos import strobes
from printhammer.chaos.exponents.lyapunov import kaplan_yorke
from printhammer.claims.verdicts import printed_verdicts
from printhammer.derivatives.states import standard_error, tangent_map
from printhammer.parts.pack.dashpot import DashpotPack

CLOSE = 1e-9


def oscillator(damping: float, stiffness: float = 3e4) -> ph.Hammer:
    """A mass in permanent contact with a spring and a dashpot."""
    pack = DashpotPack(stiffness=stiffness, damping=damping, front=-1.0, pull=True)
    return made_of(pack=pack, spring=hammers.preload(stiffness))


def test_an_overdamped_oscillator() -> None:
    """Perturbations decay as exp(s t), m s^2 + C s + k = 0: the exponents are s times the period."""
    damping, stiffness, period = 10.0, 3e4, 0.2e-3
    rates = np.sort(np.roots([MASS, damping, stiffness]).real)[::-1]
    with interpreted():
        found = ph.lyapunov(
            oscillator(damping),
            drive=ph.SineForce(5.0, 1.0 / period),
            state=(0.0, 0.1),
            firings=30,
            transient=30,
            tolerance=SHARP,
        )
    assert found.ok
    np.testing.assert_allclose(found.per_second, rates, rtol=CLOSE)
    assert found.total == pytest.approx(-damping / MASS * period, rel=CLOSE)
    assert found.dimension == found.dimension_error == 0.0
    assert found.growth == "regular"
    # Too few points for the 0-1 test.
    assert found.zero_one is None
    assert found.agree is None


def test_an_underdamped_oscillator() -> None:
    """Growth fluctuates as the motion rotates; the sum does not, and both exponents average to -C/(2 m)."""
    damping, period, firings = 1.5, 0.4e-3, 60
    with interpreted():
        found = ph.lyapunov(
            oscillator(damping),
            drive=ph.SineForce(5.0, 1.0 / period),
            state=(0.0, 0.1),
            firings=firings,
            transient=10,
            tolerance=SHARP,
        )
    assert found.total == pytest.approx(-damping / MASS * period, rel=CLOSE)
    # What wavers is bounded by the condition of the eigenvectors, some units, over the number of firings.
    np.testing.assert_allclose(found.exponents, 0.5 * found.total, atol=3.0 / firings)
    assert found.growth == "regular"


def henon(count: int, a: float = 1.4, b: float = 0.3) -> np.ndarray:
    """Return the growth of two orthonormal directions under x' = 1 - a x^2 + y, y' = b x, by QR."""
    x, y, frame = 0.1, 0.1, np.eye(2)
    logs = []
    for k in range(count + 500):
        frame, upper = np.linalg.qr(np.array([[-2.0 * a * x, 1.0], [b, 0.0]]) @ frame)
        x, y = 1.0 - a * x * x + y, b * x
        if k >= 500:
            logs.append(np.log(np.abs(np.diag(upper))))
    return np.array(logs)


def test_the_dimension_of_the_map_of_henon() -> None:
    """Exponents 0.4192 and ln 0.3 - 0.4192, D = 1.258 (Sprott, Chaos and Time-Series Analysis, 2003)."""
    growth = henon(20000)
    dimension, error = kaplan_yorke(growth)
    assert growth.sum(axis=1) == pytest.approx(math.log(0.3), rel=1e-9)
    assert error < 0.003
    assert abs(dimension - 1.258) < 4.0 * error


def test_the_error_of_the_dimension_is_that_of_many_repetitions() -> None:
    """Independent growth of known scatter, D = 1 - l1/l2 linearised: the error bar covers the scatter."""
    rng = np.random.default_rng(7)
    means, scatter, count = np.array([0.4, -1.6]), np.array([[0.5, 0.0], [-0.4, 0.2]]), 2000
    found = [kaplan_yorke(means + rng.standard_normal((count, 2)) @ scatter.T) for _ in range(200)]
    values, errors = np.array(found).T
    assert values.mean() == pytest.approx(1.25, abs=4.0 * values.std() / math.sqrt(200))
    slopes = np.array([-1.0 / means[1], means[0] / means[1] ** 2])
    assert np.linalg.norm(slopes @ scatter) / math.sqrt(count) == pytest.approx(values.std(), rel=0.2)
    assert errors.mean() == pytest.approx(values.std(), rel=0.2)


def test_the_exponent_of_the_logistic_map() -> None:
    """At r = 4 the exponent is ln 2; the error bar covers the deviation of the estimate."""
    x = np.random.default_rng(1).uniform(0.1, 0.9)
    logs = []
    for _ in range(20000):
        logs.append(math.log(abs(4.0 - 8.0 * x)))
        x = 4.0 * x * (1.0 - x)
    error = standard_error(logs)
    assert error < 0.01
    assert abs(np.mean(logs) - math.log(2.0)) < 4.0 * error


@pytest.mark.slow
def test_stable_orbits_have_the_logarithms_of_their_multipliers(hammer: "ph.Hammer") -> None:
    judged = strobes(hammer, list(printed_verdicts()), points=2, firings=(901, 1100))
    stable = [found for found in judged if found.verdict.period is not None]
    assert stable
    for train in stable:
        found = ph.lyapunov(hammer, period=train.period, firings=200, transient=900, tolerance=1e-13)
        q = found.verdict.period
        t = found.points.t
        assert found.ok
        # All the pulses before are under way, as in the train.
        once = tangent_map(hammer, found.points.drive, t[-1 - q], t[-1], tolerance=1e-13)
        assert once.ok
        assert once.smooth
        logs = np.sort(np.log(np.abs(np.linalg.eigvals(once.matrix))))[::-1] / q
        # Of one firing each; the determinant of a whole period is a small difference of large products.
        firings = pairwise(t[-1 - q :])
        maps = [tangent_map(hammer, found.points.drive, *pair, tolerance=1e-13) for pair in firings]
        both = sum(math.log(abs(each.determinant)) for each in maps) / q
        assert found.total == pytest.approx(both, rel=1e-6)
        # The small one of two real multipliers is known from the determinants, not from a difference.
        exact = np.array([logs[0], both - logs[0]])
        # Directions of a complex pair turn for ever, those of multipliers alike settle slowly.
        apart = exact[0] - exact[1] > 0.5 / q
        np.testing.assert_allclose(found.exponents, exact, atol=1e-6 if apart else 0.05)
        assert found.dimension == 0.0


@pytest.mark.parametrize("period", [1.05e-3, 0.9e-3])
def test_the_sum_is_the_mean_logarithm_of_the_determinant(hammer: "ph.Hammer", period: float) -> None:
    firings, transient = 12, 5
    found = ph.lyapunov(hammer, period=period, firings=firings, transient=transient)
    t = found.points.t
    maps = [tangent_map(hammer, found.points.drive, start, end) for start, end in pairwise(t)]
    assert all(each.matrix.shape == (2, 2) for each in maps)
    logs = np.array([math.log(abs(each.determinant)) for each in maps])
    # The determinant of a matrix with multipliers far apart is a difference: digits are lost.
    np.testing.assert_allclose(found.factors.sum(axis=1), logs, atol=1e-6)
    assert found.total == pytest.approx(logs.mean(), abs=1e-6)
