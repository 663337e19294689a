"""Tables of measurements as quantities in SI: assignment of columns, units, gaps, delays.

A heading states the unit of every column: ``displacement [um],current [A],force [N]``, in any order and any
unit of the dimension; every line after it is one row. A declaration of columns, or a file beside the table,
assigns the columns that the heading does not identify; see `printhammer.support.tables.columns`. The quantity
of a column is never guessed from its numbers. Times are not shifted: rows before time 0 are kept.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from operator import ne
from pathlib import Path
from types import EllipsisType, MappingProxyType
from typing import Final

import numpy as np

from printhammer.errors import InputError, located
from printhammer.support.arrays import FloatArray, IntArray
from printhammer.support.tables.columns import Columns, Source, columns_beside, read_columns
from printhammer.support.tables.layout import Table, layout_of
from printhammer.support.tables.text import GAPS, OVER, read_any
from printhammer.units import all_to_si, describe, is_unit_of, parse, to_si

_NONE: Final[Mapping[str, str]] = MappingProxyType({})
_NO_WORDS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType({})

LARGEST: Final = 1e9  # Arbitrary
"""Largest magnitude accepted for a value in SI; instruments write 9.9e37 for a missing reading."""

BEFORE: Final = 0.1
"""Largest drive value before time 0 that is treated as noise, as a fraction of the peak; arbitrary."""

_TINY: Final = float(np.finfo(np.float64).tiny)
_CAPITALS: Final = frozenset({"MA", "MV", "MN", "MW", "MJ"})
"""Capitalised spellings of mA, mV, mN, mW and mJ in headings that are all capitals."""
_BY_UNIT: Final = {"time": "s", "current": "A", "force": "N"}
"""Quantities of a record that are identified by their unit alone; a voltage may be any quantity."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Quantities read from a table, in the order of its rows."""

    path: Path
    """Path of the table."""
    values: dict[str, FloatArray]
    """Columns of numbers by quantity, SI, shape (rows,)."""
    words: dict[str, list[str]]
    """Text columns by name, in lower case."""
    lines: IntArray
    """Line number in the file of each row, counted from 1, shape (rows,)."""
    comments: dict[str, str]
    """Comments of the form ``# key: value``; the last comment with a key replaces earlier comments."""
    levels: frozenset[str] = frozenset()
    """Names of columns of logic levels, 0 or 1, from a logic analyser; a level holds until the next row."""

    def __len__(self) -> int:
        return len(self.lines)

    def check_times(self, *, least: int = 2) -> None:
        """Raise InputError for fewer than `least` rows, or at the first line whose time does not ascend."""
        times, where = self.values["time"], str(self.path)
        if len(times) < least:
            raise InputError(
                f"{where}: {len(times)} samples", file=where, key="time", expected=f"at least {least}"
            )
        bad = np.flatnonzero(np.diff(times) <= 0.0)
        if len(bad):
            row = int(bad[0]) + 1
            raise InputError(
                f"{where}: line {self.lines[row]}: time {times[row]:.9g} s after {times[row - 1]:.9g} s",
                file=where,
                key="time",
                value=float(times[row]),
                expected="ascending times",
            )

    def check_before(self, times: FloatArray, name: str) -> None:
        """Check that the signal of the drive in the column `name` does not start before time 0, the firing.

        Raises
        ------
        InputError
            Before time 0 the drive exceeds `BEFORE` times its peak, or no row is after time 0.
        """
        values, where = np.abs(self.values[name]), str(self.path)
        early = times < 0.0
        largest = float(values[early].max(initial=0.0))
        if early.all() or largest > BEFORE * float(values.max()):
            raise InputError(
                f"{where}: a {name} of {largest:.4g} before time 0",
                file=where,
                key=name,
                value=largest,
                expected=f"the firing at time 0, or --columns 'time=1+{-times[0]:.9g} s, ...'",
            )


