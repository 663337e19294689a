"""Tests of the evaluation of candidates by the claims, and of the log of judged candidates."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from studies.reconstruction.judging import judged as module
from studies.reconstruction.judging.judged import FIGURE_11, SLOW, STATED, plain_panels, row_of, text_of
from studies.reconstruction.judging.log import joined, key_of, mend, read_judged
from studies.reconstruction.lines import append
from studies.reconstruction.search.space import hammer_of
from studies.reconstruction.tests.samples import constants_in
from tests.hammers import CRUDE

from printhammer.chaos import strobe
from printhammer.claims import Context, claims, judge
from printhammer.claims.verdicts import poincare, printed_verdicts
from printhammer.errors import InputError

QUICK = ("geometry", "single_pulse_stroke", "release_margin", "two_pulses_660us", "print_force")
ROW: dict[str, Any] = {
    "constants": {"mass": 1e-3},
    "verdicts": {"geometry": True},
    "values": {"geometry": {"backstop_m": 5e-5}},
    "panels": 7,
    "panel_verdicts": {"1.35 ms": "strange"},
}


def test_claims_of_the_lists_are_those_of_the_paper() -> None:
    assert all(claims()[name].kind == "stated" for name in STATED)
    stated = {name for name, claim in claims().items() if claim.kind == "stated"}
    assert stated - set(STATED) == {FIGURE_11}
    assert STATED == (
        "geometry",
        "return_from_everywhere",
        "single_pulse_stroke",
        "two_pulses_660us",
        "two_pulses_700us",
        "second_dot_lost",
        "integrator_comparison",
    )
    assert set(SLOW) < set(claims())


def test_a_row_has_the_verdicts_and_values_of_the_claims() -> None:
    constants = constants_in(CRUDE)
    row = row_of(constants, QUICK, panels=False)
    context = Context(hammer_of(constants))
    for name in QUICK:
        result = judge(context, claims()[name])
        assert row["verdicts"][name] == (result.verdict == "holds")
        assert set(row["values"][name]) == set(claims()[name].band)
        for key, value in row["values"][name].items():
            assert result.value is not None
            assert value == result.value[key]
    assert row["constants"] == constants
    assert row["panels"] is None
    assert FIGURE_11 not in row["verdicts"]


def test_a_claim_that_cannot_be_measured_fails_without_values() -> None:
    # The magnet is so strong that no current releases the armature.
    constants = constants_in(CRUDE)
    constants["magnet.Am"] *= 3.0
    row = row_of(constants, ["settle_out", "print_force"], panels=False)
    assert row["verdicts"] == {"settle_out": False, "print_force": False}
    assert row["values"] == {"settle_out": {}, "print_force": {}}


@pytest.mark.parametrize(("wrong", "robust"), [(0, True), (0, False), (1, True)])
def test_figure_11_is_judged_with_all_its_changes_only_where_it_may_hold(
    monkeypatch: pytest.MonkeyPatch, wrong: int, robust: bool
) -> None:
    printed = ["period-2", *["strange"] * 11]
    found = {f"{k}": ("period-3" if k < wrong else name, name) for k, name in enumerate(printed)}
    asked = []

    class Verdict:
        verdict = "holds" if robust else "fails"

    def judged(_context: Any, claim: Any) -> Verdict:
        asked.append(claim.name)
        return Verdict()

    monkeypatch.setattr(module, "plain_panels", lambda _hammer: found)
    monkeypatch.setattr(module, "judge", judged)
    row = row_of(constants_in(CRUDE), [FIGURE_11])
    assert row["panels"] == 12 - wrong
    assert row["panel_verdicts"]["1"] == "strange"
    assert row["verdicts"] == {FIGURE_11: robust and not wrong}
    assert asked == ([] if wrong else [FIGURE_11])


@pytest.mark.slow
def test_panels_are_those_of_the_strobe(monkeypatch: pytest.MonkeyPatch) -> None:
    period = 1.30e-3
    monkeypatch.setattr(module, "printed_verdicts", lambda: {period: "period-1"})
    hammer = hammer_of(constants_in(CRUDE))
    ((name, (found, printed)),) = plain_panels(hammer).items()
    verdict = strobe(hammer, period=period, points=1).verdict
    assert name == "1.30 ms"
    assert printed == "period-1"
    assert verdict is not None
    assert found == verdict.name


def test_rows_are_lines_of_json_and_come_back(tmp_path: Path) -> None:
    path = tmp_path / "judged.jsonl"
    assert read_judged(path) == []
    append(path, text_of(ROW))
    append(
        path,
        text_of({**ROW, "constants": {"mass": 2e-3}, "values": {"geometry": {"platen_m": np.float64(3.0)}}}),
    )
    first, second = read_judged(path)
    assert first == ROW
    assert second["values"] == {"geometry": {"platen_m": 3.0}}
    assert path.read_text().count("\n") == 2
    assert text_of(ROW).endswith("}\n")


def test_a_candidate_comes_once_with_all_that_is_known_of_it(tmp_path: Path) -> None:
    path = tmp_path / "judged.jsonl"
    other = {**ROW, "constants": {"mass": 2e-3}}
    later = {**ROW, "verdicts": {"settle_out": False}, "values": {"settle_out": {}}, "panels": None}
    for row in (ROW, other, later):
        append(path, text_of(row))
    first, second = read_judged(path)
    assert second == other
    assert first["verdicts"] == {"geometry": True, "settle_out": False}
    assert first["values"] == {**ROW["values"], "settle_out": {}}
    assert first["panels"] == 7
    assert joined(None, ROW) is ROW
    # The last verdict on a claim counts.
    assert joined(ROW, {**ROW, "verdicts": {"geometry": False}})["verdicts"] == {"geometry": False}


def test_a_line_that_breaks_off_is_left_out_and_cut_before_more_is_added(tmp_path: Path) -> None:
    path = tmp_path / "judged.jsonl"
    append(path, text_of(ROW))
    whole = path.read_bytes()
    path.write_bytes(whole + whole[:20])
    assert read_judged(path) == [ROW]
    assert path.read_bytes() == whole + whole[:20]
    mend(path)
    assert path.read_bytes() == whole
    mend(path)
    mend(tmp_path / "none.jsonl")
    assert path.read_bytes() == whole
    assert not (tmp_path / "none.jsonl").exists()


def test_the_order_of_constants_does_not_matter() -> None:
    assert key_of({"mass": 1.0, "magnet.F0": 2.0}) == key_of({"magnet.F0": 2.0, "mass": 1.0})
    assert key_of({"mass": 1.0}) != key_of({"mass": 2.0})


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ([1], "line 1: expected a judged candidate as a JSON object, not '\\[1\\]'"),
        ({**ROW, "constants": None}, "constants = None, expected the constants"),
        ({**ROW, "constants": {}}, "constants = {}, expected the constants"),
        ({**ROW, "constants": {"mass": "4 g"}}, "constants.mass = '4 g', expected a finite number"),
        ({**ROW, "constants": {"mass": float("nan")}}, "constants.mass = nan, expected a finite number"),
        ({**ROW, "verdicts": None}, "verdicts = None, expected those"),
        ({**ROW, "values": [1]}, "values = \\[1\\], expected those"),
        ({**ROW, "verdicts": {"speed": True}}, "verdicts.speed is not known"),
        ({**ROW, "verdicts": {"geometry": "holds"}}, "verdicts.geometry = 'holds', expected true or false"),
        ({**ROW, "values": {"speed": {}}}, "values.speed is not known"),
        ({**ROW, "panels": 7.5}, "panels = 7.5, expected a whole number"),
    ],
)
def test_bad_lines_are_told_in_one_sentence(tmp_path: Path, row: Any, said: str) -> None:
    path = tmp_path / "judged.jsonl"
    path.write_text(json.dumps(row) + "\n")
    with pytest.raises(InputError, match=said) as error:
        read_judged(path)
    assert str(error.value).startswith(f"{path}, line 1: ")
    assert "\n" not in str(error.value)


def test_a_log_in_which_there_must_be_some(tmp_path: Path) -> None:
    path = tmp_path / "judged.jsonl"
    for content in (None, "", text_of(ROW)[:20]):
        if content is not None:
            path.write_text(content)
        assert read_judged(path) == []
        with pytest.raises(
            InputError, match=r"judged\.jsonl: expected judged candidates, and there are none"
        ):
            read_judged(path, some=True)
    path.write_text(text_of(ROW))
    assert read_judged(path, some=True) == [ROW]


def test_files_that_cannot_be_read_or_written_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the file cannot be read"):
        read_judged(tmp_path)
    with pytest.raises(InputError, match="the file cannot be written"):
        append(tmp_path / "none" / "judged.jsonl", text_of(ROW))
    (tmp_path / "a.jsonl").write_bytes(b"\xff\xfe\n")
    with pytest.raises(InputError, match="not UTF-8"):
        read_judged(tmp_path / "a.jsonl")


@pytest.mark.slow
def test_panels_of_the_shipped_hammer_are_those_of_the_claim(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compare three of the twelve panels; all panels are judged in the same way."""
    claim, some = claims()[FIGURE_11], dict(list(printed_verdicts().items())[::4])
    claim = replace(claim, settings={"strobe_times_s": list(some)}, band={"verdicts": list(some.values())})
    monkeypatch.setattr(module, "printed_verdicts", lambda: some)
    hammer = hammer_of(constants_in(CRUDE))
    found = plain_panels(hammer)
    value = poincare(Context(hammer), claim).value
    assert value is not None
    for name, printed, whole in zip(found, some.values(), value["verdicts"], strict=True):
        assert found[name][1] == printed
        # The plain verdict is among the verdicts under all changes of constants and tolerance.
        assert found[name][0] in whole.split(" or ")
