"""Elements of the figures of frequency-time maps: scales, firing lines, lost dots, colour bar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from printhammer.errors import InputError
from printhammer.figures.elements.marks import ALONG_Y, beside, legend_above
from printhammer.figures.elements.scales import Scale, scale
from printhammer.figures.elements.style import HAIR, INK, MUTED, ORANGE, SMALL, foot
from printhammer.hammer.hammer import Hammer
from printhammer.maps.frequency import failed_rates, places_of
from printhammer.support.arrays import FloatArray

COLOURS: Final = "viridis"
"""Name of the colour map: perceptually uniform and suited to the colour-blind (Smith, van der Walt, 2015)."""

LINES: Final = "white"
"""Colour of the lines that mark firings."""

LOST: Final = "lost dots"
"""SVG id of the marks of lost dots."""

FEW: Final = 50
"""Number of rates below which each rate's firings and lost dots are marked in its own row; arbitrary."""

UNKNOWN: Final = "#e4e4e4"
"""Colour of map cells without a displacement."""

LOWEST, HIGHEST, RATES, TIMES = 500.0, 2500.0, 640, 1024
"""Defaults of Figs. 8 and 9: lowest and highest rate, Hz, and the numbers of rates and of times."""

_KILO: Final = 1e3  # Highest rate of a map, Hz, from which on its axis is in kHz; arbitrary
_LOST: Final = 2.0  # Width of the lines of lost dots, points; arbitrary


def chart_of(
    hammer: Hammer, rates: npt.ArrayLike | None = None, times: npt.ArrayLike | None = TIMES
) -> xr.Dataset:
    """Compute the frequency-time map of a hammer for a figure.

    Raises
    ------
    InputError
        The hammer has no waveform or no rest state, or the rates are invalid.
    """
    from printhammer.maps.frequency import frequency_map

    return frequency_map(hammer, np.linspace(LOWEST, HIGHEST, RATES) if rates is None else rates, times=times)


def drawable(chart: xr.Dataset) -> xr.Dataset:
    """Check that a map can be drawn; return the map, or raise InputError for fewer than two times."""
    if chart["time"].size < 2:
        raise InputError(
            f"the map has {chart['time'].size} times", key="times", expected="at least 2 to draw it"
        )
    return chart


def edges(centres: FloatArray) -> FloatArray:
    """Compute the n + 1 borders of the cells around n ascending centres."""
    if len(centres) == 1:
        return np.asarray([0.98 * centres[0], 1.02 * centres[0]], dtype=np.float64)
    middle = 0.5 * (centres[1:] + centres[:-1])
    ends = 2.0 * centres[[0, -1]] - middle[[0, -1]]
    return np.concatenate([ends[:1], middle, ends[1:]], dtype=np.float64)


@dataclass(frozen=True)
class Scales:
    """Axis scales of displacement, time and rate of a map, and its colour scale."""

    way: Scale
    time: Scale
    rate: Scale
    norm: Normalize


def scales_of(*charts: xr.Dataset) -> Scales:
    """Build the axis scales common to several maps, and a colour scale for all their displacements."""
    from matplotlib.colors import Normalize

    low, high = limits_of(*charts)
    ends = [low, high, *(place for chart in charts for place in places_of(chart).values())]
    fast = max(float(chart["rate"][-1]) for chart in charts)
    way = scale("displacement", max(map(abs, ends)))
    time = scale("time", max(float(chart["time"][-1]) for chart in charts))
    colours = Normalize(float(way.shown(low)), float(way.shown(high)))
    return Scales(way, time, Scale("Rate", "Hz", "kHz" if fast >= _KILO else "Hz"), colours)


