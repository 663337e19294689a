"""The files of the page."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files
from typing import Final

KINDS: Final = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".svg": "image/svg+xml"}
"""Types of the files, by their endings."""


@lru_cache
def page_files() -> dict[str, bytes]:
    """Return the files of the page by the path under which they are asked for."""
    contents: dict[str, bytes] = {}
    root = files("printhammer.studio").joinpath("web")
    for folder, place in ((root, ""), (root.joinpath("vendor"), "vendor/")):
        for entry in folder.iterdir():
            if any(entry.name.endswith(kind) for kind in KINDS):
                contents[place + entry.name] = entry.read_bytes()
    # The vendored file stays as its authors built it; what it defines becomes a module here.
    contents["vendor/uPlot.js"] = contents["vendor/uPlot.iife.min.js"] + b"\nexport default uPlot;\n"
    return contents
