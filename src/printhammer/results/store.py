"""Store of sweep results: a Zarr v3 group, written block by block, that survives a crash at any time.

All arrays are laid out before the first result. A block of members is one chunk of every array, so that
stored data are never rewritten. Each file is written to a temporary name, flushed to disk, and renamed; the
chunk of the array `MARK` is written last, so that a block is done if and only if that file exists. The
operating system releases the lock of a store when the process ends.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self

import numpy.typing as npt

from printhammer.errors import InputError, missing_extra
from printhammer.results.declare import Declared, part

if TYPE_CHECKING:
    import xarray as xr

MARK: Final = "status"
"""Name of the array whose chunk, written last, marks a block as complete."""

_ROOT: Final = "zarr.json"
_FLUSHES: Final = 8  # Files flushed at once; arbitrary
_ARRAYS: Final = "arrays"
_DRAFT: Final = f"{MARK}/.draft"


class Variable(Declared):
    """Array of a store: dimensions, type, chunks and attributes."""

    name: str = part("name of the variable")
    dims: tuple[str, ...] = part("names of the dimensions, member dimensions first")
    shape: tuple[int, ...] = part("lengths of the dimensions")
    dtype: str = part("NumPy name of the data type")
    fill: Any = part("fill value of entries not written yet")
    attrs: Mapping[str, Any] = part("attributes such as unit and meaning", default_factory=dict)
    values: npt.NDArray[Any] | None = part(
        "values of a coordinate, written with the layout; None for a result", default=None
    )


class Layout(Declared):
    """Layout of a store: its arrays, its attributes, and the settings that identify the sweep."""

    chunks: tuple[int, ...] = part("number of members in a block, along each member dimension")
    variables: tuple[Variable, ...] = part("results and coordinates, `MARK` among the results")
    attrs: Mapping[str, Any] = part("attributes of the group")
    identity: Mapping[str, str] = part("settings that must be equal for a sweep to be resumed")


class Store:
    """Store of sweep results, opened for writing and locked by this process; a context manager.

    Parameters
    ----------
    path : path
        Folder of the store; created if missing.
    layout : Layout
        Layout of the store.
    now : str
        Time stamp of the creation.

    Raises
    ------
    InputError
        The folder contains other data, or results of a sweep with other settings; another process holds the
        lock; the folder cannot be written; zarr is not installed. Existing data are kept.
    """

    def __init__(self, path: str | Path, layout: Layout, now: str) -> None:
        self.path = Path(path)
        self._layout = layout
        self._files, self._arrays = _encoder(layout)
        self._encoded = dict(self._files)
        self._handle = -1
        try:
            if self.path.exists() or self.path.is_symlink():
                self._reopen()
            else:
                self._create(now)
            (self.path / _DRAFT).unlink(missing_ok=True)
        except OSError as error:
            self.close()
            raise self._refusal(error) from None
        except BaseException:
            self.close()
            raise

    def done(self, index: Sequence[int]) -> bool:
        """Whether the block at an index of the chunk grid has been written."""
        return (self.path / _chunk(MARK, index)).exists()

    def write(self, index: Sequence[int], results: Mapping[str, npt.NDArray[Any]]) -> None:
        """Write a block atomically, and flush its files to disk.

        `index` is the index of the block in the chunk grid; `results` are the arrays of the block, by name.
        """
        where = tuple(
            slice(i * size, i * size + count)
            for i, size, count in zip(index, self._layout.chunks, results[MARK].shape, strict=True)
        )
        for name, values in results.items():
            self._arrays[name][where] = values
        files = {
            key: self._files.pop(key).to_bytes() for key in list(self._files) if key not in self._encoded
        }
        mark = files.pop(_chunk(MARK, index))
        try:
            self._put(files)
            self._put({_chunk(MARK, index): mark})
        except OSError as error:
            raise self._refusal(error) from None

    def finish(self, now: str) -> None:
        """Add the time stamp of completion, `now`, to a complete store, unless it already has a stamp."""
        root = _root(self.path)
        if root["attributes"].get("finished"):
            return
        root["attributes"]["finished"] = now
        try:
            self._put({_ROOT: _text(root)})
        except OSError as error:
            raise self._refusal(error) from None

    def close(self) -> None:
        """Release the lock of the store, so that another process can open it for writing."""
        if self._handle >= 0:
            os.close(self._handle)
            self._handle = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _reopen(self) -> None:
        root = _root(self.path)
        there = root["attributes"]
        for name, asked in self._layout.identity.items():
            if there.get(name) != asked:
                raise InputError(
                    f"{self.path}: the store was written with {name.replace('_', ' ')} {there.get(name)}",
                    file=self.path,
                    key=name,
                    expected=f"{asked}, or another folder for the results",
                )
        self._handle = _lock(self.path, self.path)

    def _create(self, now: str) -> None:
        """Create the arrays in a temporary folder, then rename the folder."""
        draft = self.path.with_name(f".{self.path.name}.part")
        draft.mkdir(exist_ok=True)
        self._handle = _lock(draft, self.path)
        for entry in draft.iterdir():
            shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
        files = {key: buffer.to_bytes() for key, buffer in self._encoded.items()}
        root = json.loads(files[_ROOT])
        root["attributes"] |= {"created": now, "finished": ""}
        files[_ROOT] = _text(root)
        try:
            for key, data in files.items():
                (draft / key).parent.mkdir(parents=True, exist_ok=True)
                (draft / key).write_bytes(data)
            _flush([draft, *draft.rglob("*")])
            draft.rename(self.path)
        except OSError:
            shutil.rmtree(draft, ignore_errors=True)
            raise
        _flush([self.path.parent])

    def _put(self, files: Mapping[str, bytes]) -> None:
        """Write files, given as contents by relative path, each atomically; flush all files to disk."""
        draft = self.path / _DRAFT
        touched: set[Path] = set()
        try:
            for key, data in files.items():
                target = self.path / key
                touched |= {target, *_make(target.parent)}
                draft.write_bytes(data)
                draft.replace(target)
        except OSError:
            with suppress(OSError):
                draft.unlink(missing_ok=True)
            raise
        _flush(touched)

    def _refusal(self, error: OSError) -> InputError:
        return InputError(
            f"{self.path}: the store cannot be written ({error.strerror or error}); its blocks are kept",
            file=self.path,
        )


def open_store(path: str | Path) -> xr.Dataset:
    """Open a store, complete or incomplete; values are read when accessed."""
    _require_zarr()
    import xarray as xr

    arrays = _root(Path(path))["attributes"][_ARRAYS]
    whole: Any = xr.open_zarr(path, chunks=None, consolidated=False)
    results: xr.Dataset = whole[arrays]
    return results


def _require_zarr() -> None:
    try:
        import zarr  # noqa: F401
    except ImportError:
        raise missing_extra("a store needs zarr", "sweep") from None


def _encoder(layout: Layout) -> tuple[dict[str, Any], dict[str, Any]]:
    """Create an in-memory Zarr group with a layout; return its files, and its arrays by name.

    Values written to an array appear among the files as the bytes to store on disk.
    """
    _require_zarr()
    import zarr
    from zarr.codecs import ZstdCodec
    from zarr.storage import MemoryStore

    files: dict[str, Any] = {}
    arrays = [variable.name for variable in layout.variables if variable.values is None]
    attrs = {**layout.attrs, _ARRAYS: arrays, **layout.identity}
    group = zarr.create_group(MemoryStore(store_dict=files), zarr_format=3, attributes=attrs)
    by_name: dict[str, Any] = {}
    members = len(layout.chunks)
    for variable in layout.variables:
        chunks = (
            variable.shape if variable.values is not None else (*layout.chunks, *variable.shape[members:])
        )
        by_name[variable.name] = array = group.create_array(
            variable.name,
            shape=variable.shape,
            # A chunk has at least one element, even along a dimension of length 0.
            chunks=tuple(max(1, length) for length in chunks),
            dtype=variable.dtype,
            fill_value=variable.fill,
            compressors=ZstdCodec(level=3, checksum=True),
            attributes=dict(variable.attrs),
            dimension_names=variable.dims,
            # Write chunks of fill values, too: their files mark blocks as done.
            config={"write_empty_chunks": True},
        )
        if variable.values is not None:
            array[...] = variable.values
    return files, by_name


def _root(path: Path) -> dict[str, Any]:
    """Return the metadata of the Zarr group of a store."""
    other = f"{path}: the folder is no store of printhammer: expected such a store, or a new name"
    try:
        root: dict[str, Any] = json.loads((path / _ROOT).read_bytes())
        _ = root["attributes"][_ARRAYS]
    except (FileNotFoundError, NotADirectoryError):
        if path.exists():
            raise InputError(other, file=path) from None
        raise InputError(f"{path}: there is no such store", file=path) from None
    except OSError as error:
        raise InputError(f"{path}: the store cannot be read ({error.strerror or error})", file=path) from None
    except (ValueError, KeyError, TypeError):
        raise InputError(other, file=path) from None
    return root


def _text(root: Mapping[str, Any]) -> bytes:
    return (json.dumps(root, indent=2, ensure_ascii=False) + "\n").encode()


def _chunk(name: str, index: Sequence[int]) -> str:
    return "/".join([name, "c", *(str(i) for i in index)])


def _lock(folder: Path, named: Path) -> int:
    """Lock a folder against other processes; return the file handle that holds the lock.

    The handle is -1 if the operating system has no such locks. Error messages name the folder `named`.
    """
    try:
        import fcntl
    except ImportError:
        # The system does not support such locks.
        return -1
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(handle)
        raise InputError(f"{named}: another process is writing this store", file=named) from None
    except OSError:
        os.close(handle)
        raise
    return handle


def _make(folder: Path) -> list[Path]:
    """Create a folder and its parents; return the folders whose entries must be flushed."""
    if folder.is_dir():
        return [folder]
    above = _make(folder.parent)
    folder.mkdir(exist_ok=True)
    return [*above, folder]


def _flush(paths: Collection[Path]) -> None:
    """Flush files and directory entries to disk, in parallel since a flush mostly waits for the disk."""
    with ThreadPoolExecutor(min(_FLUSHES, len(paths))) as pool:
        list(pool.map(_flush_one, paths))


def _flush_one(path: Path) -> None:
    if path.is_dir() and os.name != "posix":
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
