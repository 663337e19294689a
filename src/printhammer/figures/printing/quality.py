"""Quality as pictures: force and arrival of every dot, and how both deviate as the rate grows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import ALONG_X, beside, dashed, dots, heading
from printhammer.figures.elements.style import new_figure, sign, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.printing.dots.limits import Limits
    from printhammer.printing.rates.quality import Quality
    from printhammer.printing.rates.safe_rate import SafeRate
    from printhammer.support.arrays import FloatArray

_MOST_SLOTS: Final = 64
_US: Final = 1e6
_ROOM: Final = 1.25


@styled
def plot(quality: Quality) -> Figure:
    """Draw where the dots of a pattern lie in force and arrival, and one after the other.

    Left: every dot, its force over that of the single pulse against how late it arrives, the limits as a box.
    Right: both against the slot, at most 64 slots, those with the worst dot among them.
    """
    figure = new_figure(3.6, 7.6)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.35))
    plane = figure.add_subplot(grid[:, 0])
    force = figure.add_subplot(grid[0, 1])
    arrival = figure.add_subplot(grid[1, 1], sharex=force)
    share = 100.0 * (quality.force / quality.nominal.force - 1.0)
    late = _US * quality.arrival_deviation
    good = quality.fault < 0
    limits = quality.limits
    _box(plane, limits, late, share)
    off = ~good & ~quality.lost
    for which, colour, name in ((good, style.BLUE, "within limits"), (off, style.ORANGE, "off")):
        if which.any():
            dots(plane, late[which], share[which], 3.2, colour, alpha=0.7, label=name, gid=name)
    if quality.lost.any():
        plane.plot([], [], "x", ms=5.0, color=style.INK, label=f"{int(quality.lost.sum())} lost")
    plane.set_xlabel("Arrives late by  [µs]")
    plane.set_ylabel("Force against the single pulse  [%]")
    plane.legend(loc="upper right", fontsize=style.TINY, frameon=False, handletextpad=0.2)
    begin = _window(quality)
    shown = (quality.slot >= begin) & (quality.slot < begin + _MOST_SLOTS)
    first = quality.judged_from
    where, colours = quality.slot[shown] - first, np.where(good[shown], style.BLUE, style.ORANGE)
    for ax, values, bound in ((force, share, 100.0 * limits.force), (arrival, late, _US * limits.arrival)):
        ax.axhspan(-bound, bound, color=style.FAINT, alpha=0.5, lw=0.0)
        ax.axhline(0.0, color=style.MUTED, lw=style.HAIR)
        ax.vlines(where, 0.0, values[shown], color=colours, lw=style.THIN)
        ax.scatter(where, values[shown], s=7.0, color=colours, lw=0.0)
        gone = quality.slot[shown & np.isnan(values)] - first
        ax.plot(gone, np.zeros(gone.size), "x", ms=5.0, color=style.INK, gid="lost")
        reach = _reach(values, bound)
        ax.set_ylim(-reach, reach)
    force.set_ylabel("Force  [%]")
    arrival.set_ylabel("Arrival  [µs]")
    force.tick_params(axis="x", labelbottom=False)
    name = "Slot of the cycle" if first else "Slot"
    arrival.set_xlabel(name if begin == 0 else f"{name}; the {_MOST_SLOTS} with the worst dot")
    arrival.set_xlim(begin - first - 1.0, min(begin + _MOST_SLOTS, len(quality.wanted)) - first)
    within = f"{int(good.sum())} of {good.size} dots within limits"
    heading(force, f"{quality.rate:g} Hz, {quality.strategy}: {within}")
    sign(figure, quality.hammer, "" if quality.ok else f"The run ended early: {quality.status}.")
    return figure


@styled
def plot_safe_rate(*safe_rates: SafeRate) -> Figure:
    """Draw how force and arrival deviate against the rate, and up to which rate all patterns pass.

    Bands from the least to the largest deviation of any dot of any pattern; grey: within limits. Several safe
    rates, such as of different strategies, are drawn over each other.
    """
    figure = new_figure(4.6)
    axes = figure.subplots(2, 1, sharex=True)
    for number, safe in enumerate(safe_rates):
        colour = (style.BLUE, style.GREEN, style.ORANGE)[number % 3]
        for ax, low, high in (
            (axes[0], 100.0 * safe.force_low, 100.0 * safe.force_high),
            (axes[1], _US * safe.arrival_low, _US * safe.arrival_high),
        ):
            ax.fill_between(safe.rates, low, high, color=colour, alpha=0.3, lw=0.0)
            ax.plot(safe.rates, low, color=colour, lw=style.THIN)
            ax.plot(safe.rates, high, color=colour, lw=style.THIN, label=safe.strategy)
            if np.isfinite(safe.rate):
                dashed(ax.axvline, safe.rate, color=colour, lw=style.THIN, gid="safe rate")
        if np.isfinite(safe.rate):
            text = f"{'at least ' if safe.at_least else ''}{safe.rate:g} Hz"
            how = {"xycoords": ALONG_X, "fontsize": style.SMALL, "color": colour}
            beside(axes[0], text, (safe.rate, 1.0), (-3.0, -3.0 - 10.0 * number), "right top", **how)
    limits = safe_rates[0].limits
    for ax, bound in ((axes[0], 100.0 * limits.force), (axes[1], _US * limits.arrival)):
        ax.axhspan(-bound, bound, color=style.FAINT, alpha=0.5, lw=0.0, zorder=0)
        ax.axhline(0.0, color=style.MUTED, lw=style.HAIR)
    axes[0].set_ylabel("Force  [%]")
    axes[1].set_ylabel("Arrival  [µs]")
    axes[1].set_xlabel("Slots per second  [Hz]")
    if len(safe_rates) > 1:
        axes[0].legend(loc="lower left", fontsize=style.TINY, frameon=False)
    remarks = [safe.failure.text for safe in safe_rates if safe.failure is not None]
    sign(figure, safe_rates[0].hammer, *remarks[:1])
    return figure


def _box(ax: Axes, limits: Limits, late: FloatArray, share: FloatArray) -> None:
    """Draw the limits as a box, and choose the view so that box and dots are seen."""
    from matplotlib.patches import Rectangle

    x, y = _US * limits.arrival, 100.0 * limits.force
    box: Any = Rectangle((-x, -y), 2.0 * x, 2.0 * y, facecolor=style.FAINT, alpha=0.5, lw=0.0)
    ax.add_patch(box)
    ax.axhline(0.0, color=style.MUTED, lw=style.HAIR)
    ax.axvline(0.0, color=style.MUTED, lw=style.HAIR)
    across, up = _reach(late, x), _reach(share, y)
    ax.set(xlim=(-across, across), ylim=(-up, up))


def _reach(values: FloatArray, bound: float) -> float:
    known = np.abs(values[~np.isnan(values)])
    return float(_ROOM * max(bound, known.max(initial=0.0))) or 1.0


def _window(quality: Quality) -> int:
    """Return the first slot shown, so that the worst dot is in the middle."""
    if len(quality.wanted) <= _MOST_SLOTS:
        return 0
    bounds = np.maximum([quality.limits.force, quality.limits.arrival], 1e-300)
    off = np.maximum(
        np.abs(quality.force / quality.nominal.force - 1.0) / bounds[0],
        np.abs(quality.arrival_deviation) / bounds[1],
    )
    # Lost dots, whose deviations are NaN, and extra contacts are worse than any deviation.
    worst = int(np.argmax(np.where(np.isnan(off) | (quality.extra_contacts > 0), np.inf, off)))
    middle = int(quality.slot[worst]) - _MOST_SLOTS // 2
    return max(quality.judged_from, min(middle, len(quality.wanted) - _MOST_SLOTS))
