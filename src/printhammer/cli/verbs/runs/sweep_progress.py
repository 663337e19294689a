"""How far a sweep is, and how long it will take."""

from __future__ import annotations

import math
import sys
import time
from typing import Final, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

_LINE_EVERY: Final = 10.0


class Telling:
    """Tells how far a sweep is: a bar on a terminal, else a line now and then, on the standard error.

    Attributes
    ----------
    new : float
        Members done by this process.
    """

    def __init__(self) -> None:
        self.new = 0.0
        self._began = self._told = time.monotonic()
        self._bar = (
            Progress(
                BarColumn(),
                TextColumn("{task.description}"),
                console=Console(stderr=True, highlight=False),
                transient=True,
            )
            if sys.stderr.isatty()
            else None
        )
        self._task = None if self._bar is None else self._bar.add_task("…", total=None)

    def __enter__(self) -> Self:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def tell(self, done: float, before: int, members: int) -> None:
        """Take how many members are done, were done before, and there are."""
        now = time.monotonic()
        if self.new <= 0.0 and done <= before:
            # Compiling and reaching a cluster are not part of the rate.
            self._began = now
        self.new = done - before
        text = progress_text(done, before, members, now - self._began)
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=text, completed=done, total=members)
        elif now - self._told >= _LINE_EVERY:
            self._told = now
            sys.stderr.write(f"{text}\n")
            sys.stderr.flush()


def progress_text(done: float, before: int, members: int, seconds: float) -> str:
    """Say how many members are done, at which rate, and how long the others will take."""
    text = f"{int(done)} of {members} members"
    new = done - before
    if new <= 0.0 or seconds <= 0.0:
        return text
    rate = new / seconds
    return f"{text}, {rate:.3g}/s, {duration_text((members - done) / rate)} left"


def duration_text(seconds: float) -> str:
    """Return a duration in two units at most, such as "2 h 5 min"."""
    whole = math.ceil(seconds)
    days, hours, minutes = whole // 86400, whole // 3600 % 24, whole // 60 % 60
    if days:
        return f"{days} d {hours} h"
    if hours:
        return f"{hours} h {minutes} min"
    return f"{minutes} min {whole % 60} s" if minutes else f"{whole} s"


def size_text(size: float) -> str:
    """Return a size in bytes, such as "1.2 MB"."""
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.3g} TB"
