from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from tests.control.least_work.test_burst import let_go, thrown
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.control.least_work import search


@pytest.fixture
def unsearched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "printing_current", thrown)
    monkeypatch.setattr(search, "landing_current", let_go)


def test_a_burst_and_its_files(cli: Callable, tmp_path: Path, unsearched: None) -> None:
    paths = {kind: tmp_path / f"burst.{kind}" for kind in ("csv", "nc", "png", "svg")}
    out = [word for path in paths.values() for word in ("--out", path)]
    words = ("--rate", "400 Hz", "--dots", "2", "--least-force", "0.3", "--supply", *out)
    done = cli("energy", CRUDE, *words)
    assert done.status == 0
    assert "2 of 2 adequate at 400 Hz" in done.out
    assert "positive work W+" in done.out
    assert "+3.0 %" in done.out
    assert "\ntime [us],current [A]\n" in paths["csv"].read_text("utf-8")
    assert paths["png"].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in paths["svg"].read_bytes()


def test_the_sensitivity_stands_beside_the_result_and_the_interpolation_in_the_file(
    cli: Callable, tmp_path: Path, unsearched: None
) -> None:
    """The weakest dot barely reaches the required force: a current that is 0.1 % smaller is insufficient."""
    asked: dict[str, Any] = {"rate": "400 Hz", "dots": 2, "largest": "1.2 A"}
    hammer, current = ph.load(CRUDE), tmp_path / "current.csv"
    burst = ph.least_work(hammer, force=0.3, **asked)
    least = float(burst.forces.min()) * (1.0 - 1e-6)
    counts = []
    for factor in (0.999, 1.001):
        motion = ph.simulate(hammer, burst.drive.scaled(factor), duration=burst.motion.end)
        peaks = [contact.peak_force or 0.0 for contact in motion.contacts if contact.surface == "pack"]
        counts.append(sum(peak >= least * burst.single.force for peak in peaks))
    assert counts[0] < 2
    words = ("--rate", "400 Hz", "--dots", "2", "--largest", "1.2 A", "--least-force", repr(least))
    done = cli("energy", CRUDE, *words, "--out", current)
    assert done.status == 0
    assert f"{counts[0]} and {counts[1]} of 2 dots adequate at 0.1 % less and more current" in done.out
    assert "linear between nodes" in current.read_text("utf-8")


def test_inadequate_dots_end_with_status_1(cli: Callable, unsearched: None) -> None:
    words = ("--rate", "400 Hz", "--dots", "2", "--least-force", "2", "--largest", "1.2 A", "--units", "inch")
    done = cli("energy", CRUDE, *words)
    assert done.status == 1
    assert "0 of 2 dots are adequate" in done.err
    assert "in·lbf" in done.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--rate", "0 Hz"), "rate"),
        (("--rate", "fast"), "rate"),
        (("--dots", "0"), "dots = 0"),
        (("--largest", "3 m"), "largest"),
        (("--slew", "0"), "slew"),
        (("--rates", "300 Hz"), "two rates and a number"),
        (("--rates", "400 Hz, 300 Hz, 2"), "the lower rate first"),
        (("--rates", "300 Hz, 400 Hz, 1"), "from 2 to 200"),
        (("--rates", "300 Hz, 400 Hz, 2", "--supply"), "neither --supply nor a current"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, words: tuple[str, ...], said: str) -> None:
    refused("energy", CRUDE, *words, said=said)


def test_several_rates(cli: Callable, tmp_path: Path, unsearched: None) -> None:
    out, picture = tmp_path / "rates.nc", tmp_path / "rates.png"
    words = ("--rates", "300 Hz, 400 Hz, 2", "--dots", "2", "--least-force", "0.3")
    done = cli("energy", CRUDE, *words, "--out", out, "--out", picture)
    assert done.status == 0
    assert done.out.count("2 of 2") == 2
    with xr.open_dataset(out, engine="scipy") as kept:
        assert kept["rate"].values.tolist() == [300.0, 400.0]
    assert picture.read_bytes().startswith(b"\x89PNG")
