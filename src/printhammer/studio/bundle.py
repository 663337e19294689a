"""The page as one ES module and one style sheet, for a notebook, where no module can fetch another."""

from __future__ import annotations

import json
import re
from functools import lru_cache
from typing import Final

from printhammer.studio.files import page_files

_IMPORT: Final = re.compile(r'from "\./([\w./]+)"')

_LOADER: Final = """
const sources = %s;
const places = {};
for (const [name, text] of sources) {
  const whole = text.replace(/from "\\.\\/([\\w.\\/]+)"/g, (_all, part) => `from "${places[part]}"`);
  places[name] = URL.createObjectURL(new Blob([whole], { type: "text/javascript" }));
}
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
    """Return the one module: the modules of the page as texts, needed ones first, and what loads them."""
    texts = {name: data.decode() for name, data in page_files().items() if name.endswith(".js")}
    ordered: list[tuple[str, str]] = []

    def add(name: str) -> None:
        if name in (done for done, _ in ordered):
            return
        for part in _IMPORT.findall(texts[name]):
            add(part)
        ordered.append((name, texts[name]))

    add("mount.js")
    return _LOADER % json.dumps(ordered)


@lru_cache
def style() -> str:
    """Return the one style sheet."""
    sheets = page_files()
    return "\n".join(sheets[name].decode() for name in ("vendor/uPlot.min.css", "studio.css"))
