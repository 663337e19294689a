"""Where machine code is kept, and that trouble with its files is no reason not to run."""

import errno
import os
import tempfile
from pathlib import Path
from typing import Any

import numba
import pytest
from numba.core import caching, config

from printhammer.kernel.compile import cache


def doubled(x: float) -> float:
    return 2.0 * x


def compiled() -> Any:
    return cache.keep(numba.njit(doubled))


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that a user has asked for."""
    place = tmp_path / "machine code"
    monkeypatch.setattr(config, "CACHE_DIR", str(place))
    return place


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for temporary files, where neither the installation nor the home can be written to."""
    monkeypatch.setattr(config, "CACHE_DIR", "")
    monkeypatch.setattr(cache._Files, "_locator_classes", [cache._TemporaryLocator])
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


def test_code_is_kept_where_the_user_asks(folder: Path) -> None:
    function = compiled()
    assert function(1.5) == 3.0
    assert cache.kept(function) == "once; kept on disk"
    assert len(files(folder)) == 2
    again = compiled()
    assert again(1.5) == 3.0
    assert again.stats.cache_hits


def test_a_folder_that_cannot_be_written_to_is_named(folder: Path) -> None:
    folder.write_text("a file")
    function = compiled()
    assert function(1.5) == 3.0
    assert f"since {folder} cannot be written to" in cache.kept(function)


def test_without_home_there_is_a_temporary_folder(temporary: Path) -> None:
    function = compiled()
    assert function(1.5) == 3.0
    (place,) = temporary.iterdir()
    assert place.stat().st_mode & 0o777 == 0o700
    assert f"once; kept in {place}, since no other folder can be written to" in cache.kept(function)
    assert len(files(place)) == 2


def test_a_temporary_folder_of_others_is_not_used(temporary: Path) -> None:
    cache._temporary_folder().mkdir(mode=0o777)
    cache._temporary_folder().chmod(0o777)
    function = compiled()
    assert function(1.5) == 3.0
    assert files(temporary) == []
    assert "kept nowhere" in cache.kept(function)


def test_without_any_folder_code_is_made_each_time(temporary: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(temporary / "nowhere"))
    function = compiled()
    assert function(1.5) == 3.0
    assert "kept nowhere, since no folder for it can be written to" in cache.kept(function)


def test_a_full_disk_is_told_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    said: list[str] = []
    monkeypatch.setattr(caching.IndexDataCacheFile, "save", full)
    monkeypatch.setattr(cache, "announce", said.append)
    assert [compiled()(1.5), compiled()(1.5)] == [3.0, 3.0]
    (sentence,) = said
    assert sentence.startswith(str(folder))
    assert "machine code cannot be kept (No space left on device)" in sentence


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_a_file_cut_short_is_written_anew(folder: Path, ending: str) -> None:
    assert compiled()(1.5) == 3.0
    (path,) = folder.rglob(f"*.{ending}")
    whole = path.read_bytes()
    path.write_bytes(whole[:20])
    assert compiled()(1.5) == 3.0
    # Names in the machine code count the functions compiled before.
    assert len(path.read_bytes()) > len(whole) / 2
    again = compiled()
    assert again(1.5) == 3.0
    assert again.stats.cache_hits
