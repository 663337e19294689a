"""Bifurcation diagrams and basins of a bouncing ball on a vibrating table, whose orbits are known.

In the table's frame the ball feels m (A w^2 sin(w t) - g); Gamma = A w^2 / g. Three attractors are known in
closed form: for Gamma < 1 the ball may lie on the table; and an orbit with one impact in n periods T of the
table is stable from Gamma = n pi (1 - e) / (1 + e), where it appears, up to where it doubles its period,

    Gamma^2 = (n pi (1 - e) / (1 + e))^2 + (2 (1 + e^2) / (1 + e)^2)^2

(P. J. Holmes, J. Sound Vib. 84 (1982) 173, without his approximation of high flights, derived anew: the
table is at the same height at every impact, the ball leaves it with g n T / 2 in the frame of the ground and
arrives with minus that, and the law of impact fixes the phase p by Gamma cos p = n pi (1 - e) / (1 + e)).
"""

import math

import numpy as np
import pytest

import printhammer as ph
from printhammer.chaos import orbit, strobes
from printhammer.chaos.bifurcation.diagram import hysteresis
from printhammer.run.regime import Regime

GRAVITY, RESTITUTION, FREQUENCY, MASS = 9.80665, 0.8, 50.0, 1e-3
OMEGA, PERIOD = 2.0 * math.pi * FREQUENCY, 1.0 / FREQUENCY
LOSS = math.pi * (1.0 - RESTITUTION) / (1.0 + RESTITUTION)
DOUBLING = 2.0 * (1.0 + RESTITUTION**2) / (1.0 + RESTITUTION) ** 2
WEIGHT = MASS * GRAVITY


def fold(n: int) -> float:
    return n * LOSS


def doubling(n: int) -> float:
    return math.hypot(n * LOSS, DOUBLING)


def state(gamma: float, n: int, turn: int = 0) -> tuple[float, float]:
    """Height above the table and its rate at t = 0, `turn` periods after the last time that p was passed."""
    phase = math.acos(n * LOSS / gamma)
    height = gamma * GRAVITY / OMEGA**2
    # The last impact was at the phase p, before t = 0.
    since = (turn + 1) * PERIOD - phase / OMEGA
    up = 0.5 * GRAVITY * n * PERIOD
    y = height * math.sin(phase) + up * since - 0.5 * GRAVITY * since**2
    return y, up - GRAVITY * since - height * OMEGA


@pytest.fixture(scope="module")
def ball() -> "ph.Hammer":
    return ph.Hammer.build(
        MASS,
        name="ball on a table",
        spring={"law": "preload", "preload": f"{-1e3 * WEIGHT!r} mN", "stiffness": "0 N/m"},
        backstop={"law": "rigid", "position": "0 m", "restitution": RESTITUTION},
    )


def shaken(gamma: float) -> "ph.SineForce":
    return ph.SineForce(gamma * WEIGHT, FREQUENCY)


def test_rising_and_falling_values_show_the_hysteresis_of_the_closed_forms(ball: "ph.Hammer") -> None:
    gammas = np.array([0.3, 0.32, 0.37, 0.5, 0.7, 0.9, 0.98])
    assert 0.32 < fold(1) < 0.37
    options = {
        "parameter": "drive.amplitude",
        "values": gammas * WEIGHT,
        "drive": shaken(0.98),
        "refine": 0,
        "firings": 400,
        "transient": 300,
        "tolerance": 1e-11,
    }
    up = ph.bifurcation(ball, direction="up", state=(0.0, 0.0), **options)
    # A ball that lies on the table stays there up to Gamma = 1.
    assert (up.cycles == 1).all()
    assert (up.x == 0.0).all()
    down = ph.bifurcation(ball, direction="down", state=state(0.98, 1), **options)
    assert (down.cycles == 1).all()
    assert (down.x[0, :2] == 0.0).all()
    for k in range(2, len(gammas)):
        x, v = state(gammas[k], 1)
        np.testing.assert_allclose(down.x[0, k, -1], x, rtol=1e-6)
        np.testing.assert_allclose(down.v[0, k, -1], v, rtol=1e-6)
    assert not hysteresis(up).any()


