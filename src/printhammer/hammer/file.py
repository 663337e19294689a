"""Hammer files: parsing of TOML into parts, constants and waveform.

A file has ``format = 1``, ``name``, optionally ``title``, ``note``, ``strike`` and ``views``, the constants
``mass`` and ``platen``, and a table for each part: ``[magnet]``, ``[coil]``, ``[spring]``, ``[pack]``,
``[backstop]`` and ``[damping]`` with their ``law``, ``[waveform]`` with its ``shape``, any number of
``[[force]]`` and ``[[contact]]`` with ``name`` and ``law`` (`printhammer.parts.spring.terms`), and
``[uncertainty]`` with standard errors of constants (`printhammer.hammer.uncertainty`). All but name and mass
are optional. A constant is ``{ value = 0.008, unit = "in", status = "stated", source = "Fig. 3" }``, with the
unit "1" for a pure number.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError, located, nearest
from printhammer.hammer.uncertainty import UNCERTAINTY, Uncertainty, read_uncertainty
from printhammer.parts import PARTS, ROLES, BackstopPart, MagnetPart, PackPart, Part, SpringPart, laws
from printhammer.parts.friction import DryFriction, with_friction
from printhammer.parts.functions import check_functions
from printhammer.parts.outside import load_installed
from printhammer.parts.spring.forces import ForceSum
from printhammer.parts.spring.sums import sum_of
from printhammer.parts.spring.terms import TERMS, Friction, Term
from printhammer.support.constants import (
    STATUSES,
    Constant,
    Quantity,
    invalid,
    options,
    quantities,
    quantity,
    shown,
)

FORMAT: Final = 1
"""Version of the hammer file format."""

CONSTANT_KEYS: Final = ("value", "unit", "status", "source")
TEXTS: Final = {
    "name": "short name of the hammer",
    "title": "one-line description of the hammer",
    "note": "important remarks on the constants",
    "strike": "noun for the result of a pulse, as shown in summaries; 'dot' if missing",
    "struck": "noun for the struck object, as shown by the studio; 'paper' or 'pack' if missing",
    "mover": "noun for the moving part, as shown by the studio; 'armature' if missing",
    "length_unit": "unit of lengths in the studio: um, mm or m; chosen by the stroke if missing",
    "time_unit": "unit of times in the studio: us, ms or s; chosen by the pulse width if missing",
}
"""Text entries of a hammer file and their meanings."""

VIEWS: Final = ("motion", "forces", "loops", "phase", "sketch", "map", "strobe", "energy", "line")
"""Names of the views that the studio can display, and that the entry ``views`` of a hammer file may list."""

_NOUN: Final = re.compile("[a-z]+(-[a-z]+)*")
_LABEL: Final = re.compile("[a-z][a-z0-9]*([-_][a-z0-9]+)*")
_EXPECTED: Final = {
    "strike": (_NOUN, "a noun in lower case whose plural ends in s, such as 'closing'"),
    "struck": (_NOUN, "a noun in lower case, such as 'pole'"),
    "mover": (_NOUN, "a noun in lower case, such as 'ball'"),
    "length_unit": (re.compile("um|mm|m"), "um, mm or m"),
    "time_unit": (re.compile("us|ms|s"), "us, ms or s"),
}
"""Regular expression of each optional text entry, and the expectation stated in error messages."""

SELECTORS: Final = {**dict.fromkeys(ROLES, "law"), "waveform": "shape"}
"""Tables of a hammer file, each with the key that selects its law or shape."""

UNSAID: Final = {"coil": "winding"}
"""Default law or shape of the tables that need not contain the key `law` or `shape`."""

_M = TypeVar("_M", bound=BaseModel)


class Body(BaseModel):
    """Constants at the top level of a hammer file."""

    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)

    mass: float = quantity("kg", "m", "mass of the armature", gt=0)
    platen: float | None = quantity("m", "x_platen", "position of the platen", default=None)


@dataclass(frozen=True)
class Contents:
    """Parsed contents of a hammer file in SI; `parts` by role, forces and contacts (`terms`) by key."""

    name: str
    title: str
    note: str
    strike: str
    struck: str
    mover: str
    length_unit: str
    time_unit: str
    views: tuple[str, ...]
    body: Body
    parts: dict[str, Part]
    terms: dict[str, Term]
    waveform: Waveform | None
    constants: dict[str, Constant]
    uncertainty: Uncertainty | None


def read_document(text: str, where: str) -> dict[str, Any]:
    """Read TOML text into plain dictionaries."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        # tomllib raises a bare ValueError for a number with thousands of digits.
        raise InputError(
            f"{where}: expected a TOML file ({' '.join(str(error).split())})", file=where
        ) from None


