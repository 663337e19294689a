"""Measured maps: the record is restored from every form; invalid files are rejected in one sentence."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.errors import refused

import printhammer as ph
from printhammer.maps.frequency import LAYOUT
from printhammer.maps.measured import load_measured_map
from printhammer.results import save_dataset

Write = Callable[[str], Path]

LONG = """# laser vibrometer
rate [kHz], time [us], displacement [um]
0.5,0,50
0.5,10,60

0.5,20,80
1.2,0,51
1.2,10,71
1.2,20,111
"""
WIDE = """time [ms],1.2 kHz [um],500 Hz [mil]
0.00,51,2
0.02,111,4
0.01,71,3
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def written(text: str) -> Path:
        path = tmp_path / "measured.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def test_one_row_for_each_sample(write: Write) -> None:
    found = load_measured_map(write(LONG))
    np.testing.assert_allclose(found["rate"], [500.0, 1200.0], rtol=1e-14)
    np.testing.assert_allclose(found["time"], [0.0, 10e-6, 20e-6], rtol=1e-14)
    np.testing.assert_allclose(
        found["displacement"], [[50e-6, 60e-6, 80e-6], [51e-6, 71e-6, 111e-6]], rtol=1e-6
    )
    assert found["displacement"].dtype == np.float32
    assert found["displacement"].dims == ("rate", "time")
    for name, variable in found.variables.items():
        assert LAYOUT[str(name)].attributes.items() <= variable.attrs.items()
    assert found.attrs["source"] == "measured.csv"


def test_one_column_for_each_rate(write: Write) -> None:
    found = load_measured_map(write(WIDE))
    np.testing.assert_array_equal(found["rate"], [500.0, 1200.0])
    np.testing.assert_allclose(
        found["displacement"], [[50.8e-6, 76.2e-6, 101.6e-6], [51e-6, 71e-6, 111e-6]], rtol=1e-6
    )


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.permutations(LONG.splitlines()[2:]))
def test_rows_come_in_any_order(tmp_path: Path, rows: list[str]) -> None:
    path = tmp_path / "shuffled.csv"
    path.write_text("\n".join([*LONG.splitlines()[:2], *rows]), encoding="utf-8")
    straight = tmp_path / "straight.csv"
    straight.write_text(LONG, encoding="utf-8")
    xr.testing.assert_equal(load_measured_map(path), load_measured_map(straight))


def test_gaps_stay_gaps(write: Write) -> None:
    text = LONG.replace("0.5,10,60", "0.5,10,nan").replace("1.2,20,111", "1.2,20,")
    found = load_measured_map(write(text))["displacement"].values
    np.testing.assert_array_equal(np.isfinite(found), [[True, False, True], [True, True, False]])


def test_every_rate_may_have_times_of_its_own(write: Write) -> None:
    rows = ["rate [Hz],time [us],displacement [um]"]
    rows += [f"500,{t},{2 * t + 7}" for t in range(0, 101, 10)]
    rows += [f"700,{t},{3 * t}" for t in range(25, 76, 5)]
    found = load_measured_map(write("\n".join(rows)))
    # The closest samples, 5 us apart, from the first time of any record to the last.
    t = found["time"].values
    np.testing.assert_allclose(t, np.arange(0, 101, 5) * 1e-6, rtol=1e-12, atol=1e-18)
    slow, fast = found["displacement"].values
    np.testing.assert_allclose(slow, 2.0 * t + 7e-6, rtol=1e-6)
    inside = (t > 24.9e-6) & (t < 75.1e-6)
    np.testing.assert_array_equal(np.isfinite(fast), inside)
    np.testing.assert_allclose(fast[inside], 3.0 * t[inside], rtol=1e-6)


def test_times_may_be_asked_for(write: Write) -> None:
    found = load_measured_map(write(LONG), times=[5e-6, 15e-6, 25e-6])
    np.testing.assert_allclose(
        found["displacement"], [[55e-6, 70e-6, np.nan], [61e-6, 91e-6, np.nan]], rtol=1e-6
    )
    with refused("times"):
        load_measured_map(write(LONG), times=[1.0, 0.0])


@pytest.mark.parametrize("engine", ["scipy", "zarr"])
def test_a_computed_map_is_read_as_a_measured_one(hammer: "ph.Hammer", tmp_path: Path, engine: str) -> None:
    chart = ph.frequency_map(hammer, [500.0, 900.0], times=101)
    path = tmp_path / ("map.zarr" if engine == "zarr" else "map.nc")
    save_dataset(chart, path)
    found = load_measured_map(path)
    xr.testing.assert_equal(found, chart[["displacement"]].drop_vars("firing", errors="ignore"))


def test_netcdf_with_other_units_order_and_times(tmp_path: Path) -> None:
    time = np.array([[0.0, 1.0, 2.0], [0.0, 2.0, np.nan]])
    x = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 9.0]])
    data = xr.Dataset(
        {
            "displacement": (("sample", "rate"), x.T, {"units": "mil"}),
            "time": (("rate", "sample"), time, {"units": "ms"}),
            "temperature": ((), 20.0),
        },
        coords={"rate": ("rate", [1.5, 0.5], {"units": "kHz"})},
    )
    path = tmp_path / "laboratory.nc"
    data.to_netcdf(path, engine="scipy")
    found = load_measured_map(path)
    np.testing.assert_array_equal(found["rate"], [500.0, 1500.0])
    np.testing.assert_allclose(found["time"], [0.0, 1e-3, 2e-3])
    np.testing.assert_allclose(
        found["displacement"], [[101.6e-6, 114.3e-6, 127e-6], [25.4e-6, 50.8e-6, 76.2e-6]], rtol=1e-6
    )


