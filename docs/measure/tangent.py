"""Measure the tables of the page on the tangent flow.

Run ``.venv/bin/python docs/measure/tangent.py``, which takes a few minutes. Finite differences and
hammers are the same as in the tests.
"""

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from measured import MOTION, Cell, Column, write

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.hammers import Draw, crude, interpreted
from tests.tangents import SHARP, before_slow_touches, deviation, scaled
from tests.truth.test_tangent_finite_differences import CASES, MOVING, drive_of, hammer_of

import printhammer as ph
from printhammer.derivatives.states import strobe_exponent, tangent_map
from printhammer.hammer.equilibrium import rest_state
from printhammer.run.problem import TOLERANCE, Problem

SIZES = (1e-4, 1e-5, 1e-3, 1e-6)
"""Initial spacings of the finite differences; the best result counts, since their errors differ."""


def best(*what: object, **how: object) -> float:
    """Return the smallest deviation over all spacings."""
    found = np.inf
    for size in SIZES:
        found = min(found, deviation(*what, size=size, **how))
        if found < 1e-9:
            break
    return found


def row(name: str, errors: list[float]) -> list[Cell]:
    """Return a row of the table."""
    print(name, f"{max(errors):.1e}", flush=True)
    return [name, float(max(errors)), float(np.median(errors))]


def crude_hammer() -> list[list[Cell]]:
    """Compare a single pulse, trains, and maps from contact to contact; also at the default tolerance."""
    rows = []
    hammer = crude()
    single = ph.PulseTrain(hammer.waveform)
    ends = np.linspace(0.1e-3, 0.85e-3, 16)
    rows.append(row("single pulse, 16 ends in all modes", [best(hammer, single, 0.0, end) for end in ends]))
    starts = [0.3e-3, 0.36e-3, 0.5e-3, 0.56e-3]
    pairs = [(start, end) for start in starts for end in ends if end > start + 10e-6]
    between = [best(hammer, single, *pair) for pair in pairs]
    rows.append(row("from inside one contact to inside another", between))
    errors, changes = [], []
    for period in np.linspace(0.8e-3, 1.35e-3, 12):
        train = ph.PulseTrain(hammer.waveform, period=period, pulses=3)
        end = before_slow_touches(hammer, train, 2.0 * period)
        errors.append(best(hammer, train, 0.0, end))
        exact, usual = (tangent_map(hammer, train, 0.0, end, tolerance=t) for t in (SHARP, TOLERANCE))
        scales = Problem(hammer, train, exact.state_at_start[:2], 0.0, SHARP).scales
        change = scaled(usual.matrix - exact.matrix, scales)
        changes.append(float(np.linalg.norm(change) / np.linalg.norm(scaled(exact.matrix, scales))))
    rows.append(row("trains of three pulses, 12 rates", errors))
    rows.append(row("these trains, at the default tolerance", changes))
    return rows


def other_hammers() -> list[list[Cell]]:
    """Compare other parts, drives, and random hammers near the crude hammer."""
    errors: dict[bool, list[float]] = {False: [], True: []}
    for magnet, spring, pack, backstop, name, start, end in CASES:
        with tempfile.TemporaryDirectory() as folder, interpreted():
            hammer = hammer_of(magnet, spring, pack, backstop, Path(folder))
            drive = drive_of(magnet, name)
            errors[magnet == "table"].append(best(hammer, drive, start, end, MOVING, levels=4))
    rows = [
        row(f"other parts and drives, {len(errors[False])} hammers", errors[False]),
        row(f"the same with a force table, {len(errors[True])} hammers", errors[True]),
    ]
    draw, found = Draw(np.random.default_rng(4), spread=0.1), []
    while len(found) < 200:
        hammer = draw()
        drive = ph.PulseTrain(hammer.waveform, period=draw.rng.uniform(0.8e-3, 1.6e-3), pulses=3)
        end = before_slow_touches(hammer, drive, draw.rng.uniform(0.5e-3, 2.5e-3))
        found.append(best(hammer, drive, 0.0, end))
    return [*rows, row(f"{len(found)} random hammers, trains of three pulses", found)]


def cost() -> list[Cell]:
    """Return a row with the time for exponents divided by the time for the runs alone."""
    hammer = ph.load("hendriks-1983")
    ratios = []
    for _ in range(5):
        begin = time.process_time()
        strobe_exponent(hammer, hammer.waveform, 1.05e-3, first=1, last=1000)
        middle = time.process_time()
        drive = ph.PulseTrain(hammer.waveform, period=1.05e-3, pulses=1000)
        Problem(hammer, drive, (rest_state(hammer), 0.0), 0.0, TOLERANCE).run(float(drive.times[-1]))
        ratios.append((middle - begin) / (time.process_time() - middle) - 1.0)
    return ["shipped hammer, 1000 firings", float(np.median(ratios[1:]))]


if __name__ == "__main__":
    rows = [*crude_hammer(), *other_hammers()]
    columns = [Column(name=f"{which} difference", format=".1e") for which in ("largest", "median")]
    rooms = (*MOTION, "derivatives")
    settings = {"hammer": crude().fingerprint, "spacings": SIZES, "seed": 4}
    write("tangent", [Column(name="what"), *columns], rows, settings, rooms, hammers=())
    columns = [Column(name="train"), Column(name="time of the second pass / time of the run", format=".1f")]
    write("tangent-cost", columns, [cost()], {"firings": 1000}, rooms)
