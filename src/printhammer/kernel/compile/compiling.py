"""The one compiler setting that all compiled functions of the kernel share."""

from __future__ import annotations

from contextlib import contextmanager
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numba
from numba.core.registry import CPUDispatcher

from printhammer.kernel.compile.linking import KeptCompiler, OpenCompiler, PartCompiler, WholeCompiler

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numba.core.compiler import Compiler

Function = TypeVar("Function", bound="Callable[..., Any]")

# Contraction to fused multiply-add changes no sign, comparison or NaN; the other fast-math freedoms would.
# Without reference counts (_nrt) no compiled function may allocate: all arrays are the caller's. Counting the
# references to the drive's arrays at every call made a run thirty times slower.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True, "_nrt": False}

# A function first met in one that is inlined would inherit that, and be inlined wherever it is called.
_CALLED: dict[str, Any] = {**_OPTIONS, "forceinline": False}


class _Helper(CPUDispatcher):
    """A function of which compiled callers take the module; Python calls one compiled by itself."""

    @cached_property
    def alone(self) -> Any:
        """The function as an entry point."""
        return numba.njit(pipeline_class=WholeCompiler, **_CALLED)(self.py_func)

    def __call__(self, *arguments: Any) -> Any:
        return self.alone(*arguments)


def _helper(function: Function, compiler: type[Compiler], options: dict[str, Any]) -> Function:
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    options = {"nopython": True, "boundscheck": None, **options}
    return cast("Function", _Helper(function, targetoptions=options, pipeline_class=compiler))


def inlined(function: Function) -> Function:
    """Compile a scalar helper lazily, always as part of the machine code of whatever calls it."""
    return _helper(function, PartCompiler, {**_OPTIONS, "forceinline": True})


_inline_all = False


@contextmanager
def all_inlined() -> Iterator[None]:
    """Have `compiled` do what `inlined` does: a loop that is to become vector code must not hold calls."""
    global _inline_all  # noqa: PLW0603
    _inline_all = True
    try:
        yield
    finally:
        _inline_all = False


def compiled(function: Function) -> Function:
    """Compile a scalar helper lazily, as part of whatever calls it."""
    if _inline_all:
        return inlined(function)
    return _helper(function, PartCompiler, _CALLED)


def called(function: Function) -> Function:
    """Compile a long helper lazily, once for all that call it, unless everything is to be inlined."""
    if _inline_all:
        return inlined(function)
    return _helper(function, KeptCompiler, _CALLED)


def entry(function: Function) -> Function:
    """Compile an entry point lazily, as the last part of its template."""
    return _helper(function, PartCompiler, _CALLED)


def opened(function: Function) -> Function:
    """Compile the calls of a function, and leave open what it does."""
    return _helper(function, OpenCompiler, _CALLED)
