"""How far a verb is: told where somebody looks, and nowhere else."""

import pytest

from printhammer.cli.progress import counting, telling


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the library take any stream for a terminal."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")


def test_nothing_is_written_where_nobody_looks(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    with counting("orbits") as count, telling("judging") as say:
        count(1, 2)
        say("more")
    assert capsys.readouterr() == ("", "")


@pytest.mark.usefixtures("terminal")
def test_a_terminal_sees_what_is_counted(capsys: pytest.CaptureFixture[str]) -> None:
    with counting("orbits") as count:
        count(3, 7)
    out, err = capsys.readouterr()
    assert out == ""
    assert "orbits" in err
    assert "3/7" in err


@pytest.mark.usefixtures("terminal")
def test_a_terminal_sees_what_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with telling("sampling") as say:
        say("12 candidates")
    out, err = capsys.readouterr()
    assert out == ""
    assert "12 candidates" in err


def test_an_error_goes_through() -> None:
    with pytest.raises(ZeroDivisionError), counting("orbits"):
        raise ZeroDivisionError
