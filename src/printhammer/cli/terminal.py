"""What the command line prints, and where."""

from __future__ import annotations

import codecs
import io
import sys
import unicodedata
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.markup import escape

if TYPE_CHECKING:
    from collections.abc import Iterator

_WIDTH: Final = 120
_PLAIN: Final = {"µ": "u", "–": "-", "…": "...", "·": " ", "×": "x", "°": "deg", "→": "->"}
"""How signs are written where the output has none of them."""


def _plain(error: UnicodeError) -> tuple[str, int]:
    """Write the nearest plain text for what a stream cannot hold, or its number where there is none."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    signs = error.object[error.start : error.end]
    nearest = (_PLAIN.get(sign, unicodedata.normalize("NFKD", sign)) for sign in signs)
    return "".join(nearest).encode("ascii", "backslashreplace").decode(), error.end


def allow_any_text() -> None:
    """Have text that the standard streams cannot hold, such as "µ" in ASCII, replaced instead of refused."""
    codecs.register_error(__name__, _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=__name__)


def console() -> Console:
    """Return the console of the standard output; wide enough for tables where it is no terminal."""
    return Console(highlight=False, emoji=False, width=None if sys.stdout.isatty() else _WIDTH)


_bars: Final[list[Console]] = []


@contextmanager
def above(bar: Console) -> Iterator[None]:
    """Print what is said meanwhile above a bar that a console shows on the standard error, not into it."""
    _bars.append(bar)
    try:
        yield
    finally:
        _bars.remove(bar)


def _print(text: str) -> None:
    console = _bars[-1] if _bars else Console(stderr=True, highlight=False, emoji=False)
    console.print(text, soft_wrap=True)


def complain(sentence: str) -> None:
    """Print one line on the standard error."""
    text = " ".join(sentence.split())
    _print(f"[red]printhammer:[/red] {escape(text)}")


def say(sentence: str) -> None:
    """Print a remark on the standard error, so that it does not get into what is piped on."""
    _print(f"[dim]{escape(sentence)}[/dim]")


def warn(sentence: str) -> None:
    """Print a warning on the standard error."""
    _print(f"[yellow]warning:[/yellow] {escape(sentence)}")