def test_the_period_doubles_where_the_closed_form_says(ball: "ph.Hammer") -> None:
    where = doubling(1)
    found = ph.bifurcation(
        ball,
        parameter="drive.amplitude",
        values=np.array([where - 0.005, where + 0.005]) * WEIGHT,
        drive=shaken(1.0),
        direction="up",
        state=state(where - 0.005, 1),
        refine=3,
        firings=2000,
        transient=1800,
        tolerance=1e-11,
    )
    values = found.values / WEIGHT
    assert found.cycles[0, values < where - 1e-3].tolist() == [1] * int((values < where - 1e-3).sum())
    assert found.cycles[0, values > where + 1e-3].tolist() == [2] * int((values > where + 1e-3).sum())
    first, second = found.windows()[0], found.windows()[-1]
    assert (first.period, second.period) == (1, 2)
    # The last step was halved three times.
    assert abs(0.5 * (first.high + second.low) / WEIGHT - where) <= 0.01 / 8.0 + 1e-3
    assert (found.levels > 0).sum() >= 3


def test_basins_hold_the_attractors_of_the_closed_forms(ball: "ph.Hammer") -> None:
    gamma = 0.8
    assert all(fold(n) < gamma < doubling(n) for n in (1, 2))
    ends = [state(gamma, 2, turn) for turn in (0, 1)]
    found = ph.basins(
        ball,
        drive=shaken(gamma),
        x=(0.0, 2.0 * max(x for x, _ in ends), 12),
        v=(-0.6, 0.6, 12),
        firings=300,
        rounds=6,
        tolerance=1e-11,
    )
    known = {
        "lies on the table": np.zeros((1, 2)),
        "one impact a period": np.array([state(gamma, 1)]),
        "one impact in two periods": np.array(ends),
    }
    counts = found.counts
    for name, states in known.items():
        fits = [
            k
            for k, attractor in enumerate(found.attractors, 1)
            if attractor.period == len(states)
            and np.abs(
                attractor.states[np.argsort(attractor.states[:, 0])] - states[np.argsort(states[:, 0])]
            ).max()
            < 1e-7
        ]
        assert len(fits) == 1, name
        assert counts[fits[0]] > 0, name
    # Every cell is accounted for, and what is not decided is counted as such.
    assert sum(counts.values()) == found.labels.size
    assert counts[0] == (found.labels == 0).sum()


def test_just_before_a_doubling_the_ball_still_bounces_once_a_period() -> None:
    # At 60 Hz and a restitution of 0.5 the orbit doubles at an amplitude of 0.01053531 cm.
    ball = ph.load("bouncing-ball").replace("backstop.restitution", 0.5)
    loss, omega = math.pi * 0.5 / 1.5, 2.0 * math.pi * 60.0
    gamma = 0.0105e-2 * omega**2 / GRAVITY
    assert math.hypot(loss, 2.0 * 1.25 / 1.5**2) * GRAVITY / omega**2 == pytest.approx(
        0.01053531e-2, rel=1e-6
    )
    table = ph.SineForce(1e-3 * GRAVITY * gamma, 60.0)
    found = ph.basins(ball, drive=table, x=(1e-6, 0.6e-3, 12), v=(-0.1, 0.1, 12))
    phase = math.acos(loss / gamma)
    since = (2.0 * math.pi - phase) / omega
    up = 0.5 * GRAVITY / 60.0
    x = gamma * GRAVITY / omega**2 * math.sin(phase) + up * since - 0.5 * GRAVITY * since**2
    # Beside the ball that bounces: one that lies on the table once a period, and one that never quite does.
    names = [attractor.name for attractor in found.attractors]
    assert names == ["period-1", "period-1", "period-2"]
    assert found.attractors[1].states[0, 0] == pytest.approx(x, abs=1e-9)
    assert found.counts[0] == 0
    regime = Regime.of(ball, drive=table)
    for attractor in found.attractors:
        closed = orbit(regime, attractor.states[0], firings=attractor.period)
        assert (closed.firings, closed.kind) == (attractor.period, "stable")


@pytest.mark.parametrize(
    ("amplitude", "period"), [(0.0113e-2, 3), pytest.param(0.0115e-2, 14, marks=pytest.mark.slow)]
)
def test_a_ball_that_comes_to_lie_on_the_table_repeats_itself(amplitude: float, period: int) -> None:
    # The rounding of the phase of the table, which grew with time, showed as a period of 28 or none at all.
    ball = ph.load("bouncing-ball").replace("backstop.restitution", 0.5)
    omega = 2.0 * math.pi * 60.0
    table = ph.SineForce(1e-3 * amplitude * omega**2, 60.0)
    (found,) = strobes(ball, drives=[table], points=1, firings=(901, 1100), every_exponent=True)
    assert found.verdict is not None
    assert found.verdict.name == f"period-{period}"
    assert found.verdict.distance < 1e-8
    # Once a cycle at least it lies on the table for a while, and forgets all that was before.
    assert found.verdict.exponent == -math.inf
