"""Bad input: one sentence with file, key, value and expectation; status 2; no data lost."""

import subprocess
import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.hammers import CRUDE

import printhammer as ph

SCRIPT = Path(sysconfig.get_path("scripts")) / "printhammer"
SAMPLED = '[waveform]\nshape = "sampled"\nfile = "pulse.csv"\n'
HEADING = "time [us],current [A]\n"


def with_samples(text: str) -> str:
    return text[: text.index("[waveform]")] + SAMPLED


def edited(old: str, new: str) -> Callable[[str], str]:
    def edit(text: str) -> str:
        assert text.count(old) == 1
        return text.replace(old, new)

    return edit


# What is wrong with the hammer file, the CSV beside it, and what the sentence must name beside the file.
BAD_HAMMERS = {
    "unknown key": (edited("front = {", "frunt = {"), "", ("pack.frunt", "front")),
    "missing unit": (edited('unit = "g", ', ""), "", ("mass", "0.397975875", "unit", "kg")),
    "unknown unit": (edited('unit = "g", ', 'unit = "gee", '), "", ("mass", "gee", "unit")),
    "force for a length": (
        edited('value = 0.008, unit = "in"', 'value = 0.008, unit = "lbf"'),
        "",
        ("pack.front", "0.008", "lbf", "a length"),
    ),
    "negative mass": (edited("value = 0.397975875", "value = -0.4"), "", ("mass", "-0.4", "more than 0")),
    "NaN": (edited("value = 2.47161892", "value = nan"), "", ("magnet.F0", "nan", "finite")),
    "infinite": (edited("value = 2.47161892", "value = inf"), "", ("magnet.F0", "inf", "finite")),
    "text for a number": (edited("value = 2.47161892", 'value = "2.5"'), "", ("magnet.F0", "2.5", "number")),
    "backstop beyond the pack": (
        edited("value = 0.002", "value = 0.009"),
        "",
        ("backstop.position", "0.009", "pack.front", "0.008"),
    ),
    "no rest state": (edited("value = 14.2981139", "value = 44.0"), "", ("rest state", "N", "negative")),
    "unknown status": (
        edited(
            'value = 0.015, unit = "in", status = "stated"', 'value = 0.015, unit = "in", status = "sure"'
        ),
        "",
        ("platen.status", "sure", "stated"),
    ),
    "unknown law": (edited('law = "power"', 'law = "powr"'), "", ("pack.law", "powr", "power")),
    "not TOML": (lambda _: "mass = = 3", "", ("TOML",)),
    "not text": (lambda _: "\udcff\udcfe", "", ("UTF-8",)),
    "empty file": (lambda _: "", "", ("format",)),
    "empty CSV": (with_samples, "", ("pulse.csv", "empty")),
    "CSV without samples": (with_samples, HEADING, ("pulse.csv", "rows")),
    "non-monotonic CSV": (
        with_samples,
        HEADING + "0,0\n20,1\n10,1\n30,0\n",
        ("pulse.csv", "1e-05", "ascending"),
    ),
    "CSV without units": (with_samples, "time,current\n0,0\n10,1\n", ("pulse.csv", "unit")),
}


