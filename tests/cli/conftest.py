from collections.abc import Callable
from typing import NamedTuple

import pytest

import printhammer as ph
from printhammer.cli.main import main


class Outcome(NamedTuple):
    status: int
    out: str
    err: str


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """Run the command line in this process."""

    def call(*arguments: object) -> Outcome:
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        # Compiling is told on the standard error as well.
        told = [line for line in err.splitlines() if not line.startswith("compiling")]
        return Outcome(int(end.value.code or 0), out, "\n".join(told))

    return call


@pytest.fixture(scope="session")
def hammer() -> ph.Hammer:
    """The shipped hammer, which the tests here call by its name."""
    return ph.load("hendriks-1983")
