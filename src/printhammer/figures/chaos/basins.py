"""Figures of basins of attraction in the plane of the initial states, with the attractors.

`plot_manifolds` draws stable and unstable manifolds of saddles.

`plot_quench` draws the quench map of two pulses: the force of the second dot or, where the dot is lost, the
second peak of the displacement.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from printhammer.chaos.basins.basins import Basins
from printhammer.chaos.basins.quench import QuenchMap
from printhammer.chaos.orbits.manifolds import Manifolds
from printhammer.figures.chaos.strobe import shown_period
from printhammer.figures.elements.map_marks import edges
from printhammer.figures.elements.marks import dashed, dots, heading, legend_above, legend_below, place_lines
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import BLUE, INK, MUTED, ORANGE, SMALL, new_panel, sign, styled
from printhammer.figures.paper.motion import DELAYS

COLOURS: Final = {"stable": BLUE, "unstable": ORANGE}
"""Colours of stable and unstable manifolds on a white background."""
_LIGHT: Final = {"stable": "white", "unstable": INK}
"""Colours of stable and unstable manifolds that are drawn over basins."""


@styled
def plot_manifolds(manifolds: Manifolds) -> Figure:
    """Draw the manifolds of a saddle, and the saddle itself, in the plane of displacement and velocity."""
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
    """Draw manifolds and their saddle into given axes; return one legend handle per kind of mark.

    `way` and `speed` are the scales of the axes; `colours` are the colours of stable and unstable manifolds.
    """
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


SHADES: Final = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#0072b2", "#d55e00", "#999933")
"""Colours of the basins, by M. Okabe and K. Ito (2008); lighter shades follow for further basins."""

OTHERS: Final = {0: ("undecided", "#ffffff"), -1: ("run ended early", "#1a1a1a"), -2: ("no state", "#d9d9d9")}
"""Names and colours of the cells that lead to no known attractor, by cell label."""

_MARKS: Final = "os^Dvph*"
_LIGHTER: Final = 0.5  # Factor of the distance from white of repeated colours; arbitrary
_MOST: Final = 12  # Attractors named in the legend; arbitrary
_FEW: Final = 4  # Entries beyond which the legend has two columns; arbitrary


def shade(number: int) -> str:
    """Return the colour of the basin of attractor `number`, counted from 1."""
    turn, place = divmod(number - 1, len(SHADES))
    parts = [int(SHADES[place][k : k + 2], 16) for k in (1, 3, 5)]
    for _ in range(min(turn, 2)):
        parts = [round(255 - _LIGHTER * (255 - part)) for part in parts]
    return "#" + "".join(f"{part:02x}" for part in parts)


@styled
def plot(basins: Basins, *, attractors: bool = True, manifolds: Sequence[Manifolds] = ()) -> Figure:
    """Draw basins of attraction, and the attractors in the same plane.

    `manifolds` of saddles are drawn on top: stable manifolds, which bound the basins, in white, unstable
    manifolds in black.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure, ax = new_panel(5.0)
    way = scale("displacement", float(np.abs(basins.x).max()))
    speed = scale("velocity")
    count = len(basins.attractors)
    numbers = [-2, -1, 0, *range(1, count + 1)]
    colours = [OTHERS[k][1] if k in OTHERS else shade(k) for k in numbers]
    mesh = ax.pcolormesh(
        edges(way.shown(basins.x)),
        edges(speed.shown(basins.v)),
        basins.labels,
        cmap=ListedColormap(colours),
        norm=BoundaryNorm(np.arange(-2.5, count + 1.0), len(colours)),
        rasterized=True,
        zorder=0.0,
    )
    mesh.set_gid("basins")
    place_lines(ax, basins.regime.hammer, way, "x")
    share, error = basins.shares
    handles: list[Any] = []
    for number, attractor in enumerate(basins.attractors, 1):
        strange = attractor.period is None
        mark = "." if strange else _MARKS[(number - 1) % len(_MARKS)]
        style: dict[str, Any] = {
            "ls": "none",
            "marker": mark,
            "ms": 1.2 if strange else 5.0,
            "mew": 0.0 if strange else 0.8,
            "mec": INK,
            "mfc": INK if strange else shade(number),
        }
        if attractors:
            x, v = way.shown(attractor.states[:, 0]), speed.shown(attractor.states[:, 1])
            ax.plot(x, v, **style, zorder=4.0, gid=f"attractor {number}", scalex=False, scaley=False)
        if number <= _MOST:
            name = (
                f"{number}: {attractor.name.replace('-', ' ')},"
                f" {100.0 * share[number - 1]:.1f} ± {100.0 * error[number - 1]:.1f} %"
            )
            handles.append((Patch(color=shade(number)), Line2D([], [], **{**style, "ms": 4.0}), name))
    for number, (name, colour) in OTHERS.items():
        cells = basins.counts[number]
        if cells:
            patch = Patch(facecolor=colour, edgecolor=INK, lw=0.5)
            handles.append((patch, patch, f"{name}: {cells} cells"))
    lines: list[Any] = []
    for each in manifolds:
        lines = draw(ax, each, way, speed)
    handles += [(line, line, line.get_label()) for line in lines]
    signs, names = [entry[:2] for entry in handles], [entry[2] for entry in handles]
    legend_below(ax, signs, names, ncols=1 + (len(handles) > _FEW), handlelength=1.2)
    heading(ax, f"Every {shown_period(basins.regime.period)}")
    label(ax, "x", way, "Displacement at the first firing")
    label(ax, "y", speed, "Velocity at the first firing")
    more = count - _MOST
    unnamed = f"{more} more attractors are not named. " if more > 0 else ""
    sign(figure, basins.regime.hammer, f"{unnamed}{basins.rounding}{'.' if basins.rounding else ''}".strip())
    return figure


