"""CSV files whose heading gives every column its unit: their lines, the cells of the heading, numbers."""

from __future__ import annotations

import csv
import io
import math
from typing import TYPE_CHECKING

from printhammer.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path


def read_rows(path: Path, what: str) -> list[tuple[int, list[str]]]:
    """Return the lines that carry cells, with their numbers; blank ones and those that begin with # do not.

    Parameters
    ----------
    path : Path
        The file, UTF-8, with or without a byte order mark.
    what : str
        What it is, for messages, such as "force table".

    Raises
    ------
    InputError
        The file cannot be read, or is no such text.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: the {what} is expected to be UTF-8 text") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: the {what} cannot be read ({reason})") from None
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        rows = [(reader.line_num, row) for row in reader]
    except csv.Error as error:
        raise InputError(f"{path}: expected comma-separated values ({error})") from None
    return [(line, row) for line, row in rows if "".join(row).strip() and not row[0].lstrip().startswith("#")]


def heading(cell: str) -> tuple[str, str]:
    """Return name and unit of a cell of the heading, ``force [N]``; an empty unit where it has none."""
    name, _, rest = cell.partition("[")
    unit, closed, tail = rest.partition("]")
    return name.strip(), unit.strip() if closed and not tail.strip() else ""


def number(cell: str, where: str) -> float:
    """Return the number in a cell.

    Raises
    ------
    InputError
        It is no finite number.
    """
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: {cell.strip()!r} is expected to be a finite number")
    return value
