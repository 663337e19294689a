"""The verb `bench`: this machine's figures, beside those of other solvers where a folder of them is named."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich.markup import escape

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, Job, announce_compiling, verb
from printhammer.cli.screen import Column, table

if TYPE_CHECKING:
    from rich.console import RenderableType

    from printhammer.bench.report import Report, Rows


@verb(
    "bench",
    "printhammer bench --quick --out build/bench.json",
    out=opt.file(
        "Figures (.json) or tables (.md); may be given repeatedly.",
        ".json",
        ".md",
        many=True,
        older=("json", "markdown"),
    ),
)
def bench(
    job: Job,
    quick: bool = opt.switch("Short runs, one round: to see that everything works."),
    threads: int | None = opt.whole("Largest number of threads of ensembles (2)."),
    peers: str | None = opt.text("FOLDER", "Other solvers, such as benchmarks/peers."),
) -> Answer:
    """Measure speed and error against a slow reference and other solvers, single runs and ensembles."""
    from printhammer import bench as benchmark
    from printhammer.bench.entry import load_peers
    from printhammer.support.outputs import write_file

    others = None if peers is None else load_peers(Path(peers))
    announce_compiling()
    with job.telling() as say:
        report = benchmark.run(quick=quick, threads=threads, peers=others, say=say)
    texts = {".json": report.to_json, ".md": report.to_markdown}
    return Answer(
        described(report),
        files={"out": Content(lambda path: write_file(path, texts[path.suffix.lower()]()))},
    )


def described(report: Report) -> list[RenderableType]:
    """Return the tables of a report, and what they say of this machine."""
    from printhammer.bench.report import FRAME_HEADS, MASS_HEADS, SOLVER_HEADS

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
    text = {"solver", "engine", "ours as exact"}
    cells = [lambda row, k=k: escape(row[k]) for k in range(len(heads))]
    columns = [Column(escape(head), cell, left=head in text) for head, cell in zip(heads, cells, strict=True)]
    return [table(columns, rows, title=title), ""]
