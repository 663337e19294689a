"""Studio in a notebook: the page of the studio in a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.errors import missing_extra

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


def widget(*hammers: Hammer, state: str = "", height: str = "760px") -> Any:
    """Return the studio as a notebook widget (anywidget), for Jupyter and marimo.

    Parameters
    ----------
    *hammers : Hammer
        Hammers of the page; by default all shipped hammers.
    state : str, optional
        State, in the form of the page's address after the #.
    height : str, optional
        Height, in the syntax of a style sheet.

    Returns
    -------
    anywidget.AnyWidget
        Widget whose trait `state` follows the settings; setting `state` changes them.

    Raises
    ------
    InputError
        The extra `notebook` is not installed, or a hammer has laws of its own and the extra `page` is not.
    """
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise missing_extra(f"the widget needs {error.name}", "notebook") from None
    from printhammer.studio.bundle import page_files
    from printhammer.studio.live import live_page
    from printhammer.studio.shelf import Shelf

    class StudioWidget(anywidget.AnyWidget):
        """Notebook widget that shows the page."""

        _esm = page_files()["widget.mjs"].decode()
        page = traitlets.Unicode("").tag(sync=True)
        state = traitlets.Unicode("").tag(sync=True)
        height = traitlets.Unicode("").tag(sync=True)

    return StudioWidget(page=live_page(Shelf(*hammers, only=True)), state=state, height=height)
