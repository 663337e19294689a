"""Tests of the shortlist of a search, whose candidates are judged only once."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from studies.reconstruction.judging import shortlist as module
from studies.reconstruction.judging.judged import FIGURE_11, STATED
from studies.reconstruction.judging.shortlist import judge_candidates, rounded, shortlist, standing

from printhammer.claims import claims
from printhammer.errors import InputError


def candidate(*point: float, total: float, constants: Any = None) -> dict[str, Any]:
    return {"point": list(point), "total": total, "constants": constants or {"mass": 1e-3 * (1.0 + total)}}


ROWS = st.lists(
    st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 5.0)).map(
        lambda drawn: candidate(drawn[0], drawn[1], total=drawn[2])
    ),
    max_size=30,
)


@settings(max_examples=50)
@given(ROWS, st.integers(1, 10), st.sampled_from([0.01, 0.1, 0.4]))
def test_the_best_that_are_not_next_to_each_other(
    rows: list[dict[str, Any]], count: int, apart: float
) -> None:
    chosen = shortlist(rows, count, apart)
    assert len(chosen) <= count
    totals = [row["total"] for row in chosen]
    assert totals == sorted(totals)
    points = [np.array(row["point"]) for row in chosen]
    for k, point in enumerate(points):
        assert all(np.abs(point - other).max() >= apart for other in points[:k])
    # An omitted candidate lies close to a better candidate, or ranks below the last.
    for row in rows:
        if row not in chosen and len(chosen) < count:
            better = [one for one in chosen if one["total"] <= row["total"]]
            assert any(np.abs(np.array(row["point"]) - one["point"]).max() < apart for one in better)


def test_points_that_are_no_hammers_are_never_chosen() -> None:
    rows = [candidate(0.1, total=0.0) | {"constants": None}, candidate(0.2, total=3.0)]
    assert shortlist(rows, 5) == rows[1:]
    assert shortlist(rows[:1], 5) == []


@given(st.floats(1e-9, 1e12))
def test_constants_are_rounded_to_six_digits(value: float) -> None:
    (found,) = rounded({"mass": value}).values()
    assert found == pytest.approx(value, rel=5.001e-6)
    assert rounded({"mass": found}) == {"mass": found}
    assert len(f"{found:e}".partition("e")[0].replace(".", "").rstrip("0")) <= 6


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, tuple[str, ...]]]:
    """Replace the claims by the verdict that all hold; return the list of recorded calls."""
    done: list[tuple[float, tuple[str, ...]]] = []

    def row_of(constants: dict[str, float], names: tuple[str, ...], *, panels: bool) -> dict[str, Any]:
        done.append((constants["mass"], (*names, FIGURE_11) if panels else names))
        held = dict.fromkeys(done[-1][1], True)
        return {"constants": constants, "verdicts": held, "values": {}, "panels": 12 if panels else None}

    monkeypatch.setattr(module, "row_of", row_of)
    return done


def masses(*values: float) -> list[dict[str, float]]:
    return [{"mass": value} for value in values]


def test_what_is_known_is_not_judged_again(
    judged: list[tuple[float, tuple[str, ...]]], tmp_path: Path
) -> None:
    path = tmp_path / "judged.jsonl"
    told: list[tuple[int, int]] = []
    first = judge_candidates(masses(1.0, 2.0), path, tell=lambda done, of, _row: told.append((done, of)))
    assert [row["constants"]["mass"] for row in first] == [1.0, 2.0]
    assert told == [(1, 2), (2, 2)]
    before = path.read_bytes()
    again = judge_candidates(masses(3.0, 2.0, 3.0), path)
    assert [row["constants"]["mass"] for row in again] == [3.0, 2.0, 3.0]
    assert [mass for mass, _ in judged] == [1.0, 2.0, 3.0]
    assert path.read_bytes().startswith(before)
    assert path.read_bytes().count(b"\n") == 3


def test_more_claims_are_judged_where_they_were_not(
    judged: list[tuple[float, tuple[str, ...]]], tmp_path: Path
) -> None:
    path = tmp_path / "judged.jsonl"
    judge_candidates(masses(1.0), path)
    (more,) = judge_candidates(masses(1.0), path, names=[STATED[0], "settle_out", FIGURE_11])
    assert judged == [(1.0, (*STATED, FIGURE_11)), (1.0, ("settle_out",))]
    assert more["panels"] == 12
    # The row contains the earlier verdicts.
    assert set(more["verdicts"]) == {*STATED, "settle_out", FIGURE_11}
    judge_candidates(masses(1.0), path, names=list(STATED))
    assert len(judged) == 2


def test_judging_goes_on_after_an_interruption(
    judged: list[tuple[float, tuple[str, ...]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "judged.jsonl"
    plain = module.row_of

    def stopped(constants: dict[str, float], names: tuple[str, ...], *, panels: bool) -> dict[str, Any]:
        if constants["mass"] == 3.0:
            raise KeyboardInterrupt
        return plain(constants, names, panels=panels)

    monkeypatch.setattr(module, "row_of", stopped)
    with pytest.raises(KeyboardInterrupt):
        judge_candidates(masses(1.0, 2.0, 3.0), path)
    assert path.read_bytes().count(b"\n") == 2
    # The second row is incomplete, as after an interruption.
    path.write_bytes(path.read_bytes()[:-9])
    monkeypatch.setattr(module, "row_of", plain)
    judge_candidates(masses(1.0, 2.0, 3.0), path)
    assert [mass for mass, _ in judged] == [1.0, 2.0, 2.0, 3.0]
    assert [json.loads(line)["constants"]["mass"] for line in path.read_text().splitlines()] == [
        1.0,
        2.0,
        3.0,
    ]


def test_nothing_is_written_to_what_is_no_log(
    judged: list[tuple[float, tuple[str, ...]]], tmp_path: Path
) -> None:
    for content in ("notes", "notes\n", '{"aim": "all"}\n'):
        path = tmp_path / "notes.txt"
        path.write_text(content)
        with pytest.raises(InputError, match=r"notes\.txt"):
            judge_candidates(masses(1.0), path)
        assert path.read_text() == content
    assert judged == []


def test_standing_counts_claims_and_twelfths_for_panels() -> None:
    kinds = {name: claim.kind for name, claim in claims().items()}

    def row(panels: int | None = 0, **verdicts: bool) -> dict[str, Any]:
        return {"panels": panels, "verdicts": verdicts}

    assert standing(row(None)) == (0, 0)
    assert standing(row(6, geometry=True, settle_out=True, print_force=True)) == (2.5, 1)
    assert standing(row(3, geometry=False, poincare=True)) == (0.25, 0)
    # Twelve correct panels are one claim, which counts once.
    assert standing(row(12, poincare=True)) == standing(row(12, poincare=False)) == (1, 0)
    # At equal counts, more stated claims rank higher.
    assert standing(row(0, geometry=True)) > standing(row(0, settle_out=True))
    typical = dict.fromkeys((name for name, kind in kinds.items() if kind == "typical"), True)
    assert standing(row(4, geometry=True, **typical)) == standing(row(4, geometry=True))
