"""Page as one ES module and one style sheet, for a notebook, and as one file without a server."""

from __future__ import annotations

import json
import posixpath
import re
from functools import lru_cache
from typing import Final

from printhammer.studio.files import page_files

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

_WIDGET: Final = """
const { mount } = await import(places["mount.js"]);
export default {
  render({ model, el }) {
    el.classList.add("studio-widget");
    // Notebooks have keys of their own, some of which cut cells: what is typed here is not for them.
    el.dataset.lmSuppressShortcuts = "true";
    el.addEventListener("keydown", (event) => event.stopPropagation());
    el.style.setProperty("--height", model.get("height"));
    const studio = mount(el, (text) => model.send({ text }), {
      read: () => model.get("state"),
      write: (text) => { model.set("state", text); model.save_changes(); },
      address: () => model.get("state"),
    });
    const take = (_content, buffers) => { for (const buffer of buffers) studio.receive(buffer); };
    model.on("msg:custom", take);
    return () => model.off("msg:custom", take);
  },
};
"""


@lru_cache
def module() -> str:
    """Return one ES module that contains the modules of the page as texts, and loads them in order."""
    return sources("mount.js") + _WIDGET


def sources(wanted: str) -> str:
    """Return a script that creates a module of the page and its dependencies."""
    # Inside a page, no text may resemble the end of a script.
    return _SOURCES % json.dumps(_ordered(wanted)).replace("<", "\\u003c")


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


@lru_cache
def style() -> str:
    """Return all style sheets of the page as one text."""
    sheets = page_files()
    return "\n".join(sheets[name].decode() for name in ("vendor/uPlot.min.css", "studio.css"))


PLACE: Final = "/* what is kept */"
"""Placeholder of the saved page for its state and curves, as JSON without the character <."""

_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline' blob:; \
style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'; form-action 'none'">
<title>printhammer studio, as it was saved</title>
<style>%s</style>
</head>
<body>
<div id="studio"></div>
<noscript>The curves are drawn by JavaScript.</noscript>
<script type="application/json" id="kept">%s</script>
<script type="module">%s
const { show } = await import(places["kept.js"]);
show(document.getElementById("studio"), JSON.parse(document.getElementById("kept").textContent));
</script>
</body>
</html>
"""


@lru_cache
def page() -> str:
    """Return a page that shows, without a server, the content inserted at `PLACE`."""
    return _PAGE % (style(), PLACE, sources("kept.js"))
