"""Tests of shipping: from judged candidates to the hammer file and the report's data on the search."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from studies.reconstruction import shipping as module
from studies.reconstruction.judging.judged import FIGURE_11, STATED
from studies.reconstruction.judging.shortlist import rounded
from studies.reconstruction.search.candidates import TOLERANCE
from studies.reconstruction.search.space import BEYOND
from studies.reconstruction.shipping import NOTE, TITLE, best_of, gauge, search_json, shipped_hammer
from studies.reconstruction.tests.samples import constants_in
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.claims import JudgedClaim, claims
from printhammer.report.reconstruction.results import Results

FAILING = ("settle_out", FIGURE_11, "release_margin")


def row(mass: float, *, panels: int = 5, **verdicts: bool) -> dict[str, Any]:
    return {
        "constants": {"mass": mass},
        "verdicts": {**dict.fromkeys(claims(), True), **dict.fromkeys(FAILING, False), **verdicts},
        "values": {"settle_out": {"rebounds": 7}},
        "panels": panels,
        "panel_verdicts": dict.fromkeys(("1.35 ms", "1.30 ms"), "strange"),
    }


@pytest.fixture
def some_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace the verdicts on the shipped hammer: all but a few claims hold."""

    def judge_all(_hammer: ph.Hammer, progress: Callable[[str], None] | None = None) -> list[JudgedClaim]:
        for name in claims() if progress is not None else ():
            progress(name)
        return [
            JudgedClaim(claim, dict.fromkeys(claim.band, 0.5), "fails", "So it is.")
            if name in FAILING
            else JudgedClaim(claim, {}, "holds", "")
            for name, claim in claims().items()
        ]

    monkeypatch.setattr(module, "judge_all", judge_all)


def test_most_claims_ship_and_panels_decide_among_equals() -> None:
    lost = row(1.0, panels=9, settle_out=True, **{STATED[1]: False})
    few = row(2.0, panels=8, settle_out=True)
    many = row(3.0, panels=9, settle_out=False)
    more = row(4.0, panels=9, settle_out=True)
    assert best_of([lost, few, many, more]) is more
    assert best_of([lost, few, many]) is few
    # At equal counts of claims and panels, more stated claims rank higher.
    assert best_of([lost, many]) is many
    # Of equal candidates, the first is the best.
    assert best_of([many, dict(many)]) is many


def test_the_hammer_file_comes_back_the_same(tmp_path: Path) -> None:
    constants = rounded(constants_in(CRUDE))
    hammer = shipped_hammer(constants, "found")
    hammer.save(tmp_path / "found.toml")
    back = ph.load(tmp_path / "found.toml")
    assert back.fingerprint == hammer.fingerprint
    assert back.name == "found"
    assert back.title == TITLE
    assert back.note.strip() == NOTE.strip()
    assert not back.note.startswith("\n")
    for key, value in constants.items():
        assert back.constants[key].si == value
        assert back.constants[key].status == "reconstructed"
    # The renamed hammer has the same motion as the judged hammer.
    drive = ph.PulseTrain(hammer.waveform)
    motions = [ph.simulate(one, drive, duration=2e-3) for one in (hammer, back)]
    assert (motions[0].x == motions[1].x).all()


def test_what_the_report_tells_can_be_read(some_fail: None, tmp_path: Path) -> None:
    del some_fail
    hammer = shipped_hammer(constants_in(CRUDE), "found")
    best = row(2.0, panels=6, settle_out=True, weak_prints_when_hung_up=False)
    worse = row(3.0, panels=6, settle_out=True, **{STATED[1]: False})
    panels = row(4.0, panels=11, **dict.fromkeys(STATED, False))
    searches = [
        {"aim": "all", "seed": 5, "candidates": 40, "sample": 16},
        {"aim": "all", "seed": 6, "candidates": 2},
        {"aim": "stated", "seed": 1, "candidates": 7},
    ]
    told: list[str] = []
    table = search_json(
        hammer,
        [row(1.0), worse, best, panels],
        searches=searches,
        core_hours=1.23456,
        progress=told.append,
    )
    assert told == list(claims())
    (tmp_path / "search.json").write_text(json.dumps(table, allow_nan=False))
    found = Results(tmp_path).search
    assert found is not None
    assert found.shipped == hammer.fingerprint
    assert [(one.aim, one.seed, one.candidates) for one in found.searches] == [
        ("all", 5, 40),
        ("all", 6, 2),
        ("stated", 1, 7),
    ]
    assert found.core_hours == 1.23
    # The tolerance is that of the search, not that of the claims.
    assert found.tolerance == TOLERANCE
    assert found.waveform == "rectangle"
    assert found.gauge == gauge()
    assert set(found.failing) == set(FAILING)
    settled = found.failing["settle_out"]
    assert settled.why == "So it is."
    assert set(settled.value) == set(claims()["settle_out"].band)
    assert settled.best is not None
    assert settled.best.constants == {"mass": 2.0}
    assert settled.best.value == {"rebounds": 7}
    assert settled.best.holds
    # Claims that hold for the shipped hammer, but not for the best hammer.
    assert settled.best.costs == ["weak_prints_when_hung_up"]
    # No candidate satisfies the claim.
    assert found.failing["release_margin"].best is None
    chaos = found.failing[FIGURE_11].best
    assert chaos is not None
    assert chaos.constants == {"mass": 4.0}
    assert not chaos.holds
    assert chaos.value == {"panels_as_printed": 11, "verdicts": ["strange", "strange"]}
    assert set(chaos.costs) == set(STATED)


def test_the_gauge_is_told_in_the_units_of_the_paper() -> None:
    assert "5 lb" in gauge()
    assert "1 A" in gauge()
    assert f"{BEYOND:g} times" in gauge()
