"""Measured tables of the pages: written by scripts, shown by pages, stale if code or hammer has changed."""

import ast
import functools
import importlib
import re
import runpy
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
MEASURE = DOCS / "measure"
SHOWN = re.compile(r"^```\{measured\} ([\w-]+)\n((?::\w+: .*\n)*)```$", re.MULTILINE)
FINGERPRINT = re.compile(r"(?:[0-9a-f]{16,64})?")
# What a room may import without its numbers depending on it.
SILENT = (
    "errors",
    "figures",
    "results",
    "studies/reconstruction/figures",
    "support/arguments",
    "support/arrays",
    "support/c_code",
    "support/constants",
    "support/files",
    "support/html",
    "support/tables",
    "support/threads",
    "units",
)


def module(name: str, folder: Path) -> Any:
    sys.path.insert(0, str(folder))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(folder))


measured = module("measured", MEASURE)
NAMES = measured.names()


def pages() -> dict[str, list[tuple[str, str]]]:
    return {
        str(page.relative_to(DOCS)): SHOWN.findall(page.read_text("utf-8"))
        for page in DOCS.rglob("*.md")
        if "gallery" not in page.parts
    }


@functools.cache
def imported(path: Path) -> set[str]:
    """Return the imports of a file from the package, the oracle or a study, as paths of rooms."""
    tree = ast.parse(path.read_text("utf-8"))
    for_types = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    return {
        node.module.removeprefix("printhammer.").replace(".", "/")
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom)
        and id(node) not in for_types
        and node.module is not None
        and node.module.startswith(("printhammer.", "studies.", "tests.oracle"))
    }


def test_pages_show_every_table_and_no_other() -> None:
    shown = [name for tables in pages().values() for name, _ in tables]
    assert sorted(set(shown)) == NAMES
    for page, tables in pages().items():
        text = (DOCS / page).read_text("utf-8")
        assert text.count("{measured}") == len(tables), page


def test_no_page_excuses_its_figures() -> None:
    for page in pages():
        text = " ".join((DOCS / page).read_text("utf-8").split())
        assert not re.search(r"before (?:the|its) last change|measured before", text), page


@pytest.mark.parametrize("name", NAMES)
def test_a_table_keeps_to_its_form(name: str) -> None:
    table = measured.read(name)
    assert (measured.FOLDER / f"{name}.json").read_text("utf-8") == measured.text_of(table)
    assert all(len(row) == len(table.columns) for row in table.rows)
    assert table.rows
    assert len({column.name for column in table.columns}) == len(table.columns)
    script = ROOT / table.script
    assert script.parent == MEASURE
    assert "write(" in script.read_text("utf-8")
    assert f'"{name}"' in script.read_text("utf-8")
    for mark in (table.code, *table.hammers.values()):
        assert FINGERPRINT.fullmatch(mark)
    # An unknown origin is that of code and hammers.
    assert all(bool(mark) == bool(table.code) for mark in table.hammers.values())
    assert measured.markdown(table.columns, table.rows).count("\n") == len(table.rows) + 1


@pytest.mark.parametrize("name", NAMES)
def test_the_rooms_of_a_table_are_all_that_it_depends_on(name: str) -> None:
    table = measured.read(name)
    files = [file for room in table.rooms for file in measured.files_of(room)]
    assert all(file.exists() for file in files)
    inside = (*table.rooms, *SILENT)
    outside = {
        path
        for file in files
        for path in imported(file)
        if not any(path == room or path.startswith(f"{room}/") for room in inside)
    }
    assert outside == set()


@pytest.mark.parametrize("script", sorted(MEASURE.glob("*.py")), ids=lambda path: path.stem)
def test_a_script_names_the_rooms_that_it_uses(script: Path) -> None:
    tables = [measured.read(name) for name in NAMES]
    rooms = {
        room for table in tables if table.script == f"docs/measure/{script.name}" for room in table.rooms
    }
    # Hammers of the family are known by their fingerprints.
    used = imported(script) - {"studies/reconstruction/family/family"}
    inside = rooms and all(any(path.startswith(room) for room in rooms) for path in used)
    # The scripts that write and draw tables compute none of their numbers.
    assert script.name in ("measured.py", "drawings.py") or inside


