"""Frequency-time maps: equal to single runs, for any number of threads, saved and read back."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.maps.frequency import LAYOUT, interpolated, map_dataset, rms_difference
from printhammer.results import save_dataset

STROKE = 234e-6
"""Single-pulse peak less backstop of the shipped hammer, m: Figs. 8 and 9 print 284 um from the origin."""

EARLY = 4e-3
"""Time up to which runs of different arithmetic agree, s."""

RATES = np.array([500.0, 875.0, 1100.0, 1515.0, 2200.0])


@pytest.fixture(scope="module")
def chart(hammer: "ph.Hammer") -> xr.Dataset:
    return ph.frequency_map(hammer, RATES, times=301)


def test_a_map_is_what_single_runs_are(hammer: "ph.Hammer", chart: xr.Dataset) -> None:
    times = chart["time"].values
    lost = 0
    for row, rate in enumerate(RATES):
        drive = ph.PulseTrain(hammer.waveform, rate=rate, pulses=9)
        motion = ph.simulate(hammer, drive, duration=float(times[-1]), times=times)
        # Lanes and the single run differ by what the tolerance allows; later impacts make it larger.
        early = times <= EARLY
        shown = chart["displacement"].values[row]
        np.testing.assert_allclose(shown[early], motion.x[early], rtol=0.0, atol=1e-6 * STROKE)
        for dot in motion.dots:
            if dot.fired_at > EARLY:
                continue
            found = chart.isel(rate=row, firing=dot.index)
            assert found["fired_at"] == dot.fired_at
            assert bool(found["struck"]) == dot.struck
            if dot.struck:
                assert float(found["flight_time"]) == pytest.approx(dot.flight_time, rel=1e-6)
                assert float(found["peak_force"]) == pytest.approx(dot.peak_force, rel=1e-6)
            else:
                lost += 1
                assert np.isnan(found["flight_time"])
                assert np.isnan(found["peak_force"])
    assert lost > 0


def test_time_runs_from_the_first_firing_to_1_ms_after_the_last_at_the_lowest_rate(
    hammer: "ph.Hammer", chart: xr.Dataset
) -> None:
    assert float(chart["time"][0]) == 0.0
    assert float(chart["time"][-1]) == pytest.approx(8.0 / 500.0 + 1e-3, rel=1e-15)
    whole = ph.frequency_map(hammer, times=16)
    assert whole["rate"].size == 512
    assert (float(whole["rate"][0]), float(whole["rate"][-1])) == (500.0, 2000.0)
    assert whole["firing"].size == 9
    assert whole["displacement"].dtype == np.float32
    assert (whole["status"] == 0).all()


def test_the_same_bits_for_any_threads_and_any_neighbours(hammer: "ph.Hammer", chart: xr.Dataset) -> None:
    one = ph.frequency_map(hammer, RATES, times=301, threads=1)
    xr.testing.assert_identical(one.drop_attrs(), chart.drop_attrs())
    alone = ph.frequency_map(hammer, RATES[2:3], times=chart["time"].values)
    np.testing.assert_array_equal(alone["displacement"].values[0], chart["displacement"].values[2])


def test_units_and_provenance(hammer: "ph.Hammer", chart: xr.Dataset) -> None:
    for name, variable in chart.variables.items():
        assert LAYOUT[str(name)].attributes.items() <= variable.attrs.items()
    assert chart.attrs["hammer"] == "hendriks-1983"
    assert chart.attrs["hammer_fingerprint"] == hammer.fingerprint
    assert chart.attrs["printhammer"] == ph.__version__
    assert chart.attrs["pulses"] == 9
    assert {"numpy", "llvmlite", "tolerance", "waveform", "overlap", "made"} <= set(chart.attrs)
    assert chart.attrs["pack_front_m"] == hammer.front


@pytest.mark.parametrize("name", ["map.nc", "map.zarr"])
def test_a_map_is_read_back_as_it_was(chart: xr.Dataset, tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    for _ in range(2):
        save_dataset(chart, path)
    back = xr.load_dataset(path, engine="scipy" if path.is_file() else "zarr")
    xr.testing.assert_identical(back, chart)
    assert back["displacement"].dtype == np.float32
    assert list(tmp_path.iterdir()) == [path]


def test_a_map_is_not_half_written(chart: xr.Dataset, tmp_path: Path) -> None:
    with refused(None, file="map.txt"):
        save_dataset(chart, tmp_path / "map.txt")
    for name in ("map.nc", "map.zarr"):
        with refused(None):
            save_dataset(chart, tmp_path / "nowhere" / name)
    assert list(tmp_path.iterdir()) == []


def test_a_run_that_cannot_go_on_is_a_row(hammer: "ph.Hammer") -> None:
    short = hammer.replace("magnet.range_max", "287 um")
    rates = np.linspace(500.0, 1500.0, 21)
    found = ph.frequency_map(short, rates, times=301)
    failed = np.flatnonzero(found["status"].values)
    assert 0 < failed.size < rates.size
    assert "range left" in found["status"].attrs["codes"]
    for row, rate in enumerate(rates):
        motion = ph.simulate(
            short, ph.PulseTrain(hammer.waveform, rate=rate, pulses=9), duration=float(found["time"][-1])
        )
        assert motion.ok == (row not in failed)
        known = np.isfinite(found["displacement"].values[row])
        np.testing.assert_array_equal(known, found["time"].values <= motion.end)
        fired = np.isfinite(found["fired_at"].values[row])
        assert fired.sum() == len(motion.dots)


def test_progress_is_told(hammer: "ph.Hammer") -> None:
    told: list[tuple[int, int]] = []
    ph.frequency_map(hammer, RATES, times=2, progress=lambda done, of: told.append((done, of)))
    assert told[-1] == (5, 5)


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"rates": []}, "rates"),
        ({"rates": [500.0, np.nan]}, "rates"),
        ({"rates": [-5.0]}, "rates"),
        ({"rates": [500.0, 500.0]}, "rates"),
        ({"rates": ["fast"]}, "rates"),
        ({"pulses": 0}, "pulses"),
        ({"times": 1}, "times"),
        ({"times": 2.5}, "times"),
        ({"times": [1e-3, 1e-4]}, "times"),
        ({"times": [-1e-3, 1e-4]}, "times"),
        ({"times": [np.inf]}, "times"),
        ({"rates": range(1, 20002), "times": 10**4}, "rates"),
        ({"tolerance": 1.0}, "tolerance"),
        ({"threads": 0}, "threads"),
        ({"overlap": "both"}, "overlap"),
    ],
)
def test_bad_input(hammer: "ph.Hammer", options: dict[str, object], key: str) -> None:
    with refused(key):
        ph.frequency_map(hammer, **options)


def test_a_hammer_without_a_waveform_is_given_one(hammer: "ph.Hammer") -> None:
    bare = hammer.replace("waveform", None)
    with refused("waveform"):
        ph.frequency_map(bare, RATES)
    found = ph.frequency_map(bare, RATES[:1], times=11, waveform=hammer.waveform)
    assert found["struck"].all()


def test_the_difference_of_two_maps(chart: xr.Dataset) -> None:
    shifted = chart.assign(displacement=chart["displacement"] + np.float32(3e-6))
    rates, difference = rms_difference(chart, shifted)
    np.testing.assert_array_equal(rates, RATES)
    np.testing.assert_allclose(difference, 3e-6, rtol=1e-4)
    rates, difference = rms_difference(chart, shifted.isel(rate=[1, 3], time=slice(40, 200, 2)))
    np.testing.assert_array_equal(rates, RATES[[1, 3]])
    np.testing.assert_allclose(difference, 3e-6, rtol=1e-4)
    # The closer times are joined, whichever map has them: coarse ones would cut off the peaks.
    for one, other in (
        (chart, shifted.isel(time=slice(None, None, 30))),
        (chart.isel(time=[4, 90]), shifted),
    ):
        np.testing.assert_allclose(rms_difference(one, other)[1], 3e-6, rtol=1e-4)
    empty = chart.assign(displacement=chart["displacement"] * np.nan)
    assert np.isnan(rms_difference(chart, empty)[1]).all()
    assert rms_difference(chart, chart.assign_coords(rate=RATES + 1.0))[0].size == 0


@given(
    st.lists(st.integers(0, 50), min_size=2, max_size=12, unique=True).map(sorted),
    st.lists(st.floats(-5.0, 55.0), min_size=1, max_size=20),
    st.data(),
)
def test_gaps_stay_gaps(at: list[int], times: list[float], data: st.DataObject) -> None:
    known = np.array(at, dtype=float)
    gaps = np.array(data.draw(st.lists(st.booleans(), min_size=len(at), max_size=len(at))))
    values = np.where(gaps, np.nan, 3.0 * known + 1.0)
    for time, found in zip(times, interpolated(known, values, np.array(times)), strict=True):
        # A time within the last bit of an end is meant to be the end.
        nearest = float(np.clip(time, known[0], known[-1]))
        t = nearest if abs(time - nearest) <= 1e-12 * known[-1] else time
        on_sample = np.flatnonzero(known == t)
        if on_sample.size:
            expected = values[on_sample[0]]
        elif t < known[0] or t > known[-1]:
            expected = np.nan
        else:
            right = int(np.searchsorted(known, t))
            expected = 3.0 * t + 1.0 if np.isfinite(values[right - 1 : right + 1]).all() else np.nan
        assert found == pytest.approx(expected, abs=1e-9, nan_ok=True)


def test_a_map_of_one_rate_and_no_firings() -> None:
    found = map_dataset([700.0], [0.0, 1e-3], {"displacement": np.zeros((1, 2), np.float32)}, {})
    assert "firing" not in found.dims
