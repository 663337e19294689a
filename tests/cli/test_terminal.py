"""Terminal output: all digits on a narrow terminal, unchanged file names, plain text in ASCII."""

import io
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from printhammer.cli.main import main
from printhammer.cli.screen import Column, facts, table
from printhammer.results.summary import Cells, styled

COLUMNS: tuple[Column[float], ...] = (
    Column("dot", int),
    Column("flight", lambda x: 1e-6 * x, "s"),
    Column("force", lambda x: 22.23 * x, "N"),
    Column("", lambda x: f"{styled('bad', 'lost')} on the way", left=True),
    Column("work", lambda x: 1e-3 * x, "J"),
)
ROWS = [1.0, 22.0, 333.0]


def shown(made: Any, width: int) -> str:
    file = io.StringIO()
    Console(file=file, width=width, emoji=False).print(made)
    return file.getvalue()


@given(st.integers(16, 120))
def test_no_digit_is_cut_off(width: int) -> None:
    text = shown(table(COLUMNS, ROWS), width)
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    words = text.split()
    for column in COLUMNS:
        if not column.left:
            values = [column.value(row) for row in ROWS]
            assert set(Cells(column.heading, values, column.unit).texts("si")) <= set(words)


def test_a_narrow_terminal_gets_parts_that_begin_alike() -> None:
    lines = [line.split() for line in shown(table(COLUMNS, ROWS), 30).splitlines()]
    assert [line[0] for line in lines if line and line[0].isdigit()] == ["1", "22", "333"] * 2
    assert [] in lines
    wide = [line.split() for line in shown(table(COLUMNS, ROWS), 80).splitlines()]
    assert [line[0] for line in wide if line[0].isdigit()] == ["1", "22", "333"]


def test_long_words_of_facts_are_folded() -> None:
    name = "a_file_with_a_very_long_name_indeed.toml"
    text = shown(facts([("written", name)]), 30)
    assert "".join(text.split()) == f"written{name}"


@pytest.mark.parametrize("name", [":smile:.json", "[red]schema.json", "[bold].json", "x[/red].json"])
def test_names_of_files_are_shown_as_they_are(
    cli: Callable[..., Any], refused: Callable[..., None], tmp_path: Path, name: str
) -> None:
    (tmp_path / name).parent.mkdir(exist_ok=True)
    refused("run", name, said=f"printhammer: {name}: there is no such file")
    assert f"wrote {name}" in cli("hammer", "schema", "--out", name).out


def stream(monkeypatch: pytest.MonkeyPatch, name: str, encoding: str) -> io.BytesIO:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, name, io.TextIOWrapper(raw, encoding=encoding, write_through=True))
    return raw


def test_an_output_of_ascii_gets_plain_text(monkeypatch: pytest.MonkeyPatch) -> None:
    out, err = stream(monkeypatch, "stdout", "ascii"), stream(monkeypatch, "stderr", "ascii")
    with pytest.raises(SystemExit, match="0"):
        main(["hammer", "show", "hendriks-1983-1"])
    assert b"0.41 um deep in the backstop" in out.getvalue()
    with pytest.raises(SystemExit, match="2"):
        main(["hammer", "show", "caf\N{LATIN SMALL LETTER E WITH ACUTE}-\N{GREEK SMALL LETTER OMEGA}.toml"])
    assert err.getvalue().startswith(b"printhammer: cafe\\u0301-\\u03c9.toml: there is no such file")


def test_a_name_of_other_bytes_can_be_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    err = stream(monkeypatch, "stderr", "utf-8")
    with pytest.raises(SystemExit, match="2"):
        main(["hammer", "show", "\udcff.toml"])
    assert err.getvalue().startswith(b"printhammer: \\udcff.toml: there is no such file")
