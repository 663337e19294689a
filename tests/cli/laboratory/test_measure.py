"""The verb `measure`."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import printhammer as ph
from printhammer.identify.bench.laboratory import KINDS
from printhammer.support.tables.readings import read_table


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_all_tables_go_into_a_folder(cli: Callable, here: Path) -> None:
    options = ("--duration", "0.3 ms", "--bandwidth", "100 kHz", "--noise", "force=0.1 N", "--seed", "4")
    assert cli("measure", "all", "--out", "lab", *options).status == 0
    assert sorted(path.name for path in (here / "lab").iterdir()) == sorted(
        f"{kind}.csv" for kind in KINDS if kind != "current"
    )
    # One by one they are the same.
    assert cli("measure", "pack", "--out", "pack.csv", "--noise", "force=0.1 N", "--seed", "4").status == 0
    assert (here / "pack.csv").read_bytes() == (here / "lab" / "pack.csv").read_bytes()
    text = (here / "lab" / "motion.csv").read_text("utf-8")
    assert "# bandwidth: 100 kHz\n" in text
    assert (
        text
        == ph.measure(
            "motion", ph.load("hendriks-1983"), seed=4, duration="0.3 ms", sensor={"bandwidth": "100 kHz"}
        ).to_csv()
    )


def test_what_the_hammer_lacks_is_left_out_and_said(cli: Callable, here: Path) -> None:
    ph.load("hendriks-1983").replace({"waveform": None, "pack": None}).save("still.toml")
    done = cli("measure", "all", "still.toml", "--out", "lab", "--currents", "0 A, 1 A")
    assert done.status == 0
    assert "still.toml: the hammer has no pack; pack is omitted" in done.err
    assert "still.toml: the hammer has no waveform; motion is omitted" in done.err
    assert sorted(path.stem for path in (here / "lab").iterdir()) == ["backstop", "magnet", "spring"]


def test_nothing_is_written_over_unless_asked(cli: Callable, here: Path) -> None:
    path = here / "spring.csv"
    path.write_text("mine", "utf-8")
    done = cli("measure", "spring", "--out", path)
    assert done.status == 2
    assert "--force overwrites" in done.err
    assert path.read_text("utf-8") == "mine"
    assert cli("measure", "spring", "--out", path, "--force").status == 0
    assert path.read_text("utf-8").startswith("# measurement: spring")
    (here / "lab").mkdir()
    (here / "lab" / "pack.csv").write_text("mine", "utf-8")
    assert cli("measure", "all", "--out", "lab").status == 2
    assert [entry.name for entry in (here / "lab").iterdir()] == ["pack.csv"]


def test_places_and_currents_of_ones_own(cli: Callable, here: Path) -> None:
    options = ("--displacements", "60 um, 0.01 cm", "--currents", "0 A, 800 mA", "--exact")
    assert cli("measure", "magnet", "--out", "a.csv", *options).status == 0
    table = read_table(here / "a.csv", {"displacement": "m", "current": "A", "force": "N"})
    np.testing.assert_allclose(table.values["displacement"], [60e-6, 100e-6, 60e-6, 100e-6], rtol=1e-14)
    np.testing.assert_allclose(table.values["current"], [0.0, 0.0, 0.8, 0.8], rtol=1e-14)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("magnet",), "--out"),
        (("all",), "--out"),
        (("magnet", "--out", "a.csv", "--noise", "3"), "noise '3'"),
        (("magnet", "--out", "a.csv", "--noise", "mass=3 g"), "the quantity 'mass'"),
        (("magnet", "--out", "a.csv", "--noise", "force=3 g"), "the unit 'g' is a mass"),
        (("magnet", "--out", "a.csv", "--noise", "3 N", "--noise", "force=2 N"), "force occurs twice"),
        (("magnet", "--out", "a.csv", "--bandwidth", "1 kHz"), "expected this option with motion or current"),
        (("magnet", "--out", "a.csv", "--peaks", "30 um"), "expected this option with pack only"),
        (
            ("backstop", "--out", "a.csv", "--displacements", "30 um"),
            "expected this option with magnet, spring only",
        ),
        (("magnet", "--out", "a.csv", "--displacements", "30"), "--displacements: '30' has no unit"),
        (("magnet", "--out", "a.csv", "--seed", "-1"), "seed = -1"),
        (("motion", "--out", "a.csv", "--outliers", "2"), "outliers = '2'"),
        (("motion", "--out", "a.csv", "--duration", "0 ms"), "duration = '0 ms'"),
        (("motion", "--out", "a.csv", "--sampling-rate", "none"), "sampling_rate"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, words: tuple[str, ...], said: str) -> None:
    refused("measure", *words, said=said)
