"""Where machine code is kept and read, and what is said while it is made; trouble is no reason not to run."""

import errno
import json
import math
import multiprocessing
import os
import tempfile
from pathlib import Path
from typing import Any

import numba
import pytest
from numba.core import config, event

from printhammer.kernel.compile import cache, records
from printhammer.kernel.compile.compiling import called, compiled, entry

DIGEST = "0123"


def doubled(x: float) -> float:
    return 2.0 * x


def kept() -> Any:
    return cache.keep(numba.njit(doubled), "curves", "a line")


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
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(cache, "_folders", lambda: iter([cache._temporary_folder()]))
    return tmp_path


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is announced."""
    sentences: list[str] = []
    monkeypatch.setattr(cache, "_said", set())
    monkeypatch.setattr(cache, "listeners", {sentences.append})
    return sentences


def files(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*.nb?") if path.is_file()]


def make_read_only(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nobody write to a folder; the administrator, whom permissions do not stop, neither."""
    folder.chmod(0o555)
    can_be_written = cache._can_be_written
    monkeypatch.setattr(cache, "_can_be_written", lambda place: place != folder and can_be_written(place))


def test_code_is_kept_where_the_user_asks(folder: Path) -> None:
    function = kept()
    assert function(1.5) == 3.0
    assert function._cache.place == "once, kept on disk"
    assert len(files(folder)) == 2
    again = kept()
    assert again(1.5) == 3.0
    assert again.stats.cache_hits


def test_a_folder_that_cannot_be_written_to_is_named(folder: Path) -> None:
    folder.write_text("a file")
    function = kept()
    assert function(1.5) == 3.0
    assert f"since {folder / 'printhammer'} cannot be written to" in function._cache.place


def test_without_home_there_is_a_temporary_folder(temporary: Path) -> None:
    function = kept()
    assert function(1.5) == 3.0
    (place,) = temporary.iterdir()
    assert place.stat().st_mode & 0o777 == 0o700
    assert f"once, kept in {place}, since no other folder can be written to" in function._cache.place
    assert len(files(place)) == 2


def test_a_temporary_folder_of_others_is_neither_read_nor_written(temporary: Path) -> None:
    assert kept()(1.5) == 3.0
    before = files(temporary)
    cache._temporary_folder().chmod(0o777)
    function = kept()
    assert function(1.5) == 3.0
    assert not function.stats.cache_hits
    assert files(temporary) == before
    assert "kept nowhere" in function._cache.place


def test_without_any_folder_code_is_made_each_time(
    temporary: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(temporary / "nowhere"))
    assert kept()(1.5) == 3.0
    (sentence,) = said
    assert sentence.startswith("compiling curves (a line): about 1 s; kept nowhere, since no folder for it ")
    assert sentence.endswith("can be written to; NUMBA_CACHE_DIR names another folder")


def test_code_in_a_folder_that_can_only_be_read_is_used(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]
) -> None:
    assert kept()(1.5) == 3.0
    said.clear()
    baked, fallback = folder / "printhammer", tmp_path / "fallback"
    make_read_only(baked, monkeypatch)
    monkeypatch.setattr(cache, "_folders", lambda: iter([baked, fallback]))
    again = kept()
    assert again(1.5) == 3.0
    assert again.stats.cache_hits
    assert said == []
    # What is new goes elsewhere, and is found there.
    assert again(3) == 6
    assert len(files(baked)) == len(files(fallback)) == 2
    (sentence,) = said
    assert sentence.endswith(f"; once, kept in {fallback}, since {baked} cannot be written to")
    other = kept()
    assert [other(1.5), other(3)] == [3.0, 6]
    assert len(other.stats.cache_hits) == 2


