"""Basins in the plane of the initial states, each in a colour, with the attractors drawn in."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.figures.chaos.manifolds import draw
from printhammer.figures.chaos.strobe import shown_period
from printhammer.figures.elements.map_marks import edges
from printhammer.figures.elements.marks import heading, legend_below, place_lines
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import INK, new_panel, sign, styled

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from printhammer.chaos.basins.basins import Basins
    from printhammer.chaos.orbits.manifolds import Manifolds

SHADES: Final = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#0072b2", "#d55e00", "#999933")
"""Colours of the basins, of M. Okabe and K. Ito (2008); further ones begin anew, lighter."""

OTHERS: Final = {0: ("undecided", "#ffffff"), -1: ("run ended early", "#1a1a1a"), -2: ("no state", "#d9d9d9")}
"""Names and colours of the cells that lead to no known attractor, by label."""

_MARKS: Final = "os^Dvph*"
_LIGHTER: Final = 0.5
_MOST: Final = 12
_FEW: Final = 4


def shade(number: int) -> str:
    """Return the colour of the basin of an attractor, numbered from 1 on."""
    turn, place = divmod(number - 1, len(SHADES))
    parts = [int(SHADES[place][k : k + 2], 16) for k in (1, 3, 5)]
    for _ in range(min(turn, 2)):
        parts = [round(255 - _LIGHTER * (255 - part)) for part in parts]
    return "#" + "".join(f"{part:02x}" for part in parts)


@styled
def plot(basins: Basins, *, attractors: bool = True, manifolds: Sequence[Manifolds] = ()) -> Figure:
    """Draw basins, and in them the attractors where they lie in the plane, marked at the firings.

    Over them `manifolds` of saddles, white the stable ones, which bound basins, and dark the unstable ones.
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
    sign(figure, basins.regime.hammer, f"{more} more attractors are not named." if more > 0 else "")
    return figure
