"""Base class of all figures: a matplotlib figure that notebooks display without pyplot."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure


class Picture(Figure):
    """Matplotlib figure that a notebook displays if the figure is the last value of a cell.

    Notebooks use the PNG repr. If the inline backend of matplotlib is active, the backend displays the figure
    instead, so that the figure appears only once.
    """

    settings: Mapping[str, Any] = {}
    """Matplotlib settings used when the figure is rendered."""

    def _repr_png_(self) -> bytes:
        """Return the figure as PNG bytes, for notebooks."""
        buffer = BytesIO()
        settings: Any = dict(self.settings)  # The type stub of matplotlib lists every setting by name.
        with rc_context(settings):
            self.savefig(buffer, format="png", dpi=self.dpi)
        return buffer.getvalue()
