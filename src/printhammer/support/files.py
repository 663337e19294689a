"""Text files: reading, and atomic writing that never overwrites an input."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from printhammer.errors import InputError

listeners: set[Callable[[str], None]] = set()
"""Callbacks that receive a message before a long table is parsed, which takes seconds."""


def write_file(path: str | Path, content: str | bytes) -> None:
    """Write a file atomically; text is encoded in UTF-8.

    The content goes to a temporary file in the same folder, which then replaces the target, so that an
    existing file survives any failure.
    """
    target = Path(path)
    data = content.encode("utf-8") if isinstance(content, str) else content
    draft = None
    try:
        handle, draft = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        # Restore the usual permissions, since mkstemp creates files that only the owner can read.
        mask = os.umask(0)
        os.umask(mask)
        Path(draft).chmod(0o666 & ~mask)
        Path(draft).replace(target)
    except OSError as error:
        if draft is not None:
            with suppress(OSError):
                Path(draft).unlink()
        raise InputError(
            f"{target}: the file cannot be written ({error.strerror or error})", file=target
        ) from None


def make_folder(path: str | Path) -> Path:
    """Create a folder and its parents; raise InputError if no file can be written there."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise InputError(
            f"{folder}: expected a writable folder ({error.strerror or error})", file=folder
        ) from None
    return folder


def check_outputs(outputs: Iterable[Path], inputs: Iterable[Path] = ()) -> None:
    """Check, before a computation, that output files are writable, distinct, and not input files.

    Raises
    ------
    InputError
        The folder of a file is missing or read-only, or the file is a folder, an input, or named twice.
    """
    read = {path.resolve() for path in inputs}
    named: set[Path] = set()
    for path in outputs:
        place = path.resolve()
        if place in read:
            raise InputError(f"{path}: expected an output file that is not an input file", file=path)
        if place in named:
            raise InputError(f"{path}: expected distinct output files, this name occurs twice", file=path)
        named.add(place)
        store = place.suffix.lower() == ".zarr"
        # A Zarr store is a folder, and is overwritten as a whole.
        if place.is_dir() and not (store and (place / "zarr.json").is_file()):
            wanted = (
                "a new store; the existing folder is no Zarr store"
                if store
                else "a file to write, not a folder"
            )
            raise InputError(f"{path}: expected {wanted}", file=path)
        if not place.parent.is_dir():
            raise InputError(f"{path}: expected a file in a folder that exists", file=path)
        if not os.access(place.parent, os.W_OK):
            raise InputError(f"{path}: expected a file in a writable folder", file=path)


def read_text(path: Path, what: str, *, wanted: str = "", encoding: str = "utf-8") -> str:
    """Read a text file; `what` names the file in messages, such as "the drive file".

    Raises
    ------
    InputError
        The file cannot be read, or is not UTF-8; `wanted` is the expectation stated in the message.
    """
    try:
        return path.read_text(encoding)
    except UnicodeDecodeError:
        raise InputError(str(path), file=path, expected=wanted or f"{what} in UTF-8") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: {what} cannot be read ({reason})", file=path) from None
