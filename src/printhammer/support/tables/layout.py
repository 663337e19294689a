"""Layout of a table of numbers: separator, heading, units, surrounding metadata, and sample times.

Supported are the exports of oscilloscopes (Rigol, Tektronix, Keysight, PicoScope, LeCroy, Siglent, Rohde &
Schwarz, GW Instek, Yokogawa), of logic analysers (Saleae, sigrok), of LabVIEW and LTspice, and of
spreadsheets. No number is skipped: a row of numbers outside the table is an error that names its line.

The heading of a column contains its name and unit; the name denotes a quantity.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from printhammer.errors import InputError, located
from printhammer.support.arrays import FloatArray
from printhammer.support.tables.text import (
    is_number,
    is_reading,
    paused_collector,
    read_any,
    spaced,
    split_cells,
    with_points,
)
from printhammer.units import is_unit_of, parse, to_si

ALIASES: Final = {
    "time": ("time", "t", "x-axis", "sec", "second", "seconds", "zeit", "temps"),
    "displacement": ("displacement", "position", "x", "weg"),
    "current": ("current", "i", "strom"),
    "force": ("force", "f", "kraft"),
    "voltage": ("voltage", "u", "spannung", "tension"),
}
"""Names of columns, in lower case, by quantity."""

_MEASURED: Final = ("s", "V", "A", "m", "N", "Hz", "m/s", "ohm", "Wb", "H")
_COUNTS: Final = frozenset({"number", "sequence", "samples", "sample", "#", "pts", "points"})
_BRACKETS: Final = re.compile(r"(.*?)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\})", re.DOTALL)
_BESIDE: Final = re.compile(r"(.*?)(?:(?:^|\s+)in\s+|\s*/\s*|\s*,\s*|_)([^\s,/_]+)", re.DOTALL)
_NUMBERED: Final = re.compile(r"[A-Za-z]+\d+")  # "A1" and "V2" are names of channels, not powers of units
_CURRENTS: Final = re.compile(r"I\w*\(.+\)")
_VOLTAGES: Final = re.compile(r"V\(.+\)")


class Heading(NamedTuple):
    """Name and unit of a column; empty where the heading has no name or no unit."""

    name: str
    unit: str = ""

    @property
    def shown(self) -> str:
        """Column heading as text for messages, such as "CH1 [V]"."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def quantity(self) -> str:
        """Quantity that the column name denotes, such as "current"; empty if the name is unknown."""
        name = self.name.lower()
        if name == "x" and is_unit_of(self.unit, "s"):
            return "time"  # The horizontal axis of an oscilloscope.
        return next((what for what, names in ALIASES.items() if name in names), "")


def split_heading(cell: str) -> Heading:
    """Split a heading such as "time [us]", "time (us)", "time in us" or "t/us" into name and unit.

    A text in square brackets is always the unit; in any other notation only if the unit is known, so that
    "i(t)" is a name.
    """
    cell = " ".join(cell.split())
    match = _BRACKETS.fullmatch(cell)
    if match:
        name, square, *others = match.groups()
        if square is not None:
            return Heading(name, (unit_of(square) or square).strip())
        unit = unit_of(next(text for text in others if text is not None))
        if unit:
            return Heading(name, unit)
    match = _BESIDE.fullmatch(cell)
    if match and (match[1] or cell.startswith("in ")) and (unit := unit_of(match[2])):
        return Heading(match[1], unit)
    return Heading(cell)


def unit_of(text: str) -> str:
    """Parse a cell such as "(us)", "Volts" or "V DC" as a unit; an empty string if it is not a unit."""
    bare = re.sub(r"\s*(DC|AC|dc|ac)$", "", text.strip().strip("()[]{}").strip()) or text.strip()
    if _NUMBERED.fullmatch(bare):
        return ""
    for word in (bare, bare.lower()):
        for si in _MEASURED:
            with suppress(InputError):
                return si if to_si(1.0, word, si) == 1.0 else word
    return ""


