"""Numbers as written in tables: decimal marks, thousands separators, gaps, and out-of-range readings."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from printhammer.errors import InputError

GAPS: Final = frozenset({"", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "1.#qnan", "-1.#ind"})
"""Cells that stand for a missing reading, in lower case."""

OVER: Final = frozenset({"inf", "-inf", "+inf", "infinity", "-infinity", "∞", "-∞", "1.#inf", "-1.#inf"})
"""Cells that stand for a reading beyond the range of an instrument, in lower case."""

_SPACES: Final = "'\u2019\u00a0\u202f"
_NUMBER: Final = re.compile(
    rf"[+-]?(\d+\.?\d*|\.\d+|\d*,\d+|\d{{1,3}}([.,{_SPACES}]\d{{3}})+([.,]\d*)?)([eE][+-]?\d+)?", re.ASCII
)
_GROUPED: Final = {
    mark: re.compile(rf"[+-]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+(\{other}\d*)?", re.ASCII)
    for mark, other in ((".", ","), (",", "."))
}


def is_number(cell: str) -> bool:
    """Whether a stripped cell is a finite number, with any decimal mark and thousands separators."""
    return _NUMBER.fullmatch(cell) is not None


def is_reading(cell: str) -> bool:
    """Whether a stripped cell is a number, a gap, or a reading out of range."""
    return is_number(cell) or cell.lower() in GAPS or cell.lower() in OVER


def with_points(
    where: str, text: str, separator: str, lines: Sequence[int], rows: list[list[str]]
) -> list[list[str]]:
    """Convert the numbers in rows to a decimal point and no thousands separators.

    Parameters
    ----------
    where, text, separator : str
        Name of the file, for messages; text of the file; separator of cells.
    lines, rows : list
        Line number and cells of each row.

    Raises
    ------
    InputError
        Decimal comma and decimal point both occur, or a number such as 1,234 is ambiguous.
    """
    dropped: dict[int, str | None] = dict.fromkeys(ord(mark) for mark in _SPACES if mark in text)
    if "," in (text if separator != "," else "".join(cell for row in rows for cell in row)):
        cells = ((line, cell.strip()) for line, row in zip(lines, rows, strict=True) for cell in row)
        marked = [(line, cell) for line, cell in cells if ("," in cell or "." in cell) and is_number(cell)]
        comma, point = (
            next((each for each in marked if mark in each[1] and not _GROUPED[mark].fullmatch(each[1])), None)
            for mark in ",."
        )
        if comma and point:
            raise _unclear(where, *max(comma, point), "the same decimal mark in all numbers")
        if comma:
            dropped |= {ord("."): None, ord(","): "."}
        elif (first := next((each for each in marked if "," in each[1]), None)) is not None:
            if point is None:
                raise _unclear(where, *first, "another number that shows the meaning of the mark")
            dropped[ord(",")] = None
    elif separator != ",":
        _check_groups(where, lines, rows)
    if not dropped:
        return rows
    return [[cell.translate(dropped) if is_number(cell.strip()) else cell for cell in row] for row in rows]


def _check_groups(where: str, lines: Sequence[int], rows: list[list[str]]) -> None:
    """Raise InputError for a column such as 999, 1.000, 1.001, whose points may be thousands separators."""
    for place in range(max(map(len, rows), default=0)):
        column = [
            (line, row[place].strip()) for line, row in zip(lines, rows, strict=True) if place < len(row)
        ]
        points = [each for each in column if "." in each[1]]
        if (
            points
            and any(cell.isdecimal() and cell != "0" for _line, cell in column)
            and any(cell.endswith("0") for _line, cell in points)
            and all(_GROUPED["."].fullmatch(cell) for _line, cell in points)
        ):
            raise _unclear(where, *points[0], "another number that shows the meaning of the mark")


def _unclear(where: str, line: int, cell: str, expected: str) -> InputError:
    return InputError(
        f"{where}: line {line}: the mark in {cell!r} may be a decimal mark or a thousands separator",
        file=where,
        key=f"line {line}",
        value=cell,
        expected=expected,
    )
