"""JSON schema of hammer files, made of what the parts say about their constants."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, TypeAdapter

from printhammer.hammer.file import (
    CONSTANT_KEYS,
    FORMAT,
    SELECTORS,
    TEXTS,
    UNSAID,
    Body,
    file_options,
    kinds_of,
    model_of,
)
from printhammer.hammer.uncertainty import ENTRIES, UNCERTAINTY
from printhammer.support.constants import STATUSES, Quantity, quantities

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of hammer files: what a file may hold.

    Dimensions, the order of positions and constants that stand in the place of others are left to
    `printhammer hammer check`.
    """
    properties: dict[str, Any] = {"format": {"const": FORMAT, "description": "version of the file format"}}
    properties |= {name: {"type": "string", "description": meaning} for name, meaning in TEXTS.items()}
    properties["name"]["minLength"] = 1
    properties |= _constants(Body)
    for section, selector in SELECTORS.items():
        tables = [_table(section, kind, selector) for kind in kinds_of(section)]
        properties[section] = {"oneOf": tables}
    properties[UNCERTAINTY] = _object(
        {name: {"type": "array", "description": meaning} for name, meaning in ENTRIES.items()}, ["constants"]
    )
    result = _object(properties, ["format", "name", *_required(Body)])
    return {
        "$schema": _DIALECT,
        "title": "printhammer hammer file",
        **result,
        "$defs": {"constant": _CONSTANT},
    }


def _table(section: str, kind: str, selector: str) -> dict[str, Any]:
    model = model_of(section, kind)
    properties: dict[str, Any] = {selector: {"const": kind}}
    properties |= _constants(model)
    for name, annotation in file_options(model).items():
        description = model.model_fields[name].description
        properties[name] = TypeAdapter(annotation).json_schema()
        if description:
            properties[name]["description"] = description
    required = [name for name in file_options(model) if model.model_fields[name].is_required()]
    doc = (model.__doc__ or "").strip().partition("\n")[0]
    needed = [] if UNSAID.get(section) == kind else [selector]
    return {"description": doc, **_object(properties, [*needed, *_required(model), *required])}


def _object(properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def _required(model: type[BaseModel]) -> list[str]:
    return [name for name, note in quantities(model).items() if note.required]


def _constants(model: type[BaseModel]) -> dict[str, Any]:
    return {name: _constant(note) for name, note in quantities(model).items()}


def _constant(note: Quantity) -> dict[str, Any]:
    """Return the schema of one constant; of its bounds only the sign does not depend on the unit."""
    units = " or ".join((note.si, *(unit for unit in note.also if unit != note.si)))
    result: dict[str, Any] = {
        "$ref": "#/$defs/constant",
        "description": f"{note.meaning}, {note.symbol}, in {units} or a unit like it",
    }
    if note.gt == 0:
        result["properties"] = {"value": {"exclusiveMinimum": 0}}
    elif note.ge == 0:
        result["properties"] = {"value": {"minimum": 0}}
    if note.si == "1" and not note.also and note.le is not None:
        result.setdefault("properties", {"value": {}})["value"]["maximum"] = note.le
    return result


_CONSTANT: dict[str, Any] = _object(
    {
        "value": {"type": "number"},
        "unit": {"type": "string", "minLength": 1},
        "status": {"enum": list(STATUSES)},
        "source": {"type": "string", "minLength": 1},
    },
    list(CONSTANT_KEYS),
)
