"""Measure the work of least-work bursts.

Run ``.venv/bin/python docs/measure/energy.py``, which takes some minutes. The first table is for
eight dots at 1 kHz from rest to rest, including the settle-out, for the shipped hammer and five hammers
of its family; the second for several rates, for two of these hammers.
"""

from measured import MOTION, Cell, Column, write
from studies.reconstruction.family.family import family_hammers

import printhammer as ph
from printhammer.control.least_work.burst import NoBurstError

FAMILY = ("02", "06", "10", "14", "18")
FORCES = (0.9, 1.1, 1.2)
RATES = (1000.0, 1250.0, 1500.0)
DOTS = 8
ROOMS = (*MOTION, "control/least_work", "control/pulses", "printing/dots")
SINGLE, POSITIVE, LEAST = 2, 4, 5
"""Indices in the cells of `burst`: ratio of the single pulse, positive work, and lower bound."""


def hammers() -> list[ph.Hammer]:
    """Return the shipped hammer and five hammers of the family."""
    chosen = [hammer for hammer in family_hammers() if hammer.name.rpartition("-")[2] in FAMILY]
    return [ph.load("hendriks-1983"), *chosen]


def short(hammer: ph.Hammer) -> str:
    """Return the name of a hammer as written on the pages."""
    return hammer.name.replace("hendriks-1983-family", "family")


def burst(hammer: ph.Hammer, force: float, rate: float) -> list[Cell]:
    """Compute a least-work burst; return the cells of its row."""
    cells: list[Cell] = []
    try:
        found = ph.least_work(hammer, rate, dots=DOTS, force=force)
    except NoBurstError:
        cells += ["none found", *[None] * 7]
    else:
        ledger, absorbed = found.ledger, found.ledger.pack_loss
        cells += [
            f"{found.adequate} of {found.count}",
            float(found.drive.peak),
            float(found.single_ratio),
            float(found.net_ratio),
            float(found.positive_ratio),
            float(found.bound_ratio),
            float(ledger.backstop_loss / absorbed),
            float(ledger.residual / ledger.throughput),
        ]
    print(hammer.name, f"{force:g}, {rate:g} Hz:", *cells, flush=True)
    return cells


def main() -> None:
    """Measure the tables: by force at the first rate, and by rate at the first force."""
    chosen = hammers()
    rows: list[list[Cell]] = []
    for hammer in chosen:
        bursts = [burst(hammer, force, RATES[0]) for force in FORCES]
        single = next((cells[SINGLE] for cells in bursts if cells[SINGLE] is not None), None)
        costs = [cells[place] for cells in bursts for place in (POSITIVE, LEAST)]
        rows.append([short(hammer), single, *costs])
    columns = [Column(name="hammer"), Column(name="W, single pulse", format=".2f")]
    for force in FORCES:
        columns += [Column(name=f"{what}, force {force}", format=".3f") for what in ("W+", "least")]
    settings = {"dots": DOTS, "rate": RATES[0], "forces": FORCES}
    names = tuple(hammer.name for hammer in chosen)
    write("energy", columns, rows, settings, ROOMS, names)
    pair = (chosen[0], chosen[-1])
    rows = [
        [short(hammer), rate, *(cells[place] for place in (POSITIVE, LEAST))]
        for hammer in pair
        for rate in RATES
        for cells in [burst(hammer, FORCES[0], rate)]
    ]
    columns = [Column(name="hammer"), Column(name="rate", unit="Hz", format="g")]
    columns += [Column(name=what, format=".3f") for what in ("W+", "least")]
    settings = {"dots": DOTS, "rates": RATES, "force": FORCES[0]}
    write("energy-rates", columns, rows, settings, ROOMS, (names[0], names[-1]))


if __name__ == "__main__":
    main()
