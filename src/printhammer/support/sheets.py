"""CSV tables with units in the heading: cells, line numbers and comments, not yet interpreted.

Blank lines and lines that begin with # are skipped; a comment such as ``# sampling rate: 1 MHz`` is kept as a
key with its text.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from printhammer.errors import InputError
from printhammer.support.files import read_text


@dataclass(frozen=True)
class Sheet:
    """Cells of a CSV table."""

    where: str
    """Name of the file, for messages."""
    rows: list[tuple[int, list[str]]]
    """Line numbers, from 1, with the cells of each line; the heading comes first."""
    comments: dict[str, str]
    """Comments of the form ``# key: value``; the last one wins if a key is repeated."""


def read_sheet(path: Path, what: str, *, gaps: bool = False) -> Sheet:
    """Read a CSV table; `what` names it in messages, such as "the force table".

    With `gaps`, a line of empty cells counts as a row.

    Raises
    ------
    InputError
        The file cannot be read, is not UTF-8, or holds no comma-separated values.
    """
    return sheet_of(read_text(path, what, encoding="utf-8-sig"), str(path), gaps=gaps)


def sheet_of(text: str, where: str, *, gaps: bool = False, delimiter: str = ",") -> Sheet:
    """Split the text of a CSV table as `read_sheet` does; `where` names the file in messages."""
    comments: dict[str, str] = {}
    reader = csv.reader(_uncommented(text, comments), strict=True, delimiter=delimiter)
    rows = []
    try:
        for row in reader:
            if any(cell.strip() for cell in row) or (gaps and len(row) > 1):
                rows.append((reader.line_num, row))  # noqa: PERF401
    except csv.Error as error:
        raise InputError(
            f"{where}: line {reader.line_num}: expected comma-separated values ({error})",
            file=where,
            key=f"line {reader.line_num}",
        ) from None
    return Sheet(where, rows, comments)


def split_heading(cell: str) -> tuple[str, str]:
    """Split a heading such as "time [us]" into name and unit; a heading without a unit yields ""."""
    name, _, rest = cell.strip().partition("[")
    unit, closed, tail = rest.partition("]")
    return name.strip(), unit.strip() if closed and not tail.strip() else ""


def finite(cell: str, where: str) -> float:
    """Parse a finite number."""
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(
            f"{where}: {cell.strip()!r} is expected to be a finite number", file=where, value=cell
        )
    return number


def _uncommented(text: str, comments: dict[str, str]) -> Iterator[str]:
    """Yield the lines, with comments blanked; collect comments of the form ``key: value`` in `comments`."""
    for line in io.StringIO(text):
        bare = line.strip()
        if not bare.startswith("#"):
            yield line
            continue
        key, colon, value = bare.lstrip("#").partition(":")
        if colon and key.strip():
            comments[key.strip()] = value.strip()
        yield "\n"
