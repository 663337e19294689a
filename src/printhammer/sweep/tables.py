"""Schema of a sweep spec: its tables as written, before units and keys are interpreted.

Quantities in a spec always carry their unit, as text or as a table.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, WithJsonSchema

from printhammer.errors import InputError, located
from printhammer.run.problem import LARGEST_TOLERANCE, LEAST_TOLERANCE, TOLERANCE
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
"""Annotation of a spec field that holds one quantity, with its JSON schema."""

ManyQuantities = Annotated[Any, WithJsonSchema(_MANY)]
"""Annotation of a spec field that holds several quantities, with its JSON schema."""


def read_quantity(written: Any, si: str, where: str) -> float:
    """Parse a quantity into SI: "1.2 kHz", { value = 1.2, unit = "kHz" }, or a dimensionless number.

    `si` is the SI unit of the quantity; `where` is its key in the spec, for error messages.
    """
    with located(where, key=where):
        if isinstance(written, str):
            return parse(written, si)
        if isinstance(written, Mapping):
            value, unit = _columns(written, ("value", "unit"))
            return to_si(value, unit, si)
        if si == "1":
            return to_si(written, "1", "1")
    raise InputError(
        f"{where} = {shown(written)} has no unit",
        key=where,
        value=written,
        expected=f"{describe(si)} as text such as '1 {si}'",
    )


def read_quantities(written: Any, si: str, where: str) -> list[float]:
    """Parse several quantities into SI: a list of quantities, or values with a common unit.

    Arguments as for `read_quantity`.
    """
    values: Iterable[Any] = written if isinstance(written, list) else ()
    if isinstance(written, Mapping):
        with located(where, key=where):
            column, unit = _columns(written, ("values", "unit"))
        values = [{"value": value, "unit": unit} for value in column] if isinstance(column, list) else ()
    numbers = [read_quantity(value, si, f"{where}[{i}]") for i, value in enumerate(values)]
    if not numbers:
        raise InputError.of(where, written, "a list of quantities, at least one", written=shown(written))
    return numbers


def _columns(table: Mapping[str, Any], names: tuple[str, str]) -> tuple[Any, str]:
    if set(table) != set(names):
        raise InputError(
            shown(dict(table)), value=dict(table), expected=f"the keys {names[0]} and {names[1]}"
        )
    unit = table[names[1]]
    if not isinstance(unit, str):
        raise InputError(f"the unit {shown(unit)}", expected="text", key="unit", value=unit)
    return table[names[0]], unit


Design = Literal["grid", "latin-hypercube"]
Spacing = Literal["linear", "geometric"]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class AxisTable(_Table):
    """Table `[[axis]]` of a spec: a key with values, or with a range."""

    key: str = Field(description="key to change, such as 'pack.stiffness', 'drive.rate' or 'state.x'")
    values: ManyQuantities = Field(None, description="values of the axis")
    low: OneQuantity = Field(None, description="first end of a range")
    high: OneQuantity = Field(None, description="second end of a range")
    count: int | None = Field(None, ge=1, description="number of values of a range, in a grid")
    spacing: Spacing = Field("linear", description="how a range is divided")


class StateTable(_Table):
    """Table `[state]` of a spec: initial state; by default the rest state."""

    x: OneQuantity = Field(None, description="displacement; by default the rest position")
    v: OneQuantity = Field(None, description="velocity; by default 0")


class TimesTable(_Table):
    """Table of the times at which the displacement is stored."""

    start: OneQuantity = Field("0 s", description="first time")
    end: OneQuantity = Field(description="last time")
    count: int = Field(ge=1, description="number of times")


class OutputsTable(_Table):
    """Table `[outputs]` of a spec: outputs stored for each run."""

    dots: list[str] | Literal["all"] = Field([], description="dot of each firing")
    strobes: list[str] | Literal["all"] = Field([], description="state at each firing")
    final: bool = Field(False, description="state at the end of the run")
    displacement: TimesTable | None = Field(None, description="displacement at common times")
    scalars: list[str] | Literal["all"] = Field([], description="numbers for the whole run")


class SpecTable(_Table):
    """Top-level table of a sweep spec."""

    format: Literal[1] = Field(description="version of the spec format")
    title: str = Field("", description="one-line description")
    hammer: str = Field(description="name of a shipped hammer, or path of a hammer file")
    design: Design = Field("grid", description="design of the sweep: how the axes are combined")
    members: int | None = Field(None, ge=1, description="number of members of a Latin hypercube")
    seed: int | None = Field(None, ge=0, description="seed of a Latin hypercube")
    tolerance: float = Field(
        TOLERANCE,
        ge=LEAST_TOLERANCE,
        le=LARGEST_TOLERANCE,
        allow_inf_nan=False,
        description="error in one step",
    )
    duration: OneQuantity = Field(
        None, description="end of each run; by default 4 ms after its last firing, of a slow device later"
    )
    chunk: int | None = Field(None, ge=1, description="members of a block of work")
    drive: dict[str, Any] | str = Field(description="the tables of a drive file, or its path")
    state: StateTable = Field(StateTable(), description="initial state")
    constants: dict[str, OneQuantity] = Field({}, description="constants replaced in all members, by key")
    axis: list[AxisTable] = Field(min_length=1, description="axes of the sweep")
    outputs: OutputsTable = Field(description="outputs to store")


def read_tables(document: dict[str, Any]) -> SpecTable:
    """Validate the tables of a spec; errors name the key, its value and the expectation."""
    try:
        return SpecTable.model_validate(document)
    except ValidationError as error:
        raise _fault(error) from None


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of specs."""
    content = SpecTable.model_json_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **content,
        "title": "printhammer sweep",
    }


def _fault(error: ValidationError) -> InputError:
    """Convert the first validation error to an `InputError` with key, value and expectation."""
    fault = error.errors(include_url=False)[0]
    key, table = _place(fault["loc"])
    if fault["type"] == "missing":
        field = table.model_fields.get(str(fault["loc"][-1]))
        wanted = (field.description if field else None) or "a value"
        return InputError(f"{key} is missing", key=key, expected=wanted)
    if fault["type"] == "extra_forbidden":
        known = ", ".join(table.model_fields)
        return InputError(
            f"the key {shown(key, quotes=False)} is not known", key=key, expected=f"one of {known}"
        )
    wanted = fault["msg"].removeprefix("Input should be ")
    wanted = {"bool_type": "true or false", "string_type": "text in quotes"}.get(fault["type"], wanted)
    value = fault["input"]
    return InputError.of(key, value, wanted, written=shown(value))


def _place(steps: tuple[int | str, ...]) -> tuple[str, type[BaseModel]]:
    """Return key and table class of a validation error; a key is text such as "axis[1].count"."""
    key, table = "", SpecTable
    inner: dict[str, type[_Table]] = {
        "axis": AxisTable,
        "state": StateTable,
        "outputs": OutputsTable,
        "displacement": TimesTable,
    }
    owner: type[BaseModel] = table
    for place, step in enumerate(steps):
        if isinstance(step, int):
            key += f"[{step}]"
        elif place and step not in owner.model_fields and step in _CHOICES:
            # The type tried for a value of several types is not part of the key.
            break
        else:
            key += f".{step}" if key else step
            if place < len(steps) - 1:
                owner = inner.get(step, owner)
    return key, owner


_CHOICES: Final = ("str", "dict[str,any]", "list[str]", "literal['all']", "int", "float")
