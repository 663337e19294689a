"""Entry points of the kernel, and the lowered modules from which their machine code is linked.

The machine code of an entry point is linked from its template and the modules of the laws. A module is named
after a digest of its sources. It is read from the wheel, or else lowered by numba on first use and cached
with the machine code.
"""

from __future__ import annotations

import hashlib
import lzma
import threading
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import missing_extra
from printhammer.kernel.compile import calls, link
from printhammer.kernel.compile.bindings import code_digest, plain_digest
from printhammer.kernel.compile.cache import Code, File, say_once
from printhammer.kernel.compile.signatures import RESULTS, signature_of
from printhammer.kernel.compile.web import build as web
from printhammer.kernel.model.laws import LAW_FUNCTIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from printhammer.kernel.compile.bindings import Bindings
    from printhammer.kernel.compile.signatures import Plain

KINDS: Final = {
    "run": "runs",
    "resample": "curves",
    "quadratures": "energies",
    "peaks": "peaks",
    "members": "many runs",
    "lanes": "many runs side by side",
    "flow": "derivatives",
}
"""Entry points by name, with a phrase that describes their results in messages."""

KERNEL: Final = Path(__file__).parents[1]
SHIPPED: Final = KERNEL / "modules"
"""Folder of the lowered modules that the wheel contains."""

_LOWERING: Final = ("compile/compiling.py", "compile/linking.py", "compile/lower.py")
_PLAIN: Final = ("model", "methods", "single", *_LOWERING)
_SOURCES: Final = {
    "lanes": (*_PLAIN, "lanes"),
    "members": (*_PLAIN, "lanes"),
    "flow": (*_PLAIN, "variational"),
}

_NONE: Final[Mapping[str, Any]] = MappingProxyType({})

one_at_a_time: Final = threading.RLock()


@cache
def _digest_of(places: tuple[str, ...]) -> str:
    """Return a digest of the kernel's files and folders `places`, and of sources common to all modules."""
    paths = [
        KERNEL / place
        for place in (*places, "compile/opening.py", "compile/signatures.py", "compile/templates.py")
    ]
    files = [file for path in paths for file in (sorted(path.glob("*.py")) if path.is_dir() else (path,))]
    return code_digest(file.read_text("utf-8") for file in files)


@cache
def _versions() -> str:
    """Return the versions of numba and llvmlite, on which lowered modules depend, for use in file names."""
    versions = []
    for name in ("numba", "llvmlite"):
        try:
            versions.append(f"{name}{version(name)}")
        except PackageNotFoundError:
            versions.append(f"no-{name}")
    return "-".join(versions)


def require_numba(needs: str) -> None:
    """Raise InputError with the text `needs` if numba, installed by the optional extra `laws`, is missing."""
    try:
        import numba  # noqa: F401
    except ImportError:
        raise missing_extra(needs, "laws") from None


_NEEDED: Final = "this installation contains no lowered modules of the kernel, and lowering needs numba"


class Module:
    """Lowered module, as LLVM bitcode, of a template or of a part's laws; `make` lowers the module."""

    suffix = ".bc"
    is_readable = staticmethod(link.is_readable)

    def __init__(self, kind: str, sources: str, make: Callable[[], bytes]) -> None:
        self.name = f"{kind}_{hashlib.sha256(sources.encode()).hexdigest()[:24]}"
        self._make = make

    @property
    def shipped(self) -> Path:
        """Path of the module in the wheel; the file exists only if the module is shipped."""
        return SHIPPED / f"{self.name}{self.suffix}.xz"

    def identity(self) -> str:
        """Return a name that identifies the content of the module, without reading or lowering it."""
        return self.name if self.shipped.exists() else f"{self.name}_{_versions()}"

    def is_there(self) -> bool:
        """Whether the lowered module is in the wheel or in the disk cache."""
        return self.shipped.exists() or File(f"{self.name}_{_versions()}{self.suffix}").exists()

    def content(self) -> bytes:
        """Return the content of the module: read from the wheel or the disk cache, otherwise lowered."""
        if self.shipped.exists():
            with suppress(OSError, EOFError, lzma.LZMAError):
                content = lzma.decompress(self.shipped.read_bytes())
                if self.is_readable(content):
                    return content
            say_once(f"{self.shipped}: the module cannot be read; it is made anew")
        return File(f"{self.name}_{_versions()}{self.suffix}").get(self._make)


