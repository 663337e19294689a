"""Bindings of a kernel to a hammer: law functions, compile-time choices, and digests of the law sources."""

from __future__ import annotations

import ast
import hashlib
import importlib
import inspect
import sys
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from printhammer.kernel.compile.cache import File
from printhammer.kernel.model.laws import LAW_FUNCTIONS, PACKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from printhammer.kernel.model.laws import Laws


_CHOICES = {
    "pack": ("MEMORY", "RIGID_FRONT"),
    "backstop": ("RIGID",),
    "spring": ("LEVELS", "VISCOUS"),
    "damping": ("FRICTION",),
}
"""Names of the compile-time choices that the module of a part defines, by role."""


class Bindings(NamedTuple):
    """Law functions and compile-time choices by name, and for each part a digest of the sources of its laws.

    `packing` holds, by name, the functions that pack the constants of a part into an array.
    """

    names: dict[str, Any]
    choices: dict[str, bool]
    digests: dict[str, str]
    packing: dict[str, Any]


def bindings_of(laws: Laws) -> Bindings:
    """Return the law functions, the compile-time choices and the source digests of `laws`.

    Raises ImportError if a module named in `laws` cannot be imported.
    """
    absent = importlib.import_module(laws.absent)
    names: dict[str, Any] = {}
    digests: dict[str, str] = {}
    packing: dict[str, Any] = {}
    choices = {
        "FORCE_DRIVE": laws.force_drive,
        "HAS_CIRCUIT": laws.circuit,
        "PACK_PULLS": laws.pack_pulls,
        "BACKSTOP_PULLS": laws.backstop_pulls,
        "RELOAD_ALONG_UNLOADING": laws.reload_along_unloading,
    }
    for role, functions in LAW_FUNCTIONS.items():
        name = getattr(laws, role)
        module = importlib.import_module(name) if name else absent
        for function in functions:
            names[function] = getattr(module, function, None) or getattr(absent, function)
        for function in PACKING[role]:
            packing[function] = getattr(module, function, None) or getattr(absent, function)
        used = {name for function in functions for name in _modules_of(names[function])}
        others = sorted(used - {module.__name__, absent.__name__})
        sources = (absent, module, *(sys.modules[other] for other in others))
        digests[role] = code_digest(inspect.getsource(each) for each in sources)
        choices[f"HAS_{role.upper()}"] = bool(name)
        for choice in _CHOICES.get(role, ()):
            choices[choice] = bool(getattr(module, choice, False))
    choices["HAS_DAMPING"] |= choices["VISCOUS"]
    return Bindings(names, choices, digests, packing)


def code_digest(sources: Iterable[str]) -> str:
    """Return a digest of source texts that ignores docstrings, comments and layout.

    The digest is cached on disk under a digest of the full texts, since parsing the kernel takes 0.1 s.
    """
    texts = list(sources)
    name = hashlib.sha256("\0".join(texts).encode()).hexdigest()[:24]

    def make() -> bytes:
        code = "\n".join(syntax_text(ast.parse(text)) for text in texts)
        return hashlib.sha256(code.encode()).hexdigest().encode()

    return File(f"{name}.digest").get(make).decode()


def syntax_text(node: Any, replaced: Callable[[ast.AST], str | None] = lambda _node: None) -> str:
    """Return a text form of a syntax tree, without docstrings, that is the same in all Python versions.

    `replaced` returns a replacement text for a node, or None to keep the node. A node whose replacement is
    the empty string is omitted.
    """
    if isinstance(node, list):
        return "[" + ",".join(filter(None, (syntax_text(each, replaced) for each in node))) + "]"
    if not isinstance(node, ast.AST):
        return repr(node)
    if (
        isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    ):
        return ""
    text = replaced(node)
    if text is not None:
        return text
    fields = ((name, value) for name, value in ast.iter_fields(node) if value not in (None, []))
    kept = (
        f"{name}={syntax_text(value, replaced)}"
        for name, value in fields
        if name not in ("ctx", "kind", "type_comment")
    )
    return f"{type(node).__name__}({','.join(kept)})"


def helpers_of(function: FunctionType) -> dict[str, FunctionType]:
    """Return the Python functions that a law calls directly, keyed by their names in the law."""
    return {
        name: value
        for name in function.__code__.co_names
        if isinstance(value := function.__globals__.get(name), FunctionType)
    }


def _modules_of(function: FunctionType) -> set[str]:
    """Return the names of the modules that define a law and all functions that it calls."""
    return {function.__module__}.union(*(_modules_of(helper) for helper in helpers_of(function).values()))


def plain_digest(function: Callable[..., Any]) -> str:
    """Return a digest of the sources of a plain function: its module, its helpers, and their constants."""
    modules: set[str] = set()
    constants: set[str] = set()

    def walk(each: Any) -> None:
        modules.add(each.__module__)
        for name in each.__code__.co_names:
            value = each.__globals__.get(name)
            if isinstance(value, FunctionType):
                walk(value)
            elif isinstance(value, type):
                modules.add(value.__module__)
            elif isinstance(value, ModuleType):
                attributes = ((one, getattr(value, one, None)) for one in each.__code__.co_names)
                constants.update(f"{name}.{one} {number}" for one, number in attributes if _is_number(number))
            elif _is_number(value):
                constants.add(f"{name} {value!r}")

    walk(function)
    sources = (inspect.getsource(sys.modules[name]) for name in sorted(modules))
    return f"{code_digest(sources)} {sorted(constants)}"


def _is_number(value: Any) -> bool:
    return isinstance(value, bool | int | float | tuple)
