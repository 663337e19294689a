"""Table files: written tables are read back; invalid files are rejected with one sentence."""

import dataclasses
import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.control.table.by_hand import by_hand
from tests.errors import refused

from printhammer.control.table.compensation import CompensationTable, load_table
from printhammer.control.table.drive import COLUMNS, histories, number_of
from printhammer.control.table.formats import read_table


def same(one: CompensationTable, other: CompensationTable) -> bool:
    heads = ("hammer", "fingerprint", "gaps", "reach", "largest_current")
    return all(getattr(one, name) == getattr(other, name) for name in heads) and all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True)
        for name in ("rates", *COLUMNS, "deviation", "multiplier")
    )


def json_text(table: CompensationTable) -> str:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "table.json"
        table.save(path)
        return path.read_text("utf-8")


@pytest.mark.parametrize("suffix", [".csv", ".json"])
def test_read_back_from_disk(suffix: str, tmp_path: Path) -> None:
    table = by_hand()
    table.save(tmp_path / f"table{suffix}")
    assert same(load_table(tmp_path / f"table{suffix}"), table)


@given(
    gaps=st.integers(1, 3),
    reach=st.integers(1, 3),
    late=st.floats(-1e-4, 1e-4),
    form=st.sampled_from([(".csv", CompensationTable.to_csv), (".json", json_text)]),
)
@settings(max_examples=30, deadline=None)
def test_read_back_to_the_last_bit(gaps: int, reach: int, late: float, form: Any) -> None:
    table = by_hand(gaps=gaps, reach=reach)
    table = by_hand(gaps=gaps, reach=reach, advance=table.advance + late / 3.0)
    suffix, text = form
    assert same(CompensationTable(**read_table(text(table), suffix)), table)


@pytest.mark.parametrize(
    ("before", "after", "key"),
    [
        (
            "# printhammer compensation table, format 1",
            "# format 7",
            "first, value=line",
        ),
        ("# gaps = 2", "# gaps = 9", "history"),
        ("# gaps = 2", "# gapes = 2", "gapes"),
        ("# reach = 2", "# reach = two", "reach"),
        ("# reach = 2", '# reach = "2"', "reach"),
        ("# reach = 2\n", "", "reach"),
        ("# reach = 2", "# reach = 2\n# reach = 2", "reach"),
        ("largest_current = 2.0", "largest_current = -1", "largest_current"),
        ("rate [Hz],gap 1", "rate [kHz],gap 1", "columns"),
        ("800.0,rest,rest", "-800.0,rest,rest", "rate"),
        ("800.0,rest,rest", "fast,rest,rest", "rate"),
        ("800.0,1,rest", "800.0,7,rest", "row 2: gap"),
        ("800.0,1,rest", "800.0,rest,1", "row 2: gaps"),
        ("800.0,1,rest", "800.0,rest,rest", "history"),
        ("800.0,1,rest,", "800.0,1,rest,1.0,", "row"),
    ],
)
def test_bad_csv(before: str, after: str, key: str) -> None:
    text = by_hand().to_csv()
    assert before in text
    with refused(key):
        read_table(text.replace(before, after, 1), ".csv")


@pytest.mark.parametrize(
    ("key", "value", "wrong_key"),
    [
        ("hammer", 5, "hammer"),
        ("reach", None, "reach"),
        ("columns", {}, "rate"),
        ("columns", 3, "columns"),
    ],
)
def test_bad_json_of_a_result(key: str, value: object, wrong_key: str, tmp_path: Path) -> None:
    path = tmp_path / "table.json"
    by_hand().save(path)
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    with refused(wrong_key):
        load_table(path)


@pytest.mark.parametrize(
    ("name", "value", "key"),
    [
        ("width", 3, "width"),
        ("width", {"values": [[1.0]]}, "columns"),
        ("width", {"values": [["wide"] * 7, [1.0] * 7]}, "width"),
        ("history", {"values": ["rest-1"] * 7}, "row 1: gaps"),
        ("surprise", {"values": []}, "surprise"),
    ],
)
def test_bad_arrays_in_json(name: str, value: object, key: str, tmp_path: Path) -> None:
    path = tmp_path / "table.json"
    by_hand().save(path)
    data = json.loads(path.read_text())
    data["columns"][name] = value
    path.write_text(json.dumps(data))
    with refused(key):
        load_table(path)


def test_a_missing_row() -> None:
    lines = by_hand().to_csv().splitlines(keepends=True)
    (row,) = (line for line in lines if line.startswith("800.0,1,1,"))
    with refused("history"):
        read_table("".join(line for line in lines if line != row), ".csv")


def test_a_table_without_rows() -> None:
    lines = by_hand().to_csv().splitlines(keepends=True)
    with refused("rows"):
        read_table("".join(line for line in lines if not line[0].isdigit()), ".csv")


@pytest.mark.parametrize(("text", "key"), [("{", "table"), ("[]", "columns"), ("null", "columns")])
def test_no_json_table(text: str, key: str) -> None:
    with refused(key):
        read_table(text, ".json")


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with refused(None, file="table.h"):
        load_table(tmp_path / "table.h")
    with refused(None, file="table.csv"):
        load_table(tmp_path / "table.csv")
    (tmp_path / "table.csv").write_bytes(b"\xff\xfe\x00")
    with refused(None, file="table.csv"):
        load_table(tmp_path / "table.csv")


def test_a_name_that_is_no_table(tmp_path: Path) -> None:
    with refused(None, file="table.txt"):
        by_hand().save(tmp_path / "table.txt")


def test_dataset() -> None:
    table = by_hand()
    chart = table.to_dataset()
    assert chart["width"].attrs["units"] == "s"
    assert chart.attrs["hammer_fingerprint"] == table.fingerprint
    assert chart["history"].values.tolist()[:2] == ["rest-rest", "1-rest"]
    column = number_of((1, 0), 2)
    assert np.array_equal(chart["advance"].sel(history="1-rest"), table.advance[:, column])


def test_the_header_compiles_and_says_the_same(tmp_path: Path) -> None:
    table = by_hand()
    table.save(tmp_path / "table.h")
    name = "printhammer_hendriks_1983_800_1000hz"
    lines = ['#include "table.h"', "#include <stdio.h>", "int main(void) {"]
    for history in histories(2, 2):
        gaps = ", ".join(f"{gap or 9}u" for gap in history)
        lines.append(f"  {{ unsigned gaps[2] = {{{gaps}}}; unsigned at = {name}_history(gaps);")
        lines.append(
            f'    printf("%u %d %d\\n", at, (int){name}_advance[1][at], (int){name}_width[1][at]); }}'
        )
    (tmp_path / "main.c").write_text("\n".join([*lines, "  return 0;", "}"]) + "\n")
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-o", "main", "main.c"]
    subprocess.run([*command, "-Wunused-const-variable=2"], cwd=tmp_path, check=True)
    told = subprocess.run([tmp_path / "main"], check=True, capture_output=True, text=True).stdout.split("\n")
    for line, history in zip(told, histories(2, 2), strict=False):
        column = number_of(history, 2)
        wanted = column, round(1e9 * table.advance[1, column]), round(1e9 * table.width[1, column])
        assert tuple(int(word) for word in line.split()) == wanted


def test_odd_names_make_a_header_all_the_same() -> None:
    text = dataclasses.replace(by_hand(), hammer='odd */ "name"\\\n', fingerprint="ab*/cd").to_header()
    assert "odd * /" in text
    assert "abcd" in text
    comments = text.count("/*")
    assert text.count("*/") == comments
