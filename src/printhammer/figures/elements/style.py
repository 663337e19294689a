"""Style of all figures: colours, line widths and font sizes.

Figures are built with matplotlib's objects, never with pyplot, which would leave global state. Colours are
those of M. Okabe and K. Ito (2008), suited to the colour-blind; important distinctions also use dashes or
labels.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Final, Literal, ParamSpec

from printhammer.hammer.hammer import Hammer
from printhammer.results.summary import worded

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_P = ParamSpec("_P")
_Layout = Literal["constrained", "none"]

INK: Final = "#1a1a1a"
MUTED: Final = "#6b6b6b"
FAINT: Final = "#d9d9d9"
BLUE: Final = "#0072b2"
ORANGE: Final = "#d55e00"
GREEN: Final = "#009e73"
YELLOW: Final = "#e69f00"
FAMILY: Final = ("#7db7dc", "#4f9bcb", "#2f7fb9", "#1a619f", "#08417a")
"""Colours from light to dark, for a family of curves with one parameter."""

SURFACES: Final = {"backstop": "#8a8a8a", "pack": YELLOW}
"""Colours of backstop and pack, used as tints."""

WIDTH: Final = 6.4
"""Default width of a figure, in inches; arbitrary."""

TEXT, SMALL, TINY = 9.0, 8.0, 6.5  # Font sizes, points; arbitrary
LINE, THIN, HAIR = 1.4, 0.9, 0.6  # Line widths, points; arbitrary
_LINE_OF_REMARK: Final = 112  # Number of characters in a line of a remark; arbitrary

RC: Final[dict[str, Any]] = {
    "axes.edgecolor": INK,
    "axes.formatter.useoffset": False,
    "axes.grid": False,
    "axes.labelcolor": INK,
    "axes.labelsize": TEXT,
    "axes.linewidth": HAIR,
    "axes.unicode_minus": True,
    "axes.xmargin": 0.0,
    "figure.constrained_layout.h_pad": 0.05,
    "figure.constrained_layout.w_pad": 0.06,
    "figure.dpi": 100.0,
    "figure.facecolor": "white",
    "font.family": ["DejaVu Sans"],
    "font.size": TEXT,
    "lines.dash_capstyle": "butt",
    "lines.linewidth": LINE,
    "lines.solid_joinstyle": "round",
    "mathtext.fontset": "dejavusans",
    "patch.linewidth": HAIR,
    "path.simplify": True,
    "path.simplify_threshold": 0.05,
    "pdf.fonttype": 42,
    "savefig.bbox": None,
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "printhammer",
    "text.color": INK,
    "text.usetex": False,
    "xtick.color": INK,
    "xtick.direction": "in",
    "xtick.labelsize": SMALL,
    "xtick.major.size": 3.5,
    "xtick.major.width": HAIR,
    "ytick.color": INK,
    "ytick.direction": "in",
    "ytick.labelsize": SMALL,
    "ytick.major.size": 3.5,
    "ytick.major.width": HAIR,
}
"""Matplotlib settings for building and saving figures, used instead of the user's settings."""


def in_style() -> AbstractContextManager[None]:
    """Return a context in which matplotlib uses the settings `RC`."""
    from matplotlib import rc_context

    settings: Any = RC  # The type stub of matplotlib lists every setting by name.
    return rc_context(settings)


def styled(function: Callable[_P, Figure]) -> Callable[_P, Figure]:
    """Decorate a drawing function: apply the style `RC` and the hammer's word for a dot to its figure.

    The word is the attribute `strike` of an argument: a hammer, a result or a frequency-time map.
    """

    @wraps(function)
    def wrapped(*args: _P.args, **kwargs: _P.kwargs) -> Figure:
        with in_style():
            figure = function(*args, **kwargs)
        for each in (*args, *kwargs.values()):
            if (strike := getattr(each, "strike", "dot")) != "dot":
                _name_strikes(figure, strike)
                break
        return figure

    return wrapped


def _name_strikes(figure: Figure, strike: str) -> None:
    """Replace the word "dot" in all texts of a figure with the hammer's word for the result of a pulse."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if (said := worded(text.get_text(), strike)) != text.get_text():
            text.set_text(said)


def new_figure(height: float, width: float = WIDTH, layout: _Layout = "constrained") -> Figure:
    """Create an empty figure, with sizes in inches; by default, the layout avoids overlaps."""
    from printhammer.figures.elements.picture import Picture

    figure = Picture(figsize=(width, height), layout=layout)  # type: ignore[arg-type]
    figure.settings = RC
    return figure


def new_panel(height: float, width: float = WIDTH) -> tuple[Figure, Axes]:
    """Create a figure with a single panel, sizes in inches; return figure and panel."""
    figure = new_figure(height, width)
    return figure, figure.add_subplot()


def with_strip(figure: Figure, ratio: float = 5.5) -> tuple[Axes, Axes]:
    """Divide a figure into a panel and a slim strip below it that share the time axis; return both axes.

    `ratio` is the height of the panel divided by the height of the strip.
    """
    grid = figure.add_gridspec(2, 1, height_ratios=(ratio, 1.0), hspace=0.03)
    panel = figure.add_subplot(grid[0])
    strip = figure.add_subplot(grid[1], sharex=panel)
    panel.tick_params(axis="x", labelbottom=False)
    strip.locator_params(axis="y", nbins=2)
    return panel, strip


def sign(figure: Figure, hammer: Hammer, *remarks: str) -> None:
    """Write hammer name, fingerprint and status of constants at the foot of a figure, remarks at the top."""
    statuses = {constant.status for constant in hammer.constants.values()}
    known = [status for status in ("reconstructed", "assumed") if status in statuses]
    origin = [hammer.name, hammer.fingerprint[:8]]
    if known:
        origin.append(f"constants in part {' and '.join(known)}")
    lines = [line for remark in remarks if remark for line in wrap(remark, _LINE_OF_REMARK)]
    foot(figure, " · ".join(origin), "\n".join(lines))


def foot(figure: Figure, origin: str, remark: str = "") -> None:
    """Write the origin of the data at the foot of a figure, and a remark at the top."""
    text = figure.supxlabel(origin, x=0.99, ha="right", fontsize=TINY, color=MUTED)
    text.set_in_layout(True)
    if remark:
        figure.suptitle(remark, x=0.01, ha="left", fontsize=SMALL, color=ORANGE)
