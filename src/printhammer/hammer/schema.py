"""JSON schema of hammer files, from the declarations of parts, forces, contacts and waveforms."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, TypeAdapter

from printhammer.hammer.file import (
    CONSTANT_KEYS,
    FORMAT,
    SELECTORS,
    TEXTS,
    UNSAID,
    VIEWS,
    Body,
    file_options,
    kinds_of,
    model_of,
)
from printhammer.hammer.uncertainty import ENTRIES, UNCERTAINTY
from printhammer.parts.spring.terms import TERMS
from printhammer.support.constants import STATUSES, Quantity, quantities

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of hammer files.

    The schema cannot express the dimensions of units, the order of positions, or which constants exclude each
    other; `printhammer hammer check` tests these rules.
    """
    properties: dict[str, Any] = {"format": {"const": FORMAT, "description": "version of the file format"}}
    properties |= {name: {"type": "string", "description": meaning} for name, meaning in TEXTS.items()}
    properties["name"]["minLength"] = 1
    properties["views"] = {
        "type": "array",
        "description": "views of the studio that apply; chosen by the parts if missing",
        "items": {"enum": list(VIEWS)},
        "minItems": 1,
        "uniqueItems": True,
    }
    properties |= _constants(Body)
    for section, selector in SELECTORS.items():
        tables = [_table(section, kind, selector) for kind in kinds_of(section)]
        properties[section] = {"oneOf": tables}
    for section, models in TERMS.items():
        entries = [_term(section, law, model) for law, model in models.items()]
        properties[section] = {"type": "array", "items": {"oneOf": entries}}
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


def _term(section: str, law: str, model: type[BaseModel]) -> dict[str, Any]:
    """Return the schema of an entry of ``[[force]]`` or ``[[contact]]`` with the given law."""
    table = _described(model, {"law": {"const": law}, "name": {"type": "string"}}, ["law", "name"])
    return {**table, "title": f"[[{section}]] {law}"}


def _table(section: str, kind: str, selector: str) -> dict[str, Any]:
    """Return the schema of a part or waveform table; `selector` is the key of its law or shape `kind`."""
    needed = [] if UNSAID.get(section) == kind else [selector]
    return _described(model_of(section, kind), {selector: {"const": kind}}, needed)


def _described(model: type[BaseModel], properties: dict[str, Any], needed: list[str]) -> dict[str, Any]:
    """Return the schema of a table with the given `properties` and the constants and options of `model`.

    `needed` lists the properties that are required in addition to the required constants and options.
    """
    properties |= _constants(model)
    for name, annotation in file_options(model).items():
        description = model.model_fields[name].description
        properties[name] = TypeAdapter(annotation).json_schema()
        if description:
            properties[name]["description"] = description
    required = [name for name in file_options(model) if model.model_fields[name].is_required()]
    doc = (model.__doc__ or "").strip().partition("\n")[0]
    return {"description": doc, **_object(properties, [*needed, *_required(model), *required])}


def _object(properties: dict[str, Any], required: list[str]) -> dict[str, Any]:
    """Return the schema of an object that allows no other properties."""
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def _required(model: type[BaseModel]) -> list[str]:
    """Return the names of the required constants of a model."""
    return [name for name, note in quantities(model).items() if note.required]


def _constants(model: type[BaseModel]) -> dict[str, Any]:
    """Return the schemas of the constants of a model, by name."""
    return {name: _constant_schema(note) for name, note in quantities(model).items()}


def _constant_schema(note: Quantity) -> dict[str, Any]:
    """Return the JSON schema of one constant.

    The schema contains a bound only if it holds in every unit: a bound of zero, or a bound of a pure number.
    """
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
