"""Marks on figures: positions of backstop, pack and platen, arrows, firings, notes, legends.

`freest` finds free space for a label or an inset on a panel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.text import Text

from printhammer.figures.elements.curves import places
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import (
    BLUE,
    FAINT,
    HAIR,
    INK,
    LINE,
    MUTED,
    SMALL,
    SURFACES,
    THIN,
    TINY,
)
from printhammer.hammer.hammer import Hammer
from printhammer.run.motion import Motion
from printhammer.support.arrays import FloatArray

CURVE: Final = "curve:"
"""Label prefix of the curves that texts and insets must not cover."""

_SPACING: Final = 0.004
"""Spacing of points on a curve, as a fraction of the axes; smaller than any label; arbitrary."""


def occupied(ax: Axes) -> FloatArray:
    """Sample points along the curves of a panel, as fractions of the axes, shape (n, 2).

    The points are dense enough that no label fits between two of them.
    """
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    every = [np.empty((0, 2))]
    for line in ax.lines:
        if not str(line.get_label()).startswith(CURVE):
            continue
        x = (np.asarray(line.get_xdata(), dtype=np.float64) - left) / (right - left)
        y = (np.asarray(line.get_ydata(), dtype=np.float64) - bottom) / (top - bottom)
        known = np.isfinite(x) & np.isfinite(y)
        x, y = np.clip(x[known], -1.0, 2.0), np.clip(y[known], -1.0, 2.0)
        length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
        at = np.linspace(0.0, length[-1], max(2, int(length[-1] / _SPACING)))
        every.append(np.column_stack([np.interp(at, length, x), np.interp(at, length, y)]))
    return np.concatenate(every)


def freest(
    points: FloatArray, size: tuple[float, float], corners: Iterable[tuple[float, float]]
) -> tuple[tuple[float, float], int]:
    """Find the candidate box that covers the fewest points; return its corner and the number of points.

    `points`, shape (n, 2), `size` (width and height of the box) and `corners` (lower left corners of the
    candidates, in order of preference) are fractions of the axes.
    """
    width, height = size
    best: tuple[float, float] = (0.0, 0.0)
    fewest = -1
    for left, bottom in corners:
        inside = (points[:, 0] > left) & (points[:, 0] < left + width)
        inside &= (points[:, 1] > bottom) & (points[:, 1] < bottom + height)
        count = int(inside.sum())
        if fewest < 0 or count < fewest:
            best, fewest = (left, bottom), count
        if count == 0:
            break
    return best, fewest


HALO: Final[dict[str, Any]] = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8}
"""Background of text that may overlap a line: a semi-transparent white box."""

ALONG_X: Final = ("data", "axes fraction")
"""Annotation coordinates: x in data units, y as a fraction of the axes."""
ALONG_Y: Final = ("axes fraction", "data")
"""Annotation coordinates: x as a fraction of the axes, y in data units."""

_LINE_NAME: Final = (0.095, 0.06)
"""Width and height of a name on a horizontal line, as fractions of the axes; arbitrary."""

_BELOW: Final = 30.0
"""Distance from a panel to a legend below its tick labels and axis label, in points; arbitrary."""


def place_lines(ax: Axes, hammer: Hammer, shown: Scale, side: Literal["x", "y"] = "y") -> None:
    """Draw lines at the positions of backstop, pack and platen; label vertical lines.

    `side` is the axis of the displacement, `shown` its scale; the limits of the axes must be set already.
    """
    low, high = ax.get_ylim() if side == "y" else ax.get_xlim()
    for name, place in places(hammer).items():
        at = float(shown.shown(place))
        if not low <= at <= high:
            continue
        (ax.axhline if side == "y" else ax.axvline)(at, color=MUTED, lw=HAIR, zorder=1.0, gid=name)
        if side == "x":
            how = {"rotation": 90, "fontsize": SMALL, "zorder": 4.0, "bbox": HALO}
            beside(ax, name, (at, 1.0), (-2.5, -4), "right top", xycoords=ALONG_X, **how)


def closed(ax: Axes, motion: Motion, time: Scale, way: Scale, colour: str) -> None:
    """Draw a bar at the position of an additional contact whenever the contact is closed."""
    at = places(motion.hammer)
    for closing in motion.closings:
        end = motion.end if closing.t_out is None else closing.t_out
        span = time.shown(np.array([closing.t_in, end]))
        level = float(way.shown(at[closing.contact]))
        ax.plot(
            span,
            [level, level],
            color=colour,
            lw=4.0,
            alpha=0.45,
            solid_capstyle="butt",
            zorder=1.5,
            gid="closed",
        )


def name_lines(ax: Axes, hammer: Hammer, shown: Scale) -> None:
    """Label the horizontal position lines near the right edge, away from curves."""
    low, high = ax.get_ylim()
    points = occupied(ax)
    for name, place in places(hammer).items():
        at = (float(shown.shown(place)) - low) / (high - low)
        if not 0.0 <= at <= 1.0:
            continue
        corners = [
            (left, bottom)
            for bottom in (at, at - _LINE_NAME[1])
            for left in np.linspace(1.0 - _LINE_NAME[0], 0.0, 60).tolist()
        ]
        (left, bottom), _covered = freest(points, _LINE_NAME, corners)
        # Keep the names of further lines clear of this name.
        across, up = (np.linspace(0.0, 1.0, 9) * size for size in _LINE_NAME)
        points = np.concatenate(
            [points, np.stack(np.meshgrid(left + across, bottom + up), -1).reshape(-1, 2)]
        )
        beside(
            ax,
            name,
            (left + _LINE_NAME[0], at),
            (-4, 1.5 if bottom == at else -2.5),
            ha="right",
            va="bottom" if bottom == at else "top",
            xycoords="axes fraction",
            fontsize=SMALL,
            zorder=4.0,
        )


def note(ax: Axes, text: str, at: tuple[float, float], **options: Any) -> Text:
    """Write a small remark at a position in fractions of the axes."""
    style = {"fontsize": SMALL, "color": MUTED, "va": "top", "ha": "left", "zorder": 5.0, **options}
    return ax.text(*at, text, transform=ax.transAxes, **style)


def inside(ax: Axes, text: str, x: float, y: float, color: str) -> None:
    """Write tiny text, centred at a position in data units."""
    ax.text(x, y, text, ha="center", va="center", fontsize=TINY, color=color)


def beside(
    ax: Axes,
    text: str,
    at: tuple[float, float],
    shift: tuple[float, float],
    side: str = "left baseline",
    **options: Any,
) -> None:
    """Write small text at an offset, in points, from a position; `side` is the alignment of the text."""
    ha, va = side.split()
    how = {"fontsize": TINY, "color": MUTED, "textcoords": "offset points", "ha": ha, "va": va, **options}
    ax.annotate(text, at, shift, **how)


def heading(ax: Axes, text: str, **options: Any) -> None:
    """Write a small left-aligned heading above a panel."""
    ax.set_title(text, **{"loc": "left", "fontsize": SMALL, **options})


def dots(ax: Axes, x: npt.ArrayLike, y: npt.ArrayLike, size: float, color: str, **options: Any) -> None:
    """Draw points without an edge, as dots or with another `marker`; `size` is in points."""
    ax.plot(x, y, **{"ls": "none", "marker": "o", "ms": size, "mew": 0.0, "color": color, **options})


def dashed(line: Callable[..., Any], *levels: float, **options: Any) -> None:
    """Draw thin dashed lines at `levels`; `line` is the method `axhline` or `axvline` of the axes."""
    for level in levels:
        line(level, **{"color": MUTED, "lw": HAIR, "ls": (0, (4, 3)), **options})


def legend_above(ax: Axes, handles: Sequence[Artist], **options: Any) -> None:
    """Draw a one-line legend above the axes, left-aligned."""
    where: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2}
    ax.legend(handles=handles, fontsize=SMALL, ncols=len(handles), **{"frameon": False, **where, **options})


def legend_in_columns(ax: Axes, handles: Sequence[Artist], columns: int, size: float = SMALL) -> None:
    """Draw a legend in columns, centred above the axes; `size` is the font size in points."""
    where: dict[str, Any] = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0)}
    ax.legend(handles=handles, ncols=columns, fontsize=size, frameon=False, **where)


def legend_below(ax: Axes, *entries: Any, **options: Any) -> None:
    """Draw a legend below a panel and its axis label; options are as for `Axes.legend`.

    Unlike a legend of the figure, a legend of the panel leaves room for the text at the foot of the figure.
    """
    from matplotlib.transforms import ScaledTranslation

    down = ScaledTranslation(0.0, -_BELOW / 72.0, ax.figure.dpi_scale_trans)
    where: dict[str, Any] = {"bbox_to_anchor": (0.0, 0.0), "bbox_transform": ax.transAxes + down}
    ax.legend(
        *entries, loc="upper left", borderaxespad=0.0, fontsize=SMALL, frameon=False, **where, **options
    )


def contact_spans(ax: Axes, motion: Motion, until: float, shown: Scale) -> None:
    """Tint the time intervals in which the armature touches pack or backstop, up to `until` [s]."""
    for contact in motion.contacts:
        end = until if contact.t_out is None else min(contact.t_out, until)
        if contact.t_in >= end:
            continue
        span = (float(shown.shown(contact.t_in)), float(shown.shown(end)))
        strong = 0.28 if contact.surface == "pack" else 0.18
        ax.axvspan(*span, color=SURFACES[contact.surface], alpha=strong, lw=0.0, zorder=0.5)


def arrows(
    ax: Axes,
    x: FloatArray,
    y: FloatArray,
    count: int,
    color: str = INK,
    size: float = 9.0,
    first: float = 0.5,
) -> None:
    """Draw evenly spaced arrow heads along a curve in data units.

    The limits of the axes must be set already; `size` is in points; `first` is the position of the first head
    in units of the spacing of the heads.
    """
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    root = ax.get_figure(root=True)
    width, height = (1.0, 1.0) if root is None else root.get_size_inches()
    across, up = (x - left) / (right - left) * width, (y - bottom) / (top - bottom) * height
    inside = (across >= 0.0) & (across <= width) & (up >= 0.0) & (up <= height)
    steps = np.hypot(np.diff(across), np.diff(up)) * (inside[1:] & inside[:-1])
    length = np.concatenate([[0.0], np.cumsum(steps)])
    if length[-1] <= 0.0:
        return
    for k in range(count):
        at = (k + first) / count * length[-1]
        row = int(np.clip(np.searchsorted(length, at), 1, len(x) - 1))
        back = row - 1
        # An arrow head needs a direction: extend the chord backwards until it is long enough.
        while back > 0 and length[row] - length[back] < 0.02:
            back -= 1
        ax.annotate(
            "",
            (x[row], y[row]),
            (x[back], y[back]),
            arrowprops={
                "arrowstyle": "-|>,head_width=0.28,head_length=0.6",
                "color": color,
                "lw": 0.0,
                "mutation_scale": size,
                "shrinkA": 0.0,
                "shrinkB": 0.0,
            },
            zorder=4.0,
        )


def firings(ax: Axes, times: Iterable[float], shown: Scale, color: str = BLUE, foot: float = 0.022) -> None:
    """Mark firing times [s] by small triangles near the lower edge of the axes.

    `shown` is the scale of the time axis, and `foot` the height of their centres, as a fraction of the axes.
    """
    at = [float(shown.shown(t)) for t in times]
    how = {"transform": ax.get_xaxis_transform(), "clip_on": False, "zorder": 5.0, "gid": "firings"}
    dots(ax, at, [foot] * len(at), 4.5, color, marker="^", **how)


def drive_strip(
    ax: Axes, motions: Sequence[Motion], times: Sequence[FloatArray], until: float, colours: Sequence[str]
) -> None:
    """Draw the drive currents, or forces, of motions in the slim strip below a panel.

    `times` [s] and `colours` have one entry per motion; the time axis ends at `until` [s]. A motion driven
    by a force is skipped if the first motion is driven by a current, and vice versa.
    """
    quantity = motions[0].driven
    time, value = scale("time", until), scale(quantity)
    low, high = 0.0, 0.0
    for number, (motion, grid, colour) in enumerate(zip(motions, times, colours, strict=True)):
        if motion.driven != quantity:
            continue
        values = value.shown(motion.driven_at(grid))
        low, high = min(low, float(values.min())), max(high, float(values.max()))
        gid = f"{quantity} {number + 1}" if len(motions) > 1 else str(quantity)
        curve(ax, time.shown(grid), values, gid, colour, lw=THIN)
    room = 0.15 * (high - low) or 1.0
    ax.set_ylim(low - room, high + 1.6 * room)
    ax.axhline(0.0, color=FAINT, lw=HAIR, zorder=0.5)
    label(ax, "x", time)
    label(ax, "y", value, "Current\n" if quantity == "current" else "Drive\n")


def curve(ax: Axes, x: FloatArray, y: FloatArray, gid: str, color: str = BLUE, **options: Any) -> None:
    """Draw a curve with an SVG id, labelled as a curve that texts must not cover."""
    (line,) = ax.plot(x, y, color=color, label=CURVE + gid, **{"lw": LINE, **options})
    line.set_gid(gid)
