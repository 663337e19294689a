"""Effort of a computation: tolerance, threads and progress, in one object.

Public functions accept the keywords `tolerance`, `threads` and `progress`. The decorator `computation`
declares and documents the keywords, validates their values once and passes one `Effort`.
"""

from __future__ import annotations

import functools
import inspect
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypedDict, TypeVar

from printhammer.run.ensemble import DISPLAY_TOLERANCE
from printhammer.run.problem import TOLERANCE, check_tolerance
from printhammer.support.arguments import check_objects
from printhammer.support.threads import Progress, mapped, shifted, thread_count

A = TypeVar("A")
B = TypeVar("B")
F = TypeVar("F", bound=Callable[..., Any])


class OfTolerance(TypedDict, total=False):
    """Type of the keyword argument `tolerance` of a public function."""

    tolerance: float


class OfThreads(TypedDict, total=False):
    """Type of the keyword argument `threads` of a public function."""

    threads: int | None


class OfProgress(TypedDict, total=False):
    """Type of the keyword argument `progress` of a public function."""

    progress: Progress | None


class InThreads(OfTolerance, OfThreads):
    """Types of the keyword arguments `tolerance` and `threads`, for functions without progress reports."""


class InOneThread(OfTolerance, OfProgress):
    """Types of the keyword arguments `tolerance` and `progress`, for functions that use a single thread."""


class AtFixedTolerance(OfThreads, OfProgress):
    """Types of the keyword arguments `threads` and `progress`, for functions with fixed tolerances."""


class Keywords(OfTolerance, OfThreads, OfProgress):
    """Types of the keyword arguments `tolerance`, `threads` and `progress` of a public function."""


@dataclass(frozen=True)
class Effort:
    """Tolerance, threads and progress of a computation. Only the tolerance affects results."""

    tolerance: float = TOLERANCE
    """Error tolerance of one integration step."""
    threads: int | None = None
    """Number of threads; None for one per core."""
    progress: Progress | None = None
    """Callback that receives the number of steps done and the total number of steps."""

    def __post_init__(self) -> None:
        check_tolerance(self.tolerance)
        thread_count(self.threads)

    @property
    def quiet(self) -> Effort:
        """Copy without progress reports, for a subtask."""
        return replace(self, progress=None)

    @property
    def alone(self) -> Effort:
        """Copy with a single thread and without progress reports, for work inside a worker thread."""
        return Effort(self.tolerance, threads=1)

    @property
    def running(self) -> AtFixedTolerance:
        """Keyword arguments `threads` and `progress` for `Ensemble.run`; the ensemble sets the tolerance."""
        return {"threads": self.threads, "progress": self.progress}

    def at(self, tolerance: float) -> Effort:
        """Return a copy with the tolerance `tolerance` and without progress reports."""
        return Effort(tolerance, self.threads)

    def within(self, begun: int, total: int) -> Effort:
        """Return a copy for a subtask that begins when `begun` of `total` steps of the task are done."""
        return replace(self, progress=shifted(self.progress, begun, total))

    def report(self, done: int, total: int) -> None:
        """Report progress to the callback, if any."""
        if self.progress is not None:
            self.progress(done, total)

    def mapped(self, function: Callable[[A], B], items: Sequence[A], *, length: int | None = None) -> list[B]:
        """Map a function over items in threads, in chunks of `length` items; return the values in order.

        See `printhammer.support.threads.mapped`.
        """
        return mapped(function, items, self.threads, self.progress, length=length)


DEFAULT: Final = Effort()
DISPLAY: Final = Effort(DISPLAY_TOLERANCE)

_ENTRIES: Final = {
    "tolerance": """tolerance : float, optional
    Error allowed in one integration step, relative to the stroke and to a typical speed, as for
    `printhammer.simulate`.""",
    "threads": """threads : int, optional
    Number of threads, by default one per core. The result does not depend on it.""",
    "progress": """progress : callable, optional
    Called from time to time, in the calling thread, with the number of steps done and, as far as it is
    known, the total number of steps.""",
    "firing": """**firing
    How the hammer is fired, as for `printhammer.Regime.of`.""",
}
_TYPES: Final = {"tolerance": "float", "threads": "int | None", "progress": "Progress | None"}


def computation(function: F) -> F:
    """Decorate a public function to accept tolerance, threads and progress, and pass one `Effort`.

    The function has a parameter `effort`, whose default supplies the defaults of the keywords. The type of
    its `**` parameter names the accepted keywords: `Unpack[Keywords]`, or a dictionary type with further
    keys, which are passed on in `**`. Public signature and docstring show the keywords; functions of the
    package pass `effort` to each other. Entries already present in the docstring are kept.
    """
    signature = inspect.signature(function)
    *own, rest = signature.parameters.values()
    default: Effort = signature.parameters["effort"].default
    keys = vars(sys.modules[function.__module__])[rest.annotation[7:-1]].__annotations__
    names = [name for name in _TYPES if name in keys]
    allowed = {each.name for each in own} | (keys.keys() - _TYPES.keys())
    check = check_objects(function)

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        stated = {name: keywords.pop(name) for name in names if name in keywords}
        if stated:
            keywords["effort"] = replace(keywords.get("effort", default), **stated)
        unknown = keywords.keys() - allowed
        if unknown:
            raise TypeError(f"{function.__name__}() got an unexpected keyword argument {min(unknown)!r}")
        check(args, keywords)
        return function(*args, **keywords)

    fired = rest.name == "firing"
    shown = [each for each in own if each.name != "effort"]
    shown += [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=getattr(default, name), annotation=_TYPES[name]
        )
        for name in names
    ]
    if fired:
        shown.append(rest.replace(annotation="Unpack[Firing]"))
    typed: Any = call
    typed.__signature__ = signature.replace(parameters=shown)
    typed.__doc__ = _with_entries(function.__doc__ or "", [*names, "firing"] if fired else names)
    result: F = typed
    return result


def _with_entries(text: str, names: Sequence[str]) -> str:
    """Return a docstring whose Parameters section has entries for all keywords `names`."""
    text = inspect.cleandoc(text)
    ends = [text.find(head) for head in ("\nprogress : ", "\n**firing\n", "\n\nReturns\n-", "\n\nRaises\n-")]
    end = min((place for place in ends if place >= 0), default=len(text))
    lacking = [_ENTRIES[name] for name in names if _ENTRIES[name].partition("\n")[0] not in text.splitlines()]
    return "\n".join([text[:end], *lacking]) + text[end:]
