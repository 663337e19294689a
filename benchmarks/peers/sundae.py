"""SUNDIALS from Python: CVODE through scikit-sundae, split at events like SciPy."""

from __future__ import annotations

import importlib
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.solvers.entry import Absent, Entry
from benchmarks.solvers.problem import FIRST, GRID

from .events import Stretch, event_split

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.solvers.problem import Task
    from printhammer.support.arrays import FloatArray

_CLOSE = 1e-13


def entries(task: Task, quick: bool) -> list[Entry]:  # noqa: ARG001
    """Return the benchmark entry of scikit-sundae.

    Raises
    ------
    Absent
        scikit-sundae is not installed.
    """
    try:
        sundae = importlib.import_module("sksundae")
        cvode = importlib.import_module("sksundae.cvode")
    except ImportError as error:
        raise Absent("not installed") from error
    rtol = 1e-11
    run = partial(event_split, task, FIRST, GRID, partial(_adams, cvode, rtol))
    name = f"scikit-sundae {sundae.__version__} CVODE Adams, its events, {rtol:.0e}"
    return [Entry(name, run, run, FIRST)]


def _adams(
    cvode: Any,
    rtol: float,
    rates: Callable[[float, FloatArray], tuple[float, float]],
    guards: list[Callable[[float, FloatArray], float]],
    begin: float,
    end: float,
    state: FloatArray,
    times: FloatArray,
) -> Stretch:
    def rates_into(t: float, y: FloatArray, out: FloatArray) -> None:
        out[:] = rates(t, y)

    def events(t: float, y: FloatArray, out: FloatArray) -> None:
        for k, guard in enumerate(guards):
            out[k] = guard(t, y)

    events.terminal = [True] * len(guards)  # type: ignore[attr-defined]
    events.direction = [-1] * len(guards)  # type: ignore[attr-defined]
    solver = cvode.CVODE(
        rates_into,
        method="Adams",
        rtol=rtol,
        atol=np.array([1e-4 * rtol, rtol]),
        eventsfn=events,
        num_events=len(guards),
        first_step=min(1e-9, 0.5 * (end - begin)),
        max_num_steps=1_000_000,
    )
    # The solver rejects times that differ only by rounding.
    times = np.where(abs(times - begin) < _CLOSE, begin, np.where(abs(times - end) < _CLOSE, end, times))
    wanted = np.unique(np.concatenate(([begin], times, [end])))
    found = solver.solve(wanted, state)
    inside = np.isin(times, found.t)
    at = found.y[np.searchsorted(found.t, times[inside]), 0] if inside.any() else times[:0]
    event = -1
    if found.t_events is not None and len(found.t_events):
        event = int(np.flatnonzero(np.asarray(found.i_events[-1]) != 0)[0])
    return Stretch(float(found.t[-1]), found.y[-1], event, at)
