"""What the command line prints, and where."""

from __future__ import annotations

import sys

from rich.console import Console
from rich.markup import escape

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


def warn(sentence: str) -> None:
    """Print a warning on the standard error."""
    err = Console(stderr=True, highlight=False, soft_wrap=True)
    err.print(f"[yellow]warning:[/yellow] {escape(sentence)}")
