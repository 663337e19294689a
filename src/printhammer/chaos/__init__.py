"""Chaos: strobe points of trains, and what kind of motion they tell of."""

from printhammer.chaos.basins import Basins, basins
from printhammer.chaos.basins_entropy import BasinEntropy, basin_entropy
from printhammer.chaos.bifurcation import Bifurcation, bifurcation
from printhammer.chaos.continuation import continuation
from printhammer.chaos.continuation_branch import Branch
from printhammer.chaos.continuation_events import BranchEvent
from printhammer.chaos.continuation_regimes import Branches, regimes
from printhammer.chaos.impact_train import ImpactTrain, impact_train
from printhammer.chaos.lyapunov import Lyapunov, lyapunov
from printhammer.chaos.lyapunov_chart import LyapunovChart, lyapunovs
from printhammer.chaos.orbit_result import Orbit
from printhammer.chaos.orbit_search import Orbits, orbit, orbits
from printhammer.chaos.quench import QuenchMap, quench_map
from printhammer.chaos.recurrence import Recurrence, recurrence
from printhammer.chaos.regime import Regime
from printhammer.chaos.sections import Section, section, sections
from printhammer.chaos.sensitivity import Sensitivities, Spread, sensitivities
from printhammer.chaos.stability_chart import LossCurve, StabilityChart, stability_chart
from printhammer.chaos.strobe import Strobe, strobe, strobes
from printhammer.chaos.verdict import Verdict
from printhammer.chaos.zero_one import ZeroOne, zero_one

__all__ = [
    "BasinEntropy",
    "Basins",
    "Bifurcation",
    "Branch",
    "BranchEvent",
    "Branches",
    "ImpactTrain",
    "LossCurve",
    "Lyapunov",
    "LyapunovChart",
    "Orbit",
    "Orbits",
    "QuenchMap",
    "Recurrence",
    "Regime",
    "Section",
    "Sensitivities",
    "Spread",
    "StabilityChart",
    "Strobe",
    "Verdict",
    "ZeroOne",
    "basin_entropy",
    "basins",
    "bifurcation",
    "continuation",
    "impact_train",
    "lyapunov",
    "lyapunovs",
    "orbit",
    "orbits",
    "quench_map",
    "recurrence",
    "regimes",
    "section",
    "sections",
    "sensitivities",
    "stability_chart",
    "strobe",
    "strobes",
    "zero_one",
]
