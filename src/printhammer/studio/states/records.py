"""Measured curves as oscilloscopes and spreadsheets write them: time, and what is declared in `QUANTITIES`.

Columns are parted by tabs, semicolons or commas, numbers may have a decimal comma, lines above the heading
are passed over, and units stand in the heading, as "time [us]" or "time (us)", or in a row below it. What a
column holds is never guessed from its numbers: where heading and unit do not say it, it is asked for.
"""

from __future__ import annotations

import re
from typing import Any, Final, NamedTuple

import numpy as np

from printhammer.errors import InputError, located
from printhammer.studio.bounds import LARGEST_CURRENT, LARGEST_VOLTAGE, LONGEST_TIME, MOST_SAMPLES
from printhammer.support.sheets import sheet_of, split_heading
from printhammer.units import parse, to_si

QUANTITIES: Final = {"time": "s", "displacement": "m", "current": "A", "force": "N", "voltage": "V"}
"""What a column may hold, with its SI unit."""

EXPECTED: Final = "'time [us],displacement [um]', 'time [us],current [A]' or 'time [us],force [N]'"

MOST_COLUMNS: Final = 16
"""Columns of a table."""

_NAMES: Final = {
    "time": ("time", "t", "x-axis", "sec", "second", "seconds", "zeit", "temps"),
    "displacement": ("displacement", "position", "x", "weg"),
    "current": ("current", "i", "strom"),
    "force": ("force", "f", "kraft"),
    "voltage": ("voltage", "u", "spannung", "tension"),
}
_NUMBER: Final = re.compile(r"\s*[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?\s*")
_WHOLE: Final = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*")


class Column(NamedTuple):
    """A column of a table: what its heading says, and what it holds as far as that is known."""

    name: str
    unit: str
    quantity: str
    first: list[str]


class Record(NamedTuple):
    """Curves over one time, SI, beginning at time 0, thinned evenly to at most `MOST_SAMPLES`."""

    times: np.ndarray[Any, Any]
    curves: dict[str, np.ndarray[Any, Any]]


def read_record(text: str, where: str, told: list[tuple[str, str]] | None = None) -> Record | list[Column]:
    """Read a table.

    Parameters
    ----------
    text : str
        The table.
    where : str
        What messages call it.
    told : list of tuple, optional
        What each column holds, see `QUANTITIES`, or nothing, and its unit; by default as its heading says.

    Returns
    -------
    Record or list of Column
        The curves, or the columns where it has to be asked what they hold.

    Raises
    ------
    InputError
        It is no such table.
    """
    columns, rows, line = _table(text, where)
    if told is not None:
        if len(told) != len(columns):
            raise InputError(
                f"{where}: {len(columns)} columns",
                file=where,
                key="columns",
                expected=f"as many answers, not {len(told)}",
            )
        columns = [
            column._replace(quantity=what, unit=unit)
            for column, (what, unit) in zip(columns, told, strict=True)
        ]
    known = [column.quantity for column in columns]
    unclear = any(column.quantity and not column.unit for column in columns)
    if told is None and (unclear or "time" not in known or len(set(known) - {"time", ""}) == 0):
        return columns
    for quantity in QUANTITIES:
        if known.count(quantity) > 1:
            raise InputError(
                f"{where}: {known.count(quantity)} columns of {quantity}",
                file=where,
                key=quantity,
                expected="one",
            )
    if "time" not in known or not set(known) - {"time", ""}:
        raise InputError(
            f"{where}: expected a column of time and one of displacement, current, force or voltage",
            file=where,
            key="time",
        )
    curves = {}
    for place, column in enumerate(columns):
        if column.quantity:
            values = np.array([_number(row[place], f"{where}: row {line + k}") for k, row in enumerate(rows)])
            with located(f"{where}: {column.name or column.quantity}", file=where, key=column.name):
                curves[column.quantity] = values * _factor(column.unit, QUANTITIES[column.quantity])
    times = curves.pop("time")
    if len(times) < 2 or (np.diff(times) <= 0.0).any():
        raise InputError(f"{where}: expected at least 2 samples at increasing times", file=where, key="time")
    keep = np.unique(np.linspace(0, len(times) - 1, min(len(times), MOST_SAMPLES)).astype(int))
    # Oscilloscopes count time from their trigger.
    record = Record(times[keep] - min(times[0], 0.0), {name: values[keep] for name, values in curves.items()})
    return _checked(record, where)


