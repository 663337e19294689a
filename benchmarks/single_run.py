"""Accuracy and speed of one run: ours, the integrators of 1983, and SciPy, on a hammer of its own.

    python benchmarks/single_run.py [--quick] [--markdown FILE] [--json FILE]

Error: the largest deviation of the displacement from the reference over the first 3 ms of a 1.35 ms train, on
a grid of 1 us. Speed: hammer-seconds per second of processor time, over 200 pulses (3 ms for SciPy),
in rounds in which every solver has its turn, so that a busy machine slows all alike. The best round counts.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import time
import warnings
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from peers import event_split, naive
from rich.console import Console
from rich.table import Table

import printhammer as ph
from printhammer.kernel.reference import reference
from printhammer.problem import TOLERANCE, Problem
from printhammer.scheme_runs import SchemeProblem

if TYPE_CHECKING:
    from collections.abc import Callable

PERIOD = 1.35e-3
FIRST = 3e-3
GRID = np.linspace(0.0, FIRST, 3001)


@dataclass
class Result:
    """One line of the table."""

    solver: str
    error_m: float
    hammer_seconds_per_second: float
    hammer_seconds_timed: float


@dataclass
class Entry:
    """A solver: its displacement on the grid, a call that integrates to a time, how far to time it [s]."""

    name: str
    positions: Callable[[], np.ndarray]
    integrate: Callable[[float], object]
    duration: float


def entries(hammer: ph.Hammer, quick: bool) -> list[Entry]:
    """Return all solvers; `quick` times few pulses."""
    rest = ph.rest_state(hammer)
    many = 5 if quick else 200

    def train(pulses: int) -> ph.PulseTrain:
        return ph.PulseTrain(hammer.waveform, period=PERIOD, pulses=pulses)

    def ours(name: str, problem: Problem, pulses: int) -> Entry:
        return Entry(
            name,
            lambda: problem.resample(problem.run(FIRST), GRID)[:, 0],
            problem.run,
            pulses * PERIOD,
        )

    found = []
    for tolerance in sorted({1e-6, 1e-8, 1e-9, 1e-10, TOLERANCE, 1e-12}, reverse=True):
        name = f"printhammer, tolerance {tolerance:.0e}" + (" (default)" if tolerance == TOLERANCE else "")
        problem = Problem(hammer, train(many), (rest, 0.0), 0.0, tolerance)
        found.append(ours(name, problem, many))
    for scheme, label in (("trapezoid", "implicit trapezoidal rule"), ("runge-kutta-4", "Runge-Kutta 4")):
        fixed = SchemeProblem(hammer, train(many), (rest, 0.0), TOLERANCE, scheme, 1.0)  # type: ignore[arg-type]
        entry = ours(f"1983: {label}, 10/1/20 us", fixed, many)
        entry.integrate = fixed.integrate
        found.append(entry)
    peers: list[tuple[str, Any, dict[str, Any]]] = [
        (
            "SciPy RK45, rtol 1e-11, one right-hand side",
            naive,
            {"method": "RK45", "rtol": 1e-11, "atol": 1e-15},
        ),
        (
            "SciPy Radau, rtol 1e-6, one right-hand side",
            naive,
            {"method": "Radau", "rtol": 1e-6, "atol": 1e-10},
        ),
        (
            "SciPy LSODA, rtol 1e-8, one right-hand side",
            naive,
            {"method": "LSODA", "rtol": 1e-8, "atol": 1e-12},
        ),
        (
            "SciPy DOP853, rtol 1e-11, one right-hand side",
            naive,
            {"method": "DOP853", "rtol": 1e-11, "atol": 1e-15},
        ),
        (
            "SciPy DOP853, rtol 1e-11, split at events",
            event_split,
            {"method": "DOP853", "rtol": 1e-11, "atol": 1e-15},
        ),
    ]
    for name, solver, options in peers:
        found.append(
            Entry(
                name,
                lambda solver=solver, options=options: solver(hammer, PERIOD, rest, FIRST, GRID, **options),
                lambda end, solver=solver, options=options: solver(
                    hammer, PERIOD, rest, end, GRID, **options
                ),
                FIRST,
            )
        )
    return found


def measure(quick: bool) -> list[Result]:
    """Return error and speed of every solver."""
    hammer = ph.load(Path(__file__).with_name("frozen-hammer.toml"))
    exact = reference(
        hammer, ph.PulseTrain(hammer.waveform, period=PERIOD, pulses=3), FIRST, tolerance=1e-14, times=GRID
    ).x
    solvers = entries(hammer, quick)
    errors = []
    for solver in solvers:
        with warnings.catch_warnings():
            # What a solver warns of belongs to its error.
            warnings.simplefilter("ignore")
            x = solver.positions()
        errors.append(float(np.abs(x - exact[: len(x)]).max()) if len(x) == len(exact) else float("nan"))
    best = [float("inf")] * len(solvers)
    for turn in range(1 if quick else 9):
        for i, solver in enumerate(solvers):
            if turn >= 2 and best[i] > 1.0:
                continue
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                start = time.process_time()
                solver.integrate(solver.duration)
                best[i] = min(best[i], time.process_time() - start)
    return [
        Result(solver.name, error, solver.duration / seconds, solver.duration)
        for solver, error, seconds in zip(solvers, errors, best, strict=True)
    ]


def markdown(results: list[Result]) -> str:
    """Return the table in Markdown, with the machine."""
    versions = f"Python {platform.python_version()}, NumPy {np.__version__}, {platform.machine()}"
    lines = [
        "# Single run",
        "",
        "Made by `make bench`: the hammer of `benchmarks/frozen-hammer.toml`, a train of 1.35 ms. Error over",
        "the first 3 ms against the reference; hammer-seconds per second of processor time. Read the ratios:",
        f"all figures are of one run on one machine ({versions}).",
        "",
        "| solver | error [m] | hammer-seconds per second | hammer-seconds timed |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {r.solver} | {r.error_m:.1e} | {r.hammer_seconds_per_second:.3g} | {r.hammer_seconds_timed:.3g} |"
        for r in results
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, print, and write what was asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="few pulses, one round: to see that it works")
    parser.add_argument("--markdown", type=Path, help="write the table as Markdown")
    parser.add_argument("--json", type=Path, help="write the figures as JSON")
    options = parser.parse_args()
    results = measure(options.quick)
    table = Table(
        "solver", "error [m]", "hammer-seconds per second", "hammer-seconds timed", title="Single run"
    )
    for r in results:
        table.add_row(
            r.solver,
            f"{r.error_m:.1e}",
            f"{r.hammer_seconds_per_second:.3g}",
            f"{r.hammer_seconds_timed:.3g}",
        )
    Console(file=sys.stdout, width=120).print(table)
    if options.markdown:
        options.markdown.write_text(markdown(results), encoding="utf-8")
    if options.json:
        options.json.write_text(json.dumps([asdict(r) for r in results], indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
