"""Impact maps: velocity at touch against the time since the last firing.

Impact trains: histogram, return map and autocorrelation of the intervals between impacts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from printhammer.figures.chaos.strobe import shown_period
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import dashed, dots, heading, note
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import (
    BLUE,
    FAINT,
    HAIR,
    MUTED,
    SMALL,
    THIN,
    new_figure,
    new_panel,
    sign,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.chaos import ImpactTrain, Section


@styled
def plot(section: Section) -> Figure:
    """Draw the touches of a surface: velocity against the time since the last firing.

    The whole period is shown.
    """
    figure, ax = new_panel(4.2)
    time, speed = scale("time", section.period), scale("velocity")
    colour = style.BLUE if section.surface == "backstop" else style.ORANGE
    ax.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=1.0)
    dots(ax, time.shown(section.since), speed.shown(section.v), 2.2, colour, gid="touches", zorder=3.0)
    ax.set_xlim(0.0, float(time.shown(section.period)))
    ax.margins(y=0.08)
    fired = f"fired every {shown_period(section.period)}"
    heading(ax, f"{len(section.t)} touches of the {section.surface}, {fired}")
    if not len(section.t):
        note(ax, "no touches", (0.5, 0.5), ha="center", va="center", color=style.YELLOW)
    label(ax, "x", time, "Time since the last firing")
    label(ax, "y", speed, "Velocity at touch")
    sign(figure, section.hammer, f"{section.remark}." if section.remark else "")
    return figure


@styled
def plot_train(train: ImpactTrain) -> Figure:
    """Draw the statistics of an impact train.

    Histogram of the intervals, each interval against the one before, and their autocorrelation; what
    independent intervals would not exceed in 19 of 20 lags lies between the broken lines.
    """
    figure = new_figure(2.9)
    bars, returns, lags = figure.subplots(1, 3)
    time = scale("time", float(train.intervals.max()))
    bars.stairs(train.counts, time.shown(train.edges), fill=True, color=BLUE, gid="histogram")
    bars.set(xlabel=f"Interval  [{time.sign}]", ylabel="Number")
    shown = time.shown(train.intervals)
    dots(returns, shown[:-1], shown[1:], 1.8, BLUE, gid="returns", zorder=3.0)
    low, high = (float(end) for end in time.shown(train.edges[[0, -1]]))
    room = 0.06 * (high - low)
    ends = (low - room, high + room)
    returns.plot(ends, ends, color=FAINT, lw=HAIR, zorder=1.0)
    returns.set(xlabel=f"Interval  [{time.sign}]", ylabel=f"Next one  [{time.sign}]", xlim=ends, ylim=ends)
    _lags(lags, train)
    for ax in (bars, returns, lags):
        ax.tick_params(axis="both", top=True, right=True)
        ax.locator_params(axis="both", nbins=5)
    statistics = [
        f"{len(train.times)} impacts",
        f"mean interval {time.shown(train.mean):.4g} {time.sign}",
        f"coefficient of variation {train.variation:.3g}",
    ]
    if not np.isnan(train.fano):
        statistics.append(f"Fano factor {train.fano:.3g} in {time.shown(train.window):.4g} {time.sign}")
    figure.suptitle(", ".join(statistics), x=0.01, ha="left", fontsize=SMALL)
    if train.hammer is not None:
        sign(figure, train.hammer)
    return figure


def _lags(ax: Axes, train: ImpactTrain) -> None:
    if np.isfinite(train.autocorrelation).all():
        at = np.arange(len(train.autocorrelation))
        ax.vlines(at, 0.0, train.autocorrelation, color=BLUE, lw=THIN, gid="autocorrelation")
        dots(ax, at, train.autocorrelation, 2.2, BLUE)
        dashed(ax.axhline, -train.significant, train.significant)
    else:
        note(ax, "all intervals are the same", (0.5, 0.6), ha="center", va="center")
    ax.set_xlim(-0.5, len(train.autocorrelation) - 0.5)
    ax.axhline(0.0, color=MUTED, lw=HAIR)
    ax.set(xlabel="Lag", ylabel="Autocorrelation", ylim=(-1.1, 1.1))
