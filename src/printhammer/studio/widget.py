"""Studio in a notebook: the page of the studio in a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import missing_extra

if TYPE_CHECKING:
    from printhammer.hammer.hammer import Hammer

SCRIPT: Final = """
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = "printhammer studio";
    // The page begins with the state that is the name of its window.
    frame.name = model.get("state");
    frame.srcdoc = model.get("page");
    frame.style.cssText = "width: 100%; border: 0";
    frame.style.height = model.get("height");
    let told = frame.name;
    const hear = ({ source, data }) => {
      if (source !== frame.contentWindow || typeof data?.printhammer !== "string") return;
      told = data.printhammer;
      model.set("state", told);
      model.save_changes();
    };
    const tell = () => {
      if (model.get("state") === told) return;
      frame.contentWindow?.postMessage({ printhammer: model.get("state") }, "*");
    };
    window.addEventListener("message", hear);
    model.on("change:state", tell);
    el.append(frame);
    return () => { window.removeEventListener("message", hear); model.off("change:state", tell); };
  },
};
"""


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
    from printhammer.studio.live import live_page
    from printhammer.studio.shelf import Shelf

    class StudioWidget(anywidget.AnyWidget):
        """Notebook widget that shows the page."""

        _esm = SCRIPT
        page = traitlets.Unicode("").tag(sync=True)
        state = traitlets.Unicode("").tag(sync=True)
        height = traitlets.Unicode("").tag(sync=True)

    return StudioWidget(page=live_page(Shelf(*hammers, only=True)), state=state, height=height)
