"""Measure the effect of rounding the times of a table to whole ticks of a timer.

Run ``.venv/bin/python docs/measure/ticks.py``. For the shipped hammer, the script tunes a table
for all rates and computes its safe rate for increasing ticks. For tables at 1.5 times the open-loop safe
rate, it computes the worst dot on the nominal hammer, and the dots within limits on hammers drawn from
the variability of a production. It takes some ten minutes on one core.

``--units N`` sets the number of hammers; ``--keep FOLDER`` is as for ``tables.py``; ``--curves FILE``
only draws the measured table.
"""

import argparse
from importlib import import_module
from io import BytesIO
from pathlib import Path

import numpy as np
from measured import MOTION, Cell, Column, read, write
from tables import finite, tuned

import printhammer as ph
from printhammer.control.table.compensation import CompensationTable
from printhammer.printing.dots.judging import Limits
from printhammer.printing.dots.nominal import nominal
from printhammer.printing.dots.strategy import LEAD_IN, cycle_with_lead_in, slots_of
from printhammer.printing.dots.trial import Case, Trial, attempt
from printhammer.printing.rates.variability import Variability
from printhammer.run.ensemble import DISPLAY_TOLERANCE

SHARE = 1.5
"""Rate of the single-rate tables, as a multiple of the open-loop safe rate."""
TICKS = (None, "1 us", "2 us", "5 us", "10 us", "20 us")
ROOMS = (
    *MOTION,
    "derivatives",
    "control/pulses",
    "control/table",
    "printing/dots",
    "printing/rates",
)


def printed(units: list[ph.Hammer], hammer: ph.Hammer, table: CompensationTable, rate: float) -> Trial:
    """Return the dots of the cycle that hammers print with a table."""
    single = nominal(hammer, tolerance=DISPLAY_TOLERANCE)
    return attempt(
        [Case(unit, single, rate) for unit in units],
        [slots_of(cycle_with_lead_in())],
        table.strategy(hammer),
        limits=Limits(),
        tolerance=DISPLAY_TOLERANCE,
        judged_from=LEAD_IN,
    )


def worst(trial: Trial) -> float:
    """Return the largest deviation of a dot, as a fraction of the limits."""
    judgement, limits = trial.judgement, Limits()
    force = np.abs(judgement.force_deviation[judgement.wanted]) / limits.force
    arrival = np.abs(judgement.arrival_deviation[judgement.wanted]) / limits.arrival
    return float(np.fmax(force, arrival).max())


def measure(hammer: ph.Hammer, units: list[ph.Hammer], rate: float, kept: Path | None) -> list[list[Cell]]:
    """Return one row for each tick."""
    (whole, _time), rows = tuned(hammer, 1, robust=False, kept=kept), []
    tables = {driver: ph.tune(hammer, rate=rate, driver=driver) for driver in ("own", "switch")}
    for tick in TICKS:
        ticked = {name: table if tick is None else table.quantised(tick) for name, table in tables.items()}
        fired = whole if tick is None else whole.quantised(tick)
        safe = ph.safe_rate(
            hammer, fired.strategy(hammer), last=float(whole.rates[-1]), tolerance=DISPLAY_TOLERANCE
        )
        row: list[Cell] = ["exact" if tick is None else tick, finite(safe.rate)]
        row.append(whole.size() if tick is None else whole.size(tick))
        for table in ticked.values():
            good = printed(units, hammer, table, rate).judgement
            share = good.good.sum() / good.wanted.sum()
            row += [finite(worst(printed([hammer], hammer, table, rate))), 100.0 * float(share)]
        rows.append(row)
        print(*row, flush=True)
    return rows


def known(ticks: list[float], rows: list[list[Cell]], column: int) -> tuple[list[float], list[float]]:
    """Return the ticks at which a column has a number, and the numbers."""
    points = [(tick, row[column]) for tick, row in zip(ticks, rows, strict=True)]
    numbers = [(tick, value) for tick, value in points if isinstance(value, float)]
    return [tick for tick, _ in numbers], [value for _, value in numbers]


def curves(path: Path) -> None:
    """Draw the safe rate and the worst deviation against the tick."""
    style = import_module("printhammer.figures.elements.style")
    measured = read("ticks")
    rows, safe, rate = measured.rows, measured.settings["safe rate"], measured.settings["rate"]
    ticks = [0.0 if row[0] == "exact" else float(str(row[0]).split()[0]) for row in rows]
    with style.in_style():
        figure = style.new_figure(3.2)
        left, right = figure.subplots(1, 2)
        left.plot(*known(ticks, rows, 1), color=style.BLUE, marker="o")
        left.axhline(safe, color=style.MUTED, linestyle="--")
        left.annotate(
            "open loop", (known(ticks, rows, 1)[0][-1], safe), ha="right", va="bottom", fontsize=style.SMALL
        )
        left.set_ylim(0.0, None)
        left.set_ylabel("Safe rate of a table over all rates  [Hz]")
        for column, name, colour in ((3, "own pulse", style.ORANGE), (5, "fast switch", style.BLUE)):
            right.plot(*known(ticks, rows, column), color=colour, marker="o", label=name)
        right.axhline(1.0, color=style.MUTED, linestyle="--")
        right.set_ylim(0.0, None)
        right.set_ylabel(f"Worst dot at {rate:,g} Hz  [limits]")
        right.legend(fontsize=style.SMALL, frameon=False)
        for ax in (left, right):
            ax.margins(x=0.05)
            ax.set_xlabel("Tick of the timer  [µs]")
        style.foot(figure, next(iter(measured.hammers)))
        drawn = BytesIO()
        figure.savefig(drawn, dpi=110)
    path.write_bytes(drawn.getvalue())


def main() -> None:
    """Measure the table, or draw the measured table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--curves", type=Path)
    parser.add_argument("--keep", type=Path)
    asked = parser.parse_args()
    if asked.curves is not None:
        curves(asked.curves)
        return
    hammer = ph.load("hendriks-1983")
    safe = ph.safe_rate(hammer).rate
    rate = SHARE * safe
    rows = measure(hammer, Variability().draw(hammer, asked.units, asked.seed), rate, asked.keep)
    heads = [
        Column(name="tick"),
        Column(name="safe rate", unit="Hz", format="g"),
        Column(name="table over all rates", unit="bytes"),
        Column(name=f"{rate:,g} Hz, own pulse: worst dot, as a multiple of the limits", format=".2f"),
        Column(name="its units' dots within limits", unit="%", format=".1f"),
        Column(name=f"{rate:,g} Hz, fast switch: worst dot, as a multiple of the limits", format=".2f"),
        Column(name="its units' dots within limits, switch", unit="%", format=".1f"),
    ]
    write(
        "ticks",
        heads,
        rows,
        {"units": asked.units, "seed": asked.seed, "safe rate": safe, "rate": rate},
        ROOMS,
    )


if __name__ == "__main__":
    main()