def build(
    document: Mapping[str, Any],
    where: str,
    folder: Path,
    like: tuple[Mapping[str, Any], Contents] | None = None,
) -> Contents:
    """Build and validate the contents of a hammer file, in SI, from its TOML document.

    Error messages begin with `where`, usually the file; force tables and sampled waveforms are read from
    `folder`. A table that is the identical object in the document `like` is not parsed again; the contents
    parsed from `like` are reused.

    Raises
    ------
    InputError
        A key is unknown or missing, a value is of the wrong kind, dimension or range, or positions are out of
        order.
    """
    with located(where):
        return _build(document, folder, *(like or ({}, None)))


def model_of(section: str, kind: str) -> type[BaseModel]:
    """Return the class that holds a table of a hammer file, such as the class of "pack" with the law "power".

    `section` is the name of the table, `kind` its law or shape.
    """
    if section == "waveform":
        from printhammer.drive.waveforms.shapes import SHAPES

        return SHAPES[kind]
    part = PARTS[section, kind]
    check_functions(part)
    return part


def kinds_of(section: str) -> tuple[str, ...]:
    """List the laws or shapes that a table of a hammer file may select."""
    if section == "waveform":
        from printhammer.drive.waveforms.shapes import SHAPES

        return tuple(SHAPES)
    load_installed()
    return laws(section)


def file_options(model: type[BaseModel]) -> dict[str, Any]:
    """Return the options of a part or waveform class that a hammer file may set, with their types.

    These are all options but `quantity`, which follows from the unit of the amplitude.
    """
    return {name: kind for name, kind in options(model).items() if name != "quantity"}


def physics_of(model: Any) -> dict[str, Any]:
    """Return the fields of a part or waveform that enter the fingerprint of a hammer; empty for None."""
    if model is None:
        return {}
    kind: type[BaseModel] = type(model)
    content: dict[str, Any] = {}
    for name in (*quantities(kind), *(set(file_options(kind)) - {"file"}), "quantity"):
        value = getattr(model, name, None)
        entry = kind.model_fields.get(name)
        if value is not None and (entry is None or value != entry.default):
            content[name] = value.hex() if isinstance(value, float) else value
    for name, numbers in model.content().items():
        content[name] = _hex(numbers)
    return content


def _hex(numbers: Any) -> Any:
    nested = getattr(numbers, "tolist", lambda: numbers)()
    return [_hex(entry) for entry in nested] if isinstance(nested, (list, tuple)) else float(nested).hex()


def _build(
    document: Mapping[str, Any], folder: Path, before: Mapping[str, Any], known: Contents | None
) -> Contents:
    known_keys = ("format", *TEXTS, "views", *quantities(Body), *SELECTORS, *TERMS, UNCERTAINTY)
    _check_keys(document, known_keys, "")
    if "format" not in document:
        raise InputError("format is missing", key="format", expected=f"format = {FORMAT}")
    version = document["format"]
    if not isinstance(version, int) or isinstance(version, bool) or version != FORMAT:
        raise InputError.of("format", version, FORMAT, written=shown(version))
    texts: dict[str, str] = {}
    for name in TEXTS:
        texts[name] = document.get(name, "")
        if not isinstance(texts[name], str):
            raise InputError.of(name, texts[name], "text in quotes", written=shown(texts[name]))
    if not texts["name"].strip():
        raise InputError("name is missing", key="name", expected="a short name of the hammer")
    for name, (pattern, expected) in _EXPECTED.items():
        if texts[name] and not pattern.fullmatch(texts[name]):
            raise InputError.of(name, texts[name], expected, written=shown(texts[name]))
    constants: dict[str, Constant] = {}
    top = {key: document[key] for key in quantities(Body) if key in document}
    body = _read(Body, top, "", constants, folder, before, known)
    made: dict[str, Any] = {}
    for section, selector in SELECTORS.items():
        if section in document:
            table = document[section]
            if not isinstance(table, Mapping):
                raise InputError.of(section, table, f"a table [{section}]", written=shown(table))
            keys = [f"{section}.{name}" for name in table if name != selector]
            # An option may name a file that has changed since, so that it is read again.
            same = known is not None and table is before.get(section) and known.constants.keys() >= set(keys)
            if (
                same
                and known is not None
                and not isinstance(known.parts.get(section), (ForceSum, DryFriction))
            ):
                made[section] = known.parts.get(section, known.waveform)
                constants |= {key: known.constants[key] for key in keys}
                continue
            kind = _kind(table, section, selector)
            rest = {key: value for key, value in table.items() if key != selector}
            model = model_of(section, kind)
            made[section] = _read(
                model, rest, f"{section}.", constants, folder, before.get(section, {}), known
            )
    terms = {
        f"{section}.{entry['name']}": _term(section, entry, constants, folder)
        for section in TERMS
        for entry in entries_of(document, section)
    }
    frictions = [term for term in terms.values() if isinstance(term, Friction)]
    if frictions:
        made["damping"] = with_friction(made.get("damping"), frictions)
        _check_friction(made.get("backstop"))
    if len(terms) > len(frictions):
        added = {key: term for key, term in terms.items() if not isinstance(term, Friction)}
        made["spring"] = sum_of(made.get("spring"), added, body.mass)
    contents = Contents(
        **texts,
        views=_views(document),
        body=body,
        waveform=made.pop("waveform", None),
        parts=made,
        terms=terms,
        constants=constants,
        uncertainty=read_uncertainty(document[UNCERTAINTY], constants) if UNCERTAINTY in document else None,
    )
    _check_order(contents)
    return contents


