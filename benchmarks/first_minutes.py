"""Waiting times of a new user, without compiled code: medians over rounds with empty cache folders.

    python benchmarks/first_minutes.py [HAMMER] [--rounds N] [--only run|studio]

`run` is the duration of the verb `run`. `studio` is the time from the start of the program to the first curve
and to the full map of its page, in a headless Chromium; in a checkout, it includes linking the modules that
the wheel contains. The table also shows the times of the same round with everything compiled, and the
processor time of all child processes, including compilers.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

CURVE = "window.studio?.studio?.frames.motion"
MAP = "window.studio.studio.frames.map?.detail === 'full'"


def cpu() -> float:
    """Return the processor time of the child processes that have ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(hammer: str) -> dict[str, float]:
    """Measure the duration of the verb `run`, s."""
    begun = time.perf_counter()
    subprocess.run([sys.executable, "-m", "printhammer", "run", hammer], check=True, capture_output=True)
    return {"run: first number": time.perf_counter() - begun}


def studio(hammer: str) -> dict[str, float]:
    """Measure the time until the studio shows its first curve and its full map, s."""
    sys.path.insert(0, str(Path(__file__).parents[1]))
    from tests.studio.browser import browser

    with browser() as tab:
        page = tab()
        page.size(1280, 720)
        begun = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "page.html")
            words = ("-m", "printhammer", "studio", hammer, "--only", "--out", path)
            subprocess.run([sys.executable, *words], check=True, capture_output=True)
            page.open(path.as_uri())
            page.wait(CURVE, 300.0)
            curve = time.perf_counter() - begun
            page.wait(MAP, 300.0)
            return {"studio: first curve": curve, "studio: full map": time.perf_counter() - begun}


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("hammer", nargs="?", default="hendriks-1983")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", choices=("run", "studio"))
    options = parser.parse_args()
    tasks: dict[str, Callable[[str], dict[str, float]]] = {"run": run, "studio": studio}
    for name, task in tasks.items():
        if options.only not in (None, name):
            continue
        cold: dict[str, list[float]] = {}
        warm: dict[str, list[float]] = {}
        used = []
        for _ in range(options.rounds):
            with tempfile.TemporaryDirectory() as folder:
                os.environ["NUMBA_CACHE_DIR"] = folder
                before = cpu()
                for times in (cold, warm):
                    for what, took in task(options.hammer).items():
                        times.setdefault(what, []).append(took)
                    if times is cold:
                        used.append(cpu() - before)
        for what, took in cold.items():
            print(
                f"{what:24s} cold {statistics.median(took):6.1f} s,"
                f" compiled {statistics.median(warm[what]):5.1f} s,"
                f" processor time of all children {statistics.median(used):6.1f} s, {options.rounds} rounds"
            )


if __name__ == "__main__":
    main()
