"""The verbs `hammer show`, `check`, `schema`, `list` and `from-datasheet`."""

from __future__ import annotations

from importlib.resources import files
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Final

import typer
from rich.console import RenderableType
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from printhammer.cli import options as opt
from printhammer.cli.options import Units
from printhammer.cli.runner import Answer, Content, Job, verb
from printhammer.cli.screen import STATUS_STYLES, Column, render, status_counts, table
from printhammer.cli.terminal import warn
from printhammer.errors import InputError, nearest

if TYPE_CHECKING:
    from printhammer.hammer.equilibrium import EquilibriumPicture
    from printhammer.hammer.hammer import Hammer
    from printhammer.results import Summary
    from printhammer.support.constants import Constant

GROUP: Final = "Show and check hammer files."


@verb("hammer show", "printhammer hammer show hendriks-1983")
def show(
    hammer: str = opt.NAMED,
    units: Units = opt.UNITS,
    toml: bool = opt.switch("Print the hammer file, as a template for your own."),
) -> Answer:
    """Show each constant with its status and source, and the equilibria of the armature."""
    from printhammer.hammer.equilibrium import equilibrium_picture
    from printhammer.hammer.hammer import load

    loaded = load(hammer)
    if toml:
        typer.echo(loaded.to_toml(), nl=False)
        return Answer()
    sources = list(dict.fromkeys(constant.source for constant in loaded.constants.values()))
    picture = equilibrium_picture(loaded)
    for warning in loaded.warnings() if picture.rest is not None else [picture.no_rest]:
        warn(f"{loaded.path}: {warning}")
    title = f"  {escape(loaded.title)}" if loaded.title else ""
    note: list[RenderableType] = []
    if loaded.note.strip():
        words = escape(" ".join(loaded.note.split()))
        note.append(Padding(f"[italic]{words}[/italic]", (0, 0, 1, 2)))
    return Answer(
        [
            f"[bold]{escape(loaded.name)}[/bold]{title}",
            f"[dim]{escape(loaded.path)}, fingerprint {loaded.fingerprint[:16]}[/dim]",
            f"constants: {status_counts(loaded)}\n",
            *note,
            constants_table(loaded, sources),
            *numbered(sources),
            "",
            *render(statics(loaded, picture), units),
        ]
    )


@verb("hammer check", "printhammer hammer check hendriks-1983")
def check(hammer: str = opt.NAMED) -> Answer:
    """Check a hammer file; the exit status is 2 for an error, 0 for warnings only."""
    from printhammer.hammer.hammer import load

    loaded = load(hammer)
    warnings = loaded.warnings()
    for warning in warnings:
        warn(f"{loaded.path}: {warning}")
    count = f"{len(warnings)} warning{'s' if len(warnings) > 1 else ''}"
    return Answer(
        [f"{escape(hammer)}: {count if warnings else '[green]ok[/green]'}; {status_counts(loaded)}"]
    )


@verb(
    "hammer schema",
    "printhammer hammer schema --out hammer.schema.json",
    {"part": opt.PART},
    out=opt.file("Output file for the schema (default: the terminal)."),
)
def schema(job: Job) -> Answer:
    """Print the JSON schema of hammer files, including the laws registered with --part."""
    import json

    from printhammer.hammer.hammer import Hammer

    text = json.dumps(Hammer.schema(), indent=2) + "\n"
    if not job.outputs:
        typer.echo(text, nl=False)
    return Answer(files={"out": Content.text(lambda: text)})


@verb("hammer list", "printhammer hammer list")
def list_shipped() -> Answer:
    """List the shipped hammers."""
    from printhammer.hammer.hammer import load, shipped

    columns: tuple[Column[str], ...] = (
        Column("name", str, left=True),
        Column("title", lambda name: load(name).title, left=True),
    )
    return Answer([table(columns, shipped())])


def numbered(sources: list[str]) -> list[str]:
    """Return the numbered list of sources that the table of constants refers to."""
    lines = (f"[dim]{number}  {escape(source)}[/dim]" for number, source in enumerate(sources, 1))
    return ["\n[bold]sources[/bold]", *lines]


def constants_table(hammer: Hammer, sources: list[str]) -> Table:
    """Return the table of constants, in groups headed by the part and its law."""
    laws = {key: f"{'shape' if key == 'waveform' else 'law'} {law}" for key, law in hammer.laws.items()}
    files = hammer.files

    def cells(constant: Constant) -> tuple[str, ...]:
        own, style = constant.unit == constant.si_unit, STATUS_STYLES[constant.status]
        return (
            constant.key.rpartition(".")[2],
            format(constant.value, ".9g"),
            escape(constant.unit),
            "" if own else f"{constant.si:.6g}",
            "" if own else escape(constant.si_unit),
            f"[{style}]{constant.status}[/{style}]",
            f"[dim]{sources.index(constant.source) + 1}[/dim]",
            f"[dim]{escape(constant.meaning)}[/dim]",
        )

    numbers = "value", "SI", "source"
    heads = ("constant", "value", "unit", "SI", "", "status", "source", "meaning")
    made = table([Column(head, str, left=head not in numbers) for head in heads], ())
    groups = {
        section: list(group)
        for section, group in groupby(hammer.constants.values(), lambda each: each.key.rpartition(".")[0])
    }
    for section in (*groups, *(key for key in files if key not in groups)):
        if section:
            made.add_row("")
            law, file = laws.get(section, ""), escape(files.get(section, ""))
            made.add_row(f"[bold]\\[{section}][/bold]", f"[dim]{law}[/dim]", *[""] * 5, f"[dim]{file}[/dim]")
        for constant in groups.get(section, []):
            made.add_row(*cells(constant))
    return made


