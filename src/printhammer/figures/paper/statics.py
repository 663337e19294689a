"""Figure 2: magnetic force against displacement at several currents, the spring force and its reflection."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.errors import InputError
from printhammer.figures.elements import style
from printhammer.figures.elements.curves import places, reach
from printhammer.figures.elements.marks import curve, place_lines
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import new_panel, sign, styled
from printhammer.hammer.hammer import Hammer
from printhammer.support.arrays import FloatArray

CURRENTS: Final = (0.0, 0.5, 1.0, 1.5, 2.0)
"""Currents of the paper's Fig. 2, A."""

_POINTS: Final = 400
_HALF_WIDTH, _ENOUGH, _PREFERRED = 0.04, 0.055, 0.3
"""Half the width of a label, distance from other curves that is enough, and best place; of the axes."""


@styled
def statics(hammer: Hammer, *, currents: Sequence[float] = CURRENTS) -> Figure:
    """Draw Fig. 2: net magnetic force, equation (3), at several currents, and spring force, equation (4).

    Parameters
    ----------
    currents : sequence of float, optional
        Coil currents, A; those outside the range of the magnet's law are left out.

    Raises
    ------
    InputError
        The hammer has no magnet, nothing that gives its stroke, or no current is in range.
    """
    from printhammer.hammer.static_force import StaticForce

    if hammer.magnet is None:
        raise InputError(f"the hammer {hammer.name!r} has no magnet, whose force Fig. 2 shows", key="magnet")
    low, high = getattr(hammer.magnet, "current_range", (-np.inf, np.inf))
    inside = [current for current in currents if low <= current <= high]
    if not inside:
        raise InputError(
            f"currents = {list(currents)} A: none is in the range {low:g} to {high:g} A of the magnet's law",
            key="currents",
            value=list(currents),
        )
    start, end = reach(hammer)
    x = np.linspace(start, end, _POINTS)
    if places(hammer):
        x = np.unique(np.concatenate([x, list(places(hammer).values())]))
        x = x[(x >= start) & (x <= end)]
    figure, ax = new_panel(4.6)
    way, force = scale("displacement", end), scale("force")
    static = StaticForce(hammer)
    curves = {
        f"{current:g} A": force.shown([static.magnet(place, current) for place in x.tolist()])
        for current in inside
    }
    spring = None
    if hammer.spring is not None:
        spring = force.shown([static.spring(place) for place in x.tolist()])

    ax.set_xlim(float(way.shown(start)), float(way.shown(end)))
    ax.set_ylim(*_limits(hammer, x, [*curves.values()], spring))
    ax.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0.5)
    place_lines(ax, hammer, way, "x")
    for (name, values), colour in zip(curves.items(), _colours(len(curves)), strict=True):
        curve(ax, way.shown(x), values, f"magnet {name}", colour)
    if spring is not None:
        curve(ax, way.shown(x), spring, "spring", style.ORANGE)
        curve(ax, way.shown(x), -spring, "spring reflected", style.ORANGE, ls=(0, (4, 2)))
        ax.legend(
            handles=ax.lines[-2:],
            labels=["spring force", "its reflection"],
            loc="upper center",
            bbox_to_anchor=(0.71, 1.0),
            fontsize=style.SMALL,
            edgecolor="none",
        )
    lines = way.shown(list(places(hammer).values()))
    _label_curves(ax, way.shown(x), lines, curves, [] if spring is None else [spring, -spring])
    label(ax, "x", way)
    label(ax, "y", force)
    sign(figure, hammer)
    return figure


def _limits(
    hammer: Hammer, x: FloatArray, family: list[FloatArray], spring: FloatArray | None
) -> tuple[float, float]:
    """Return limits that hold every curve within the stroke; beyond it the fit may be singular."""
    ends = list(places(hammer).values())
    stroke = (x >= min(ends)) & (x <= max(ends)) if len(ends) > 1 else np.full(x.shape, True)
    curves = [*family, *([] if spring is None else [spring, -spring])]
    values = np.concatenate([curve[stroke] for curve in curves])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = 0.1 * (high - low) or 1.0
    # The names of the places are written above the curves.
    return low - room, high + 2.2 * room


def _colours(count: int) -> list[str]:
    if count == 1:
        return [style.BLUE]
    picks = np.linspace(0, len(style.FAMILY) - 1, count).round().astype(int)
    return [style.FAMILY[pick] for pick in reversed(picks)]


def _label_curves(
    ax: Axes, x: FloatArray, lines: FloatArray, curves: dict[str, FloatArray], further: list[FloatArray]
) -> None:
    """Write a name on each curve where the others, further ones and the lines of places are far."""
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    across = (x - left) / (right - left)
    up = {name: (values - bottom) / (top - bottom) for name, values in curves.items()}
    marked = ((lines - left) / (right - left)).tolist()
    placed: list[tuple[float, float]] = []
    for name, height in up.items():
        others = [other for key, other in up.items() if key != name]
        others += [(values - bottom) / (top - bottom) for values in further]
        clear = np.full(x.shape, 1.0)
        for other in others:
            # A label is wider than high: nearness counts over its whole width.
            distance = np.abs(other - height)
            near = np.array(
                [np.nanmin(distance[np.abs(across - at) < _HALF_WIDTH], initial=1.0) for at in across]
            )
            clear = np.minimum(clear, near)
        for line in marked:
            clear = np.where(np.abs(across - line) < 1.3 * _HALF_WIDTH, 0.0, clear)
        for column, level in placed:
            clear[(np.abs(across - column) < 2.2 * _HALF_WIDTH) & (np.abs(height - level) < _ENOUGH)] = -1.0
        clear[~((across > 0.06) & (across < 0.94) & (height > 0.05) & (height < 0.95))] = -1.0
        merit = np.minimum(clear, _ENOUGH) - 0.02 * np.abs(across - _PREFERRED)
        row = int(np.nanargmax(merit))
        placed.append((float(across[row]), float(height[row])))
        ax.annotate(
            name,
            (x[row], curves[name][row]),
            ha="center",
            va="center",
            fontsize=style.SMALL,
            color=style.FAMILY[-1],
            zorder=5.0,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1.0},
        )