def is_unit_row(cells: list[str]) -> bool:
    """Whether each cell of a row is a unit, a word such as "samples", or empty, with at least one unit."""
    units = [unit_of(cell) or cell.strip().strip("()").lower() in _COUNTS for cell in cells if cell.strip()]
    return all(units) and any(isinstance(unit, str) for unit in units)


def headings(rows: list[list[str]], width: int, separator: str) -> list[Heading]:
    """Build the headings of `width` columns from a row of names, a row of units, or both.

    Without rows, the headings are empty. With tabs as `separator`, headings of LTspice obtain their units.
    """
    units = [""] * width
    names = rows[-1][:width] if rows else [""] * width
    if rows and is_unit_row(names):
        units = [unit_of(cell) for cell in names]
        names = rows[-2][:width] if len(rows) > 1 else names
    columns = []
    for name, unit in zip(names, units, strict=True):
        split = split_heading(name)
        columns.append(Heading(split.name, unit or split.unit))
    return _of_ltspice(columns) if separator == "\t" else columns


def _of_ltspice(columns: list[Heading]) -> list[Heading]:
    """Add the units that LTspice omits to its headings: "time", "V(out)", "I(L1)"."""
    kinds = [
        "A" if _CURRENTS.fullmatch(name) else "V" if _VOLTAGES.fullmatch(name) else "" for name, _ in columns
    ]
    if columns[0] != Heading("time") or not all(kinds[1:]) or len(columns) < 2:
        return columns
    return [
        Heading("time", "s"),
        *(Heading(c.name, kind) for c, kind in zip(columns[1:], kinds[1:], strict=True)),
    ]


Row = tuple[int, list[str]]
"""Row of a table: its line in the file, counted from 1, and its cells."""

_SEPARATORS: Final = "\t;|, "
_LINES: Final = 2000
"""Number of leading lines from which the separator is determined; arbitrary."""
_START: Final = ("xorg", "xorigin", "t0", "x0", "tstart", "xzero", "hoffset", "start", "begin")
_STEP: Final = (
    *("increment", "incr", "inc", "step", "delta", "tinc", "dt", "deltax", "timeincrement", "hresolution"),
    *("xinc", "xincr", "xincrement", "sampleinterval", "samplinginterval", "samplingperiod"),
)
_CLOCK: Final = {*_START, *_STEP}
_RATE: Final = ("samplerate", "samplingrate")
_ZERO: Final = ("zeroindex", "triggerpoint")
_TIME_UNIT: Final = ("horizontalunits", "xunits", "hunit", "timeunits", "timeunit")
_VALUE_UNIT: Final = ("verticalunits", "yunits", "vunit")
_NUMBERING: Final = ("x", "no", "no.", "nr", "n", "#", "index", "sample", "sequence", "point")
_STAMP: Final = re.compile(r"\s*\d{1,4}([:/.-])\d{1,2}\1\d{1,4}")  # Time of day or date, never a heading
_ASSIGNED: Final = re.compile(r"\s*([^=:]+?)\s*[=:]\s*([^=:]+?)\s*")


class Clock(NamedTuple):
    """Times of evenly spaced samples."""

    start: float
    """Time of the first sample, s."""
    step: float
    """Sampling interval, s."""
    numbers: int | None = None
    """Index of the column of sample numbers; None if there is no such column."""

    def times(self, count: int) -> FloatArray:
        """Return the times of the first `count` samples, s."""
        return np.asarray(self.start + self.step * np.arange(count), dtype=np.float64)


@dataclass(frozen=True)
class Table:
    """Table of numbers, before the columns are assigned to quantities."""

    where: str
    """Name of the file, for error messages."""
    head: int
    """Line number of the heading; 0 without a heading."""
    columns: list[Heading]
    """Name and unit of each column, from its heading."""
    lines: list[int]
    """Line number in the file of each row, counted from 1."""
    rows: list[list[str]]
    """Cells of each row as text; numbers are written with a decimal point, not a decimal comma."""
    comments: dict[str, str]
    """Comments of the form ``# key: value``."""
    clock: Clock | None
    """Sample times of the rows, if metadata in the file state the sampling; else None."""

    def cells(self, place: int) -> list[str]:
        """Return the cells of a column, stripped of white space."""
        return [row[place].strip() if place < len(row) else "" for row in self.rows]