def read_table(
    path: str | Path,
    required: Mapping[str, str],
    *,
    optional: Mapping[str, str] = _NONE,
    text: Mapping[str, tuple[str, ...]] = _NO_WORDS,
    gaps: Collection[str] = (),
    columns: str | EllipsisType | None = ...,
    what: str = "the table",
) -> Readings:
    """Read a table and convert its numbers to SI; optional columns may be missing from the result.

    Parameters
    ----------
    path : path
        The file.
    required : mapping of str to str
        Required columns: name, in lower case, to SI unit.
    optional : mapping of str to str, optional
        Optional columns of numbers.
    text : mapping of str to tuple of str, optional
        Optional columns of words: name to the allowed words, in lower case. They have no unit.
    gaps : collection of str, optional
        Columns whose empty cells become NaN.
    columns : str, optional
        Declaration of the columns; by default the file beside the table, or else its heading.
        If this argument is omitted, error messages suggest such a file instead of the option ``--columns``.
    what : str, optional
        Name of the file in error messages.

    Raises
    ------
    InputError
        The file cannot be read or has no rows; a column is missing, unknown or repeated, or lacks a unit of
        its dimension; a cell is not a finite number or an allowed word; a number is too large or too small
        for a measurement; or a row has too few or too many cells.
    """
    source = Path(path)
    content = read_any(source, what)
    option = columns is not ...
    told = columns_of(source, columns if isinstance(columns, str) else None)
    words = {word for allowed in text.values() for word in allowed}
    table = layout_of(content, str(source), words)
    return readings_of(table, required, optional=optional, text=text, gaps=gaps, columns=told, option=option)


def columns_of(path: Path, columns: str | None) -> Columns | None:
    """Return the declared columns of a table, from `columns` or the file next to the table; else None."""
    return columns_beside(path) if columns is None else read_columns(columns)


def readings_of(
    table: Table,
    required: Mapping[str, str],
    *,
    optional: Mapping[str, str] = _NONE,
    text: Mapping[str, tuple[str, ...]] = _NO_WORDS,
    gaps: Collection[str] = (),
    columns: Columns | None = None,
    option: bool = True,
) -> Readings:
    """Convert a table to quantities; arguments and errors as for `read_table`.

    Error messages suggest the option ``--columns`` if `option` is true, else a file of columns beside the
    table.
    """
    numbers = {**required, **optional}
    wanted = _wanted(required, optional, text)
    sources, words = assigned(table, numbers, text, wanted, columns, option)
    clock = columns.clock if columns and columns.clock else table.clock
    missing = [name for name in required if name not in sources and not (name == "time" and clock)]
    if missing:
        raise InputError(
            f"{table.where}: {_line(table)}the column {missing[0]!r} is missing among {_list_columns(table)}",
            file=table.where,
            key=missing[0],
            expected=f"{wanted}, or {_advice(table, required, option)}",
        )
    if not table.rows:
        raise InputError(
            f"{table.where}: the table has no rows",
            file=table.where,
            key="rows",
            expected="rows below the heading",
        )
    values = {
        name: _values(table, name, source, numbers[name], name in gaps) for name, source in sources.items()
    }
    if "time" in numbers and "time" not in values and clock:
        values["time"] = clock.times(len(table.rows))
    cells = {name: _words(table, name, place, text[name]) for name, place in words.items()}
    lines = np.array(table.lines, dtype=np.int64)
    if columns and columns.delays:
        values, lines = _in_time(values, lines, columns, table.where)
    levels = {name for name, source in sources.items() if source.place - 1 in _levels(table)}
    return Readings(Path(table.where), values, cells, lines, table.comments, frozenset(levels))


