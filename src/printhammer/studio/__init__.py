"""Studio: an HTML file that simulates hammers in the browser and plots their motions.

`live_page` returns the page, `widget` shows it in a notebook and needs the extra `notebook`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from printhammer.studio.live import live_page
    from printhammer.studio.shelf import Shelf
    from printhammer.studio.widget import widget

__all__ = ["Shelf", "live_page", "widget"]

_PLACES = {"Shelf": "shelf", "live_page": "live", "widget": "widget"}


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # Imported lazily by name, since the page needs the kernel and the widget an extra.
    value = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
    globals()[name] = value
    return value