def read_layout(path: Path, what: str, words: Collection[str] = ()) -> Table:
    """Read the table in a file; `what` names the file in messages, `words` are cells allowed as text."""
    return layout_of(read_any(path, what), str(path), words)


@paused_collector()
def layout_of(text: str, where: str, words: Collection[str] = ()) -> Table:
    """Determine the layout of a table in a text; arguments and errors as for `read_layout`.

    Raises
    ------
    InputError
        There is no heading, a row has too few or too many cells, a row of numbers is outside the table, or
        the decimal mark is ambiguous.
    """
    separator = _separator(text)
    split = split_cells(text, where, delimiter=separator)
    whole = {line: len(row) for line, row in split.rows}
    rows = [(line, _bare(row)) for line, row in split.rows]
    if not rows:
        raise InputError(
            f"{where}: the file has no heading",
            file=where,
            key="heading",
            expected="a line such as 'time [us],current [A]' above the numbers",
        )
    rows, beside = _without_facts_beside(rows)
    facts = {_key(key): [value] for key, value in split.comments.items()} | beside
    # If no row is numeric, the parser of the cells reports the faulty cell.
    begin = next((k for k, (_line, row) in enumerate(rows) if _is_data(row, words)), 1)
    above, data = rows[:begin], rows[begin:]
    if len(above) > 1 and is_unit_row(above[-1][1]):
        line, units = above[-1]
        # Columns without a unit, at the right of the table.
        above[-1] = line, [*units, *[""] * (min(whole[line], len(above[-2][1])) - len(units))]
    if (
        above
        and data
        and above[-1][1][-1].strip() == "Comment"
        and all(len(row) < len(above[-1][1]) for _, row in data)
    ):
        above[-1] = above[-1][0], above[-1][1][:-1]  # LabVIEW writes no cell for an empty comment.
    named = [] if above and any(map(_STAMP.match, above[-1][1])) else above
    width = _width(data, named)
    if not width:
        line, row = above[-1]
        raise InputError(
            f"{where}: line {line}: {row[0].strip()[:40]!r} states the sampling",
            file=where,
            key=f"line {line}",
            value=row[0],
            expected="the names of the columns left of it",
        )
    for line, row in data:
        if not len(row) <= width <= whole[line]:
            raise InputError(
                f"{where}: line {line} has {len(row)} {'cell' if len(row) == 1 else 'cells'}",
                file=where,
                key=f"line {line}",
                expected=f"{width}",
            )
    if not above and not beside:
        above = named = _commented(split.notes, separator, width, data[0][0])
    heading = _heading_rows(where, named, width)
    for line, row in above[: len(above) - len(heading)]:
        facts |= _facts_of(row) if line else {}
    extra = [row[width:] for _line, row in heading]
    for name, *values in zip(*extra, strict=False):
        facts |= {_key(name): values} if values else _facts_of([name])
    columns = _with_units(headings([row for _line, row in heading], width, separator), facts, above)
    if beside and _TIME_UNIT[0] in facts:
        columns = _beside_names(columns, facts)
    lines = [line for line, _row in data]
    cells = with_points(where, text, separator, lines, [row for _line, row in data])
    if any("sigrok" in note for _line, note in split.notes):
        facts.setdefault("start", ["0 s"])
    clock = _clock(where, facts, columns, cells, numbered=any(extra))
    if clock and lines and clock.numbers is None and lines[-1] - lines[0] >= len(lines):
        # Rows may be missing, so times follow from the sample numbers.
        clock = None
    head = heading[0][0] if heading else 0
    return Table(where, head, columns, lines, cells, split.comments, clock)


