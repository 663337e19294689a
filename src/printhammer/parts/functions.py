"""Signatures of the law functions, taken from the functions of the absent part, by role."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any, Final

from printhammer.errors import InputError
from printhammer.parts import absent

_FORCES: Final = {
    "magnet": ("magnet_force",),
    "coil": (),
    "spring": ("spring_force",),
    "pack": ("pack_loading", "pack_rebound"),
    "backstop": ("backstop_elastic", "backstop_rebound"),
    "damping": ("damping_force",),
}
"""Force functions of each role; a complete law defines at least one of them."""


@cache
def check_functions(part: Any, *, complete: bool = False) -> None:
    """Check that the law functions of a part class take the arguments that the kernel passes.

    Functions that the module omits come from the absent part; if `complete`, the module must define at least
    one force function of the role.

    Raises
    ------
    InputError
        A function has other arguments, is not callable or calls `print`; a force function is missing; or the
        law is defined at an interactive prompt or in a notebook cell. The message names the module.
    """
    module = sys.modules.get(part.__module__)
    where = getattr(module, "__file__", None)
    if where is None:
        raise InputError.of(
            part.__qualname__,
            part.__module__,
            "a law in a file of its own, whose source the compiler can read; in a notebook the first line"
            " `%%writefile my_law.py` of a cell writes one, and `import my_law` registers it",
            written=f"a law of the module {part.__module__!r}",
        )
    prefix = f"{part.role}_"
    for name, model in vars(absent).items():
        if not name.startswith(prefix) or not hasattr(module, name):
            continue
        wanted, law = list(inspect.signature(model).parameters), getattr(module, name)
        if not callable(law) or not _takes(law, len(wanted)):
            has = f"{name}{inspect.signature(law)}" if callable(law) else f"{name} = {law!r}"
            raise InputError(
                f"{where}: {has}", file=where, key=name, expected=f"the function {name}({', '.join(wanted)})"
            )
        if any("print" in function.__code__.co_names for function in _callees(law)):
            # Machine code runs without the interpreter's lock, for which a print would wait.
            raise InputError.of(name, "print", "a law that prints nothing", file=where)
    forces = _FORCES[part.role]
    if complete and forces and not any(hasattr(module, name) for name in forces):
        raise InputError(
            f"{where}: the {part.role} law {part.law!r} has no force",
            file=where,
            key="force",
            expected=f"the function {' or '.join(forces)}",
        )


def _callees(law: Callable[..., Any]) -> list[FunctionType]:
    """Return a law function and all Python functions that it calls, directly or indirectly."""
    waiting: list[object] = [law]
    functions: dict[FunctionType, None] = {}
    while waiting:
        function = waiting.pop()
        if isinstance(function, FunctionType) and function not in functions:
            functions[function] = None
            waiting += [function.__globals__.get(name) for name in function.__code__.co_names]
    return list(functions)


def _takes(law: Callable[..., Any], count: int) -> bool:
    try:
        inspect.signature(law).bind(*range(count))
    except TypeError:
        return False
    return True
