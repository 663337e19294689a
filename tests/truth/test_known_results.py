"""Oscillators of the literature: published values and closed forms."""

import importlib
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.hammers import PACKS, STOP, compare, drives, interpreted, made_of, rigid
from tests.oracle.den_hartog import DenHartog
from tests.oracle.two_stops import TwoStops
from tests.truth.impact_orbits import BouncingBall, DampedImpacts

import printhammer as ph
from printhammer.chaos import orbit
from printhammer.parts.damping import ViscousDamping
from printhammer.parts.spring.cubic import CubicSpring
from printhammer.run.regime import Regime

MEASURE = Path(__file__).parents[2] / "docs" / "measure"


def cases() -> list[Any]:
    sys.path.insert(0, str(MEASURE))
    try:
        return list(importlib.import_module("known_results").CASES)
    finally:
        sys.path.remove(str(MEASURE))


# Means over tens of thousands of periods take a while.
CASES = [
    pytest.param(
        case, id=f"{case.hammer}: {case.what}", marks=[pytest.mark.slow] * (case.hammer == "duffing-holmes")
    )
    for case in cases()
]
RESONANT = DampedImpacts(omega=0.95001, stop=-1.0, restitution=0.9, damping=0.04, n=2)
CLOSED_FORMS = {
    ("resonant-grazing", "w = 0.81", "doubling"): (DampedImpacts(0.81, -1.0, 0.9, 0.04, 2), -1.0, 5e-3, 7e-3),
    ("resonant-grazing", "w = 0.95001", "doubling"): (RESONANT, -1.0, 2.9, 3.1),
    ("resonant-grazing", "w = 0.799", "fold"): (DampedImpacts(0.799, -1.0, 0.9, 0.04, 2), 1.0, -1e-3, -9e-4),
    ("shaw-holmes-1983", "w = 2.2", "doubling"): (DampedImpacts(2.2, -0.1, 0.8, 0.1), -1.0, 0.0105, 0.0112),
    ("shaw-holmes-1983", "w = 2.6", "doubling"): (
        DampedImpacts(2.6, -0.1, 0.8, 0.1, 2),
        -1.0,
        -0.139,
        -0.137,
    ),
    ("shaw-holmes-1983", "w = 2.6", "fold"): (DampedImpacts(2.6, -0.1, 0.8, 0.1, 2), 1.0, -0.0985, -0.097),
}


def known(hammer: str, *words: str) -> float:
    """Return the value in the table for a hammer."""
    (case,) = [case for case in cases() if case.hammer == hammer and all(word in case.what for word in words)]
    return float(case.expected)


@pytest.mark.parametrize("case", CASES)
def test_what_is_known_is_what_the_program_computes(case: Any) -> None:
    assert case.compute() == pytest.approx(float(case.expected), rel=0.0, abs=case.tolerance)


@pytest.mark.parametrize("words", CLOSED_FORMS, ids=" ".join)
def test_branch_points_with_damping_are_those_of_the_closed_form(words: tuple[str, str, str]) -> None:
    case, multiplier, low, high = CLOSED_FORMS[words]
    a, force = case.branch_point(multiplier, low, high)
    assert case.possible(a)
    assert known(*words) == pytest.approx(force, abs=1e-12)


def test_other_closed_forms_of_the_table() -> None:
    assert known("resonant-grazing", "product") == pytest.approx(RESONANT.product, abs=1e-12)
    grazes = math.hypot(1.0 - 0.81**2, 0.04 * 0.81)
    assert known("resonant-grazing", "grazing") == pytest.approx(grazes, abs=1e-12)
    # The doubling of the orbit with one impact a period, at standard gravity.
    ball = BouncingBall(9.80665, 0.5, 60.0)
    amplitude = 100.0 * ball.doubling * ball.gravity / ball.omega**2
    assert known("tufillaro-1992", "doubling 1") == pytest.approx(amplitude, abs=5e-9)
    assert known("housner-1963", "first impact") == pytest.approx(math.acosh(1.0 / (1.0 - 0.6)), abs=1e-12)
    for impacts in (1, 2, 5):
        angle = 1.0 - math.sqrt(1.0 - 0.81**impacts * (1.0 - 0.4**2))
        assert known("housner-1963", f"after {impacts} ") == pytest.approx(angle, abs=1e-12)


