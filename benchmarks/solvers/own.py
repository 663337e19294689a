"""Entries of printhammer in the table: single runs, the integrators of 1983, and ensembles."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final, get_args

from benchmarks.solvers.entry import Entry
from benchmarks.solvers.problem import ENDS, FIRST, GRID, PERIOD, Task, checked, ensemble_tasks
from printhammer.run.problem import TOLERANCE, Problem

if TYPE_CHECKING:
    from printhammer.kernel.schemes_1983 import Scheme
    from printhammer.run.ensemble import Ensemble
    from printhammer.support.arrays import FloatArray

TOLERANCES: Final = tuple(
    sorted({TOLERANCE, *(f * 10.0**-e for e in range(5, 13) for f in (1.0, 0.3)), 1e-13}, reverse=True)
)
"""Tolerances of the table, loosest first."""


def _chosen(quick: bool) -> tuple[float, ...]:
    return (1e-6, 1e-8, 1e-10, TOLERANCE, 1e-12) if quick else TOLERANCES


def engines() -> list[str]:
    """Return the names of the ensemble engines that a caller can select."""
    from printhammer.run.ensemble import Engine

    return [engine for engine in get_args(Engine) if engine != "auto"]


def singles(task: Task, quick: bool) -> list[Entry]:
    """Return the benchmark entries of single runs, one per tolerance."""
    pulses = 5 if quick else 50
    entries = []
    for tolerance in _chosen(quick):
        problem = Problem(task.hammer, task.drive(pulses), (task.rest, 0.0), 0.0, tolerance)
        default = " (default)" if tolerance == TOLERANCE else ""
        entries.append(_single(f"printhammer, {tolerance:.0e}{default}", problem, pulses))
    return entries


def schemes(task: Task, quick: bool) -> list[Entry]:
    """Return the benchmark entries of the paper's integrators, with the step sizes of the paper."""
    from printhammer.run.scheme_runs import SchemeProblem

    pulses = 5 if quick else 50
    labels: dict[Scheme, str] = {
        "trapezoid": "implicit trapezoidal rule",
        "runge-kutta-4": "Runge-Kutta 4",
    }
    entries = []
    for scheme, label in labels.items():
        start = (task.rest, 0.0)
        problem = SchemeProblem(task.hammer, task.drive(pulses), start, TOLERANCE, scheme, 1.0)
        entry = _single(f"1983: {label}, 10/1/20 us", problem, pulses)
        entry.integrate, entry.ours = partial(problem.integrate, entry.duration), False
        entries.append(entry)
    return entries


def _single(name: str, problem: Problem, pulses: int) -> Entry:
    def positions() -> FloatArray:
        return problem.resample(problem.run(FIRST), GRID)[:, 0]

    duration = pulses * PERIOD
    return Entry(name, positions, partial(problem.run, duration), duration, ours=True)


def ensembles(task: Task, quick: bool, members: int) -> list[Entry]:
    """Return the benchmark entries of ensembles of `members` members, on one thread, for each engine."""
    from printhammer.run.ensemble import Ensemble

    tasks = ensemble_tasks(task, members)
    pulses = 5 if quick else 10
    some = [tasks[i] for i in checked(members)]

    def strobed(runs: Ensemble, engine: str) -> FloatArray:
        strobes = runs.run(strobes=[ENDS] * runs.size, threads=1, engine=engine).strobes  # type: ignore[arg-type]
        assert strobes is not None
        return strobes.x.T

    entries, duration = [], pulses * PERIOD
    for engine in engines():
        for tolerance in _chosen(quick):
            runs = Ensemble(task.hammer, [one.drive(pulses) for one in tasks], duration, tolerance=tolerance)
            few = Ensemble(task.hammer, [one.drive(3) for one in some], FIRST, tolerance=tolerance)
            positions = partial(strobed, few, engine)
            integrate = partial(runs.run, threads=1, engine=engine)  # type: ignore[arg-type]
            name = f"printhammer, {engine} engine, {tolerance:.0e}"
            entries.append(Entry(name, positions, integrate, duration * members, members, ours=True))
    return entries
