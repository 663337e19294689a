"""Forces and contacts on the page: the numbers of spring and damping as functions of the constants.

The page receives the sum of the spring and of the entries of ``[[force]]`` and ``[[contact]]`` as one array
of numbers (`printhammer.parts.spring.forces`), and a damping with dry friction as another
(`printhammer.parts.friction`). Each number of these arrays is a sum of products of constants, which the page
evaluates again when a control changes one of the constants.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import Range, range_of
from printhammer.parts.friction import DryFriction
from printhammer.parts.spring.forces import WIDTH, ForceSum
from printhammer.parts.spring.terms import TERMS, Friction, LinearContact, SampledForce
from printhammer.studio.bounds import QUARTER_TURN, SPAN, SPAN_OF_PLACES

Product = tuple[float, list[str], list[str], list[str]]
"""Factor, and keys of the constants that the product contains as factors, as divisors, and as sines."""

_Template = tuple[float, tuple[str, ...], tuple[str, ...], tuple[str, ...]]


def _alone(name: str, factor: float = 1.0) -> _Template:
    return (factor, (name,), (), ())


_CUBIC: Final = {1: _alone("center"), 3: _alone("stiffness", -1.0), 4: _alone("cubic", -1.0)}
_CONTACT: Final = {1: _alone("position"), 2: _alone("stiffness"), 4: _alone("damping")}
_ROWS: Final[dict[str, dict[int, _Template]]] = {
    "spring.linear": {2: _alone("Bs"), 3: (-1.0, ("Bs",), ("As",), ())},
    "spring.preload": {2: _alone("preload"), 3: _alone("stiffness", -1.0)},
    "spring.cubic": _CUBIC,
    "force.constant": {2: _alone("force")},
    "force.gravity": {2: (-1.0, ("mass", "acceleration"), (), ("angle",))},
    "force.spring": {1: _alone("position"), 2: _alone("preload"), 3: _alone("stiffness", -1.0)},
    "force.cubic": _CUBIC,
    "contact.linear": _CONTACT,
    "contact.hertz": _CONTACT,
}
"""Products that set the columns of the row of a spring, force or contact, by section and law."""


def sums_of(hammer: Hammer) -> dict[str, list[tuple[int, list[Product]]]]:
    """Return the numbers of spring and damping as sums of products of constants, by role.

    An entry consists of the index of a number and the products whose sum is the number. Numbers that no
    constant of the hammer file determines are omitted; the result is empty for a hammer without forces and
    contacts.
    """
    sums: dict[str, list[tuple[int, list[Product]]]] = {}
    if isinstance(hammer.spring, ForceSum):
        sums["spring"] = list(_numbers_of_rows(hammer))
    if isinstance(hammer.damping, DryFriction):
        sums["damping"] = _numbers_of_friction(hammer)
    return sums


def _numbers_of_rows(hammer: Hammer) -> Iterator[tuple[int, list[Product]]]:
    laws = hammer.laws
    summed = [key for key, term in hammer.terms.items() if not isinstance(term, Friction | SampledForce)]
    for number, key in enumerate([*(["spring"] if "spring" in laws else []), *summed]):
        template = _ROWS[f"{key.partition('.')[0]}.{laws[key]}"]
        for column, product in template.items():
            if found := _product(hammer, key, product):
                yield 1 + WIDTH * number + column, [found]


def _product(hammer: Hammer, entry: str, template: _Template) -> Product | None:
    """Insert the keys of an entry of the hammer file into the template of a product.

    Return None if a constant other than `acceleration` is missing.
    """
    factor, *roles = template
    keys: list[list[str]] = []
    for names in roles:
        keys.append([])
        for name in names:
            key = name if name == "mass" else f"{entry}.{name}"
            if key in hammer.constants:
                keys[-1].append(key)
            elif name == "acceleration":
                factor *= getattr(hammer.terms[entry], name)
            else:
                return None
    return (factor, keys[0], keys[1], keys[2])


def _numbers_of_friction(hammer: Hammer) -> list[tuple[int, list[Product]]]:
    entries = [key for key, term in hammer.terms.items() if isinstance(term, Friction)]
    known = hammer.constants
    kinetic = [f"{entry}.kinetic" for entry in entries]
    static = [key if (key := f"{entry}.static") in known else f"{entry}.kinetic" for entry in entries]
    viscous = [key for key in ("damping.coefficient",) if key in known]
    columns = enumerate((viscous, kinetic, static))
    return [(column, [(1.0, [key], [], []) for key in keys]) for column, keys in columns if keys]


def contacts_of(hammer: Hammer) -> list[dict[str, Any]]:
    """Return name, side and position [m] of each ``[[contact]]`` of a hammer."""
    return [
        {"name": key.partition(".")[2], "side": contact.side, "position": contact.position}
        for key, contact in hammer.terms.items()
        if isinstance(contact, LinearContact)
    ]


def frictions_of(hammer: Hammer) -> list[list[str]]:
    """Return the keys of kinetic and static friction of each friction entry that states both."""
    entries = (key for key, term in hammer.terms.items() if isinstance(term, Friction))
    pairs = [[f"{entry}.kinetic", f"{entry}.static"] for entry in entries]
    return [pair for pair in pairs if pair[1] in hammer.constants]


def is_place(key: str) -> bool:
    """Whether a dotted key denotes the position of a force or contact."""
    return key.partition(".")[0] in TERMS and key.rpartition(".")[2] in ("position", "center")


def span_of_term(hammer: Hammer, key: str) -> Range:
    """Return the slider range of a constant of a force or contact.

    Positions vary by half the largest distance between the positions of the hammer, in either direction; a
    contact stays beyond the backstop. Angles vary by a quarter turn about 0, or more if the file states more.
    Other constants have the range of `range_of`.
    """
    constant = hammer.constants[key]
    value = constant.si
    if constant.si_unit == "rad":
        return Range(min(-QUARTER_TURN, value), max(QUARTER_TURN, value), logarithmic=False)
    if not is_place(key):
        return range_of(hammer, key, SPAN)
    known = [place for place in (hammer.position, hammer.front, hammer.platen) if place is not None]
    places = [*known, *(constant.si for own, constant in hammer.constants.items() if is_place(own))]
    reach = 0.5 * (max(places) - min(places)) or abs(value) or SPAN_OF_PLACES
    low = value - reach
    if key.startswith("contact.") and hammer.position is not None:
        low = max(low, hammer.position)
    return Range(low, value + reach, logarithmic=False)
