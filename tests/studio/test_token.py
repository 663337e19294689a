"""The token of a user: the same every time, and for nobody else."""

import logging
import stat
from pathlib import Path

import pytest

from printhammer.studio.token import FILE, user_folder, user_token


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("XDG_STATE_HOME", "LOCALAPPDATA", "HOME"):
        monkeypatch.setenv(name, str(tmp_path / "own"))
    return user_folder() / FILE


def test_it_is_kept_for_this_user_alone(kept: Path) -> None:
    first = user_token()
    assert user_token() == first
    assert kept.read_text("ascii") == first
    assert stat.S_IMODE(kept.stat().st_mode) == 0o600


@pytest.mark.parametrize("spoilt", ["mode", "content", "link", "folder"])
def test_what_others_could_have_written_is_not_used(
    kept: Path, caplog: pytest.LogCaptureFixture, tmp_path: Path, spoilt: str
) -> None:
    first = user_token()
    if spoilt == "mode":
        kept.chmod(0o644)
    elif spoilt == "content":
        kept.write_text("short", "ascii")
    elif spoilt == "link":
        kept.rename(tmp_path / "elsewhere")
        kept.symlink_to(tmp_path / "elsewhere")
    else:
        kept.unlink()
        kept.mkdir()
    with caplog.at_level(logging.WARNING):
        other = user_token()
    assert other != first
    assert len(other) == 32
    assert str(kept) in caplog.text
    assert "for this time only" in caplog.text
