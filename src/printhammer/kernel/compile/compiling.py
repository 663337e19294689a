"""Compiler options shared by all compiled functions of the kernel, and the decorators that apply them."""

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
# Without reference counting (_nrt), no compiled function may allocate memory: the caller allocates all
# arrays. Counting references to the drive's arrays at every call made a run thirty times slower.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True, "_nrt": False}

# Set forceinline explicitly: a function first compiled for an inlined caller would otherwise inherit its
# flag.
_CALLED: dict[str, Any] = {**_OPTIONS, "forceinline": False}


class _Helper(CPUDispatcher):
    """Numba dispatcher of a kernel function: compiled callers link its module, Python calls another copy."""

    @cached_property
    def alone(self) -> Any:
        """Copy of the function compiled on its own, for calls from Python."""
        return numba.njit(pipeline_class=WholeCompiler, **_CALLED)(self.py_func)

    def __call__(self, *arguments: Any) -> Any:
        return self.alone(*arguments)


def _helper(function: Function, compiler: type[Compiler], options: dict[str, Any]) -> Function:
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    options = {"nopython": True, "boundscheck": None, **options}
    return cast("Function", _Helper(function, targetoptions=options, pipeline_class=compiler))


def inlined(function: Function) -> Function:
    """Mark a scalar helper for lazy compilation, always inlined into its callers."""
    return _helper(function, PartCompiler, {**_OPTIONS, "forceinline": True})


_inline_all = False


@contextmanager
def all_inlined() -> Iterator[None]:
    """Context in which `compiled` and `called` also inline, since only a loop without calls is vectorised."""
    global _inline_all  # noqa: PLW0603
    _inline_all = True
    try:
        yield
    finally:
        _inline_all = False


def compiled(function: Function) -> Function:
    """Mark a scalar helper for lazy compilation; the optimiser decides whether to inline it."""
    if _inline_all:
        return inlined(function)
    return _helper(function, PartCompiler, _CALLED)


def called(function: Function) -> Function:
    """Mark a long helper for lazy compilation; it is inlined only in the context `all_inlined`."""
    if _inline_all:
        return inlined(function)
    return _helper(function, KeptCompiler, _CALLED)


def entry(function: Function) -> Function:
    """Mark an entry point for lazy compilation, as the top-level function of its template."""
    return _helper(function, PartCompiler, _CALLED)


def opened(function: Function) -> Function:
    """Mark a stub: calls of the function are compiled, and its body is linked from another module later."""
    return _helper(function, OpenCompiler, _CALLED)
