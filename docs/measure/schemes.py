"""Measure how often a verdict on a panel of Fig. 11 is another one as the schemes of 1983 compute it.

The figures are those of ``printhammer reconstruct schemes``, which ship with the package. Run it with
``.venv/bin/python docs/measure/schemes.py``; it takes about an hour, or a share of it with --hammers.
"""

import argparse

from measured import MOTION, Cell, Column, write

from printhammer.reconstruction.judging.schemes import changes

HAMMERS = 100
SEED = 15
"""Of the random hammers."""

ROOMS = (*MOTION, "chaos/strobe", "reconstruction/judging/schemes", "reconstruction/search/space")


def main() -> None:
    """Measure the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--hammers", type=int, default=HAMMERS)
    count = parser.parse_args().hammers
    rows: list[list[Cell]] = []
    for row in changes(count, SEED):
        error = "" if row["share_error"] is None else f" ± {100.0 * row['share_error']:.1f}"
        share = f"{100.0 * row['share']:.1f}{error} %"
        ends = row["periodic_to_strange"], row["strange_to_periodic"]
        rows.append([row["first"], row["second"], row["panels"], share, *ends])
    columns = [Column(name="verdicts"), Column(name="compared with"), Column(name="panels", format="d")]
    columns += [Column(name="another verdict"), Column(name="periodic to strange", format="d")]
    columns.append(Column(name="strange to periodic", format="d"))
    write("schemes", columns, rows, {"hammers": count, "seed": SEED}, ROOMS)


if __name__ == "__main__":
    main()
