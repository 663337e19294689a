"""The verb `tune`: tables, the report, and rejected input."""

import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest
from tests.hammers import CRUDE

import printhammer as ph


@pytest.fixture
def quick(tmp_path: Path) -> Path:
    """Return a hammer file whose pulse ends before the touch."""
    path = tmp_path / "quick.toml"
    hammer = ph.load(CRUDE).replace({"waveform.amplitude": 1.3, "waveform.width": 200e-6})
    hammer.save(path)
    return path


def test_tables_and_pictures(cli: Callable, quick: Path, tmp_path: Path) -> None:
    names = [tmp_path / f"table.{kind}" for kind in ("csv", "json", "h", "nc", "png")]
    out = [word for name in names for word in ("--out", name)]
    done = cli("tune", quick, "--rate", "1.85kHz", "--history", 1, "--no-brake", "--no-judge", *out)
    assert done.status == 0
    assert "Table for 1850 Hz" in done.out
    assert ph.load_table(names[0]).fingerprint == ph.load(quick).fingerprint
    assert ph.load_table(names[1]).rates.tolist() == [1850.0]
    assert "int32_t" in names[2].read_text()
    assert names[4].read_bytes().startswith(b"\x89PNG")


def test_tables_along_the_gap(cli: Callable, quick: Path, tmp_path: Path) -> None:
    names = [tmp_path / f"table.{kind}" for kind in ("csv", "json", "h", "nc")]
    out = [word for name in names for word in ("--out", name)]
    words = ("--rate", "1.85kHz", "--history", 1, "--reach", 1, "--no-brake", "--along", "gap -2 um, 2 um, 2")
    done = cli("tune", quick, *words, "--tick", "1 us", "--budget", 60, *out)
    assert done.status == 0
    assert "Tables along the gap at 1850 Hz" in done.out
    # Four times, a look-ahead and a multiplier for each entry; a rate and two gaps of four bytes.
    assert f"{2 * 2 * (4 * 2 + 1 + 2) + 3 * 4} bytes in a C header" in done.out
    assert "TICK_NS 1000" in names[2].read_text()
    assert names[0].read_text().startswith("gap [m],")


@pytest.mark.slow
def test_what_is_gained_and_lost(cli: Callable, quick: Path, tmp_path: Path) -> None:
    report = tmp_path / "report.svg"
    done = cli("tune", quick, "--rate", "1.85 kHz", "--history", 1, "--report", report)
    assert done.status == 0
    assert "current +10 %" in done.out
    assert "damping -20 %" in done.out
    assert b"<svg" in report.read_bytes()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("--rate 0Hz", "rate"),
        ("--rate 1mm", "rate"),
        ("--rate 1kHz --rates '1 kHz, 2 kHz, 3'", "expected one of them"),
        ("--rates '1 kHz, 2 kHz'", "expected two rates and a number"),
        ("--rates '2 kHz, 1 kHz, 3'", "expected the lower rate first"),
        ("--rate 1kHz --history 9", "history = 9"),
        ("--rate 1kHz --reach 0", "reach"),
        ("--rate 1kHz --largest-current 0.1A", "the waveform peaks at"),
        ("--along 'gap 0 um, 10 um, 2'", "expected one rate"),
        ("--rate 1kHz --along 'weather 0, 1, 2'", "expected one of rail, temperature, gap, forms first"),
        ("--rate 1kHz --along 'gap 0 um'", "expected two ends and a number"),
        ("--rate 1kHz --along 'gap 0 V, 1 V, 2'", "--along gap"),
        ("--rate 1kHz --along 'gap 0 um, 10 um, 1'", "expected two values or more"),
        ("--rate 1kHz --along 'rail 9 V, 10 V, 2'", "expected a hammer whose [waveform] is a driver"),
        ("--rate 1kHz --along 'gap 0 um, 10 um, 2' --out table.png", "expected a name that ends in one of"),
        ("--rate 1kHz --along 'gap 0 um, 10 um, 2' --report r.nc", "expected no report with --along"),
        ("--rate 1kHz --report report.nc --no-judge", "expected no report with --no-judge"),
    ],
)
def test_bad_input_is_one_sentence(refused: Callable, words: str, sentence: str) -> None:
    refused("tune", CRUDE, *shlex.split(words), said=sentence)


@pytest.mark.slow
def test_a_page_is_printed_with_a_table(cli: Callable, quick: Path, tmp_path: Path) -> None:
    table, dots = tmp_path / "table.json", tmp_path / "dots.csv"
    ph.tune(ph.load(quick), rate=1850.0, history=1).save(table)
    words = ("print", "HI", "--hammer", quick, "--rate", "1.85kHz", "--out", dots, "--force")
    done, without = cli(*words, "--table", table), cli(*words)
    assert done.status == without.status == 0
    good, plain = (re.search(r"within limits +(\d+) of (\d+) dots", one.out) for one in (done, without))
    assert good is not None
    assert plain is not None
    assert int(good[1]) == int(good[2]) > int(plain[1])
    refused = cli(
        "print", "HI", "--hammer", CRUDE, "--rate", "1.85kHz", "--out", dots, "--table", table, "--force"
    )
    assert refused.status == 2
    assert "the table is made for another hammer" in refused.err
    beyond = cli(
        "print", "HI", "--hammer", quick, "--rate", "2kHz", "--out", dots, "--table", table, "--force"
    )
    assert beyond.status == 2
    assert "is made for 1850 Hz" in beyond.err