PRINTED: Final = "viridis"
"""Colour map of the force of a printed second dot in a quench map."""

LOST: Final = "bone"
"""Colour map of the second displacement peak where the second dot is lost, in a quench map."""

_FAILED: Final = "#d55e00"
_FEW_QUENCH: Final = 0.01  # Fraction of forces beyond either end of the colour scale; arbitrary


@styled
def plot_quench(quenches: QuenchMap) -> Figure:
    """Draw a quench map: width of the second pulse against the time between the firings.

    Colours show the force of the second dot or, where this dot is lost, the second peak of the displacement.
    Crosses mark the two cases of Fig. 6 of the paper if they lie within the axes.
    """
    figure, ax = new_panel(4.6)
    across = Scale("Second firing after the first", "s", "ms")
    up = Scale("Width of the second pulse", "s", "ms")
    x, y = edges(across.shown(quenches.gaps)), edges(up.shown(quenches.widths))
    ax.set_facecolor(_FAILED)
    lost = np.ma.masked_where(~quenches.lost, np.nan_to_num(quenches.peak_share)).T
    printed = np.ma.masked_where(~quenches.struck, quenches.force_ratio).T
    mesh = None
    if quenches.struck.any():
        known = quenches.force_ratio[quenches.struck]
        low, high = np.quantile(known, [_FEW_QUENCH, 1.0 - _FEW_QUENCH])
        mesh = ax.pcolormesh(x, y, printed, cmap=PRINTED, vmin=low, vmax=high, rasterized=True)
        bar = figure.colorbar(mesh, ax=ax, pad=0.02, fraction=0.05, extend="both")
        bar.set_label("Printed: force relative to the first dot", fontsize=SMALL)
    if quenches.lost.any():
        mesh = ax.pcolormesh(x, y, lost, cmap=LOST, vmin=0.0, vmax=1.0, rasterized=True)
        # The ratio exceeds 1 if the second firing falls into the contact of the first dot.
        bar = figure.colorbar(mesh, ax=ax, pad=0.02, fraction=0.05, extend="max")
        bar.set_label("Lost: second peak, fraction of the way to the pack", fontsize=SMALL)
    width = getattr(quenches.waveform, "width", None)
    if width is not None and y[0] < up.shown(width) < y[-1]:
        dashed(
            ax.axhline,
            float(up.shown(width)),
            color="white",
            label="width of the first pulse",
            gid="first width",
        )
        shown = [delay for delay in DELAYS if quenches.gaps[0] <= delay <= quenches.gaps[-1]]
        level = np.full(len(shown), float(up.shown(width)))
        crosses = {"marker": "x", "mew": 1.4, "label": "two cases of the paper's Fig. 6", "gid": "Fig. 6"}
        if shown:
            dots(ax, across.shown(shown), level, 6.0, "white", **crosses)
        # White on grey, since the marks on the map are white.
        box = {
            "frameon": True,
            "facecolor": MUTED,
            "edgecolor": "none",
            "framealpha": 1.0,
            "labelcolor": "white",
        }
        legend_above(ax, ax.get_legend_handles_labels()[0], **box)
    ax.set_xlim(float(x[0]), float(x[-1]))
    ax.set_ylim(float(y[0]), float(y[-1]))
    label(ax, "x", across)
    label(ax, "y", up)
    for spine in ax.spines.values():
        spine.set_color(INK if spine.get_visible() else MUTED)
    bad = int((quenches.status != "ok").sum())
    sign(figure, quenches.hammer, f"{bad} of {quenches.status.size} runs ended early." if bad else "")
    return figure
