"""One run of the benchmark: single runs, ensembles, compilation."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from benchmarks.solvers.entry import Peers, Say
    from benchmarks.solvers.report import Report

_ROOT: Final = Path(__file__).parents[2]
_COMPILING: Final = """
import sys, time
from benchmarks.solvers.ensembles import trains
from benchmarks.solvers.problem import frozen
from printhammer.run.ensemble import Ensemble
drives, ends = trains(frozen(), 16, 2)
began = time.perf_counter()
Ensemble(frozen().hammer, drives, ends).run(times=[0.0, 1e-3], threads=1, engine=sys.argv[1])
print(time.perf_counter() - began)
"""


def run(
    *, quick: bool = False, threads: int | None = None, peers: Peers | None = None, say: Say | None = None
) -> Report:
    """Measure everything.

    Parameters
    ----------
    quick : bool, optional
        Whether to use short runs, few members and one round, as a test of the program.
    threads : int, optional
        Largest number of threads of ensembles; by default 2, or 1 on a single core.
    peers : Peers, optional
        Third-party solvers; see `benchmarks.solvers.entry.load_peers`.
    say : callable, optional
        Called with a line of text before each step.

    Raises
    ------
    InputError
        Fewer than one thread.
    """
    from benchmarks.solvers import ensembles, machine, own, table
    from benchmarks.solvers.entry import Peers
    from benchmarks.solvers.problem import MEMBERS, frozen
    from benchmarks.solvers.report import Report
    from printhammer.errors import InputError
    from printhammer.support.threads import thread_count

    if threads is not None and threads < 1:
        raise InputError.of("threads", threads, "at least 1")
    report_step: Say = say if say is not None else lambda _line: None
    task, others = frozen(), peers if peers is not None else Peers()
    here = machine.machine()
    lines, absent = table.measure(task, quick, 16 if quick else MEMBERS, others, report_step)
    figures = ensembles.measure(task, quick, threads or min(2, thread_count(None)), report_step)
    compiling = {}
    for engine in [] if quick else own.engines():
        report_step(f"compiling, {engine} engine")
        compiling[engine] = _compiling(engine)
    return Report(here, quick, lines, absent, figures, compiling, others.used)


def _compiling(engine: str) -> float:
    """Return the time [s] to compile the code of an engine in a process with an empty cache."""
    with tempfile.TemporaryDirectory(prefix="printhammer-bench-") as folder:
        done = subprocess.run(
            [sys.executable, "-c", _COMPILING, engine],
            env={**os.environ, "NUMBA_CACHE_DIR": folder},
            cwd=_ROOT,
            capture_output=True,
            text=True,
            check=True,
        )
    return float(done.stdout)
