"""Compare the reports of random compensation tables with long rows of dots, each in one simulation.

Run ``.venv/bin/python docs/measure/random_tables.py``, which takes some ten minutes. The script draws
hammers from the shipped hammer and its family, a rate from 500 to 1800 Hz, a history and a driver, and
tunes a table for that rate. It then prints rows of 200 dots in every slot,
every second and every third slot, and rows of random motifs, with the table on the hammer, and compares
the dots with the report of the table: no dot of a row may deviate more than the worst dot that the report
states, and no row may have a dot out of limits if the table passes. Rows are simulated from rest with an
error tolerance of 1e-10, and their dots are compared with the single pulse by this script alone.

``--tables N`` sets the number of tables, ``--seed N`` the seed of the random numbers.
"""

import argparse
from typing import NamedTuple

import numpy as np
from measured import MOTION, Cell, Column, write
from studies.reconstruction.family.family import family_hammers

import printhammer as ph
from printhammer.printing.dots.nominal import Nominal, nominal

DOTS = 200
RATES = 500.0, 1800.0
MOTIFS = 3
"""Number of random motifs per table; each has three to seven slots, and is repeated."""
TOLERANCE = 1e-10
FIRST = 1e-3
"""Time of slot 0 in the drives of a table, s."""
ALLOWED = 1e-3
"""Deviation, relative to a limit, within which a row agrees with the report: its runs have a tolerance of
1e-6."""
GROUPS = ("passes", "out of limits", "within limits, multiplier above 1", "no table")
ROOMS = (*MOTION, "derivatives", "control/pulses", "control/table", "printing/dots", "printing/rates")


class Outcome(NamedTuple):
    """Report of a table, and the rows printed with it: dots out of limits, and excess over the report."""

    group: str
    rows: int = 0
    dots: int = 0
    out: int = 0
    excess: float = 0.0


def drawn(rng: np.random.Generator, hammers: list[ph.Hammer]) -> tuple[ph.Hammer, float, int, str]:
    """Draw a hammer, a rate rounded to 1 Hz, a history and a driver."""
    hammer = hammers[int(rng.integers(len(hammers)))]
    rate = float(round(rng.uniform(*RATES)))
    return hammer, rate, int(rng.integers(1, 3)), ("own", "switch")[int(rng.integers(2))]


def patterns(rng: np.random.Generator) -> list[tuple[int, ...]]:
    """Return the rows: equal steps of one, two and three slots, and random motifs."""
    rows = [tuple(range(0, step * DOTS, step)) for step in (1, 2, 3)]
    for _ in range(MOTIFS):
        motif = rng.random(int(rng.integers(3, 8))) < 0.6
        motif[0] = True
        slots = np.flatnonzero(np.resize(motif, 3 * DOTS * motif.size))[:DOTS]
        rows.append(tuple(slots.tolist()))
    return rows


def deviations(
    hammer: ph.Hammer, drive: ph.PulseTrain, slots: tuple[int, ...], rate: float, single: Nominal
) -> tuple[np.ndarray, np.ndarray]:
    """Return the relative force and the arrival deviation, s, of each dot; infinite for a lost dot."""
    force, arrival = np.full((2, len(slots)), np.inf)
    dots = ph.simulate(hammer, drive, points=2, tolerance=TOLERANCE).dots
    for place, (slot, dot) in enumerate(zip(slots, dots, strict=True)):
        if dot.peak_force is not None and dot.flight_time is not None:
            force[place] = dot.peak_force / single.force - 1.0
            arrival[place] = dot.fired_at + dot.flight_time - (FIRST + slot / rate) - single.flight_time
    return np.abs(force), np.abs(arrival)


def judged(rng: np.random.Generator, hammer: ph.Hammer, rate: float, history: int, driver: str) -> Outcome:
    """Tune a table, and compare rows with its report."""
    try:
        table = ph.tune(hammer, rate=rate, history=history, driver=driver)
    except ph.InputError as error:
        print(error)
        return Outcome("no table")
    report = ph.judge_table(hammer, table, perturbations=[ph.Perturbation()])
    single, limits, strategy = nominal(hammer), report.limits, table.strategy(hammer)
    good, passed = bool((report.good[1] == 1.0).all()), bool(report.passed[1].all())
    group = GROUPS[0] if passed else GROUPS[2] if good else GROUPS[1]
    rows = patterns(rng)
    out, excess = 0, -np.inf
    for slots in rows:
        force, arrival = deviations(hammer, strategy(hammer, [slots], rate)[0], slots, rate, single)
        out += int(((force > limits.force) | (arrival > limits.arrival)).sum())
        if not report.lost[1].any():
            worst = (force.max() - report.force[1].max()) / limits.force
            excess = max(excess, worst, (arrival.max() - report.arrival[1].max()) / limits.arrival)
    return Outcome(group, len(rows), DOTS * len(rows), out, excess)


def main() -> None:
    """Measure the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tables", type=int, default=50)
    parser.add_argument("--seed", type=int, default=50)
    asked = parser.parse_args()
    hammers, rng = [ph.load("hendriks-1983"), *family_hammers()], np.random.default_rng(asked.seed)
    outcomes = []
    for number in range(asked.tables):
        hammer, rate, history, driver = drawn(rng, hammers)
        outcomes.append(judged(rng, hammer, rate, history, driver))
        print(number, hammer.name, rate, history, driver, *outcomes[-1], flush=True)
    rows: list[list[Cell]] = []
    for group in GROUPS:
        some = [each for each in outcomes if each.group == group]
        excess = max((each.excess for each in some), default=0.0)
        rows.append(
            [
                group,
                len(some),
                sum(each.rows for each in some),
                sum(each.dots for each in some),
                sum(each.out for each in some),
                sum(each.excess > ALLOWED for each in some),
                100.0 * excess if some and np.isfinite(excess) else None,
            ]
        )
    columns = [Column(name="report of the table")]
    columns += [Column(name=name) for name in ("tables", "rows", "dots", "dots out of limits")]
    columns.append(Column(name="tables with a dot worse than reported"))
    columns.append(Column(name="largest excess over the report", unit="% of a limit", format=".2g"))
    names = tuple(hammer.name for hammer in hammers)
    write("tables-random", columns, rows, {"tables": asked.tables, "seed": asked.seed}, ROOMS, names)


if __name__ == "__main__":
    main()
