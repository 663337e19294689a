"""Measure safe rates with a compensation table and in open loop, for nominal and perturbed hammers.

Run ``.venv/bin/python docs/measure/tables.py``. For the shipped hammer and two hammers of its
family, the script tunes a table for all rates and writes one row; with ``--perturbed``, one row for each
perturbed hammer. It takes some ten minutes on two cores, and with ``--perturbed`` some five more for each
hammer.

``--history N`` and ``--robust`` are as for ``printhammer tune``. ``--hammer`` selects a name or a file
instead of the three hammers, and is repeatable. ``--keep FOLDER`` stores the tables, and reuses tables
already stored.
"""

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from measured import MOTION, Cell, Column, write
from studies.reconstruction.family.family import family_hammers

import printhammer as ph
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.report import PERTURBATIONS
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.rates.safe_rate import SafeRate
from printhammer.printing.rates.variability import Perturbation, perturbed

OTHERS = (5, 17)
"""Indices of the two hammers in the family."""

TOLERANCE = 5e-7
"""Display tolerance, used for all runs of this script."""

BETWEEN = 2.5
"""Shift of the grid of rates between the rates of the table, Hz."""

ROOMS = (
    *MOTION,
    "derivatives",
    "control/pulses",
    "control/table",
    "printing/dots",
    "printing/rates",
)


def finite(value: float) -> float | str:
    """Return a finite number, or "none" for any other value."""
    return float(value) if np.isfinite(value) else "none"


def hammers(names: list[str]) -> Iterator[ph.Hammer]:
    """Return the hammers with the given names, or the three default hammers."""
    if names:
        yield from (ph.load(name) for name in names)
        return
    family = list(family_hammers())
    yield ph.load("hendriks-1983")
    yield from (family[place] for place in OTHERS)


def tuned(
    hammer: ph.Hammer, history: int, robust: bool, kept: Path | None
) -> tuple[CompensationTable, float]:
    """Return a table for all rates, and the processor time of tuning, s; 0 for a stored table."""
    path = None if kept is None else kept / f"{hammer.fingerprint[:8]}-{history}{'-robust' * robust}.json"
    if path is not None and path.exists():
        return ph.load_table(path), 0.0
    begin = time.process_time()
    table = ph.tune(hammer, history=history, robust=robust)
    spent = time.process_time() - begin
    if path is not None:
        table.save(path)
    return table, spent


def rates_of(hammer: ph.Hammer, table: CompensationTable, by: Perturbation) -> tuple[SafeRate, SafeRate]:
    """Return the safe rates of a perturbed hammer, in open loop and with the table."""
    driven, single = perturbed(hammer, by), nominal(hammer, tolerance=TOLERANCE)
    last = float(table.rates[-1])
    options = {"nominal": single, "tolerance": TOLERANCE}
    return (
        ph.safe_rate(driven, **options),
        ph.safe_rate(driven, table.strategy(hammer), last=last, **options),
    )


def main() -> None:
    """Measure the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hammer", action="append", default=[])
    parser.add_argument("--history", type=int, default=1)
    parser.add_argument("--robust", action="store_true")
    parser.add_argument("--perturbed", action="store_true")
    parser.add_argument("--keep", type=Path)
    asked = parser.parse_args()
    if asked.keep is not None:
        asked.keep.mkdir(parents=True, exist_ok=True)
    rows: list[list[Cell]] = []
    used = []
    for hammer in hammers(asked.hammer):
        table, spent = tuned(hammer, asked.history, asked.robust, asked.keep)
        for by in PERTURBATIONS if asked.perturbed else PERTURBATIONS[:1]:
            plain, better = rates_of(hammer, table, by)
            between = None
            if by == Perturbation():
                # The grid begins at the first rate at which dots do not start from rest.
                found = ph.safe_rate(
                    hammer,
                    table.strategy(hammer),
                    first=float(table.rates[1]) + BETWEEN,
                    last=float(table.rates[-1]),
                    tolerance=TOLERANCE,
                )
                between = finite(found.rate)
            row: list[Cell] = [
                hammer.name.removeprefix("hendriks-1983-"),
                by.name,
                finite(plain.rate),
                finite(better.rate),
                finite(better.rate / plain.rate),
                between,
                int(table.rates.size),
                spent,
                better.failure.text if better.failure else "the table ends",
            ]
            print(*row, flush=True)
            rows.append(row)
        used.append(hammer.name)
    columns = [
        Column(name="hammer"),
        Column(name="driven"),
        Column(name="open loop", unit="Hz", format="g"),
        Column(name="table", unit="Hz", format="g"),
        Column(name="ratio", format=".2f"),
        Column(name="between", unit="Hz", format="g"),
        Column(name="rates"),
        Column(name="processor time of tuning", unit="s", format=".0f"),
        Column(name="what fails first with the table"),
    ]
    settings = {"history": asked.history, "robust": asked.robust, "hammers": used}
    name = "tables-perturbed" if asked.perturbed else "tables"
    write(name, columns, rows, settings, ROOMS, tuple(used))


if __name__ == "__main__":
    main()
