"""Axes of a sweep: varying parameter with unit, meaning and values; parsing of axis tables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from types import MappingProxyType
from typing import Final, Literal

import numpy as np

from printhammer.errors import InputError, nearest
from printhammer.hammer.file import kinds_of, model_of
from printhammer.hammer.hammer import Hammer
from printhammer.hammer.names import FORCE, PERIOD, RATE, TIMING, in_unit_of_drive, quantity_of
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray
from printhammer.support.constants import Quantity, expected, quantities, shown
from printhammer.sweep.tables import AxisTable, read_quantities, read_quantity

Target = Literal["hammer", "waveform", "drive", "at", "state"]

DRIVE: Final[dict[str, Quantity]] = {
    RATE: TIMING[RATE],
    PERIOD: TIMING[PERIOD],
    "start": Quantity("s", "t0", "time of the first firing", ge=0.0),
    "gap": Quantity("s", "tg", "time between bursts", gt=0.0),
    "pulses": Quantity("1", "n", "number of pulses", ge=1.0),
    "bursts": Quantity("1", "nb", "number of bursts", ge=1.0),
    **FORCE,
}
"""Quantities of a drive that an axis may vary, in addition to firing times."""

COUNTS: Final = ("pulses", "bursts")

_STATE: Final = {
    "x": Quantity("m", "x", "initial displacement"),
    "v": Quantity("m/s", "v", "initial velocity"),
}
_FIRING: Final = Quantity("s", "t", "time of a firing", ge=0.0)


class Axis(Declared, eq=False):
    """One axis of a sweep: a parameter and its values."""

    key: str = part("key as written in the spec")
    name: str = part("name of the axis's dimension or coordinate in the store")
    target: Target = part(
        "object that the axis changes: hammer, waveform, timing of the drive, a firing time, or initial state"
    )
    field: str = part("target of the change: the key, the name of a number, or the index of a firing")
    note: Quantity = part("unit, meaning and bounds")
    values: FloatArray = part("values of a grid, or the two ends of a range; SI")
    geometric: bool = part("whether a range is divided geometrically", default=False)

    @property
    def counts(self) -> bool:
        """Whether the values of the axis are counts, i.e. integers."""
        return self.target == "drive" and self.field in COUNTS


def read_axis(
    table: AxisTable,
    where: str,
    hammer: Hammer,
    own_waveform: Mapping[str, object] | None,
    grid: bool,
    named: Mapping[str, object] = MappingProxyType({}),
) -> Axis:
    """Parse one `[[axis]]` table of a sweep spec.

    `where` names the table in error messages. `own_waveform` is the waveform table of the drive, if any;
    `named` are the waveforms of a sequence, by name. `grid` states whether the sweep is a grid: an axis of a
    grid has values or a range, an axis of a Latin hypercube only a range.

    Raises
    ------
    InputError
        The key is unknown, a value is invalid or out of bounds, or a range is empty.
    """
    target, field, note = _resolved(table.key, where, hammer, own_waveform, named)
    here = f"{where} ({table.key})"
    geometric = table.spacing == "geometric"
    values = _values(table, here, note.si, grid, geometric)
    for value in values:
        if not _is_inside(value, note):
            raise InputError(
                f"{here}: {value!r} {note.si} is out of bounds", key=here, expected=f"{expected(note)}"
            )
    if target == "drive" and field in COUNTS:
        if not grid:
            raise InputError(f"{here}: a count cannot be drawn", key=here, expected="an axis of a grid")
        if not all(value.is_integer() for value in values):
            raise InputError(f"{here}: expected whole numbers", key=here)
    name = table.key.removeprefix("drive.").replace(".", "_").replace(" ", "_")
    return Axis(table.key, name, target, field, note, np.array(values), geometric)


def _resolved(
    key: str,
    where: str,
    hammer: Hammer,
    own_waveform: Mapping[str, object] | None,
    named: Mapping[str, object],
) -> tuple[Target, str, Quantity]:
    section, _, name = key.partition(".")
    if section == "state" and name in _STATE:
        return "state", name, _STATE[name]
    if section == "drive":
        if name in DRIVE:
            return "drive", name, DRIVE[name]
        number = name.removeprefix("at.")
        if name.startswith("at.") and number.isascii() and number.isdigit():
            return "at", number, _FIRING
    if section == "waveforms":
        own, _, constant = name.rpartition(".")
        if (note := _constant_of(named.get(own), constant)) is not None:
            return "waveform", name, note
    elif section == "waveform" and own_waveform is not None:
        if (note := _constant_of(own_waveform, name)) is not None:
            return "waveform", name, note
    elif (note := quantity_of(hammer, key)) is not None:
        return "hammer", key, note
    known = [*(f"drive.{name}" for name in DRIVE), "drive.at.0", *(f"state.{name}" for name in _STATE)]
    known += [f"waveforms.{name}.amplitude" for name in named]
    fired = own_waveform is None and not named
    known += [name for name in hammer.constants if fired or not name.startswith("waveform.")]
    hint = nearest(key, known, "one such as 'pack.stiffness', 'drive.rate' or 'state.x'")
    raise InputError(
        f"{where}.key = {shown(key)} does not name a constant of {hammer.name} or its drive",
        key=f"{where}.key",
        value=key,
        expected=hint,
    )


def _constant_of(waveform: object, name: str) -> Quantity | None:
    """Return unit, meaning and bounds of a constant in a waveform table of the drive; None if unknown."""
    shape = waveform.get("shape") if isinstance(waveform, Mapping) else None
    if not isinstance(waveform, Mapping) or not isinstance(shape, str) or shape not in kinds_of("waveform"):
        return None
    note = quantities(model_of("waveform", shape)).get(name)
    if note is None:
        return None
    for unit in note.also:
        # Keep the unit in which the table states the value.
        with suppress(InputError):
            read_quantity(waveform.get(name), unit, "")
            return in_unit_of_drive(note, unit)
    return in_unit_of_drive(note, note.si)


def _values(table: AxisTable, here: str, si: str, grid: bool, geometric: bool) -> list[float]:
    ends = (table.low, table.high)
    if table.values is not None:
        if not grid:
            raise InputError(f"{here}: values of a Latin hypercube", key=here, expected="low and high")
        if any(value is not None for value in (*ends, table.count)) or geometric:
            raise InputError(f"{here}: values", key=here, expected="no range together with values")
        values = read_quantities(table.values, si, f"{here}.values")
        if len(set(values)) < len(values):
            raise InputError(f"{here}.values: expected different values", key=f"{here}.values")
        return values
    for name, value in (("low", table.low), ("high", table.high), ("count", table.count if grid else 1)):
        if value is None:
            raise InputError(
                f"{here}.{name} is missing", key=f"{here}.{name}", expected="values, or low, high and count"
            )
    if not grid and table.count is not None:
        raise InputError(
            f"{here}.count of a Latin hypercube", key=f"{here}.count", expected="members instead"
        )
    low, high = (
        read_quantity(end, si, f"{here}.{name}") for end, name in zip(ends, ("low", "high"), strict=True)
    )
    if low == high or not math.isfinite(high - low):
        raise InputError(
            f"{here}: the range from {low!r} to {high!r} {si} is empty", key=here, expected="two ends"
        )
    if geometric and not (low > 0.0 and high > 0.0):
        raise InputError(f"{here}: a geometric range", key=here, expected=f"ends above 0 {si}")
    if not grid:
        return [low, high]
    count = table.count or 1
    if count < 2:
        raise InputError.of(f"{here}.count", count, "at least 2 values of a range", written=str(count))
    divide = np.geomspace if geometric else np.linspace
    grid_values = [float(value) for value in divide(low, high, count)]
    if len(set(grid_values)) < count:
        raise InputError(
            f"{here}: {low!r} to {high!r}", key=here, expected=f"a range of {count} different values"
        )
    return grid_values


def _is_inside(value: float, note: Quantity) -> bool:
    return (
        (note.gt is None or value > note.gt)
        and (note.ge is None or value >= note.ge)
        and (note.lt is None or value < note.lt)
        and (note.le is None or value <= note.le)
    )
