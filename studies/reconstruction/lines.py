"""Files of JSON lines that grow while a search or a judge works: read as far as they are whole, added to."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from printhammer.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path


def read_text(path: Path, what: str = "file", *, required: bool = False) -> str:
    """Return the text of a file; unless it is required, none where there is no file.

    Raises
    ------
    InputError
        It cannot be read.
    """
    try:
        # Bytes, since the length of what is kept counts in them.
        return path.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        if isinstance(error, FileNotFoundError) and not required:
            return ""
        reason = getattr(error, "strerror", None) or "not UTF-8"
        raise InputError(f"{path}: the {what} cannot be read ({reason})") from None


def read_object(line: str) -> dict[str, Any] | None:
    """Return the JSON object of a line; None if it is none."""
    try:
        row = json.loads(line)
    except ValueError:
        return None
    return row if isinstance(row, dict) else None


def append(path: Path, text: str, what: str = "file", *, kept: str | None = None) -> None:
    """Add text to a file, behind a beginning that is kept, if one is given.

    Raises
    ------
    InputError
        It cannot be written.
    """
    try:
        with path.open("ab") as file:
            if kept is not None:
                file.truncate(len(kept.encode()))
            file.write(text.encode())
    except OSError as error:
        raise InputError(f"{path}: the {what} cannot be written ({error.strerror or error})") from None
