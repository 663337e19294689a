"""Compare three strategies to drive a hammer: open loop, a compensation table, and feedback.

Run ``.venv/bin/python docs/measure/ways.py [HAMMER] [--rate RATE]``. The script measures the dots within
limits on a page of several lines at each rate, and the deviations of the second of two dots for a range of
gaps, which takes a few minutes. With ``--picture FILE``, it only draws one line printed with each strategy at
the last rate: the figure of the README, ``docs/images/ways.png``.
"""

import argparse
from io import BytesIO
from pathlib import Path

import numpy as np
from measured import MOTION, Cell, Column, write
from tables import tuned

import printhammer as ph
from printhammer.control.feedback.closed_loop import FeedbackStrategy
from printhammer.control.feedback.comparison import Feedback
from printhammer.control.feedback.controller import Controller
from printhammer.control.feedback.plant import driver_of
from printhammer.printing.dots.strategy import Strategy, open_loop
from printhammer.printing.page.page import Page

RATES = ("1 kHz", "1.3 kHz", "1.6 kHz")
TEXT = "The quick brown fox\njumps over the lazy dog\n0123456789 !?"
ROOMS = (*MOTION, "derivatives", "control/feedback", "control/pulses", "control/table", "printing")
LINE = "Bounce and chaos 1983"


def ways_at(hammer: ph.Hammer, rate: str, controller: Controller) -> list[Strategy]:
    """Return the three strategies; the table is tuned for the rate."""
    table = ph.tune(hammer, rate=rate, history=2)
    return [open_loop, table.strategy(hammer), FeedbackStrategy(controller)]


def page_row(page: Page) -> list[Cell]:
    """Return a table row with the dots within limits on a page."""
    on = page.printed
    force, place = 100.0 * (page.force_ratio[on] - 1.0), 1e6 * page.placement_error[on]
    return [
        float(page.rate),
        str(page.strategy),
        int(page.lost.sum()),
        int(page.good.sum()),
        f"{force.min():+.1f} to {force.max():+.1f}",
        f"{np.std(place):.1f}, {np.abs(place).max():.1f}",
    ]


def pair_rows(found: Feedback) -> list[list[Cell]]:
    """Return the deviations of the second of two dots, one row per strategy."""
    rows: list[list[Cell]] = []
    for number, name in enumerate(found.strategies):
        force, arrival = found.gap_force[number], found.gap_arrival[number]
        known = np.isfinite(force)
        good = (np.abs(force) <= found.limits.force) & (np.abs(arrival) <= found.limits.arrival)
        off, late = 100.0 * force[known], 1e6 * arrival[known]
        extremes = [f"{off.min():+.1f} to {off.max():+.1f}", f"{late.min():+.0f} to {late.max():+.0f}"]
        rows.append([name, f"{good.sum()} of {good.size}", *extremes])
    return rows


def picture(pages: list[Page], path: Path) -> None:
    """Draw the same line printed with each strategy, one below the other."""
    from matplotlib.figure import Figure
    from matplotlib.image import imread

    figure = Figure(figsize=(7.6, 1.0 * len(pages)), layout="constrained")
    for ax, page in zip(figure.subplots(len(pages)), pages, strict=True):
        sheet = BytesIO()
        page.plot(view="sheet").savefig(sheet, format="png", dpi=300)
        sheet.seek(0)
        ax.imshow(imread(sheet), interpolation="antialiased")
        ax.axis("off")
        told = f"{page.strategy}: {int(page.good.sum())} of {page.line.size} dots within limits"
        ax.set_title(f"{page.rate:.0f} Hz, {told}", loc="left", fontsize=8)
    figure.savefig(path, dpi=160)


def main() -> None:
    """Read the arguments; measure the tables or draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("hammer", nargs="?", default="hendriks-1983")
    parser.add_argument("--rate", action="append", dest="rates")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--keep", type=Path, help="folder of tables over all rates, as for tables.py")
    given = parser.parse_args()
    hammer = ph.load(given.hammer)
    controller = Controller(hammer, driver_of(hammer))
    if given.picture is not None:
        rate = (given.rates or RATES)[-1]
        ways = ways_at(hammer, rate, controller)
        picture([ph.print_page(hammer, LINE, rate, strategy=way) for way in ways], given.picture)
        return
    rows: list[list[Cell]] = []
    for rate in given.rates or RATES:
        ways = ways_at(hammer, rate, controller)
        for way in ways:
            rows.append(page_row(ph.print_page(hammer, TEXT, rate, strategy=way)))
            print(*rows[-1], flush=True)
    columns = [
        Column(name="rate", unit="Hz", format=".0f"),
        Column(name="way"),
        Column(name="lost"),
        Column(name="within limits"),
        Column(name="force", unit="%"),
        Column(name="placement: spread, worst", unit="µm"),
    ]
    settings = {"rates": given.rates or RATES, "text": TEXT}
    write("ways-pages", columns, rows, settings, ROOMS, (hammer.name,))
    table, _time = tuned(hammer, 1, robust=False, kept=given.keep)
    found = ph.feedback(
        hammer,
        table.rates[-1],
        beside=[table.strategy(hammer)],
        gaps=np.arange(1.0 / table.rates[-1], 3e-3, 40e-6),
    )
    columns = [Column(name="way"), Column(name="within limits"), Column(name="force", unit="%")]
    settings = {"gaps, ms": [round(1e3 * float(found.gaps[place]), 3) for place in (0, -1)]}
    columns.append(Column(name="arrival", unit="µs"))
    write("ways-pairs", columns, pair_rows(found), settings, ROOMS, (hammer.name,))


if __name__ == "__main__":
    main()
