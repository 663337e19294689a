"""Figures 8 and 9: frequency-time maps, and their comparison with measured maps.

Figure 8: displacement curves at gradually rising rates, stacked into a surface with hidden lines removed.
Figure 9: displacement in colours, against time and firing rate, in bursts of nine pulses.

`compare_maps` draws a computed and a measured map side by side on the same scales, and their difference.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from printhammer.figures.elements import map_marks
from printhammer.figures.elements.marks import beside, heading
from printhammer.figures.elements.scales import Scale
from printhammer.figures.elements.style import BLUE, HAIR, INK, MUTED, SMALL, new_figure, new_panel, styled
from printhammer.hammer.hammer import Hammer
from printhammer.maps.frequency import places_of, rms_difference
from printhammer.support.arrays import FloatArray


@styled
def frequency_map(
    hammer: Hammer, *, chart: xr.Dataset | None = None, rates: npt.ArrayLike | None = None
) -> Figure:
    """Draw Fig. 9: the frequency-time map in colours.

    Thin lines mark firings, bold lines lost dots; with fewer than 50 rates, marks in each row replace the
    lines. The SVG ids are "firing 1" and so on, and "lost dots".

    Parameters
    ----------
    hammer : Hammer
        Hammer with a waveform; ignored if a map is passed.
    chart : xarray.Dataset, optional
        A map from `printhammer.frequency_map`; by default the map of the hammer is computed.
    rates : array, optional
        Rates of the map that is computed, Hz.

    Raises
    ------
    InputError
        The hammer has no waveform or no rest state, or the map has fewer than two times.
    """
    chart = map_marks.drawable(map_marks.chart_of(hammer, rates) if chart is None else chart)
    scales = map_marks.scales_of(chart)
    figure = new_figure(4.6)
    grid = figure.add_gridspec(1, 2, width_ratios=(30.0, 1.0))
    panel, bar = figure.add_subplot(grid[0]), figure.add_subplot(grid[1])
    map_marks.picture(panel, chart, scales)
    map_marks.key(panel, chart)
    map_marks.colour_bar(bar, chart, scales)
    map_marks.sign_map(figure, chart, map_marks.failures(chart))
    return figure


CURVES: Final = 81
"""Number of curves of Fig. 8."""

_TIMES: Final = 1361  # Times of a curve: more than a picture resolves; arbitrary
_LEAN: Final = (0.19, 0.66)  # Arbitrary
"""Offset of the last curve relative to the first, to the right and up, in units of the picture width."""

_ACROSS: Final = 0.80
"""Width of each displacement curve, in units of the picture width; arbitrary."""

_TALL: Final = 0.22
"""Height of a curve over the displacement range, in units of the picture width; arbitrary."""

_TICK: Final = 0.008  # Length of a tick, in units of the picture width; arbitrary

_SHEETS: Final = 2.0
"""Common z-order of curves and white sheets, so that matplotlib draws all in order of creation."""

_FLAT: Final = 4e-4
"""Tolerance of thinned curves, in units of the picture width; corresponds to 0.15 points. Arbitrary."""

_NAME: Final[dict[str, Any]] = {"fontsize": "medium"}  # Style of the axis names
_POST: Final = 0.13
"""Distance from the displacement axis to the curves, in units of the picture width; arbitrary."""


@dataclass(frozen=True)
class _View:
    """Oblique projection of time [s], displacement [m] and rate [Hz] onto the plane of the figure."""

    times: tuple[float, float]
    heights: tuple[float, float]
    rates: tuple[float, float]

    def depth(self, rate: float) -> float:
        first, last = self.rates
        return (rate - first) / (last - first) if last > first else 0.0

    def across(self, t: npt.ArrayLike, rate: float) -> FloatArray:
        first, last = self.times
        way = (np.asarray(t, dtype=np.float64) - first) / (last - first)
        return np.asarray(_ACROSS * way + _LEAN[0] * self.depth(rate))

    def up(self, x: npt.ArrayLike, rate: float) -> FloatArray:
        low, high = self.heights
        way = (np.asarray(x, dtype=np.float64) - low) / (high - low)
        return np.asarray(_TALL * way + _LEAN[1] * self.depth(rate))


@styled
def surface(hammer: Hammer, *, chart: xr.Dataset | None = None, rates: npt.ArrayLike | None = None) -> Figure:
    """Draw Fig. 8: displacement against time, one curve per rate, each hiding the curves behind it.

    The portions of a curve inside the pack are blue. The SVG id of a curve is "rate" followed by its rate in
    Hz.

    Parameters
    ----------
    hammer : Hammer
        Hammer with a waveform; ignored if a map is passed.
    chart : xarray.Dataset, optional
        A map from `printhammer.frequency_map`, of which evenly chosen rates are drawn; by default the map of
        the hammer is computed.
    rates : array, optional
        Rates of the map that is computed, Hz.

    Raises
    ------
    InputError
        The hammer has no waveform or no rest state, or the map has fewer than two times.
    """
    if chart is None:
        wanted = np.linspace(map_marks.LOWEST, map_marks.HIGHEST, CURVES) if rates is None else rates
        chart = map_marks.chart_of(hammer, wanted, _TIMES)
    map_marks.drawable(chart)
    scales = map_marks.scales_of(chart)
    places = places_of(chart)
    low, high = map_marks.limits_of(chart)
    every = chart["rate"].values
    time = chart["time"].values
    view = _View(
        (float(time[0]), float(time[-1])),
        (min(low, *places.values(), high), max(high, *places.values())),
        (float(every[0]), float(every[-1])),
    )
    figure, ax = new_panel(4.7)
    ax.set_axis_off()
    rows = np.unique(np.linspace(0, len(every) - 1, min(CURVES, len(every))).round().astype(int))
    for row in rows[::-1]:
        _sheet(ax, view, time, chart["displacement"].values[row], float(every[row]), places.get("pack"))
    _time_axis(ax, view, scales.time)
    _height_axis(ax, view, scales.way, places)
    _rate_axis(ax, view, scales.rate)
    ax.set_xlim(-0.26, 1.10)
    ax.set_ylim(-0.09, _LEAN[1] + _TALL)
    map_marks.sign_map(figure, chart, map_marks.failures(chart))
    return figure


def _sheet(ax: Axes, view: _View, time: FloatArray, x: FloatArray, rate: float, front: float | None) -> None:
    """Draw one curve over a white sheet that hides the curves behind it."""
    known = np.isfinite(x)
    if not known.any():
        return
    t, x = time[known], x[known].astype(np.float64)
    across, up = thinned(view.across(t, rate), view.up(x, rate), _FLAT)
    foot = float(view.up(view.heights[0], rate))
    ax.fill([across[0], *across, across[-1]], [foot, *up, foot], color="white", lw=0.0, zorder=_SHEETS)
    ax.plot(across, up, color=INK, lw=0.4, zorder=_SHEETS, gid=f"rate {rate:.6g}")
    if front is not None and (x > front).any():
        inside = _above(across, up, float(view.up(front, rate)))
        ax.plot(*inside, color=BLUE, lw=0.6, zorder=_SHEETS, gid=f"in the pack at {rate:.6g}")


def thinned(x: FloatArray, y: FloatArray, room: float) -> tuple[FloatArray, FloatArray]:
    """Thin a curve to fewer points whose polygon stays within `room` of the curve, measured along y.

    The algorithm is that of D. Douglas and T. Peucker, Cartographica 10 (1973) 112.
    """
    keep = np.zeros(len(x), dtype=np.bool_)
    keep[[0, -1]] = True
    pieces = [(0, len(x) - 1)]
    while pieces:
        first, last = pieces.pop()
        if last - first < 2:
            continue
        share = (x[first : last + 1] - x[first]) / (x[last] - x[first])
        off = np.abs(y[first : last + 1] - y[first] - share * (y[last] - y[first]))
        far = first + int(off.argmax())
        if off[far - first] > room:
            keep[far] = True
            pieces += [(first, far), (far, last)]
    return x[keep], y[keep]


def _above(x: FloatArray, y: FloatArray, level: float) -> tuple[FloatArray, FloatArray]:
    """Clip a curve to its portions above a level, separated by NaN."""
    crossing = np.flatnonzero((y[1:] - level) * (y[:-1] - level) < 0.0)
    share = (level - y[crossing]) / (y[crossing + 1] - y[crossing])
    x = np.insert(x, crossing + 1, x[crossing] + share * (x[crossing + 1] - x[crossing]))
    y = np.insert(y, crossing + 1, level)
    return x, np.where(y >= level, y, np.nan)


def _time_axis(ax: Axes, view: _View, time: Scale) -> None:
    first, last = view.times
    nearest = view.rates[0]
    foot = float(view.up(view.heights[0], nearest))
    ax.plot(view.across([first, last], nearest), [foot, foot], color=INK, lw=HAIR)
    for tick in _ticks(time, first, last, 9):
        at = float(view.across(tick / time.factor, nearest))
        _mark(ax, f"{tick:g}", (at, foot), (0.0, -_TICK), (0.0, -2.0), "center top")
    middle = float(view.across(0.5 * (first + last), nearest)), foot - _TICK
    _text(ax, f"Time from the first firing  [{time.sign}]", middle, (0.0, -14.0), "center top", **_NAME)


def _height_axis(ax: Axes, view: _View, way: Scale, places: dict[str, float]) -> None:
    low, high = view.heights
    nearest = view.rates[0]
    at = float(view.across(view.times[0], nearest)) - _POST
    ends = [float(view.up(end, nearest)) for end in (low, high)]
    ax.plot([at, at], ends, color=INK, lw=HAIR)
    for tick in _ticks(way, low, high, 4):
        up = float(view.up(tick / way.factor, nearest))
        _mark(ax, f"{tick:g}", (at, up), (-_TICK, 0.0), (-2.0, 0.0), "right center")
    for name, place in places.items():
        colour = BLUE if name == "pack" else MUTED
        here = at, float(view.up(place, nearest))
        _mark(ax, name, here, (_TICK, 0.0), (2.0, 0.0), "left center", colour, gid=name)
    middle = at, 0.5 * (ends[0] + ends[1])
    _text(ax, f"Displacement  [{way.sign}]", middle, (-26.0, 0.0), "right center", rotation=90.0, **_NAME)


def _rate_axis(ax: Axes, view: _View, shown: Scale) -> None:
    end, floor = view.times[1], view.heights[0]
    across = [float(view.across(end, rate)) for rate in view.rates]
    up = [float(view.up(floor, rate)) for rate in view.rates]
    ax.plot(across, up, color=INK, lw=HAIR)
    for tick in _ticks(shown, *view.rates, 5):
        rate = tick / shown.factor
        at = float(view.across(end, rate)), float(view.up(floor, rate))
        _mark(ax, f"{tick:g}", at, (_TICK, 0.0), (2.0, 0.0), "left center")
    middle = 0.5 * (across[0] + across[1]), 0.5 * (up[0] + up[1])
    lean = float(np.degrees(np.arctan2(_LEAN[1], _LEAN[0])))
    text = f"{shown.label}  [{shown.sign}]"
    _text(ax, text, middle, (32.0, -4.0), "center center", rotation=lean, **_NAME)


def _ticks(shown: Scale, first: float, last: float, most: int) -> list[float]:
    low, high = float(shown.shown(first)), float(shown.shown(last))
    ticks = MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    return [float(tick) for tick in ticks if low <= tick <= high * (1.0 + 1e-12)]


def _mark(
    ax: Axes,
    text: str,
    at: tuple[float, float],
    way: tuple[float, float],
    shift: tuple[float, float],
    side: str,
    color: str = INK,
    **options: Any,
) -> None:
    """Draw a tick at a position `at` on an axis, with a text at its end.

    `way` is the vector of the tick, in data units; `shift` is the offset of the text from the end of the
    tick, in points; and `side` is the alignment of the text.
    """
    end = at[0] + way[0], at[1] + way[1]
    ax.plot([at[0], end[0]], [at[1], end[1]], color=color, lw=HAIR, **options)
    _text(ax, text, end, shift, side, color=color)


def _text(
    ax: Axes, text: str, at: tuple[float, float], shift: tuple[float, float], side: str, **options: Any
) -> None:
    beside(
        ax, text, at, shift, side, **{"fontsize": SMALL, "color": INK, "annotation_clip": False, **options}
    )


@styled
def compare_maps(computed: xr.Dataset, measured: xr.Dataset) -> Figure:
    """Draw a computed and a measured map side by side, with the RMS of their difference.

    The maps are from `printhammer.frequency_map` and `printhammer.maps.measured.load_measured_map`. The third
    panel shows the RMS difference over time for every common rate (SVG id "difference"). Grey areas have no
    displacement.
    """
    for chart in (computed, measured):
        map_marks.drawable(chart)
    scales = map_marks.scales_of(computed, measured)
    figure = new_figure(4.4, 8.6)
    grid = figure.add_gridspec(1, 4, width_ratios=(10.0, 10.0, 3.4, 0.7))
    left = figure.add_subplot(grid[0])
    right = figure.add_subplot(grid[1], sharex=left, sharey=left)
    beside = figure.add_subplot(grid[2], sharey=left)
    bar = figure.add_subplot(grid[3])
    for ax, chart, name in ((left, computed, "computed"), (right, measured, "measured")):
        map_marks.picture(ax, chart, scales)
        heading(ax, name)
    for ax in (right, beside):
        ax.set_ylabel("")
        ax.tick_params(axis="y", labelleft=False)
    # The axes are shared, so that both pictures show the full range of both maps.
    maps = (computed, measured)
    rows = [scales.rate.shown(map_marks.edges(chart["rate"].values)) for chart in maps]
    ends = [scales.time.shown(chart["time"].values[[0, -1]]) for chart in maps]
    left.set_ylim(min(row[0] for row in rows), max(row[-1] for row in rows))
    left.set_xlim(min(end[0] for end in ends), max(end[1] for end in ends))
    remark = _difference(beside, scales, computed, measured)
    map_marks.colour_bar(bar, computed, scales)
    map_marks.sign_map(figure, computed, map_marks.failures(computed), remark)
    return figure


def _difference(ax: Axes, scales: map_marks.Scales, computed: xr.Dataset, measured: xr.Dataset) -> str:
    """Draw the RMS difference against the rate; return a remark if the maps share no rate."""
    way = scales.way
    rates, difference = rms_difference(computed, measured)
    heading(ax, "difference")
    ax.set_xlabel(f"RMS  [{way.sign}]")
    ax.tick_params(axis="x", top=True)
    known = np.isfinite(difference)
    if not known.any():
        ax.set_xticks([])
        return "The maps have no rate in common, so that no difference can be drawn."
    style: dict[str, Any] = {"color": BLUE, "lw": 0.8, "marker": "o", "ms": 2.6 if known.sum() < 80 else 0.0}
    ax.plot(way.shown(difference[known]), scales.rate.shown(rates[known]), gid="difference", **style)
    ax.set_xlim(0.0, 1.08 * max(float(way.shown(difference[known].max())), 1e-12))
    return ""
