"""Read and validate data sheets of actuators: TOML files with the values published by a manufacturer.

    name = "pull-12v"
    source = "manufacturer's data sheet, page 3"
    rail = "12 V"
    resistance = "10 ohm"                    # at 20 degC
    force = [["0.25 mm", "85.9 N"], ["5 mm", "3.59 N"]]
    stroke = "4.75 mm"
    mass = "26 g"

These keys are required. Optional keys:

- `current`, at which the forces are specified (default: `rail` / `resistance`), and `end_gap`, the remaining
  gap at the end of the stroke (default: 0 mm);
- `inductance`, with the gap at which it was measured, as ``["45 mH", "4 mm"]``; `turns`; `pole_diameter`;
  `residual_gap`, an air gap in series with the working gap;
- `spring`, with `preload` at rest and `stiffness`; `target`, the distance to the struck object, if it is not
  at the end of the stroke; `stop`, with the `restitution` of both ends, or with `stiffness` and `damping` of
  the struck object;
- `make_contact`, with the `gap` at rest and the `force` at the end of the stroke, `break_contact`, with the
  `force` at rest and the `overtravel` until the contact opens, and the `rating` of the contacts, as a text;
- `operate_time`, `release_time` and `bounce_time`, which the contacts must not exceed, and `size`, the
  smallest side or diameter of the device; they are compared with the hammer;
- `on_time`; `driver`, a waveform table without its voltage; `title`, `note` and `strike`, the noun for the
  result of a pulse.

`assumed` lists the keys whose values were guessed rather than read from the sheet, and ``[why]`` states a
source for single keys.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from printhammer.errors import InputError, located, nearest
from printhammer.hammer.file import read_document
from printhammer.support.constants import shown
from printhammer.support.files import read_text
from printhammer.units import describe, split, to_si

TEXTS: Final = {"name": True, "source": True, "title": False, "note": False, "strike": False, "rating": False}
"""Text keys of a data sheet, and whether each key is required."""

QUANTITIES: Final = {
    "rail": ("V", True),
    "resistance": ("ohm", True),
    "stroke": ("m", True),
    "mass": ("kg", True),
    "current": ("A", False),
    "end_gap": ("m", False),
    "turns": ("1", False),
    "pole_diameter": ("m", False),
    "residual_gap": ("m", False),
    "target": ("m", False),
    "on_time": ("s", False),
    "size": ("m", False),
    "operate_time": ("s", False),
    "release_time": ("s", False),
    "bounce_time": ("s", False),
}
"""Quantities of a data sheet: the SI unit of each, and whether the quantity is required."""

TABLES: Final = {
    "spring": {"preload": "N", "stiffness": "N/m"},
    "stop": {"restitution": "1", "stiffness": "N/m", "damping": "N s/m"},
    "make_contact": {"gap": "m", "force": "N"},
    "break_contact": {"overtravel": "m", "force": "N"},
}
"""Tables of a data sheet, each with its quantities and their SI units."""

LIMITS: Final = ("operate_time", "release_time", "bounce_time")
"""Quantities of a data sheet that limit the switching times of its contacts."""

_ZERO: Final = ("end_gap", "spring.preload", "spring.stiffness", "stop.restitution", "stop.damping")
_OTHERS: Final = ("force", "inductance", "driver", "assumed", "why")
_PAIR: Final = 2  # Length of a pair of gap and force, by definition
_WHOLE: Final = 1e6  # Magnitude up to which whole numbers are written without a decimal point; arbitrary


@dataclass(frozen=True)
class Entry:
    """Quantity of a data sheet: value and unit as written, and value in SI."""

    key: str
    value: float
    unit: str
    """Unit as written in the data sheet."""
    si: float


@dataclass(frozen=True)
class DataSheet:
    """Contents of a data sheet: quantities, force table, inductance, and their sources."""

    where: str
    """File name of the data sheet, for error messages."""
    texts: dict[str, str]
    entries: dict[str, Entry]
    """Quantities by key, such as "mass" and "spring.preload"."""
    force: list[tuple[Entry, Entry]]
    """Gap and force pairs, in the order of the data sheet."""
    inductance: tuple[Entry, Entry] | None
    """Inductance, and the gap of the measurement."""
    driver: dict[str, Any]
    assumed: frozenset[str]
    """Keys whose values were guessed by the person who transcribed the data sheet."""
    why: dict[str, str] = field(default_factory=dict)
    """Sources of individual quantities, by key."""

    def si(self, key: str, otherwise: float = math.nan) -> float:
        """Return a quantity of the data sheet in SI; for a missing quantity, `otherwise`."""
        return self.entries[key].si if key in self.entries else otherwise

    def origin(self, key: str) -> tuple[str, str]:
        """Return status and source of a key; a key without a source inherits the source of its table."""
        holder = key.partition(".")[0]
        guessed = not self.assumed.isdisjoint((key, holder))
        otherwise = "assumed beside the data sheet" if guessed else f"data sheet: {self.texts['source']}"
        why = self.why.get(key, self.why.get(holder, otherwise))
        return "assumed" if guessed else "datasheet", why

    def constant(self, key: str) -> dict[str, Any]:
        """Return a quantity as a constant of a hammer file, with status and source."""
        entry = self.entries[key]
        status, source = self.origin(key)
        return {"value": plain(entry.value), "unit": entry.unit, "status": status, "source": source}


def plain(value: float) -> float | int:
    """Convert a whole number to `int`; return any other number unchanged."""
    return int(value) if value.is_integer() and abs(value) < _WHOLE else value


def read_sheet(path: str | Path) -> DataSheet:
    """Read and validate a data sheet.

    Raises
    ------
    InputError
        The file cannot be read, is not TOML, or has a missing, unknown or invalid entry; the message names
        file, key, value and expectation.
    """
    source = Path(path)
    document = read_document(read_text(source, "the data sheet"), str(source))
    with located(str(source)):
        return _sheet(document, str(source))


def _sheet(document: Mapping[str, Any], where: str) -> DataSheet:
    known = (*TEXTS, *QUANTITIES, *TABLES, *_OTHERS)
    for key in document:
        if key not in known:
            raise InputError(
                f"the key {shown(key, quotes=False)} is not known", key=key, expected=f"{nearest(key, known)}"
            )
    for key in [key for key, needed in TEXTS.items() if needed] + [
        *(key for key, (_si, needed) in QUANTITIES.items() if needed),
        "force",
    ]:
        if key not in document:
            raise InputError(
                f"{key} is missing", key=key, expected=f"{_WANTED.get(key) or _quantity_text(key)}"
            )
    texts = {key: document[key] for key in TEXTS if key in document}
    for key, text in texts.items():
        if not isinstance(text, str) or not text.strip():
            raise InputError.of(key, text, "text in quotes", written=shown(text))
    entries = {
        key: _entry(key, document[key], si) for key, (si, _needed) in QUANTITIES.items() if key in document
    }
    for name, units in TABLES.items():
        table = document.get(name, {})
        if not isinstance(table, Mapping):
            raise InputError.of(name, table, f"a table with {' and '.join(units)}", written=shown(table))
        for key, value in table.items():
            if key not in units:
                raise InputError(
                    f"the key {name}.{key} is not known",
                    key=f"{name}.{key}",
                    expected=f"{nearest(key, units)}",
                )
            entries[f"{name}.{key}"] = _entry(f"{name}.{key}", value, units[key])
    force = document["force"]
    if not isinstance(force, list) or not force:
        raise InputError.of("force", force, _WANTED["force"], written=shown(force))
    points = [
        _pair(f"force, point {number}", pair, ("m", "N"), _WANTED["force"])
        for number, pair in enumerate(force, 1)
    ]
    inductance = None
    if "inductance" in document:
        inductance = _pair("inductance", document["inductance"], ("H", "m"), '["45 mH", "4 mm"]')
    driver = document.get("driver", {})
    if not isinstance(driver, Mapping):
        raise InputError.of("driver", driver, "a table with a shape", written=shown(driver))
    sheet = DataSheet(
        where, texts, entries, points, inductance, dict(driver), _assumed(document), _why(document)
    )
    _check(sheet)
    return sheet


_WANTED: Final = {
    "name": "a short name of the device",
    "source": "the origin of the data sheet",
    "force": 'gaps and forces such as [["0.5 mm", "40 N"], ["5 mm", "3.6 N"]]',
}


def _quantity_text(key: str) -> str:
    return f"{describe(QUANTITIES[key][0])} in quotes, with its unit"


def _entry(key: str, written: Any, si: str, *, zero: bool = False) -> Entry:
    """Parse a quantity with the SI unit `si`; the value must be positive or, with `zero`, non-negative."""
    zero = zero or key in _ZERO
    if isinstance(written, bool) or not isinstance(written, str | int | float):
        raise InputError.of(
            key,
            written,
            f"{describe(si)} in quotes, with its unit",
            written=shown(written),
        )
    with located(key, key=key):
        value, unit = split(written if isinstance(written, str) else repr(written), si)
        size = to_si(value, unit, si)
    if size < 0.0 or (size == 0.0 and not zero):
        least = "0 or more" if zero else "more than 0"
        raise InputError.of(key, written, least, written=shown(written))
    return Entry(key, value, unit, size)


def _pair(key: str, written: Any, units: tuple[str, str], wanted: str) -> tuple[Entry, Entry]:
    """Parse a pair of quantities with given SI units; a length in the pair may be 0."""
    if not isinstance(written, list) or len(written) != _PAIR:
        raise InputError.of(key, written, wanted, written=shown(written))
    first, second = (_entry(key, part, si, zero=si == "m") for part, si in zip(written, units, strict=True))
    return first, second


def _keys(document: Mapping[str, Any]) -> list[str]:
    """List the keys of a data sheet that `assumed` and `[why]` may name: top-level and table entries."""
    whole = [key for key in document if key not in (*TEXTS, "assumed", "why")]
    inner = [f"{name}.{key}" for name in (*TABLES, "driver") for key in document.get(name, {})]
    return [*whole, *inner]


def _assumed(document: Mapping[str, Any]) -> frozenset[str]:
    assumed = document.get("assumed", [])
    if not isinstance(assumed, list):
        raise InputError.of(
            "assumed",
            assumed,
            'keys of this sheet, such as ["mass"]',
            written=shown(assumed),
        )
    known = _keys(document)
    for key in assumed:
        if key not in known:
            expected = nearest(str(key), known)
            raise InputError(
                f"assumed: {shown(key)} is not a key of this sheet", key="assumed", expected=expected
            )
    return frozenset(assumed)


def _why(document: Mapping[str, Any]) -> dict[str, str]:
    why = document.get("why", {})
    if not isinstance(why, Mapping) or not all(
        isinstance(text, str) and text.strip() for text in why.values()
    ):
        raise InputError.of("why", why, "a table of keys and texts", written=shown(why))
    for key in why:
        if key not in _keys(document):
            raise InputError(f"why.{key}: no such key", key=f"why.{key}", expected="a key of this sheet")
    return dict(why)


def _check(sheet: DataSheet) -> None:
    """Raise `InputError` if the entries of a data sheet contradict each other."""
    gaps = [gap.si for gap, _force in sheet.force]
    if len(set(gaps)) < len(gaps):
        raise InputError("force: a gap occurs twice", key="force", expected="one force per gap")
    restitution = sheet.si("stop.restitution", 0.0)
    if restitution > 1.0:
        raise InputError.of("stop.restitution", restitution, "1 or less", written=f"{restitution:g}")
    if ("stop.stiffness" in sheet.entries) != ("stop.damping" in sheet.entries):
        raise InputError("stop: expected both stiffness and damping, or neither", key="stop")
    for name in ("make_contact", "break_contact"):
        missing = [key for key in TABLES[name] if f"{name}.{key}" not in sheet.entries]
        if len(missing) == 1:
            raise InputError(
                f"{name}.{missing[0]} is missing", key=f"{name}.{missing[0]}", expected="a quantity"
            )
    for key in ("make_contact.gap", "break_contact.overtravel"):
        if sheet.si(key, 0.0) >= sheet.si("stroke"):
            entry, stroke = sheet.entries[key], sheet.entries["stroke"]
            raise InputError.of(
                key,
                entry.si,
                f"less than the stroke of {stroke.value:g} {stroke.unit}",
                written=f"{entry.value:g} {entry.unit}",
            )
    if any(name in sheet.entries for name in LIMITS) and "make_contact.force" not in sheet.entries:
        raise InputError(
            "make_contact is missing", key="make_contact", expected="the contact of the stated times"
        )
    if sheet.si("target", 0.0) > sheet.si("stroke"):
        target, stroke = sheet.entries["target"], sheet.entries["stroke"]
        raise InputError(
            f"target = {target.value:g} {target.unit}: expected it within the stroke of {stroke.value:g}"
            f" {stroke.unit}",
            key="target",
            value=target.value,
        )
