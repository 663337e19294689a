"""Progress displays of the verbs: shown on a terminal only."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from printhammer.cli.terminal import pace_of, progress_bar, say, status_line


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Make the library treat any stream as a terminal."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")


def test_nothing_is_written_where_nobody_looks(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    with progress_bar("orbits") as count, status_line("judging") as tell:
        count(1, 2)
        tell("more")
    assert capsys.readouterr() == ("", "")


@pytest.mark.usefixtures("terminal")
def test_a_terminal_sees_what_is_counted(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("orbits") as count:
        count(3, 7)
    out, err = capsys.readouterr()
    assert out == ""
    assert "orbits" in err
    assert "3/7" in err


@pytest.mark.usefixtures("terminal")
def test_a_terminal_sees_what_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with status_line("sampling") as tell:
        tell("12 candidates")
    out, err = capsys.readouterr()
    assert out == ""
    assert "12 candidates" in err


@pytest.mark.usefixtures("terminal")
def test_what_is_said_meanwhile_stands_above_the_bar(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("trains") as count, status_line("judging"):
        count(1, 2)
        say("compiling runs")
    say("done")
    lines = re.sub(r"\x1b\[[\d;?]*[a-zA-Z]", "", capsys.readouterr().err).replace("\r", "\n").splitlines()
    assert "compiling runs" in [line.strip() for line in lines]
    assert lines[-1] == "done"


def test_a_long_table_is_announced(
    cli: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "spring.csv"
    rows = "".join(f"{0.01 * k},{0.5 + 0.002 * k}\n" for k in range(50))
    path.write_text(f"displacement [mm],force [N]\n{rows}")
    words = ["fit", "spring", path, "--backstop", "0 mm"]
    assert "reading" not in cli(*words).err
    monkeypatch.setattr("printhammer.support.tables.text._LONG", 100)
    done = cli(*words)
    assert "reading spring.csv: 51 lines" in done.err
    assert done.out == cli(*words).out


def test_an_error_goes_through() -> None:
    with pytest.raises(ZeroDivisionError), progress_bar("orbits"):
        raise ZeroDivisionError


@pytest.mark.usefixtures("terminal")
def test_count_rate_and_time_left_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("judging") as count:
        count(0, 4)
        count(1, 4, "settle out")
    err = " ".join(capsys.readouterr().err.split())
    assert "judging settle out" in err
    assert "1/4" in err
    assert "/s" in err
    assert "left" in err


@pytest.mark.parametrize(
    ("done", "total", "seconds", "said"),
    [
        (0, 4, 5.0, ""),
        (3, 4, None, ""),
        (30, 60, 10.0, "3/s, 0:10 left"),
        (2, 7, 61.0, "30.5 s each, 2:32 left"),
        (4, 4, 2.0, "2/s, 0:00 left"),
        (1, None, 3.0, "3 s each"),
    ],
)
def test_the_pace_is_rate_and_time_left(
    done: int, total: int | None, seconds: float | None, said: str
) -> None:
    assert pace_of(done, total, seconds) == said