@pytest.fixture
def bad_file(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    edit, samples, _ = BAD_HAMMERS[request.param]
    (tmp_path / "pulse.csv").write_text(samples, "utf-8")
    path = tmp_path / "bad.toml"
    path.write_bytes(edit(CRUDE.read_text("utf-8")).encode("utf-8", "surrogateescape"))
    return path


@pytest.mark.parametrize(
    ("bad_file", "expected"), [(name, told) for name, (_, _, told) in BAD_HAMMERS.items()],
    indirect=["bad_file"], ids=list(BAD_HAMMERS),
)  # fmt: skip
def test_bad_hammer(cli, bad_file: Path, expected: tuple[str, ...]) -> None:
    """Test every fault of a file once; test_registry.py tests that every verb rejects a faulty file."""
    before = {path: path.read_bytes() for path in bad_file.parent.iterdir()}
    outcome = cli("run", bad_file, "--out", bad_file.parent / "out.json")
    assert outcome.status == 2
    assert_one_sentence(outcome.err, bad_file.name, *expected)
    assert outcome.out == ""
    assert {path: path.read_bytes() for path in bad_file.parent.iterdir()} == before


def assert_one_sentence(text: str, *expected: str) -> None:
    assert len(text.splitlines()) == 1
    assert text.startswith("printhammer: ")
    for told in expected:
        assert told in text
    assert "Traceback" not in text
    assert "Error" not in text


BAD_OPTIONS = {
    "period of zero": (["--period", "0 ms"], ("period", "0 ms", "greater than 0")),
    "rate of zero": (["--rate", "0 Hz"], ("rate", "0 Hz", "greater than 0")),
    "negative period": (["--period=-1 ms"], ("period", "-1 ms", "greater than 0")),
    "rate without unit": (["--rate", "1200"], ("rate", "1200", "unit", "Hz")),
    "rate in metres": (["--rate", "1200 m"], ("rate", "a length", "a frequency")),
    "rate and period": (["--rate", "1 kHz", "--period", "1 ms"], ("rate", "period")),
    "pulses alone": (["--pulses", "3"], ("pulses", "3")),
    "no pulses": (["--rate", "1 kHz", "--pulses", "0"], ("pulses", "0")),
    "pulses in words": (["--rate", "1 kHz", "--pulses", "nine"], ("pulses", "nine", "whole number")),
    "times descending": (["--at", "700 us, 0 us"], ("firing time",)),
    "times twice": (["--at", "0 us, 0 us"], ("firing time",)),
    "time without unit": (["--at", "0 us, 7"], ("7", "unit", "a time")),
    "no times": (["--at", ""], ("a time",)),
    "duration without unit": (["--duration", "4"], ("duration", "4", "unit")),
    "no duration": (["--duration", "0 ms"], ("duration", "positive")),
    "tolerance too loose": (["--tolerance", "1"], ("tolerance", "1.0", "1e-05")),
    "one point": (["--points", "1"], ("points", "1", "at least 2")),
    "unknown scheme": (["--scheme", "euler"], ("--scheme", "euler", "trapezoid")),
    "unknown overlap": (["--overlap", "both"], ("--overlap", "both", "add")),
    "unknown option": (["--rte", "1 kHz"], ("--rte",)),
    "no such drive": (["--drive", "none.toml"], ("none.toml",)),
    "drive and rate": (["--drive", "d.toml", "--rate", "1 kHz"], ("--rate", "--drive")),
    "no such folder": (["--out", "none/motion.csv"], ("none/motion.csv", "folder that exists")),
    "no such format": (["--dots", "dots.xls"], ("dots.xls", ".csv")),
    "no such picture": (["--out", "motion.gif"], ("motion.gif", ".svg")),
    "written twice": (["--out", "a.csv", "--dots", "a.csv"], ("a.csv", "twice")),
}


@pytest.mark.parametrize(("options", "expected"), BAD_OPTIONS.values(), ids=BAD_OPTIONS)
def test_bad_options_of_run(
    cli, options: list[str], expected: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = cli("run", *options)
    assert outcome.status == 2
    assert_one_sentence(outcome.err, *expected)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["figure", "1"], ("figure", "1", "2, 3")),
        (["figure", "three"], ("figure", "three", "whole number")),
        (["figure"], ("N",)),
        (["walk"], ("walk",)),
        (["hammer", "chek"], ("chek", "check")),
        (["hammer", "show", "no-such-hammer"], ("no-such-hammer", "hendriks-1983")),
        (["run", "no-such-hammer.toml"], ("no-such-hammer.toml", "no such file")),
    ],
    ids=" ".join,
)
def test_bad_arguments(cli, arguments: list[str], expected: tuple[str, ...]) -> None:
    outcome = cli(*arguments)
    assert outcome.status == 2
    assert_one_sentence(outcome.err, *expected)


