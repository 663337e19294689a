"""Motions as tables and files: all digits, units, provenance; existing files survive a failed write."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests import hammers
from tests.errors import refused

import printhammer as ph
from printhammer.run.motion import FORCES


@pytest.fixture(scope="module")
def motion() -> ph.Motion:
    hammer = hammers.crude()
    return ph.simulate(hammer, ph.PulseTrain(hammer.waveform), points=301)


def test_dataset(motion: ph.Motion) -> None:
    data = motion.to_xarray()
    np.testing.assert_array_equal(data["t"], motion.t)
    assert motion.hammer.damping is None
    forces = [name for name in FORCES if name != "drag"]
    units = {"t": "s", "x": "m", "v": "m/s", "current": "A", **{f"force_{name}": "N" for name in forces}}
    assert {name: data[name].attrs["units"] for name in units} == units
    np.testing.assert_array_equal(data["x"], motion.x)
    np.testing.assert_array_equal(data["force_pack"], motion.force["pack"])
    assert data.attrs["hammer_fingerprint"] == motion.hammer.fingerprint


def test_csv_round_trip(motion: ph.Motion, tmp_path: Path) -> None:
    path = tmp_path / "motion.csv"
    motion.to_csv(path)
    head = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    heading = head[0].split(",")
    assert heading == list(motion.to_pandas().columns)
    assert heading[:4] == ["t [s]", "x [m]", "v [m/s]", "current [A]"]
    np.testing.assert_array_equal(np.loadtxt(head[1:], delimiter=","), motion.to_pandas().to_numpy())
    assert [entry.name for entry in tmp_path.iterdir()] == ["motion.csv"]


def test_parquet_round_trip(motion: ph.Motion, tmp_path: Path) -> None:
    path = tmp_path / "motion.parquet"
    motion.to_parquet(path)
    table = pd.read_parquet(path)
    pd.testing.assert_frame_equal(table, motion.to_pandas())
    assert table.attrs["hammer_fingerprint"] == motion.hammer.fingerprint


def test_a_failed_write_leaves_what_was_there(motion: ph.Motion, tmp_path: Path) -> None:
    with refused(None, file="motion.csv"):
        motion.to_csv(tmp_path / "missing" / "motion.csv")
    taken = tmp_path / "taken.csv"
    taken.mkdir()
    with refused(None, file="taken.csv"):
        motion.to_csv(taken)
    assert [entry.name for entry in tmp_path.iterdir()] == ["taken.csv"]
