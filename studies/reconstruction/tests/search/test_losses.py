"""Tests of the losses of candidates against the verdicts of the claims."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from studies.reconstruction.search import evaluation, losses, panel_losses
from studies.reconstruction.search.candidates import Candidate, candidates
from studies.reconstruction.search.evaluation import AIMS, WEIGHTS, evaluate, rows
from studies.reconstruction.search.losses import Score, hinge
from studies.reconstruction.search.map_losses import sensitivity
from studies.reconstruction.search.panel_losses import FIRINGS, panels
from studies.reconstruction.tests.samples import near_points, random_points, some_candidates

from printhammer.claims import Context, claims, judge
from printhammer.claims.verdicts import printed_verdicts

BEST = Path(evaluation.__file__).with_name("best.jsonl")
QUICK = (
    "single_pulse_stroke",
    "return_from_everywhere",
    "release_margin",
    "settle_out",
    "two_pulses_660us",
    "two_pulses_700us",
)
# Margins at the end of a band within which the coarser grid and tolerance may change the verdict.
NEAR = {
    "return_from_everywhere": ("largest_net_force_N", 0.05),
    "settle_out": ("largest_excursion_over_stroke", 0.002),
    "two_pulses_660us": ("peak_minus_pack_front_m", 0.5e-6),
    "two_pulses_700us": ("second_over_first_peak_force", 0.002),
}


def looked_at(chosen: tuple[Candidate, ...]) -> list[Score]:
    scores = [Score() for _ in chosen]
    for candidate, score in zip(chosen, scores, strict=True):
        losses.statics(candidate, score)
    losses.single_pulse(chosen, scores)
    losses.pairs(chosen, scores)
    return scores


def close_call(name: str, value: dict[str, float]) -> bool:
    """Whether a measured value is close to the end of its band."""
    key, margin = NEAR.get(name, ("", 0.0))
    band = claims()[name].band.get(key)
    ends = band if isinstance(band, list) else (band or {}).values()
    found = value.get(key)
    return found is not None and any(abs(found - end) < margin for end in ends)


@given(st.floats(-10.0, 10.0), st.floats(0.01, 5.0))
def test_hinge_is_zero_without_excess_and_at_most_one(excess: float, scale: float) -> None:
    loss = hinge(excess, scale)
    assert 0.0 <= loss <= 1.0
    assert (loss == 0.0) == (excess <= 0.0 or excess / scale == 0.0)
    assert (loss == 1.0) == (excess >= scale)


def test_what_is_not_known_counts_in_full() -> None:
    assert hinge(math.nan, 1.0) == 1.0
    score = Score({"settle_out": 0.25})
    assert score.total({"settle_out": 2.0, "poincare": 4.0}) == 4.5


def test_only_stated_claims_lead_one_search_and_typical_ones_neither() -> None:
    known = claims()
    # The appearance of clouds is not a claim and guides no search alone.
    kinds = {aim: {known[name].kind for name in weights if name in known} for aim, weights in WEIGHTS.items()}
    led = {"stated", "shape"}
    assert kinds == {"stated": {"stated"}, "all": led, "panels": led, "buzz": led, "claims": led}
    # Claims that guide the first search guide the second with the same weight.
    assert WEIGHTS["stated"].items() <= WEIGHTS["all"].items()


def check(chosen: tuple[Candidate, ...], names: tuple[str, ...], scores: list[Score]) -> int:
    """Compare losses with verdicts, except in close calls; return the number of comparisons."""
    compared = 0
    for candidate, score in zip(chosen, scores, strict=True):
        context = Context(candidate.hammer)
        for name in names:
            result = judge(context, claims()[name])
            if close_call(name, dict(result.value or {})):
                continue
            assert (score.losses[name] == 0.0) == (result.verdict == "holds"), (name, score, result.detail)
            compared += 1
    return compared


def test_no_loss_where_the_claim_holds_and_some_where_it_fails() -> None:
    chosen = some_candidates()
    scores = looked_at(chosen)
    assert check(chosen, QUICK, scores) > 0.8 * len(QUICK) * len(chosen)
    for name in QUICK[1:3]:
        # The claim holds for some candidates and fails for others, so that both cases are compared.
        assert len({score.losses[name] == 0.0 for score in scores}) == 2


@pytest.mark.slow
def test_losses_and_verdicts_of_many_candidates() -> None:
    shipped = candidates(near_points(24, 5, 0.002, "hendriks-1983-1"))
    chosen = (*some_candidates(200, 48, 5), *(one for one in shipped if one is not None))
    scores = looked_at(chosen)
    assert check(chosen, QUICK, scores) > 0.8 * len(QUICK) * len(chosen)
    for name in QUICK:
        assert len({score.losses[name] == 0.0 for score in scores}) == 2


def test_numbers_in_the_log_are_those_of_the_claims() -> None:
    *_, candidate = some_candidates()
    (score,) = looked_at((candidate,))
    context = Context(candidate.hammer)
    found = {name: judge(context, claims()[name]).value or {} for name in QUICK}
    measured = score.measured
    assert measured["force"] == pytest.approx(context.print_force, rel=1e-6)
    assert measured["flight_time"] == pytest.approx(context.dot.flight_time, abs=1e-9)
    margin = found["release_margin"]["net_over_magnet_force"]
    assert measured["margin"] == pytest.approx(margin, rel=1e-9)
    settled = found["settle_out"]["largest_excursion_over_stroke"]
    # The motion is sampled every microsecond.
    assert measured["highest"] == pytest.approx(settled, rel=1e-3, abs=1e-3)
    speed = found["two_pulses_700us"]["velocity_at_half_current_m_per_s"]
    assert measured["rise_speed"] == pytest.approx(speed, abs=1e-6)


def test_a_second_pulse_without_a_peak_is_no_quench() -> None:
    score = Score()
    gaps, quenched, _caught = losses._pair_gaps()
    peaks = np.full(len(gaps), 1e-3)
    peaks[quenched] = math.nan
    losses._judge_quench(score, gaps, peaks, quenched)
    assert score.losses["two_pulses_660us"] == 1.0
    peaks[quenched] = 0.0
    losses._judge_quench(score, gaps, peaks, quenched)
    assert score.losses["two_pulses_660us"] == 0.0


def test_how_much_too_late_an_armature_rises() -> None:
    times = np.arange(0.0, 1e-3, 4e-6)
    turn = 6e-4
    x = ((times - turn) ** 2).astype(np.float32)
    for moment in (2e-4, 5e-4):
        assert losses._late(x, times, moment) == pytest.approx(turn - moment, abs=8e-6)
    assert losses._late(-x[times < turn], times[times < turn], 2e-4) == pytest.approx(0.0, abs=8e-6)
    assert losses._late(np.zeros(200, np.float32), times[:200], 2e-4) == math.inf


def test_impacts_that_several_pulses_make_are_not_looked_at() -> None:
    times, front = np.arange(0.0, 1e-3, 4e-6), losses.geometry()["xp"]
    x = np.full(len(times), front - 1e-5, np.float32)
    for start, depth in ((1e-4, 8e-5), (3e-4, 3e-5), (7e-4, 6e-5)):
        x[(times > start) & (times < start + 1e-4)] = front + depth
    firings = np.array([0.0, 2e-4, 4e-4, 6e-4])
    assert losses._deepest_distinct(x, times, firings) == pytest.approx(front + 3e-5)
    assert losses._deepest_distinct(x, times, firings[:3]) == pytest.approx(front + 6e-5)
    assert losses._deepest_distinct(x[: len(x) // 4], times, firings) == 0.0


def test_losses_do_not_depend_on_the_candidates_beside() -> None:
    chosen = some_candidates()[:4]
    together = looked_at(chosen)
    for candidate, score in zip(chosen, together, strict=True):
        (alone,) = looked_at((candidate,))
        assert alone.losses == score.losses
        assert alone.measured == score.measured


@pytest.mark.slow
def test_losses_of_trains_do_not_depend_on_the_candidates_beside() -> None:
    chosen = some_candidates(2, 4, 6)

    def look(some: tuple[Candidate, ...]) -> list[Score]:
        scores = looked_at(some)
        panels(some, scores)
        losses.hung(some, scores)
        return scores

    for candidate, score in zip(chosen, look(chosen), strict=True):
        (alone,) = look((candidate,))
        assert alone.losses == score.losses
        assert alone.measured == score.measured


@pytest.mark.parametrize("aim", AIMS)
def test_losses_are_between_zero_and_one_and_go_into_the_log(aim: str) -> None:
    points = random_points(8, 2) + near_points(8, 2)
    for (candidate, score), row in zip(evaluate(points, aim), rows(points, aim), strict=True):
        assert (candidate is None) == (row["constants"] is None)
        assert all(0.0 <= loss <= 1.0 for loss in score.losses.values())
        assert 0.0 <= row["total"] <= sum(WEIGHTS[aim].values())
        # JSON represents all numbers of the row.
        assert json.loads(json.dumps(row, allow_nan=False)) == row
        if candidate is None:
            assert row["total"] == sum(WEIGHTS[aim].values())


@pytest.mark.slow
def test_losses_that_follow_whole_scans_of_rates() -> None:
    """Compare a shipped hammer, which loses its second dot as in the paper, and two that hang up later."""
    shipped = candidates(near_points(1, 5, 0.0, "hendriks-1983-1"))
    chosen = (*(each for each in shipped if each is not None), *some_candidates(6, 6, 3)[-2:])
    scores = looked_at(chosen)
    losses.hung(chosen, scores)
    verdicts = []
    for candidate, score in zip(chosen, scores, strict=True):
        context = Context(candidate.hammer)
        lost = judge(context, claims()["second_dot_lost"])
        verdicts.append(lost.verdict)
        # The claim scans in steps of 1 Hz, the search in steps of 10 us or more.
        if lost.verdict == "holds":
            assert score.losses["second_dot_lost"] < 0.5
        hung = (judge(context, claims()["hang_up_at_high_rate"]).value or {}).get("hang_up_rate_Hz")
        must = claims()["hang_up_at_high_rate"].band["hang_up_rate_Hz"]["at_most"]
        if hung is not None:
            # The search scans from 2 kHz in steps of about 250 Hz.
            assert score.measured["hang_up"] <= max(hung, 2000.0) + 600.0
            if hung < must - 600.0:
                assert score.losses["hang_up_at_high_rate"] == 0.0
    assert verdicts == ["holds", "fails", "fails"]


@pytest.mark.slow
def test_panels_of_short_trains_are_mostly_those_of_the_claim() -> None:
    from studies.reconstruction.judging.judged import plain_panels

    # One candidate has losses so large that most panels are not computed; two have all panels.
    near = some_candidates(5, 5, 9)[-5:]
    chosen = [near[k] for k in (0, 1, 3)]
    scores = [Score() for _ in chosen]
    panels(chosen, scores)
    right, seen, off = 0, 0, []
    for candidate, score in zip(chosen, scores, strict=True):
        found = [name for name, _printed in plain_panels(candidate.hammer).values()]
        # If the hard panels have large losses, the other panels are not computed.
        looked_at = [
            (mine, name) for mine, name in zip(score.measured["verdicts"], found, strict=True) if mine
        ]
        right += sum(mine == name for mine, name in looked_at)
        seen += len(looked_at)
        assert 0.0 <= score.losses["poincare"] <= 1.0
        share = (judge(Context(candidate.hammer), claims()["poincare_window"]).value or {}).get(
            "least_share_inside"
        )
        assert share is not None
        if len(looked_at) == len(found):
            off.append(abs(score.measured["least_share"] - share))
    # The points of a strange train depend on the tolerance, and the search simulates fewer firings than
    # the claim: allow two standard errors of a fraction of this number of firings.
    assert np.median(off) < 2.0 * math.sqrt(0.25 / FIRINGS)
    # A short train distinguishes period from chaos in most panels; the claim alone decides.
    assert right > 0.75 * seen
    assert seen > 12


@pytest.mark.slow
def test_the_looks_of_map_and_cloud_are_about_those_of_the_claims() -> None:
    shipped = candidates(near_points(3, 5, 0.002, "hendriks-1983-1"))
    chosen = tuple(each for each in shipped if each is not None)
    scores = looked_at(chosen)
    panels(chosen, scores)
    losses.hung(chosen, scores)
    sensitivity(chosen, scores)
    for candidate, score in zip(chosen, scores, strict=True):
        context = Context(candidate.hammer)
        apart = judge(context, claims()["successive_points_apart"])
        assert (score.losses["successive_points_apart"] == 0.0) == (apart.verdict == "holds")
        value = judge(context, claims()["map_sensitivity"]).value
        assert value is not None
        # A few bursts dominate the sensitivity, and the claim simulates twice as many rates.
        assert score.measured["sensitivity"] == pytest.approx(value["erratic_over_low"], rel=0.6)


@pytest.mark.parametrize(("late", "loss"), [(0.3, 0.0), (0.15, 0.5), (0.0, 1.0)])
def test_six_panels_of_eight_are_to_jump_about(late: float, loss: float) -> None:
    strange = [period for period, name in printed_verdicts().items() if name == "strange"]
    ratios = dict.fromkeys(printed_verdicts(), 1.0) | dict.fromkeys(strange[5:], late)
    assert panel_losses._successive(ratios) == pytest.approx(loss)


def test_what_just_fails_counts_where_the_number_of_claims_leads() -> None:
    score = Score({"settle_out": 0.1, "low_restitution": 0.0})
    weights = {"settle_out": 2.0, "low_restitution": 1.0, "poincare": 4.0}
    assert score.total(weights, 0.4) == pytest.approx(2.0 * (0.4 + 0.6 * 0.1) + 4.0)


def test_region_and_clouds_agree_with_the_claims() -> None:
    """Both claims fail for the former hammer and hold for the best hammer of the search."""
    best = json.loads(BEST.read_text("utf-8").splitlines()[0])
    points = [best["point"], *near_points(1, 5, 0.0, "hendriks-1983-1")]
    names = ("chaotic_region", "behind_the_backstop")
    for (candidate, score), verdict in zip(evaluate(points, "claims"), ("holds", "fails"), strict=True):
        assert candidate is not None
        context = Context(candidate.hammer)
        for name in names:
            assert judge(context, claims()[name]).verdict == verdict
            assert (score.losses[name] == 0.0) == (verdict == "holds")
        assert 0.0 < score.measured["extent"] <= 1.0
    assert score.losses["clouds"] > 0.0