def test_input_is_never_written_over(cli, hammer: "ph.Hammer", tmp_path: Path) -> None:
    mine, drive = tmp_path / "mine.json", tmp_path / "drive.csv"
    mine.write_text(hammer.to_toml(), "utf-8")
    drive.write_text('format = 1\n[train]\nrate = "1 kHz"\npulses = 2\n', "utf-8")
    for path in (mine, drive):
        before = path.read_bytes()
        outcome = cli("run", mine, "--drive", drive, "--out", path)
        assert outcome.status == 2
        assert_one_sentence(outcome.err, path.name, "that is not an input file")
        assert path.read_bytes() == before


def test_a_table_is_never_written_over(cli, hammer: "ph.Hammer", tmp_path: Path) -> None:
    (tmp_path / "pulse.csv").write_text(HEADING + "0,0\n20,1\n300,1\n320,0\n", "utf-8")
    mine, drive = tmp_path / "mine.toml", tmp_path / "drive.toml"
    mine.write_text(with_samples(hammer.to_toml()), "utf-8")
    drive.write_text('format = 1\n[times]\nat = ["0 us"]\n' + SAMPLED, "utf-8")
    before = (tmp_path / "pulse.csv").read_bytes()
    for arguments in ([mine], ["hendriks-1983", "--drive", drive]):
        outcome = cli("run", *arguments, "--out", tmp_path / "pulse.csv", "--force")
        assert outcome.status == 2
        assert_one_sentence(outcome.err, "pulse.csv", "that is not an input file")
    assert (tmp_path / "pulse.csv").read_bytes() == before


@pytest.mark.parametrize("verb", [["paper"], ["figure", "3"]], ids=" ".join)
def test_a_folder_that_cannot_be_written_to(cli, verb: list[str], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        outcome = cli(*verb, "--out", out)
        assert outcome.status == 2
        assert_one_sentence(outcome.err, str(out), "writable folder")
    assert (tmp_path / "file").read_text() == "kept"


def test_force_toward_the_paper_is_a_warning(cli, tmp_path: Path) -> None:
    path = tmp_path / "weak.toml"
    ph.load(CRUDE).replace("magnet.Am", 0.41).save(path)
    for arguments in (["hammer", "check"], ["hammer", "show"], ["run"]):
        outcome = cli(*arguments, path)
        assert outcome.status == 0
        (line,) = outcome.err.splitlines()
        assert line.startswith("warning: ")
        for told in ("weak.toml", "positive from", "um", "never return"):
            assert told in line


@pytest.mark.parametrize(
    "arguments",
    [["run", "bad.toml"], ["walk"]],
    ids=" ".join,
)
def test_as_a_process(arguments: list[str], tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("not = = TOML", "utf-8")
    done = subprocess.run([SCRIPT, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert_one_sentence(done.stderr)
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]


LONG = "x" * 280


@pytest.mark.parametrize(
    "words",
    [
        f"run dot-peen --out {LONG}.png",
        f"fit coil {LONG}.csv --hammer dot-peen",
        f"fit coil a.csv --hammer {LONG}.toml",
        f"learn dot-peen --table {LONG}.csv",
        f"run --part {LONG}.py",
        f"map --measured {LONG}.csv",
        f"run --drive {LONG}.toml",
    ],
)
def test_a_path_that_is_too_long_is_one_sentence(
    cli: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    found = cli(*words.split())
    assert (found.status, found.err.count("\n")) == (2, 0)
    assert LONG in found.err.replace("\n", "")


@pytest.mark.parametrize("words", [["hammer", "show", "dot-peen"], ["--version"]])
def test_an_output_on_a_full_disk_is_one_sentence(words: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([SCRIPT, *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1, done.stderr
