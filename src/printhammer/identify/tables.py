"""Tables of measurements: CSV files whose heading gives every column its unit.

The first line that is no comment is the heading, ``displacement [um],current [A],force [N]``, in any order
and any unit of the dimension; every line after it is one row. Blank lines and lines that begin with # are
passed over; a comment such as ``# sampling rate: 1 MHz`` is kept as a key and its text.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from printhammer.errors import InputError, located
from printhammer.results import Declared, part
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.sheets import read_sheet, split_heading
from printhammer.units import describe, to_si

_NONE: Final[Mapping[str, str]] = MappingProxyType({})
_NO_WORDS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType({})

LARGEST: Final = 1e9
"""Largest magnitude of a measured value in SI. Beyond it is what instruments write without a reading, such as
9.9e37."""


class Readings(Declared, eq=False):
    """Columns of a file in the order of its rows."""

    path: Path = part("the file")
    values: dict[str, FloatArray] = part("columns of numbers by name, SI, shape (rows,)")
    words: dict[str, list[str]] = part("columns of words by name, in lower case")
    lines: IntArray = part("line of the file in which each row stands, counted from 1; shape (rows,)")
    comments: dict[str, str] = part("comments of the form ``# key: value``; of a key given twice, the last")

    def __len__(self) -> int:
        return len(self.lines)


def read_table(
    path: str | Path,
    columns: Mapping[str, str],
    *,
    optional: Mapping[str, str] = _NONE,
    text: Mapping[str, tuple[str, ...]] = _NO_WORDS,
) -> Readings:
    """Read a table, numbers in SI; a column that was left out is not in it.

    Parameters
    ----------
    path : path
        The file, UTF-8.
    columns : mapping of str to str
        Columns that must be there: name, in lower case, to SI unit.
    optional : mapping of str to str, optional
        Columns of numbers that may be left out.
    text : mapping of str to tuple of str, optional
        Columns of words, which may be left out: name to the words allowed, in lower case. They have no unit.

    Raises
    ------
    InputError
        The file cannot be read, has no rows, a column is missing, not known or given twice, lacks its unit
        or has one of another dimension, a cell is no finite number or no word allowed, or a number is
        too large or too small to be a measured one, or a row has too many or too few cells.
    """
    source = Path(path)
    if not source.exists():
        raise InputError(f"{source}: there is no such file", file=source, expected="a table of measurements")
    sheet = read_sheet(source, "the table")
    lines = sheet.rows
    must = ",".join(f"{name} [{si}]" for name, si in columns.items())
    may = ",".join([*(f"{name} [{si}]" for name, si in optional.items()), *text])
    wanted = f"the columns '{must}'" + (f" and perhaps '{may}'" if may else "")
    if not lines:
        raise InputError(f"{source}: the file has no heading", file=source, key="heading", expected=wanted)
    names, units = _heading(source, lines[0], {**columns, **optional}, text, wanted)
    missing = [name for name in columns if name not in names]
    if missing:
        raise InputError(
            f"{source}: line {lines[0][0]}: the column {missing[0]!r} is missing",
            file=source,
            key=missing[0],
            expected=wanted,
        )
    if len(lines) < 2:
        raise InputError(
            f"{source}: the table has no rows", file=source, key="rows", expected="them below the heading"
        )
    values: dict[str, FloatArray] = {name: np.empty(len(lines) - 1) for name in units}
    words: dict[str, list[str]] = {name: [] for name in names if name in text}
    for row, (number, cells) in enumerate(lines[1:]):
        if len(cells) != len(names):
            raise InputError(
                f"{source}: line {number} has {len(cells)} cells",
                file=source,
                key=f"line {number}",
                expected=f"{len(names)}",
            )
        for name, cell in zip(names, cells, strict=True):
            where = f"{source}: line {number}, column {name!r}"
            if name in text:
                word = cell.strip().lower()
                if word not in text[name]:
                    raise InputError(
                        f"{where}: {cell.strip()!r}",
                        file=where,
                        value=cell,
                        expected=f"{' or '.join(text[name])}",
                    )
                words[name].append(word)
            else:
                values[name][row] = _number(cell, *units[name], where)
    rows = np.array([number for number, _cells in lines[1:]], dtype=np.int64)
    return Readings(source, values, words, rows, sheet.comments)


def _heading(
    path: Path,
    line: tuple[int, list[str]],
    numbers: Mapping[str, str],
    text: Mapping[str, tuple[str, ...]],
    wanted: str,
) -> tuple[list[str], dict[str, tuple[str, str]]]:
    """Return the names of the columns, and of those that hold numbers their unit and its SI unit."""
    where = f"{path}: line {line[0]}"
    names: list[str] = []
    units: dict[str, tuple[str, str]] = {}
    for cell in line[1]:
        name, unit = split_heading(cell)
        name = " ".join(name.lower().split())
        if name not in numbers and name not in text:
            raise InputError(
                f"{where}: the column {cell.strip()!r} is not known",
                file=where,
                key=cell.strip(),
                expected=wanted,
            )
        if name in names:
            raise InputError(
                f"{where}: the column {name!r} is given twice", file=where, key=name, expected="it once"
            )
        names.append(name)
        if name in text:
            if "[" in cell:
                raise InputError(
                    f"{where}: heading {cell.strip()!r}: expected {name!r}, words have no unit",
                    file=where,
                    key=cell.strip(),
                )
            continue
        if not unit:
            such = f"{name} [{numbers[name]}]"
            raise InputError(
                f"{where}: heading {cell.strip()!r} is expected to carry its unit, such as {such!r}",
                file=where,
                key=cell.strip(),
            )
        with located(f"{where}: heading {cell.strip()!r}", file=where, key=cell.strip()):
            to_si(1.0, unit, numbers[name])
        units[name] = unit, numbers[name]
    return names, units


def _number(cell: str, unit: str, si: str, where: str) -> float:
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(
            f"{where}: {cell.strip()!r} is expected to be a finite number, {describe(si)} in {unit}",
            file=where,
            value=cell,
        )
    with located(where):
        value = to_si(number, unit, si)
    # Squares and powers of what no sensor reads are no numbers.
    tiny = float(np.finfo(np.float64).tiny)
    if abs(value) > LARGEST or (number != 0.0 and abs(value) < tiny):
        raise InputError(
            f"{where}: {cell.strip()} {unit}",
            file=where,
            value=cell,
            expected=f"a measured value, 0 or one of a magnitude from {tiny:.2g} to {LARGEST:g} {si}",
        )
    return value
