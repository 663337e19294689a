"""Registration of additional parts: from a Python file, or from entry points "printhammer.parts".

A file is imported under its own name, and its folder is added to the Python path, so that worker processes
find the module as well.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib import import_module, invalidate_caches
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from printhammer.errors import InputError
from printhammer.parts.base import PARTS, Part
from printhammer.parts.functions import check_functions

GROUP: Final = "printhammer.parts"
"""Entry-point group of installed packages whose modules register parts."""


def load_parts(path: str | Path) -> list[type[Part]]:
    """Import a Python file that registers parts; return the parts.

    Raises
    ------
    InputError
        The file does not exist, its name is taken by another module, it cannot be imported, it registers no
        part, or a law function is missing or has the wrong arguments.
    """
    source = Path(path).resolve()
    name = source.stem
    if not source.is_file():
        raise InputError(f"{path}: no such file", file=path, expected="a Python file that registers a part")
    if source.suffix != ".py" or not name.isidentifier():
        raise InputError(
            f"{path}: expected a Python file whose name can be imported, such as my_spring.py", file=path
        )
    if str(source.parent) not in sys.path:
        sys.path.append(str(source.parent))
        invalidate_caches()
    known = find_spec(name)
    if known is None or known.origin is None or Path(known.origin).resolve() != source:
        raise InputError(
            f"{path}: another module has the name {name!r} already",
            file=path,
            key="module",
            expected="another name",
        )
    try:
        import_module(name)
    # The file may raise any exception.
    except Exception as error:
        raise InputError(f"{path}: cannot be imported, {_sentence(error)}", file=path) from error
    parts = [part for part in PARTS.values() if part.__module__ == name]
    if not parts:
        raise InputError(
            f"{path}: registers no part", file=path, key="part", expected="a class marked with @register"
        )
    for part in parts:
        check_functions(part, complete=True)
    return parts


@cache
def load_installed() -> None:
    """Import the parts that installed packages register, once per process."""
    for entry in entry_points(group=GROUP):
        try:
            entry.load()
        except Exception as error:
            where = f"the entry point {entry.name!r} = {entry.value!r} of {GROUP}"
            raise InputError(f"{where} cannot be imported, {_sentence(error)}", key=entry.name) from error
    for part in PARTS.values():
        check_functions(part, complete=True)


def _sentence(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"
