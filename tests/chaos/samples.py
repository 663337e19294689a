"""One small result of every class of `printhammer.chaos` and `printhammer.derivatives`, by class name."""

from collections.abc import Callable
from functools import cache

import numpy as np

import printhammer as ph
from printhammer.chaos import Branch, Branches, Orbits, lyapunovs, orbit, strobe
from printhammer.derivatives.sensitivities import Sensitivities
from printhammer.results import Result
from printhammer.run.regime import Regime

PERIOD = 1.3e-3


@cache
def orbits(hammer: ph.Hammer) -> Orbits:
    return ph.orbits(hammer, period=PERIOD, longest=2, starts=100, guesses=8, follow=0)


@cache
def branch(hammer: ph.Hammer) -> Branch:
    return ph.continuation(hammer, "period", (2.95e-3, 3.05e-3), period=3e-3, most=4)


def damping(hammer: ph.Hammer) -> Result:
    own = hammer.constants["backstop.damping"].si
    bounds = (0.95 * own, 1.05 * own)
    return ph.stability_chart(branch(hammer), "backstop.damping", bounds, grid=(2, 3), most=2)


def curve(hammer: ph.Hammer) -> Result:
    wide = ph.continuation(hammer, "period", (1.24e-3, 1.26e-3), period=1.25e-3, most=10)
    own = hammer.constants["backstop.damping"].si
    return ph.bifurcation_curve(wide, "backstop.damping", (0.99 * own, 1.01 * own), grid=(2, 3), most=2)


def sensitivities(hammer: ph.Hammer) -> Sensitivities:
    drive = ph.PulseTrain(hammer.waveform)
    return ph.sensitivities(hammer, drive, constants=["mass", "pack.stiffness"])


def manifolds_of_duffing() -> Result:
    force = ph.SineForce(0.3, 1.0 / (2.0 * np.pi), phase="90 deg")
    saddle = orbit(Regime.of(ph.load("duffing-holmes"), drive=force), (-0.15, 0.015))
    return ph.manifolds(saddle, length=0.05)


CHAOS: dict[str, Callable[[ph.Hammer], Result]] = {
    "Basins": lambda hammer: ph.basins(
        hammer, period=PERIOD, x=(30e-6, 80e-6, 3), v=(-0.2, 0.2, 2), firings=40, rounds=1
    ),
    "Bifurcation": lambda hammer: ph.bifurcation(
        hammer, periods=[1.2e-3, PERIOD], firings=20, transient=10, direction="both", refine=0
    ),
    "BifurcationCurve": curve,
    "Branch": branch,
    "Branches": lambda hammer: Branches((branch(hammer),)),
    "CorrelationDimension": lambda _hammer: ph.correlation_dimension(np.sqrt(2.0) * np.arange(400.0) % 1.0),
    "FiniteTime": lambda hammer: ph.finite_time(
        ph.lyapunov(hammer, period=PERIOD, firings=20, transient=2), lengths=(1, 2)
    ),
    "ImpactTrain": lambda hammer: ph.impact_train(ph.section(hammer, period=PERIOD, touches=12)),
    "Lyapunov": lambda hammer: ph.lyapunov(hammer, period=PERIOD, firings=20, transient=2),
    "LyapunovChart": lambda hammer: lyapunovs(hammer, [1.2e-3, PERIOD], firings=10, transient=0),
    "Manifolds": lambda _hammer: manifolds_of_duffing(),
    "Orbit": lambda hammer: orbits(hammer)[0],
    "Orbits": orbits,
    "QuenchMap": lambda hammer: ph.quench_map(
        hammer, gaps=("650 us", "710 us", 2), widths=("300 us", "400 us", 3)
    ),
    "Recurrence": lambda _hammer: ph.recurrence(np.arange(12.0) % 3.0),
    "Section": lambda hammer: ph.section(hammer, period=PERIOD, touches=5),
    "Sensitivities": sensitivities,
    "Spread": lambda hammer: sensitivities(hammer).spread({"mass": 0.01}),
    "StabilityChart": damping,
    "Strobe": lambda hammer: strobe(hammer, period=PERIOD, points=5, verdict=False),
    "ZeroOne": lambda _hammer: ph.zero_one(np.sin(np.arange(100.0)), angles=5),
}
