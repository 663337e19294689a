import json
from pathlib import Path
from typing import Any

import pytest

from printhammer.errors import InputError
from printhammer.reconstruction.family import promising
from printhammer.reconstruction.family_log import read_logs, stated

GOOD = {"constants": {"mass": 4e-4}, "verdicts": {"geometry": True, "settle_out": False}, "panels": 9}


def log(folder: Path, *rows: Any, tail: str = "") -> Path:
    path = folder / "search.jsonl"
    path.write_text("".join(json.dumps(row) + "\n" for row in rows) + tail, encoding="utf-8")
    return path


def test_a_log_is_read_but_for_what_is_no_hammer_and_a_line_that_breaks_off(tmp_path: Path) -> None:
    path = log(tmp_path, {"format": 1, "seed": 7}, GOOD, tail='{"constants": {"ma')
    (found,) = read_logs([path])
    assert found.constants == {"mass": 4e-4}
    assert found.panels == 9
    assert found.promising
    assert found.source == f"{path}, line 2"


def test_the_last_word_on_a_hammer_counts(tmp_path: Path) -> None:
    (found,) = read_logs([log(tmp_path, GOOD, {**GOOD, "panels": 5})])
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


def test_the_stated_claims_are_those_of_the_paper_outside_figure_11() -> None:
    assert stated() == [
        "geometry",
        "return_from_everywhere",
        "single_pulse_stroke",
        "two_pulses_660us",
        "two_pulses_700us",
        "second_dot_lost",
        "integrator_comparison",
    ]


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ([1], "line 1: expected a JSON object, not '[1]'"),
        ({**GOOD, "constants": {}}, "line 1: constants = {}, expected keys"),
        (
            {**GOOD, "constants": {"mass": "4 g"}},
            "line 1: constants.mass = '4 g', expected a finite number in SI",
        ),
        ({**GOOD, "constants": {"mass": True}}, "line 1: constants.mass = True, expected"),
        ({**GOOD, "verdicts": [1]}, "line 1: verdicts = [1], expected claims"),
        ({**GOOD, "verdicts": {"speed": True}}, "line 1: verdicts.speed is not known"),
        (
            {**GOOD, "verdicts": {"geometry": "holds"}},
            "line 1: verdicts.geometry = 'holds', expected true or false",
        ),
        ({**GOOD, "panels": 8.5}, "line 1: panels = 8.5, expected a whole number"),
    ],
)
def test_bad_lines_are_told(tmp_path: Path, row: Any, said: str) -> None:
    path = log(tmp_path, row, GOOD)
    with pytest.raises(InputError) as error:
        read_logs([path])
    assert f"{path}, {said}" in str(error.value)


def test_a_broken_line_in_the_middle_and_a_missing_file_are_told(tmp_path: Path) -> None:
    path = tmp_path / "broken.jsonl"
    path.write_text("{\n" + json.dumps(GOOD) + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"line 1: expected a JSON object, not '\{'"):
        read_logs([path])
    with pytest.raises(InputError, match="the log cannot be read"):
        read_logs([tmp_path / "none.jsonl"])


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
