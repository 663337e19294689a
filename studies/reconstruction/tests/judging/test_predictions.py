"""Tests of the predictions: other claims that hold for hammers found with the stated claims alone."""

from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from studies.reconstruction.judging.judged import FIGURE_11, STATED
from studies.reconstruction.judging.predictions import predictions

from printhammer.claims import claims
from printhammer.report.reconstruction.results import Predictions

SHAPES = [name for name, claim in claims().items() if claim.kind == "shape"]


def row(*failing: str, **verdicts: bool) -> dict[str, Any]:
    return {"verdicts": {**dict.fromkeys(STATED, True), **dict.fromkeys(failing, False), **verdicts}}


def test_hammers_that_meet_all_stated_claims_are_counted() -> None:
    rows = [
        row(settle_out=True, release_margin=False, poincare=False),
        row(settle_out=False, poincare=False),
        row(STATED[0], settle_out=True),
        {"verdicts": {"settle_out": True}},
    ]
    found = predictions(rows, seed=3, candidates=100)
    Predictions.model_validate(found)
    assert found["hammers"] == 2
    assert found["seed"] == 3
    assert found["candidates"] == 100
    assert found["stated_held"] == list(STATED)
    assert found["claims"]["settle_out"] == {"kind": "shape", "measured": 2, "holds": 1}
    assert found["claims"]["release_margin"] == {"kind": "shape", "measured": 1, "holds": 0}
    assert found["claims"]["loops"] == {"kind": "shape", "measured": 0, "holds": 0}
    assert found["claims"][FIGURE_11] == {"kind": "stated", "measured": 2, "holds": 0}


def test_what_led_is_no_prediction_and_what_is_typical_is_none_either() -> None:
    found = predictions([row()], seed=0, candidates=1)
    assert set(found["claims"]) == {*SHAPES, FIGURE_11}


@settings(max_examples=30)
@given(st.lists(st.dictionaries(st.sampled_from([*STATED, *SHAPES]), st.booleans(), max_size=8), max_size=8))
def test_counts_are_consistent(verdicts: list[dict[str, bool]]) -> None:
    rows = [row(**some) for some in verdicts]
    found = predictions(rows, seed=0, candidates=1)
    kept = [one["verdicts"] for one in rows if all(one["verdicts"][name] for name in STATED)]
    assert found["hammers"] == len(kept)
    for name in SHAPES:
        entry = found["claims"][name]
        assert entry["holds"] <= entry["measured"] <= found["hammers"]
        assert entry["measured"] == sum(name in some for some in kept)
        assert entry["holds"] == sum(some.get(name, False) for some in kept)


def test_no_hammers_predict_nothing() -> None:
    found = predictions([], seed=0, candidates=5)
    Predictions.model_validate(found)
    assert found["hammers"] == 0
    assert all(entry["measured"] == 0 for entry in found["claims"].values())