def assigned(
    table: Table,
    numbers: Mapping[str, str],
    text: Mapping[str, tuple[str, ...]],
    wanted: str,
    columns: Columns | None,
    option: bool,
) -> tuple[dict[str, Source], dict[str, int]]:
    """Assign columns to quantities and words, by the declaration `columns` or else by the heading.

    Return the sources of the quantities and the indices of the columns of words, by name; `wanted` states the
    possible columns in messages.
    """
    if columns is None:
        return _by_heading(table, numbers, text, wanted, option)
    for name, source in columns.sources.items():
        if name not in numbers or source.place > len(table.columns):
            raise InputError(
                f"{columns.where}: {name} = {source.place} in {table.where}",
                file=columns.where,
                key=name,
                value=source.place,
                expected=f"{wanted}, and one of the {len(table.columns)} columns {_list_columns(table)}",
            )
    for name in columns.delays:
        if name not in columns.sources:
            raise InputError(
                f"{columns.where}: delay({name})",
                file=columns.where,
                key=f"delay({name})",
                expected="an existing column",
            )
    sources = dict(columns.sources)
    if "time" in numbers and "time" not in sources and columns.clock is None:
        times = [k for k, heading in enumerate(table.columns) if heading.quantity == "time" and heading.unit]
        sources |= {"time": Source(times[0] + 1)} if len(times) == 1 else {}
    return sources, {}


def quantities_of(table: Table, numbers: Collection[str]) -> list[str]:
    """Identify the quantity of each column by its heading: by name, or by a unit that occurs once.

    A column of sample indices is not a quantity. Only time, current and force are identified by unit, and
    only in a record over time: a voltage or a length may be any quantity.
    """
    known = []
    for place, heading in enumerate(table.columns):
        name = heading.name.lower()
        numbered = table.clock is not None and place == table.clock.numbers
        known.append("" if numbered else name if name in numbers else heading.quantity)
    for name, si in _BY_UNIT.items() if "time" in numbers else ():
        same = [k for k, heading in enumerate(table.columns) if not known[k] and is_unit_of(heading.unit, si)]
        if name in numbers and name not in known and len(same) == 1:
            known[same[0]] = name
    return known


def _levels(table: Table) -> set[int]:
    """Return the indices of the columns of logic levels; empty unless some level changes in every row.

    A column of logic levels has cells 0 and 1, and neither a unit nor the name of a quantity.
    """
    columns = {
        place: table.cells(place)
        for place, heading in enumerate(table.columns)
        if not (heading.unit or heading.quantity) and {"0", "1"} >= set(table.cells(place))
    }
    rows = list(zip(*columns.values(), strict=True))
    return set(columns) if all(map(ne, rows, rows[1:])) else set()


def _by_heading(
    table: Table, numbers: Mapping[str, str], text: Mapping[str, tuple[str, ...]], wanted: str, option: bool
) -> tuple[dict[str, Source], dict[str, int]]:
    """Assign columns by names in the heading, or by a unit that occurs once; result as for `assigned`."""
    where = f"{table.where}: {_line(table)}".rstrip(": ")
    sources: dict[str, Source] = {}
    words: dict[str, int] = {}
    unknown = []
    known = quantities_of(table, {*numbers, *text})
    for place, (heading, name) in enumerate(zip(table.columns, known, strict=True)):
        if name in sources or name in words:
            raise InputError(
                f"{where}: the column {name!r} occurs twice",
                file=where,
                key=name,
                expected="each column once",
            )
        if name in text:
            if heading.unit:
                raise InputError(
                    f"{where}: heading {heading.shown!r}: expected {name!r}, since words have no unit",
                    file=where,
                    key=heading.shown,
                )
            words[name] = place
        elif name in numbers:
            sources[name] = Source(place + 1)
        elif name and "time" in numbers:
            # A column of a known quantity that is not requested is ignored.
            continue
        elif (table.clock is None or place != table.clock.numbers) and (
            heading.shown or not any(each.name for each in table.columns)
        ):
            unknown.append(place)
    if unknown:
        shown = table.columns[unknown[0]].shown[:60]
        raise InputError(
            f"{where}: the column {shown!r} is not known"
            if shown
            else f"{where}: column {unknown[0] + 1} has no heading",
            file=where,
            key=shown,
            expected=f"{wanted}, or {_advice(table, numbers, option)}",
        )
    for name, source in sources.items():
        heading = table.columns[source.place - 1]
        such = f"{name} [{numbers[name]}]"
        if not heading.unit:
            raise InputError(
                f"{where}: heading {heading.shown!r}",
                expected=f"a heading with a unit, such as {such!r}",
                file=where,
                key=heading.shown,
            )
        with located(f"{where}: heading {heading.shown!r}", file=where, key=heading.shown):
            to_si(1.0, heading.unit, numbers[name])
    return sources, words


