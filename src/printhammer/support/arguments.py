"""Type checks for the arguments of public functions: hammer, drive, waveform or path.

Passing a name instead of a hammer, or swapping two arguments, raises an `InputError` that names the argument.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, Final, NamedTuple, TypeVar

from printhammer.errors import InputError

F = TypeVar("F", bound=Callable[..., Any])

_PATH: Final = "str | Path"

_KINDS: Final = {
    "Hammer": "a hammer, such as load('hendriks-1983')",
    "Regime": "a regime",
    "Drive": "a drive, such as PulseTrain(hammer.waveform, rate='1 kHz', pulses=9)",
    "Waveform": "a waveform",
    "CompensationTable": "a compensation table, such as a result of tune or load_table",
    "Branch": "a branch of orbits",
    "Orbit": "an orbit",
    _PATH: "a text or a path",
}
"""Noun phrase for each checked class, for error messages."""


class _Argument(NamedTuple):
    name: str
    place: int
    """Positional index of the argument; if keyword-only, the number of positional arguments."""

    classes: frozenset[str]
    expected: str


def check_objects(function: F) -> Callable[[tuple[Any, ...], dict[str, Any]], None]:
    """Build a function that checks the arguments of another function.

    A parameter is checked if its annotation names only classes in `_KINDS`, and possibly None. Objects are
    compared by the names of their classes, so that no class has to be imported.

    Returns
    -------
    Callable
        Function that checks the positional and keyword arguments of a call; raises InputError with name and
        value of an argument of the wrong class.
    """
    arguments = []
    for place, each in enumerate(inspect.signature(function).parameters.values()):
        annotation = str(each.annotation)
        names = [annotation] if annotation == _PATH else [part.strip() for part in annotation.split("|")]
        kinds = [name for name in names if name != "None"]
        if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY) and set(kinds) <= _KINDS.keys():
            classes = frozenset(["NoneType", *kinds] if "None" in names else kinds)
            if annotation == _PATH:
                classes = frozenset({"str", "PurePath"})
            expected = " or ".join(_KINDS[kind] for kind in kinds)
            arguments.append(_Argument(each.name, place, classes, expected))

    def check(positional: tuple[Any, ...], keywords: dict[str, Any]) -> None:
        for name, place, classes, expected in arguments:
            if place < len(positional):
                value = positional[place]
            elif name in keywords:
                value = keywords[name]
            else:
                continue
            if classes.isdisjoint(kind.__name__ for kind in type(value).__mro__):
                raise InputError.of(name, value, expected)

    return check


def checked(function: F) -> F:
    """Decorate a public function so that an argument of the wrong class raises InputError."""
    check = check_objects(function)

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        check(args, keywords)
        return function(*args, **keywords)

    result: Any = call
    typed: F = result
    return typed
