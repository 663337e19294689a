"""The verbs `hammer show`, `check`, `schema` and `list`."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer

from printhammer.cli.run import HAMMER, HammerArgument, UnitsOption
from printhammer.cli.units import Units

app = typer.Typer(help="Show and check hammer files.", no_args_is_help=True)


@app.command("show", epilog="Example: printhammer hammer show hendriks-1983")
def show(
    hammer: HammerArgument = HAMMER,
    units: UnitsOption = Units.SI,
    toml: Annotated[
        bool, typer.Option("--toml", help="Print the hammer file instead, to start one of your own from.")
    ] = False,
) -> None:
    """Show every constant with its status and source, and where the armature can rest."""
    from printhammer.cli import hammer_screen
    from printhammer.cli.terminal import console
    from printhammer.hammer.hammer import load

    loaded = load(hammer)
    if toml:
        typer.echo(loaded.to_toml(), nl=False)
        return
    hammer_screen.show(loaded, units, console())


@app.command("check", epilog="Example: printhammer hammer check hendriks-1983")
def check(hammer: HammerArgument = HAMMER) -> None:
    """Check a hammer file: an error ends with status 2, a warning does not."""
    from rich.markup import escape

    from printhammer.cli.terminal import console, honesty, warn
    from printhammer.hammer.hammer import load

    loaded = load(hammer)
    told = loaded.warnings()
    screen = console()
    for warning in told:
        warn(f"{loaded.path}: {warning}")
    verdict = f"{len(told)} warning{'s' if len(told) > 1 else ''}" if told else "[green]ok[/green]"
    screen.print(f"{escape(hammer)}: {verdict}; {honesty(loaded)}", soft_wrap=True)


@app.command("schema", epilog="Example: printhammer hammer schema --out hammer.schema.json")
def schema(
    out: Annotated[Path | None, typer.Option(metavar="FILE", help="Write it here instead.")] = None,
) -> None:
    """Print the JSON schema of hammer files."""
    import json

    from printhammer.hammer.hammer import Hammer
    from printhammer.support.outputs import check_outputs, write_file

    text = json.dumps(Hammer.schema(), indent=2) + "\n"
    if out is None:
        typer.echo(text, nl=False)
        return
    check_outputs([out])
    write_file(out, text)
    typer.echo(f"wrote {out}")


@app.command("list", epilog="Example: printhammer hammer list")
def list_shipped() -> None:
    """List the hammers that come with the program."""
    from rich.markup import escape

    from printhammer.cli.terminal import console, plain_table
    from printhammer.hammer.hammer import load, shipped

    table = plain_table(("name", "left"), ("title", "left"))
    for name in shipped():
        table.add_row(name, escape(load(name).title))
    console().print(table)
