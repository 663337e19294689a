"""Recurrence plots with what is counted in them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from printhammer.figures.elements.marks import beside
from printhammer.figures.elements.style import INK, SMALL, new_panel, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.chaos import Recurrence

_NAMES: Final = {
    "rate": "recurrence rate",
    "determinism": "determinism",
    "mean_diagonal": "mean diagonal",
    "longest_diagonal": "longest diagonal",
    "entropy": "entropy",
    "laminarity": "laminarity",
    "trapping": "trapping time",
    "longest_vertical": "longest vertical",
}


@styled
def plot(recurrence: Recurrence) -> Figure:
    """Draw a recurrence plot: a point where two states lie within the threshold of each other.

    The quantities stand beside the plot.
    """
    from matplotlib.colors import ListedColormap

    figure, ax = new_panel(4.6)
    count = len(recurrence.matrix)
    ax.imshow(
        recurrence.matrix,
        origin="lower",
        cmap=ListedColormap(["white", INK]),
        vmin=0,
        vmax=1,
        extent=(0.5, count + 0.5, 0.5, count + 0.5),
        # Averaged where there are more points than pixels, so that no line vanishes.
        interpolation="antialiased",
        interpolation_stage="rgba",
    )
    ax.set(xlabel="Number of the state", ylabel="Number of the state")
    ax.tick_params(axis="both", top=True, right=True)
    lines = [f"threshold  {recurrence.threshold:.3g}"]
    lines += [f"{_NAMES[name]}  {_shown(value)}" for name, value in recurrence.quantities.items()]
    how = {"xycoords": "axes fraction", "fontsize": SMALL, "linespacing": 1.7}
    beside(ax, "\n".join(lines), (1.0, 1.0), (8, 0), "left top", **how)
    return figure


def _shown(value: float) -> str:
    if isinstance(value, int):
        return str(value)
    return "–" if math.isnan(value) else f"{value:.3g}"
