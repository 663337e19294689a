"""SciPy's `solve_ivp`, with one right-hand side for all modes and split at events.

Naive: the solver integrates one right-hand side that contains all switches. Expert: runs are split at events.
"""

from __future__ import annotations

import warnings
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.solvers.entry import Entry
from benchmarks.solvers.problem import FIRST, GRID

from .equations import (
    BACKSTOP,
    FREE,
    LOADING,
    UNLOADING,
    compiled_acceleration,
    current_pieces,
    hammer_constants,
)
from .events import Stretch, event_split

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray


def entries(task: Task, quick: bool) -> list[Entry]:  # noqa: ARG001
    """Return the benchmark entries of SciPy: naive runs, and runs split at events."""
    import scipy

    found = []
    for method, rtol, atol in (("RK45", 1e-11, 1e-15), ("Radau", 1e-6, 1e-10), ("LSODA", 1e-8, 1e-12)):
        run = partial(naive, task, FIRST, GRID, method=method, rtol=rtol, atol=atol)
        name = f"SciPy {scipy.__version__} {method}, one right-hand side, {rtol:.0e}"
        found.append(Entry(name, run, run, FIRST))
    for rtol in (1e-8, 1e-11):
        run = partial(event_split, task, FIRST, GRID, partial(_dop853, rtol))
        name = f"SciPy {scipy.__version__} DOP853, its events, {rtol:.0e}"
        found.append(Entry(name, run, run, FIRST))
    return found


def naive(task: Task, end: float, grid: FloatArray, **options: Any) -> FloatArray:
    """Integrate one right-hand side that contains all contacts and pulses; return x on the grid, m."""
    from scipy.integrate import solve_ivp

    c = hammer_constants(task)
    acceleration = compiled_acceleration()
    pieces = current_pieces(task, end)
    peak = 0.0

    def rates(t: float, y: FloatArray) -> tuple[float, float]:
        nonlocal peak
        x, v = y
        r = (x - c[7]) / c[8]
        if r > 0.0:
            # The naive form: stages of rejected steps also change the peak.
            peak = max(peak, r)
            mode = LOADING if v >= 0.0 else UNLOADING
        else:
            peak = 0.0
            mode = BACKSTOP if x < c[9] else FREE
        piece = pieces[max(int(np.searchsorted(pieces[:, 0], t, side="right")) - 1, 0)]
        return v, acceleration(t, x, v, mode, peak, c, piece)

    with warnings.catch_warnings():
        # A numerical problem of the solver shows in its error.
        warnings.simplefilter("ignore")
        found = solve_ivp(rates, (0.0, end), (task.rest, 0.0), t_eval=grid, **options)
    out = np.full(grid.size, np.nan)
    out[: found.y.shape[1]] = found.y[0]
    return out


def _dop853(
    rtol: float,
    rates: Callable[[float, FloatArray], tuple[float, float]],
    guards: list[Callable[[float, FloatArray], float]],
    begin: float,
    end: float,
    state: FloatArray,
    times: FloatArray,
) -> Stretch:
    from scipy.integrate import solve_ivp

    def terminal(guard: Callable[[float, FloatArray], float]) -> Any:
        def event(t: float, y: FloatArray) -> float:
            return guard(t, y)

        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
        return event

    found: Any = solve_ivp(
        rates,
        (begin, end),
        state,
        method="DOP853",
        rtol=rtol,
        atol=(1e-4 * rtol, rtol),
        events=[terminal(guard) for guard in guards],
        dense_output=True,
        first_step=min(1e-8, end - begin),
    )
    inside = times[times <= found.t[-1]]
    event = next((k for k, hits in enumerate(found.t_events) if len(hits)), -1)
    at = found.sol(inside)[0] if inside.size else inside
    return Stretch(float(found.t[-1]), found.y[:, -1], event, at)