def _checked(record: Record, where: str) -> Record:
    """Return a record whose drive, where it has one, can be fired."""
    for name in {"current", "force", "voltage"} & set(record.curves):
        last, peak = float(record.times[-1]), float(np.abs(record.curves[name]).max())
        if last > LONGEST_TIME:
            raise InputError(
                f"{where}: a {name} of {last:g} s",
                file=where,
                key=name,
                expected=f"at most {LONGEST_TIME:g} s",
            )
        most = LARGEST_VOLTAGE if name == "voltage" else LARGEST_CURRENT
        if peak > most:
            unit = QUANTITIES[name]
            raise InputError(
                f"{where}: a {name} of {peak:g} {unit}",
                file=where,
                key=name,
                expected=f"at most {most:g} {unit}",
            )
    return record


def _table(text: str, where: str) -> tuple[list[Column], list[list[str]], int]:
    """Return the columns of a table, its rows of numbers, and the number of the first of these."""
    if not text.strip():
        raise InputError(
            f"{where}: the file is empty", file=where, key="heading", expected=f"the heading {EXPECTED}"
        )
    delimiter = _delimiter(text)
    rows = [_bare(cells) for _line, cells in sheet_of(text, where, delimiter=delimiter).rows]
    begin = next(
        (k for k, row in enumerate(rows) if len(row) > 1 and all(map(_NUMBER.fullmatch, row[:2]))), None
    )
    if begin is None:
        raise InputError(
            f"{where}: expected columns of numbers below a heading such as {EXPECTED}",
            file=where,
            key="heading",
        )
    width = len(rows[begin])
    if width > MOST_COLUMNS:
        raise InputError(
            f"{where}: {width} columns", file=where, key="columns", expected=f"at most {MOST_COLUMNS}"
        )
    numbers = rows[begin:]
    for k, row in enumerate(numbers):
        if len(row) != width:
            raise InputError(
                f"{where}: row {begin + k + 1} has {len(row)} cells",
                file=where,
                key=f"row {begin + k + 1}",
                expected=f"{width} numbers",
            )
    if delimiter != "," and any(_WHOLE.fullmatch(cell) for row in numbers[:50] for cell in row):
        numbers = [[cell.replace(",", ".") for cell in row] for row in numbers]
    above = [row for row in rows[:begin] if len(row) == width][-2:]
    units = [""] * width
    if len(above) == 2 and all(not cell.strip() or _measures(cell) for cell in above[1]):
        units = [cell.strip() for cell in above.pop()]
    names = above[-1] if above else [""] * width
    columns = []
    for place, (name, unit) in enumerate(zip(names, units, strict=True)):
        bare, own = _heading(name)
        columns.append(Column(bare, own or unit, _quantity(bare), [row[place] for row in numbers[:3]]))
    return columns, numbers, begin + 1


def _bare(cells: list[str]) -> list[str]:
    """Return cells without empty ones at the end."""
    while cells and not cells[-1].strip():
        cells = cells[:-1]
    return cells


def _delimiter(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    counts = {sign: sum(sign in line for line in lines) for sign in "\t;"}
    return next((sign for sign, count in counts.items() if 2 * count > len(lines)), ",")


def _heading(cell: str) -> tuple[str, str]:
    name, unit = split_heading(cell)
    if not unit and cell.strip().endswith(")"):
        name, unit = split_heading(cell.replace("(", "[").replace(")", "]"))
    return name, unit


def _quantity(name: str) -> str:
    return next((what for what, names in _NAMES.items() if name.lower() in names), "")


def _measures(cell: str) -> bool:
    """Whether a cell is a unit of something that a column may hold."""
    for si in QUANTITIES.values():
        try:
            to_si(1.0, cell.strip(), si)
        except InputError:
            continue
        return True
    return cell.strip().lower() in ("volt", "volts")


def _factor(unit: str, si: str) -> float:
    """Return what 1 is in SI; a unit may also be what 1 stands for, such as "10 A"."""
    return parse(unit, si) if _NUMBER.match(unit) and unit.strip() != "1" else to_si(1.0, unit, si)


def _number(cell: str, where: str) -> float:
    if not _NUMBER.fullmatch(cell) or "," in cell:
        raise InputError(f"{where} is expected to hold finite numbers, not {cell.strip()[:40]!r}", key=where)
    return float(cell)
