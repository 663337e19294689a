"""The verb `paper`: every figure and claim of the paper, in one report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from printhammer.cli.run import HAMMER, HammerArgument

EXAMPLE = "Example: printhammer paper hendriks-1983 --out build/paper"

_STYLES = {"holds": "green", "fails": "red", "not yet": "yellow"}


def paper(
    hammer: HammerArgument = HAMMER,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where to write the report.")] = Path(
        "build/paper"
    ),
    pdf: Annotated[bool, typer.Option("--pdf", help="Write the report as report.pdf too.")] = False,
    strict: Annotated[bool, typer.Option("--strict", help="End with status 1 if a claim fails.")] = False,
) -> None:
    """Draw the figures, judge the claims, and write one HTML report, the figures and claims.json."""
    from rich.markup import escape

    from printhammer.cli.progress import telling
    from printhammer.cli.saving import say_written
    from printhammer.cli.terminal import announce_compiling, console, load_checked, plain_table
    from printhammer.report import write_report

    loaded = load_checked(hammer)
    announce_compiling()
    screen = console()
    with telling() as say:
        report = write_report(loaded, out, progress=say, pdf=pdf)
    table = plain_table(("claim", "left"), ("kind", "left"), ("verdict", "left"), ("measured", "left"))
    for result in report.results:
        style = _STYLES[result.verdict]
        table.add_row(
            result.claim.name,
            result.claim.kind,
            f"[{style}]{result.verdict}[/{style}]",
            escape(result.detail),
        )
    screen.print(table)
    counts = ", ".join(
        f"[{style}]{report.count(verdict)} {verdict}[/{style}]" for verdict, style in _STYLES.items()
    )
    screen.print(f"\n{len(report.results)} claims: {counts}")
    whole = [path for path in report.files if path.parent == out]
    for path in whole:
        say_written(screen, path)
    pictures = len(report.files) - len(whole)
    screen.print(f"[dim]wrote[/dim] {out / 'figures'}, {pictures} files", soft_wrap=True)
    if strict and report.count("fails"):
        raise typer.Exit(1)
