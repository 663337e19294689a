"""Studio in a notebook: the page of the studio, with computations in the notebook's Python process."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.errors import missing_extra

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


def widget(hammer: Hammer | None = None, *, state: str = "", height: str = "760px") -> Any:
    """Return the studio as a notebook widget (anywidget), for Jupyter and marimo.

    Parameters
    ----------
    hammer : Hammer, optional
        Hammer to open; by default the first shipped hammer.
    state : str, optional
        State, in the form of the page's address after the #.
    height : str, optional
        Height, in the syntax of a style sheet.

    Returns
    -------
    anywidget.AnyWidget
        Widget whose trait `state` follows the settings.

    Raises
    ------
    InputError
        The extra `notebook` is not installed.
    """
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise missing_extra(f"the widget needs {error.name}", "notebook") from None
    from printhammer.studio.bundle import module, style
    from printhammer.studio.session import Session
    from printhammer.studio.states.shelf import Shelf
    from printhammer.studio.states.state import ProtocolError

    shelf = Shelf(hammer)

    class StudioWidget(anywidget.AnyWidget):
        """Notebook widget: the page, and the session that computes its views."""

        _esm = module()
        _css = style()
        state = traitlets.Unicode("").tag(sync=True)
        height = traitlets.Unicode("").tag(sync=True)

        def __init__(self, **traits: Any) -> None:
            super().__init__(**traits)
            self._session = Session(lambda data: self.send({}, [data]), shelf)
            self.on_msg(self._take)

        def _take(self, _widget: Any, content: Any, _buffers: Any) -> None:
            try:
                self._session.receive(content["text"] if isinstance(content, dict) else "")
            except (ProtocolError, KeyError, TypeError):
                # A notebook has no connection to close.
                return

        def close(self) -> None:
            """Close the session."""
            self._session.close()
            super().close()

    return StudioWidget(state=state, height=height)
