"""What a public call costs above its engine: the frequency-time map and the safe rate.

    python benchmarks/public_calls.py [HAMMER] [--rates N] [--times N] [--rounds N]

The engine of the map is the run of an ensemble that was made before, with the same dots and times; both
have their turn in each round. That of the safe rate are the runs of the ensembles inside the call. Times are
of the processor, on one thread; printed are medians and the median of the ratios.
"""

from __future__ import annotations

import argparse
import statistics
import time
from typing import TYPE_CHECKING, Any

import numpy as np

import printhammer as ph
from printhammer.maps.frequency import HIGHEST, LOWEST, PULSES, TAIL

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
        ("safe rate", safe_rate(hammer, max(3, given.rounds // 10))),
    ):
        call, engine = (statistics.median(column) for column in zip(*samples, strict=True))
        above = statistics.median(call - engine for call, engine in samples)
        ratio = statistics.median(call / engine for call, engine in samples)
        print(f"{name:22}{1e3 * call:9.1f} ms{1e3 * engine:9.1f} ms{1e3 * above:7.1f} ms{ratio:8.3f}")


def chart(hammer: ph.Hammer, rates: int, times: int, rounds: int) -> list[tuple[float, float]]:
    """Return times of the public call and of its engine, s, for each round."""
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


def safe_rate(hammer: ph.Hammer, rounds: int) -> list[tuple[float, float]]:
    """Return times of the public call and of all runs of ensembles in it, s, for each round."""
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
        ph.safe_rate(hammer, threads=1)
        for _ in range(rounds):
            inside.clear()
            whole = seconds(lambda: ph.safe_rate(hammer, threads=1))
            samples.append((whole, sum(inside)))
    finally:
        ph.Ensemble.run = run  # type: ignore[method-assign]
    return samples


def seconds(work: Callable[[], object]) -> float:
    begun = time.process_time()
    work()
    return time.process_time() - begun


if __name__ == "__main__":
    main()
