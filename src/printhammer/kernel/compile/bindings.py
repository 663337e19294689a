"""Bindings of a kernel to a hammer: law functions, choices, and digests of the sources of the laws."""

from __future__ import annotations

import hashlib
import importlib
import inspect
import sys
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from printhammer.kernel.model.laws import LAW_FUNCTIONS

if TYPE_CHECKING:
    from printhammer.kernel.model.laws import Laws


class Bindings(NamedTuple):
    """Law functions by name, choices by name, and a digest of the sources of each part's laws."""

    names: dict[str, Any]
    choices: dict[str, bool]
    digests: dict[str, str]


def bindings_of(laws: Laws) -> Bindings:
    """Return the law functions, choices and source digests of `laws`.

    Raises ImportError if a module named in `laws` cannot be imported.
    """
    absent = importlib.import_module(laws.absent)
    names: dict[str, Any] = {}
    digests: dict[str, str] = {}
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
        used = {name for function in functions for name in _modules_of(names[function])}
        others = sorted(used - {module.__name__, absent.__name__})
        text = b"".join(_source(each) for each in (absent, module, *(sys.modules[other] for other in others)))
        digests[role] = hashlib.sha256(text).hexdigest()
        choices[f"HAS_{role.upper()}"] = bool(name)
        for role_of_choice, choice in (("pack", "MEMORY"), ("backstop", "RIGID")):
            if role == role_of_choice:
                choices[choice] = bool(getattr(module, choice, False))
    return Bindings(names, choices, digests)


def _source(module: ModuleType) -> bytes:
    return inspect.getsource(module).encode()


def helpers_of(function: FunctionType) -> dict[str, FunctionType]:
    """Return the functions that a law calls, by the name that it uses."""
    return {
        name: value
        for name in function.__code__.co_names
        if isinstance(value := function.__globals__.get(name), FunctionType)
    }


def _modules_of(function: FunctionType) -> set[str]:
    """Return the names of the modules of a law and all that it calls."""
    return {function.__module__}.union(*(_modules_of(helper) for helper in helpers_of(function).values()))