def statics(hammer: Hammer, picture: EquilibriumPicture) -> Summary:
    """Return the static properties: rest state, equilibria, release current and holding margin."""
    from printhammer.hammer.equilibrium import holding_margin
    from printhammer.results.summary import FactRow, Facts, Summary, judged, quantity, styled

    def force(margin: float) -> str:
        text = quantity(margin, "N")
        return text if margin > 0.0 else styled("poor", text)

    rest = styled("bad", "none")
    if picture.rest is not None:
        depth = None if hammer.position is None else hammer.position - picture.rest
        deep = f", {quantity(depth, 'm')} deep in the backstop" if depth else ""
        rest = quantity(picture.rest, "m") + deep
    rows: list[FactRow] = [("rest state", rest)]
    for point in picture.equilibria:
        kind = judged(point.stable, "stable" if point.stable else "unstable")
        rate = f", {point.frequency / 1e3:.3f} kHz" if point.frequency is not None else ""
        where = f", in the {point.surface}" if point.surface else ""
        rows.append(("equilibrium", f"{quantity(point.x, 'm')}  {kind}{rate}{where}"))
    if hammer.magnet is not None and hammer.backstop is not None:
        rows.append(("release current", quantity(picture.release_current, "A")))
    if hammer.magnet is not None or hammer.spring is not None:
        places = {"backstop": hammer.position, "pack": hammer.front, "platen": hammer.platen}
        rows += [
            (f"held at the {name}", force(float(holding_margin(hammer, x))))
            for name, x in places.items()
            if x is not None
        ]
        x, margin = picture.weakest
        rows.append(("held least", f"{force(margin)} at {quantity(x, 'm')}"))
    return Summary([Facts(rows, "statics, no current")])


POOR = 0.15
"""Relative deviation of a force from the data sheet above which the fit is called poor; arbitrary."""


@verb(
    "hammer from-datasheet",
    "printhammer hammer from-datasheet --example impact-wire > sheet.toml"
    " && printhammer hammer from-datasheet sheet.toml --out wire.toml",
    out=opt.file("Output hammer file (.toml).", ".toml"),
)
def from_datasheet(
    sheet: Path | None = opt.argument("SHEET", "Data sheet of a solenoid (TOML).", type=Path, is_input=True),
    example: str | None = opt.text("NAME", "Print the data sheet of a shipped hammer, as an example."),
) -> Answer:
    """Build a hammer from a manufacturer's data sheet; mark constants as printed, derived or assumed."""
    if example is not None:
        typer.echo(_example(example), nl=False)
        return Answer()
    if sheet is None:
        raise InputError("SHEET is missing", key="SHEET", expected="a data sheet; --example NAME prints one")
    from printhammer.identify.datasheet.build import hammer_of
    from printhammer.identify.datasheet.plausible import implausible, missed_limits
    from printhammer.identify.datasheet.sheet import read_sheet
    from printhammer.results import Cells, Grid, Summary

    read = read_sheet(sheet)
    made, magnet = hammer_of(read)
    if magnet.misfit > POOR:
        warn(
            f"{sheet}: the fit misses a force by {100.0 * magnet.misfit:.2g} %: the poles are not flat, or"
            " the sheet has a typing error"
        )
    for sentence in (*implausible(read, magnet.part), *missed_limits(read, made)):
        warn(f"{sheet}: {sentence}")
    gaps, printed = zip(*read.force, strict=True)
    forces = [
        Cells("gap", [f"{gap.value:g} {gap.unit}" for gap in gaps]),
        Cells("printed", [f"{force.value:g} {force.unit}" for force in printed]),
        Cells("of the law", magnet.forces, "N", ".4g"),
    ]
    sources = list(dict.fromkeys(constant.source for constant in made.constants.values()))
    return Answer(
        [
            f"[bold]{made.name}[/bold]  {status_counts(made)}\n",
            constants_table(made, sources),
            *numbered(sources),
            "",
            *render(Summary([Grid(forces, "Forces")])),
        ],
        files={"out": Content.text(made.to_toml)},
    )


def _example(name: str) -> str:
    folder = files("printhammer").joinpath("hammers", "sheets")
    known = sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir())
    if name not in known:
        raise InputError.of("--example", name, nearest(name, known))
    return folder.joinpath(f"{name}.toml").read_text(encoding="utf-8")
