"""Figures of compensation tables, and of their gains and losses relative to open loop.

`plot_learning` draws the dots before, during and after learning.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.control.learning.learn import Learning
from printhammer.control.table.compensation import CompensationTable
from printhammer.control.table.drive import REST, gap_text, histories, number_of
from printhammer.control.table.report import STRATEGIES, TableReport
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import heading, inside
from printhammer.figures.elements.scales import Scale
from printhammer.figures.elements.style import foot, new_figure, sign, styled
from printhammer.printing.dots.strategy import LEAD_IN
from printhammer.printing.rates.quality import PITCH
from printhammer.support.arrays import FloatArray
from printhammer.units import from_si

_FEW: Final = 4  # Number of rates from which on curves replace maps; arbitrary
_LINES: Final = (style.BLUE, style.ORANGE, style.GREEN, style.YELLOW)
_MICROSECONDS: Final = Scale("", "s", "us")
_BINS: Final = 41  # Bins of a histogram, odd so that one is centred at zero; arbitrary


@styled
def plot(table: CompensationTable) -> Figure:
    """Draw a compensation table: maps over histories for up to three rates, else curves against the rate."""
    figure = _few_rates(table) if table.rates.size < _FEW else _many_rates(table)
    foot(figure, f"{table.hammer} · {table.fingerprint[:8]} · at most {table.largest_current:g} A")
    return figure


def _few_rates(table: CompensationTable) -> Figure:
    """Draw advance and width as maps with one cell per history; the vertical axis is the latest gap."""
    figure = new_figure(1.2 + 2.1 * table.rates.size)
    axes = figure.subplots(table.rates.size, 2, squeeze=False)
    side, across = table.reach + 1, (table.reach + 1) ** (table.gaps - 1)
    every = {number_of(row, table.reach): row for row in histories(table.gaps, table.reach)}
    for row, rate in enumerate(table.rates.tolist()):
        for ax, name, word in zip(
            axes[row], ("advance", "width"), ("Advance of the firing", "Width of the pulse"), strict=True
        ):
            values = np.full((side, across), np.nan)
            for number in every:
                values[divmod(number, across)] = getattr(table, name)[row, number]
            shown = _MICROSECONDS.shown(values)
            mesh = ax.pcolormesh(np.ma.masked_invalid(shown), cmap="viridis")
            for (down, right), value in np.ndenumerate(shown):
                if np.isfinite(value):
                    colour = "white" if mesh.norm(value) < 0.6 else "black"
                    inside(ax, f"{value:.1f}", right + 0.5, down + 0.5, colour)
            heading(ax, f"{word}, µs, at {rate:g} Hz")
            ax.set_yticks(np.arange(side) + 0.5, [gap_text(gap) for gap in range(side)])
            ticks = {
                number % across: "-".join(map(gap_text, history[1:])) for number, history in every.items()
            }
            ax.set_xticks([place + 0.5 for place in ticks], list(ticks.values()), fontsize=style.TINY)
            ax.set_ylabel("Last gap, slots")
            if table.gaps > 1:
                ax.set_xlabel("Gaps before, latest first")
            ax.invert_yaxis()
    return figure


def _many_rates(table: CompensationTable) -> Figure:
    """Draw, against the rate, advance and width of the second dot after a rest; one line per gap."""
    figure = new_figure(5.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    lowest = int(np.argmax((table.advance != 0.0).any(axis=1)))
    shown = slice(max(0, lowest - 1), None)
    rates = table.rates[shown] / 1e3
    for gap in range(1, table.reach + 1):
        column = number_of((gap, *[REST] * (table.gaps - 1)), table.reach)
        colour = _LINES[(gap - 1) % len(_LINES)]
        word = "gap of one slot" if gap == 1 else f"gap of {gap} slots"
        for ax, name in ((upper, "advance"), (lower, "width")):
            values = _MICROSECONDS.shown(getattr(table, name)[shown, column])
            ax.plot(rates, values, color=colour, lw=style.THIN, label=word, gid=f"{name} {gap}")
            braked = table.brake_width[shown, column] > 0.0
            first = ax is lower and gap == 1 and braked.any()
            names = {"gid": f"braked {name} {gap}", "label": "with a brake pulse before" if first else None}
            ax.plot(rates[braked], values[braked], ls="none", marker="o", ms=2.5, color=colour, **names)
    upper.axhline(0.0, color=style.MUTED, lw=style.HAIR)
    upper.set_ylabel("Advance of the firing  [µs]")
    lower.set_ylabel("Width of the pulse  [µs]")
    lower.set_xlabel("Slots per second  [kHz]")
    lower.legend(frameon=False, fontsize=style.SMALL)
    heading(upper, "Second dot after a rest")
    return figure


@styled
def plot_report(report: TableReport) -> Figure:
    """Draw a report on a compensation table: fractions of good dots, and histograms of deviations.

    Bars: fraction of dots within limits for each hammer, over all rates and patterns. Histograms: force and
    arrival deviations of the dots of the de Bruijn cycle at the first rate; grey bands are the limits.
    """
    figure = new_figure(5.6)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.2, 1.0))
    bars = figure.add_subplot(grid[0, :])
    share = 100.0 * report.good.mean(axis=(2, 3))
    places = np.arange(len(report.hammers))
    for number, (name, colour) in enumerate(zip(STRATEGIES, (style.ORANGE, style.BLUE), strict=True)):
        bars.bar(places + 0.4 * number - 0.2, share[number], 0.38, color=colour, label=name)
    names = [name.replace(" %", "%") for name in report.hammers]
    bars.set_xticks(places, names, fontsize=style.TINY, rotation=30)
    for text in bars.get_xticklabels():
        text.set_horizontalalignment("right")
    bars.set_ylabel("Dots within limits  [%]")
    bars.set_xlim(-0.6, places.size - 0.4)
    bars.set_ylim(0.0, 119.0)
    bars.set_yticks([0, 25, 50, 75, 100])
    bars.legend(frameon=False, fontsize=style.SMALL, ncols=2, loc="upper right")
    rates = report.rates
    span = f"{rates[0]:g} Hz" if rates.size == 1 else f"{rates.min():g} Hz to {rates.max():g} Hz"
    heading(bars, f"Hammers driven, {span}")
    off, limit = 100.0 * report.force_deviation, 100.0 * report.limits.force
    _histogram(figure.add_subplot(grid[1, 0]), off, limit, "Force deviation  [%]")
    late = _MICROSECONDS.shown(report.arrival_deviation)
    limit = float(_MICROSECONDS.shown(report.limits.arrival))
    _histogram(figure.add_subplot(grid[1, 1]), late, limit, "Arrival deviation  [µs]")
    sign(figure, report.hammer)
    return figure


def _histogram(ax: Axes, values: FloatArray, limit: float, name: str) -> None:
    """Draw histograms of deviations in open loop and with the table, clipped to three times the limit."""
    edges = np.linspace(-3.0 * limit, 3.0 * limit, _BINS + 1)
    ax.axvspan(-limit, limit, color=style.FAINT, lw=0.0, zorder=0)
    for row, colour, look in zip(values, (style.ORANGE, style.BLUE), ("--", "-"), strict=True):
        known = np.clip(row[~np.isnan(row)], edges[0], edges[-1])
        ax.hist(known, bins=edges.tolist(), histtype="step", color=colour, ls=look, lw=style.THIN)
    heading(ax, "larger deviations: in the end bins", loc="right", fontsize=style.TINY)
    ax.set_yscale("log")
    ax.set_xlabel(name)
    ax.set_ylabel("Dots of the cycle")


_FIRST: Final = LEAD_IN + 128  # First slot drawn, after the lead-in, where dots and gaps are mixed
_SLOTS: Final = 88  # Number of slots drawn; arbitrary
_HEIGHT: Final = 0.42  # Height of a line, inches; arbitrary
_SIZE: Final = 20.0  # Area of a dot of nominal force; arbitrary
_CONTRAST: Final = 4.0  # Factor by which the area of a dot exaggerates its force deviation; arbitrary
_SMALLEST: Final = 0.1  # Smallest area of a dot, as a fraction of the area at nominal force; arbitrary


@styled
def plot_learning(learning: Learning) -> Figure:
    """Draw the printed dots of each learning stage as a line of dots on the paper.

    Each dot is drawn at its position on the paper; its area exaggerates the force deviation. Dots outside the
    limits are orange; a lost dot is a cross at its slot.
    """
    stages = learning.dots.size
    figure = new_figure(1.1 + _HEIGHT * stages)
    ax = figure.subplots()
    drawn = (learning.slot >= _FIRST) & (learning.slot < _FIRST + _SLOTS)
    place = PITCH * (learning.slot[drawn] - _FIRST)
    speed = PITCH * learning.rate
    for row in range(stages):
        late, force = learning.arrival_deviation[row, drawn], learning.force_deviation[row, drawn]
        lost, good = np.isnan(late), learning.good[row, drawn].astype(bool)
        x = from_si(1.0, "m", "mm") * (place + speed * np.nan_to_num(late))
        size = _SIZE * np.maximum(1.0 + _CONTRAST * np.nan_to_num(force), _SMALLEST)
        for which, colour in ((good, style.BLUE), (~good & ~lost, style.ORANGE)):
            ax.scatter(x[which], np.full(which.sum(), row), s=size[which], c=colour, linewidths=0.0)
        ax.scatter(x[lost], np.full(lost.sum(), row), s=_SIZE, c=style.ORANGE, marker="x", linewidths=0.8)
    shares = 100.0 * learning.share
    names = [
        f"{int(dots)} dots" + ("" if learned else ", open loop")
        for dots, learned in zip(learning.dots, learning.learned, strict=True)
    ]
    ax.set_yticks(range(stages), names)
    ax.set_ylim(stages - 0.4, -0.6)
    ax.margins(x=0.03)
    right = ax.secondary_yaxis("right")
    right.set_yticks(range(stages), [f"{share:.0f} %" for share in shares])
    ax.set_xlabel("Position on the paper  [mm]")
    heading(ax, f"Dots after a number of test dots, at {learning.rate:.6g} Hz")
    heading(ax, "within limits", loc="right")
    sign(figure, learning.hammer)
    return figure
