"""Write the table of panels of Fig. 11 that the schemes of 1983 classify wrongly, from the shipped data.

The comparison itself takes an hour and is computed by ``python -m studies.reconstruction schemes``; this
script writes its table for the pages. Run ``.venv/bin/python docs/measure/schemes.py``.
"""

from measured import MOTION, Cell, Column, write

from printhammer.report.reconstruction.results import shipped_results

STUDY = tuple(f"studies/reconstruction/{room}" for room in ("family", "judging", "lines", "search"))
ROOMS = (*MOTION, "chaos", "claims", "derivatives", "maps", "printing", "report/reconstruction", *STUDY)


def main() -> None:
    """Write the table."""
    found = shipped_results().schemes
    assert found is not None
    rows: list[list[Cell]] = []
    for row in found.changes:
        error = "" if row.share_error is None else f" ± {100.0 * row.share_error:.1f}"
        share = f"{100.0 * row.share:.1f}{error} %"
        ends = row.periodic_to_strange, row.strange_to_periodic
        rows.append([row.first, row.second, row.panels, share, *ends])
    columns = [Column(name="verdicts"), Column(name="compared with"), Column(name="panels", format="d")]
    columns += [Column(name="another verdict"), Column(name="periodic to strange", format="d")]
    columns.append(Column(name="strange to periodic", format="d"))
    write("schemes", columns, rows, {"hammers": found.hammers, "seed": found.seed}, ROOMS)


if __name__ == "__main__":
    main()