def test_closed_forms_of_the_table_for_dry_friction() -> None:
    friction = 0.3
    for omega in (0.7, 1.4):
        x0, _phase = DenHartog(omega, friction).motion(0.5)
        assert known("den-hartog-1931", f"w = {omega}, F", "amplitude") == pytest.approx(x0, abs=1e-12)
    for omega in (0.42, 0.7, 1.4):
        boundary = DenHartog(omega, friction).boundary
        assert known("den-hartog-1931", f"w = {omega}: F", "sticks") == pytest.approx(boundary, abs=1e-12)
    exact = DenHartog(0.7, friction)
    # At a turn the other forces are x0 w^2; they must exceed the static friction (Shaw 1986).
    boundary = math.hypot(0.45 / 0.49, friction * exact.big_u) / abs(exact.big_v)
    assert known("den-hartog-1931", "static") == pytest.approx(boundary, abs=1e-12)
    # Every reversal multiplies the velocity by the ratio of the accelerations after and before.
    turn = 0.49 * exact.motion(0.5)[0]
    product = ((turn - friction) / (turn + friction)) ** 2
    assert known("den-hartog-1931", "product") == pytest.approx(product, abs=1e-12)
    # Half a swing about the displacement 0.3, and half a swing about -0.3.
    assert known("den-hartog-1931", "rest") == pytest.approx(1.0 - 4.0 * friction, abs=1e-12)


def test_closed_forms_of_the_table_for_two_stops() -> None:
    pair, e = ph.load("impact-pair"), 0.5
    assert pair.pack.restitution == pair.backstop.restitution == e
    exact = TwoStops(0.0, 0.0, 0.5, 1.0, e)
    assert known("impact-pair", "fold") == pytest.approx(exact.fold, abs=1e-12)
    assert known("impact-pair", "pitchfork") == pytest.approx(exact.pitchfork, abs=1e-12)
    # The impact pair has explicit formulas, which the note of its file states.
    kappa = 0.5 * math.pi * (1.0 + e) / (1.0 - e)
    c = 4.0 * kappa / math.pi**2
    assert exact.fold == pytest.approx(1.0 / math.hypot(1.0, kappa), rel=1e-14)
    assert exact.pitchfork == pytest.approx(math.hypot(1.0, c) / (kappa - c), rel=1e-14)
    assert known("impact-pair", "product") == pytest.approx(e**4, abs=1e-12)
    for omega in (1.5, 2.6):
        exact = TwoStops(1.0, 0.1, 1.0, omega, 0.8)
        assert known("shaw-1985", f"w = {omega}", "fold") == pytest.approx(exact.fold, abs=1e-12)
        assert known("shaw-1985", f"w = {omega}", "pitchfork") == pytest.approx(exact.pitchfork, abs=1e-12)
    exact = TwoStops(1.0, 0.1, 1.93013, 1.5, 0.8)
    assert known("shaw-1985", "grazing") == pytest.approx(exact.grazing, abs=1e-12)
    product = np.prod(exact.multipliers(*exact.orbits()[0]) ** 2).real
    assert product == pytest.approx(0.8**4 * math.exp(-0.1 * 2.0 * math.pi / 1.5), rel=1e-12)
    assert known("shaw-1985", "product") == pytest.approx(product, abs=1e-12)


