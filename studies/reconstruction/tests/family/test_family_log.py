"""Tests of reading judged candidates as hammers of the family; `test_judged` covers invalid logs."""

import json
from pathlib import Path
from typing import Any

import pytest
from studies.reconstruction.family.family import promising
from studies.reconstruction.family.log import read_logs
from studies.reconstruction.judging.log import read_judged

from printhammer.errors import InputError

GOOD = {
    "constants": {"mass": 4e-4},
    "verdicts": {"geometry": True, "settle_out": False},
    "values": {},
    "panels": 9,
}


def log(folder: Path, *rows: Any, name: str = "judged") -> Path:
    path = folder / f"{name}.jsonl"
    path.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    return path


def test_hammers_come_in_the_order_of_the_files_with_where_they_are_from(tmp_path: Path) -> None:
    light = {**GOOD, "constants": {"mass": 1, "magnet.F0": 2.5}}
    paths = [log(tmp_path, GOOD, light), log(tmp_path, {**GOOD, "constants": {"mass": 7e-4}}, name="more")]
    first, second, third = read_logs(paths)
    assert [row.constants for row in (first, second, third)] == [
        {"mass": 4e-4},
        {"mass": 1.0, "magnet.F0": 2.5},
        {"mass": 7e-4},
    ]
    assert (first.panels, first.verdicts) == (9, GOOD["verdicts"])
    assert first.promising
    assert second.source == f"{paths[0]}, candidate 2"
    assert third.source == f"{paths[1]}, candidate 1"


def test_what_was_judged_later_does_not_hide_what_was_known(tmp_path: Path) -> None:
    # `judge --every-claim` logs only the new verdicts.
    later = {**GOOD, "verdicts": {"release_margin": True}, "panels": None}
    for paths in (
        [log(tmp_path, GOOD, later, name="both")],
        [log(tmp_path, GOOD), log(tmp_path, later, name="later")],
    ):
        (found,) = read_logs(paths)
        assert found.panels == 9
        assert found.verdicts == {"geometry": True, "settle_out": False, "release_margin": True}
        assert found.promising
        assert found.source == f"{paths[0]}, candidate 1"


def test_the_last_word_on_a_hammer_counts(tmp_path: Path) -> None:
    again = {**GOOD, "panels": 5}
    for paths in (
        [log(tmp_path, GOOD, again, name="both")],
        [log(tmp_path, GOOD), log(tmp_path, again, name="again")],
    ):
        (found,) = read_logs(paths)
        assert found.panels == 5
        assert not found.promising


@pytest.mark.parametrize(
    ("change", "promising_"),
    [
        ({"panels": 8}, True),
        ({"panels": 7}, False),
        ({"panels": None}, False),
        ({"verdicts": {}}, True),
        ({"verdicts": {"geometry": False}}, False),
        ({"verdicts": {"poincare": False, "settle_out": False, "print_force": False}}, True),
    ],
)
def test_only_stated_claims_and_panels_decide(tmp_path: Path, change: Any, promising_: bool) -> None:
    (found,) = read_logs([log(tmp_path, {**GOOD, **change})])
    assert found.promising == promising_


def test_what_is_no_log_is_told_as_wherever_one_is_read(tmp_path: Path) -> None:
    good = log(tmp_path, GOOD)
    bad = log(tmp_path, {**GOOD, "panels": 8.5}, name="bad")
    for path in (bad, tmp_path / "none.jsonl"):
        with pytest.raises(InputError) as one:
            read_judged(path, some=True)
        with pytest.raises(InputError) as error:
            read_logs([good, path])
        assert str(error.value) == str(one.value)
        assert str(path) in str(error.value)


def test_the_best_come_first_and_nearly_equal_ones_once_where_there_are_many(tmp_path: Path) -> None:
    rows = [
        {**GOOD, "constants": {"mass": 4e-4 * (1.0 + 1e-4 * number)}, "panels": 8 + number % 3}
        for number in range(30)
    ]
    logged = read_logs([log(tmp_path, *rows, {**GOOD, "constants": {"mass": 9e-4}})])
    found = promising(logged)
    assert [row.panels for row in found] == sorted((row.panels for row in logged), key=lambda n: -(n or 0))
    few = promising(logged, most=5)
    assert len(few) <= 5
    assert few[0].panels == 10
    assert any(row.constants["mass"] == 9e-4 for row in few)
