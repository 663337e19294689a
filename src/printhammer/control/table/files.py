"""Compensation tables as files: CSV and JSON, which are read back, and a C header for the firmware.

The format is described in docs/howto/tables.md. Times are in seconds with all their digits, so that what is
read back is the same table to the last bit; in the C header they are whole nanoseconds.
"""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.control.table.compensation import COLUMNS, CompensationTable
from printhammer.control.table.histories import (
    REST,
    checked_size,
    entries_of,
    gap_text,
    histories,
    number_of,
    plain,
    shared_numbers,
)
from printhammer.errors import InputError
from printhammer.support.constants import shown
from printhammer.support.outputs import write_dataset, write_file

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import xarray as xr

FORMAT: Final = 1
"""Version of the format."""

KIND: Final = "printhammer compensation table"
"""What the first line of a file says."""

SUFFIXES: Final = (".csv", ".json", ".h", ".nc")
"""What names of table files end in."""

_HEAD: Final = {"hammer": str, "fingerprint": str, "gaps": int, "reach": int, "largest_current": float}
_TIMES: Final = {name: f"{name} [s]" for name in COLUMNS}
_DEVIATION: Final = "deviation"


def save_table(table: CompensationTable, path: str | Path) -> None:
    """Write a table, whole or not at all; the end of the name tells how.

    Raises
    ------
    InputError
        The name ends in none of `SUFFIXES`, or the file cannot be written; what was there stays.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix == ".csv":
        write_file(target, csv_text(table))
    elif suffix == ".json":
        write_file(target, json_text(table))
    elif suffix == ".h":
        from printhammer.control.table.header import header_text

        write_file(target, header_text(table))
    elif suffix == ".nc":
        write_dataset(target, table_dataset(table))
    else:
        raise InputError(f"{target}: expected a name that ends in one of {', '.join(SUFFIXES)}")


def load_table(path: str | Path) -> CompensationTable:
    """Read a compensation table that was written as CSV or JSON.

    Parameters
    ----------
    path : str or Path
        Its file.

    Returns
    -------
    CompensationTable
        The same, to the last bit.

    Raises
    ------
    InputError
        The file cannot be read or is no such table; the sentence names file, key, value and what was
        expected.
    """
    target = Path(path)
    if target.suffix.lower() not in (".csv", ".json"):
        raise InputError(f"{target}: expected a table whose name ends in .csv or .json")
    try:
        text = target.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{target}: the table is expected to be UTF-8 text") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{target}: the table cannot be read ({reason})") from None
    return read_table(text, target.suffix.lower(), name=str(target))


def read_table(text: str, suffix: str, *, name: str = "table") -> CompensationTable:
    """Read the text of a table; `name` stands in messages.

    Raises
    ------
    InputError
        As for `load_table`.
    """
    try:
        head, rows = _of_json(text) if suffix == ".json" else _of_csv(text)
        return _built(head, rows)
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def table_dataset(table: CompensationTable) -> xr.Dataset:
    """Return a table as a Dataset over `rate` [Hz] and `history`, the gaps as text such as "1-2-rest"."""
    import xarray as xr

    from printhammer import __version__

    every = histories(table.gaps, table.reach)
    numbers = [number_of(history, table.reach) for history in every]
    meanings = {
        "advance": "how long before its slot a dot is fired",
        "width": "width of its pulse",
        "brake_delay": "from the slot of the dot before to the brake pulse",
        "brake_width": "width of the brake pulse, 0 for none",
    }
    data: dict[str, Any] = {
        name: (("rate", "history"), getattr(table, name)[:, numbers], {"units": "s", "long_name": meaning})
        for name, meaning in meanings.items()
    }
    note = {"units": "1", "long_name": "worst deviation where it was tuned, in parts of the limits"}
    data[_DEVIATION] = ("rate", "history"), table.deviation[:, numbers], note
    return xr.Dataset(
        data,
        coords={
            "rate": ("rate", table.rates, {"units": "Hz", "long_name": "slots per second"}),
            "history": (
                "history",
                np.array(["-".join(map(gap_text, row)) for row in every]),
                {"long_name": "gaps to the dots before in slots, the latest first"},
            ),
        },
        attrs={
            "title": f"compensation table for {table.hammer}",
            **_head(table),
            "printhammer": __version__,
        },
    )


def _head(table: CompensationTable) -> dict[str, Any]:
    return {
        "hammer": table.hammer,
        "fingerprint": table.fingerprint,
        "gaps": table.gaps,
        "reach": table.reach,
        "largest_current": table.largest_current,
    }


def _rows(table: CompensationTable) -> list[dict[str, Any]]:
    found = []
    for row, rate in enumerate(table.rates.tolist()):
        for history in histories(table.gaps, table.reach):
            column = number_of(history, table.reach)
            values = {name: float(getattr(table, name)[row, column]) for name in COLUMNS}
            known = float(table.deviation[row, column])
            found.append(
                {
                    "rate": rate,
                    "gaps": [gap_text(gap) for gap in history],
                    **values,
                    _DEVIATION: None if np.isnan(known) else known,
                }
            )
    return found


def csv_text(table: CompensationTable) -> str:
    """Return a table as CSV: what it is about in lines that begin with "#", then a row an entry."""
    lines = io.StringIO()
    lines.write(f"# {KIND}, format {FORMAT}\n")
    for key, value in _head(table).items():
        lines.write(f"# {key} = {json.dumps(value, ensure_ascii=False)}\n")
    writer = csv.writer(lines, lineterminator="\n")
    writer.writerow(_columns(table.gaps))
    for row in _rows(table):
        times = [repr(row[name]) for name in COLUMNS]
        known = "" if row[_DEVIATION] is None else repr(row[_DEVIATION])
        writer.writerow([repr(row["rate"]), *row["gaps"], *times, known])
    return lines.getvalue()


def json_text(table: CompensationTable) -> str:
    """Return a table as JSON."""
    entries = [
        {
            "rate": row["rate"],
            "gaps": row["gaps"],
            **{name: row[name] for name in COLUMNS},
            _DEVIATION: row[_DEVIATION],
        }
        for row in _rows(table)
    ]
    head = {"kind": KIND, "format": FORMAT, "units": {"rate": "Hz", **dict.fromkeys(COLUMNS, "s")}}
    return json.dumps({**head, **_head(table), "entries": entries}, indent=1, ensure_ascii=False) + "\n"


def _columns(gaps: int) -> list[str]:
    return ["rate [Hz]", *[f"gap {number}" for number in range(1, gaps + 1)], *_TIMES.values(), _DEVIATION]


def _of_csv(text: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Read head and rows of a CSV file."""
    lines = text.splitlines()
    if not lines or lines[0].strip() != f"# {KIND}, format {FORMAT}":
        first = shown(lines[0] if lines else "")
        raise InputError(f"first line = {first}, expected '# {KIND}, format {FORMAT}'")
    head: dict[str, Any] = {}
    body = []
    for line in lines[1:]:
        if not line.startswith("#"):
            body.append(line)
            continue
        key, mark, value = line[1:].partition("=")
        if not mark:
            raise InputError(f"{shown(line)}: expected '# key = value'")
        if key.strip() in head:
            raise InputError(f"{key.strip()} is given twice, expected once")
        try:
            head[key.strip()] = json.loads(value)
        except ValueError:
            raise InputError(f"{key.strip()} = {shown(value.strip())}: expected a text or a number") from None
    _checked_head(head)
    wanted = _columns(head["gaps"])
    table = [row for row in csv.reader(body) if row]
    if not table or table[0] != wanted:
        raise InputError(
            f"columns = {shown(','.join(table[0]) if table else '')}, expected {','.join(wanted)}"
        )
    rows = []
    for number, cells in enumerate(table[1:], 1):
        if len(cells) != len(wanted):
            raise InputError(f"row {number}: {len(cells)} cells, expected {len(wanted)}")
        times = dict(zip(COLUMNS, cells[1 + head["gaps"] : -1], strict=True))
        rows.append(
            {
                "rate": _csv_number(cells[0], f"row {number}: rate"),
                "gaps": cells[1 : 1 + head["gaps"]],
                **{name: _csv_number(cell, f"row {number}: {name}") for name, cell in times.items()},
                _DEVIATION: _csv_number(cells[-1], f"row {number}: deviation") if cells[-1] else None,
            }
        )
    return head, rows


