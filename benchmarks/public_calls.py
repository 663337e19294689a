"""Overhead of public calls over their engines: frequency-time map, safe rate, sweep.

    python benchmarks/public_calls.py [HAMMER] [--rates N] [--times N] [--rounds N]

The engine of the map is the run of an existing ensemble with the same dots and times; call and engine are
measured alternately. The engine of safe rate and sweep is the sum of all ensemble runs inside the call; the
sweep is the printed example with 512 rates, in one block, without its store. The table shows medians of
processor times on one thread, and the median of the ratios.
"""

from __future__ import annotations

import argparse
import statistics
import time
import tomllib
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

import printhammer as ph
from printhammer.drive.input import PULSES
from printhammer.maps.frequency import HIGHEST, LOWEST, TAIL
from printhammer.sweep.plan import make_plan
from printhammer.sweep.spec import read_spec
from printhammer.sweep.work import run_chunk

if TYPE_CHECKING:
    from collections.abc import Callable


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("hammer", nargs="?", default="hendriks-1983")
    parser.add_argument("--rates", type=int, default=512)
    parser.add_argument("--times", type=int, default=512)
    parser.add_argument("--rounds", type=int, default=41)
    given = parser.parse_args()
    hammer = ph.load(given.hammer)
    print(f"{'':22}{'call':>12}{'engine':>12}{'above':>10}{'ratio':>8}")
    for name, samples in (
        (f"map, {given.rates} x {given.times}", chart(hammer, given.rates, given.times, given.rounds)),
        ("safe rate", with_runs_inside(lambda: ph.safe_rate(hammer, threads=1), max(3, given.rounds // 10))),
        ("sweep, example", with_runs_inside(block(), given.rounds)),
    ):
        call, engine = (statistics.median(column) for column in zip(*samples, strict=True))
        above = statistics.median(call - engine for call, engine in samples)
        ratio = statistics.median(call / engine for call, engine in samples)
        print(f"{name:22}{1e3 * call:9.1f} ms{1e3 * engine:9.1f} ms{1e3 * above:7.1f} ms{ratio:8.3f}")


def chart(hammer: ph.Hammer, rates: int, times: int, rounds: int) -> list[tuple[float, float]]:
    """Return the times of `frequency_map` and of its engine, s, for each round."""
    grid = np.linspace(LOWEST, HIGHEST, rates)
    waveform: Any = hammer.waveform
    moments = np.linspace(0.0, (PULSES - 1) / LOWEST + TAIL, times)
    ends = np.maximum(moments[-1], (PULSES - 1) / grid + TAIL)
    runs = ph.Ensemble(hammer, ph.PulseTrains.at_rates(waveform, grid, PULSES), ends)

    def engine() -> ph.EnsembleResult:
        return runs.run(dots=True, times=moments, threads=1)

    def call() -> Any:
        return ph.frequency_map(hammer, grid, times=times, threads=1)

    displacement = engine().x
    assert displacement is not None
    if displacement.tobytes() != call()["displacement"].values.tobytes():
        raise SystemExit("the map is not what its engine computes")
    return [(seconds(call), seconds(engine)) for _ in range(rounds)]


def with_runs_inside(call: Callable[[], object], rounds: int) -> list[tuple[float, float]]:
    """Return the times of a call and of all ensemble runs inside the call, s, for each round."""
    inside: list[float] = []
    run = ph.Ensemble.run

    def timed(self: ph.Ensemble, **options: Any) -> ph.EnsembleResult:
        begun = time.process_time()
        result = run(self, **options)
        inside.append(time.process_time() - begun)
        return result

    samples = []
    ph.Ensemble.run = timed  # type: ignore[method-assign]
    try:
        call()
        for _ in range(rounds):
            inside.clear()
            whole = seconds(call)
            samples.append((whole, sum(inside)))
    finally:
        ph.Ensemble.run = run  # type: ignore[method-assign]
    return samples


def block() -> Callable[[], object]:
    """Return a function that computes all members of the example sweep as one block, without a store."""
    content = tomllib.loads((files("printhammer") / "sweep" / "example.toml").read_text())
    content["axis"][0]["count"] = 512
    plan = make_plan(read_spec(content))
    rows = plan.rows(range(plan.members))
    return lambda: run_chunk(plan.spec.base, plan.spec.outputs, rows)


def seconds(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


if __name__ == "__main__":
    main()