BAD_TABLES = {
    "no unit": (LONG.replace("time [us]", "time"), "time"),
    "unknown unit": (LONG.replace("[us]", "[uz]"), "time [uz]"),
    "other dimension": (LONG.replace("[um]", "[N]"), "displacement [N]"),
    "word": (LONG.replace("1.2,10,71", "1.2,10,much"), "displacement"),
    "infinite": (LONG.replace("1.2,10,71", "1.2,10,inf"), "displacement"),
    "no time": (LONG.replace("1.2,10,71", "1.2,,71"), "time"),
    "rate of zero": (LONG.replace("1.2,", "0,"), "rate"),
    "twice": (LONG.replace("1.2,10,71", "1.2,20,71"), "time"),
    "one sample": (LONG + "1.7,0,50\n", "rate"),
    "cells": (LONG.replace("1.2,10,71", "1.2,10"), "line 8"),
    "another column": (
        LONG.replace("displacement", "velocity"),
        "velocity [um]",
    ),
    "no rate": (WIDE.replace("1.2 kHz", "left"), "left"),
    "a record of one shot": ("time [us],current [A]\n0,1\n1,2\n", "rate"),
    "rate in metres": (WIDE.replace("1.2 kHz", "1.2 m"), "1.2 m"),
    "rate twice": (WIDE.replace("1.2 kHz", "0.5 kHz"), "500 Hz"),
    "empty": ("", "heading"),
    "heading alone": (WIDE.splitlines()[0], "rows"),
    "quotes": ('time [us],500 Hz [um]\n"0,1\n', "line 2"),
}


@pytest.mark.parametrize("kind", BAD_TABLES)
def test_odd_tables_are_told_with_column_and_line(write: Write, kind: str) -> None:
    text, key = BAD_TABLES[kind]
    with refused(key):
        load_measured_map(write(text))


def test_the_refusal_of_an_export_advises_columns_that_are_read(tmp_path: Path) -> None:
    path = tmp_path / "pico.csv"
    path.write_text("Time,Channel A\n(ms),(V)\n\n0,-1\n1,1\n", encoding="utf-8")
    with refused("Channel A", "Channel A") as caught:
        load_measured_map(path)
    (columns,) = re.findall("--columns such as '([^']*)'", str(caught.value.expected))
    chart = load_measured_map(path, columns=columns)
    np.testing.assert_allclose(chart["displacement"], [[-50e-6, 50e-6]])


def test_odd_files(tmp_path: Path) -> None:
    with refused(None, file="nowhere.csv"):
        load_measured_map(tmp_path / "nowhere.csv")
    with refused(None, file="nowhere.zarr"):
        load_measured_map(tmp_path / "nowhere.zarr")
    for start in (b"CDF\x01", b"\x89HDF\r\n\x1a\n"):
        (tmp_path / "broken.nc").write_bytes(start + b"broken")
        with refused(None, file="broken.nc"):
            load_measured_map(tmp_path / "broken.nc")
    (tmp_path / "latin.csv").write_bytes("time [µs],500 Hz [µm]\n0,1\n1,2\n".encode("latin-1"))
    np.testing.assert_allclose(load_measured_map(tmp_path / "latin.csv")["displacement"], [[1e-6, 2e-6]])


def laboratory(**changes: object) -> xr.Dataset:
    data = {
        "rate": ("rate", [500.0, 900.0], {"units": "Hz"}),
        "time": ("time", [0.0, 1e-3], {"units": "s"}),
        "displacement": (("rate", "time"), np.ones((2, 2)), {"units": "m"}),
        **changes,
    }
    return xr.Dataset({name: entry for name, entry in data.items() if entry is not None})


BAD_SETS = {
    "no displacement": ({"displacement": None}, "displacement"),
    "no unit": ({"time": ("time", [0.0, 1.0])}, "time"),
    "other unit": ({"time": ("time", [0.0, 1.0], {"units": "m"})}, "time"),
    "one dimension": (
        {"displacement": ("rate", [1.0, 2.0], {"units": "m"})},
        "displacement",
    ),
    "other dimension": ({"time": ("t", [0.0], {"units": "s"})}, "time"),
    "infinite": (
        {"displacement": (("rate", "time"), np.full((2, 2), np.inf), {"units": "m"})},
        "displacement",
    ),
    "rate twice": ({"rate": ("rate", [500.0, 500.0], {"units": "Hz"})}, "row 2"),
    "text": (
        {"displacement": (("rate", "time"), np.full((2, 2), "a"), {"units": "m"})},
        "displacement",
    ),
}


@pytest.mark.parametrize("kind", BAD_SETS)
def test_odd_data_sets(tmp_path: Path, kind: str) -> None:
    changes, key = BAD_SETS[kind]
    path = tmp_path / "laboratory.nc"
    laboratory(**changes).to_netcdf(path, engine="scipy")
    with refused(key):
        load_measured_map(path)