@pytest.mark.parametrize("script", sorted(MEASURE.glob("*.py")), ids=lambda path: path.stem)
def test_what_a_script_imports_is_there(script: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(MEASURE))
    monkeypatch.syspath_prepend(str(ROOT))
    assert runpy.run_path(str(script), run_name=f"docs.measure.{script.stem}")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package of one room."""
    (tmp_path / "room").mkdir()
    monkeypatch.setattr(measured, "SOURCES", tmp_path)
    return tmp_path / "room"


def digest(**files: str) -> str:
    measured._statements.cache_clear()
    for name, text in files.items():
        (measured.SOURCES / "room" / f"{name}.py").write_text(text, "utf-8")
    return str(measured.code_fingerprint(["room"]))


def test_words_and_places_do_not_change_the_fingerprint_of_code(package: Path) -> None:
    one = digest(
        law='"""A law."""\nimport math\nA = 2\n\ndef f(x):\n    """Return."""\n    return A * x**0.5\n'
    )
    assert one == digest(law="A = 2  # why\ndef f(x): return A*x**.5\n")
    raised = "def f(x):\n    raise ValueError({})\n"
    assert digest(error=raised.format("'a'")) == digest(error=raised.format("f'{x} is wrong'"))
    (package / "error.py").unlink()
    assert one == digest(law="A = 2\n", other="from room.law import A\n\ndef f(x):\n    return A * x**0.5\n")
    measured._statements.cache_clear()


@pytest.mark.parametrize(
    "changed", ["return A * x**0.6", "return A + x**0.5", "return A * y**0.5", "yield A * x**0.5"]
)
def test_a_change_of_the_computation_changes_it(package: Path, changed: str) -> None:
    first = digest(law="def f(x):\n    return A * x**0.5\n")
    assert first != digest(law=f"def f(x):\n    {changed}\n")
    measured._statements.cache_clear()


def table(**changes: Any) -> Any:
    known = {
        "command": "docs/measure/accuracy.py",
        "hammers": {"hendriks-1983": measured.hammer_fingerprint("hendriks-1983")},
        "rooms": ["units"],
        "code": measured.code_fingerprint(["units"]),
        "settings": {},
        "columns": [measured.Column(name="error", unit="m", format=".1e"), measured.Column(name="ok")],
        "rows": [[1.2e-10, True], [None, False], ["none", None]],
    }
    return measured.Measured(**known | changes)


def test_what_makes_a_table_stale() -> None:
    assert table().stale() == []
    assert table(code="").stale() == ["its code was not recorded"]
    assert table(code="0" * 16).stale() == ["the code has changed"]
    assert table(hammers={"hendriks-1983": "0" * 64}).stale() == ["hendriks-1983 has changed"]
    assert table(hammers={"hendriks-1983-family-99": "0" * 64}).stale() == [
        "hendriks-1983-family-99 has changed"
    ]
    assert table(rooms=["no_such_room"]).stale() == ["the code has changed"]


def test_a_table_is_written_and_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(measured, "FOLDER", tmp_path)
    monkeypatch.setattr(measured, "ROOT", tmp_path)
    monkeypatch.setattr(sys, "argv", [str(tmp_path / "docs" / "measure" / "a.py"), "--step", "5"])
    written = table()
    settings = {"rates": (1.0, 2.0)}
    measured.write("a", written.columns, written.rows, settings, ("units",))
    found = measured.read("a")
    assert found.rows == written.rows
    assert (found.command, found.script) == ("docs/measure/a.py --step 5", "docs/measure/a.py")
    assert found.settings == {"rates": [1.0, 2.0]}
    assert found.stale() == []
    # A run with other settings leaves it, unless its code is unknown.
    measured.write("a", written.columns, [], {"rates": (3.0,)}, ("units",))
    assert measured.read("a") == found
    assert "kept" in capsys.readouterr().out
    (tmp_path / "a.json").write_text(measured.text_of(found.model_copy(update={"code": ""})), "utf-8")
    measured.write("a", written.columns, written.rows[:1], {"rates": (3.0,)}, ("units",))
    assert measured.read("a").rows == written.rows[:1]


def test_how_cells_are_shown() -> None:
    made = table()
    assert measured.markdown(made.columns, made.rows) == (
        "| error, m | ok |\n| --- | --- |\n| 1.2e-10 | yes |\n|  | no |\n| none |  |"
    )
    assert measured.shown(5e-7, measured.Column(name="", format=".0e")) == "5e-7"
    assert measured.shown(12, measured.Column(name="")) == "12"


@pytest.mark.slow  # the extension needs sphinx, which the fast tests do without
def test_a_page_chooses_columns_and_formats() -> None:
    chosen = module("measured_tables", DOCS / "_ext").chosen
    columns, rows = chosen(table(), "ok; error", "error = .3e")
    assert [column.name for column in columns] == ["ok", "error"]
    assert rows[0] == [True, 1.2e-10]
    assert measured.shown(rows[0][1], columns[1]) == "1.200e-10"
    with pytest.raises(ValueError, match="no column place, expected some of error; ok"):
        chosen(table(), "place", "")


@pytest.mark.slow  # the extension needs sphinx, which the fast tests do without
def test_a_page_says_where_a_table_comes_from() -> None:
    origin = module("measured_tables", DOCS / "_ext").origin
    made = table(code="0123456789abcdef")
    hammer = made.hammers["hendriks-1983"][:8]
    assert origin(made) == f"Measured with `docs/measure/accuracy.py`: hendriks-1983 {hammer}, code 01234567."
    assert "2 hammers, code 01234567" in origin(table(code="0123456789abcdef", hammers={"a": "1", "b": "2"}))
    assert "was not recorded" in origin(table(code=""))
