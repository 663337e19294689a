"""Studio page in a file: initial state of the page, and cache folder of written pages."""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.studio.bounds import LARGEST_FILE, LARGEST_MESSAGE, MOST_DOTS
from printhammer.support.files import make_folder, read_text, write_file

FORMAT: Final = 1  # Version of the state file format
KIND: Final = "printhammer studio state"

_KEPT: Final = 8
"""Number of pages that are kept in the cache folder; arbitrary."""


def read_start(written: str) -> tuple[dict[str, Any] | str, Hammer | None]:
    """Read the initial state of a page, and the hammer embedded in a state file, if any.

    Parameters
    ----------
    written : str
        Path of a state file that the studio has exported, or the text of a state as in the address of a page:
        "rate=900&pulses=3". The page itself reports entries that it cannot use.

    Raises
    ------
    InputError
        The file is not a state file, or its hammer is invalid.
    """
    # `Path.is_file` raises an error for texts longer than any path.
    if "=" in written and not os.path.isfile(written):
        return written.rpartition("#")[2], None
    path = Path(written)
    text = read_text(path, "the state")
    if len(text) > LARGEST_MESSAGE:
        raise InputError.of("characters", len(text), f"at most {LARGEST_MESSAGE}", file=path)
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        content = None
    if not isinstance(content, dict) or content.get("kind") != KIND:
        raise InputError(f"{path}: expected a state file, as the studio exports it", file=path, key="state")
    if content.get("format") != FORMAT:
        form = str(content.get("format"))[:40]
        raise InputError.of("format", form, FORMAT, file=str(path), written=form)
    state = content.get("state")
    if not isinstance(state, dict):
        raise InputError(f"{path}: state is expected to be a table", file=path, key="state")
    if not (isinstance(own := state.get("text"), str) and own):
        return state, None
    hammer = _hammer_inside(own, f"{path}, text")
    return {**state, "hammer": hammer.name, "text": ""}, hammer


def _hammer_inside(text: str, where: str) -> Hammer:
    """Parse a hammer file embedded in a state file; raise InputError if it refers to further files.

    `where` names the embedded text in error messages.
    """
    # The parse time of a key grows with the square of the number of its dots.
    dots = max(part.count(".") for part in re.split(r"[\n,=\[\]{}]", text))
    if len(text) > LARGEST_FILE or dots > MOST_DOTS:
        expected = f"at most {LARGEST_FILE} characters, and keys of at most {MOST_DOTS} dots"
        raise InputError(where, file=where, key="text", expected=expected)
    try:
        document = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{where}: expected a TOML file ({reason})", file=where, key="text") from None
    for name, entry in document.items():
        for section in entry if isinstance(entry, list) else [entry]:
            if isinstance(section, Mapping) and "file" in section:
                message = f"{where}: {name}.file names another file, which the studio does not read"
                raise InputError(message, file=where, key=f"{name}.file")
    hammer = Hammer.from_toml(text, name=where)
    hammer.check()
    return hammer


def keep_page(html: str) -> Path:
    """Write a page into the user's cache, under a digest of its content; return its path.

    Raises
    ------
    InputError
        The folder of the cache cannot be written.
    """
    folder = make_folder(_cache())
    path = folder / f"studio-{hashlib.sha256(html.encode()).hexdigest()[:16]}.html"
    write_file(path, html)
    ages = {}
    for page in folder.glob("studio-*.html"):
        # Another program may remove the page meanwhile.
        with suppress(OSError):
            ages[page] = page.stat().st_mtime
    for old in sorted(ages, key=lambda page: ages[page], reverse=True)[_KEPT:]:
        with suppress(OSError):
            old.unlink()
    return path


def _cache() -> Path:
    """Return the cache folder of the program, by the convention of the operating system."""
    if os.name == "nt":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "printhammer"
