"""Kernels specialised for a combination of laws: their entry points as Python functions."""

from __future__ import annotations

import functools
import os
import sys
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, cast

from printhammer.kernel.compile.bindings import bindings_of
from printhammer.kernel.compile.modules import Entry, WebModule, one_at_a_time, require_numba, web_module_of
from printhammer.kernel.compile.templates import TEMPLATES, VARIATIONAL, bind, compile_law, execute_all
from printhammer.kernel.variational.layout import changing, electric_row

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from printhammer.kernel.compile.signatures import Plain
    from printhammer.kernel.model.laws import Laws

begin_ahead: Callable[[Laws], Callable[[], None]] | None = None
"""Hook called with the laws before `run` is compiled, to compile the entry points `AHEAD` in parallel.

The hook returns a function that waits until these entry points are compiled.
"""

ENTRIES = ("run", "resample", "quadratures", "peaks", "members")
"""Names of the entry points of the scalar kernel, i.e. without lanes and variational equations."""

AHEAD = ("peaks", "quadratures", "resample")
"""Entry points that are usually needed after `run`, and may be compiled ahead in parallel."""

_NONE: Final[Mapping[str, Plain]] = MappingProxyType({})


class Kernel:
    """Entry points of the kernel for one combination of laws, as Python functions.

    The scalar kernel has the entry points `run`, `resample`, `quadratures`, `peaks` and `members`, defined in
    its template modules. The kernels for lanes and for variational equations have a single entry point,
    `lanes` and `flow`. `label` describes the laws in messages.
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
        """Return an entry point, compiled if necessary.

        Meanwhile, a second process started by `begin_ahead` may compile other functions.
        """
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
        # Later look-ups find the attribute without calling this method.
        self.__dict__[name] = function
        return function

    @property
    def entries(self) -> tuple[Entry, ...]:
        """Compiled entry points of the kernel; empty if the kernel is interpreted."""
        return tuple(self._entries.values())

    def is_ready(self, name: str) -> bool:
        """Whether an entry point is compiled in this process or has machine code on disk."""
        return name not in self._entries or self._entries[name].is_ready()

    def web_module(self, names: Sequence[str] = ENTRIES, further: Mapping[str, Plain] = _NONE) -> WebModule:
        """Return the WebAssembly module of the entry points `names` and of `further` plain functions.

        The names may include "flow", the variational equations for derivatives with respect to the state.
        The calling convention is described in :mod:`printhammer.kernel.compile.web.build`. The wheel contains
        the modules for the laws of shipped hammers; the build of other modules needs the optional extra
        `page`.
        """
        plain = [_plain_entry(name, function, self.laws) for name, function in further.items()]
        known = dict(self._entries)
        if "flow" in names:
            known |= variational(self, forced=False)._entries
        return web_module_of([*(known[name] for name in names), *plain])

    def plain(self, name: str, function: Plain) -> Callable[..., Any]:
        """Return a plain function, with the laws of the kernel, as machine code that Python calls."""
        if is_interpreted():
            names = {**bindings_of(self.laws).packing, **self.namespace}
            return cast("Callable[..., Any]", bind(function.function, names, _as_is))
        return _plain_entry(name, function, self.laws).function()

    @functools.cached_property
    def namespace(self) -> dict[str, Any]:
        """All names of the template modules, bound to the laws, for direct calls of helper functions."""
        require_numba("to run the kernel as plain Python (NUMBA_DISABLE_JIT) needs numba")
        from printhammer.kernel.compile.compiling import compiled

        bindings = bindings_of(self.laws)
        laws = {name: compile_law(function, compiled) for name, function in bindings.names.items()}
        return execute_all(TEMPLATES, {**laws, **bindings.choices}, f"{id(self):x}")

    def interpret(self, namespace: Mapping[str, Any]) -> None:
        """Replace the entry points with the uncompiled functions of executed template modules."""
        for name in self._entries:
            self.__dict__[name] = namespace[name]
        self._entries = {}


def is_interpreted() -> bool:
    """Whether the kernel runs as plain Python, i.e. whether numba's JIT compilation is disabled."""
    # None stands for a module that must not be imported.
    if (numba := sys.modules.get("numba")) is not None:
        return bool(numba.config.DISABLE_JIT)
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


def specialise(laws: Laws) -> Kernel:
    """Return the kernel specialised for `laws`; equal laws share one kernel object.

    The entry points are compiled, or their machine code is loaded from disk, on first use. Raises ImportError
    if a module named in `laws` cannot be imported.
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


@functools.cache
def _plain_entry(name: str, function: Plain, laws: Laws) -> Entry:
    bindings = bindings_of(laws)
    variant = {"HAS_CIRCUIT": bindings.choices["HAS_CIRCUIT"]}
    label = _specialised(laws).label if function.laws else "numbers of the page"
    return Entry(name, variant, bindings, {}, label, function)


def _as_is(function: Callable[..., Any]) -> Callable[..., Any]:
    return function


def variational(plain: Kernel, *, forced: bool) -> Kernel:
    """Return the kernel of the variational equations for the laws of a scalar kernel; entry point `flow`.

    See :mod:`printhammer.kernel.variational.flow`. With `forced`, derivatives with respect to constants are
    computed. The kernel is separate, so that runs without derivatives compile nothing for them.
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
