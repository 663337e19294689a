"""Timings of ensembles: Figure 9, thousands of long trains, growth with the number of members, errors."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.solvers import exact
from benchmarks.solvers.own import engines
from printhammer.run.problem import TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Callable

    from benchmarks.solvers.entry import Say
    from benchmarks.solvers.problem import Task
    from printhammer.drive.trains import PulseTrain
    from printhammer.run.ensemble import Ensemble
    from printhammer.support.arrays import FloatArray

LOWEST: Final = 500.0
"""Lowest firing rate, Hz."""
HIGHEST: Final = 2000.0
"""Highest firing rate, Hz."""
TAIL: Final = 1e-3
"""Time from the end of the last period to the end of a run, s."""
DISPLAY: Final = 1e-4
"""Error that is invisible in a figure, as a fraction of the stroke."""
EXACT: Final = 1e-8
"""Error up to which a result counts as exact, as a fraction of the stroke; arbitrary."""

_TOLERANCES: Final = (1e-6, 3e-7, 1e-7, 1e-8, 1e-9, 3e-10, 1e-10, 5e-11, TOLERANCE)
_STROBES: Final = 200


@dataclass(frozen=True)
class Frame:
    """Timing of Figure 9 for one tolerance, engine and number of threads.

    Median and smallest wall-clock time over all rounds, s, including sampling; median and 95th percentile,
    over the members, of the largest error before the horizon, as a fraction of the stroke.
    """

    engine: str
    tolerance: float
    threads: int
    seconds: float
    best: float
    error_median: float
    error_95: float


@dataclass(frozen=True)
class Mass:
    """Timing of many members: total length of the runs, hammer-seconds, and wall-clock time, s."""

    engine: str
    tolerance: float
    threads: int
    members: int
    pulses: int
    hammer_seconds: float
    seconds: float

    @property
    def speed(self) -> float:
        """Hammer-seconds per second of wall-clock time and thread."""
        return self.hammer_seconds / self.seconds / self.threads


@dataclass(frozen=True)
class Figures:
    """All timings of ensembles.

    The size of Figure 9, `rates` x `pulses`, sampled at `times`; the total length of its runs, s; the time of
    the very first run, s, which compiles or loads the kernel; the number of members compared with the
    reference; the timings of Figure 9, of long trains, and of Figure 9 with an increasing number of members
    on one thread.
    """

    rates: int
    pulses: int
    times: int
    hammer_seconds: float
    first: float
    checked: int
    frames: list[Frame]
    masses: list[Mass]
    growth: list[Mass]

    def fastest(self, error: float, threads: int) -> Frame | None:
        """Return the fastest timing of Figure 9 on `threads` threads with a median error up to `error`."""
        good = [f for f in self.frames if f.error_median <= error and f.threads == threads]
        return min(good, key=lambda f: f.seconds, default=None)


def trains(task: Task, members: int, pulses: int) -> tuple[list[PulseTrain], FloatArray]:
    """Build trains at rates from 500 Hz to 2 kHz; return the trains and the end times of their runs, s."""
    from printhammer.drive.trains import PulseTrain

    waveform: Any = task.hammer.waveform
    rates = np.linspace(LOWEST, HIGHEST, members)
    drives = [PulseTrain(waveform, rate=rate, pulses=pulses) for rate in rates.tolist()]
    return drives, pulses / rates + TAIL


def measure(task: Task, quick: bool, threads: int, say: Say) -> Figures:
    """Time ensembles of the hammer on up to `threads` threads; few members and repeats if `quick`."""
    from printhammer.run.ensemble import Ensemble

    rates, pulses, times = (32, 3, 64) if quick else (512, 9, 512)
    drives, ends = trains(task, rates, pulses)
    grid = np.linspace(0.0, float(ends.max()), times)
    x = np.empty((rates, times), np.float32)
    first = _seconds(partial(Ensemble(task.hammer, drives[:1], ends[:1]).run, times=grid, threads=1))
    counts = sorted({1, threads})
    say("reference of Figure 9")
    some = np.unique(np.linspace(0, rates - 1, 4 if quick else 64).round().astype(int)).tolist()
    hammer: Any = task.hammer
    stroke = float(hammer.pack.front - hammer.backstop.position)
    moments = [np.linspace(0.0, ends[i], _STROBES) for i in some]
    true = [
        exact.trusted(task.hammer, drives[i], float(ends[i]), moment, stroke)
        for i, moment in zip(some, moments, strict=True)
    ]
    frames: list[Frame] = []
    work: list[Callable[[], object]] = []
    for engine in engines():
        for tolerance in (1e-7, TOLERANCE) if quick else _TOLERANCES:
            few = Ensemble(task.hammer, [drives[i] for i in some], ends[some], tolerance=tolerance)
            errors = _errors(few, engine, moments, true, stroke)
            middle, most = float(np.median(errors)), float(np.percentile(errors, 95))
            runs = Ensemble(task.hammer, drives, ends, tolerance=tolerance)
            for count in counts:
                frames.append(Frame(engine, tolerance, count, math.inf, math.inf, middle, most))
                work.append(partial(runs.run, times=grid, x=x, threads=count, engine=engine))  # type: ignore[arg-type]
    samples = _rounds(work, 3 if quick else 21, say)
    frames = [
        replace(frame, seconds=float(np.median(times)), best=min(times))
        for frame, times in zip(frames, samples, strict=True)
    ]
    figures = Figures(rates, pulses, grid.size, float(ends.sum()), first, len(some), frames, [], [])
    chosen = figures.fastest(EXACT, 1)
    tolerance = TOLERANCE if chosen is None else chosen.tolerance
    for engine in engines():
        many, long = (64, 5) if quick else (4096, 50)
        for count in counts:
            say(f"{many} members x {long} pulses, {engine} engine, {count} threads")
            figures.masses.append(_mass(task, engine, tolerance, count, many, long, 2))
        for many in (32, 64) if quick else (512, 1024, 2048, 4096):
            say(f"growth: {many} members, {engine} engine")
            figures.growth.append(_mass(task, engine, tolerance, 1, many, pulses, 2 if quick else 3))
    return figures


def _mass(
    task: Task, engine: str, tolerance: float, threads: int, members: int, pulses: int, repeats: int
) -> Mass:
    from printhammer.run.ensemble import Ensemble

    drives, ends = trains(task, members, pulses)
    runs = Ensemble(task.hammer, drives, ends, tolerance=tolerance)
    work = partial(runs.run, threads=threads, engine=engine)  # type: ignore[arg-type]
    seconds = min(_seconds(work) for _ in range(repeats))
    return Mass(engine, tolerance, threads, members, pulses, float(ends.sum()), seconds)


def _errors(
    runs: Ensemble, engine: Any, moments: list[FloatArray], true: list[FloatArray], stroke: float
) -> FloatArray:
    strobes = runs.run(strobes=moments, engine=engine).strobes
    assert strobes is not None
    errors = []
    for row, wanted in zip(strobes.x, true, strict=True):
        before = np.isfinite(wanted)
        # A failed run has no error and ranks below every other run.
        gap = np.abs(row - wanted)[before]
        errors.append(math.inf if np.isnan(gap).any() else float(gap.max(initial=0.0)) / stroke)
    return np.array(errors)


def _rounds(works: list[Callable[[], object]], rounds: int, say: Say) -> list[list[float]]:
    """Time each function once in every round; return the times [s], by function."""
    for work in works:
        work()
    samples: list[list[float]] = [[] for _ in works]
    for turn in range(rounds):
        say(f"Figure 9, round {turn + 1} of {rounds}")
        for work, times in zip(works, samples, strict=True):
            times.append(_seconds(work))
    return samples


def _seconds(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began
