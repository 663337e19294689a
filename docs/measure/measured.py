"""Measured tables: written by the scripts in this folder, shown by the pages, and checked for staleness.

A table is a file ``docs/measured/NAME.json``. In addition to columns and rows, it contains the command
that produced it, the fingerprints of its hammers, and a fingerprint of the code on which the numbers
depend. A table is stale if one of the fingerprints has changed; ``.venv/bin/python
docs/measure/measured.py`` and ``make docs`` list the stale tables.

The code fingerprint is a digest of the syntax trees of the rooms that a script names: paths in
``src/printhammer``, or in the repository for rooms outside the package. File names, order, docstrings,
comments, imports and the text of errors do not affect the digest, so that code may move within these
rooms.
"""

from __future__ import annotations

import ast
import hashlib
import json
import re
import shlex
import sys
from functools import cache
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

import printhammer as ph
from printhammer.kernel.compile.bindings import syntax_text

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "measured"
SOURCES = ROOT / "src" / "printhammer"
# Scripts import the oracle of the tests and the studies.
sys.path.insert(0, str(ROOT))
MOTION = ("drive", "hammer", "kernel", "parts", "run", "support/roots")
"""Rooms on which every motion depends."""
OUTSIDE = ("studies/", "tests/")
"""Prefixes of the paths of rooms outside the package."""

Cell = bool | int | float | str | None
UNSEEN = (ast.Import, ast.ImportFrom)
UNCOUNTED = tuple(SOURCES / "kernel" / "compile" / name for name in ("cache.py", "records.py", "web"))
"""Modules on which no table depends: cache of machine code, messages of the compiler, WebAssembly."""


class Column(BaseModel):
    """Column of a table: name on the page, unit, and number format in Python's notation."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    unit: str = ""
    format: str = ""

    @property
    def head(self) -> str:
        """Heading of the column: name and unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


class Measured(BaseModel):
    """Measured table; an empty fingerprint means that it was not recorded."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    format: Literal[1] = 1
    command: str
    hammers: dict[str, str]
    rooms: list[str]
    code: str
    settings: dict[str, Any]
    columns: list[Column]
    rows: list[list[Cell]]

    @property
    def script(self) -> str:
        """Path of the script that produced the table."""
        return shlex.split(self.command)[0]

    def stale(self) -> list[str]:
        """Return the reasons for staleness; empty for a fresh table."""
        if not self.code:
            return ["its code was not recorded"]
        changed = ["the code"] if self.code != code_fingerprint(self.rooms) else []
        changed += [name for name, known in self.hammers.items() if known != hammer_fingerprint(name)]
        return [f"{what} has changed" for what in changed]


def write(
    name: str,
    columns: list[Column],
    rows: list[list[Cell]],
    settings: dict[str, Any],
    rooms: tuple[str, ...],
    hammers: tuple[str, ...] = ("hendriks-1983",),
) -> None:
    """Print a table and write it, unless a recorded table with other settings exists."""
    print(f"\n{markdown(columns, rows)}\n")
    path = FOLDER / f"{name}.json"
    settings = json.loads(json.dumps(settings))
    if path.exists() and (kept := read(name)).code and kept.settings != settings:
        print(f"{path.relative_to(ROOT)} is of other settings, {kept.settings}: kept")
        return
    script = Path(sys.argv[0]).resolve().relative_to(ROOT).as_posix()
    options = sys.argv[1:]
    if "--keep" in options:
        # The folder exists on one machine only and does not affect the numbers.
        at = options.index("--keep")
        options = options[:at] + options[at + 2 :]
    table = Measured(
        command=shlex.join([script, *options]),
        hammers={hammer: hammer_fingerprint(hammer) for hammer in hammers},
        rooms=sorted(rooms),
        code=code_fingerprint(rooms),
        settings=settings,
        columns=columns,
        rows=rows,
    )
    FOLDER.mkdir(exist_ok=True)
    path.write_text(text_of(table), "utf-8")
    print(f"{path.relative_to(ROOT)} written")


def text_of(table: Measured) -> str:
    """Return the JSON text of a table, with one line per row."""
    data = table.model_dump()
    parts = [f"  {json.dumps(key)}: {_value(key, value)}" for key, value in data.items()]
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _value(key: str, value: Any) -> str:
    if key not in ("columns", "rows"):
        return json.dumps(value, ensure_ascii=False)
    lines = [f"    {json.dumps(line, ensure_ascii=False, allow_nan=False)}" for line in value]
    return "[\n" + ",\n".join(lines) + "\n  ]"


def read(name: str) -> Measured:
    """Read a table."""
    return Measured.model_validate_json((FOLDER / f"{name}.json").read_text("utf-8"))


def names() -> list[str]:
    """Return the names of all tables."""
    return sorted(path.stem for path in FOLDER.glob("*.json"))


def markdown(columns: list[Column], rows: list[list[Cell]]) -> str:
    """Return a table in Markdown, as shown on a page."""
    lines = [[column.head for column in columns], ["---"] * len(columns)]
    lines += [[shown(cell, column) for cell, column in zip(row, columns, strict=True)] for row in rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def shown(cell: Cell, column: Column) -> str:
    """Return the text of a cell in the format of its column."""
    if cell is None or isinstance(cell, str):
        return cell or ""
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    return re.sub(r"e([+-])0*(?=\d)", lambda sign: "e" + sign[1].strip("+"), format(cell, column.format))


@cache
def hammer_fingerprint(name: str) -> str:
    """Return the current fingerprint of a shipped hammer or of a hammer of the family."""
    from studies.reconstruction.family.family import family_hammers

    if "-family-" in name:
        return next((hammer.fingerprint for hammer in family_hammers() if hammer.name == name), "none")
    return ph.load(name).fingerprint


@cache
def open_loop_rate(hammer: ph.Hammer) -> float:
    """Return the open-loop safe rate of a hammer, Hz, to whose multiples scripts measure drives."""
    return float(ph.safe_rate(hammer).rate)


def code_fingerprint(rooms: tuple[str, ...] | list[str]) -> str:
    """Return the code fingerprint of rooms, which are folders or modules."""
    found = sorted(statement for room in rooms for statement in _statements(room))
    return hashlib.sha256("\n".join(found).encode()).hexdigest()[:16]


def files_of(room: str) -> list[Path]:
    """Return the files of a room of the package or, for a path in `OUTSIDE`, of the repository."""
    path = (ROOT if room.startswith(OUTSIDE) else SOURCES) / room
    return sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]


@cache
def _statements(room: str) -> tuple[str, ...]:
    files = [file for file in files_of(room) if file.exists()]
    counted = [file for file in files if not any(map(file.is_relative_to, UNCOUNTED))]
    trees = [ast.parse(file.read_text("utf-8")) for file in counted]
    return tuple(text for tree in trees for node in tree.body if (text := syntax_text(node, _other_text)))


def _other_text(node: ast.AST) -> str | None:
    """Return the text of a node that counts in part or not at all; None for all other nodes."""
    if isinstance(node, UNSEEN) or _is_for_types(node):
        return ""
    if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
        return f"Raise({syntax_text(node.exc.func, _other_text)})"
    return None


def _is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def report() -> list[str]:
    """Return a line for each stale table."""
    tables = {name: read(name) for name in names()}
    return [
        f"stale table {name}: {', '.join(why)}; .venv/bin/python {table.command}"
        for name, table in tables.items()
        if (why := table.stale())
    ]


if __name__ == "__main__":
    print("\n".join(report()) or "no stale table")
