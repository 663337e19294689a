"""Studio: hammer, drive and all their pictures in a browser, updated while a slider moves.

`serve` runs it on this machine for its user alone and needs the extra `studio`; `widget` embeds the same page
in a notebook and needs the extra `notebook`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from printhammer.studio.serve import serve
    from printhammer.studio.widget import widget

__all__ = ["serve", "widget"]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # Imported lazily by name, since server and widget need different extras.
    value = getattr(import_module(f"{__name__}.{name}"), name)
    globals()[name] = value
    return value
