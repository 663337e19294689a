"""Tests of the claim about the frequency-time map, and of the claims about bursts, which use ensembles."""

import numpy as np
import pytest

import printhammer as ph
from printhammer.claims import Context, NotMeasurableError, claims, judge
from printhammer.claims.bursts import (
    _exceeds,
    erratic_pairs,
    erratic_share,
    onsets,
    sensitivity,
    spreads,
)


def test_the_change_per_hertz_is_that_of_two_records(context: Context) -> None:
    ends = 8.0 / 550.0 + 1e-3
    times = np.arange(0.0, ends, 2e-6)
    slow, fast = (
        ph.simulate(
            context.hammer, ph.PulseTrain(context.waveform, rate=rate, pulses=9), duration=ends, times=times
        ).x
        for rate in (550.0, 550.5)
    )
    expected = np.sqrt(np.mean(((fast - slow) / 0.5) ** 2))
    assert sensitivity(context, (550.0, 551.0), 5.0, 0.5, 9) == pytest.approx(expected, rel=0.02)


def test_where_the_response_varies_slowly_the_step_does_not_matter(context: Context) -> None:
    coarse, fine = (sensitivity(context, (500.0, 560.0), 10.0, step, 9) for step in (0.2, 0.05))
    assert coarse == pytest.approx(fine, rel=0.01)


def test_a_band_needs_two_rates(context: Context) -> None:
    with pytest.raises(NotMeasurableError, match="there are no two rates to compare"):
        sensitivity(context, (500.0, 500.05), 5.0, 0.1, 9)


def test_map_sensitivity_compares_three_bands(context: Context) -> None:
    value = judge(context, claims()["map_sensitivity"]).value
    onset = judge(context, claims()["order_of_onset"]).value
    hung = judge(context, claims()["hang_up_at_high_rate"]).value
    assert value["erratic_from_Hz"] == onset["flight_time_varies_from_Hz"]
    assert value["hang_up_rate_Hz"] == hung["hang_up_rate_Hz"]
    assert value["erratic_over_low"] == pytest.approx(value["erratic_m_per_Hz"] / value["low_m_per_Hz"])
    assert value["erratic_over_hung_up"] == pytest.approx(
        value["erratic_m_per_Hz"] / value["hung_up_m_per_Hz"]
    )


def test_a_hammer_that_never_hangs_up_is_told(hammer: "ph.Hammer") -> None:
    slow = Context(hammer.replace("waveform.amplitude", "0.7 A"))
    result = judge(slow, claims()["map_sensitivity"])
    assert result.verdict == "fails"
    assert result.value is None or result.value["erratic_over_low"] is None


def test_onsets_are_those_of_single_runs(context: Context) -> None:
    found = onsets(context)
    settings = claims()["order_of_onset"].settings
    checks = {
        "flight_time": lambda struck, force, flight: flight > settings["flight_time_spread_s"],
        "force": lambda struck, force, flight: force > settings["force_spread"],
        "lost": lambda struck, force, flight: struck < settings["pulses"],
    }
    for name, rate in found.items():
        below, at = (spreads(context.train(at, 9)) for at in (rate - settings["rate_step_Hz"], rate))
        assert not checks[name](*below)
        assert checks[name](*at)


def test_a_sample_above_the_limit_is_enough(context: Context) -> None:
    for rate in (500.0, 4000.0, 5550.0, 5555.0, 6000.0):
        drive = ph.PulseTrain(context.waveform, rate=rate, pulses=9)
        assert _exceeds(drive, 2.0) == (drive.peak > 2.0)


SETTINGS = {"first_dot": 3, "flight_time_change_s": 20.0, "flight_time_spread_s": 5.0}


def test_pairs_of_rates_between_which_a_late_dot_changes() -> None:
    flights = np.full((6, 4), 100.0)
    struck = np.ones((6, 4), dtype=bool)
    flights[1, 1] = 150.0  # the second dot does not count as a late one
    flights[2, 2] = 119.0  # less than a change
    flights[3, 3] = 121.0
    struck[4, 2] = False
    flights[5] = 90.0  # all dots alike, however early
    erratic, varies = erratic_pairs(struck, flights, SETTINGS)
    assert erratic.tolist() == [False, False, True, True, True]
    assert varies.tolist() == [False, True, True, True, True, False]
    rates = np.arange(6) * 10.0 + 700.0
    assert erratic_share(rates, erratic, varies, None) == (0.75, 710.0)
    assert erratic_share(rates, erratic, varies, 730.0) == (0.5, 710.0)
    assert erratic_share(rates, erratic, varies, 715.0) == (None, 710.0)
    assert erratic_share(rates, erratic, ~np.ones(6, dtype=bool), None) == (None, None)


def test_a_rate_without_a_dot_is_lost() -> None:
    none = np.zeros((2, 4), dtype=bool)
    erratic, varies = erratic_pairs(none, np.full((2, 4), np.nan), SETTINGS)
    assert varies.all()
    assert not erratic.any()


def test_the_chaotic_region_is_that_of_the_map(context: Context) -> None:
    """The same fraction, counted cell by cell in a map of the hammer."""
    rates = np.arange(700.0, 1499.0, 3.0)
    table = ph.frequency_map(context.hammer, rates=rates)
    flights, struck = table.flight_time.values, table.struck.values
    count = 0
    for k in range(len(rates) - 1):
        pairs = [(struck[k, d], struck[k + 1, d], flights[k, d], flights[k + 1, d]) for d in range(3, 9)]
        count += any(a != b or (a and abs(f - g) > 20e-6) for a, b, f, g in pairs)
    value = judge(context, claims()["chaotic_region"]).value
    assert value["erratic_share_of_all"] == pytest.approx(count / (len(rates) - 1))
