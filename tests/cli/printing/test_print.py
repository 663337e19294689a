from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from tests.hammers import CRUDE

import printhammer as ph
from printhammer.printing.page.pattern import Pattern

HAMMER = ("--hammer", CRUDE)


def test_a_page_and_its_files(cli: Callable, tmp_path: Path) -> None:
    paths = {name: tmp_path / name for name in ("page.png", "page.pdf", "dots.csv", "dots.nc")}
    more = {"--zoom": "zoom.png", "--sheet": "sheet.svg", "--save": "pattern.toml"}
    out = [word for path in paths.values() for word in ("--out", path)]
    out += [word for flag, name in more.items() for word in (flag, tmp_path / name)]
    done = cli("print", "Two\\nlines", *HAMMER, "--rate", "1.5kHz", *out)
    assert (done.status, done.err) == (0, "")
    page = ph.print_page(ph.load(CRUDE), "Two\nlines", 1500.0)
    assert page.pattern.lines == 2
    counts = page.line.size, page.printed.sum(), page.lost.sum(), page.extra_contacts.sum()
    assert "{} wanted, {} printed, {} lost, {} extra contacts".format(*counts) in done.out
    assert f"{page.good.sum()} of {page.line.size} dots" in done.out
    assert "1500 slots a second, 0.635 m/s" in done.out
    with xr.open_dataset(paths["dots.nc"], engine="scipy") as chart:
        np.testing.assert_array_equal(chart["placement_error"], page.placement_error)
    assert len(pd.read_csv(paths["dots.csv"], comment="#")) == page.line.size
    assert paths["page.png"].read_bytes().startswith(b"\x89PNG")
    assert paths["page.pdf"].read_bytes().startswith(b"%PDF")
    assert b"<svg" in (tmp_path / "sheet.svg").read_bytes()
    assert (tmp_path / "zoom.png").stat().st_size > 5_000
    assert Pattern.load(tmp_path / "pattern.toml") == page.pattern


def test_the_same_page_is_the_same_file(cli: Callable, tmp_path: Path) -> None:
    for name in ("one.pdf", "two.pdf"):
        assert cli("print", "Hi", *HAMMER, "--rate", "1 kHz", "--out", tmp_path / name).status == 0
    assert (tmp_path / "one.pdf").read_bytes() == (tmp_path / "two.pdf").read_bytes()


def test_a_pattern_and_a_head_of_ones_own(cli: Callable, tmp_path: Path) -> None:
    path = tmp_path / "bars.png"
    bars = Pattern("bars", np.arange(12 * 30).reshape(12, 30) % 3 == 0)
    bars.save(path)
    words = ("--pattern", path, "--wires", "12", "--rate", "800 Hz", "--pitch", "0.5 mm", "--wire", "0.2 mm")
    done = cli(
        "print", *HAMMER, *words, "--units", "inch", "--limits", "dot-matrix", "--save", tmp_path / "b.toml"
    )
    assert done.status == 0
    assert f"{bars.wanted} wanted" in done.out
    assert "15.7 in/s" in done.out
    np.testing.assert_array_equal(Pattern.load(tmp_path / "b.toml").dots, bars.dots)


def test_a_drawing_goes_on_from_line_to_line(cli: Callable, tmp_path: Path) -> None:
    Pattern("bar", np.ones((18, 2), dtype=bool)).save(tmp_path / "bar.PNG")
    words = ("--pattern", tmp_path / "bar.PNG", "--rate", "500 Hz", "--out", tmp_path / "dots.nc", "--force")
    for more, gap in (((), 0.0), (("--line-gap", "0.5"), 0.5)):
        assert cli("print", *HAMMER, *words, *more).status == 0
        attributes = xr.load_dataset(tmp_path / "dots.nc").attrs
        assert attributes["line_pitch"] == pytest.approx((1.0 + gap) * 9 * attributes["wire_pitch"])
    below = cli("print", *HAMMER, *words, "--line-gap", "-0.1")
    assert below.status == 2
    assert "line_gap = -0.1" in below.err


def test_without_names_three_files_are_written(
    cli: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli("print", "x", *HAMMER, "--rate", "1 kHz", "--wires", "18").status == 0
    assert {path.name for path in tmp_path.iterdir()} == {"printed.png", "printed.pdf", "printed-zoom.png"}


def test_a_run_that_stops_is_told(cli: Callable, tmp_path: Path) -> None:
    hammer = ph.load(CRUDE)
    single = ph.print_page(hammer, "Hello", 1500.0).nominal
    path = tmp_path / "short.toml"
    hammer.replace("magnet.range_max", hammer.front + 1.02 * single.indentation).save(path)
    done = cli("print", "=====", "--hammer", path, "--rate", "1.5 kHz", "--out", tmp_path / "page.png")
    assert done.status == 1
    assert "runs ended early: range left" in done.err
    assert "not run" in done.out
    assert (tmp_path / "page.png").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("Hi",), "--rate"),
        (("Hi", "--rate", "0 Hz"), "--rate = '0 Hz'"),
        (("Hi", "--rate", "fast"), "--rate"),
        (("Hi", "--rate", "1 ms"), "--rate"),
        (("", "--rate", "1 kHz"), "text = ''"),
        ((" ", "--rate", "1 kHz"), "text = ' '"),
        (("naïve", "--rate", "1 kHz"), "'ï'"),
        (("--rate", "1 kHz"), "both are missing"),
        (("Hi", "--pattern", "p.toml", "--rate", "1 kHz"), "both are set"),
        (("--pattern", "p.toml", "--rate", "1 kHz"), "p.toml"),
        (("--pattern", "p.toml", "--font", "f.ttf", "--rate", "1 kHz"), "--font f.ttf"),
        (("--pattern", "p.toml", "--columns", "3", "--rate", "1 kHz"), "--columns 3"),
        (("Hi", "--rate", "1 kHz", "--font", "f.ttf"), "f.ttf"),
        (("Hi", "--rate", "1 kHz", "--wires", "0"), "wires = 0"),
        (("Hi", "--rate", "1 kHz", "--columns", "0"), "columns = 0"),
        (("Hi", "--rate", "1 kHz", "--pitch", "0 mm"), "--pitch"),
        (("Hi", "--rate", "1 kHz", "--wire", "1 s"), "--wire"),
        (("Hi", "--rate", "1 kHz", "--density", "-1"), "density"),
        (("Hi", "--rate", "1 kHz", "--limits", "none"), "limits = 'none'"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, words: tuple[str, ...], said: str) -> None:
    refused("print", *words, *HAMMER, said=said)


def test_the_name_of_a_hammer_as_a_text_is_reported(cli: Callable, tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(CRUDE.read_text(encoding="utf-8"), encoding="utf-8")
    for text in ("relay-5v", str(file)):
        done = cli("print", text)
        assert done.status == 2
        assert done.err.count("warning:") == 1
        assert f"--hammer {text}" in " ".join(done.err.split())
    assert "--pattern" in done.err
    for words in (("relay-5v", "--hammer", "relay-5v"), ("relay", *HAMMER), (tmp_path / "no.toml",)):
        assert "warning" not in cli("print", *words).err
    assert "--hammer selects the hammer" in cli("print", "relay-5v", "HELLO", "--rate", "10 Hz").err
    assert "--hammer" not in cli("run", "relay-5v", "HELLO").err
