"""Compensation tables as CSV and JSON text: writer of the metadata, and parsers.

The formats are described in docs/howto/tables.md. Times are in seconds with all significant digits, so that
reading restores the table to the last bit.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.drive import (
    COLUMNS,
    REST,
    checked_size,
    entries_of,
    gap_text,
    histories,
    history_text,
    number_of,
    plain,
    shared_numbers,
)
from printhammer.errors import InputError
from printhammer.support.constants import shown
from printhammer.support.tables.text import split_cells

if TYPE_CHECKING:
    Head = dict[str, Any]
    Rows = list[dict[str, Any]]

FORMAT: Final = 1  # Version of the CSV format
KIND: Final = "printhammer compensation table"  # First words of a CSV file
FIGURES: Final = ("deviation", "multiplier")
"""Names of the arrays that are not times; an empty cell is an unknown value."""
DEVIATION, MULTIPLIER = FIGURES
# Required metadata of a table file
HEAD: Final = {"hammer": str, "fingerprint": str, "gaps": int, "reach": int, "largest_current": float}
OPTIONAL: Final = {"driver": "own", "serial": ""}
"""Optional metadata of a table file, with default values."""
_FIRST: Final = f"# {KIND}, format {FORMAT}"
_ATTRIBUTE: Final = re.compile(r"# \w+: ")  # Provenance line of a CSV file


def columns(gaps: int) -> list[str]:
    """Return the column headings of a CSV file."""
    times = [f"{name} [s]" for name in COLUMNS]
    return ["rate [Hz]", *[f"gap {number}" for number in range(1, gaps + 1)], *times, *FIGURES]


def csv_head(head: Mapping[str, Any]) -> str:
    """Return the comment lines at the head of a CSV file: format and metadata."""
    said = [*HEAD, *(key for key, value in OPTIONAL.items() if head[key] != value)]
    lines = [_FIRST, *(f"# {key} = {json.dumps(head[key], ensure_ascii=False)}" for key in said)]
    return "\n".join(lines) + "\n"


def read_table(text: str, suffix: str) -> dict[str, Any]:
    """Parse a table file (suffix ".csv" or ".json") to the arguments of a `CompensationTable`.

    Raises
    ------
    InputError
        The text is not a valid table; the message names key, value and expectation.
    """
    head, rows = _of_json(text) if suffix == ".json" else _of_csv(text)
    return _built(head, rows)


def _of_csv(text: str) -> tuple[Head, Rows]:
    """Parse metadata and rows of a CSV file."""
    lines = text.splitlines()
    if not lines or lines[0].strip() != _FIRST:
        first = shown(lines[0] if lines else "")
        raise InputError(f"first line = {first}", key="first, value=line", expected=f"{_FIRST!r}")
    head: Head = {}
    for line in lines[1:]:
        if not line.startswith("#") or _ATTRIBUTE.match(line):
            continue
        key, mark, value = line[1:].partition("=")
        if not mark:
            raise InputError(f"{shown(line)}: expected '# key = value'", key="line", value=line)
        if key.strip() in head:
            raise InputError(f"{key.strip()} occurs twice", key=key.strip(), expected="once")
        try:
            head[key.strip()] = json.loads(value)
        except ValueError:
            raise InputError.of(
                key.strip(),
                value.strip(),
                "a text or a number",
                written=shown(value.strip()),
            ) from None
    _check_head(head)
    gaps, wanted = head["gaps"], columns(head["gaps"])
    table = [cells for _line, cells in split_cells(text, "table", gaps=True).rows]
    if table and table[0] == wanted[:-1]:
        # A file of an earlier version, without multipliers.
        table = [
            table[0] + wanted[-1:],
            *(cells + [""] * (len(cells) == len(wanted) - 1) for cells in table[1:]),
        ]
    if not table or table[0] != wanted:
        raise InputError.of(
            "columns",
            ",".join(table[0]) if table else "",
            ",".join(wanted),
            written=shown(",".join(table[0]) if table else ""),
        )
    rows = []
    for number, cells in enumerate(table[1:], 1):
        if len(cells) != len(wanted):
            raise InputError(f"row {number}: {len(cells)} cells", key="row", expected=f"{len(wanted)}")
        row: dict[str, Any] = {"gaps": cells[1 : 1 + gaps]}
        for name, cell in zip(("rate", *COLUMNS, *FIGURES), (cells[0], *cells[1 + gaps :]), strict=True):
            try:
                row[name] = float(cell) if cell or name not in FIGURES else None
            except ValueError:
                raise InputError.of(
                    name, cell, "a number", file=f"row {number}", written=shown(cell)
                ) from None
        rows.append(row)
    return head, rows


def _of_json(text: str) -> tuple[Head, Rows]:
    """Parse metadata and rows of a JSON file, which has the format of a saved result."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"expected JSON ({' '.join(str(error).split())})", key="table") from None
    if not isinstance(data, dict) or not isinstance(data.get("columns"), dict):
        columns = data.get("columns") if isinstance(data, dict) else data
        raise InputError.of("columns", columns, "the arrays of a table", written=shown(columns))
    head = {key: data[key] for key in (*HEAD, *OPTIONAL) if key in data}
    head |= {"fingerprint": data["hammer_fingerprint"]} if "hammer_fingerprint" in data else {}
    _check_head(head)
    entries = _entries(data["columns"])
    for number, entry in enumerate(entries, 1):
        for name in ("rate", *COLUMNS, *FIGURES):
            if entry[name] is None and name in FIGURES:
                continue
            if isinstance(entry[name], bool) or not isinstance(entry[name], int | float):
                raise InputError.of(
                    name, entry[name], "a number", file=f"entry {number}", written=shown(entry[name])
                )
    return head, entries


