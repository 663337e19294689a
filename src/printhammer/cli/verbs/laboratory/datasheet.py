"""The verb `hammer from-datasheet`: what a maker prints, as a hammer file."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

import typer

from printhammer.cli import options as opt
from printhammer.cli.runner import Answer, Content, verb
from printhammer.cli.screen import Column, honesty, table
from printhammer.cli.terminal import warn
from printhammer.cli.verbs.laboratory.hammer import constants_table, numbered
from printhammer.errors import InputError, nearest

POOR = 0.15
"""Relative misfit of a force above which a fit is called poor."""


@verb(
    "hammer from-datasheet",
    "printhammer hammer from-datasheet --example impact-wire > sheet.toml"
    " && printhammer hammer from-datasheet sheet.toml --out wire.toml",
    out=opt.file("Write the hammer file here.", ".toml"),
)
def from_datasheet(
    sheet: Path | None = opt.argument("SHEET", "A data sheet, TOML.", type=Path, is_input=True),
    example: str | None = opt.text("NAME", "Print the data sheet of a shipped hammer, to begin with."),
) -> Answer:
    """Make a hammer of what a maker prints; every constant says whether it is printed, derived or assumed."""
    if example is not None:
        typer.echo(_example(example), nl=False)
        return Answer()
    if sheet is None:
        raise InputError("SHEET is missing", key="SHEET", expected="a data sheet; --example NAME prints one")
    from printhammer.identify.datasheet.build import hammer_of
    from printhammer.identify.datasheet.sheet import read_sheet

    read = read_sheet(sheet)
    made, magnet = hammer_of(read)
    if magnet.misfit > POOR:
        warn(
            f"{sheet}: a force is met to {100.0 * magnet.misfit:.2g} % only: poles that are not flat, or a"
            " typing error"
        )
    points = [
        (gap, force, of_law) for (gap, force), of_law in zip(read.force, magnet.forces.tolist(), strict=True)
    ]
    forces: tuple[Column[tuple[Any, Any, float]], ...] = (
        Column("gap", lambda row: f"{row[0].value:g} {row[0].unit}"),
        Column("printed", lambda row: f"{row[1].value:g} {row[1].unit}"),
        Column("of the law", lambda row: row[2], unit="N", format=".4g"),
    )
    sources = list(dict.fromkeys(constant.source for constant in made.constants.values()))
    return Answer(
        [
            f"[bold]{made.name}[/bold]  {honesty(made)}\n",
            constants_table(made, sources),
            *numbered(sources),
            "",
            table(forces, points, title="Forces"),
        ],
        files={"out": Content.text(made.to_toml)},
    )


def _example(name: str) -> str:
    folder = files("printhammer").joinpath("hammers", "sheets")
    known = sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir())
    if name not in known:
        raise InputError.of("--example", name, nearest(name, known))
    return folder.joinpath(f"{name}.toml").read_text(encoding="utf-8")
