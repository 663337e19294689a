"""The cache of machine code: folders, messages during compilation, and runs despite cache problems."""

import errno
import fcntl
import json
import multiprocessing
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import llvmlite
import pytest

from printhammer.kernel.compile import cache, records

CODE = b"machine code"
CURVES, PEAKS = (records.expected([], kind) for kind in ("curves", "peaks"))
NOWHERE = Path("no wheel")


def kept(name: str = "curves.code") -> cache.Code:
    return cache.Code(name, "curves", "a line", lambda: True, NOWHERE)


def make() -> bytes:
    return CODE


def unmade() -> bytes:
    raise AssertionError


def test_machine_code_of_a_wheel_is_read_and_not_kept_again(tmp_path: Path, folder: Path) -> None:
    shipped = tmp_path / "shipped.code"
    shipped.write_bytes(cache.sealed(CODE))
    code = cache.Code("curves.code", "curves", "a line", lambda: True, shipped)
    assert code.exists()
    assert code.get(unmade) == CODE
    assert not folder.exists()


@pytest.mark.parametrize("damaged", [b"", cache.sealed(CODE)[:-1], cache.sealed(CODE) + b"x", CODE])
def test_damaged_machine_code_of_a_wheel_is_made_anew(tmp_path: Path, folder: Path, damaged: bytes) -> None:
    shipped = tmp_path / "shipped.code"
    shipped.write_bytes(damaged)
    code = cache.Code("curves.code", "curves", "a line", lambda: True, shipped)
    assert not code.exists()
    assert code.get(make) == CODE
    assert (folder / "printhammer" / "curves.code").exists()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder that the user selected."""
    place = tmp_path / "machine code"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(place))
    return place


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the temporary folder, used if neither the installation nor the home folder is writable."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(cache, "_folders", lambda: iter([cache._temporary_folder()]))
    return tmp_path


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the list of announced messages."""
    sentences: list[str] = []
    monkeypatch.setattr(cache, "_said", set())
    monkeypatch.setattr(cache, "listeners", {sentences.append})
    return sentences


def files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*.code") if path.is_file()]


