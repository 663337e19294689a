from pathlib import Path

import pytest
from tests.errors import refused

from printhammer.support.files import check_outputs, make_folder, write_file


def test_what_is_written_is_read_again(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    write_file(target, "µm\n")
    assert target.read_bytes() == "µm\n".encode()
    write_file(target, b"\x00\x01")
    assert target.read_bytes() == b"\x00\x01"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_file_is_as_readable_as_any_other(tmp_path: Path) -> None:
    (tmp_path / "plain").touch()
    write_file(tmp_path / "ours", "text")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_failure_leaves_what_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "a.txt"
    target.write_text("before")

    def fail(self: Path, _target: Path) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with refused(None, file="a.txt"):
        write_file(target, "after")
    assert target.read_text() == "before"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_place_that_cannot_be_written_to(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with refused(None, file="a.txt"):
        write_file(tmp_path / "file" / "a.txt", "text")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with refused(None):
            make_folder(folder)


def test_folders_are_made_above_it_as_well(tmp_path: Path) -> None:
    folder = make_folder(tmp_path / "a" / "b")
    assert folder.is_dir()
    assert list(folder.iterdir()) == []
    assert make_folder(folder) == folder


def test_outputs_are_checked_before_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hammer.toml").touch()
    check_outputs([Path("a.csv"), tmp_path / "b.csv"], [Path("hammer.toml"), Path("no-such-file")])
    for outputs, key in (
        ([tmp_path / "x" / ".." / "hammer.toml"], None),
        ([Path("a.csv"), tmp_path / "a.csv"], None),
        ([tmp_path], None),
        ([tmp_path / "none" / "a.csv"], None),
    ):
        with refused(key):
            check_outputs(outputs, [Path("hammer.toml")])
