"""Cycles of a ball that comes to rest on its table: each rest erases the past, so that cycles repeat."""

import math

import numpy as np
import pytest

import printhammer as ph
from printhammer.chaos.strobe.points import strobes
from printhammer.run.regime import Regime

BALL = ph.load("tufillaro-1992")
FREQUENCY, RESTITUTION = 60.0, 0.5
OMEGA, GRAVITY = 2.0 * math.pi * FREQUENCY, 9.80665


def force(centimetres: float) -> float:
    """Amplitude of the force, N, in the frame of a table with this amplitude."""
    return BALL.mass * 0.01 * centimetres * OMEGA**2


def cycle(centimetres: float, restitution: float = RESTITUTION) -> int:
    """Return the periods of the table between two take-offs of the ball from rest, flight by flight."""
    height = 0.01 * centimetres

    def rises(t: float, t0: float, v0: float) -> float:
        """Return the height above the table of a ball that leaves it at t0 with the relative speed v0."""
        u = v0 + height * OMEGA * math.cos(OMEGA * t0)
        y = height * (math.sin(OMEGA * t0) - math.sin(OMEGA * t)) + u * (t - t0)
        return y - 0.5 * GRAVITY * (t - t0) ** 2

    def pushed(t: float) -> bool:
        """Return whether the ball is pressed against the table."""
        return height * OMEGA**2 * math.sin(OMEGA * t) < GRAVITY

    leaves = math.asin(GRAVITY / (height * OMEGA**2)) / OMEGA
    # Flights from rest begin with the third derivative alone: a first step takes the ball off the table.
    t, v = leaves, 0.0
    for _ in range(2000):
        step = 1e-5 / FREQUENCY if v > 1e-3 else 1e-3 / FREQUENCY if t == leaves else 1e-2 * v / GRAVITY
        low = t + step
        while rises(low, t, v) <= 0.0 and low < t + 1.0 / FREQUENCY:
            low += step
        high = low + 1e-3 / FREQUENCY if v > 1e-3 or t == leaves else low + step
        while rises(high, t, v) > 0.0:
            low, high = high, high + (high - low)
        while low < (middle := 0.5 * (low + high)) < high:
            low, high = (middle, high) if rises(middle, t, v) > 0.0 else (low, middle)
        u = v + height * OMEGA * math.cos(OMEGA * t) - GRAVITY * (high - t)
        arrives = u - height * OMEGA * math.cos(OMEGA * high)
        t, v = high, -restitution * arrives
        if v < 1e-10 and pushed(t):
            waits = (leaves - t) % (1.0 / FREQUENCY)
            return round((t + waits - leaves) * FREQUENCY)
    return 0


@pytest.mark.parametrize(("centimetres", "periods"), [(0.0115, 14), (0.0113, 3), (0.01145, 11), (0.0119, 10)])
def test_a_sticking_cycle_is_found_whatever_the_number_of_firings(centimetres: float, periods: int) -> None:
    assert cycle(centimetres) == periods
    for firings, transient in ((400, 250), (1300, 1150)):
        diagram = ph.bifurcation(
            BALL,
            parameter="drive.amplitude",
            values=np.array([force(centimetres)]),
            drive=ph.SineForce(force(centimetres), FREQUENCY),
            firings=firings,
            transient=transient,
            refine=0,
        )
        assert diagram.cycles.tolist() == [[periods]]


def test_basins_of_a_sticking_cycle_beside_a_bouncing_one() -> None:
    found = ph.basins(BALL, drive=ph.SineForce(force(0.0115), FREQUENCY), x=(1e-6, 6e-4, 8), v=(-0.1, 0.1, 8))
    assert [attractor.name for attractor in found.attractors] == ["period-2", "period-14"]
    assert found.counts[0] == 0


def test_a_cycle_longer_than_64_that_comes_to_rest_is_superstable() -> None:
    acceleration = 18.72
    assert cycle(100.0 * acceleration / OMEGA**2, 0.63) > 64
    regime = Regime.of(
        BALL.replace("backstop.restitution", 0.63), drive=ph.SineForce(BALL.mass * acceleration, FREQUENCY)
    )
    (points,) = strobes(regime, points=1, firings=(201, 800))
    judged = points.verdict
    assert judged is not None
    assert (judged.name, judged.period, judged.exponent) == ("superstable", None, -math.inf)
    assert judged.rests >= 2
    assert judged.reason == ""
    assert "inf" not in judged.evidence


def test_a_period_that_hangs_on_the_last_bits_says_so() -> None:
    # The first cycle changes with the tolerance; the second one is the same at any.
    amplitudes = 0.01600361819149, force(0.0115)
    diagram = ph.bifurcation(
        BALL,
        parameter="drive.amplitude",
        values=np.array(amplitudes),
        drive=ph.SineForce(amplitudes[0], FREQUENCY),
        firings=350,
        refine=0,
        tolerance=1e-9,
    )
    assert diagram.cycles[0, 1] == 14
    assert diagram.sensitive.tolist() == [[True, False]]
    regime = Regime.of(BALL, drive=ph.SineForce(amplitudes[1], FREQUENCY))
    (points,) = strobes(regime, points=1, firings=(201, 300), every_exponent=True)
    assert points.verdict is not None
    assert not points.verdict.hangs_on_rounding
    assert [name for _tolerance, name in points.verdict.elsewhere] == ["period-14"] * 2
