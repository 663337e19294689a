import json
import tomllib
from typing import TYPE_CHECKING

import pytest

from printhammer.claims import JUDGES, PENDING, Context, JudgedClaim, claims, judge, judge_all
from printhammer.claims.judging import measures
from printhammer.report.build import claims_json

if TYPE_CHECKING:
    import printhammer as ph

MANY_RUNS = {
    "order_of_onset",
    "second_dot_lost",
    "hang_up_at_high_rate",
    "weak_prints_when_hung_up",
    "poincare",
    "no_period_doubling_cascade",
}
QUICK = ("geometry", "release_margin", "single_pulse_stroke", "print_force")


def test_results_come_in_the_order_of_the_paper(hammer: "ph.Hammer", context: Context) -> None:
    told: list[str] = []
    results = judge_all(hammer, reversed(QUICK), progress=told.append, context=context)
    assert [result.claim.name for result in results] == list(QUICK) == told


def test_what_cannot_be_judged_yet(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PENDING, "geometry", "a ruler")
    result = judge(context, claims()["geometry"])
    assert (result.verdict, result.value, result.missed) == ("not yet", None, [])
    assert "a ruler" in result.detail


def test_the_verdict_is_that_of_the_band(context: Context) -> None:
    for name in QUICK:
        result = judge(context, claims()[name])
        assert (result.verdict == "holds") == (not result.missed)
        assert set(claims()[name].band) <= set(result.value)


def test_json_has_what_was_asked_for_and_is_the_same_again(hammer: "ph.Hammer") -> None:
    first, second = (claims_json(judge_all(hammer, QUICK, context=Context(hammer))) for _ in range(2))
    assert first == second
    for entry in json.loads(first):
        assert {"name", "kind", "value", "band", "verdict"} <= set(entry)
        assert entry["verdict"] in ("holds", "fails", "not yet")
        assert "seconds" not in entry


def test_no_claim_is_measured_twice() -> None:
    with pytest.raises(ValueError, match="geometry"):
        measures("geometry")(JUDGES["geometry"][1])
    with pytest.raises(ValueError, match="no_such_claim"):
        measures("no_such_claim")(JUDGES["geometry"][1])


def test_a_run_that_stops_early_is_a_reason(hammer: "ph.Hammer") -> None:
    # The law of the magnet ends before the platen, and the armature is thrown there.
    short = hammer.replace({"magnet.range_max": "0.009 in"})
    result = judge(Context(short), claims()["single_pulse_stroke"])
    assert result.verdict == "fails"
    assert "range" in result.detail


def test_a_hammer_without_a_rest_state_fails_with_the_reason(hammer: "ph.Hammer") -> None:
    loose = Context(hammer.replace("spring.Bs", "40 N"))
    for name in ("single_pulse_stroke", "two_pulses_660us", "low_rate_fixed_point"):
        result = judge(loose, claims()[name])
        assert result.verdict == "fails"
        assert "no rest state" in result.detail


def assert_complete(result: JudgedClaim) -> None:
    assert result.detail.endswith(".")
    if result.verdict == "not yet":
        assert result.value is None
    elif result.value is not None:
        assert set(result.claim.band) <= set(result.value)
    json.dumps(result.as_dict(), allow_nan=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {
            "backstop": {"law": "rigid", "position": "0.002 in", "restitution": "0.6"},
            "pack": {"law": "dashpot", "front": "0.008 in", "stiffness": "400 N/mm", "damping": "20 N s/m"},
        },
        {"waveform": {"shape": "half-sine", "amplitude": "20 N", "width": "300 us"}},
        {"waveform.amplitude": "2 A"},
        {"waveform.width": "3 ms"},
    ],
    ids=["rigid backstop and dashpot pack", "force", "strong pulse", "long pulse"],
)
def test_no_claim_crashes_on_another_hammer(hammer: "ph.Hammer", changes: dict[str, object]) -> None:
    for result in judge_all(hammer.replace(changes), set(claims()) - MANY_RUNS):
        assert_complete(result)


@pytest.mark.slow
def test_the_elastomer_stops_the_armature_in_fewer_rebounds(context: Context) -> None:
    value = judge(context, claims()["elastomer_backstop"]).value
    assert value["rebounds_hard"] - value["rebounds_elastomer"] == value["fewer_rebounds"]
    assert value["largest_deformation_m"] < context.position
    assert {*value["too_soft_N"], value["force_at_25_um_N"]} <= set(
        claims()["elastomer_backstop"].settings["forces_N"]
    )


def test_the_claims_file_is_toml_of_tables() -> None:
    from importlib.resources import files

    text = files("printhammer").joinpath("claims", "claims.toml").read_text("utf-8")
    assert all(isinstance(table, dict) for table in tomllib.loads(text).values())


def test_each_text_of_a_list_is_a_statement() -> None:
    claim = claims()["poincare"]
    printed = list(claim.band["verdicts"])
    some = ["strange", *printed[1:]]
    judged = JudgedClaim(claim, {"verdicts": some}, "fails", "")
    assert judged.statements == (len(printed) - 1, len(printed)) == (11, 12)
    assert JudgedClaim(claim, None, "fails", "").statements == (0, 12)
    other = claims()["settle_out"]
    assert JudgedClaim(other, None, "fails", "").statements == (0, 1)
    assert JudgedClaim(other, {}, "holds", "").statements == (1, 1)
    made = sum(JudgedClaim(each, None, "fails", "").statements[1] for each in claims().values())
    assert made == len(claims()) - 1 + len(printed) == 47