def _check_friction(backstop: BackstopPart | None) -> None:
    """Raise InputError for an elastic backstop, which cannot be combined with dry friction."""
    if backstop is not None and not backstop.rigid:
        expected = "rigid beside dry friction, or a [[contact]] with side = 'back' in its place"
        raise InputError.of("backstop.law", backstop.law, expected)


def _views(document: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the views that the file lists; an empty tuple if the entry is missing."""
    if "views" not in document:
        return ()
    views = document["views"]
    known = isinstance(views, list) and bool(views) and all(view in VIEWS for view in views)
    if not known or len(set(views)) < len(views):
        expected = f"a list of different views among {', '.join(VIEWS)}"
        raise InputError.of("views", views, expected, written=shown(views))
    return tuple(views)


def _kind(table: Mapping[str, Any], section: str, selector: str) -> str:
    known = kinds_of(section)
    kind = table.get(selector, UNSAID.get(section))
    if kind is None:
        raise InputError(
            f"{section}.{selector} is missing",
            key=f"{section}.{selector}",
            expected=f"one of {', '.join(known)}",
        )
    if not isinstance(kind, str) or kind not in known:
        raise InputError.of(
            f"{section}.{selector}",
            kind,
            f"one of {', '.join(known)}",
            written=shown(kind),
        )
    return kind


def entries_of(document: Mapping[str, Any], section: str) -> list[Mapping[str, Any]]:
    """Return the entries of ``[[force]]`` or ``[[contact]]``; check that their names are valid and unique."""
    entries = document.get(section, [])
    if not isinstance(entries, list) or not all(isinstance(entry, Mapping) for entry in entries):
        raise InputError.of(section, entries, f"tables [[{section}]]", written=shown(entries))
    names: list[Any] = ["backstop", "pack"] if section == "contact" else []
    for number, entry in enumerate(entries, 1):
        name = entry.get("name")
        key = f"{section}[{number}].name"
        if name is None:
            raise InputError(f"{key} is missing", key=key, expected="a short name, such as 'weight'")
        if not isinstance(name, str) or not _LABEL.fullmatch(name) or name in names:
            expected = "a name of its own in lower case, such as 'weight' or 'contact-spring'"
            raise InputError.of(key, name, expected, written=shown(name))
        names.append(name)
    return entries


def _term(section: str, entry: Mapping[str, Any], constants: dict[str, Constant], folder: Path) -> Term:
    """Parse an entry of ``[[force]]`` or ``[[contact]]``; add the constants of the entry to `constants`."""
    key, known = f"{section}.{entry['name']}", TERMS[section]
    law = entry.get("law")
    expected = f"one of {', '.join(known)}"
    if law is None:
        raise InputError(f"{key}.law is missing", key=f"{key}.law", expected=expected)
    if not isinstance(law, str) or law not in known:
        roles = [role for role in ("backstop", "pack") if section == "contact" and (role, law) in PARTS]
        if roles:
            expected += f"; a contact with this law is the table {' or '.join(f'[{role}]' for role in roles)}"
        raise InputError.of(f"{key}.law", law, expected, written=shown(law))
    rest = {name: value for name, value in entry.items() if name not in ("name", "law")}
    return _read(known[law], rest, f"{key}.", constants, folder, {}, None)


def _check_keys(table: Mapping[str, Any], known: Iterable[str], prefix: str) -> None:
    """Raise InputError for an unknown key of a table; the message suggests the closest known key."""
    known = list(known)
    for key in table:
        if key not in known:
            raise InputError(
                f"the key {shown(prefix + key, quotes=False)} is not known",
                key=prefix + key,
                expected=f"{nearest(key, known)}",
            )


def _read(
    model: type[_M],
    table: Mapping[str, Any],
    prefix: str,
    constants: dict[str, Constant],
    folder: Path,
    before: Mapping[str, Any],
    read: Contents | None,
) -> _M:
    """Parse the constants and options of one table into its model; add the constants to `constants`.

    `before` is the same table of an earlier document, and `read` the contents parsed from that document: a
    constant that is the identical object in both tables is copied from `read`.
    """
    known, choices = quantities(model), file_options(model)
    _check_keys(table, (*known, *choices), prefix)
    fields: dict[str, Any] = {}
    written: dict[str, str] = {}
    for name, value in table.items():
        if name in known:
            if read is not None and before.get(name) is value:
                constant = read.constants[prefix + name]
            else:
                constant = _constant(prefix + name, value, known[name])
            constants[constant.key] = constant
            fields[name] = constant.si
            written[name] = f"{constant.value!r} {constant.unit}"
            if known[name].also:
                from printhammer.drive.waveforms.shapes import QUANTITY_UNITS

                fields["quantity"] = QUANTITY_UNITS[constant.si_unit]
        else:
            fields[name] = value
    try:
        return model.model_validate(fields, strict=True, context={"folder": folder})
    except ValidationError as error:
        raise invalid(error, model, prefix, written) from None


def _constant(key: str, written: Any, note: Quantity) -> Constant:
    from printhammer.units import describe, to_si

    if not isinstance(written, Mapping):
        raise InputError.of(
            key,
            written,
            f'{describe(note.si)} as {{ value = ..., unit = "...", status = "...", source = "..." }}',
            written=shown(written),
        )
    _check_keys(written, CONSTANT_KEYS, f"{key}.")
    value = written.get("value")
    for name in CONSTANT_KEYS:
        if name not in written:
            what = f"the constant {key} = {shown(value)}" if name != "value" else f"the constant {key}"
            raise InputError(
                f"{what} has no {name}", key=what, expected=f"{describe(note.si)} with {_WANTED[name]}"
            )
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < math.inf:
        raise InputError.of(key, value, "a finite number", written=shown(value))
    texts = {name: written[name] for name in CONSTANT_KEYS[1:]}
    for name, text in texts.items():
        if not isinstance(text, str) or not text.strip():
            raise InputError.of(f"{key}.{name}", text, _WANTED[name], written=shown(text))
    if texts["status"] not in STATUSES:
        raise InputError.of(
            f"{key}.status",
            texts["status"],
            f"one of {', '.join(STATUSES)}",
            written=shown(texts["status"]),
        )
    si_unit = si_unit_of(note, texts["unit"])
    with located(f"{key} = {value!r} {shown(texts['unit'], quotes=False)}", key=key):
        si = to_si(value, texts["unit"], si_unit)
    return Constant(
        key=key, value=value, **texts, si=si, meaning=note.meaning, symbol=note.symbol, si_unit=si_unit
    )


_WANTED: Final = {
    "value": "a number",
    "unit": "a unit",
    "status": f"a status ({', '.join(STATUSES)})",
    "source": "a source",
}


def si_unit_of(note: Quantity, unit: str) -> str:
    """Return the SI unit that matches `unit`, for a constant that may have one of several dimensions."""
    from printhammer.units import to_si

    for other in note.also:
        with suppress(InputError):
            to_si(1.0, unit, other)
            return other
    return note.si


def _check_order(contents: Contents) -> None:
    """Check that backstop, pack front and platen are in order, and inside the range of the magnet's law."""
    places: dict[str, float] = {}
    backstop, pack = contents.parts.get("backstop"), contents.parts.get("pack")
    if isinstance(backstop, BackstopPart):
        places["backstop.position"] = backstop.position
    if isinstance(pack, PackPart):
        places["pack.front"] = pack.front
    ends = {} if contents.body.platen is None else {"platen": contents.body.platen}

    def written(key: str) -> str:
        constant = contents.constants[key]
        return f"{key} = {constant.value!r} {constant.unit}"

    for (key, place), (after, end) in pairwise([*places.items(), *ends.items()]):
        if not place < end:
            raise InputError(f"{written(key)}: expected a position before {written(after)}", key=written(key))
    for key, constant in contents.constants.items():
        before = places.get("backstop.position", -math.inf)
        if key.startswith("contact.") and key.endswith(".position") and constant.si < before:
            expected = f"a position not before {written('backstop.position')}"
            raise InputError.of(key, constant.value, expected, unit=constant.unit)
    for role in ("magnet", "spring"):
        part = contents.parts.get(role)
        if not isinstance(part, (MagnetPart, SpringPart)):
            continue
        low, high = part.domain
        for key, place in places.items():
            if not (low <= place <= high and _has_force(part, place)):
                span = f"{low:g} to {high:g} m"
                raise InputError(
                    f"{written(key)}: expected a position where the {role}'s law holds, {span}",
                    key=written(key),
                )


def _has_force(part: MagnetPart | SpringPart, place: float) -> bool:
    """Whether a magnet or spring has a finite force at a displacement [m]; always True for a spring."""
    if isinstance(part, SpringPart):
        return True
    return math.isfinite(import_module(part.module).magnet_force(part.packed(0.0), place, 0.0))
