"""Which function draws which result: all that `Result.plot` knows of pictures."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOTS: Final = {
    "Basins": "chaos.basins.plot",
    "Bifurcation": "chaos.bifurcation.plot",
    "BifurcationCurve": "chaos.curves.bifurcation_curve.plot",
    "Branch": "chaos.continuation.plot",
    "Branches": "chaos.continuation.plot",
    "CompensationTable": "control.compensation.plot",
    "CorrelationDimension": "chaos.correlation.plot",
    "DeadTime": "control.dead_time.plot",
    "DampingStudy": "printing.damping.plot",
    "Feedback": "control.feedback.plot",
    "Feedback.run": "control.feedback.plot_run",
    "FiniteTime": "chaos.finite_time.plot",
    "Fit": "fit.plot",
    "ImpactTime": "control.impact_time.plot",
    "ImpactTrain": "chaos.impact_train.plot",
    "Learning": "control.learning.plot",
    "LeastWork": "control.energy.plot",
    "LeastWorkRates": "control.energy.plot_rates",
    "Lyapunov": "chaos.lyapunov.plot",
    "LyapunovChart": "chaos.lyapunov.plot_chart",
    "Manifolds": "chaos.manifolds.plot",
    "Motion": "motion.plot",
    "Orbit": "chaos.orbits.plot_orbit",
    "Orbits": "chaos.orbits.plot",
    "Page": "printing.page.plot",
    "Quality": "printing.quality.plot",
    "QuenchMap": "chaos.quench.plot",
    "Recurrence": "chaos.recurrence.plot",
    "SafeRate": "printing.quality.plot_safe_rate",
    "Section": "chaos.sections.plot",
    "Sensitivities": "chaos.sensitivity.plot",
    "StabilityChart": "chaos.curves.stability_chart.plot",
    "Strobe": "chaos.strobe.plot",
    "TableReport": "control.compensation.plot_report",
    "ThermalDuty": "control.duty.plot",
    "ThermalLimit": "control.duty.plot_limit",
    "ToleranceYield": "printing.tolerance.plot",
    "ZeroOne": "chaos.lyapunov.plot_zero_one",
}
"""Module and function, by the name of the class of the result; a second picture has a name after a dot."""


def plot(result: object, picture: str = "", **options: Any) -> Figure:
    """Draw a result; `picture` names a second one, such as "run" for the entry "Feedback.run".

    Raises
    ------
    AttributeError
        There is no such picture of results of that class.
    """
    name = ".".join(filter(None, (type(result).__name__, picture)))
    if name not in PLOTS:
        raise AttributeError(f"no picture of {name} is known")
    module, _, function = PLOTS[name].rpartition(".")
    drawn: Figure = getattr(import_module(f"{__package__}.{module}"), function)(result, **options)
    return drawn
