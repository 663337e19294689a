"""What the circuit of the coil costs: a run by voltage beside one by current, and beside SciPy.

    python benchmarks/circuit.py [--rounds N]

The first two are the paper's hammer under its current and behind a rail of 100 V that makes the same
current, fired nine times at 800 Hz, at equal tolerances; the error is that of the displacement up to 3 ms
against a run at 1e-13. The third is one pulse of that hammer without its pack, integrated by the kernel and
by SciPy's DOP853 with events, as the tests have it. Each has its turn in each round; printed are medians.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import printhammer as ph
from printhammer.drive.waveforms.drivers import Rail
from printhammer.run.problem import Problem
from printhammer.run.start import initial_state

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.hammer.hammer import Hammer

END, SHOWN = 15e-3, 3e-3
TOLERANCES = (1e-8, 2e-11, 1e-12)


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=21)
    rounds = parser.parse_args().rounds
    current = ph.load("hendriks-1983")
    rail = Rail(voltage=100.0, width=177.24e-6, decay="diode", decay_resistance=159.08)
    coil = {"coil.resistance": 28.612, "coil.inductance": 6.5468e-3}
    voltage = current.replace({**coil, "waveform": rail})
    for tolerance in TOLERANCES:
        runs = {name: run_of(hammer, tolerance) for name, hammer in (("i", current), ("u", voltage))}
        spent = medians(runs, rounds)
        errors = {"i": error_of(current, tolerance), "u": error_of(voltage, tolerance)}
        print(
            f"tolerance {tolerance:.0e}: by current {1e6 * spent['i']:5.0f} us, error {errors['i']:.0e} of"
            f" the stroke; by voltage {1e6 * spent['u']:5.0f} us, {errors['u']:.0e};"
            f" speed {spent['i'] / spent['u']:.2f} of that by current"
        )
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tests.circuits import Phase, integrate
    from tests.truth.test_circuit import as_device

    bare = voltage.replace("pack", None)
    device = as_device(bare, 28.612, 6.5468e-3)
    phases = [Phase(0.0, 100.0), Phase(rail.width, 0.7, series=159.08, decay=True)]
    start = (initial_state(bare, None)[0], 0.0)
    spent = medians(
        {
            "ours": run_of(bare, 1e-11, pulses=1, end=6e-4),
            "SciPy": lambda: integrate(device, phases, [0.0], start, 6e-4, longest=2e-5, tolerance=1e-11),
        },
        max(3, rounds // 4),
    )
    ratio = spent["SciPy"] / spent["ours"]
    print(f"one pulse: {1e6 * spent['ours']:.0f} us, SciPy {1e3 * spent['SciPy']:.0f} ms: {ratio:.0f} times")


def run_of(hammer: Hammer, tolerance: float, pulses: int = 9, end: float = END) -> Callable[[], object]:
    """Return a run of a hammer, made ready."""
    drive = ph.PulseTrain(hammer.waveform, rate=800.0, pulses=pulses)
    problem = Problem(hammer, drive, initial_state(hammer, None), 0.0, tolerance)
    problem.run(end)
    return lambda: problem.run(end)


def medians(runs: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the median time of each run, s."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            begin = time.perf_counter()
            run()
            times[name].append(time.perf_counter() - begin)
    return {name: statistics.median(each) for name, each in times.items()}


def error_of(hammer: Hammer, tolerance: float) -> float:
    """Return the error of a run up to `SHOWN`, in strokes."""
    drive = ph.PulseTrain(hammer.waveform, rate=800.0, pulses=9)
    grid = np.linspace(0.0, SHOWN, 301)
    exact, x = (
        ph.simulate(hammer, drive, duration=END, tolerance=each, times=grid).x for each in (1e-13, tolerance)
    )
    return float(np.abs(x - exact).max() / (exact.max() - hammer.origin))


if __name__ == "__main__":
    main()
