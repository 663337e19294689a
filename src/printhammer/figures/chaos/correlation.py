"""Correlation sums and their local slopes against the distance, with the plateau."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from printhammer.figures.elements.marks import heading
from printhammer.figures.elements.style import BLUE, MUTED, ORANGE, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.chaos import CorrelationDimension


@styled
def plot(correlation: CorrelationDimension) -> Figure:
    """Draw the correlation sums, below them their local slopes, and the dimension if there is a plateau."""
    figure = new_figure(5.0)
    above, below = figure.subplots(2, 1, sharex=True)
    some = correlation.sums > 0.0
    above.loglog(correlation.radius[some], correlation.sums[some], "o-", color=BLUE, ms=3.0, lw=0.8)
    above.set_ylabel("Correlation sum")
    below.semilogx(correlation.radius, correlation.slopes, "o-", color=BLUE, ms=3.0, lw=0.8)
    below.set(xlabel="Distance", ylabel="Local slope")
    if not math.isnan(correlation.dimension):
        for ax in (above, below):
            ax.axvspan(*correlation.plateau, color=MUTED, alpha=0.15, lw=0.0, zorder=0.0)
        below.axhspan(correlation.low, correlation.high, color=ORANGE, alpha=0.2, lw=0.0, zorder=0.0)
        below.axhline(correlation.dimension, color=ORANGE, lw=1.0)
    heading(above, correlation.message)
    return figure
