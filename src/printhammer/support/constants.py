"""Physical constants of parts and waveforms: declarations of unit, symbol, meaning and bounds.

Parts (`printhammer.parts`) and waveforms are frozen pydantic models whose physical constants are plain SI
floats. `quantity` declares such a field, and `quantities` lists the declarations of a model. The file reader,
the JSON schema, the tables of `printhammer hammer show` and the documentation all derive from these
declarations.

A model that reads a further file (a measured table, a sampled waveform) resolves the name of that file
against `info.context["folder"]` of its validators: the folder of the hammer or drive file, a `pathlib.Path`;
without a context, the working directory.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, cast, get_args

from pydantic import BaseModel, Field, ValidationError, ValidationInfo
from pydantic_core import PydanticUndefined

from printhammer.errors import InputError

Status = Literal["stated", "datasheet", "derived", "reconstructed", "assumed"]
STATUSES: tuple[str, ...] = get_args(Status)

_KEY = "quantity"


@dataclass(frozen=True)
class Quantity:
    """Declaration of a physical constant, stored as metadata of a model field."""

    si: str
    """SI unit of the stored value, in the notation of `printhammer.units`; "1" for a pure number."""
    symbol: str
    """Symbol of the constant in the paper or in textbooks, as plain text."""
    meaning: str
    """Description of the constant in one phrase, for tables and help texts."""
    also: tuple[str, ...] = ()
    """SI units of other dimensions that a file may use instead (for the amplitude of a waveform: A or N)."""
    gt: float | None = None
    """Exclusive lower bound of the SI value."""
    ge: float | None = None
    """Lower bound of the SI value."""
    lt: float | None = None
    """Exclusive upper bound of the SI value."""
    le: float | None = None
    """Upper bound of the SI value."""
    required: bool = True
    """Whether the constant is required in a file."""


@dataclass(frozen=True)
class Constant:
    """Constant of a hammer: value and unit as written in the file, and the SI value."""

    key: str
    """Dotted key, such as "magnet.F0"."""
    value: float
    """Number as written in the file, in `unit`."""
    unit: str
    """Unit as written in the file."""
    si: float
    """Value in SI, in the unit `si_unit`."""
    status: str
    """Status of the constant, one of `STATUSES`, such as "stated" or "assumed"."""
    source: str
    """Origin of the value, such as a figure, a measurement or a textbook."""
    meaning: str
    """Description of the constant, from the `Quantity` of the field."""
    symbol: str
    """Symbol of the constant, from the `Quantity` of the field."""
    si_unit: str
    """SI unit of the value `si`."""


def quantity(
    si: str,
    symbol: str,
    meaning: str,
    *,
    also: tuple[str, ...] = (),
    gt: float | None = None,
    ge: float | None = None,
    lt: float | None = None,
    le: float | None = None,
    default: Any = PydanticUndefined,
) -> Any:
    """Declare a pydantic field that holds a physical constant in SI; arguments as for `Quantity`.

    The result is the default of a `float` (or `float | None`) annotation. NaN and infinity are always
    rejected; a `default` makes the constant optional.
    """
    note = Quantity(si, symbol, meaning, also, gt, ge, lt, le, default is PydanticUndefined)
    limits: dict[str, Any] = {"gt": gt, "ge": ge, "lt": lt, "le": le, "allow_inf_nan": False}
    return Field(default, description=meaning, json_schema_extra={_KEY: asdict(note)}, **limits)


@cache
@cache
def quantities(model: type[BaseModel]) -> Mapping[str, Quantity]:
    """List the physical constants of a model class: `Quantity` by field name, in order of declaration."""
    notes: dict[str, Quantity] = {}
    for name, field in model.model_fields.items():
        extra = field.json_schema_extra
        note = extra.get(_KEY) if isinstance(extra, dict) else None
        if isinstance(note, dict):
            notes[name] = Quantity(**cast("dict[str, Any]", note))
    return notes


@cache
def options(model: type[BaseModel]) -> Mapping[str, Any]:
    """List the fields that are not physical constants (choices, flags, file names): annotation by name."""
    known = quantities(model)
    return {name: field.annotation for name, field in model.model_fields.items() if name not in known}


def folder_of(info: ValidationInfo) -> Path:
    """Return the folder for resolving the name of a file that a model refers to."""
    context = info.context
    folder = context.get("folder") if isinstance(context, dict) else None
    return Path(folder) if folder is not None else Path()


def expected(note: Quantity) -> str:
    """Describe the bounds of a constant for an error message, such as "more than 0 m"."""
    pure = note.si == "1"
    unit = "" if pure else f" {note.si}"
    bounds = (
        ("more than ", note.gt, ""),
        ("", note.ge, " or more"),
        ("less than ", note.lt, ""),
        ("", note.le, " or less"),
    )
    said = [f"{before}{bound:g}{unit}{after}" for before, bound, after in bounds if bound is not None]
    return " and ".join(said) or ("a finite number" if pure else f"a finite number in {note.si}")


def shown(value: object, *, quotes: bool = True) -> str:
    """Format a value for an error message, on one line of at most 80 characters, by default in quotes."""
    text = value if isinstance(value, str) and not quotes and value.isprintable() else repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def invalid(
    error: ValidationError, model: type[BaseModel], prefix: str = "", written: Mapping[str, str] | None = None
) -> InputError:
    """Convert the first error of a pydantic validation to an `InputError`.

    Parameters
    ----------
    error : ValidationError
        Error from the validation of `model`.
    model : type of BaseModel
        The model class.
    prefix : str
        Prefix of the field's name in the key, such as "magnet.".
    written : mapping, optional
        Text of values as the user wrote them, by field name.

    Returns
    -------
    InputError
        Error with key, value and expectation; an InputError raised by a validator is returned unchanged.
    """
    fault = error.errors(include_url=False)[0]
    cause = fault.get("ctx", {}).get("error")
    name = ".".join(str(step) for step in fault["loc"])
    file, _, section = prefix.rpartition(": ")
    if isinstance(cause, InputError):
        if cause.file is None and cause.key is None:
            cause.key = section + name or None
        return cause
    if not name:
        place, said = prefix.rstrip("."), fault["msg"].removeprefix("Value error, ")
        return InputError(
            f"{place}: {said}".removeprefix(": "), file=file or None, key=section.rstrip(".") or None
        )
    key, kind, note = section + name, fault["type"], quantities(model).get(name)
    wanted = expected(note) if note else fault["msg"].removeprefix("Input should be ")
    if kind == "bool_type":
        wanted = "true or false"
    if kind == "missing":
        ending = f": expected {note.meaning} ({note.si})" if note else ""
        return InputError(f"{prefix}{name} is missing{ending}", file=file or None, key=key)
    value = fault["input"]
    text = (written or {}).get(name) or shown(value)
    if kind == "extra_forbidden":
        message = f"{prefix}{name} = {text} is not known: expected one of {', '.join(model.model_fields)}"
        return InputError(message, file=file or None, key=key, value=value)
    return InputError.of(key, value, wanted, file=file or None, written=text)