def test_broken_files_that_can_only_be_read_are_no_trouble(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert kept()(1.5) == 3.0
    baked = folder / "printhammer"
    for path in files(baked):
        path.write_bytes(path.read_bytes()[:20])
    make_read_only(baked, monkeypatch)
    monkeypatch.setattr(cache, "_folders", lambda: iter([baked, tmp_path / "fallback"]))
    assert kept()(1.5) == 3.0
    assert not kept()._cache._read[0].holds(kept().targetctx)


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("processor", "z80", "is for processor z80, this is "),
        ("numba", "0.1", f"is for numba 0.1, this is {numba.__version__}"),
        ("Python", "2.7", "is for Python 2.7, this is 3."),
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
    assert [kept()(1.5), kept()(3)] == [3.0, 6]
    why, first, second = said
    assert why.startswith(f"{place}: the machine code there ")
    assert reason in why
    assert first.startswith("compiling curves (a line): about 77 s; once")
    # From now on this machine has a record of its own.
    assert second == "compiling curves (a line): about 0 s"
    assert len(records.read(place)) == 2


def test_a_folder_may_be_copied_to_another_place_of_the_program(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert kept()(1.5) == 3.0
    moved = tmp_path / "elsewhere" / Path(__file__).name
    moved.parent.mkdir()
    moved.write_bytes(Path(__file__).read_bytes())
    monkeypatch.setattr(cache.inspect, "getfile", lambda _: str(moved))
    again = kept()
    assert again(1.5) == 3.0
    assert again.stats.cache_hits


@pytest.mark.parametrize(
    "text", ["", "{}", '{"makers": [{}]}', '{"makers": 3}', '{"makers": [{"seconds": 1}]}']
)
def test_a_record_that_is_none_is_passed_over(tmp_path: Path, text: str) -> None:
    (tmp_path / records.FILE).write_text(text)
    assert records.read(tmp_path) == []
    assert records.mismatch(tmp_path) == ""
    records.note(tmp_path, "runs", 2.5)
    assert records.expected([tmp_path], "runs") == 2.5


def test_what_may_follow_is_told_until_it_is_there(folder: Path, said: list[str]) -> None:
    first, second = kept(), cache.keep(numba.njit(lambda x: 3.0 * x), "peaks", "a line")
    first._cache.with_it, second._cache.with_it = (second._cache,), (first._cache,)
    assert [first(1.0), second(1.0)] == [2.0, 3.0]
    assert said == [
        "compiling curves (a line): about 1 s, then at most 1 s for peaks; once, kept on disk",
        "compiling peaks (a line): about 1 s",
    ]


def test_processes_that_compile_different_code_at_once_take_different_files(folder: Path) -> None:
    files_of = [cache._Files(str(folder), "name", b"stamp") for _ in range(2)]
    folder.mkdir()
    # Both have read the index before either writes it.
    for one in files_of:
        one._load_index = dict
    for one, key in zip(files_of, ("one processor", "another"), strict=True):
        one.save(key, key)
    fresh = cache._Files(str(folder), "name", b"stamp")
    assert [fresh.load("one processor"), fresh.load("another")] == [None, "another"]
    assert len(list(folder.glob("*.nbc"))) == 2


def run_elsewhere(folder: str, results: Any) -> None:
    config.CACHE_DIR = folder  # type: ignore[attr-defined]
    results.put(kept()(1.5))


def test_two_processes_compile_the_same_at_once(folder: Path) -> None:
    context = multiprocessing.get_context("fork")
    results = context.Queue()
    processes = [context.Process(target=run_elsewhere, args=(str(folder), results)) for _ in range(2)]
    for process in processes:
        process.start()
    assert [results.get(timeout=60) for _ in processes] == [3.0, 3.0]
    for process in processes:
        process.join()
    again = kept()
    assert again(1.5) == 3.0
    assert again.stats.cache_hits
    assert not [path for path in folder.rglob("*") if "tmp" in path.name]


def test_a_full_disk_is_told_once(folder: Path, monkeypatch: pytest.MonkeyPatch, said: list[str]) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(cache._Files, "save", full)
    assert [kept()(1.5), kept()(1.5)] == [3.0, 3.0]
    (sentence,) = [each for each in said if not each.startswith("compiling")]
    assert sentence.startswith(str(folder))
    assert "machine code cannot be kept (No space left on device)" in sentence


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
def test_a_file_cut_short_is_written_anew(folder: Path, ending: str) -> None:
    assert kept()(1.5) == 3.0
    (path,) = folder.rglob(f"*.{ending}")
    whole = path.read_bytes()
    path.write_bytes(whole[:20])
    assert kept()(1.5) == 3.0
    # Names in the machine code count the functions compiled before.
    assert len(path.read_bytes()) > len(whole) / 2
    again = kept()
    assert again(1.5) == 3.0
    assert again.stats.cache_hits


def test_what_is_interrupted_while_it_compiles_can_be_compiled_again(folder: Path) -> None:
    @compiled
    def cubed(x: float) -> float:
        return x * x * x

    @called
    def shifted(x: float) -> float:
        return cubed(x) + math.sqrt(x)

    def total(x: float) -> float:
        return shifted(x) + cubed(2.0 * x)

    class Stop(event.Listener):  # type: ignore[misc]
        left = 0

        def on_start(self, _: event.Event) -> None:
            self.left -= 1
            if self.left == 0:
                raise KeyboardInterrupt

        def on_end(self, _: event.Event) -> None: ...

    function, interrupted = entry(total), 0
    while not function.signatures:
        stop = Stop()
        stop.left = 1 + 7 * interrupted
        with event.install_listener("numba:run_pass", stop):
            try:
                function(4.0)
            except KeyboardInterrupt:
                interrupted += 1
    assert interrupted > 5
    assert function(4.0) == 64.0 + 2.0 + 512.0
    assert len(files(folder)) == 2
