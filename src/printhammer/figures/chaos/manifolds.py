"""Stable and unstable manifolds of saddles in the plane of displacement and velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.chaos.strobe import shown_period
from printhammer.figures.elements.marks import heading, legend_below, place_lines
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import BLUE, INK, ORANGE, new_panel, sign, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    from printhammer.chaos.orbits.manifolds import Manifolds

COLOURS: Final = {"stable": BLUE, "unstable": ORANGE}
_LIGHT: Final = {"stable": "white", "unstable": INK}
"""Over the colours of basins."""


@styled
def plot(manifolds: Manifolds) -> Figure:
    """Draw the manifolds of one saddle, and the saddle in the middle."""
    figure, ax = new_panel(5.0)
    largest = np.nanmax(np.abs(manifolds.x)) if len(manifolds.x) else 1.0
    way, speed = scale("displacement", float(largest)), scale("velocity")
    handles = draw(ax, manifolds, way, speed, COLOURS)
    place_lines(ax, manifolds.orbit.regime.hammer, way, "x")
    legend_below(ax, handles, [str(handle.get_label()) for handle in handles], ncols=3)
    heading(ax, f"{manifolds.orbit.name.capitalize()}, every {shown_period(manifolds.orbit.regime.period)}")
    label(ax, "x", way, "Displacement at the section")
    label(ax, "y", speed, "Velocity at the section")
    sign(figure, manifolds.orbit.regime.hammer)
    return figure


def draw(
    ax: Axes, manifolds: Manifolds, way: Scale, speed: Scale, colours: dict[str, str] = _LIGHT
) -> list[Line2D]:
    """Draw manifolds and their saddle in axes as they are; return a handle of each kind and of the saddle."""
    from matplotlib.patheffects import withStroke

    from printhammer.chaos.orbits.manifolds import KINDS

    kept: dict[str, Line2D] = {}
    for number, kind in enumerate(manifolds.kinds):
        name = KINDS[int(kind)]
        points = manifolds.points(number)
        (kept[name],) = ax.plot(
            way.shown(points[:, 0]),
            speed.shown(points[:, 1]),
            color=colours[name],
            lw=0.8,
            label=f"{name} manifold",
            gid=f"{name} manifold {number}",
            zorder=3.0,
            path_effects=[withStroke(linewidth=1.8, foreground=INK)] if colours[name] == "white" else None,
            scalex=colours is not _LIGHT,
            scaley=colours is not _LIGHT,
        )
    x, v = way.shown(manifolds.orbit.section[:1]), speed.shown(manifolds.orbit.section[1:])
    (kept["saddle"],) = ax.plot(
        x, v, ls="none", marker="X", ms=5.5, mew=0.7, mec=INK, mfc="white", label="saddle", zorder=5.0,
        scalex=False, scaley=False,
    )  # fmt: skip
    return list(kept.values())
