"""The verb `figure`: one figure of the paper, for any hammer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from printhammer.cli.numbers import whole
from printhammer.cli.run import HAMMER, HammerArgument

EXAMPLE = "Example: printhammer figure 3 hendriks-1983 --out build/figures"
_POINCARE: Final = 11


def figure(
    number: Annotated[str, typer.Argument(metavar="N", help="Number of the figure in the paper.")],
    hammer: HammerArgument = HAMMER,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where to write it.")] = Path("build/figures"),
) -> None:
    """Draw a figure of the paper as SVG, PNG and PDF."""
    from printhammer.cli.saving import say_written
    from printhammer.cli.terminal import announce_compiling, console, load_checked
    from printhammer.errors import InputError
    from printhammer.figures import FIGURES, save
    from printhammer.support.outputs import make_folder

    entry = FIGURES.get(whole(number, "figure") or 0)
    if entry is None:
        known = ", ".join(map(str, FIGURES))
        raise InputError(f"figure = {number}: expected one of {known}")
    loaded = load_checked(hammer)
    make_folder(out)
    announce_compiling()
    screen = console()
    screen.print(f"[bold]Figure {entry.number}[/bold]  {entry.title}")
    options = {}
    if entry.number == _POINCARE:
        from printhammer.claims.verdicts import printed_verdicts

        options["printed"] = printed_verdicts()
    for path in save(entry.draw(loaded, **options), out, f"figure{entry.number:02d}"):
        say_written(screen, path)
