"""Nonsmooth dynamics of pulse trains: strobe maps, orbits, continuation, Lyapunov exponents, basins."""

from printhammer.chaos.basins.basins import BasinEntropy, Basins, basin_entropy, basins
from printhammer.chaos.basins.quench import QuenchMap, quench_map
from printhammer.chaos.bifurcation.bifurcation import bifurcation
from printhammer.chaos.bifurcation.diagram import Bifurcation
from printhammer.chaos.continuation.branch import Branch, BranchEvent
from printhammer.chaos.continuation.continuation import continuation
from printhammer.chaos.continuation.regimes import Branches, regimes
from printhammer.chaos.curves.bifurcation_curve import BifurcationCurve, bifurcation_curve
from printhammer.chaos.curves.codimension import CodimensionTwo
from printhammer.chaos.curves.stability_chart import StabilityChart, stability_chart
from printhammer.chaos.exponents.chart import FiniteTime, LyapunovChart, finite_time, lyapunovs
from printhammer.chaos.exponents.correlation import CorrelationDimension, correlation_dimension
from printhammer.chaos.exponents.lyapunov import Lyapunov, lyapunov
from printhammer.chaos.exponents.recurrence import Recurrence, recurrence
from printhammer.chaos.exponents.zero_one import ZeroOne, zero_one
from printhammer.chaos.impacts import ImpactTrain, Section, impact_train, section, sections
from printhammer.chaos.orbits.collection import Orbits
from printhammer.chaos.orbits.manifolds import Manifolds, manifolds
from printhammer.chaos.orbits.orbit import Orbit
from printhammer.chaos.orbits.search import orbit, orbits
from printhammer.chaos.strobe.points import Strobe, strobe, strobes
from printhammer.chaos.strobe.verdict import Verdict

__all__ = [
    "BasinEntropy",
    "Basins",
    "Bifurcation",
    "BifurcationCurve",
    "Branch",
    "BranchEvent",
    "Branches",
    "CodimensionTwo",
    "CorrelationDimension",
    "FiniteTime",
    "ImpactTrain",
    "Lyapunov",
    "LyapunovChart",
    "Manifolds",
    "Orbit",
    "Orbits",
    "QuenchMap",
    "Recurrence",
    "Section",
    "StabilityChart",
    "Strobe",
    "Verdict",
    "ZeroOne",
    "basin_entropy",
    "basins",
    "bifurcation",
    "bifurcation_curve",
    "continuation",
    "correlation_dimension",
    "finite_time",
    "impact_train",
    "lyapunov",
    "lyapunovs",
    "manifolds",
    "orbit",
    "orbits",
    "quench_map",
    "recurrence",
    "regimes",
    "section",
    "sections",
    "stability_chart",
    "strobe",
    "strobes",
    "zero_one",
]