def _entries(arrays: Mapping[str, Any]) -> Rows:
    """Return the table entries of a JSON file, whose arrays have the dimensions rate and history."""
    wanted = ("rate", "history", *COLUMNS, *FIGURES)
    if MULTIPLIER not in arrays and isinstance(arrays.get(DEVIATION), dict):
        # A file of an earlier version, without multipliers.
        unknown = [[None] * len(row) for row in arrays[DEVIATION].get("values", [])]
        arrays = {**arrays, MULTIPLIER: {"values": unknown}}
    _check_keys(arrays, wanted, "columns: ")
    for name in wanted:
        if not isinstance(arrays[name], dict) or not isinstance(arrays[name].get("values"), list):
            raise InputError.of(
                name, arrays[name], "an array with its values", file="columns", written=shown(arrays[name])
            )
    rates, texts = arrays["rate"]["values"], arrays["history"]["values"]
    values = {name: arrays[name]["values"] for name in (*COLUMNS, *FIGURES)}
    for name, table in values.items():
        if [len(row) if isinstance(row, list) else None for row in table] != [len(texts)] * len(rates):
            raise InputError(
                f"columns: {name}: expected {len(rates)} rows of {len(texts)} numbers", key="columns"
            )
    return [
        {"rate": rate, "gaps": str(text).split("-"), **{name: values[name][i][j] for name in values}}
        for i, rate in enumerate(rates)
        for j, text in enumerate(texts)
    ]


def _check_head(head: Mapping[str, Any]) -> None:
    _check_keys({**OPTIONAL, **head}, [*HEAD, *OPTIONAL], "")
    for key, kind in (HEAD | dict.fromkeys(OPTIONAL, str)).items():
        if key not in head:
            continue
        value = head[key]
        good = isinstance(value, int | float) if kind is float else isinstance(value, kind)
        if isinstance(value, bool) or not good:
            expected = {str: "a text", int: "a whole number", float: "a number"}[kind]
            raise InputError.of(key, value, expected, written=shown(value))
    checked_size(head["gaps"], head["reach"])
    if not 0.0 < head["largest_current"] < np.inf:
        raise InputError.of("largest_current", head["largest_current"], "a positive number", unit="A")


def _check_keys(entry: Mapping[str, Any], wanted: Sequence[str], where: str) -> None:
    for key in entry:
        if key not in wanted:
            raise InputError(
                f"{where}{shown(key)} is not known", key=key, expected=f"one of {', '.join(wanted)}"
            )
    for key in wanted:
        if key not in entry:
            raise InputError(f"{where}{key} is missing", key=key)


def _built(head: Head, rows: Rows) -> dict[str, Any]:
    """Assemble the arrays of a table from rows; check that each history occurs once at each rate."""
    gaps, reach = head["gaps"], head["reach"]
    for number, row in enumerate(rows, 1):
        if not (np.isfinite(row["rate"]) and row["rate"] > 0.0):
            raise InputError.of("rate", row["rate"], "a positive number", file=f"row {number}", unit="Hz")
    rates = np.unique([float(row["rate"]) for row in rows])
    if not rates.size:
        raise InputError("the table has no rows", key="rows", expected="one for each history")
    shape = rates.size, entries_of(gaps, reach)
    arrays = {name: np.full(shape, np.nan) for name in (*COLUMNS, *FIGURES)}
    filled = np.zeros(shape, np.bool_)
    for number, row in enumerate(rows, 1):
        history = _history(row["gaps"], gaps, reach, f"row {number}: ")
        place = int(np.searchsorted(rates, row["rate"])), number_of(history, reach)
        if filled[place]:
            raise InputError(f"row {number}: the history {history_text(history)} occurs twice", key="history")
        filled[place] = True
        for name, values in arrays.items():
            values[place] = np.nan if row[name] is None else row[name]
    for history in histories(gaps, reach):
        lacking = ~filled[:, number_of(history, reach)]
        if lacking.any():
            raise InputError(
                f"the history {history_text(history)} at {rates[lacking][0]:g} Hz is missing",
                key="history",
                expected="a row for it",
            )
    shared = shared_numbers(gaps, reach)
    arguments = {**head, "largest_current": float(head["largest_current"])}
    return {**arguments, "rates": rates, **{name: values[:, shared] for name, values in arrays.items()}}


def _history(texts: Any, gaps: int, reach: int, where: str) -> tuple[int, ...]:
    if not isinstance(texts, list) or len(texts) != gaps:
        raise InputError.of(f"{where}gaps", texts, f"{gaps} gaps", written=shown(texts))
    known = {gap_text(gap): gap for gap in range(REST, reach + 1)}
    for text in texts:
        if not isinstance(text, str) or text not in known:
            raise InputError.of(
                f"{where}gap", text, f"'rest' or a whole number from 1 to {reach}", written=shown(text)
            )
    history = tuple(known[text] for text in texts)
    if history != plain(history):
        raise InputError.of(
            f"{where}gaps", "-".join(texts), "only rest after a rest", written=str("-".join(texts))
        )
    return history
