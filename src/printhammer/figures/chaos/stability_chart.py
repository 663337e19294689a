"""The designer's chart: curves on which an orbit loses its stability, and what trains from rest settle to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.style import new_figure, sign, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.chaos.continuation.stability_chart import StabilityChart

_STYLES: Final = {
    "fold": (style.BLUE, "-"),
    "period doubling": (style.ORANGE, (0, (5, 1.5))),
    "Neimark-Sacker": (style.GREEN, (0, (1, 1))),
}
_AXIS: Final = {"s": ("ms", 1e3), "1": ("", 1.0)}
_REGION: Final = "#cfe3f1"


@styled
def plot(chart: StabilityChart) -> Figure:
    """Draw a stability chart.

    The first constant to the right, the second upward. Shaded: where the train from rest settles to the
    orbit's period; grey: where its run stopped.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure = new_figure(4.4)
    ax = figure.add_subplot()
    factors = [_AXIS.get(unit, (unit, 1.0)) for unit in chart.units]
    handles: list[Line2D | Patch] = []
    if chart.settled.size:
        from matplotlib.colors import ListedColormap

        shown = np.where(chart.settled == chart.firings, 1, np.where(chart.settled < 0, 2, 0))
        edges = [_edges(axis) * factors[k][1] for k, axis in enumerate(chart.grid)]
        colours = ListedColormap(["white", _REGION, style.FAINT])
        ax.pcolormesh(*edges, shown, cmap=colours, vmin=0, vmax=2, zorder=0.5, rasterized=True)
        told = f"from rest: period {chart.firings}"
        handles.append(Patch(facecolor=_REGION, edgecolor="none", label=told))
        if (shown == 2).any():
            handles.append(Patch(facecolor=style.FAINT, edgecolor="none", label="run stopped"))
    kinds = []
    for curve in chart.curves:
        colour, dash = _STYLES[curve.kind]
        x, y = factors[0][1] * curve.first, factors[1][1] * curve.second
        limits = np.where(curve.limits, y, np.nan)
        ax.plot(x, y, color=colour, lw=style.HAIR, ls=dash, alpha=0.5, zorder=2.0)
        ax.plot(x, limits, color=colour, lw=style.LINE, ls=dash, gid=curve.kind, zorder=3.0)
        if curve.kind not in kinds:
            kinds.append(curve.kind)
    handles += [
        Line2D([], [], color=_STYLES[kind][0], ls=_STYLES[kind][1], lw=style.LINE, label=kind)
        for kind in _STYLES
        if kind in kinds
    ]
    own = chart.regime.value(chart.names[1]) * factors[1][1]
    ax.axhline(own, color=style.MUTED, lw=style.HAIR, ls=(0, (1, 2)), zorder=1.0, gid="own")
    handles.append(Line2D([], [], color=style.MUTED, lw=style.HAIR, ls=(0, (1, 2)), label="the hammer's own"))
    ax.set_xlim(*(factors[0][1] * end for end in chart.bounds[0]))
    ax.set_ylim(*(factors[1][1] * end for end in chart.bounds[1]))
    names = []
    for name, (unit, _) in zip(chart.names, factors, strict=True):
        title = name[:1].upper() + name[1:] if "." not in name else name
        names.append(f"{title}  [{unit}]" if unit else title)
    ax.set_xlabel(names[0])
    ax.set_ylabel(names[1])
    ax.legend(
        handles=handles,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=4,
        fontsize=style.SMALL,
        frameon=False,
    )
    remarks = [f"Not followed: {'; '.join(chart.refused)}."] if chart.refused else []
    sign(figure, chart.regime.hammer, *remarks)
    return figure


def _edges(axis: np.ndarray) -> np.ndarray:
    """Return the edges of the cells around values that are evenly spaced."""
    half = 0.5 * (axis[1] - axis[0]) if len(axis) > 1 else 0.5 * abs(axis[0])
    return np.append(axis - half, axis[-1] + half)
