"""Scripts and style sheets of the page, as parts of one HTML file."""

from __future__ import annotations

import json
import posixpath
import re
from functools import lru_cache
from importlib.resources import files
from typing import Final

_ENDINGS: Final = (".js", ".css", ".svg")
_IMPORT: Final = re.compile(r'from "(\.{1,2}/[\w./]+)"')
_IMPORTS: Final = re.compile(r'^import .* from ".*";$\n?', re.MULTILINE)
_EXPORT: Final = re.compile(r"^export (?=(async )?function|const|let|class)", re.MULTILINE)

_SOURCES: Final = """
const sources = %s;
const places = {};
for (const [name, text] of sources) {
  const whole = text.replace(/from "\\.\\/([\\w.\\/]+)"/g, (_all, part) => `from "${places[part]}"`);
  places[name] = URL.createObjectURL(new Blob([whole], { type: "text/javascript" }));
}
"""


@lru_cache
def page_files() -> dict[str, bytes]:
    """Load the files of the page; return their content by name."""
    contents: dict[str, bytes] = {}
    root = files("printhammer.studio").joinpath("web")
    for place in ("", "vendor/", "engine/"):
        for entry in root.joinpath(place).iterdir():
            if entry.name.endswith(_ENDINGS):
                contents[place + entry.name] = entry.read_bytes()
    # The vendored file stays unmodified; its definitions are exported as a module here.
    contents["vendor/uPlot.js"] = contents["vendor/uPlot.iife.min.js"] + b"\nexport default uPlot;\n"
    contents["engine/call.js"] = files("printhammer.kernel.compile.web").joinpath("call.mjs").read_bytes()
    return contents


def sources(wanted: str) -> str:
    """Return a script that creates a module of the page and its dependencies."""
    return _SOURCES % inside(_ordered(wanted))


def inside(content: object) -> str:
    """Return JSON in which no text resembles the end of a script."""
    return json.dumps(content).replace("<", "\\u003c")


def merged(wanted: str) -> str:
    """Return a module of the page and its dependencies as one script without imports, as workers need it."""
    return "\n".join(_EXPORT.sub("", _IMPORTS.sub("", text)) for _, text in _ordered(wanted))


def _ordered(wanted: str) -> list[tuple[str, str]]:
    """Return a module and its dependencies, each before those that import it, by name from the root."""
    texts = {name: data.decode() for name, data in page_files().items() if name.endswith(".js")}
    ordered: dict[str, str] = {}

    def add(name: str) -> None:
        if name in ordered:
            return
        folder = posixpath.dirname(name)

        def place(found: re.Match[str]) -> str:
            part = posixpath.normpath(posixpath.join(folder, found[1]))
            add(part)
            return f'from "./{part}"'

        ordered[name] = _IMPORT.sub(place, texts[name])

    add(wanted)
    # A module is entered after those that it imports.
    return list(ordered.items())


def style() -> str:
    """Return all style sheets of the page as one text."""
    return "\n".join(page_files()[name].decode() for name in ("vendor/uPlot.min.css", "studio.css"))
