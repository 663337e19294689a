"""CSV tables before they mean anything."""

from pathlib import Path

import pytest
from tests.errors import refused

from printhammer.support.sheets import finite, read_sheet, sheet_of, split_heading

TEXT = '# by hand\n#rate: 1 MHz: sharp\n\ntime [us],x [um]\n # more\n0,"1"\n,\n1,2\n'


def test_rows_lines_and_comments(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("\ufeff" + TEXT, encoding="utf-8")
    sheet = read_sheet(path, "the table")
    assert sheet.rows == [(4, ["time [us]", "x [um]"]), (6, ["0", "1"]), (8, ["1", "2"])]
    assert sheet.comments == {"rate": "1 MHz: sharp"}
    assert [line for line, _cells in sheet_of(TEXT, "a", gaps=True).rows] == [4, 6, 7, 8]


@pytest.mark.parametrize(
    ("cell", "split"),
    [
        (" time [us] ", ("time", "us")),
        ("time", ("time", "")),
        ("time []", ("time", "")),
        ("time [us", ("time", "")),
        ("time [us] x", ("time", "")),
    ],
)
def test_headings(cell: str, split: tuple[str, str]) -> None:
    assert split_heading(cell) == split


def test_what_is_no_table(tmp_path: Path) -> None:
    with refused(None, file="none.csv"):
        read_sheet(tmp_path / "none.csv", "the table")
    (tmp_path / "a.csv").write_bytes(b"\xff")
    with refused(None, file="a.csv"):
        read_sheet(tmp_path / "a.csv", "the table")
    with refused("line 2"):
        sheet_of('t\n"1\n', "a")
    for cell in ("x", "", "nan", "inf"):
        with refused(None, cell, file="here"):
            finite(cell, "here")
    assert finite(" 1e-3 ", "here") == 1e-3
