"""The one compiler setting that all compiled functions of the kernel share."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import numba

from printhammer.kernel.compile.cache import keep

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

Function = TypeVar("Function", bound="Callable[..., Any]")

# Contraction to fused multiply-add changes no sign, comparison or NaN; the other fast-math freedoms would.
# Without reference counts (_nrt) no compiled function may allocate: all arrays are the caller's. Counting the
# references to the drive's arrays at every call made a run thirty times slower.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}, "nogil": True, "_nrt": False}


def inlined(function: Function) -> Function:
    """Compile a scalar helper lazily, always as part of the machine code of whatever calls it."""
    return numba.njit(forceinline=True, **_OPTIONS)(function)  # type: ignore[no-any-return]


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
    return numba.njit(**_OPTIONS)(function)  # type: ignore[no-any-return]


def entry(function: Function) -> Function:
    """Compile an entry point lazily and keep its machine code on disk.

    The cache on disk goes by file and qualified name, which all kernels share; the digest of the kernel's
    sources, that :mod:`printhammer.kernel.compile.specialise` defines in a template module, keeps them apart.
    """
    function.__qualname__ += "_" + function.__globals__["DIGEST"]
    return keep(numba.njit(**_OPTIONS)(function))  # type: ignore[no-any-return]
