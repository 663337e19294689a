"""Text files that the program reads."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path


def read_text(path: Path, what: str, *, wanted: str = "", encoding: str = "utf-8") -> str:
    """Read a text file; `what` names it in messages, such as "the drive file".

    Raises
    ------
    InputError
        The file cannot be read, or is not UTF-8; `wanted` may say what was expected instead.
    """
    try:
        return path.read_text(encoding)
    except UnicodeDecodeError:
        raise InputError(f"{path}: {wanted or f'{what} is expected to be UTF-8 text'}") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: {what} cannot be read ({reason})") from None
