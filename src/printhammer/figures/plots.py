"""Which function draws which result: all that `Result.plot` knows of pictures."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOTS: Final = {
    "Basins": "basins.plot",
    "Bifurcation": "bifurcation.plot",
    "Branch": "continuation.plot",
    "Branches": "continuation.plot",
    "CompensationTable": "tables.plot",
    "DampingStudy": "damping.plot",
    "Feedback": "feedback.plot",
    "Feedback.run": "feedback_run.plot",
    "Fit": "fit.plot",
    "ImpactTrain": "impact_train.plot",
    "LeastWork": "energy.plot",
    "LeastWorkRates": "energy_rates.plot",
    "Lyapunov": "lyapunov.plot",
    "LyapunovChart": "lyapunov.plot_chart",
    "Motion": "motion.plot",
    "Orbit": "orbits.plot_orbit",
    "Orbits": "orbits.plot",
    "Page": "page.plot",
    "Quality": "quality.plot",
    "QuenchMap": "quench.plot",
    "Recurrence": "recurrence.plot",
    "SafeRate": "quality.plot_safe_rate",
    "Section": "sections.plot",
    "Sensitivities": "sensitivity.plot",
    "StabilityChart": "stability_chart.plot",
    "Strobe": "strobe.plot",
    "TableReport": "tables.plot_report",
    "ToleranceYield": "tolerance.plot",
    "ZeroOne": "lyapunov.plot_zero_one",
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
    module, function = PLOTS[name].split(".")
    drawn: Figure = getattr(import_module(f"{__package__}.{module}"), function)(result, **options)
    return drawn