def make_read_only(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Make a folder read-only, also for an administrator, whom permissions do not restrict."""
    folder.chmod(0o555)
    can_be_written = cache._can_be_written
    monkeypatch.setattr(cache, "_can_be_written", lambda place: place != folder and can_be_written(place))


def test_code_is_kept_where_the_user_asks(folder: Path) -> None:
    code = kept()
    assert not code.exists()
    assert code.get(make) == CODE
    assert code.place == "once, kept on disk"
    assert len(files(folder)) == 1
    assert kept().exists()
    assert kept().get(unmade) == CODE


def test_a_folder_that_cannot_be_written_to_is_named(folder: Path) -> None:
    folder.write_text("a file")
    code = kept()
    assert code.get(make) == CODE
    assert f"since {folder / 'printhammer'} cannot be written to" in code.place


def test_without_home_there_is_a_temporary_folder(temporary: Path) -> None:
    code = kept()
    assert code.get(make) == CODE
    (place,) = temporary.iterdir()
    assert place.stat().st_mode & 0o777 == 0o700
    assert f"once, kept in {place}, since no other folder can be written to" in code.place
    assert len(files(place)) == 1


def test_a_temporary_folder_of_others_is_neither_read_nor_written(temporary: Path) -> None:
    assert kept().get(make) == CODE
    before = files(temporary)
    cache._temporary_folder().chmod(0o777)
    code = kept()
    assert not code.exists()
    assert not code.can_be_kept
    assert code.get(lambda: b"other") == b"other"
    assert files(temporary) == before
    assert "kept nowhere" in code.place


def test_without_any_folder_code_is_made_each_time(
    temporary: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(temporary / "nowhere"))
    assert kept().get(make) == CODE
    (sentence,) = said
    assert sentence.startswith(
        f"compiling curves (a line): about {CURVES:.0f} s; kept nowhere, since no folder for it "
    )
    assert sentence.endswith("can be written to; NUMBA_CACHE_DIR names another folder")


def test_code_in_a_folder_that_can_only_be_read_is_used(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]
) -> None:
    assert kept().get(make) == CODE
    said.clear()
    baked, fallback = folder / "printhammer", tmp_path / "fallback"
    make_read_only(baked, monkeypatch)
    monkeypatch.setattr(cache, "_folders", lambda: iter([baked, fallback]))
    assert kept().get(unmade) == CODE
    assert said == []
    # What is new goes elsewhere, and is found there.
    assert kept("other.code").get(lambda: b"other") == b"other"
    assert len(files(baked)) == len(files(fallback)) == 1
    (sentence,) = said
    assert sentence.endswith(f"; once, kept in {fallback}, since {baked} cannot be written to")
    assert [kept().get(unmade), kept("other.code").get(unmade)] == [CODE, b"other"]


def test_broken_files_that_can_only_be_read_are_no_trouble(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert kept().get(make) == CODE
    baked = folder / "printhammer"
    for path in files(baked):
        path.write_bytes(path.read_bytes()[:20])
    make_read_only(baked, monkeypatch)
    monkeypatch.setattr(cache, "_folders", lambda: iter([baked, tmp_path / "fallback"]))
    assert not kept().exists()
    assert kept().get(make) == CODE
    assert kept().get(unmade) == CODE


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("processor", "z80", "is for processor z80, this is "),
        ("llvmlite", "0.1", f"is for llvmlite 0.1, this is {llvmlite.__version__}"),
        ("printhammer", "0.0.1", "is for printhammer 0.0.1, this is "),
        ("features", "+none", "with other instructions than this one has"),
    ],
)
def test_a_copied_folder_that_does_not_fit_says_why_once(
    folder: Path, said: list[str], key: str, value: str, reason: str
) -> None:
    place = folder / "printhammer"
    place.mkdir(parents=True)
    maker = {**records.maker(), key: value, "seconds": {"curves": 77.0}}
    (place / records.FILE).write_text(json.dumps({"makers": [maker]}))
    assert [kept().get(make), kept("other.code").get(make)] == [CODE, CODE]
    why, first, second = said
    assert why.startswith(f"{place}: the machine code there ")
    assert reason in why
    assert first.startswith("compiling curves (a line): about 77 s; once")
    # From now on this machine has a record of its own.
    assert second == "compiling curves (a line): about 0 s"
    assert len(records.read(place)) == 2


@pytest.mark.parametrize(
    "text", ["", "{}", '{"makers": [{}]}', '{"makers": 3}', '{"makers": [{"seconds": 1}]}']
)
def test_a_record_that_is_none_is_passed_over(tmp_path: Path, text: str) -> None:
    (tmp_path / records.FILE).write_text(text)
    assert records.read(tmp_path) == []
    assert records.mismatch(tmp_path) == ""
    records.note(tmp_path, "runs", 2.5)
    assert records.expected([tmp_path], "runs") == 2.5
    # Modules that a checkout has to lower first take longer, and are recorded by themselves.
    lowered = cache.Code("runs.code", "runs", "a line", lambda: False, NOWHERE).work
    assert records.expected([tmp_path], lowered) > 2.0 * records.expected([], "runs")
    records.note(tmp_path, lowered, 12.0)
    assert records.expected([tmp_path], lowered) == 12.0
    assert records.expected([tmp_path], "runs") == 2.5
    # So do those with the circuit of a coil.
    circuit = cache.Code("runs.code", "runs", "a line", lambda: False, NOWHERE, True).work
    assert records.expected([], circuit) > records.expected([], lowered)
    records.note(tmp_path, circuit, 24.0)
    assert records.expected([tmp_path], circuit) == 24.0
    assert records.expected([tmp_path], lowered) == 12.0


def test_what_may_follow_is_told_until_it_is_there(folder: Path, said: list[str]) -> None:
    first, second = kept(), cache.Code("peaks.code", "peaks", "a line", lambda: True, NOWHERE)
    first.with_it, second.with_it = (second,), (first,)
    assert [first.get(make), second.get(make)] == [CODE, CODE]
    one, other = f"about {CURVES:.0f} s, then at most {PEAKS:.0f} s for peaks", f"about {PEAKS:.0f} s"
    assert said == [
        f"compiling curves (a line): {one}; once, kept on disk",
        f"compiling peaks (a line): {other}",
    ]


def run_elsewhere(number: int, results: Any) -> None:
    def make() -> bytes:
        time.sleep(0.1)
        return bytes([number]) * 100_000

    results.put(kept().get(make))


def test_of_several_processes_one_makes_the_code_and_the_others_wait(folder: Path) -> None:
    context = multiprocessing.get_context("fork")
    results = context.Queue()
    processes = [context.Process(target=run_elsewhere, args=(number, results)) for number in range(4)]
    for process in processes:
        process.start()
    made = [results.get(timeout=60) for _ in processes]
    for process in processes:
        process.join()
    assert made == [kept().get(unmade)] * 4
    assert [path.name for path in (folder / "printhammer").iterdir() if path.suffix != ".json"] == [
        "curves.code"
    ]


def test_processes_that_cannot_lock_a_file_make_it_each_for_itself(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def unsupported(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", unsupported)
    assert kept().get(make) == CODE
    assert kept().get(unmade) == CODE
    assert [path.name for path in (folder / "printhammer").glob(".*")] == []


def test_a_full_disk_is_told_once(folder: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(cache, "_write", full)
    assert [kept().get(make), kept().get(make)] == [CODE, CODE]
    (sentence,) = [each for each in said if not each.startswith("compiling")]
    assert sentence.startswith(str(folder))
    assert "machine code cannot be kept (No space left on device)" in sentence


@pytest.mark.parametrize("damage", [lambda whole: whole[:20], lambda whole: whole[:-1] + b"x", lambda _: b""])
def test_a_damaged_file_is_written_anew(folder: Path, damage: Any) -> None:
    assert kept().get(make) == CODE
    (path,) = files(folder)
    whole = path.read_bytes()
    path.write_bytes(damage(whole))
    assert kept().get(make) == CODE
    assert path.read_bytes() == whole


def test_what_fails_while_it_is_made_can_be_made_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[bool] = []
    monkeypatch.setattr(cache, "watchers", {heard.append})

    def interrupted() -> bytes:
        raise KeyboardInterrupt

    code = kept()
    with pytest.raises(KeyboardInterrupt):
        code.get(interrupted)
    assert files(folder) == []
    assert code.get(make) == CODE
    assert heard == [True, False, True, False]
