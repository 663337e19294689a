"""Figures of bifurcation curves in a plane of two parameters, coloured by the period of trains from rest.

`plot_chart` draws a stability chart: the limits of an orbit, and the trains from rest that settle to its
period.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from printhammer.chaos.curves.bifurcation_curve import BifurcationCurve
from printhammer.chaos.curves.stability_chart import StabilityChart
from printhammer.errors import InputError
from printhammer.figures.chaos.continuation import axis_of
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import legend_in_columns
from printhammer.figures.elements.style import new_panel, sign, styled

CURVES: Final = {
    "fold": (style.BLUE, "-"),
    "period doubling": (style.ORANGE, (0, (5, 1.5))),
    "Neimark-Sacker": (style.GREEN, (0, (1, 1))),
    "grazing": (style.INK, "-"),
}
"""Colour and dash pattern of the curves, by kind of bifurcation."""
_REGION: Final = "#cfe3f1"


@styled
def plot_chart(chart: StabilityChart) -> Figure:
    """Draw a stability chart: the second parameter against the first parameter.

    Shaded: the train from rest settles to the period of the orbit; grey: its run stopped early.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure, ax = new_panel(4.4)
    headings, factors = zip(*map(axis_of, chart.names, chart.units), strict=True)
    handles: list[Line2D | Patch] = []
    if chart.settled.size:
        from matplotlib.colors import ListedColormap

        shown = np.where(chart.settled == chart.firings, 1, np.where(chart.settled < 0, 2, 0))
        sides = [edges(axis) * factors[k] for k, axis in enumerate(chart.grid)]
        colours = ListedColormap(["white", _REGION, style.FAINT])
        ax.pcolormesh(*sides, shown, cmap=colours, vmin=0, vmax=2, zorder=0.5, rasterized=True)
        name = f"from rest: period {chart.firings}"
        handles.append(Patch(facecolor=_REGION, edgecolor="none", label=name))
        if (shown == 2).any():
            handles.append(Patch(facecolor=style.FAINT, edgecolor="none", label="run stopped"))
    for curve in chart.curves:
        colour, dash = CURVES[curve.kind]
        x, y = factors[0] * curve.first, factors[1] * curve.second
        limits = np.where(curve.limits, y, np.nan)
        ax.plot(x, y, color=colour, lw=style.HAIR, ls=dash, alpha=0.5, zorder=2.0)
        ax.plot(x, limits, color=colour, lw=style.LINE, ls=dash, gid=curve.kind, zorder=3.0)
    kinds = {curve.kind for curve in chart.curves}
    handles += [
        Line2D([], [], color=colour, ls=dash, lw=style.LINE, label=kind)
        for kind, (colour, dash) in CURVES.items()
        if kind in kinds
    ]
    own = chart.regime.value(chart.names[1]) * factors[1]
    dotted: dict[str, Any] = {"color": style.MUTED, "lw": style.HAIR, "ls": (0, (1, 2))}
    ax.axhline(own, zorder=1.0, gid="own", **dotted)
    handles.append(Line2D([], [], label="value of the hammer", **dotted))
    ax.set_xlim(*(factors[0] * end for end in chart.bounds[0]))
    ax.set_ylim(*(factors[1] * end for end in chart.bounds[1]))
    ax.set_xlabel(headings[0])
    ax.set_ylabel(headings[1])
    legend_in_columns(ax, handles, 4)
    remarks = [f"Not followed: {'; '.join(chart.refused)}."] if chart.refused else []
    sign(figure, chart.regime.hammer, *remarks)
    return figure


def edges(axis: np.ndarray) -> np.ndarray:
    """Compute the edges of the cells around n evenly spaced values, shape (n + 1,)."""
    half = 0.5 * (axis[1] - axis[0]) if len(axis) > 1 else 0.5 * abs(axis[0])
    return np.append(axis - half, axis[-1] + half)


_PERIODS: Final = {1: "#cfe3f1", 2: "#fbe0c3", 3: "#cfead9", 4: "#f6f0b8"}
_LONGER: Final = "#e3d5ec"
_NONE: Final = "#f1f1f1"


@styled
def plot(curve: BifurcationCurve, *, attractors: bool = True) -> Figure:
    """Draw a bifurcation curve: the second parameter against the first parameter.

    The curve is heavy where stability is lost, and dashed where a period doubling is subcritical; points of
    codimension two are marked and named.

    Parameters
    ----------
    curve : BifurcationCurve
        Result of `printhammer.bifurcation_curve`.
    attractors : bool, optional
        Whether to colour the plane by the attractors of trains from rest, if computed: see `grid` of
        `printhammer.bifurcation_curve`.
    """
    from matplotlib.lines import Line2D

    if len(curve) < 2:
        raise InputError(f"curve: {len(curve)} point", key="curve", expected="at least two to draw")
    figure, ax = new_panel(4.4)
    headings, factors = zip(*map(axis_of, curve.names, curve.units), strict=True)
    handles: list[Any] = []
    if attractors and curve.settled.size:
        handles += _shade(ax, curve, factors)
    colour, dash = CURVES[curve.kind]
    x, y = factors[0] * curve.first, factors[1] * curve.second
    ax.plot(x, y, color=colour, lw=style.HAIR, ls=dash, zorder=2.0, gid=curve.kind)
    ax.plot(
        x, np.where(curve.limits, y, np.nan), color=colour, lw=style.LINE, ls=dash, zorder=3.0, gid="limits"
    )
    handles.append(Line2D([], [], color=colour, ls=dash, lw=style.LINE, label=curve.kind))
    below = np.array([word == "subcritical" for word in curve.criticality])
    if below.any():
        look: dict[str, Any] = {"color": style.INK, "lw": style.HAIR, "ls": (0, (1, 2))}
        ax.plot(x, np.where(below, y, np.nan), zorder=4.0, gid="subcritical", **look)
        handles.append(Line2D([], [], label="subcritical", **look))
    for point in curve.points:
        place = factors[0] * point.first, factors[1] * point.second
        ax.plot(*place, "o", ms=4.0, mfc="white", mec=style.INK, mew=style.THIN, zorder=5.0, gid=point.kind)
        ax.annotate(point.message, place, (5, 3), textcoords="offset points", fontsize=style.TINY, zorder=6.0)
    for axis, factor, ends in zip("xy", factors, curve.bounds, strict=True):
        ax.set(**{f"{axis}lim": tuple(factor * end for end in ends)})
    ax.set_xlabel(headings[0])
    ax.set_ylabel(headings[1])
    legend_in_columns(ax, handles, 4)
    sign(figure, curve.regime.hammer)
    return figure


def _shade(ax: Axes, curve: BifurcationCurve, factors: tuple[float, ...]) -> list[Patch]:
    """Colour the plane by the period to which trains from rest settle; return the legend entries.

    `factors` convert the two parameters to axis units.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    names = {
        **{n: f"period {n}" for n in _PERIODS},
        5: "longer period",
        0: "no period known",
        -1: "run stopped",
    }
    colours = {**_PERIODS, 5: _LONGER, 0: _NONE, -1: style.FAINT}
    shown = np.minimum(curve.settled, 5)
    order = list(colours)
    cells = np.vectorize(order.index)(shown)
    sides = [edges(axis) * factors[k] for k, axis in enumerate(curve.grid)]
    scale = ListedColormap(list(colours.values()))
    ax.pcolormesh(*sides, cells, cmap=scale, vmin=0, vmax=len(order) - 1, zorder=0.5, rasterized=True)
    used = [key for key in order if (shown == key).any()]
    return [Patch(facecolor=colours[key], edgecolor="none", label=names[key]) for key in used]
