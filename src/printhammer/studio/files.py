"""Static files of the studio page."""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files
from typing import Final

KINDS: Final = {".js": "text/javascript", ".css": "text/css", ".html": "text/html", ".svg": "image/svg+xml"}
"""Media types by file ending."""


@lru_cache
def page_files() -> dict[str, bytes]:
    """Load the static files of the page; return their content by request path."""
    contents: dict[str, bytes] = {}
    root = files("printhammer.studio").joinpath("web")
    for folder, place in (
        (root, ""),
        (root.joinpath("vendor"), "vendor/"),
        (root.joinpath("engine"), "engine/"),
    ):
        for entry in folder.iterdir():
            if any(entry.name.endswith(kind) for kind in KINDS):
                contents[place + entry.name] = entry.read_bytes()
    # The vendored file stays unmodified; its definitions are exported as a module here.
    contents["vendor/uPlot.js"] = contents["vendor/uPlot.iife.min.js"] + b"\nexport default uPlot;\n"
    contents["engine/call.js"] = files("printhammer.kernel.compile.web").joinpath("call.mjs").read_bytes()
    return contents
