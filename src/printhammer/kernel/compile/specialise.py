"""One kernel for each combination of laws: its entry points as functions of Python."""

from __future__ import annotations

import functools
import os
import sys
from typing import TYPE_CHECKING, Any

from printhammer.kernel.compile.bindings import bindings_of
from printhammer.kernel.compile.modules import Entry, WebModule, one_at_a_time, web_module_of
from printhammer.kernel.compile.templates import TEMPLATES, VARIATIONAL, compile_law, execute_all
from printhammer.kernel.variational.layout import changing, electric_row

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from printhammer.kernel.model.laws import Laws

begin_ahead: Callable[[Laws], Callable[[], None]] | None = None
"""Called with the laws before `run` is compiled: has the entry points `AHEAD` compiled elsewhere meanwhile.

What it returns waits for these.
"""

ENTRIES = ("run", "resample", "quadratures", "peaks", "members")
"""Entry points of the plain kernel."""

AHEAD = ("peaks", "quadratures", "resample")
"""Entry points that whoever runs a hammer wants next."""


class Kernel:
    """The entry points for one combination of laws, as functions of Python.

    The plain kernel has `run`, `resample`, `quadratures`, `peaks` and `members`, defined in its template
    modules; kernels for lanes and for variational equations have one of their own, `lanes` or `flow`. The
    `label` says what the kernel is for.
    """

    _wait: Callable[[], None] | None = None

    def __init__(self, laws: Laws, label: str, entries: Sequence[Entry]) -> None:
        self.laws = laws
        self.label = label
        self._entries = {entry.name: entry for entry in entries}
        codes = {name: self._entries[name].code for name in ("run", *AHEAD) if name in self._entries}
        for code in codes.values():
            code.with_it = tuple(other for other in codes.values() if other is not code)

    def __getattr__(self, name: str) -> Any:
        """Return an entry point, compiled if need be, with others compiled elsewhere where that is wanted."""
        try:
            entry = self.__dict__["_entries"][name]
        except KeyError:
            raise AttributeError(name) from None
        if begin_ahead is not None and not entry.is_ready():
            if name == "run" and entry.code.can_be_kept:
                self._wait = begin_ahead(self.laws)
                entry.code.with_it = ()
            elif name in AHEAD and self._wait is not None:
                wait, self._wait = self._wait, None
                wait()
        function = entry.function()
        # Found there from now on, without coming here.
        self.__dict__[name] = function
        return function

    def is_ready(self, name: str) -> bool:
        """Whether an entry point is compiled in this process or has machine code on disk."""
        return name not in self._entries or self._entries[name].is_ready()

    def web_module(self, names: Sequence[str] = ENTRIES, *others: Kernel) -> WebModule:
        """Return the module of WebAssembly of entry points, and of all those of `others`.

        It is called as :mod:`printhammer.kernel.compile.web.build` says. Its content ships for the laws of
        shipped hammers; making it takes the extra `page`.
        """
        entries = [self._entries[name] for name in names]
        entries += [entry for other in others for entry in other._entries.values()]
        return web_module_of(entries)

    @functools.cached_property
    def namespace(self) -> dict[str, Any]:
        """All names of the template modules, bound to the laws: for helpers that are called by themselves."""
        from printhammer.kernel.compile.compiling import compiled

        bindings = bindings_of(self.laws)
        laws = {name: compile_law(function, compiled) for name, function in bindings.names.items()}
        return execute_all(TEMPLATES, {**laws, **bindings.choices}, f"{id(self):x}")

    def interpret(self, namespace: Mapping[str, Any]) -> None:
        """Take the entry points of executed template modules, as plain Python."""
        for name in self._entries:
            self.__dict__[name] = namespace[name]
        self._entries = {}


def is_interpreted() -> bool:
    """Whether the kernel is to run as plain Python."""
    if "numba" in sys.modules:
        return bool(sys.modules["numba"].config.DISABLE_JIT)
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


def specialise(laws: Laws) -> Kernel:
    """Return the kernel for `laws`; the same object for equal laws.

    Its entry points are compiled, or their machine code is loaded from disk, when they are first wanted.
    ImportError if a module named in `laws` cannot be imported.
    """
    with one_at_a_time:
        return _specialised(laws)


@functools.cache
def _specialised(laws: Laws) -> Kernel:
    bindings = bindings_of(laws)
    parts = [getattr(laws, role).rpartition(".")[2] for role in bindings.digests if getattr(laws, role)]
    label = f"laws {', '.join(parts)}" if parts else "a free mass"
    if laws.circuit:
        label += " with the coil's circuit"
    variant = {"HAS_CIRCUIT": laws.circuit}
    kernel = Kernel(laws, label, [Entry(name, variant, bindings, {}, label) for name in ENTRIES])
    if is_interpreted():
        kernel.interpret(kernel.namespace)
    return kernel


def variational(plain: Kernel, *, forced: bool) -> Kernel:
    """Return the kernel whose entry point `flow` carries columns along the runs of a plain one.

    See :mod:`printhammer.kernel.variational.flow`; `forced` says whether constants force the columns. It is
    apart from the plain kernel, so that runs which do not ask for derivatives compile nothing for them.
    """
    with one_at_a_time:
        return _built(plain, forced)


@functools.cache
def _built(plain: Kernel, forced: bool) -> Kernel:
    bindings = bindings_of(plain.laws)
    circuit, damped = bindings.choices["HAS_CIRCUIT"], bindings.choices["HAS_DAMPING"]
    choices = {"CHANGING": changing(forced, damped, circuit)}
    variant = {"HAS_CIRCUIT": circuit, "FORCED": forced}
    label = f"{plain.label}, by {'constants' if forced else 'states'}"
    kernel = Kernel(plain.laws, label, [Entry("flow", variant, bindings, choices, label)])
    if is_interpreted():
        own = {**choices, "FORCED": forced, "ELECTRIC_ROW": electric_row(forced)}
        kernel.interpret(execute_all(VARIATIONAL, {**plain.namespace, **own}, f"{id(kernel):x}"))
    return kernel
