"""Type checks of public functions for arguments that are a hammer, a drive or a waveform.

A name in place of a hammer, or two arguments swapped, is an `InputError` that names the argument.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, Final, NamedTuple, TypeVar

from printhammer.errors import InputError

F = TypeVar("F", bound=Callable[..., Any])

_KINDS: Final = {
    "Hammer": "a hammer, as load('hendriks-1983') gives one",
    "Regime": "a regime",
    "Drive": "a drive, such as PulseTrain(hammer.waveform, rate='1 kHz', pulses=9)",
    "Waveform": "a waveform",
    "CompensationTable": "a compensation table, as tune or load_table gives one",
    "Branch": "a branch of orbits",
    "Orbit": "an orbit",
}
"""Names of the classes that are checked, and the words for an object of each."""


class _Argument(NamedTuple):
    name: str
    place: int
    """Place among the positional arguments; the number of these for one that has to be named."""

    classes: frozenset[str]
    expected: str


def check_objects(function: F) -> Callable[[tuple[Any, ...], dict[str, Any]], None]:
    """Build the check of a function's arguments.

    It looks at the parameters whose annotation is a union of classes in `_KINDS` and None. Objects are known
    by the names of their classes, so that nothing has to be imported.

    Returns
    -------
    Callable
        Takes the positional arguments and the keywords of a call; InputError with the name and the value of
        an argument that is not of its class.
    """
    arguments = []
    for place, each in enumerate(inspect.signature(function).parameters.values()):
        names = [part.strip() for part in str(each.annotation).split("|")]
        kinds = [name for name in names if name != "None"]
        if each.kind in (each.POSITIONAL_OR_KEYWORD, each.KEYWORD_ONLY) and set(kinds) <= _KINDS.keys():
            classes = frozenset(["NoneType", *kinds] if "None" in names else kinds)
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
    """Decorate a public function to raise InputError for an argument that is not the object annotated."""
    check = check_objects(function)

    @functools.wraps(function)
    def call(*args: Any, **keywords: Any) -> Any:
        check(args, keywords)
        return function(*args, **keywords)

    result: Any = call
    typed: F = result
    return typed