def _values(table: Table, name: str, source: Source, si: str, gaps: bool) -> FloatArray:
    """Return the numbers of the quantity `name` in SI; if `gaps`, empty cells become NaN."""
    cells = table.cells(source.place - 1)
    heading = table.columns[source.place - 1]
    if heading.unit in _CAPITALS and not source.unit.endswith(f"/{heading.unit}"):
        small = heading.unit.replace("M", "m")
        raise InputError(
            f"{table.where}: heading {heading.shown!r}: {heading.unit} may be {small} in capital letters",
            file=table.where,
            key=heading.shown,
            expected=f"{small}, or --columns '{name}={source.place}*1 {small}/{heading.unit}, ...'",
        )
    numbers = _floats(table, name, cells, heading.unit or source.unit, si, gaps)
    place = heading.name or name
    with located(f"{table.where}: {place}", file=table.where, key=place):
        if is_unit_of(heading.unit, si) and (source.factor, source.unit) == (1.0, ""):
            array = _to_si(numbers, heading.unit, si)
        else:
            array = np.array(numbers, dtype=np.float64) * source.scale(heading.unit, si)
    # Squares and powers of implausible readings would overflow.
    size, cell = np.abs(array), np.abs(numbers)
    # 32 degF are 0 degC: only a number below 1 can underflow.
    bad = np.flatnonzero((size > LARGEST) | ((size < _TINY) & (cell > 0.0) & (cell < 1.0)))
    if len(bad):
        row = int(bad[0])
        raise InputError(
            f"{table.where}: line {table.lines[row]}, column {name!r}: {cells[row]} {heading.unit}".rstrip(),
            file=f"{table.where}: line {table.lines[row]}",
            key=name,
            value=cells[row],
            expected=f"a measured value, 0 or one of a magnitude from {_TINY:.2g} to {LARGEST:g} {si}",
        )
    if source.offset:
        with located(f"{table.where}: {place}", file=table.where, key=place):
            array = array + parse(source.offset, si)
    return array


def _to_si(numbers: list[float], unit: str, si: str) -> FloatArray:
    """Convert numbers to SI; infinite if a number overflows."""
    try:
        return np.array(all_to_si(numbers, unit, si), dtype=np.float64)
    except InputError:
        return np.array(numbers) * math.inf


def _floats(table: Table, name: str, cells: list[str], unit: str, si: str, gaps: bool) -> list[float]:
    """Parse the numbers of a column in the unit of the table; an allowed gap is NaN."""
    numbers = []
    for row, cell in enumerate(cells):
        try:
            number = float(cell)
        except ValueError:
            number = math.nan
        if math.isfinite(number) and "_" not in cell:
            numbers.append(number)
            continue
        if gaps and cell.lower() in GAPS:
            numbers.append(math.nan)
            continue
        what = "beyond the range of the instrument" if cell.lower() in OVER else f"expected {describe(si)}"
        raise InputError(
            f"{table.where}: line {table.lines[row]}, column {name!r}: {cell[:40]!r} is no finite number,"
            f" {what}" + (f" in {unit}" if unit else ""),
            file=f"{table.where}: line {table.lines[row]}",
            key=name,
            value=cell,
        )
    return numbers


def _words(table: Table, name: str, place: int, allowed: tuple[str, ...]) -> list[str]:
    cells = [cell.lower() for cell in table.cells(place)]
    for row, cell in enumerate(cells):
        if cell not in allowed:
            where = f"{table.where}: line {table.lines[row]}"
            raise InputError(
                f"{where}, column {name!r}: {cell[:40]!r}",
                file=where,
                key=name,
                value=cell,
                expected=" or ".join(allowed),
            )
    return cells


