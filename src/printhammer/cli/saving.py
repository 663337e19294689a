"""Writers of results whose classes have no method `save` yet."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

_WRITERS: Final = {
    "Strobe": "chaos.tables:save_strobe",
    "Orbits": "chaos.orbit_tables:save_orbits",
    "LyapunovChart": "chaos.lyapunov_tables:save_lyapunov",
    "Branches": "chaos.continuation_tables:save_branches",
    "Bifurcation": "chaos.bifurcation_tables:save_bifurcation",
    "Basins": "chaos.basins_tables:save_basins",
    "QuenchMap": "chaos.quench_tables:save_quench",
    "LeastWork": "control.least_work_tables:save_least_work",
    "Feedback": "control.feedback_tables:save_feedback",
    "Page": "printing.page_tables:save_page",
    "Quality": "printing.quality_tables:save_result",
    "SafeRate": "printing.quality_tables:save_result",
    "ToleranceYield": "printing.quality_tables:save_result",
    "DampingStudy": "printing.quality_tables:save_result",
}


def writer(result: Any) -> Callable[[Path], Any]:
    """Return what writes a result: its own `save`, a function beside its class, or NetCDF of its Dataset."""
    if hasattr(result, "save"):
        save: Callable[[Path], Any] = result.save
        return save
    module, _, name = _WRITERS.get(type(result).__name__, "").partition(":")
    if module:
        return partial(getattr(import_module(f"printhammer.{module}"), name), result)
    from printhammer.support.outputs import write_dataset

    return lambda path: write_dataset(path, result.to_dataset())
