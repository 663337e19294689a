"""Plain functions that are entry points of the page's WebAssembly module, beside those of the kernel.

A plain function takes numbers, arrays and tuples of them, allocates nothing, raises nothing, and returns
integers; it and all functions that it calls are ordinary functions of any room. Python calls it as it is, or
as machine code through `compiled`; a page calls it in the module of a hammer's laws, `page_module`. A name
that its module leaves undefined is bound to the law, choice or function of the kernel of that name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final

from printhammer.drive import tables
from printhammer.kernel.model.laws import Laws

if TYPE_CHECKING:
    from printhammer.kernel.compile.modules import Module, WebModule
    from printhammer.kernel.compile.signatures import Plain

_NO_LAWS: Final = Laws("", "", "", "", absent="printhammer.parts.absent")

_ENTRIES: Final[dict[str, tuple[Any, ...]]] = {
    "firings": (tables.fill_firings, ("f", "i1", "b", "f1"), 1),
    "pulse": (tables.pulse, ("i", "f1", "f2", "f1"), 1),
    "pulse_values": (tables.fill_values, ("f2", "f1", "f1")),
}
"""Functions by name, with the types of their arguments (as in `printhammer.kernel.compile.calls.Signature`),
the number of integers that they return, and whether they use names of the kernel."""


def entries() -> dict[str, Plain]:
    """Return the plain functions of the page, by name."""
    from printhammer.kernel.compile.signatures import Plain

    return {name: Plain(*entry) for name, entry in _ENTRIES.items()}


def templates() -> Iterator[Module]:
    """Yield the templates of all plain functions, with and without a coil circuit if they call laws."""
    from printhammer.kernel.compile.modules import plain_template

    for name, plain in entries().items():
        yield from (plain_template(name, plain, circuit) for circuit in {False, plain.laws})


def compiled(name: str, laws: Laws = _NO_LAWS) -> Callable[..., Any]:
    """Return a plain function as machine code; compiled or loaded from disk, with `laws` if it calls laws."""
    from printhammer.kernel.compile.specialise import specialise

    return specialise(laws).plain(name, entries()[name])


def page_module(laws: Laws) -> WebModule:
    """Return the WebAssembly module of a page: entry points of the kernel, and all plain functions."""
    from printhammer.kernel.compile.specialise import specialise

    return specialise(laws).web_module(further=entries())
