"""Measure the fraction of a production that prints within limits, for several spreads and rates.

Run ``.venv/bin/python docs/measure/yields.py``, which takes some minutes.
"""

from measured import MOTION, Cell, Column, write
from studies.reconstruction.family.family import family_hammers

import printhammer as ph

NUMBER = 256
"""Number of hammers drawn for each entry."""

SPREADS = (("own", 0.01), ("own", 0.02), ("design", 0.01))
"""Reference single pulse of each column, and the relative spread of the constants."""

RATES = {
    "hendriks-1983": {400.0: (2,), 750.0: (0, 1), 800.0: (0, 1, 2)},
    "hendriks-1983-family-06": {400.0: (2,), 900.0: (0, 1, 2), 925.0: (0, 1)},
}
"""Rates of each hammer, Hz, with the indices in `SPREADS` to measure at each rate."""


def main() -> None:
    """Measure the table."""
    known = {hammer.name: hammer for hammer in family_hammers()}
    rows: list[list[Cell]] = []
    for name, rates in RATES.items():
        hammer = known[name] if name in known else ph.load(name)
        own = float(ph.safe_rate(hammer).rate)
        for rate, places in rates.items():
            cells: list[Cell] = [None] * len(SPREADS)
            for place in places:
                judged, spread = SPREADS[place]
                found = ph.tolerance_yield(hammer, rate, number=NUMBER, spreads=spread, judged_by=judged)
                cells[place] = f"{100.0 * found.share:.1f} ± {100.0 * found.share_error:.1f} %"
            rows.append([name.replace("hendriks-1983-family", "family"), own, rate, *cells])
            print(*rows[-1], flush=True)
    columns = [Column(name="hammer"), Column(name="its safe rate", unit="Hz", format="g")]
    columns.append(Column(name="rate", unit="Hz", format="g"))
    columns += [Column(name=name) for name in ("1 %", "2 %", "1 %, judged by the design")]
    settings = {"number": NUMBER, "spreads": SPREADS}
    write(
        "yields",
        columns,
        rows,
        settings,
        (*MOTION, "derivatives", "printing/dots", "printing/rates"),
        tuple(RATES),
    )


if __name__ == "__main__":
    main()