@pytest.mark.parametrize("a", [2.7, 2.9, 3.0488, 3.4])
def test_orbits_and_multipliers_with_damping(a: float) -> None:
    """The armature is slowed by the damping before an impact and after it, at another speed."""
    force, angle, _ = RESONANT.orbit(a)
    state = RESONANT.state(a, 0.5 * RESONANT.period / RESONANT.n)
    phase = (angle + math.pi) / (2.0 * math.pi) % 1.0
    drive = ph.SineForce(force, RESONANT.omega / (2.0 * math.pi), phase="90 deg")
    regime = Regime.of(ph.load("resonant-grazing"), drive=drive, phase=phase)
    found = orbit(regime, (state[0] + 1.001, state[1] - 1e-3), firings=2)
    assert found.ok
    np.testing.assert_allclose(found.section, (state[0] + 1.0, state[1]), rtol=0.0, atol=1e-10)
    assert found.multipliers.sum().real == pytest.approx(RESONANT.trace(a), abs=1e-9)
    assert found.multipliers.prod().real == pytest.approx(RESONANT.product, abs=1e-10)


def test_the_closed_form_without_damping_is_the_other_one() -> None:
    from tests.truth.impact_orbits import LinearImpacts

    plain, damped = LinearImpacts(2.2, -0.1, 0.8), DampedImpacts(2.2, -0.1, 0.8, 0.0)
    assert damped.branch_point(-1.0, 0.01, 0.02)[1] == pytest.approx(plain.doubling[0], rel=1e-12)


def test_a_cubic_spring_against_the_reference() -> None:
    """Two wells, both contacts, damping, and a constant force."""
    spring = CubicSpring(stiffness=-2e4, cubic=4e12, center=STOP + 70e-6)
    hammer = made_of(
        spring=spring, pack=PACKS["power"], backstop=rigid(0.6), damping=ViscousDamping(coefficient=0.2)
    )
    with interpreted():
        found = compare(hammer, drives("force")["train"], 2.4e-3, state=(STOP + 20e-6, -0.4), sensitive=True)
    assert found.motion.ok
    assert found.error < 1e-8
    for surface in ("pack", "backstop"):
        mine, theirs = found.touches(surface)
        assert mine
        assert len(mine) == len(theirs)
    energy = found.motion.energy
    assert abs(energy.residual) < 1e-8 * energy.throughput


@pytest.mark.slow
def test_the_exponent_of_duffings_equation_by_another_way() -> None:
    """Many trains in parallel, by the classical Runge-Kutta method: mean growth of a perturbation."""
    rng = np.random.default_rng(3)
    trains, periods, left_out, steps = 1000, 250, 50, 100
    y = np.stack([*rng.uniform(-1.0, 1.0, (2, trains)), np.ones(trains), np.zeros(trains)])

    def slope(t: float, y: np.ndarray) -> np.ndarray:
        x, v, dx, dv = y
        force = 0.3 * math.cos(t) + x - x**3 - 0.2 * v
        return np.stack([v, force, dv, (1.0 - 3.0 * x * x) * dx - 0.2 * dv])

    h, growth = 2.0 * math.pi / steps, []
    for _ in range(periods):
        for i in range(steps):
            t = i * h
            k1 = slope(t, y)
            k2 = slope(t + 0.5 * h, y + 0.5 * h * k1)
            k3 = slope(t + 0.5 * h, y + 0.5 * h * k2)
            y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + slope(t + h, y + h * k3))
        size = np.hypot(y[2], y[3])
        growth.append(np.log(size))
        y[2:] /= size
    means = np.array(growth[left_out:]).mean(axis=0) / (2.0 * math.pi)
    mean, error = means.mean(), means.std() / math.sqrt(trains)
    drive = ph.SineForce(0.3, 1.0 / (2.0 * math.pi), phase="90 deg")
    mine = ph.lyapunov(
        ph.load("duffing-holmes"), drive=drive, state=(0.1, 0.1), firings=50_000, transient=500
    )
    wide = math.hypot(error, mine.standard_errors[0] / (2.0 * math.pi))
    assert mine.per_second[0] == pytest.approx(mean, abs=4.0 * wide)
    assert wide < 1e-3
