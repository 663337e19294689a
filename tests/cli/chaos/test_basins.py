import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.drive.file import save_drive

PLANE = ("--x", "30 um, 260 um, 5", "--v", "-1 m/s, 1 m/s, 4")


def test_attractors_entropy_and_files(cli: Callable, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"cells.{kind}" for kind in ("csv", "nc", "png", "svg")}
    out = [word for path in paths.values() for word in ("--out", path)]
    done = cli("basins", CRUDE, "--period", "1.3 ms", *PLANE, "--box", "2", *out)
    assert done.status == 0
    assert "attractor 2" in done.out
    assert "0 of 20 cells" in done.out
    assert "boxes of 2 x 2 cells" in done.out
    found = ph.basins(ph.load(CRUDE), period=1.3e-3, x=(30e-6, 260e-6, 5), v=(-1.0, 1.0, 4))
    with xr.open_dataset(paths["nc"], engine="scipy") as chart:
        np.testing.assert_array_equal(chart["label"], found.labels)
    assert len(pd.read_csv(paths["csv"], comment="#")) == 20
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in paths["svg"].read_bytes()


@pytest.mark.slow
def test_manifolds_of_saddles_over_basins(cli: Callable, tmp_path: Path) -> None:
    picture = tmp_path / "b.svg"
    drive = tmp_path / "drive.toml"
    save_drive(ph.SineForce(0.3, 1.0 / (2.0 * math.pi), phase="90 deg"), drive)
    plane = ("--x", "-0.4 m, 0.1 m, 4", "--v", "-0.2 m/s, 0.3 m/s, 4", "--firings", "5", "--rounds", "1")
    done = cli("basins", "duffing-holmes", "--drive", drive, *plane, "--saddles", "1", "--out", picture)
    assert done.status == 0
    assert "manifolds of" in done.out
    text = picture.read_text("utf-8")
    assert "stable manifold 0" in text
    assert "unstable manifold 2" in text


def test_the_quench_map(cli: Callable, tmp_path: Path) -> None:
    out = tmp_path / "quench.nc"
    picture = tmp_path / "quench.png"
    words = ("--gaps", "650 us, 710 us, 4", "--widths", "300 us, 400 us, 3", "--units", "inch")
    done = cli("basins", "--quench", *words, "--out", out, "--out", picture)
    assert done.status == 0
    assert "second dots" in done.out
    assert "of 12 lost" in done.out
    assert "lbf" in done.out
    found = ph.quench_map(ph.load("hendriks-1983"), gaps=(650e-6, 710e-6, 4), widths=(300e-6, 400e-6, 3))
    with xr.open_dataset(out, engine="scipy") as chart:
        np.testing.assert_allclose(chart["force"], found.force, rtol=1e-9)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_run_that_stops_is_told(cli: Callable, tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    ph.load("hendriks-1983").replace("magnet.range_max", "250 um").save(path)
    done = cli("basins", path, "--period", "1 ms", "--x", "-10 um, 60 um, 2", "--v", "0 m/s, 0.1 m/s, 2")
    assert done.status == 1
    assert "2 of 4 runs ended early: range left" in done.err
    assert "no state" in done.out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--period and --rate"),
        (("--period", "1 ms", "--rate", "1 kHz"), "--period and --rate"),
        (("--period", "1 kg"), "period"),
        (("--period", "1 ms", "--x", "1 um, 2 um"), "--x"),
        (("--period", "1 ms", "--x", "1 um, 2 um, many"), "--x"),
        (("--period", "1 ms", "--x", "1 um, 2, 3"), "x"),
        (("--period", "1 ms", "--v", "1 m/s, 0 m/s, 3"), "v"),
        (("--period", "1 ms", "--firings", "2"), "firings"),
        (("--period", "1 ms", "--rounds", "0"), "rounds"),
        (("--period", "1 ms", "--gaps", "1 ms, 2 ms, 3"), "--gaps"),
        (("--quench", "--period", "1 ms"), "--period"),
        (("--quench", "--box", "2"), "--box"),
        (("--quench", "--saddles", "1"), "--saddles"),
        (("--period", "1 ms", "--saddles", "0"), "saddles"),
        (("--quench", "--gaps", "2 ms, 1 ms, 3"), "gaps"),
        (("--quench", "--tail", "-1 ms"), "tail"),
        (("--period", "1 ms", "--tolerance", "0"), "tolerance"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, options: tuple[str, ...], said: str) -> None:
    refused("basins", "hendriks-1983", *options, said=said)
