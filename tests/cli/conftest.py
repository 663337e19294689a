import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple, NoReturn

import pytest
import typer.main

import printhammer as ph
from printhammer.cli.main import main
from printhammer.run import ahead

COMPILING = re.compile(r"^compiling |: the machine code there is for ")

# Typer makes the commands of all verbs anew at every call, which takes longer than most calls here.
_commands = cache(typer.main.get_command)


class Outcome(NamedTuple):
    status: int
    out: str
    err: str


def called(
    program: Callable[[list[str]], NoReturn],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> Callable[..., Outcome]:
    """Return a function that runs a program of verbs in this process."""
    monkeypatch.setattr(typer.main, "get_command", _commands)
    # The cores are busy with other tests; the hook would stay for the tests that follow in this process.
    monkeypatch.setattr(ahead, "begin", lambda _laws: lambda: None)

    def call(*arguments: object) -> Outcome:
        with pytest.raises(SystemExit) as end:
            program([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        # What depends on the machine is on the standard error as well.
        said = [line for line in err.splitlines() if not COMPILING.search(line)]
        return Outcome(int(end.value.code or 0), out, "\n".join(said))

    return call


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Outcome]:
    """Run the command line in this process."""
    return called(main, capsys, monkeypatch)


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def check_refusal(
    cli: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., None]:
    """Return a function that runs a command line and checks that it is rejected with one sentence."""

    def call(*arguments: object, said: str | tuple[str, ...]) -> None:
        monkeypatch.chdir(tmp_path)
        before, entries = contents(tmp_path), sorted(tmp_path.rglob("*"))
        done = cli(*arguments)
        assert done.status == 2, done
        assert done.out == ""
        assert len(done.err.splitlines()) == 1
        assert done.err.startswith("printhammer: ")
        assert "Traceback" not in done.err
        assert "Error" not in done.err
        for part in (said,) if isinstance(said, str) else said:
            assert part in done.err
        assert contents(tmp_path) == before
        assert sorted(tmp_path.rglob("*")) == entries

    return call


@pytest.fixture
def refused(
    cli: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., None]:
    """Run an invalid command line: one sentence, exit status 2, no file written or changed."""
    return check_refusal(cli, tmp_path, monkeypatch)


@pytest.fixture(scope="session")
def hammer() -> ph.Hammer:
    """The shipped hammer, which these tests refer to by name."""
    return ph.load("hendriks-1983")