class WebModule(Module):
    """WebAssembly module that contains several entry points of a kernel; `label` describes its laws."""

    suffix = ".wasm"

    def __init__(self, sources: str, make: Callable[[], bytes], label: str) -> None:
        super().__init__("web", sources, make)
        self._label = label

    def content(self) -> bytes:
        """Return the content of the module; announce the compilation, if necessary (about half a minute)."""
        if not self.is_there():
            time = "about half a minute of processor time"
            say_once(f"compiling WebAssembly ({self._label}): {time}; once, kept on disk")
        return super().content()

    @staticmethod
    def is_readable(content: bytes) -> bool:
        """Whether the content begins with the magic number of WebAssembly."""
        return content.startswith(web.MAGIC)


def template_of(entry: str, variant: Mapping[str, bool]) -> Module:
    """Return the template of an entry point in a variant, without lowering it."""

    def make() -> bytes:
        require_numba(_NEEDED)
        from printhammer.kernel.compile import lower

        return lower.template(entry, variant)

    sources = _digest_of(_SOURCES.get(entry, _PLAIN))
    return Module(entry, f"{entry} {sorted(variant.items())} {sources}", make)


def plain_template(name: str, plain: Plain, circuit: bool, packing: Mapping[str, Any] = _NONE) -> Module:
    """Return the template of a function outside the kernel, without lowering it.

    `circuit` states whether to use the variant of the kernel with a coil circuit.

    `packing` holds the functions that pack constants, for a function that uses them.
    """
    packing = packing if plain.packing else {}

    def make() -> bytes:
        require_numba(_NEEDED)
        from printhammer.kernel.compile import lower

        return lower.plain(name, plain, circuit if plain.laws else None, packing)

    sources = _digest_of(_SOURCES["members"] if plain.laws else _LOWERING)
    kind = circuit if plain.laws else None
    own = [plain_digest(function) for function in (plain.function, *packing.values())]
    return Module(name, f"{name} {plain.arguments} {plain.results} {kind} {sources} {own}", make)


def every_template() -> Iterator[Module]:
    """Yield the templates of all entry points in all variants, e.g. with and without a coil circuit."""
    for entry in KINDS:
        circuits = (False,) if entry == "lanes" else (False, True)
        variants = [{} if entry == "lanes" else {"HAS_CIRCUIT": circuit} for circuit in circuits]
        if entry == "flow":
            variants = [{**variant, "FORCED": forced} for variant in variants for forced in (False, True)]
        yield from (template_of(entry, variant) for variant in variants)


def laws_of(role: str, bindings: Bindings, for_lanes: bool) -> Module:
    """Return the module of the law functions of a part, for arrays of constants or for lanes."""
    package = __name__.partition(".")[0]
    homes = {bindings.names[name].__module__ for name in LAW_FUNCTIONS[role]}
    others = sorted(home for home in homes if home.partition(".")[0] != package)

    def make() -> bytes:
        if not others:
            require_numba(_NEEDED)
            from printhammer.kernel.compile import lower

            return lower.laws(role, bindings.names, for_lanes)
        require_numba(f"{others[0]}: the {role} law is not part of printhammer and needs numba")
        from printhammer.kernel.compile import own

        return own.laws(role, bindings.names, for_lanes)

    lowering = ("compile/own.py",) if others else _LOWERING
    sources = _digest_of((*lowering, "model/laws.py"))
    if for_lanes:
        sources += _digest_of(("lanes/layout.py", "lanes/math.py"))
    return Module(role, f"{role} {for_lanes} {sources} {bindings.digests[role]}", make)


_objects: Final[dict[str, bytes]] = {}
"""WebAssembly objects of the functions without laws, by `Entry.sources`."""


