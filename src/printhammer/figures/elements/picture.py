"""Class of all figures: a matplotlib figure that notebooks display without pyplot."""

from __future__ import annotations

from io import BytesIO
from typing import TYPE_CHECKING, Any

from matplotlib import rc_context
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from collections.abc import Mapping


class Picture(Figure):
    """Figure that displays itself as the last value of a notebook cell.

    The PNG repr is used by notebooks; with the inline backend of matplotlib active, that backend takes
    precedence, and the picture appears once.
    """

    settings: Mapping[str, Any] = {}
    """Matplotlib settings for rendering."""

    def _repr_png_(self) -> bytes:
        """Return the PNG for notebooks."""
        buffer = BytesIO()
        settings: Any = dict(self.settings)  # The type stub of matplotlib lists every setting by name.
        with rc_context(settings):
            self.savefig(buffer, format="png", dpi=self.dpi)
        return buffer.getvalue()
