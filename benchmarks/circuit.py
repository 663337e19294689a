"""Cost of the coil circuit: runs with a voltage drive and a current drive, compared with SciPy and heyoka.

    python benchmarks/circuit.py [--rounds N]

The first comparison is between the paper's hammer with its current and the same hammer with a rail of 100 V
that produces about the same current, fired nine times at 800 Hz, at equal tolerances; the error is that of
the displacement up to 3 ms, relative to a run at the tolerance 1e-13. The second comparison is one pulse of
the hammer without its pack, integrated by the kernel, by SciPy's DOP853 with events (as in the tests), and by
heyoka, if installed (see `benchmarks/peers`); the error is the largest relative error of displacement and
velocity at the end, relative to a run at 1e-13. In each round, every program is called five times in a row,
since the other programs displace its data from the caches. The shortest of five times is used; medians over
the rounds are printed.
"""

from __future__ import annotations

import argparse
import functools
import statistics
import sys
import timeit
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
    end = 6e-4
    exact = final_of(bare, 1e-13, end)
    runs = {
        "printhammer, 1e-11": (run_of(bare, 1e-11, pulses=1, end=end), lambda: final_of(bare, 1e-11, end)),
        "SciPy, 1e-11": 2
        * (lambda: tuple(integrate(device, phases, [0.0], start, end, tolerance=1e-11).final),),
    }
    try:
        import heyoka
    except ImportError:
        print("heyoka: not installed")
    else:
        from benchmarks.circuit_heyoka import Pulse

        for tolerance in (1e-8, 1e-11):
            pulse = Pulse(heyoka, bare, phases, start[0], tolerance)
            runs[f"heyoka, {tolerance:.0e}"] = 2 * (functools.partial(pulse.run, end),)
    times = medians({name: run for name, (run, _final) in runs.items()}, max(3, rounds // 4))
    ours = times["printhammer, 1e-11"]
    for name, (_run, final) in runs.items():
        error = float(np.max(np.abs(np.subtract(final(), exact)[:2] / exact[:2])))
        spent = 1e6 * times[name]
        print(f"one pulse, {name}: {spent:.0f} us, {times[name] / ours:.1f} times, error {error:.0e}")


def final_of(hammer: Hammer, tolerance: float, end: float) -> tuple[float, float, float]:
    """Return displacement [m], velocity [m/s] and current [A] at the end of one pulse."""
    drive = ph.PulseTrain(hammer.waveform, rate=800.0, pulses=1)
    motion = ph.simulate(hammer, drive, duration=end, tolerance=tolerance)
    (x,), (v,), (i,) = *motion.at([end]), motion.driven_at([end])
    return float(x), float(v), float(i)


def run_of(hammer: Hammer, tolerance: float, pulses: int = 9, end: float = END) -> Callable[[], object]:
    """Prepare a run of a hammer, and run it once; return a function that repeats the run."""
    drive = ph.PulseTrain(hammer.waveform, rate=800.0, pulses=pulses)
    problem = Problem(hammer, drive, initial_state(hammer, None), 0.0, tolerance)
    problem.run(end)
    return lambda: problem.run(end)


def medians(runs: dict[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the median over rounds of the shortest of five calls in a row, s."""
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            times[name].append(min(timeit.repeat(run, number=1, repeat=5)))
    return {name: statistics.median(each) for name, each in times.items()}


def error_of(hammer: Hammer, tolerance: float) -> float:
    """Return the largest displacement error of a run up to `SHOWN`, as a fraction of the stroke."""
    drive = ph.PulseTrain(hammer.waveform, rate=800.0, pulses=9)
    grid = np.linspace(0.0, SHOWN, 301)
    exact, x = (
        ph.simulate(hammer, drive, duration=END, tolerance=each, times=grid).x for each in (1e-13, tolerance)
    )
    return float(np.abs(x - exact).max() / (exact.max() - hammer.origin))


if __name__ == "__main__":
    main()
