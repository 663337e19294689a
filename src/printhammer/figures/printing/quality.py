"""Quality as pictures: force and arrival of every dot, and how both deviate as the rate grows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import ALONG_X, beside
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
def plot(found: Quality) -> Figure:
    """Draw where the dots of a pattern lie in force and arrival, and one after the other.

    Left: every dot, its force over that of the single pulse against how late it arrives, the limits as a box.
    Right: both against the slot, at most 64 slots, those with the worst dot among them.
    """
    figure = new_figure(3.6, 7.6)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.35))
    plane = figure.add_subplot(grid[:, 0])
    force = figure.add_subplot(grid[0, 1])
    arrival = figure.add_subplot(grid[1, 1], sharex=force)
    share = 100.0 * (found.force / found.nominal.force - 1.0)
    late = _US * found.arrival_deviation
    good = found.fault < 0
    limits = found.limits
    _box(plane, limits, late, share)
    for which, colour, name in (
        (good, style.BLUE, "within limits"),
        (~good & ~found.lost, style.ORANGE, "off"),
    ):
        if which.any():
            plane.plot(
                late[which], share[which], "o", ms=3.2, mew=0.0, alpha=0.7, color=colour, label=name, gid=name
            )
    if found.lost.any():
        plane.plot([], [], "x", ms=5.0, color=style.INK, label=f"{int(found.lost.sum())} lost")
    plane.set_xlabel("Arrives late by  [µs]")
    plane.set_ylabel("Force against the single pulse  [%]")
    plane.legend(loc="upper right", fontsize=style.TINY, frameon=False, handletextpad=0.2)
    begin = _window(found)
    shown = (found.slot >= begin) & (found.slot < begin + _MOST_SLOTS)
    where = found.slot[shown]
    for ax, values, bound in ((force, share, 100.0 * limits.force), (arrival, late, _US * limits.arrival)):
        ax.axhspan(-bound, bound, color=style.FAINT, alpha=0.5, lw=0.0)
        ax.axhline(0.0, color=style.MUTED, lw=style.HAIR)
        ax.vlines(
            where, 0.0, values[shown], color=np.where(good[shown], style.BLUE, style.ORANGE), lw=style.THIN
        )
        ax.scatter(where, values[shown], s=7.0, color=np.where(good[shown], style.BLUE, style.ORANGE), lw=0.0)
        gone = found.slot[shown & np.isnan(values)]
        ax.plot(gone, np.zeros(gone.size), "x", ms=5.0, color=style.INK, gid="lost")
        _symmetric(ax, values, bound)
    force.set_ylabel("Force  [%]")
    arrival.set_ylabel("Arrival  [µs]")
    force.tick_params(axis="x", labelbottom=False)
    arrival.set_xlabel("Slot" if begin == 0 else f"Slot; the {_MOST_SLOTS} with the worst dot")
    arrival.set_xlim(begin - 1.0, min(begin + _MOST_SLOTS, len(found.wanted)))
    told = f"{found.rate:g} Hz, {found.strategy}: {int(good.sum())} of {good.size} dots within limits"
    force.set_title(told, loc="left", fontsize=style.SMALL)
    sign(figure, found.hammer, "" if found.ok else f"The run ended early: {found.status}.")
    return figure


@styled
def plot_safe_rate(*found: SafeRate) -> Figure:
    """Draw how force and arrival deviate against the rate, and up to which rate all patterns pass.

    Bands from the least to the largest deviation of any dot of any pattern; grey: within limits.

    Parameters
    ----------
    found : SafeRate
        From `printhammer.safe_rate`; several, such as of different strategies, are drawn over each other.
    """
    figure = new_figure(4.6)
    axes = figure.subplots(2, 1, sharex=True)
    for number, one in enumerate(found):
        colour = (style.BLUE, style.GREEN, style.ORANGE)[number % 3]
        for ax, low, high in (
            (axes[0], 100.0 * one.force_low, 100.0 * one.force_high),
            (axes[1], _US * one.arrival_low, _US * one.arrival_high),
        ):
            ax.fill_between(one.rates, low, high, color=colour, alpha=0.3, lw=0.0)
            ax.plot(one.rates, low, color=colour, lw=style.THIN)
            ax.plot(one.rates, high, color=colour, lw=style.THIN, label=one.strategy)
            if np.isfinite(one.rate):
                ax.axvline(one.rate, color=colour, lw=style.THIN, ls=(0, (4, 3)), gid="safe rate")
        if np.isfinite(one.rate):
            beside(
                axes[0],
                f"{'at least ' if one.at_least else ''}{one.rate:g} Hz",
                (one.rate, 1.0),
                (-3.0, -3.0 - 10.0 * number),
                "right top",
                xycoords=ALONG_X,
                fontsize=style.SMALL,
                color=colour,
            )
    limits = found[0].limits
    for ax, bound in ((axes[0], 100.0 * limits.force), (axes[1], _US * limits.arrival)):
        ax.axhspan(-bound, bound, color=style.FAINT, alpha=0.5, lw=0.0, zorder=0)
        ax.axhline(0.0, color=style.MUTED, lw=style.HAIR)
    axes[0].set_ylabel("Force  [%]")
    axes[1].set_ylabel("Arrival  [µs]")
    axes[1].set_xlabel("Slots per second  [Hz]")
    if len(found) > 1:
        axes[0].legend(loc="lower left", fontsize=style.TINY, frameon=False)
    remarks = [one.failure.text for one in found if one.failure is not None]
    sign(figure, found[0].hammer, *remarks[:1])
    return figure


def _box(ax: Axes, limits: Limits, late: FloatArray, share: FloatArray) -> None:
    """Draw the limits as a box, and choose the view so that box and dots are seen."""
    from matplotlib.patches import Rectangle

    x, y = _US * limits.arrival, 100.0 * limits.force
    box: Any = Rectangle((-x, -y), 2.0 * x, 2.0 * y, facecolor=style.FAINT, alpha=0.5, lw=0.0)
    ax.add_patch(box)
    ax.axhline(0.0, color=style.MUTED, lw=style.HAIR)
    ax.axvline(0.0, color=style.MUTED, lw=style.HAIR)
    reach = [_reach(late, x), _reach(share, y)]
    ax.set_xlim(-reach[0], reach[0])
    ax.set_ylim(-reach[1], reach[1])


def _symmetric(ax: Axes, values: FloatArray, bound: float) -> None:
    reach = _reach(values, bound)
    ax.set_ylim(-reach, reach)


def _reach(values: FloatArray, bound: float) -> float:
    known = np.abs(values[~np.isnan(values)])
    return float(_ROOM * max(bound, known.max(initial=0.0))) or 1.0


def _window(found: Quality) -> int:
    """Return the first slot shown, so that the worst dot is in the middle."""
    if len(found.wanted) <= _MOST_SLOTS:
        return 0
    bounds = np.maximum([found.limits.force, found.limits.arrival], 1e-300)
    off = np.maximum(
        np.abs(found.force / found.nominal.force - 1.0) / bounds[0],
        np.abs(found.arrival_deviation) / bounds[1],
    )
    # Lost dots, whose deviations are NaN, and extra contacts are worse than any deviation.
    worst = int(np.argmax(np.where(np.isnan(off) | (found.extra_contacts > 0), np.inf, off)))
    middle = int(found.slot[worst]) - _MOST_SLOTS // 2
    return max(found.judged_from, min(middle, len(found.wanted) - _MOST_SLOTS))
