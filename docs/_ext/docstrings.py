"""Corrections of the way in which Sphinx and its numpydoc reader parse four kinds of docstrings."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from sphinx.addnodes import pending_xref

if TYPE_CHECKING:
    from docutils import nodes
    from sphinx.application import Sphinx

# Napoleon runs at 500, the default.
BEFORE, AFTER = 400, 600
LETTER = re.compile(r"^(:param [^:]+: )(?=[A-Za-z]\.$)")
NAMES = re.compile(r"^:(?:ivar|vartype) \w+(?:, \w+)+:")
written: dict[str, list[str]] = {}


def keep(_app: Sphinx, what: str, name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Store the docstring of a property before numpydoc processes it."""
    if what == "property" and not any(re.match(r"^\s*-{3,}\s*$", line) for line in lines):
        written[name] = list(lines)


def restore(_app: Sphinx, _what: str, name: str, _object: Any, _options: Any, lines: list[str]) -> None:
    """Undo three misreadings: "Word: ..." as a type, "N." as a list, "a, b" as a type and a name."""
    if name in written:
        lines[:] = written.pop(name)
    lines[:] = [LETTER.sub(r"\1\\", line) for line in lines]
    lines[:] = [NAMES.sub(lambda found: found[0].replace(", ", ","), line) for line in lines]


def unlink(_app: Sphinx, doctree: nodes.document) -> None:
    """Replace links by plain words in shapes such as "shape (rate, time)": dimensions are not names."""
    for link in list(doctree.findall(pending_xref)):
        dimension = link.get("reftype") == "class" and link["reftarget"].islower()
        if dimension and "shape (" in link.parent.astext():
            link.replace_self(link.children)


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the corrections to the events of autodoc."""
    app.connect("autodoc-process-docstring", keep, priority=BEFORE)
    app.connect("autodoc-process-docstring", restore, priority=AFTER)
    app.connect("doctree-read", unlink)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
