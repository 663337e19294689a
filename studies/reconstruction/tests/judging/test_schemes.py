"""Tests of the comparison of verdicts between the integrators of 1983 and the exact motion."""

import math

import pytest
from studies.reconstruction.judging import claims_1983 as claims_of_1983
from studies.reconstruction.judging import schemes as module
from studies.reconstruction.judging.claims_1983 import COMPUTED
from studies.reconstruction.judging.schemes import EXACT, PAIRS, PLAIN, changes, named, schemes_json

from printhammer.claims.verdicts import printed_verdicts
from printhammer.report.reconstruction.results import Schemes, shipped_results


def test_changes_are_counted_with_panels_of_a_hammer_as_one(monkeypatch: pytest.MonkeyPatch) -> None:
    names = {0: ["period-1"] * 12, 1: ["strange"] * 12}
    other = {0: ["period-1"] * 6 + ["strange"] * 6, 1: ["strange"] * 12}
    monkeypatch.setattr(module, "drawn_workable", lambda count, seed: list(range(count)))
    monkeypatch.setattr(module, "hammer_of", lambda number: number)
    monkeypatch.setattr(
        module, "panel_verdicts", lambda which, way: (names if way == EXACT else other)[which]
    )
    told: list[tuple[int, int]] = []
    rows = changes(2, 1, tell=lambda done, of: told.append((done, of)))
    assert told == [(1, 2), (2, 2)]
    assert [(row["first"], row["second"]) for row in rows] == [(named(a), named(b)) for a, b in PAIRS]
    first = rows[0]
    assert (first["panels"], first["differ"]) == (24, 6)
    assert (first["periodic_to_strange"], first["strange_to_periodic"]) == (6, 0)
    # The fractions of the two hammers are 0.5 and 0, with mean 0.25 and standard error 0.25.
    assert first["share"] == pytest.approx(0.25)
    assert first["share_error"] == pytest.approx(2.0 * math.sqrt(0.125) / math.sqrt(2.0))
    assert rows[-1]["differ"] == 0


@pytest.mark.golden
@pytest.mark.slow
def test_what_ships_can_be_made_again_and_is_about_all_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    import printhammer as ph

    monkeypatch.setattr(module, "family_hammers", list)
    monkeypatch.setattr(module, "changes", lambda *_, **__: [])
    # Claims that require scans over the rate are omitted, since they are slow.
    quick = [name for name in COMPUTED if name not in ("order_of_onset", "second_dot_lost")]
    monkeypatch.setattr(claims_of_1983, "COMPUTED", quick)
    # The shipped table belongs to the former hammer.
    hammer = ph.load("hendriks-1983-1")
    made = Schemes.model_validate(schemes_json(hammer, 1, 1))
    assert set(made.panels) == {named(way) for way in (EXACT, *PLAIN)}
    assert list(made.claims) == quick
    assert made.panels["exact"] != made.panels[named(PLAIN[1])]
    assert all(len(names) == len(printed_verdicts()) for names in made.panels.values())
    shipped = shipped_results().schemes
    assert shipped is not None
    assert shipped.shipped == hammer.fingerprint
    assert list(shipped.panels) == list(made.panels)
    # With a scheme, rounding decides when a train locks, so that only the exact verdicts agree.
    assert sum(map(str.__eq__, made.panels["exact"], shipped.panels["exact"])) >= 11
    assert {name: shipped.claims[name] for name in quick} == made.claims
    assert set(shipped.claims) == set(COMPUTED)
