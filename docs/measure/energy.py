"""Measure what bursts of least work cost, and print the tables of the page on them.

Run it with ``.venv/bin/python docs/measure/energy.py``; it takes some minutes. Eight dots at 1 kHz, rest to
rest, the settle-out included, for the shipped hammer and five of its family; then the rates, for two of them.
"""

import printhammer as ph
from printhammer.control.least_work.burst import NoBurstError
from printhammer.reconstruction.family.family import family_hammers

FAMILY = ("02", "06", "10", "14", "18")
FORCES = (0.9, 1.1, 1.2)
RATES = (1000.0, 1250.0, 1500.0)
DOTS = 8


def hammers() -> list[ph.Hammer]:
    """Return the shipped hammer and five of the family."""
    chosen = [hammer for hammer in family_hammers() if hammer.name.rpartition("-")[2] in FAMILY]
    return [ph.load("hendriks-1983"), *chosen]


def heading(*cells: str) -> None:
    """Print the first two lines of a table."""
    print("\n| " + " | ".join(cells) + " |")
    print("|" + "---|" * len(cells))


def row(hammer: ph.Hammer, force: float, rate: float, first: str) -> None:
    """Print a line of a table: a burst."""
    cells = [hammer.name, first]
    try:
        found = ph.least_work(hammer, rate, dots=DOTS, force=force)
    except NoBurstError:
        cells += ["none found", *["–"] * 6]
    else:
        ledger, absorbed = found.ledger, found.ledger.pack_loss
        cells += [
            f"{found.adequate} of {found.count}",
            f"{found.drive.peak:.2f}",
            f"{found.single_ratio:.2f}",
            f"{found.net_ratio:.4f}",
            f"{found.positive_ratio:.3f}",
            f"{found.bound_ratio:.3f}",
            f"{ledger.backstop_loss / absorbed:.4f}",
            f"{ledger.residual / ledger.throughput:.0e}",
        ]
    print("| " + " | ".join(cells) + " |", flush=True)


def main() -> None:
    """Print the tables."""
    common = (
        "adequate dots", "peak (A)", "W, single pulse", "W", "W+", "least W+", "backstop",
        "residual / throughput",
    )  # fmt: skip
    heading("hammer", "force", *common)
    for force in FORCES:
        for hammer in hammers():
            row(hammer, force, 1000.0, f"{force:g}")
    heading("hammer", "rate (Hz)", *common)
    shipped, *_, last = hammers()
    for hammer in (shipped, last):
        for rate in RATES[1:]:
            row(hammer, FORCES[0], rate, f"{rate:g}")


if __name__ == "__main__":
    main()