class Entry:
    """Entry point of the kernel for given laws; its machine code is loaded or compiled on first use.

    Parameters
    ----------
    name : str
        Name of the entry point, a key of `KINDS`.
    variant : mapping
        Variant of the template; see :func:`printhammer.kernel.compile.lower.template`.
    bindings : Bindings
        Law functions and choices of the hammer.
    choices : mapping
        Additional compile-time choices, by name.
    label : str
        Description of the laws, for messages.
    plain : Plain, optional
        Function outside the kernel, instead of a key of `KINDS`.
    """

    def __init__(
        self,
        name: str,
        variant: Mapping[str, bool],
        bindings: Bindings,
        choices: Mapping[str, int],
        label: str,
        plain: Plain | None = None,
    ) -> None:
        self.name = name
        self._choices = {**bindings.choices, **choices}
        flavours: tuple[bool, ...] = (False, True) if name == "lanes" else (False,)
        if plain is None:
            self._template = template_of(name, variant)
            self._signature, self._results = signature_of(name, variant), RESULTS[name]
        else:
            self._template = plain_template(name, plain, variant["HAS_CIRCUIT"], bindings.packing)
            self._signature, self._results = plain.arguments, plain.results
            if not plain.laws:
                flavours, self._choices = (), {}
        self._laws = [laws_of(role, bindings, lanes) for lanes in flavours for role in bindings.digests]
        self._function: Callable[..., Any] | None = None
        modules = [self._template, *self._laws]
        here = (*link.processor(), _digest_of(("compile/link.py", "compile/calls.py")))

        def file_of(parts: Sequence[str]) -> str:
            digest = hashlib.sha256(repr((parts, sorted(self._choices.items()), here)).encode())
            return f"{name}_{digest.hexdigest()[:24]}.code"

        self.code = Code(
            file_of([version("llvmlite"), *(module.identity() for module in modules)]),
            KINDS.get(name, name),
            label,
            lambda: all(module.is_there() for module in modules),
            SHIPPED / file_of([module.name for module in modules]),
            variant.get("HAS_CIRCUIT", False),
        )

    def is_ready(self) -> bool:
        """Whether the machine code is loaded or cached on disk, so that no compilation is needed."""
        return self._function is not None or self.code.exists()

    def function(self) -> Callable[..., Any]:
        """Return the entry point as a Python function, compiled if necessary."""
        with one_at_a_time:
            if self._function is None:
                address = link.load(self.code.get(self.machine_code))
                self._function = calls.caller(address, self._signature, self._results)
        return self._function

    def machine_code(self) -> bytes:
        """Link the modules and compile them to machine code."""
        calling = calls.calling_code(link.ENTRY, self._signature, link.CALL)
        return link.emit(self._linked(calling))

    def _linked(self, calling: str) -> Any:
        laws = [module.content() for module in self._laws]
        return link.link(self._template.content(), laws, self._choices, calling)

    @property
    def sources(self) -> tuple[Any, ...]:
        """Inputs of the entry point's WebAssembly module: names of the lowered modules, and choices."""
        return self.name, self._template.name, [law.name for law in self._laws], sorted(self._choices.items())

    def web_object(self) -> bytes:
        """Compile the entry point to a WebAssembly object file; return its content.

        The object of a function without laws is kept in memory, since the modules of all pages contain it.
        """
        key = repr(self.sources)
        if key in _objects:
            return _objects[key]
        calling = calls.calling_code(link.ENTRY, self._signature, link.CALL, bare=True)
        content = web.emit(self._linked(calling), self.name)
        if not self._laws:
            _objects[key] = content
        return content

    def description(self) -> dict[str, Any]:
        """Return argument types and number of results of the entry point, for its WebAssembly module."""
        return {"arguments": web.description_of(self._signature), "results": self._results}


def web_module_of(entries: Sequence[Entry]) -> WebModule:
    """Return the WebAssembly module of several entry points; its build needs the optional extra `page`."""

    def make() -> bytes:
        description = {
            "laws": entries[0].code.label,
            "entries": {each.name: each.description() for each in entries},
        }
        return web.join({each.name: each.web_object() for each in entries}, description)

    sources = _digest_of(("compile/link.py", "compile/calls.py", "compile/web/build.py"))
    return WebModule(repr(([each.sources for each in entries], sources)), make, entries[0].code.label)
