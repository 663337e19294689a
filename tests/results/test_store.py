"""Stores: complete blocks are never lost, incomplete blocks are rewritten, other files are unchanged."""

import errno
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from tests.errors import refused

from printhammer.results.store import Layout, Store, Variable, open_store

if TYPE_CHECKING:
    from collections.abc import Callable

NOW = "2026-01-01T00:00:00+00:00"
LAYOUT = Layout(
    chunks=(2,),
    variables=(
        Variable("status", ("member",), (5,), "int8", -1),
        Variable("x", ("member", "time"), (5, 3), "float64", np.nan, {"units": "m"}),
        Variable("time", ("time",), (3,), "float64", 0, {"units": "s"}, np.array([0.0, 1.0, 2.0])),
    ),
    attrs={"title": "a try"},
    identity={"store_format": "1", "tolerance": "1e-09"},
)


def block(index: int) -> dict[str, Any]:
    count = min(2, 5 - 2 * index)
    x = np.full((count, 3), np.nan)
    x[:] = np.arange(3) + 10.0 * index
    return {"status": np.zeros(count, np.int8), "x": x}


def files_of(path: Path) -> dict[str, bytes]:
    return {str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*") if file.is_file()}


def filled(path: Path) -> dict[str, bytes]:
    with Store(path, LAYOUT, NOW) as store:
        for index in range(3):
            assert not store.done((index,))
            store.write((index,), block(index))
            assert store.done((index,))
        store.finish(NOW)
    return files_of(path)


def test_a_store_holds_what_was_written(tmp_path: Path) -> None:
    filled(tmp_path / "a.zarr")
    found = open_store(tmp_path / "a.zarr")
    assert found.x.values[:, 0].tolist() == [0.0, 0.0, 10.0, 10.0, 20.0]
    assert found.status.values.tolist() == [0] * 5
    assert found.time.values.tolist() == [0.0, 1.0, 2.0]
    assert found.x.attrs == {"units": "m"}
    assert (found.attrs["title"], found.attrs["created"], found.attrs["finished"]) == ("a try", NOW, NOW)
    assert [path.name for path in tmp_path.iterdir()] == ["a.zarr"]


def test_a_store_that_is_not_complete_can_be_read(tmp_path: Path) -> None:
    with Store(tmp_path / "a.zarr", LAYOUT, NOW) as store:
        store.write((1,), block(1))
        found = open_store(tmp_path / "a.zarr")
        assert found.status.values.tolist() == [-1, -1, 0, 0, -1]
        assert np.isnan(found.x.values[[0, 1, 4]]).all()
        assert found.attrs["finished"] == ""


def test_the_order_of_the_blocks_leaves_no_trace(tmp_path: Path) -> None:
    with Store(tmp_path / "b.zarr", LAYOUT, NOW) as store:
        for index in (2, 0, 1):
            store.write((index,), block(index))
        store.finish(NOW)
        store.finish("later")
    assert files_of(tmp_path / "b.zarr") == filled(tmp_path / "a.zarr")


def test_a_block_of_nothing_but_fill_values_is_done_too(tmp_path: Path) -> None:
    with Store(tmp_path / "a.zarr", LAYOUT, NOW) as store:
        store.write((0,), {"status": np.full(2, -1, np.int8), "x": np.full((2, 3), np.nan)})
        assert store.done((0,))
    assert "x/c/0/0" in files_of(tmp_path / "a.zarr")


def test_a_block_without_its_mark_is_written_again(tmp_path: Path) -> None:
    whole = filled(tmp_path / "a.zarr")
    with Store(tmp_path / "b.zarr", LAYOUT, NOW) as store:
        store.write((0,), block(0))
    # What a kill can leave: results without mark, a draft, a draft of a whole store.
    (tmp_path / "b.zarr" / "x" / "c" / "1").mkdir()
    (tmp_path / "b.zarr" / "x" / "c" / "1" / "0").write_bytes(b"something else")
    (tmp_path / "b.zarr" / "status" / ".draft").write_bytes(b"half")
    with Store(tmp_path / "b.zarr", LAYOUT, NOW) as store:
        assert [store.done((index,)) for index in range(3)] == [True, False, False]
        for index in (1, 2):
            store.write((index,), block(index))
        store.finish(NOW)
    assert files_of(tmp_path / "b.zarr") == whole


def test_a_draft_of_a_store_is_begun_anew(tmp_path: Path) -> None:
    draft = tmp_path / ".a.zarr.part"
    (draft / "x").mkdir(parents=True)
    (draft / "rest").write_text("of a kill")
    filled(tmp_path / "a.zarr")
    assert [path.name for path in tmp_path.iterdir()] == ["a.zarr"]
    assert "rest" not in files_of(tmp_path / "a.zarr")


@pytest.mark.parametrize(
    ("layout", "key"),
    [
        (replace(LAYOUT, identity={"store_format": "2", "tolerance": "1e-09"}), "store_format"),
        (
            replace(LAYOUT, identity={"store_format": "1", "tolerance": "1e-08"}),
            "tolerance",
        ),
    ],
)
def test_results_of_something_else_are_refused(tmp_path: Path, layout: Layout, key: str) -> None:
    whole = filled(tmp_path / "a.zarr")
    with refused(key):
        Store(tmp_path / "a.zarr", layout, NOW)
    assert files_of(tmp_path / "a.zarr") == whole


@pytest.mark.parametrize(
    "content", [{}, {"notes.txt": "mine"}, {"zarr.json": "{}"}, {"zarr.json": "no JSON"}]
)
def test_another_folder_is_refused_and_left_alone(tmp_path: Path, content: dict[str, str]) -> None:
    folder = tmp_path / "other"
    folder.mkdir()
    for name, text in content.items():
        (folder / name).write_text(text)
    with refused(None):
        Store(folder, LAYOUT, NOW)
    assert {path.name: path.read_text() for path in folder.iterdir()} == content


def test_a_file_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "taken"
    path.write_text("mine")
    with refused(None):
        Store(path, LAYOUT, NOW)
    assert path.read_text() == "mine"
    with refused(None):
        open_store(tmp_path / "none")


def test_a_place_that_cannot_be_written_to_is_told(tmp_path: Path) -> None:
    with refused(None, file="a.zarr"):
        Store(tmp_path / "none" / "a.zarr", LAYOUT, NOW)


def test_two_processes_do_not_share_a_store(tmp_path: Path) -> None:
    with Store(tmp_path / "a.zarr", LAYOUT, NOW) as store:
        store.write((0,), block(0))
        with refused(None, file="a.zarr"):
            Store(tmp_path / "a.zarr", LAYOUT, NOW)
    with Store(tmp_path / "a.zarr", LAYOUT, NOW) as store:
        assert store.done((0,))


def test_two_processes_do_not_lay_out_the_same_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rename = Path.rename

    def meanwhile(self: Path, target: Path) -> Path:
        with refused(None, file="a.zarr"):
            Store(tmp_path / "a.zarr", LAYOUT, NOW)
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", meanwhile)
    Store(tmp_path / "a.zarr", LAYOUT, NOW).close()


@pytest.mark.parametrize("failing", ["write_bytes", "replace"])
@pytest.mark.parametrize("after", range(4))
def test_a_full_disk_costs_only_the_block(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str, after: int
) -> None:
    whole = filled(tmp_path / "a.zarr")
    genuine: Callable[..., Any] = getattr(Path, failing)
    left = after

    def full(self: Path, *arguments: Any) -> Any:
        nonlocal left
        if left == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        left -= 1
        return genuine(self, *arguments)

    with Store(tmp_path / "b.zarr", LAYOUT, NOW) as store:
        monkeypatch.setattr(Path, failing, full)
        for index in range(3):
            if left < 2:
                with refused(None, file="b.zarr"):
                    store.write((index,), block(index))
                break
            store.write((index,), block(index))
        monkeypatch.undo()
        assert [store.done((index,)) for index in range(3)] == [after // 2 > index for index in range(3)]
        assert not (tmp_path / "b.zarr" / "status" / ".draft").exists()
    with Store(tmp_path / "b.zarr", LAYOUT, NOW) as store:
        for index in range(after // 2, 3):
            store.write((index,), block(index))
        store.finish(NOW)
    assert files_of(tmp_path / "b.zarr") == whole


@pytest.mark.parametrize("after", range(3))
def test_a_full_disk_leaves_no_half_laid_out_store(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: int
) -> None:
    left = after
    genuine = Path.write_bytes

    def full(self: Path, data: bytes) -> int:
        nonlocal left
        if left == 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        left -= 1
        return genuine(self, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with refused(None, file="a.zarr"):
        Store(tmp_path / "a.zarr", LAYOUT, NOW)
    assert list(tmp_path.iterdir()) == []
