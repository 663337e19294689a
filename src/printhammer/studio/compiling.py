"""Compilation times, and notifications of the start and end of compilation."""

from __future__ import annotations

import time
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable


class _Gauge:
    """Clock of the compilation time in this process, with the listener to notify."""

    def __init__(self) -> None:
        self.spent = 0.0
        self.begun = 0.0
        self.depth = 0
        self.tell: Callable[[str], None] = lambda _sentence: None
        self.what = "compiling machine code (once; kept on disk)"


_gauge = _Gauge()


def seconds() -> float:
    """Return the time spent on compilation in this process since the first `measure`, s."""
    return _gauge.spent + (time.monotonic() - _gauge.begun if _gauge.depth else 0.0)


@cache
def measure() -> None:
    """Start measuring the compilation time of this process."""
    from printhammer.run.simulate import watch_compiling

    watch_compiling(lambda begins: _begin() if begins else _end())


def listen(tell: Callable[[str], None]) -> None:
    """Register a listener, called with a sentence when compilation starts, and with "" when it ends."""
    from printhammer.run.simulate import announce_compiling

    _gauge.tell = tell
    # Workers compile in parallel already.
    announce_compiling(_announced, helped=False)
    measure()


def _announced(sentence: str) -> None:
    _gauge.what = sentence


def _begin() -> None:
    # Compilations nest within a thread, and run one thread at a time.
    if _gauge.depth == 0:
        _gauge.begun = time.monotonic()
        _gauge.tell(_gauge.what)
    _gauge.depth += 1


def _end() -> None:
    _gauge.depth -= 1
    if _gauge.depth == 0:
        _gauge.spent += time.monotonic() - _gauge.begun
        _gauge.tell("")
