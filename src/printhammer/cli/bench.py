"""The verb `bench`: this machine's figures, beside those of other solvers where a folder of them is named."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003
from typing import TYPE_CHECKING, Annotated

import typer

from printhammer.cli.numbers import whole

if TYPE_CHECKING:
    from rich.console import Console

    from printhammer.bench.report import Report, Rows

EXAMPLE = "Example: printhammer bench --quick --json build/bench.json"


def bench(
    quick: Annotated[
        bool, typer.Option("--quick", help="Short runs, one round: to see that everything works.")
    ] = False,
    threads: Annotated[
        str | None, typer.Option(metavar="N", help="Largest number of threads of ensembles (2).")
    ] = None,
    peers: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Other solvers, such as benchmarks/peers.")
    ] = None,
    json: Annotated[Path | None, typer.Option(metavar="FILE", help="Write the figures as JSON.")] = None,
    markdown: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the tables as Markdown.")
    ] = None,
) -> None:
    """Measure speed and error against a slow reference and other solvers, single runs and ensembles."""
    from printhammer import bench as benchmark
    from printhammer.bench.entry import load_peers
    from printhammer.cli.progress import telling
    from printhammer.cli.saving import say_written
    from printhammer.cli.terminal import announce_compiling, console
    from printhammer.support.outputs import check_outputs, write_file

    count = whole(threads, "threads")
    wanted = [path for path in (json, markdown) if path is not None]
    check_outputs(wanted)
    others = None if peers is None else load_peers(peers)
    announce_compiling()
    screen = console()
    with telling() as say:
        report = benchmark.run(quick=quick, threads=count, peers=others, say=say)
    _show(report, screen)
    if json is not None:
        write_file(json, report.to_json())
    if markdown is not None:
        write_file(markdown, report.to_markdown())
    for path in wanted:
        say_written(screen, path)


def _show(report: Report, screen: Console) -> None:
    from rich.markup import escape

    from printhammer.bench.report import FRAME_HEADS, MASS_HEADS, SOLVER_HEADS

    told = ", ".join(f"{name} {value}" for name, value in report.machine.items())
    screen.print(f"[dim]{escape(told)}[/dim]\n", soft_wrap=True)
    _table(screen, "One run at a time", SOLVER_HEADS, report.solvers(ensembles=False))
    screen.print(escape(report.least_lead(ensembles=False)) + "\n", soft_wrap=True)
    _table(screen, "Ensembles, one thread", SOLVER_HEADS, report.solvers(ensembles=True))
    screen.print(escape(report.least_lead(ensembles=True)) + "\n", soft_wrap=True)
    for name, reason in report.absent.items():
        screen.print(f"[yellow]absent[/yellow] {escape(name)}: {escape(reason)}", soft_wrap=True)
    figures = report.figures
    title = (
        f"Figure 9: {figures.rates} rates x {figures.pulses} pulses, {figures.times} times, errors in strokes"
    )
    _table(screen, title, FRAME_HEADS, report.frames())
    for sentence in report.frame_sentences():
        screen.print(escape(sentence), soft_wrap=True)
    for engine, seconds in report.compiling.items():
        screen.print(f"compiling, {engine} engine: {seconds:.0f} s", soft_wrap=True)
    _table(screen, "\nLong trains", MASS_HEADS, report.masses())
    _table(screen, "Growth with members", MASS_HEADS, report.growth())


def _table(screen: Console, title: str, heads: tuple[str, ...], rows: Rows) -> None:
    from rich.markup import escape

    from printhammer.cli.terminal import plain_table

    text = {"solver", "engine", "ours as exact"}
    table = plain_table(*((escape(head), "left" if head in text else "right") for head in heads), title=title)
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    screen.print(table)
    screen.print()
