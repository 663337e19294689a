import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.printing.dots.judging import FAULTS, Limits
from printhammer.printing.dots.strategy import FIRST_SLOT
from printhammer.printing.rates.quality import Quality, pattern_of, quality

PATTERN = "1101"
RATE = 900.0


@pytest.fixture(scope="module")
def found(hammer: "ph.Hammer") -> Quality:
    return quality(hammer, RATE, PATTERN, pitch=1e-3)


def test_the_report_is_that_of_the_motion(hammer: "ph.Hammer", found: Quality) -> None:
    at = [FIRST_SLOT + slot / RATE for slot in (0, 1, 3)]
    motion = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, at=at), points=2)
    single = ph.simulate(hammer, ph.PulseTrain(hammer.waveform), duration=4e-3).dots[0]
    struck = [dot for dot in motion.dots if dot.struck]
    assert int(found.lost.sum()) == 3 - len(struck)
    forces = [dot.peak_force for dot in struck]
    flights = [dot.flight_time for dot in struck]
    assert found.force_spread.mean == pytest.approx(np.mean(forces), rel=1e-6)
    assert found.force_spread.peak_to_peak == pytest.approx(np.ptp(forces), rel=1e-5, abs=1e-6)
    assert found.flight_time_spread.deviation == pytest.approx(np.std(flights), rel=1e-5, abs=1e-10)
    late = np.array(flights) - single.flight_time
    assert found.arrival_spread.mean == pytest.approx(late.mean(), abs=1e-9)
    # One millimetre to the slot, 900 slots a second: 0.9 m/s.
    assert found.placement_spread.high == pytest.approx(0.9 * late.max(), abs=1e-9)
    assert found.mean_power == pytest.approx(motion.energy.coil_work * RATE / 4.0, rel=1e-6)
    touches = [c for c in motion.contacts if c.surface == "backstop" and not c.initial]
    assert found.wear.touches == len(touches)
    assert found.backstop_loss == pytest.approx(motion.energy.backstop_loss / 3.0, rel=1e-6)


def test_without_a_pattern_it_is_the_cycle_after_its_lead_in(hammer: "ph.Hammer") -> None:
    cycle = quality(hammer, 400.0)
    assert cycle.passed
    assert cycle.judged_from == 64
    assert len(cycle.wanted) == 320
    assert len(cycle.slot) == 128
    assert cycle.slot.min() >= 64
    assert cycle.fired > 128


def test_a_number_is_a_train(hammer: "ph.Hammer") -> None:
    assert quality(hammer, "0.4 kHz", 3).slot.tolist() == [0, 1, 2]


def test_tolerances_of_the_paper(hammer: "ph.Hammer") -> None:
    slow = quality(hammer, 100.0, 2)
    assert slow.engraved
    assert slow.dot_matrix
    weak = hammer.replace("waveform.amplitude", 0.1 * hammer.waveform.amplitude)
    lost = quality(weak, 100.0, 2, nominal=slow.nominal)
    assert lost.missing == 1.0
    assert lost.force_spread.count == 0
    assert math.isnan(lost.force_spread.mean)
    assert not lost.dot_matrix
    assert not lost.passed


def test_a_dot_fired_ahead_of_its_slot_may_fly_longer(hammer: "ph.Hammer") -> None:
    slow = quality(hammer, 100.0, 2)
    longer = np.array([0.0, 1e-3])
    assert replace(slow, flight_time=slow.flight_time + longer).engraved
    assert not replace(slow, arrival_deviation=slow.arrival_deviation + longer).dot_matrix


def test_heat_needs_a_resistance(hammer: "ph.Hammer", found: Quality) -> None:
    assert found.mean_heat is None
    warm = quality(hammer.replace("coil.resistance", "5 ohm"), RATE, PATTERN)
    grid = np.linspace(0.0, warm.drive.end, 400_001)
    heat = 5.0 * np.trapezoid(warm.drive.value(grid) ** 2, grid)
    assert warm.mean_heat == pytest.approx(heat * RATE / 4.0, rel=1e-4)


def test_a_run_that_stops_is_told(hammer: "ph.Hammer", found: Quality) -> None:
    # The range of the magnet ends within the indentation of the first dot.
    short = hammer.replace("magnet.range_max", hammer.front + 1e-6)
    stopped = quality(short, RATE, PATTERN, nominal=found.nominal)
    assert stopped.status == "range left"
    assert not stopped.passed
    assert [FAULTS[code] for code in stopped.fault] == ["not run"] * 3
    assert not stopped.dot_matrix


def test_limits_decide(hammer: "ph.Hammer", found: Quality) -> None:
    wide = quality(hammer, RATE, PATTERN, limits=Limits(force=10.0, arrival=1.0, extra_contacts=10))
    assert (wide.fault < 0).sum() == 3 - wide.lost.sum()
    none = quality(hammer, RATE, PATTERN, limits=Limits(force=0.0))
    assert not none.passed
    assert none.force.tolist() == found.force.tolist()


def test_files_hold_the_dots(found: Quality, tmp_path: Path) -> None:
    for name in ("dots.nc", "dots.csv", "dots.json"):
        found.save(tmp_path / name)
    with xr.open_dataset(tmp_path / "dots.nc", engine="scipy") as chart:
        np.testing.assert_array_equal(chart["force"], found.force)
        assert chart["arrival_deviation"].attrs["units"] == "s"
        assert chart.attrs["hammer_fingerprint"] == found.hammer.fingerprint
    rows = pd.read_csv(tmp_path / "dots.csv", comment="#")
    np.testing.assert_array_equal(rows["flight_time [s]"], found.flight_time)
    kept = json.loads((tmp_path / "dots.json").read_text())
    assert kept["columns"]["slot"]["values"] == [0, 1, 3]
    assert kept["pattern"] == PATTERN
    assert kept["mean_power_W"] == found.mean_power
    assert {"rate_Hz", "missing", "force_peak_to_peak_N", "work_per_dot_J", "engraved_tolerance"} <= set(kept)
    assert "mean_heat_W" not in kept
    with refused(None, file="dots.txt"):
        found.save(tmp_path / "dots.txt")
    assert not (tmp_path / "dots.txt").exists()


@given(st.lists(st.booleans(), min_size=1, max_size=40).filter(any))
def test_patterns_are_read_alike_as_text_and_as_truth_values(slots: list[bool]) -> None:
    text = "".join("1" if wanted else "0" for wanted in slots)
    np.testing.assert_array_equal(pattern_of(text), pattern_of(np.array(slots)))


@pytest.mark.parametrize(
    ("given_", "key"),
    [
        ("", "pattern"),
        ("12", "pattern"),
        ("000", "pattern"),
        (0, "pattern"),
        (20_001, "pattern"),
        (True, "pattern"),
        ([0, 1], "pattern"),
        (np.ones((2, 2), bool), "pattern"),
    ],
)
def test_bad_patterns_are_refused(given_: object, key: str) -> None:
    with refused(key):
        pattern_of(given_)


@pytest.mark.parametrize(
    ("options", "key"),
    [({"rate": 0.0}, "rate"), ({"rate": "1 ms"}, "rate"), ({"rate": 900.0, "pitch": "-1 mm"}, "pitch")],
)
def test_bad_numbers_are_refused(hammer: "ph.Hammer", options: dict[str, object], key: str) -> None:
    with refused(key):
        quality(hammer, **options)


def test_a_hammer_without_pack_or_waveform_is_refused(hammer: "ph.Hammer") -> None:
    for part in ("pack", "waveform"):
        with refused(part):
            quality(hammer.replace(part, None), RATE)
