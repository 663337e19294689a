"""The table of solvers: error, speed, and speed of printhammer relative to each other solver."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from benchmarks.solvers import exact, own
from benchmarks.solvers.entry import Absent, Entry, Peers, Say
from printhammer.results import Declared, part, scalar

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.solvers.problem import Task

_SHORTEST: Final = 0.02
"""Smallest processor time of a measurement, s; a shorter integration is repeated within a measurement."""
_SLOW: Final = 1.0
"""Processor time above which a solver is measured only twice, s; arbitrary."""


class Line(Declared):
    """Table row of one solver."""

    solver: str = part("solver, version, method, tolerance")
    ours: bool = part("whether the solver is printhammer")
    members: int = part("number of runs; 1 for a single run")
    error: float = scalar(
        "m",
        "largest deviation from the reference over the first 3 ms",
        more="NaN if the solver ended early",
    )
    speed: float = part("simulated hammer-seconds per second of processor time")
    first: float = part("time of the first call, including compilation, s")
    duration: float = part("hammer-seconds simulated by one timed call")
    match: str = part(
        "for another solver: the fastest printhammer row of its kind that is at least as accurate", default=""
    )
    ratio: float = part(
        "speed of the matching printhammer row relative to this solver; NaN without a match", default=math.nan
    )


def measure(
    task: Task, quick: bool, members: int, peers: Peers, say: Say
) -> tuple[list[Line], dict[str, str]]:
    """Measure all installed solvers.

    Runs are short, with one round, if `quick`; ensembles have `members` members; `say` is called before each
    step. Return the table rows, and for each missing solver the reason why it is missing.
    """
    absent: dict[str, str] = {}
    solvers: list[Entry] = []
    building: dict[int, float] = {}
    makers: list[tuple[str, Callable[[], list[Entry]]]] = [
        ("printhammer", partial(own.singles, task, quick)),
        ("1983", partial(own.schemes, task, quick)),
        *((name, partial(make, task, quick)) for name, make in peers.single.items()),
        ("printhammer", partial(own.ensembles, task, quick, members)),
        *((name, partial(make, task, quick, members)) for name, make in peers.ensembles.items()),
    ]
    for name, make_entries in makers:
        began = time.perf_counter()
        try:
            made = make_entries()
        except Absent as reason:
            absent[name] = str(reason)
            continue
        if made:
            building[len(solvers)] = time.perf_counter() - began
        solvers += made
    lines, kept = [], []
    for i, solver in enumerate(solvers):
        say(solver.name)
        began = time.perf_counter()
        try:
            x = solver.positions()
            first = time.perf_counter() - began + building.get(i, 0.0)
            # Compile the timed function before the timing.
            solver.integrate()
        except Exception as failure:
            # A failure of one solver must not stop the benchmark of the others.
            if solver.ours:
                raise
            absent[solver.name] = f"failed: {type(failure).__name__}: {failure}".splitlines()[0]
            continue
        true = exact.single(task) if solver.members == 1 else exact.ensemble(task, solver.members)
        error = _largest(x, true)
        lines.append(Line(solver.name, solver.ours, solver.members, error, 0.0, first, solver.duration))
        kept.append(solver)
    seconds = _rounds(kept, 1 if quick else 7, say)
    timed = [replace(line, speed=line.duration / best) for line, best in zip(lines, seconds, strict=True)]
    return with_ratios(timed), absent


def _largest(x: np.ndarray, true: np.ndarray) -> float:
    """Return the largest deviation from the reference, m; NaN if a run was lost or nothing is comparable."""
    wanted = np.ones(true.shape, bool)
    if true.ndim == 2:
        # Some ensembles are available only at a part of the times.
        wanted &= ~np.isnan(x).all(axis=1, keepdims=True)
    return float(np.abs(x - true)[wanted].max()) if wanted.any() else math.nan


def _rounds(solvers: list[Entry], rounds: int, say: Say) -> list[float]:
    """Measure all solvers once in each round; return the smallest processor time of a call of each, s."""
    best = [math.inf] * len(solvers)
    repeats = [1] * len(solvers)
    for turn in range(rounds):
        say(f"round {turn + 1} of {rounds}")
        for i, solver in enumerate(solvers):
            if turn >= 2 and best[i] > _SLOW:
                continue
            began = time.process_time()
            for _ in range(repeats[i]):
                solver.integrate()
            best[i] = min(best[i], (time.process_time() - began) / repeats[i])
            repeats[i] = max(1, min(1000, int(_SHORTEST / max(best[i], 1e-6))))
    return best


def with_ratios(lines: list[Line]) -> list[Line]:
    """Add to each other solver the fastest printhammer row of its kind that is at least as accurate."""
    return [line if line.ours or math.isnan(line.error) else _rated(line, lines) for line in lines]


def _rated(line: Line, lines: list[Line]) -> Line:
    single = line.members == 1
    rivals = [o for o in lines if o.ours and (o.members == 1) == single and o.error <= line.error]
    if not rivals:
        return line
    rival = max(rivals, key=lambda own: own.speed)
    return replace(line, match=rival.solver, ratio=rival.speed / line.speed)
