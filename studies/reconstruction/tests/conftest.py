"""Fixtures of the tests of the study, all of which are slow."""

from collections.abc import Callable
from pathlib import Path

import pytest
from studies.reconstruction.__main__ import main
from tests.cli.conftest import Outcome, called, check_refusal

HERE = Path(__file__).parent


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests of the study as slow."""
    for item in items:
        if item.path.is_relative_to(HERE):
            item.add_marker(pytest.mark.slow)


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Outcome]:
    """Run the program of the study in this process."""
    return called(main, capsys, monkeypatch)


@pytest.fixture
def refused(
    cli: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., None]:
    """Check that a command line is refused in one sentence, with status 2 and without writing a file."""
    return check_refusal(cli, tmp_path, monkeypatch)
