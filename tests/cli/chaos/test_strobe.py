import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import printhammer as ph


def test_points_and_verdict(cli: Callable, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"points.{kind}" for kind in ("csv", "nc", "json", "png", "svg")}
    out = [word for path in paths.values() for word in ("--out", path)]
    done = cli("strobe", "--period", "3 ms", "--points", "20", "--transient", "10", *out)
    assert done.status == 0
    assert "period 1" in done.out
    assert "20, at the firings 11 to 30" in done.out
    assert "per firing" in done.out
    assert "firings 1001 to 2000, tolerance 2e-11" in done.out
    found = ph.strobe(ph.load("hendriks-1983"), period=3e-3, points=20, transient=10, verdict=False)
    # Read as text, so that no digit depends on how a table is read.
    table = pd.read_csv(paths["csv"], dtype=str, comment="#")
    np.testing.assert_array_equal(table["x [m]"].map(float), found.x)
    np.testing.assert_array_equal(table["v [m/s]"].map(float), found.v)
    with xr.open_dataset(paths["nc"], engine="scipy") as chart:
        np.testing.assert_array_equal(chart["x"], found.x)
    kept = json.loads(paths["json"].read_text("utf-8"))
    assert kept["verdict"] == "period-1"
    assert kept["columns"]["x"]["values"] == found.x.tolist()
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in paths["svg"].read_bytes()


def test_no_verdict_other_phase_and_inches(cli: Callable) -> None:
    options = ("--rate", "1 kHz", "--points", "3", "--phase", "0.25", "--no-verdict", "--units", "inch")
    done = cli("strobe", "hendriks-1983", *options)
    assert done.status == 0
    assert "verdict" not in done.out
    assert "0.25 of a period later" in done.out
    assert "mil" in done.out


def test_a_run_that_stops_is_told(cli: Callable, tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    ph.load("hendriks-1983").replace("magnet.range_max", "250 um").save(path)
    points = tmp_path / "points.csv"
    done = cli("strobe", path, "--period", "1 ms", "--points", "3", "--out", points)
    assert done.status == 1
    assert "range left" in done.err
    assert "undecided" in done.out
    assert len(pd.read_csv(points, comment="#")) == 3


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--period and --rate"),
        (("--period", "1 ms", "--rate", "1 kHz"), "--period and --rate"),
        (("--period", "1 kg"), "period"),
        (("--period", "-1 ms"), "period"),
        (("--period", "1 ms", "--points", "0"), "points"),
        (("--period", "1 ms", "--transient", "-3"), "transient"),
        (("--period", "1 ms", "--phase", "1"), "phase"),
        (("--period", "1 ms", "--tolerance", "0"), "tolerance"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, options: tuple[str, ...], said: str) -> None:
    refused("strobe", "hendriks-1983", *options, said=said)
