"""Access token of the user, stored in a private folder so that links and open pages survive a restart."""

from __future__ import annotations

import logging
import os
import re
import secrets
import stat
import sys
from pathlib import Path
from typing import Final

logger = logging.getLogger(__name__)

FILE: Final = "studio-token"
_TOKEN: Final = re.compile(r"[\w-]{32}")


def user_folder() -> Path:
    """Return the folder for private program data of the user."""
    if os.name == "nt":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Application Support")
    else:
        base = os.environ.get("XDG_STATE_HOME") or str(Path.home() / ".local" / "state")
    return Path(base) / "printhammer"


def user_token() -> str:
    """Return the stored token of this user, or a new one.

    If the token cannot be stored, or others could have read or written it, it is valid for this session only,
    and a warning gives the reason.
    """
    path = user_folder() / FILE
    new = secrets.token_urlsafe(24)
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        try:
            written = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        except FileExistsError:
            return _kept(path)
        with os.fdopen(written, "w", encoding="ascii") as file:
            file.write(new)
    except (OSError, RuntimeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        logger.warning(
            "%s: the token of the studio is not kept (%s); links hold for this time only", path, reason
        )
    return new


def _kept(path: Path) -> str:
    """Return the token in a file; ValueError if others can access the file, or it holds no token."""
    with os.fdopen(os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0)), encoding="ascii") as file:
        entry = os.fstat(file.fileno())
        own = not hasattr(os, "getuid") or (entry.st_uid == os.getuid() and not entry.st_mode & 0o077)
        if not (stat.S_ISREG(entry.st_mode) and own):
            raise ValueError("expected a file that its user alone can read and write, mode 0600")
        text = file.read(100).strip()
    if not _TOKEN.fullmatch(text):
        raise ValueError("expected 32 letters and digits; take the file away for a new one")
    return text
