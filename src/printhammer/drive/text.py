"""Conversion of drives and waveforms to TOML text, which `printhammer.drive.file` parses.

Numbers are written in SI with all digits, so that reading restores the drive exactly.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from typing import Any

from printhammer.drive.waveforms.base import Waveform
from printhammer.drive.waveforms.shapes import Chain, Sampled, Switched
from printhammer.support.constants import quantities

_BARE = re.compile("[A-Za-z0-9_-]+")

FORMAT = 1
"""Version of the drive file format."""


def quantity_text(value: float, unit: str) -> dict[str, Any]:
    """Format one quantity as a TOML inline table with value and unit; -0.0 is written as 0.0."""
    return {"value": float(value) + 0.0, "unit": unit}


def column_text(values: Iterable[float], unit: str) -> dict[str, Any]:
    """Format numbers with a common unit as a TOML inline table with values and unit."""
    return {"values": [float(value) + 0.0 for value in values], "unit": unit}


def waveform_text(waveform: Waveform) -> dict[str, Any]:
    """Return the ``[waveform]`` table of a drive file, including the samples of a record."""
    result: dict[str, Any] = {"shape": waveform.shape}
    if isinstance(waveform, Chain):
        result["parts"] = [
            {"at": quantity_text(offset, "s"), **waveform_text(part)} for offset, part in waveform.parts
        ]
        return result
    if isinstance(waveform, Sampled):
        result["interpolation"] = waveform.interpolation
        result["time"] = column_text(waveform.times, "s")
        result[waveform.quantity] = column_text(waveform.values, waveform.unit)
        return result
    if isinstance(waveform, Switched):
        result["at"] = column_text(waveform.at, "s")
        result["levels"] = column_text(waveform.levels, waveform.unit)
    if waveform.replaces:
        result["decay"] = getattr(waveform, "decay", "diode")
    for name, note in quantities(type(waveform)).items():
        value = getattr(waveform, name)
        if value is not None:
            result[name] = quantity_text(value, waveform.unit if note.also else note.si)
    return result


def inline(value: Any) -> str:
    """Format a TOML value on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {inline(entry)}" for key, entry in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(inline(entry) for entry in value) + "]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return repr(value)


def _key(name: str) -> str:
    """Format a TOML key, quoted if necessary."""
    return name if _BARE.fullmatch(name) else inline(name)


def document(head: Mapping[str, Any], tables: Mapping[str, Mapping[str, Any]]) -> str:
    """Format a TOML document: top-level keys first, then the tables."""
    blocks = ["\n".join(f"{key} = {inline(value)}" for key, value in head.items())]
    for name, table in tables.items():
        blocks.append(
            "\n".join([f"[{name}]", *(f"{_key(key)} = {inline(value)}" for key, value in table.items())])
        )
    return "\n\n".join(blocks) + "\n"
