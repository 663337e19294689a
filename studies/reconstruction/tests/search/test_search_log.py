"""Tests of reading the log of a search."""

import json
from pathlib import Path
from typing import Any

import pytest
from studies.reconstruction.search.log import read_search

from printhammer.errors import InputError

HEADING = {"format": 1, "aim": "stated", "seed": 4}


def candidate(place: float, total: float) -> dict[str, Any]:
    return {"point": [place], "total": total, "constants": {"mass": 1e-3 * (1.0 + total)}}


def log(folder: Path, *rows: Any, tail: str = "") -> Path:
    path = folder / "search.jsonl"
    path.write_text("".join(json.dumps(row) + "\n" for row in rows) + tail, encoding="utf-8")
    return path


def test_the_log_of_a_search_is_read_but_for_a_line_that_breaks_off(tmp_path: Path) -> None:
    rows = [candidate(0.1, 1.0), candidate(0.2, 2.0)]
    path = log(tmp_path, HEADING, *rows, tail='{"point": [0.')
    assert read_search(path) == (HEADING, rows)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "expected the log of a search, and there is nothing"),
        (
            b'{"aim": "shape", "seed": 4}\n',
            "line 1: aim = 'shape', expected one of stated, all, panels, buzz",
        ),
        (
            b'{"aim": ["all"], "seed": 4}\n',
            r"line 1: aim = \['all'\], expected one of stated, all, panels, buzz",
        ),
        (b'{"aim": "all", "seed": "4"}\n', "line 1: seed = '4', expected a whole number"),
        (b'{"aim": "all", "seed": true}\n', "line 1: seed = True, expected a whole number"),
        (b"{}\n", "line 1: expected the heading of the log of a search, not '{}'"),
        (b"[1]\n", "line 1: expected the heading"),
        (b"words\n", "line 1: expected the heading of the log of a search, not 'words'"),
        (json.dumps(HEADING).encode() + b"\n{}\n", "line 2: expected a candidate of the log of a search"),
        (json.dumps(HEADING).encode() + b"\n\n", "line 2: expected a candidate"),
        (b"\xff\xfe\n", "the log cannot be read \\(not UTF-8\\)"),
    ],
)
def test_what_is_no_log_of_a_search_is_told(tmp_path: Path, content: bytes, said: str) -> None:
    path = tmp_path / "log.jsonl"
    path.write_bytes(content)
    with pytest.raises(InputError, match=said) as error:
        read_search(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


def test_a_log_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the log cannot be read"):
        read_search(tmp_path / "none.jsonl")
    with pytest.raises(InputError, match="the log cannot be read"):
        read_search(tmp_path)
