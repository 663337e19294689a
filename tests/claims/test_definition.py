import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from printhammer.claims import JUDGES, KINDS, PENDING, claims
from printhammer.claims.judging import SIDES, within

FINITE = st.floats(allow_nan=False, allow_infinity=False)
NUMBERS = (int, float)


def numbers_in(entry: object) -> list[object]:
    if isinstance(entry, dict):
        return [number for side in entry.values() for number in numbers_in(side)]
    if isinstance(entry, list):
        return [number for item in entry for number in numbers_in(item)]
    return [entry] if isinstance(entry, NUMBERS) and not isinstance(entry, bool) else []


@pytest.mark.parametrize("name", claims())
def test_every_claim_is_complete(name: str) -> None:
    claim = claims()[name]
    assert claim.kind in KINDS
    for text in (claim.source, claim.says, claim.reading):
        assert text.strip()
    assert claim.band
    for band in claim.band.values():
        if isinstance(band, dict):
            assert band
            assert set(band) <= set(SIDES)
        elif isinstance(band, list) and numbers_in(band):
            low, high = band
            assert low < high
    assert all(math.isfinite(number) for number in numbers_in([claim.band, claim.settings]))


def test_every_claim_is_measured_or_pending() -> None:
    assert set(JUDGES) | set(PENDING) == set(claims())
    assert not set(JUDGES) & set(PENDING)


def test_what_the_paper_prints() -> None:
    # F. Hendriks (1983): captions of Figs. 2, 3 and 11, and the text of Figs. 6, 8 and 9.
    inch = 0.0254
    found = claims()
    geometry = found["geometry"].band
    assert geometry["backstop_m"] == pytest.approx(0.002 * inch)
    assert geometry["pack_front_m"] == pytest.approx(0.008 * inch)
    assert geometry["platen_m"] == pytest.approx(0.015 * inch)
    assert within(0.0112 * inch, found["single_pulse_stroke"].band["max_displacement_m"])
    assert found["two_pulses_660us"].settings["interval_s"] == 660e-6
    assert found["two_pulses_700us"].settings["interval_s"] == 700e-6
    figure = found["poincare"]
    assert [round(1e5 * time) for time in figure.settings["strobe_times_s"]] == list(range(135, 75, -5))
    verdicts = dict(zip(figure.settings["strobe_times_s"], figure.band["verdicts"], strict=True))
    assert {time for time, verdict in verdicts.items() if verdict == "period-1"} == {1.3e-3, 1.25e-3, 1e-3}
    assert {time for time, verdict in verdicts.items() if verdict == "period-2"} == {1.35e-3}
    assert sum(verdict == "strange" for verdict in verdicts.values()) == 8
    window = found["poincare_window"].settings
    assert window["window_x_m"] == pytest.approx([0.0015 * inch, 0.0035 * inch])
    assert window["window_v_m_per_s"] == pytest.approx([-25 * inch, 25 * inch])


@given(FINITE, FINITE, FINITE)
def test_an_interval_is_closed(value: float, low: float, high: float) -> None:
    assert within(value, [low, high]) == (low <= value <= high)


@given(FINITE, FINITE)
def test_sides(value: float, limit: float) -> None:
    assert within(value, {"above": limit}) == (value > limit)
    assert within(value, {"at_least": limit}) == (value >= limit)
    assert within(value, {"below": limit}) == (value < limit)
    assert within(value, {"at_most": limit}) == (value <= limit)
    assert within(value, {"at_least": limit, "at_most": limit}) == (value == limit)


@pytest.mark.parametrize("band", [1.0, [0.0, 1.0], {"below": 1.0}, {"at_least": -1.0}, True, ["a"]])
@pytest.mark.parametrize("value", [None, math.nan])
def test_nothing_measured_is_never_within(value: object, band: object) -> None:
    assert not within(value, band)


@pytest.mark.parametrize(
    ("value", "band", "holds"),
    [
        (50.8e-6, 50.8e-6, True),
        (50.8e-6 * (1.0 + 1e-12), 50.8e-6, True),
        (50.8e-6 * (1.0 + 1e-6), 50.8e-6, False),
        (True, True, True),
        (False, True, False),
        (1, True, False),
        (True, 1, False),
        (True, {"at_least": 1}, False),
        (["a", "b"], ["a", "b"], True),
        (["a"], ["a", "b"], False),
    ],
)
def test_other_bands(value: object, band: object, holds: bool) -> None:
    assert within(value, band) == holds
