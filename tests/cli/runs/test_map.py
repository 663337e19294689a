"""The verb `map`: messages, files and rejected input."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
import xarray as xr

import printhammer as ph
from printhammer.results import save_dataset

if TYPE_CHECKING:
    from collections.abc import Callable

SMALL = ("--rates", "4", "--times", "31", "--to", "1.1 kHz")


def told(text: str) -> str:
    return " ".join(text.split())


def test_what_is_written_is_the_map(
    cli: "Callable[..., object]", hammer: "ph.Hammer", tmp_path: Path
) -> None:
    files = [tmp_path / name for name in ("map.nc", "map.zarr", "map.png", "map.svg")]
    outcome = cli("map", *SMALL, *(part for file in files for part in ("--out", file)))
    assert (outcome.status, outcome.err) == (0, "")
    assert sorted(tmp_path.iterdir()) == sorted(files)
    expected = ph.frequency_map(hammer, np.linspace(500.0, 1100.0, 4), times=31)
    for path, engine in zip(files, ("scipy", "zarr"), strict=False):
        xr.testing.assert_equal(xr.load_dataset(path, engine=engine), expected)
    assert files[2].read_bytes()[:4] == b"\x89PNG"
    lost = int((~expected["struck"]).sum())
    assert "4 rates from 500 to 1100 Hz, 9 pulses, 31 times up to 17 ms" in told(outcome.out)
    assert f"36 fired, {36 - lost} struck, {lost} lost" in told(outcome.out)
    assert "status ok" in told(outcome.out)
    assert all(f"wrote {path}" in told(outcome.out) for path in files)


def test_figure_8_or_9_is_drawn(cli: "Callable[..., object]", tmp_path: Path) -> None:
    for number, marks in (("8", "rate 500"), ("9", "firing 1")):
        path = tmp_path / f"{number}.svg"
        assert cli("map", *SMALL, "--out", path, "--figure", number).status == 0
        assert f'id="{marks}"' in path.read_text("utf-8")


def test_nothing_is_written_over(cli: "Callable[..., object]", tmp_path: Path) -> None:
    for name in ("map.nc", "map.zarr", "map.png"):
        path = tmp_path / name
        assert cli("map", *SMALL, "--out", path).status == 0
        before = path.stat().st_mtime_ns
        outcome = cli("map", *SMALL, "--out", path)
        assert outcome.status == 2
        assert f"{name}: expected a new file, but the file exists; --force overwrites" in told(outcome.err)
        assert path.stat().st_mtime_ns == before
        assert cli("map", *SMALL, "--out", path, "--force").status == 0
        assert path.stat().st_mtime_ns > before


def test_a_folder_that_is_no_store_is_left_alone(cli: "Callable[..., object]", tmp_path: Path) -> None:
    folder = tmp_path / "thesis.zarr"
    folder.mkdir()
    (folder / "chapter.txt").write_text("years of work")
    outcome = cli("map", *SMALL, "--out", folder, "--force")
    assert outcome.status == 2
    assert "is no Zarr store" in told(outcome.err)
    assert (folder / "chapter.txt").read_text() == "years of work"
    assert list(tmp_path.iterdir()) == [folder]


def test_the_rates_and_times_of_a_measured_map(
    cli: "Callable[..., object]", hammer: "ph.Hammer", tmp_path: Path
) -> None:
    rates = np.array([520.0, 700.0, 910.0])
    chart = ph.frequency_map(hammer, rates, times=200)
    save_dataset(
        chart.assign(displacement=chart["displacement"] + np.float32(1e-6)), tmp_path / "measured.nc"
    )
    outcome = cli("map", "--measured", tmp_path / "measured.nc", "--out", tmp_path / "both.png")
    assert (outcome.status, outcome.err) == (0, "")
    assert "3 rates from 520 to 910 Hz" in told(outcome.out)
    assert "difference RMS 1 µm (median of 3 rates)" in told(outcome.out)
    assert (tmp_path / "both.png").is_file()
    outcome = cli("map", *SMALL, "--from", "510 Hz", "--measured", tmp_path / "measured.nc")
    assert "4 rates from 510 to 1100 Hz" in told(outcome.out)
    assert "difference not known, no rate is in both maps" in told(outcome.out)


def test_runs_that_stop_are_named(cli: "Callable[..., object]", hammer: "ph.Hammer", tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    hammer.replace("magnet.range_max", "287 um").save(path)
    outcome = cli("map", path, "--rates", "21", "--to", "1.5 kHz", "--out", tmp_path / "map.nc")
    assert outcome.status == 1
    chart = xr.load_dataset(tmp_path / "map.nc", engine="scipy")
    failed = chart["rate"].values[chart["status"].values != 0]
    assert f"range left: {failed.size} of 21 runs did not reach their end, at {failed[0]:.6g} Hz" in told(
        outcome.err
    )
    assert f"status {failed.size} of 21 runs did not reach their end" in told(outcome.out)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--from", "500"), "--from: '500' has no unit"),
        (("--to", "2 mm"), "--to: the unit 'mm' is a length"),
        (("--from", "0 Hz"), "--from = '0 Hz'"),
        (
            ("--from", "2 kHz", "--to", "1 kHz"),
            "--from 2000 Hz and --to 1000 Hz",
        ),
        (("--rates", "0"), "--rates 0"),
        (("--times", "1"), "times = 1"),
        (("--rates", "100000", "--times", "100000"), "100000 rates x 100000 times"),
        (("--pulses", "0"), "pulses = 0"),
        (("--tolerance", "2"), "tolerance = 2.0"),
        (("--threads", "0"), "threads = 0"),
        (("--figure", "7"), "--figure = '7'"),
        (("--figure", "8", "--out", "map.nc"), "--figure 8"),
        (("--measured", "nowhere.csv"), "nowhere.csv: the measured map cannot be read (No such file"),
        (
            ("--measured", "nowhere.csv", "--figure", "8", "--out", "map.png"),
            "--figure 8",
        ),
    ],
)
def test_bad_input_is_one_sentence(
    refused: "Callable[..., None]", arguments: tuple[str, ...], said: str
) -> None:
    refused("map", *arguments, said=said)


def test_a_measured_map_is_not_written_over(cli: "Callable[..., object]", tmp_path: Path) -> None:
    path = tmp_path / "measured.nc"
    path.write_bytes(b"records")
    outcome = cli("map", "--measured", path, "--out", path, "--force")
    assert outcome.status == 2
    assert "expected an output file that is not an input file" in told(outcome.err)
    assert path.read_bytes() == b"records"


def test_a_measured_map_before_the_firing_is_refused(cli: "Callable[..., object]", tmp_path: Path) -> None:
    path = tmp_path / "early.csv"
    path.write_text("time [us],500 Hz [um]\n-20,46\n-10,46\n0,46\n")
    outcome = cli("map", "--measured", path)
    assert outcome.status == 2
    assert "early.csv: 1 times from the first firing on" in told(outcome.err)
