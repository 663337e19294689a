"""When machine code is being made: for what, and for how long it has been."""

from __future__ import annotations

import time
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
        self.what = ""


_gauge = _Gauge()


def seconds() -> float:
    """Return the time that was spent on compiling so far in this process, s."""
    return _gauge.spent + (time.monotonic() - _gauge.begun if _gauge.depth else 0.0)


def listen(tell: Callable[[str], None]) -> None:
    """Have `tell` called with a sentence where compiling begins, and with nothing where it ends."""
    from numba.core import event

    from printhammer.run.simulate import announce_compiling

    first = _gauge.what == ""
    _gauge.tell = tell
    _gauge.what = "compiling machine code (once; kept on disk)"
    # Workers compile side by side already.
    announce_compiling(_announced, helped=False)
    if first:

        class Listener(event.Listener):
            def on_start(self, _event: Any) -> None:
                _begin()

            def on_end(self, _event: Any) -> None:
                _end()

        event.register("numba:compile", Listener())  # type: ignore[no-untyped-call]


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
