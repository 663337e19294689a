"""The program of the benchmark: ``python -m benchmarks.solvers``, from the root of the repository."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn

import typer
from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.main import run_program
from printhammer.cli.runner import Answer, Content, Job, announce_compiling, verb
from printhammer.cli.screen import Column, table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.console import RenderableType

    from benchmarks.solvers.report import Report, Rows

NAME: Final = "python -m benchmarks.solvers"
EXAMPLE: Final = f"{NAME} --quick --out build/bench.json"


@verb(
    "solvers",
    EXAMPLE,
    out=opt.file(
        "Output file for the results (.json) or the tables (.md); repeatable.",
        ".json",
        ".md",
        many=True,
    ),
)
def solvers(
    job: Job,
    quick: bool = opt.switch("Use short runs and a single round, to check that all solvers work."),
    threads: int | None = opt.whole("Maximum number of threads of the ensembles (default: 2)."),
    peers: str | None = opt.text("FOLDER", "Folder of other solvers, such as benchmarks/peers."),
) -> Answer:
    """Measure speed and error against a slow reference and other solvers, single runs and ensembles."""
    from benchmarks.solvers.entry import load_peers
    from benchmarks.solvers.run import run
    from printhammer.support.files import write_file

    others = None if peers is None else load_peers(Path(peers))
    announce_compiling()
    with job.status_line() as say:
        report = run(quick=quick, threads=threads, peers=others, say=say)
    texts = {".json": report.to_json, ".md": report.to_markdown}
    return Answer(
        described(report),
        files={"out": Content(lambda path: write_file(path, texts[path.suffix.lower()]()))},
    )


def described(report: Report) -> list[RenderableType]:
    """Render the tables of a report, and a description of the machine, for the terminal."""
    from benchmarks.solvers.report import FRAME_HEADS, MASS_HEADS, SOLVER_HEADS

    machine = ", ".join(f"{name} {value}" for name, value in report.machine.items())
    shown: list[RenderableType] = [f"[dim]{escape(machine)}[/dim]\n"]
    for title, ensembles in (("One run at a time", False), ("Ensembles, one thread", True)):
        shown += _table(title, SOLVER_HEADS, report.solvers(ensembles=ensembles))
        shown.append(escape(report.least_lead(ensembles=ensembles)) + "\n")
    shown += [f"[yellow]absent[/yellow] {escape(n)}: {escape(why)}" for n, why in report.absent.items()]
    figures = report.figures
    title = (
        f"Figure 9: {figures.rates} rates x {figures.pulses} pulses, {figures.times} times, errors in strokes"
    )
    return [
        *shown,
        *_table(title, FRAME_HEADS, report.frames()),
        *map(escape, report.frame_sentences()),
        *(f"compiling, {engine} engine: {seconds:.0f} s" for engine, seconds in report.compiling.items()),
        *_table("\nLong trains", MASS_HEADS, report.masses()),
        *_table("Growth with members", MASS_HEADS, report.growth()),
    ]


def _table(title: str, heads: tuple[str, ...], rows: Rows) -> list[RenderableType]:
    text = {"solver", "engine", "printhammer tolerance"}
    cells = [lambda row, k=k: escape(row[k]) for k in range(len(heads))]
    columns = [Column(escape(head), cell, left=head in text) for head, cell in zip(heads, cells, strict=True)]
    return [table(columns, rows, title=title), ""]


app: Final = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command(epilog=f"Example: {EXAMPLE}")(solvers.call)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the program with command-line arguments, by default those of the process, and exit."""
    run_program(app, NAME, arguments)


if __name__ == "__main__":
    main()