def _separator(text: str) -> str:
    """Determine the separator that turns most lines into rows of numbers, or else splits most lines."""
    lines = [line for line in text.split("\n", _LINES)[:_LINES] if line.strip() and line.strip()[0] != "#"]
    best, chosen = 0, ""
    for sign in _SEPARATORS:
        count = 0
        for line in lines:
            cells = [cell.strip(' \t"') for cell in line.split(sign if sign != " " else None)]
            count += len(cells) > 1 and all(map(is_reading, cells)) and any(map(is_number, cells))
        if count > best:
            best, chosen = count, sign
    return chosen or next(
        (sign for sign in "\t;|" if 2 * sum(sign in line for line in lines) > len(lines)), ","
    )


def _bare(row: list[str]) -> list[str]:
    """Return a row without empty cells at its end."""
    while row and not row[-1].strip():
        row = row[:-1]
    return row


def _is_data(row: list[str], words: Collection[str]) -> bool:
    """Whether a row is numeric: every cell is a reading, a gap or an allowed word."""
    cells = [cell.strip() for cell in row]
    return any(map(is_number, cells)) and all(is_reading(cell) or cell.lower() in words for cell in cells)


def _width(data: list[Row], above: list[Row]) -> int:
    """Return the number of columns: the length of the heading, or else of the longest row of numbers.

    `data` are the rows of numbers, `above` the rows above them.
    """
    last = above[-1][1] if above else []
    if any(map(_is_named, last)) or is_unit_row(last):
        facts = (k for k, cell in enumerate(last) if _key(cell) in _CLOCK or _is_clock_entry(cell))
        numbers = (k for k, cell in enumerate(last) if is_number(cell.strip()) and not cell.strip().isdigit())
        return min(next(facts, len(last)), next(numbers, len(last)))
    return max((len(row) for _line, row in data), default=len(last))


def _is_clock_entry(cell: str) -> bool:
    """Whether a cell states the start or the interval of the samples, such as "t0 = -1 ms"."""
    match = _ASSIGNED.fullmatch(cell)
    return match is not None and _key(match[1]) in _CLOCK


def _commented(notes: list[tuple[int, str]], separator: str, width: int, first: int) -> list[Row]:
    """Return the heading in the last comment above the numbers, where `numpy.savetxt` writes the heading.

    The result is empty unless the comment has `width` cells. `notes` are line numbers and texts of comments;
    `first` is the line of the first numbers.
    """
    above = [
        (line, spaced(note).split() if separator == " " else note.split(separator))
        for line, note in notes
        if line < first
    ]
    return [(line, row) for line, row in above[-1:] if len(row) == width > 1]


def _heading_rows(where: str, above: list[Row], width: int) -> list[Row]:
    """Return the rows with the names and units of columns, at most two, from the rows above the numbers."""
    if not above or len(above[-1][1]) < width:
        return []
    line, last = above[-1]
    numbers = [cell for cell in last[:width] if is_number(cell.strip())]
    before = above[-2] if len(above) > 1 and len(above[-2][1]) >= width else None
    if numbers and (is_number(last[0].strip()) or (before and any(map(_is_named, before[1])))):
        raise InputError(
            f"{where}: line {line}: {','.join(last)[:60]!r}",
            expected="numbers only",
            file=where,
            key=f"line {line}",
            value=",".join(last),
        )
    return [before, above[-1]] if before and is_unit_row(last[:width]) else above[-1:]


def _is_named(cell: str) -> bool:
    heading = split_heading(cell)
    return bool(heading.unit or heading.quantity)


def _without_facts_beside(rows: list[Row]) -> tuple[list[Row], dict[str, list[str]]]:
    """Separate the rows of numbers from metadata columns on their left; return the rows and the metadata.

    Files of older Tektronix oscilloscopes have such columns.
    """
    first = rows[0][1]
    if not first[0].strip() or is_reading(first[0].strip()):
        return rows, {}
    width = len(first)
    cut = width
    while cut and all(len(row) == width and is_number(row[cut - 1].strip()) for _line, row in rows):
        cut -= 1
    if width - cut < 2:
        return rows, {}
    facts: dict[str, list[str]] = {}
    for _line, row in rows:
        facts |= _facts_of(row[:cut])
    return [(line, row[cut:]) for line, row in rows], facts


