"""Registry of the functions that draw results, used by `Result.plot`."""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any, Final

from matplotlib.figure import Figure

PLOTS: Final = {
    "Basins": "chaos.basins.plot",
    "Bifurcation": "chaos.bifurcation.plot",
    "BifurcationCurve": "chaos.curves.plot",
    "Branch": "chaos.continuation.plot",
    "Branches": "chaos.continuation.plot",
    "CompensationTable": "control.tables.plot",
    "CorrelationDimension": "chaos.exponents.plot_correlation",
    "DeadTime": "control.coil.plot_dead_time",
    "DampingStudy": "quality.plot_damping",
    "Feedback": "control.drives.plot",
    "Feedback.run": "control.drives.plot_run",
    "FiniteTime": "chaos.exponents.plot_finite_time",
    "Fit": "fit.plot",
    "ImpactTime": "control.coil.plot_impact_time",
    "ImpactTrain": "chaos.strobe.plot_train",
    "Learning": "control.tables.plot_learning",
    "LeastWork": "control.drives.plot_burst",
    "LeastWorkRates": "control.drives.plot_rates",
    "Lyapunov": "chaos.exponents.plot",
    "LyapunovChart": "chaos.exponents.plot_chart",
    "Manifolds": "chaos.basins.plot_manifolds",
    "Motion": "paper.motion.plot",
    "Motion.timings": "contacts.plot_timings",
    "Orbit": "chaos.orbits.plot_orbit",
    "Orbits": "chaos.orbits.plot",
    "Page": "page.plot",
    "Quality": "quality.plot",
    "QuenchMap": "chaos.basins.plot_quench",
    "Recurrence": "chaos.exponents.plot_recurrence",
    "SafeRate": "quality.plot_safe_rate",
    "Section": "chaos.strobe.plot_section",
    "Sensitivities": "chaos.sensitivity.plot",
    "StabilityChart": "chaos.curves.plot_chart",
    "Strobe": "chaos.strobe.plot",
    "TableReport": "control.tables.plot_report",
    "ThermalDuty": "control.coil.plot_duty",
    "ThermalLimit": "control.coil.plot_limit",
    "ToleranceYield": "quality.plot_tolerance",
    "ZeroOne": "chaos.exponents.plot_zero_one",
}
"""Drawing function by result class, as "module.function"; additional figures have keys "Class.figure"."""


def plot(result: object, picture: str = "", **options: Any) -> Figure:
    """Draw a result; `picture` selects an additional figure, such as "run" for the key "Feedback.run".

    Raises
    ------
    AttributeError
        The class of the result has no such figure.
    """
    name = ".".join(filter(None, (type(result).__name__, picture)))
    if name not in PLOTS:
        raise AttributeError(f"the result {name} has no figure")
    module, _, function = PLOTS[name].rpartition(".")
    drawn: Figure = getattr(import_module(f"{__package__}.{module}"), function)(result, **options)
    _attach(drawn)
    return drawn


def _attach(figure: Figure) -> None:
    """Register a figure with pyplot if pyplot is loaded and its backend opens windows.

    Otherwise the figure is not registered, since pyplot would keep it in memory until it is closed.
    """
    pyplot = sys.modules.get("matplotlib.pyplot")
    if pyplot is None:
        return
    from matplotlib import get_backend
    from matplotlib.backends.registry import BackendFilter, backend_registry

    registry: Any = backend_registry  # matplotlib declares no types here
    if get_backend().lower() in registry.list_builtin(BackendFilter.INTERACTIVE):
        pyplot.figure(figure)
