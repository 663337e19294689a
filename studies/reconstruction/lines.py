"""JSON Lines files that grow while a search or an evaluation runs: reading complete lines, appending."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from printhammer.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path


def read_text(path: Path, what: str = "file", *, required: bool = False) -> str:
    """Return the text of a file; for a missing file, empty text or, if `required`, an error.

    Raises
    ------
    InputError
        The file cannot be read.
    """
    try:
        # Read bytes, since the length of the kept part is counted in bytes.
        return path.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        if isinstance(error, FileNotFoundError) and not required:
            return ""
        reason = getattr(error, "strerror", None) or "not UTF-8"
        raise InputError(f"{path}: the {what} cannot be read ({reason})") from None


def read_object(line: str) -> dict[str, Any] | None:
    """Parse a line as a JSON object; None if the line is not a JSON object."""
    try:
        row = json.loads(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) else None


def append(path: Path, text: str, what: str = "file", *, kept: str | None = None) -> None:
    """Append text to a file; with `kept`, the file is first truncated to the text `kept`.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    try:
        with path.open("ab") as file:
            if kept is not None:
                file.truncate(len(kept.encode()))
            file.write(text.encode())
    except OSError as error:
        raise InputError(f"{path}: the {what} cannot be written ({error.strerror or error})") from None