def _key(text: str) -> str:
    """Normalise the name of a metadata entry: lower case, letters and digits only."""
    return "".join(letter for letter in text.lower() if letter.isalnum())


def _facts_of(row: list[str]) -> dict[str, list[str]]:
    """Parse the metadata entries of a row: "key,value,...", or cells such as "t0 = -1 ms"."""
    facts = {_key(match[1]): [match[2]] for cell in row if (match := _ASSIGNED.fullmatch(cell))}
    if len(row) > 1 and row[0].strip():
        facts[_key(row[0])] = [cell.strip() for cell in row[1:]]
    return facts


def _with_units(columns: list[Heading], facts: dict[str, list[str]], above: list[Row]) -> list[Heading]:
    """Add units stated in the metadata to the headings of columns without a unit."""
    lecroy = bool(above) and above[0][1][0].upper().startswith("LECROY")
    time = _fact(facts, _TIME_UNIT, ["s"] if lecroy else [""])[0]
    values = _fact(facts, _VALUE_UNIT, ["V"] if lecroy else [""])
    values = [split_heading(f"x [{value.rpartition(':')[2]}]").unit for value in values if value.strip()] or [
        ""
    ]
    made, channel = [], 0
    for column in columns:
        if column.quantity == "time":
            made.append(column._replace(unit=column.unit or split_heading(f"x [{time}]").unit))
            continue
        own = values[channel if len(values) > 1 and channel < len(values) else 0]
        unit = column.unit or (own if column.name or len(columns) == 1 else "")
        made.append(column._replace(unit=unit))
        channel += 1
    return made


def _beside_names(columns: list[Heading], facts: dict[str, list[str]]) -> list[Heading]:
    """Return the column headings of a file of an older Tektronix oscilloscope, from its metadata."""
    source = _fact(facts, ("source",), [""])[0]
    unit = split_heading(f"x [{facts[_TIME_UNIT[0]][0]}]").unit
    return [Heading("time", unit), *(column._replace(name=source) for column in columns[1:])]


def _fact(facts: dict[str, list[str]], keys: Collection[str], default: list[str]) -> list[str]:
    return next((facts[key] for key in keys if facts.get(key)), default)


def _clock(
    where: str, facts: dict[str, list[str]], columns: list[Heading], rows: list[list[str]], *, numbered: bool
) -> Clock | None:
    """Derive the sample times from metadata: start and step, or step and the index of time zero.

    Return None if the metadata do not determine the times. `numbered` states whether metadata stand to the
    right of the column names; otherwise, a start without a unit may be a sample index.
    """
    written = _fact(facts, _START, [""])[0]
    # Above the numbers, a start without a unit may be a sample index.
    plain = not numbered and is_number(written) and not any(key in facts for key in _START[:-2])
    start = None if plain else _stated(where, "start", written, "s")
    step = _stated(where, "step", _fact(facts, _STEP, [""])[0], "s")
    rate, zero = (_fact(facts, keys, [""])[0] for keys in (_RATE, _ZERO))
    if step is None and (frequency := _stated(where, "sampling rate", rate, "Hz")):
        step = 1.0 / frequency
    index = _stated(where, "index of time zero", zero, "1") if is_number(zero) else None
    if start is None and step is not None and index is not None:
        start = -index * step
    if start is None or step is None:
        return None
    if columns[0].name.lower() not in (_NUMBERING if numbered else _NUMBERING[1:]):
        return Clock(start, step)
    numbers = [row[0].strip() for row in rows]
    counted = all(is_number(number) and float(number) == k for k, number in enumerate(numbers))
    return Clock(start, step, 0) if counted else None


def _stated(where: str, name: str, text: str, si: str) -> float | None:
    """Parse a number of the metadata, in the SI unit `si` or with its unit; None for an empty string."""
    if not text:
        return None
    with located(f"{where}: {name}", file=where, key=name):
        pointed = text.replace(",", ".")
        if not is_number(text):
            return parse(pointed, si)
        with suppress(ValueError):
            return float(pointed)
        raise InputError(repr(text), value=text, expected="a number without thousands separators")
