"""Figure 9: displacement in colours, against time and firing rate, in bursts of nine pulses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.figures.elements import map_marks
from printhammer.figures.elements.style import new_figure, styled

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer


@styled
def frequency_map(
    hammer: Hammer, *, chart: xr.Dataset | None = None, rates: npt.ArrayLike | None = None
) -> Figure:
    """Draw Fig. 9: the frequency-time map in colours.

    Thin lines are firings, strong ones lost dots, or marks in each row where there are fewer than 50 rates;
    the gids are "firing 1" and so on, and "lost dots".

    Parameters
    ----------
    hammer : Hammer
        Any hammer with a waveform; not looked at where a map is given.
    chart : xarray.Dataset, optional
        A map from `printhammer.frequency_map`; by default the one of the hammer.
    rates : array, optional
        Rates of the map that is computed, Hz.

    Raises
    ------
    InputError
        The hammer has no waveform or no rest state, or the map fewer than two times.
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
