"""A kernel that hangs must fail a test, not the whole run."""

import pytest

from printhammer.run import problem


@pytest.fixture(autouse=True)
def _few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(problem, "MAX_STEPS", 200_000)
