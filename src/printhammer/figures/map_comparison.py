"""A computed and a measured frequency-time map side by side, on the same scales, and how far they differ."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.figures.elements import map_marks
from printhammer.figures.elements.marks import heading
from printhammer.figures.elements.style import BLUE, new_figure, styled
from printhammer.maps.frequency import rms_difference

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def compare_maps(computed: xr.Dataset, measured: xr.Dataset) -> Figure:
    """Draw a computed and a measured map side by side, with the root mean square of their difference.

    Maps are those of `printhammer.frequency_map` and `printhammer.maps.measured.load_measured_map`. In the
    third panel, "difference" is the gid of the root mean square over time, for every rate that both have; in
    grey areas the displacement is not known.

    Raises
    ------
    InputError
        A map has fewer than two times.
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
    # Both pictures, which share their axes, show all of both maps.
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
    """Draw the root mean square of the difference against rate; say so where there is none."""
    way = scales.way
    rates, difference = rms_difference(computed, measured)
    heading(ax, "difference")
    ax.set_xlabel(f"RMS  [{way.sign}]")
    ax.tick_params(axis="x", top=True)
    known = np.isfinite(difference)
    if not known.any():
        ax.set_xticks([])
        return "No rate is in both maps; nothing is known of their difference."
    style: dict[str, Any] = {"color": BLUE, "lw": 0.8, "marker": "o", "ms": 2.6 if known.sum() < 80 else 0.0}
    ax.plot(way.shown(difference[known]), scales.rate.shown(rates[known]), gid="difference", **style)
    ax.set_xlim(0.0, 1.08 * max(float(way.shown(difference[known].max())), 1e-12))
    return ""
