"""Text of table files: encodings, line ends, comments, and cells.

Blank lines are skipped. Lines that begin with #, or with ; (sigrok) or % (Matlab), are comments; a comment
such as ``# sampling rate: 1 MHz`` is stored as key and text. A row whose first cell is an error value of a
spreadsheet, such as #N/A, is not a comment.

Cells are classified as numbers, gaps or out-of-range readings; decimal marks and thousands separators are
converted.
"""

from __future__ import annotations

import csv
import gc
import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from printhammer.errors import InputError
from printhammer.support.files import listeners

_LONG: Final = 4_000_000  # Characters of a table that takes a second or more to parse; arbitrary
_FAULT: Final = r"#(?:#+|N/A|NUM!|VALUE!|DIV/0!|REF!|NAME\?|NULL!|WERT!|ZAHL!|NV)\s*[,;|\t]"
_COMMENT: Final = re.compile(rf"\s*((?!{_FAULT})#|//|[%;]\s*[^\W\d_][^;]*$)")


@dataclass(frozen=True)
class Cells:
    """Cells of a table, with the line number of each row."""

    where: str
    """Name of the file, for error messages."""
    rows: list[tuple[int, list[str]]]
    """Rows: line number in the file, counted from 1, and cells."""
    comments: dict[str, str]
    """Comments of the form ``# key: value``; the last comment with a key replaces earlier comments."""
    notes: list[tuple[int, str]]
    """Line number and text of every comment."""


@contextmanager
def paused_collector() -> Iterator[None]:
    """Pause the cyclic garbage collector, which would double the time to build a million rows of cells."""
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            gc.enable()


def read_cells(path: Path, what: str, *, gaps: bool = False) -> Cells:
    """Read a CSV file as cells; `what` names the file in messages, such as "the force table".

    With `gaps`, a row that has only empty cells is kept.

    Raises
    ------
    InputError
        The file cannot be read, or does not contain comma-separated values.
    """
    return split_cells(read_any(path, what), str(path), gaps=gaps)


def read_any(path: Path, what: str) -> str:
    """Read a text file in UTF-8, UTF-16 or Windows-1252; line ends become line feeds."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file", file=path, expected=what) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: {what} cannot be read ({reason})", file=path) from None
    text = decoded(content, str(path))
    if len(text) > _LONG:
        for tell in listeners:
            tell(f"reading {path.name}: {text.count(chr(10)):,} lines")
    return text


def decoded(content: bytes, where: str) -> str:
    """Decode the bytes of a text file in the encodings that `read_any` accepts."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    elif b"\0" in content[:200]:
        encoding = "utf-16-be" if content[0] == 0 else "utf-16-le"
    else:
        encoding = "utf-8-sig"
    text = ""
    for each in (encoding, "cp1252"):
        with suppress(UnicodeDecodeError):
            text = content.decode(each)
            break
    if "\0" in text or bool(content) > bool(text):
        raise InputError(f"{where}: the file is not text", file=where, expected="a table of numbers as text")
    return with_line_ends(text)


def with_line_ends(text: str) -> str:
    """Convert all line ends, CR LF, LF CR or CR, to line feeds."""
    if "\r" not in text:
        return text
    text = text.replace("\r\r\n", "\n")
    first = re.search(r"[\r\n]+", text)
    pairs = ("\n\r", "\r\n") if first and first.group().startswith("\n\r") else ("\r\n", "\n\r")
    for pair in pairs:
        text = text.replace(pair, "\n")
    return text.replace("\r", "\n")


def split_cells(text: str, where: str, *, gaps: bool = False, delimiter: str = ",") -> Cells:
    """Split the text of a table into cells; a space as separator stands for any white space."""
    comments: dict[str, str] = {}
    notes: list[tuple[int, str]] = []
    lines = _without_comments(text, comments, notes)
    if delimiter == " ":
        lines = (spaced(line) + "\n" for line in lines)
    reader = csv.reader(lines, strict=True, delimiter=delimiter, skipinitialspace=True)
    rows = []
    try:
        for row in reader:
            if any(map(str.strip, row)) or (gaps and len(row) > 1):
                rows.append((reader.line_num, row))  # noqa: PERF401
    except csv.Error as error:
        raise InputError(
            f"{where}: line {reader.line_num}: expected comma-separated values ({error})",
            file=where,
            key=f"line {reader.line_num}",
        ) from None
    return Cells(where, rows, comments, notes)


def spaced(line: str) -> str:
    """Collapse white space in a line; remove white space between a name and its unit in brackets."""
    return " ".join(re.sub(r"\s+(?=[\[(])", "", line).split())


def _without_comments(text: str, comments: dict[str, str], notes: list[tuple[int, str]]) -> Iterator[str]:
    """Yield the lines of a text, with empty lines in place of comments.

    Comments with a key are stored in `comments`; line number and text of every comment are appended to
    `notes`.
    """
    for number, line in enumerate(io.StringIO(text), 1):
        if not _COMMENT.match(line):
            yield line
            continue
        bare = line.strip().lstrip("#%;/").strip()
        notes.append((number, bare))
        key, colon, value = bare.partition(":")
        if colon and key.strip():
            comments[key.strip()] = value.strip()
        yield "\n"


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
    """Rewrite the numbers in rows with a decimal point and without thousands separators.

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