def _in_time(
    values: dict[str, FloatArray], lines: IntArray, columns: Columns, where: str
) -> tuple[dict[str, FloatArray], IntArray]:
    """Remove column delays by interpolation to common times; drop incomplete rows.

    The common times are the times of the first column, minus its delay; all other columns are interpolated
    linearly.
    """
    times = values["time"]
    names = [name for name in values if name != "time"]
    delays = {name: columns.delays.get(name, 0.0) for name in names}
    first = delays[names[0]]
    at = times - first
    kept = np.ones(len(times), dtype=np.bool_)
    moved = {}
    for name in names:
        if delays[name] == first:
            moved[name] = values[name]
            continue
        own = times - delays[name]
        kept &= (at >= own[0]) & (at <= own[-1])
        moved[name] = np.interp(at, own, values[name])
    if not kept.any():
        raise InputError(
            f"{where}: the delays leave no rows", file=where, key="delay", expected="shorter delays"
        )
    return {"time": at[kept], **{name: column[kept] for name, column in moved.items()}}, lines[kept]


def _wanted(required: Mapping[str, str], optional: Mapping[str, str], text: Collection[str]) -> str:
    must = ",".join(f"{name} [{si}]" for name, si in required.items())
    may = ",".join([*(f"{name} [{si}]" for name, si in optional.items()), *text])
    return f"the columns '{must}'" + (f" and perhaps '{may}'" if may else "")


def _line(table: Table) -> str:
    return f"line {table.head}: " if table.head else ""


def _list_columns(table: Table) -> str:
    """Format the columns of a table for messages, such as "1 'TIME [s]', 2 'CH1 [V]'"."""
    listed = [f"{k} {heading.shown[:40]!r}" for k, heading in enumerate(table.columns[:8], 1)]
    return ", ".join(listed) + (", ..." if len(table.columns) > len(listed) else "")


def _advice(table: Table, numbers: Mapping[str, str], option: bool) -> str:
    """Return an example of a declaration of columns, as the option `--columns` or as the lines of a file."""
    entries = _example(table, numbers)
    if option:
        return f"--columns '{', '.join(entries)}'"
    lines = (entry.replace("=", ' = "', 1) + '"' for entry in entries)
    beside = f"{Path(table.where).name}.toml"
    return f"a file {beside} with the lines '[columns]', {', '.join(map('{!r}'.format, lines))}"


def _example(table: Table, numbers: Mapping[str, str]) -> list[str]:
    """Return the entries of an example of a declaration; STEP stands for an unknown sampling interval."""
    names, clock = dict(numbers), table.clock
    places = [place for place in range(1, len(table.columns) + 1) if any(table.cells(place - 1))]
    entries = []
    if "time" in names:
        unit = table.columns[places[0] - 1].unit if places else ""
        is_first = len(places) > 1 and (not unit or is_unit_of(unit, names["time"]))
        counted = clock is not None and clock.numbers is not None
        if counted or not is_first:
            del names["time"]
            entries = [] if clock else ["time=0 s + STEP"]
        if counted:
            places = [place for place in places if clock and place - 1 != clock.numbers]
    of_quantity = {
        name: next((place for place in places if is_unit_of(table.columns[place - 1].unit, si)), 0)
        for name, si in names.items()
        if name != "time" and si != "V"  # A voltage may be any quantity.
    }
    others = [place for place in places if place not in of_quantity.values()]
    for name, si in names.items():
        place = of_quantity.get(name) or (others.pop(0) if others else 0)
        if not place:
            continue
        own = table.columns[place - 1].unit
        factor = "" if own and is_unit_of(own, si) else f"*1 {si}/{own}" if own else f"*1 {si}"
        entries.append(f"{name}={place}{factor}")
    return entries
