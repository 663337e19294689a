"""The kind of all figures: one of matplotlib's that a notebook shows, although pyplot does not know it."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

from matplotlib import rc_context
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Mapping


class Picture(Figure):
    """A figure that shows itself as the last line of a cell.

    Notebooks show what pyplot made, and what tells them how. Where the inline backend of matplotlib is at
    work, it goes first, and the picture appears once.
    """

    settings: Mapping[str, Any] = {}
    """Settings of matplotlib with which it is shown."""

    def _repr_png_(self) -> bytes:
        """Return what a notebook shows."""
        buffer = BytesIO()
        settings: Any = dict(self.settings)  # matplotlib's own type lists every setting by name
        with rc_context(settings):
            self.savefig(buffer, format="png", dpi=self.dpi)
        return buffer.getvalue()
