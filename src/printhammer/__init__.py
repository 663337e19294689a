"""A laboratory for impact print hammers.

Give it a hammer, described by constants that can be measured, and a drive, and it tells how the hammer moves,
what it prints and when it turns chaotic. Inside, every quantity is in SI.

The public names are imported on first use, so that importing the package costs nothing.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from printhammer.chaos.basins.basins import basins
    from printhammer.chaos.basins.quench import quench_map
    from printhammer.chaos.bifurcation.bifurcation import bifurcation
    from printhammer.chaos.continuation.continuation import continuation
    from printhammer.chaos.continuation.regimes import regimes
    from printhammer.chaos.continuation.stability_chart import stability_chart
    from printhammer.chaos.exponents.lyapunov import lyapunov
    from printhammer.chaos.exponents.recurrence import recurrence
    from printhammer.chaos.exponents.zero_one import zero_one
    from printhammer.chaos.impacts.sections import section
    from printhammer.chaos.impacts.train import impact_train
    from printhammer.chaos.orbits.search import orbits
    from printhammer.chaos.strobe.points import strobe
    from printhammer.control.feedback import feedback
    from printhammer.control.least_work import least_work
    from printhammer.control.table import CompensationTable
    from printhammer.control.table_files import load_table
    from printhammer.control.table_report import judge_table
    from printhammer.control.table_tuning import tune
    from printhammer.derivatives.sensitivities import sensitivities
    from printhammer.drive.sequence import PulseSequence
    from printhammer.drive.trains import Burst, PulseTrain, SineForce
    from printhammer.drive.waveforms.shapes import Chain, Waveform
    from printhammer.errors import InputError, PrinthammerError
    from printhammer.hammer.equilibrium import equilibria, holding_margin, release_current, rest_state
    from printhammer.hammer.hammer import Hammer, load
    from printhammer.identify.bench.laboratory import measure
    from printhammer.identify.fitting import fit
    from printhammer.maps.frequency import frequency_map
    from printhammer.printing.damping import damping_study
    from printhammer.printing.limits import Limits
    from printhammer.printing.materials import Material
    from printhammer.printing.page import print_page
    from printhammer.printing.pattern import Pattern
    from printhammer.printing.perturbation import Perturbation, perturbed
    from printhammer.printing.quality import quality
    from printhammer.printing.safe_rate import safe_rate
    from printhammer.printing.tolerance import tolerance_yield
    from printhammer.run.ensemble import Ensemble, EnsembleResult
    from printhammer.run.motion import Motion
    from printhammer.run.regime import Regime
    from printhammer.run.simulate import simulate
    from printhammer.sweep import sweep

__version__ = "0.1.0"

__all__ = [
    "Burst",
    "Chain",
    "CompensationTable",
    "Ensemble",
    "EnsembleResult",
    "Hammer",
    "InputError",
    "Limits",
    "Material",
    "Motion",
    "Pattern",
    "Perturbation",
    "PrinthammerError",
    "PulseSequence",
    "PulseTrain",
    "Regime",
    "SineForce",
    "Waveform",
    "__version__",
    "basins",
    "bifurcation",
    "continuation",
    "damping_study",
    "equilibria",
    "feedback",
    "fit",
    "frequency_map",
    "holding_margin",
    "impact_train",
    "judge_table",
    "least_work",
    "load",
    "load_table",
    "lyapunov",
    "measure",
    "orbits",
    "perturbed",
    "print_page",
    "quality",
    "quench_map",
    "recurrence",
    "regimes",
    "release_current",
    "rest_state",
    "safe_rate",
    "section",
    "sensitivities",
    "simulate",
    "stability_chart",
    "strobe",
    "sweep",
    "tolerance_yield",
    "tune",
    "zero_one",
]

_HOME = {
    "Burst": "drive",
    "Chain": "waveforms",
    "CompensationTable": "control.table",
    "Ensemble": "ensemble",
    "EnsembleResult": "ensemble",
    "Hammer": "hammer",
    "InputError": "errors",
    "Limits": "printing.limits",
    "Material": "printing.materials",
    "Motion": "motion",
    "Pattern": "printing.pattern",
    "Perturbation": "printing.perturbation",
    "PrinthammerError": "errors",
    "PulseSequence": "drive_sequence",
    "PulseTrain": "drive",
    "Regime": "run.regime",
    "SineForce": "drive",
    "Waveform": "waveforms",
    "basins": "chaos.basins.basins",
    "bifurcation": "chaos.bifurcation.bifurcation",
    "continuation": "chaos.continuation.continuation",
    "damping_study": "printing.damping",
    "equilibria": "equilibrium",
    "feedback": "control.feedback",
    "fit": "identify.fitting",
    "frequency_map": "maps",
    "holding_margin": "equilibrium",
    "impact_train": "chaos.impacts.train",
    "judge_table": "control.table_report",
    "least_work": "control.least_work",
    "load": "hammer",
    "load_table": "control.table_files",
    "lyapunov": "chaos.exponents.lyapunov",
    "measure": "identify.laboratory",
    "orbits": "chaos.orbits.search",
    "perturbed": "printing.perturbation",
    "print_page": "printing.page",
    "quality": "printing.quality",
    "quench_map": "chaos.basins.quench",
    "recurrence": "chaos.exponents.recurrence",
    "regimes": "chaos.continuation.regimes",
    "release_current": "equilibrium",
    "rest_state": "equilibrium",
    "safe_rate": "printing.safe_rate",
    "section": "chaos.impacts.sections",
    "sensitivities": "derivatives.sensitivities",
    "simulate": "simulate",
    "stability_chart": "chaos.continuation.stability_chart",
    "strobe": "chaos.strobe.points",
    "sweep": "sweep",
    "tolerance_yield": "printing.tolerance",
    "tune": "control.table_tuning",
    "zero_one": "chaos.exponents.zero_one",
}


class _Package(ModuleType):
    def __setattr__(self, name: str, value: object) -> None:
        # Importing the module `simulate` must not hide the function of that name.
        if isinstance(value, ModuleType) and _HOME.get(name) == name:
            value = getattr(value, name)
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


if not TYPE_CHECKING:  # a type checker would take every name for granted

    def __getattr__(name: str) -> object:
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
