"""What the command line prints, and where.

How far a verb is: on the standard error, and only where somebody looks.
"""

from __future__ import annotations

import codecs
import io
import sys
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, Protocol

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, ProgressColumn, Task

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


class Counted(Protocol):
    """Takes steps done and of all, and perhaps what is being done."""

    def __call__(self, done: int, total: int, what: str = "", /) -> None:
        """Show them."""


@contextmanager
def counting(name: str, *, remaining: bool = True) -> Iterator[Counted]:
    """Show count, rate and time left while something, called `name`, is counted; yield what takes the count.

    The time that went by is shown instead of that left unless `remaining`: the latter says nothing where most
    steps may not be needed.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, TextColumn, TimeElapsedColumn
    from rich.text import Text

    class Pace(ProgressColumn):
        """Rate, and the time left at that rate."""

        def render(self, task: Task) -> Text:
            return Text(pace_of(task.completed, task.total if remaining else None, task.elapsed), style="dim")

    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Pace()]
    with _shown(*columns, *(() if remaining else (TimeElapsedColumn(),))) as bar:
        task = bar.add_task(name, total=None)

        def count(done: int, total: int, what: str = "", /) -> None:
            bar.update(task, completed=done, total=total, description=f"{name} {what}" if what else name)

        yield count


def pace_of(done: float, total: float | None, seconds: float | None) -> str:
    """Return how fast steps were done, and how long the others take at that rate; empty before the first.

    The rate is that since the beginning: steps that are done in parallel come in bursts.
    """
    if not done or not seconds:
        return ""
    rate = done / seconds
    said = f"{rate:.3g}/s" if rate >= 1.0 else f"{1.0 / rate:.3g} s each"
    if total is None:
        return said
    minutes, rest = divmod(round((total - done) / rate), 60)
    return f"{said}, {minutes}:{rest:02d} left"


@contextmanager
def telling(first: str = "…") -> Iterator[Callable[[str], None]]:
    """Show a line while something is done whose end is not known; yield a function of what it says next."""
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    with _shown(SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()) as line:
        task = line.add_task(first, total=None)
        yield lambda text: line.update(task, description=text)


@contextmanager
def _shown(*columns: ProgressColumn) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True, highlight=False, emoji=False)
    # Where it is no terminal, the library would end with an empty line.
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    with above(console), bar:
        yield bar
