"""Figure of a family of reconstructed hammers: relative constants, and conclusions of each member."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import ALONG_Y, beside, heading, note
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.units import from_si

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer

_SHOWN: Final = {"s": ("ms", "ms"), "J": ("mJ", "mJ"), "Hz": ("Hz", "Hz"), "N": ("N", "N"), "m": ("um", "µm")}
"""Unit and label of a quantity in the figure, by its SI unit."""

_ROW: Final = 0.2
_STRIP: Final = 0.52
_COLUMNS: Final = 2
_FAN: Final = 0.52
"""Fraction of the height of a row over which members are spread, so that equal values stay visible."""

_NICE: Final = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0)
_FEWEST_TICKS: Final = 5
_EQUAL: Final = 1e-2
"""Relative difference up to which a constant counts as the same for all members; such rows are not drawn."""


@styled
def family(
    hammer: Hammer,
    constants: Sequence[Mapping[str, float]],
    conclusions: Sequence[Mapping[str, float | None]],
    drawn: Mapping[str, Mapping[str, Any]],
    *,
    order: str = "safe_rate_Hz",
) -> Figure:
    """Draw the constants of a family relative to those of a hammer, and below them the conclusions.

    Each row has one dot per member. `constants` lists the constants of the hammer, then those of each member,
    by key of a hammer file, SI, scaled to the common gauge; `conclusions` lists the conclusions of each
    member by name, SI, or None. `drawn` contains `title`, `unit`, `robust`, `low` and `high` of each
    conclusion. Members are coloured from light to dark by the value of the conclusion `order`, in all panels.
    """
    from matplotlib.colors import LinearSegmentedColormap

    own, *members = constants
    rows = [key for key in own if any(abs(row[key] - own[key]) > _EQUAL * abs(own[key]) for row in members)]
    # Members without a value are sorted first.
    known = np.array([-np.inf if row.get(order) is None else row[order] for row in conclusions])
    places = np.argsort(np.argsort(known, kind="stable"), kind="stable")
    ranks = np.asarray(places / max(len(known) - 1, 1), dtype=np.float64)
    shades = LinearSegmentedColormap.from_list("family", style.FAMILY)(ranks)
    deep = -(-len(drawn) // _COLUMNS)
    upper, lower = 0.55 + _ROW * len(rows), _STRIP * deep
    figure = new_figure(0.5 + upper + lower)
    top, bottom = figure.subfigures(2, 1, height_ratios=(upper, lower), squeeze=False)[:, 0]
    ax = top.add_subplot()
    _constants(ax, rows, own, members, ranks, shades)
    key = f"A dot for each of {len(members)} hammers; darker: higher {drawn[order]['title']}"
    heading(ax, key, color=style.MUTED)
    grid = bottom.add_gridspec(deep, _COLUMNS, wspace=0.06)
    for number, (name, entry) in enumerate(drawn.items()):
        column, row = divmod(number, deep)
        strip = bottom.add_subplot(grid[row, column])
        _conclusion(strip, entry, [member.get(name) for member in conclusions], ranks, shades)
    sign(figure, hammer)
    return figure


def _constants(
    ax: Axes,
    rows: Sequence[str],
    own: Mapping[str, float],
    members: Sequence[Mapping[str, float]],
    ranks: Any,
    shades: Any,
) -> None:
    ratios = np.array([[member[key] / own[key] for key in rows] for member in members])
    ax.set_xscale("log")
    ax.axvline(1.0, color=style.MUTED, lw=style.HAIR, zorder=1.0)
    fan = _FAN * (0.5 - ranks)
    for row, key in enumerate(rows):
        values = ratios[:, row]
        inside = values > 0.0
        ax.axhline(row, color=style.FAINT, lw=style.HAIR, zorder=0.5)
        ax.scatter(values[inside], row + fan[inside], s=11, c=shades[inside], lw=0.0, zorder=3.0, gid=key)
        if not inside.all():
            signs = f"{int((~inside).sum())} of the other sign"
            beside(ax, signs, (0.0, row), (3, 0), "left center", xycoords=ALONG_Y, color=style.ORANGE)
    known = ratios[ratios > 0.0]
    low, high = min(float(known.min(initial=1.0)), 0.9) / 1.06, max(float(known.max(initial=1.0)), 1.1) * 1.06
    ax.set(xlim=(low, high), ylim=(len(rows) - 0.4, -0.6))
    ax.set_yticks(range(len(rows)), list(rows))
    ax.set_xlabel("Constant over that of the shipped hammer")
    ticks = _ticks(low, high)
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.tick_params(axis="x", which="minor", bottom=False)
    ax.tick_params(axis="y", length=0.0)
    ax.spines[["left", "right", "top"]].set_visible(False)


def _ticks(low: float, high: float) -> list[float]:
    """Return round tick values for a logarithmic axis around 1."""
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    for steps in ((1.0,), (1.0, 2.0, 5.0), _NICE, tuple(np.arange(10, 100) / 10.0)):
        ticks = [round(step * 10.0**decade, 9) for decade in decades for step in steps]
        inside = [tick for tick in ticks if low <= tick <= high]
        if len(inside) >= _FEWEST_TICKS:
            return inside
    return [1.0]


def _conclusion(
    ax: Axes, entry: Mapping[str, Any], values: Sequence[float | None], ranks: Any, shades: Any
) -> None:
    unit, written = _SHOWN.get(entry["unit"], (entry["unit"], entry["unit"]))
    factor = from_si(1.0, entry["unit"], unit)
    known = np.array([value is not None for value in values], dtype=np.bool_)
    shown = np.array([np.nan if value is None else value * factor for value in values])
    colour = style.BLUE if entry["robust"] else style.ORANGE
    if known.any():
        low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
        room = 0.08 * (high - low) or 0.05 * abs(high) or 1.0
        # Widen the axis, so that values that hardly differ look alike.
        room = max(room, 0.5 * (0.2 * abs(high) - (high - low)))
        ax.set_xlim(low - room, high + room)
        ax.plot([low, high], [0.0, 0.0], color=colour, lw=6.0, alpha=0.25, solid_capstyle="round", zorder=1.0)
        fan = 0.8 * (ranks - 0.5)
        ax.scatter(shown[known], fan[known], s=9, c=shades[known], lw=0.0, zorder=3.0, gid=entry["title"])
    ax.set(ylim=(-0.75, 0.75), yticks=[])
    ax.locator_params(axis="x", nbins=5)
    ax.tick_params(axis="x", labelsize=style.TINY, pad=1.5)
    ax.spines[["left", "right", "top"]].set_visible(False)
    missing = int((~known).sum())
    text = f"{entry['title'].replace(' us ', ' µs ')}  [{written}]"
    text += f", {missing} without" if missing else ""
    heading(ax, text, color=style.INK, pad=2.0)
    word = "robust" if entry["robust"] else "depends"
    note(ax, word, (1.0, 1.02), ha="right", va="bottom", color=colour, fontsize=style.TINY)
