"""Edits of a hammer file, applied both to its parsed dictionary and to its TOML text.

The text outside the edited entries is unchanged, including comments and layout.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, MutableMapping
from typing import Any

from pydantic import BaseModel

from printhammer.drive.waveforms.base import QuantityName
from printhammer.errors import InputError, located, nearest
from printhammer.hammer.file import (
    SELECTORS,
    TEXTS,
    UNSAID,
    Body,
    entries_of,
    file_options,
    kinds_of,
    model_of,
    si_unit_of,
)
from printhammer.hammer.uncertainty import UNCERTAINTY
from printhammer.parts.spring.terms import TERMS
from printhammer.support.constants import Constant, quantities, shown

Edit = tuple[str, Any]
"""Edit of a hammer file: a dotted key and its new TOML value; None deletes the key."""


def edit_of(document: Mapping[str, Any], key: str, value: Any, status: str, source: str) -> Edit:
    """Convert a key and value from the user to an edit of a TOML document.

    The key names a constant or option, such as "mass" or "pack.stiffness", a table, such as "backstop", or
    an entry of a list, such as "contact.pole". The value of a constant is text with a unit, a number in SI or
    a `Constant`; the value of a table is a part, a waveform or a mapping; None deletes the key. `status` and
    `source` are assigned to new constants.
    """
    section, _, name = key.rpartition(".")
    if key in SELECTORS:
        return key, None if value is None else _table(key, value, status, source)
    if key.partition(".")[0] in TERMS:
        return _term_edit(document, key, value, status, source)
    if key == UNCERTAINTY:
        return key, value
    if not section:
        model: type[BaseModel] | None = Body
    elif section in SELECTORS:
        selector = SELECTORS[section]
        kind = document.get(section, {}).get(selector, UNSAID.get(section, ""))
        if kind not in kinds_of(section):
            raise InputError(f"the key {shown(key)} is not known, the hammer has no [{section}]", key=key)
        if name == selector:
            raise InputError.of(key, value, f"a whole table for {section!r} instead", written=shown(value))
        model = model_of(section, kind)
    else:
        model = None
    note = quantities(model).get(name) if model is not None else None
    texts = (*TEXTS, "views") if not section else ()
    if model is None or (note is None and name not in file_options(model) and name not in texts):
        tables = [name for name in SELECTORS if isinstance(document.get(name), Mapping)]
        known = [*document, *(f"{table}.{entry}" for table in tables for entry in document[table])]
        expected = nearest(key, known, "one such as 'pack.stiffness'")
        raise InputError(f"the key {shown(key)} is not known", key=key, expected=expected)
    if note is None or value is None:
        return key, value
    # Where several dimensions are allowed, a bare number has the unit of the constant that it replaces.
    before = document.get(section, {}).get(name) if note.also else None
    unit = before.get("unit") if isinstance(before, Mapping) else None
    si = note.si if unit is None else si_unit_of(note, unit)
    return key, _constant(key, si, value, status, source)


def _term_edit(document: Mapping[str, Any], key: str, value: Any, status: str, source: str) -> Edit:
    """Convert a key and value of the lists ``[[force]]`` and ``[[contact]]`` to an edit.

    The key "contact.pole.stiffness" is the constant `stiffness` of the entry named "pole"; the key
    "contact.pole" is the whole entry, whose value is a mapping, or None to delete the entry.
    """
    section, _, place = key.partition(".")
    label, _, name = place.partition(".")
    entry = next((entry for entry in entries_of(document, section) if entry["name"] == label), None)
    if not label:
        expected = f"the name of an entry, such as '{section}.weight'"
        raise InputError.of(key, value, expected, written=shown(value))
    if not name:
        if value is None and entry is not None:
            return key, None
        if not isinstance(value, Mapping):
            raise InputError.of(key, value, f"a table of [[{section}]], or None", written=shown(value))
        content = {"name": label, "law": value.get("law")}
        for each, item in value.items():
            if each not in content:
                made = _term_item(section, content["law"], f"{key}.{each}", item, status, source)
                content |= {} if made is None else {each: made}
        return key, content
    if entry is None:
        names = [f"{section}.{other['name']}.{name}" for other in entries_of(document, section)]
        expected = nearest(key, names, f"an entry of [[{section}]]")
        raise InputError(f"the key {shown(key)} is not known", key=key, expected=expected)
    return key, _term_item(section, entry.get("law"), key, value, status, source)


def _term_item(section: str, law: Any, key: str, value: Any, status: str, source: str) -> Any:
    """Convert the value of a constant or option of an entry of ``[[force]]`` or ``[[contact]]`` to TOML.

    `key` is the dotted key of the constant or option, `law` the law of the entry.
    """
    model = TERMS[section].get(law)
    if model is None:
        place = key.rpartition(".")[0]
        raise InputError.of(f"{place}.law", law, f"one of {', '.join(TERMS[section])}", written=shown(law))
    name = key.rpartition(".")[2]
    note = quantities(model).get(name)
    if note is None and name not in file_options(model):
        expected = nearest(name, [*quantities(model), *file_options(model)])
        raise InputError(f"the key {shown(key)} is not known", key=key, expected=expected)
    return value if note is None or value is None else _constant(key, note.si, value, status, source)


def _constant(key: str, si_unit: str, value: Any, status: str, source: str) -> dict[str, Any]:
    """Convert a value (text, SI number, `Constant` or mapping) to the TOML table of a constant."""
    from printhammer.units import split

    if isinstance(value, Mapping):
        whole = {"status": status, "source": source, **value}
        # Hammer files list value and unit first.
        return dict(sorted(whole.items(), key=lambda item: item[0] in ("status", "source")))
    if isinstance(value, Constant):
        return {"value": value.value, "unit": value.unit, "status": value.status, "source": value.source}
    if isinstance(value, str):
        with located(key, key=key):
            number, unit = split(value, si_unit)
    else:
        try:
            number, unit = float(value), si_unit
        except (TypeError, ValueError, OverflowError):
            raise InputError.of(key, value, f"a number in {si_unit} or text", written=shown(value)) from None
    return {"value": number, "unit": unit, "status": status, "source": source}


def _table(section: str, value: Any, status: str, source: str) -> dict[str, Any]:
    """Convert a part, a waveform or a mapping to the TOML table `section` of a hammer file."""
    selector = SELECTORS[section]
    content = dict(value) if isinstance(value, Mapping) else _fields(section, value)
    if content.get(selector, UNSAID.get(section)) not in kinds_of(section):
        known = ", ".join(kinds_of(section))
        raise InputError.of(
            f"{section}.{selector}",
            content.get(selector),
            f"one of {known}",
            written=shown(content.get(selector)),
        )
    result: dict[str, Any] = {}
    if selector in content:
        result[selector] = content.pop(selector)
    for name, entry in content.items():
        key, item = edit_of({section: result}, f"{section}.{name}", entry, status, source)
        if item is not None:
            result[key.rpartition(".")[2]] = item
    return result


def _fields(section: str, value: Any) -> dict[str, Any]:
    """Return the law or shape, the constants and the options of a part or waveform."""
    selector = SELECTORS[section]
    kind = getattr(type(value), selector, None)
    if kind not in kinds_of(section) or type(value) is not model_of(section, kind):
        raise InputError.of(section, value, "a part, a table, or None", written=shown(value))
    if getattr(value, "content", dict)():
        raise InputError(
            f"{section}: expected a table that names its file, not a part already read from it", key=section
        )
    from printhammer.drive.waveforms.base import UNITS

    driven: QuantityName = getattr(value, "quantity", "current")
    fields: dict[str, Any] = {selector: kind}
    for name, note in quantities(type(value)).items():
        number = getattr(value, name)
        unit = UNITS[driven] if note.also else note.si
        fields[name] = None if number is None else {"value": number, "unit": unit}
    for name in file_options(type(value)):
        if getattr(value, name) != type(value).model_fields[name].default:
            fields[name] = getattr(value, name)
    return fields


def changed(document: Mapping[str, Any], edits: Iterable[Edit]) -> dict[str, Any]:
    """Return a copy of a parsed document with edits applied; unedited values are shared with the original."""
    result = dict(document)
    for key, value in edits:
        section, _, name = key.rpartition(".")
        holder = result
        listed = key.partition(".")[0]
        if listed in TERMS:
            result[listed] = _copy(result.get(listed, []))
            _put_entry(result, key, _copy(value), dict)
            continue
        if section:
            holder = result[section] = dict(result.get(section, {}))
        if isinstance(holder.get(name), Mapping):
            holder[name] = dict(holder[name])
        _put(result, key, _copy(value), dict)
    return result


def _copy(value: Any) -> Any:
    """Copy a parsed TOML value: tables and lists are copied, immutable scalars are not."""
    if isinstance(value, Mapping):
        return {name: _copy(entry) for name, entry in value.items()}
    return [_copy(entry) for entry in value] if isinstance(value, list) else value


def changed_text(text: str, edits: Iterable[Edit]) -> str:
    """Apply edits to the TOML text of a hammer file; comments and layout are preserved."""
    import tomlkit

    def inline(value: Mapping[str, Any]) -> Any:
        table = tomlkit.inline_table()
        table.update(value)
        return table

    def table(value: Mapping[str, Any]) -> Any:
        result = tomlkit.table()
        for name, entry in value.items():
            result[name] = inline(entry) if isinstance(entry, Mapping) else entry
        return result

    document = tomlkit.parse(text)
    for key, value in edits:
        section, _, name = key.rpartition(".")
        if key.partition(".")[0] in TERMS:
            if key.partition(".")[0] not in document:
                document[key.partition(".")[0]] = tomlkit.aot()
            _put_entry(document, key, value, table if key.count(".") == 1 else inline)
        elif key in (*SELECTORS, UNCERTAINTY) and isinstance(value, Mapping):
            document[key] = table(value)
        elif section in SELECTORS and section not in document:
            document[section] = table({name: value})
        else:
            multiline = isinstance(value, str) and "\n" in value
            _put(document, key, tomlkit.string(value, multiline=True) if multiline else value, inline)
    return tomlkit.dumps(document)


def _put_entry(document: MutableMapping[str, Any], key: str, value: Any, table: Callable[..., Any]) -> None:
    """Set a key such as "contact.pole" or "contact.pole.stiffness" in a document; None deletes the key.

    `table` converts a mapping to a TOML table. A new entry is appended to its list; an empty list is deleted.
    """
    section, label, *rest = key.split(".")
    entries = document[section]
    at = next((k for k, entry in enumerate(entries) if entry["name"] == label), len(entries))
    if rest:
        _put(entries[at], rest[0], value, table)
    elif value is None:
        del entries[at]
    elif at < len(entries):
        entries[at] = table(value)
    else:
        entries.append(table(value))
    if not entries:
        del document[section]


def _put(document: MutableMapping[str, Any], key: str, value: Any, table: Callable[..., Any]) -> None:
    """Set a key such as "mass" or "pack.stiffness" in a document; None deletes the key.

    `table` converts a mapping to a TOML table.
    """
    section, _, name = key.rpartition(".")
    holder: Any = document.setdefault(section, {}) if section else document
    if value is None:
        holder.pop(name, None)
    elif isinstance(value, Mapping) and isinstance(holder.get(name), Mapping) and name not in SELECTORS:
        # The value is edited in place, which keeps the comment at the end of the line.
        for part, entry in value.items():
            holder[name][part] = entry
    else:
        holder[name] = table(value) if isinstance(value, Mapping) else value
