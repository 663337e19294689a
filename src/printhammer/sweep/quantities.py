"""Quantities in a spec: always with their unit, as text or as a table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Final

from pydantic import WithJsonSchema

from printhammer.errors import InputError, located
from printhammer.support.constants import shown
from printhammer.units import describe, parse, to_si

_ONE: Final[dict[str, Any]] = {
    "oneOf": [
        {"type": "string", "description": "number and unit, such as '1.2 kHz'"},
        {
            "type": "object",
            "properties": {"value": {"type": "number"}, "unit": {"type": "string"}},
            "required": ["value", "unit"],
            "additionalProperties": False,
        },
        {"type": "number", "description": "a pure number or a count"},
    ]
}
_MANY: Final[dict[str, Any]] = {
    "oneOf": [
        {"type": "array", "items": _ONE, "minItems": 1},
        {
            "type": "object",
            "properties": {
                "values": {"type": "array", "items": {"type": "number"}, "minItems": 1},
                "unit": {"type": "string"},
            },
            "required": ["values", "unit"],
            "additionalProperties": False,
        },
    ]
}

OneQuantity = Annotated[Any, WithJsonSchema(_ONE)]
"""Type of a field that holds one quantity as a spec writes it."""

ManyQuantities = Annotated[Any, WithJsonSchema(_MANY)]
"""Type of a field that holds several."""


def read_quantity(written: Any, si: str, where: str) -> float:
    """Read one quantity into SI: "1.2 kHz" or { value = 1.2, unit = "kHz" }; a bare number if it is pure.

    Raises
    ------
    InputError
        It is none of these, or of another dimension than the unit `si`.
    """
    with located(where):
        if isinstance(written, str):
            return parse(written, si)
        if isinstance(written, Mapping):
            value, unit = _columns(written, ("value", "unit"))
            return to_si(value, unit, si)
        if si == "1":
            return to_si(written, "1", "1")
    raise InputError(
        f"{where} = {shown(written)} has no unit, expected {describe(si)} as text such as '1 {si}'"
    )


def read_quantities(written: Any, si: str, where: str) -> list[float]:
    """Read several quantities into SI: a list of what `read_quantity` takes, or values with one unit.

    Raises
    ------
    InputError
        As `read_quantity`; or there is none.
    """
    values: Iterable[Any] = written if isinstance(written, list) else ()
    if isinstance(written, Mapping):
        with located(where):
            column, unit = _columns(written, ("values", "unit"))
        values = [{"value": value, "unit": unit} for value in column] if isinstance(column, list) else ()
    numbers = [read_quantity(value, si, f"{where}[{i}]") for i, value in enumerate(values)]
    if not numbers:
        raise InputError(f"{where} = {shown(written)}: expected a list of quantities, at least one")
    return numbers


def _columns(table: Mapping[str, Any], names: tuple[str, str]) -> tuple[Any, str]:
    if set(table) != set(names):
        raise InputError(f"{shown(dict(table))} is expected to have {names[0]} and {names[1]}")
    unit = table[names[1]]
    if not isinstance(unit, str):
        raise InputError(f"the unit {shown(unit)} is expected to be text")
    return table[names[0]], unit
