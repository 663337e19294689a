"""When machine code is being made: for what, and for how long it has been."""

from __future__ import annotations

import time
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable


class _Gauge:
    """Time spent on compiling in this process, and who is told of its beginning and end."""

    def __init__(self) -> None:
        self.spent = 0.0
        self.begun = 0.0
        self.depth = 0
        self.tell: Callable[[str], None] = lambda _sentence: None
        self.what = "compiling machine code (once; kept on disk)"


_gauge = _Gauge()


def seconds() -> float:
    """Return the time that was spent on compiling in this process since the first `measure`, s."""
    return _gauge.spent + (time.monotonic() - _gauge.begun if _gauge.depth else 0.0)


@cache
def measure() -> None:
    """Measure from now on how long compiling takes in this process."""
    from numba.core import event

    class Listener(event.Listener):
        def on_start(self, _event: Any) -> None:
            _begin()

        def on_end(self, _event: Any) -> None:
            _end()

    event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]


def listen(tell: Callable[[str], None]) -> None:
    """Have `tell` called with a sentence where compiling begins, and with nothing where it ends."""
    from printhammer.run.simulate import announce_compiling

    _gauge.tell = tell
    # Workers compile side by side already.
    announce_compiling(_announced, helped=False)
    measure()


def _announced(sentence: str) -> None:
    _gauge.what = sentence


def _begin() -> None:
    # Functions are compiled inside others, one thread at a time.
    if _gauge.depth == 0:
        _gauge.begun = time.monotonic()
        _gauge.tell(_gauge.what)
    _gauge.depth += 1


def _end() -> None:
    _gauge.depth -= 1
    if _gauge.depth == 0:
        _gauge.spent += time.monotonic() - _gauge.begun
        _gauge.tell("")
