"""The tables of a spec as they are written, before units and keys are looked at."""

from __future__ import annotations

from typing import Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from printhammer.errors import InputError
from printhammer.run.problem import LARGEST_TOLERANCE, LEAST_TOLERANCE, TOLERANCE
from printhammer.support.constants import shown
from printhammer.sweep.quantities import ManyQuantities, OneQuantity

Design = Literal["grid", "latin-hypercube"]
Spacing = Literal["linear", "geometric"]


class _Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class AxisTable(_Table):
    """One axis: a key with values, or with a range."""

    key: str = Field(description="what it changes, such as 'pack.stiffness', 'drive.rate' or 'state.x'")
    values: ManyQuantities = Field(None, description="the values themselves")
    low: OneQuantity = Field(None, description="one end of a range")
    high: OneQuantity = Field(None, description="the other end")
    count: int | None = Field(None, ge=1, description="number of values of a range, in a grid")
    spacing: Spacing = Field("linear", description="how a range is divided")


class StateTable(_Table):
    """The initial state; by default the rest state."""

    x: OneQuantity = Field(None, description="displacement; by default that at rest")
    v: OneQuantity = Field(None, description="velocity; by default 0")


class TimesTable(_Table):
    """Times at which the displacement is kept."""

    start: OneQuantity = Field("0 s", description="first time")
    end: OneQuantity = Field(description="last time")
    count: int = Field(ge=1, description="number of times")


class OutputsTable(_Table):
    """What is kept of a run."""

    dots: list[str] | Literal["all"] = Field([], description="what each firing did")
    strobes: list[str] | Literal["all"] = Field([], description="state at each firing")
    final: bool = Field(False, description="state at the end of the run")
    displacement: TimesTable | None = Field(None, description="displacement at common times")
    scalars: list[str] | Literal["all"] = Field([], description="numbers for the whole run")


class SpecTable(_Table):
    """A sweep."""

    format: Literal[1] = Field(description="version of the spec format")
    title: str = Field("", description="one line that says what it is")
    hammer: str = Field(description="name of a shipped hammer, or path of a hammer file")
    design: Design = Field("grid", description="how the axes are combined")
    members: int | None = Field(None, ge=1, description="number of members of a Latin hypercube")
    seed: int | None = Field(None, ge=0, description="seed of a Latin hypercube")
    tolerance: float = Field(
        TOLERANCE,
        ge=LEAST_TOLERANCE,
        le=LARGEST_TOLERANCE,
        allow_inf_nan=False,
        description="error in one step",
    )
    duration: OneQuantity = Field(None, description="end of each run; by default 4 ms after its last firing")
    chunk: int | None = Field(None, ge=1, description="members of a block of work")
    drive: dict[str, Any] | str = Field(description="the tables of a drive file, or its path")
    state: StateTable = Field(StateTable(), description="initial state")
    constants: dict[str, OneQuantity] = Field({}, description="constants replaced in all members, by key")
    axis: list[AxisTable] = Field(min_length=1, description="the axes")
    outputs: OutputsTable = Field(description="what is kept")


def read_tables(document: dict[str, Any]) -> SpecTable:
    """Check the tables of a spec.

    Raises
    ------
    InputError
        A key is unknown or missing, or a value is of the wrong kind.
    """
    try:
        return SpecTable.model_validate(document)
    except ValidationError as error:
        raise InputError(_sentence(error)) from None


def schema() -> dict[str, Any]:
    """Return the JSON schema (draft 2020-12) of specs."""
    content = SpecTable.model_json_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **content,
        "title": "printhammer sweep",
    }


def _sentence(error: ValidationError) -> str:
    """Tell the first fault: key, value and what was expected."""
    fault = error.errors(include_url=False)[0]
    key, table = _place(fault["loc"])
    if fault["type"] == "missing":
        field = table.model_fields.get(str(fault["loc"][-1]))
        return f"{key} is missing, expected {(field.description if field else None) or 'a value'}"
    if fault["type"] == "extra_forbidden":
        known = ", ".join(table.model_fields)
        return f"the key {shown(key, quotes=False)} is not known, expected one of {known}"
    wanted = fault["msg"].removeprefix("Input should be ")
    wanted = {"bool_type": "true or false", "string_type": "text in quotes"}.get(fault["type"], wanted)
    return f"{key} = {shown(fault['input'])}: expected {wanted}"


def _place(steps: tuple[int | str, ...]) -> tuple[str, type[BaseModel]]:
    """Return the key at which a fault lies, such as "axis[1].count", and the table that it belongs to."""
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
            # Which of several types a value was tried for is no part of the key.
            break
        else:
            key += f".{step}" if key else step
            if place < len(steps) - 1:
                owner = inner.get(step, owner)
    return key, owner


_CHOICES: Final = ("str", "dict[str,any]", "list[str]", "literal['all']", "int", "float")
