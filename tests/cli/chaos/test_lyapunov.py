import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import printhammer as ph

FEW = ("--firings", "120", "--transient", "100")


def test_one_train(cli: Callable, tmp_path: Path) -> None:
    paths = {kind: tmp_path / f"one.{kind}" for kind in ("csv", "nc", "json", "png", "svg")}
    out = [word for path in paths.values() for word in ("--out", path)]
    done = cli("lyapunov", "--period", "1.3 ms", *FEW, *out)
    assert done.status == 0
    found = ph.lyapunov(ph.load("hendriks-1983"), period=1.3e-3, firings=120, transient=100)
    assert f"{found.exponents[0]:+.4g} ±" in done.out
    assert "growth from firing 101 to 221" in done.out
    assert found.zero_one.phrase in done.out
    assert found.verdict.name.replace("-", " ") in done.out
    # Read as text, so that no digit depends on how a table is read.
    table = pd.read_csv(paths["csv"], dtype=str, comment="#")
    assert table["exponent 1 [1/firing]"].map(float).tolist() == [found.exponents[0]]
    with xr.open_dataset(paths["nc"], engine="scipy") as chart:
        np.testing.assert_array_equal(chart["exponents"][0], found.exponents)
    kept = json.loads(paths["json"].read_text("utf-8"))["columns"]
    assert kept["zero_one"]["values"] == [found.zero_one.verdict]
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in paths["svg"].read_bytes()


@pytest.mark.parametrize(
    ("options", "periods"),
    [
        (("--period", "1.3 ms, 0.8 ms"), [1.3e-3, 0.8e-3]),
        (("--rate", "1 kHz, 800 Hz"), [1e-3, 1.25e-3]),
        (("--from", "1 ms", "--to", "1.2 ms", "--steps", "3"), [1e-3, 1.1e-3, 1.2e-3]),
    ],
)
def test_many_trains(cli: Callable, tmp_path: Path, options: tuple[str, ...], periods: list[float]) -> None:
    path, picture = tmp_path / "many.csv", tmp_path / "many.pdf"
    done = cli("lyapunov", *options, *FEW, "--threads", "2", "--out", path, "--out", picture)
    assert done.status == 0
    assert f"{len(periods)} trains: the exponent and the 0-1 test agree on" in done.out
    assert "[ms]" in done.out
    assert pd.read_csv(path, comment="#")["period [s]"].to_numpy() == pytest.approx(periods)
    assert picture.read_bytes().startswith(b"%PDF")


def test_a_run_that_stops_is_told(cli: Callable, tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    ph.load("hendriks-1983").replace("magnet.range_max", "250 um").save(path)
    points = tmp_path / "exponents.csv"
    for periods, said in (("1 ms", "1 of 1 runs"), ("1 ms, 1.1 ms", "2 of 2 runs")):
        done = cli("lyapunov", path, "--period", periods, *FEW, "--out", points, "--force")
        assert done.status == 1
        assert said in done.err
        assert "range left" in done.err
        assert "undecided" in done.out
        assert (pd.read_csv(points, comment="#")["status"] == "range left").all()


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "--period, --rate, or --from and --to"),
        (("--period", "1 ms", "--rate", "1 kHz"), "--period"),
        (("--period", "1 ms", "--from", "1 ms", "--to", "2 ms"), "--period"),
        (("--from", "1 ms"), "--to"),
        (("--to", "1 ms"), "--from"),
        (("--from", "2 ms", "--to", "1 ms"), "above"),
        (("--from", "1 ms", "--to", "2 ms", "--steps", "1"), "--steps"),
        (("--period", "1 ms", "--steps", "5"), "--steps"),
        (("--period", "1 ms, 2 kg"), "--period"),
        (("--period", "-1 ms"), "period"),
        (("--period", "1 ms", "--firings", "0"), "firings"),
        (("--period", "1 ms", "--transient", "-3"), "transient"),
        (("--period", "1 ms, 2 ms", "--threads", "0"), "threads"),
        (("--period", "1 ms", "--tolerance", "0"), "tolerance"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, options: tuple[str, ...], said: str) -> None:
    refused("lyapunov", "hendriks-1983", *options, said=said)
