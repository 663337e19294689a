"""The studio as the file ``studio.html`` of the documentation, shown on the front page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

NAME = "studio.html"


def write_page(app: Sphinx, exception: Exception | None) -> None:
    """Write the studio page with all shipped hammers next to the front page."""
    if exception is not None or app.builder.format != "html":
        return
    from printhammer.studio import Shelf, live_page

    Path(app.outdir, NAME).write_text(live_page(Shelf()), "utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register `write_page` for the end of a build."""
    app.connect("build-finished", write_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
