"""What the command line prints, and where."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape
from rich.table import Table

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

_WIDTH = 120


def console() -> Console:
    """Return the console of the standard output; wide enough for tables where it is no terminal."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH)


def complain(sentence: str) -> None:
    """Print one line on the standard error."""
    text = " ".join(sentence.split())
    Console(stderr=True, highlight=False, soft_wrap=True).print(f"[red]printhammer:[/red] {escape(text)}")


def say(sentence: str) -> None:
    """Print a remark on the standard error, so that it does not get into what is piped on."""
    Console(stderr=True, highlight=False, soft_wrap=True).print(f"[dim]{escape(sentence)}[/dim]")


def load_checked(name: str) -> Hammer:
    """Load a hammer that is to be run; print what is odd about it as warnings.

    Raises
    ------
    InputError
        There is no such hammer, or it does not rest at its backstop.
    """
    from printhammer.hammer.hammer import load

    hammer = load(name)
    for warning in hammer.warnings():
        warn(f"{hammer.path}: {warning}")
    return hammer


def warn(sentence: str) -> None:
    """Print a warning on the standard error."""
    err = Console(stderr=True, highlight=False, soft_wrap=True)
    err.print(f"[yellow]warning:[/yellow] {escape(sentence)}")


def announce_compiling() -> None:
    """Have the user told when machine code is made, which takes a while once."""
    from printhammer.run.simulate import announce_compiling

    announce_compiling(say)


def plain_table(*columns: tuple[str, str], title: str | None = None) -> Table:
    """Return an empty table without frame; columns as (heading, "left" or "right")."""
    table = Table(box=None, pad_edge=False, title=title, title_justify="left", title_style="bold")
    for heading, side in columns:
        table.add_column(
            heading, justify="right" if side == "right" else "left", header_style="bold", vertical="bottom"
        )
    return table


STATUS_STYLES = {"stated": "green", "derived": "cyan", "reconstructed": "yellow", "assumed": "magenta"}


def honesty(hammer: Hammer) -> str:
    """Say in one line how much of a hammer is known; rich markup."""
    counts: dict[str, int] = {}
    for constant in hammer.constants.values():
        counts[constant.status] = counts.get(constant.status, 0) + 1
    told = ", ".join(
        f"[{style}]{counts[status]} {status}[/{style}]"
        for status, style in STATUS_STYLES.items()
        if status in counts
    )
    what = "a reconstruction: " if counts.get("reconstructed") else ""
    return f"{what}{told}" if told else "no constants"
