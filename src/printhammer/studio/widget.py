"""The studio in a notebook: the same page, computed by the notebook's own Python."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from printhammer.errors import missing_extra

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer


def widget(hammer: Hammer | None = None, *, state: str = "", height: str = "760px") -> Any:
    """Return the studio as a widget for Jupyter, marimo and the like.

    Parameters
    ----------
    hammer : Hammer, optional
        The hammer that it opens with; by default the first one that comes with the program.
    state : str, optional
        A state as the address of the page holds it, behind the #.
    height : str, optional
        Height, as a style sheet tells it.

    Returns
    -------
    anywidget.AnyWidget
        Its trait `state` follows what is set.

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
        """A page and the work for it."""

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
            """End the work."""
            self._session.close()
            super().close()

    return StudioWidget(state=state, height=height)
