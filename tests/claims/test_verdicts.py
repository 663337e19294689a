import dataclasses
import json
from typing import TYPE_CHECKING

import numpy as np
import pytest

from printhammer.chaos import Verdict
from printhammer.claims import Context, claims, judge, verdicts

if TYPE_CHECKING:
    import printhammer as ph


def verdict(name: str, last: int = 2000) -> Verdict:
    period = int(name.partition("-")[2]) if name.startswith("period") else None
    return Verdict(name, period, 1e-9, period, 0.5, 0.1, last // 2 + 1, last, 2e-11)


@dataclasses.dataclass
class Found:
    verdict: Verdict


class Given:
    """Replacement for the runs: verdicts by strobe time in us, also for changed hammers."""

    def __init__(self, names: dict[int, str], changed: dict[int, str] | None = None) -> None:
        self.names = names
        self.changed = changed or {}
        self.calls: list[dict[str, object]] = []

    def strobes(self, hammers: object, periods: list[float], **options: object) -> list[Found]:
        self.calls.append({"hammers": hammers, "periods": list(periods), **options})
        many = hammers if isinstance(hammers, list) else [hammers] * len(periods)
        found = []
        for hammer, period in zip(many, periods, strict=True):
            us = round(period * 1e6)
            name = self.names[us]
            if hammer.fingerprint != many[0].fingerprint:
                name = self.changed.get(us, name)
            found.append(Found(verdict(name)))
        return found

    def scan(self, hammer: object, periods: list[float], **options: object) -> list[Verdict]:
        names = [self.names[round(period * 1e6)] for period in periods]
        return [verdict("undecided" if name == "strange" else name, 32) for name in names]


def give(
    monkeypatch: pytest.MonkeyPatch, names: dict[int, str], changed: dict[int, str] | None = None
) -> Given:
    given = Given(names, changed)
    monkeypatch.setattr(verdicts, "strobes", given.strobes)
    monkeypatch.setattr(verdicts, "scan", given.scan)
    return given


def printed() -> dict[int, str]:
    claim = claims()["poincare"]
    times = [round(time * 1e6) for time in claim.settings["strobe_times_s"]]
    return dict(zip(times, claim.band["verdicts"], strict=True))


def test_every_constant_is_changed(hammer: "ph.Hammer") -> None:
    for sign in verdicts._CHANGED.values():
        moved = verdicts.changed(hammer, sign).constants
        ratios = np.array([moved[key].si / constant.si for key, constant in hammer.constants.items()])
        assert list(moved) == list(hammer.constants)
        np.testing.assert_allclose(np.abs(ratios - 1.0), 1e-5, rtol=1e-9)
    signs = {
        tuple(sign(number) for number in range(len(hammer.constants))) for sign in verdicts._CHANGED.values()
    }
    assert len(signs) == 4


def test_a_force_stays_a_force(hammer: "ph.Hammer") -> None:
    pulse = {"shape": "half-sine", "amplitude": "20 N", "width": "300 us"}
    moved = verdicts.changed(hammer.replace("waveform", pulse), lambda _: 1)
    assert moved.waveform.quantity == "force"
    assert moved.waveform.peak == pytest.approx(20.0002, rel=1e-9)


def test_panels_as_the_paper_has_them(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    given = give(monkeypatch, printed())
    result = judge(context, claims()["poincare"])
    assert result.verdict == "holds"
    assert result.value["panels_as_printed"] == 12
    assert result.value["panels_that_change"] == []
    assert set(result.value["panels"]["1.05 ms"]) == {
        "as it is",
        *verdicts._CHANGED,
        "ten times tighter tolerance",
    }
    tolerances = {call["tolerance"] for call in given.calls}
    assert tolerances == {context.tolerance, 0.1 * context.tolerance}
    # Five hammers, twelve strobe times; and the first 200 firings apart.
    assert len(given.calls[0]["periods"]) == 60
    assert (1, 200) in [call.get("firings") for call in given.calls]
    json.dumps(result.value, allow_nan=False)


def test_a_verdict_that_does_not_stay_fails(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    give(monkeypatch, printed(), {1100: "period-3"})
    result = judge(context, claims()["poincare"])
    assert result.verdict == "fails"
    assert result.value["panels_as_printed"] == 11
    assert result.value["panels_that_change"] == ["1.10 ms"]
    assert "1.10 ms strange or period-3 instead of strange" in result.detail


def test_another_verdict_fails(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    give(monkeypatch, {**printed(), 1300: "period-2", 800: "undecided"})
    result = judge(context, claims()["poincare"])
    assert result.verdict == "fails"
    assert result.value["verdicts"][1] == "period-2"
    assert "1.30 ms period-2 instead of period-1, 0.80 ms undecided instead of strange" in result.detail


def scanned(**windows: tuple[int, int]) -> dict[int, str]:
    """Verdicts of a scan: period 1, except in windows given as (longest, shortest) strobe time in us."""
    names = dict.fromkeys(range(800, 3001), "period-1")
    for name, (high, low) in windows.items():
        names.update(dict.fromkeys(range(low, high + 1), name.rstrip("_").replace("_", "-")))
    return names


@pytest.mark.parametrize("cascade", [False, True])
def test_the_way_into_chaos(context: Context, monkeypatch: pytest.MonkeyPatch, cascade: bool) -> None:
    doubling = {"period_4": (1309, 1305), "period_8": (1304, 1301)} if cascade else {}
    give(
        monkeypatch,
        scanned(
            strange=(1300, 850),
            period_2=(1350, 1310),
            **doubling,
            period_2_=(1100, 1081),
            period_3=(1000, 1000),
            period_3_=(900, 899),
            # Outside the strange range.
            period_2__=(840, 835),
        ),
    )
    result = judge(context, claims()["no_period_doubling_cascade"])
    value = result.value
    assert (value["first_strange_s"], value["last_strange_s"]) == (1.3e-3, 0.85e-3)
    assert value["cascade_before_strange"] is cascade
    assert result.verdict == ("fails" if cascade else "holds")
    assert (value["period_2_windows"], value["period_3_windows"]) == (1, 2)
    assert value["period_2"][0] == pytest.approx(
        {"verdict": "period-2", "from_s": 1.1e-3, "to_s": 1.081e-3, "width_s": 20e-6}
    )
    assert [round(window["width_s"] * 1e6) for window in value["period_3"]] == [1, 2]
    assert value["windows_before_strange"][1]["verdict"] == "period-2"
    assert len(value["doublings_with_falling_time_s"]) == cascade
    json.dumps(value, allow_nan=False)


def test_no_chaos_no_windows(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    give(monkeypatch, scanned(period_2=(1000, 900)))
    result = judge(context, claims()["no_period_doubling_cascade"])
    assert result.verdict == "fails"
    assert result.value["first_strange_s"] is None
    assert result.value["period_2_windows"] == 0
    assert "No strobe time is strange" in result.detail


def test_a_train_without_a_period_need_not_be_strange(
    context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = scanned(undecided=(2000, 1990), strange=(1300, 1290), undecided_=(1000, 990))
    give(monkeypatch, names)
    value = judge(context, claims()["no_period_doubling_cascade"]).value
    assert (value["first_strange_s"], value["last_strange_s"]) == (1.3e-3, 1.29e-3)


@pytest.mark.golden
@pytest.mark.slow
def test_two_panels_of_the_shipped_hammer_keep_their_verdicts(context: Context) -> None:
    claim = claims()["poincare"]
    short = dataclasses.replace(
        claim,
        settings={"strobe_times_s": [1.35e-3, 1.2e-3]},
        band={"verdicts": ["period-2", "strange"]},
    )
    measured = verdicts.poincare(context, short)
    assert measured.value["verdicts"] == ["period-2", "strange"]
    assert measured.value["panels_that_change"] == []
