"""Output of the command line: results to standard output, messages to standard error.

Progress displays appear on standard error, and only if it is a terminal.
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

_WIDTH: Final = 120  # Line length, in characters, of output that is not a terminal; arbitrary
_PLAIN: Final = {"µ": "u", "–": "-", "…": "...", "·": " ", "×": "x", "°": "deg", "→": "->"}
"""Plain-text replacements of characters that the output encoding may lack."""


def _plain(error: UnicodeError) -> tuple[str, int]:
    """Error handler of an encoder: replace characters with plain text, or else with their code points."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    signs = error.object[error.start : error.end]
    nearest = (_PLAIN.get(sign, unicodedata.normalize("NFKD", sign)) for sign in signs)
    return "".join(nearest).encode("ascii", "backslashreplace").decode(), error.end


def allow_any_text() -> None:
    """Make the standard streams replace characters that the encoding lacks, such as "µ" in ASCII."""
    codecs.register_error(__name__, _plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors=__name__)


def console() -> Console:
    """Return the console for standard output; without a terminal, wide enough for tables."""
    return Console(highlight=False, emoji=False, width=None if sys.stdout.isatty() else _WIDTH)


_bars: Final[list[Console]] = []


@contextmanager
def above(bar: Console) -> Iterator[None]:
    """Print messages above the progress bar of a console while the context is open."""
    _bars.append(bar)
    try:
        yield
    finally:
        _bars.remove(bar)


def _print(text: str) -> None:
    console = _bars[-1] if _bars else Console(stderr=True, highlight=False, emoji=False)
    console.print(text, soft_wrap=True)


def complain(sentence: str) -> None:
    """Print an error message to standard error, on one line after the name of the program."""
    text = " ".join(sentence.split())
    _print(f"[red]printhammer:[/red] {escape(text)}")


def say(sentence: str) -> None:
    """Print a remark to standard error, so that piped output contains results only."""
    _print(f"[dim]{escape(sentence)}[/dim]")


def warn(sentence: str) -> None:
    """Print a warning to standard error."""
    _print(f"[yellow]warning:[/yellow] {escape(sentence)}")


class Counted(Protocol):
    """Callback of a progress bar, called with steps done, total steps, and name of the present step."""

    def __call__(self, done: int, total: int, what: str = "", /) -> None:
        """Update the progress bar to `done` of `total` steps; `what` names the present step."""


@contextmanager
def progress_bar(name: str, *, remaining: bool = True) -> Iterator[Counted]:
    """Show a progress bar labelled `name` with count, rate and time left; yield its callback.

    Without `remaining`, the bar shows the elapsed time instead of the time left, for computations in which
    most steps may turn out to be unnecessary.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, TextColumn, TimeElapsedColumn
    from rich.text import Text

    class Pace(ProgressColumn):
        """Progress-bar column with the rate of the steps and the time left."""

        def render(self, task: Task) -> Text:
            return Text(pace_of(task.completed, task.total if remaining else None, task.elapsed), style="dim")

    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Pace()]
    with _shown(*columns, *(() if remaining else (TimeElapsedColumn(),))) as bar:
        task = bar.add_task(name, total=None)

        def count(done: int, total: int, what: str = "", /) -> None:
            bar.update(task, completed=done, total=total, description=f"{name} {what}" if what else name)

        yield count


def pace_of(done: float, total: float | None, seconds: float | None) -> str:
    """Return the rate of the steps and the time left as text; empty before the first step.

    `done` of `total` steps have taken `seconds`; without a total, the text contains the rate only.

    The rate is the average since the start, because parallel steps finish in bursts.
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
def status_line(first: str = "…") -> Iterator[Callable[[str], None]]:
    """Show a status line for a computation of unknown length; yield a function that sets its text.

    `first` is the initial text.
    """
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    with _shown(SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()) as line:
        task = line.add_task(first, total=None)
        yield lambda text: line.update(task, description=text)


@contextmanager
def _shown(*columns: ProgressColumn) -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True, highlight=False, emoji=False)
    # If the output is not a terminal, rich would print an empty line at the end.
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    with above(console), bar:
        yield bar
