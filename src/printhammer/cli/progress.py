"""How far a verb is: on the standard error, and only where somebody looks."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.progress import Progress, ProgressColumn


@contextmanager
def counting(name: str, *, remaining: bool = True) -> Iterator[Callable[[int, int], None]]:
    """Show a bar while something, called `name`, is counted; yield a function of the steps done and of all.

    The time that is left is told too where `remaining`; it says nothing where most steps may not be needed.
    """
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    last = TimeRemainingColumn() if remaining else TimeElapsedColumn()
    with _shown(TextColumn(name), BarColumn(), MofNCompleteColumn(), last) as bar:
        task = bar.add_task(name, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def telling(first: str = "…") -> Iterator[Callable[[str], None]]:
    """Show a line while something is done whose end is not known; yield a function of what it says next."""
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    with _shown(SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn()) as line:
        task = line.add_task(first, total=None)
        yield lambda text: line.update(task, description=text)


def _shown(*columns: ProgressColumn) -> Progress:
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    # Where it is no terminal, the library would end with an empty line.
    return Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