def _csv_number(text: str, where: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where} = {shown(text)}, expected a number") from None


def _of_json(text: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Read head and rows of a JSON file."""
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"expected JSON ({' '.join(str(error).split())})") from None
    if not isinstance(data, dict) or data.get("kind") != KIND:
        raise InputError(
            f"kind = {shown(data.get('kind') if isinstance(data, dict) else data)}, expected {KIND!r}"
        )
    if data.get("format") != FORMAT or isinstance(data["format"], bool):
        raise InputError(f"format = {shown(data.get('format'))}, expected {FORMAT}")
    units = {"rate": "Hz", **dict.fromkeys(COLUMNS, "s")}
    if data.get("units") != units:
        raise InputError(f"units = {shown(data.get('units'))}, expected {json.dumps(units)}")
    head = {key: value for key, value in data.items() if key not in ("kind", "format", "units", "entries")}
    _checked_head(head)
    entries = data.get("entries")
    if not isinstance(entries, list):
        raise InputError(f"entries = {shown(entries)}, expected a list")
    for number, entry in enumerate(entries, 1):
        where = f"entry {number}"
        if not isinstance(entry, dict):
            raise InputError(f"{where} = {shown(entry)}, expected an object")
        _same_keys(entry, ["rate", "gaps", *COLUMNS, _DEVIATION], f"{where}: ")
        for name in ("rate", *COLUMNS, _DEVIATION):
            if entry[name] is None and name == _DEVIATION:
                continue
            if isinstance(entry[name], bool) or not isinstance(entry[name], int | float):
                raise InputError(f"{where}: {name} = {shown(entry[name])}, expected a number")
    return head, entries


def _checked_head(head: Mapping[str, Any]) -> None:
    _same_keys(head, list(_HEAD), "")
    for key, kind in _HEAD.items():
        value = head[key]
        good = isinstance(value, int | float) if kind is float else isinstance(value, kind)
        if isinstance(value, bool) or not good:
            expected = {str: "a text", int: "a whole number", float: "a number"}[kind]
            raise InputError(f"{key} = {shown(value)}, expected {expected}")
    checked_size(head["gaps"], head["reach"])
    if not 0.0 < head["largest_current"] < np.inf:
        raise InputError(f"largest_current = {head['largest_current']!r} A, expected a positive number")


def _same_keys(given: Mapping[str, Any], wanted: Sequence[str], where: str) -> None:
    for key in given:
        if key not in wanted:
            raise InputError(f"{where}{shown(key)} is not known, expected one of {', '.join(wanted)}")
    for key in wanted:
        if key not in given:
            raise InputError(f"{where}{key} is missing")


def _built(head: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> CompensationTable:
    """Put the rows where they belong, each history at each rate exactly once."""
    gaps, reach = head["gaps"], head["reach"]
    for number, row in enumerate(rows, 1):
        if not (np.isfinite(row["rate"]) and row["rate"] > 0.0):
            raise InputError(f"row {number}: rate = {row['rate']!r} Hz, expected a positive number")
    rates = np.unique([float(row["rate"]) for row in rows])
    if not rates.size:
        raise InputError("the table has no rows, expected one for each history")
    shape = rates.size, entries_of(gaps, reach)
    arrays = {name: np.full(shape, np.nan) for name in (*COLUMNS, _DEVIATION)}
    seen = np.zeros(shape, np.bool_)
    for number, row in enumerate(rows, 1):
        history = _history(row["gaps"], gaps, reach, f"row {number}: ")
        place = int(np.searchsorted(rates, row["rate"])), number_of(history, reach)
        if seen[place]:
            raise InputError(f"row {number}: the history {'-'.join(map(gap_text, history))} is given twice")
        seen[place] = True
        for name, values in arrays.items():
            values[place] = np.nan if row[name] is None else row[name]
    for history in histories(gaps, reach):
        lacking = ~seen[:, number_of(history, reach)]
        if lacking.any():
            told = "-".join(map(gap_text, history))
            raise InputError(
                f"the history {told} at {rates[lacking][0]:g} Hz is missing, expected a row for it"
            )
    shared = shared_numbers(gaps, reach)
    return CompensationTable(
        hammer=head["hammer"],
        fingerprint=head["fingerprint"],
        rates=rates,
        gaps=gaps,
        reach=reach,
        largest_current=float(head["largest_current"]),
        **{name: values[:, shared] for name, values in arrays.items()},
    )


def _history(texts: Any, gaps: int, reach: int, where: str) -> tuple[int, ...]:
    if not isinstance(texts, list) or len(texts) != gaps:
        raise InputError(f"{where}gaps = {shown(texts)}, expected {gaps} of them")
    found = []
    for text in texts:
        known: Callable[[str], bool] = {gap_text(gap) for gap in range(reach + 1)}.__contains__
        if not isinstance(text, str) or not known(text):
            raise InputError(
                f"{where}gap = {shown(text)}, expected 'rest' or a whole number from 1 to {reach}"
            )
        found.append(REST if text == gap_text(REST) else int(text))
    if tuple(found) != plain(found):
        raise InputError(f"{where}gaps = {'-'.join(texts)}, expected only rest after a rest")
    return tuple(found)