def limits_of(*charts: xr.Dataset) -> tuple[float, float]:
    """Return the smallest and the largest displacement in several maps, m."""
    every = np.concatenate([chart["displacement"].values.ravel() for chart in charts])
    known = every[np.isfinite(every)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    return low, high if high > low else low + 1e-6


def picture(ax: Axes, chart: xr.Dataset, scales: Scales) -> QuadMesh:
    """Draw the displacement in colours against time (horizontal) and rate (vertical); return the mesh.

    Firings and lost dots are drawn on top; see `firing_lines`.
    """
    from matplotlib import colormaps

    time, rate = scales.time, scales.rate
    mesh = ax.pcolormesh(
        time.shown(edges(chart["time"].values)),
        rate.shown(edges(chart["rate"].values)),
        np.ma.masked_invalid(scales.way.shown(chart["displacement"].values)),
        cmap=colormaps[COLOURS].with_extremes(bad=UNKNOWN),
        norm=scales.norm,
        rasterized=True,
        zorder=0.5,
    )
    mesh.set_gid("displacement")
    ax.set_facecolor(UNKNOWN)
    ax.set_xlim(float(time.shown(chart["time"][0])), float(time.shown(chart["time"][-1])))
    ax.set_xlabel(f"Time from the first firing  [{time.sign}]")
    ax.set_ylabel(f"{rate.label}  [{rate.sign}]")
    firing_lines(ax, chart, scales)
    return mesh


def firing_lines(ax: Axes, chart: xr.Dataset, scales: Scales) -> None:
    """Draw the time of each firing against the rate as a thin curve, bold where its dot is lost.

    For maps with fewer than 50 rates, a vertical mark in the row of each rate replaces the curve.
    """
    if "fired_at" not in chart:
        return
    time, shown = scales.time, scales.rate
    rates = chart["rate"].values
    rows = edges(rates)
    few = len(rates) < FEW
    fired, struck = chart["fired_at"].values, chart["struck"].values
    lost: list[tuple[FloatArray, FloatArray]] = []
    for firing in range(fired.shape[1]):
        at = time.shown(fired[:, firing])
        # A line follows the firing times from one border of the cell to the other; a mark is vertical.
        slopes = np.zeros_like(at) if few or firing == 0 else -at / rates
        across, up = _strokes(at, slopes, rates, rows) if few else (at, rates)
        gid = f"firing {firing + 1}"
        ax.plot(across, shown.shown(up), color=LINES, lw=HAIR, alpha=0.6, zorder=2.0, gid=gid)
        missed = np.flatnonzero(~struck[:, firing] & np.isfinite(at))
        lost.append(_strokes(at, slopes, rates, rows, missed))
    lost_at, lost_rates = (np.concatenate(parts) for parts in zip(*lost, strict=True))
    if lost_at.size:
        cap: Literal["butt", "projecting"] = "butt" if few else "projecting"
        lost_up = shown.shown(lost_rates)
        ax.plot(lost_at, lost_up, color=ORANGE, lw=_LOST, solid_capstyle=cap, zorder=2.5, gid=LOST)


def _strokes(
    at: FloatArray,
    slopes: FloatArray,
    rates: FloatArray,
    borders: FloatArray,
    rows: npt.NDArray[np.intp] | slice = slice(None),
) -> tuple[FloatArray, FloatArray]:
    """Return x and y of one line segment per map row, from the lower to the upper border of the row.

    At the rate of its row, in `rates`, a segment has x in `at` and the slope in `slopes`, in x per rate;
    `borders` are the borders of all map rows. The segments are separated by NaN.
    """
    centre, place, slope = rates[rows], at[rows], slopes[rows]
    ends = np.column_stack([borders[:-1][rows], borders[1:][rows], np.full_like(centre, np.nan)])
    across = place[:, np.newaxis] + slope[:, np.newaxis] * (ends - centre[:, np.newaxis])
    return across.ravel(), ends.ravel()


def key(ax: Axes, chart: xr.Dataset) -> None:
    """Draw the legend of firing lines and lost dots above the map."""
    from matplotlib.lines import Line2D
    from matplotlib.patheffects import Stroke

    if "fired_at" not in chart:
        return
    lost = int((~chart["struck"].values & np.isfinite(chart["fired_at"].values)).sum())
    fired = int(np.isfinite(chart["fired_at"].values).sum())
    around = [Stroke(linewidth=3.0, foreground=MUTED), Stroke(linewidth=1.4, foreground=LINES)]
    handles = [
        Line2D([], [], color=LINES, lw=HAIR, path_effects=around, label="firings"),
        Line2D([], [], color=ORANGE, lw=_LOST + 0.8, label=f"lost dots, {lost} of {fired}"),
    ]
    legend_above(ax, handles)


def colour_bar(ax: Axes, chart: xr.Dataset, scales: Scales) -> None:
    """Draw the colour bar, with backstop, pack and platen marked.

    The bar is white outside the range of displacements in the maps.
    """
    from matplotlib import colormaps

    way = scales.way
    low, high = float(scales.norm.vmin or 0.0), float(scales.norm.vmax or 1.0)
    places = {name: float(way.shown(place)) for name, place in places_of(chart).items()}
    ends = [low, high, *places.values()]
    room = 0.02 * (max(ends) - min(ends))
    ax.imshow(
        np.linspace(0.0, 1.0, 256)[:, np.newaxis],
        extent=(0.0, 1.0, low, high),
        origin="lower",
        aspect="auto",
        cmap=colormaps[COLOURS],
        interpolation="nearest",
    )
    ax.set_xlim(0.0, 1.0)
    ax.set_ylim(min(ends) - room, max(ends) + room)
    ax.set_xticks([])
    ax.yaxis.set_label_position("right")
    ax.yaxis.tick_right()
    ax.tick_params(axis="y", left=False, right=True)
    ax.set_ylabel(f"Displacement  [{way.sign}]")
    for name, at in places.items():
        for colour, width in (("white", 2.0), (INK, 0.9)):
            ax.axhline(at, color=colour, lw=width, gid=name)
        beside(ax, name, (0.0, at), (-3.0, 0.0), "right center", xycoords=ALONG_Y, fontsize=SMALL, color=INK)


def failures(chart: xr.Dataset) -> str:
    """Describe how many runs of a map ended early, by status; empty if all runs are complete."""
    failed = {name: len(rates) for name, rates in failed_rates(chart).items()}
    if not failed:
        return ""
    names = ", ".join(f"{name} ({count})" for name, count in failed.items())
    return f"{sum(failed.values())} of {chart['rate'].size} runs did not reach their end: {names}."


def sign_map(figure: Figure, chart: xr.Dataset, *remarks: str) -> None:
    """Write name and fingerprint of a map's hammer below the figure, and remarks above the figure."""
    origin = [str(chart.attrs.get("hammer", chart.attrs.get("source", "")))]
    origin.append(str(chart.attrs.get("hammer_fingerprint", ""))[:8])
    constants = str(chart.attrs.get("hammer_constants", ""))
    if constants.startswith("in part"):
        origin.append(f"constants {constants}")
    foot(figure, " · ".join(filter(None, origin)), "\n".join(filter(None, remarks)))
