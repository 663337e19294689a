"""Figures of print quality: force and arrival time of every dot, and their deviations against the rate.

`plot_damping` draws safe rate, settle-out time and wear of every material of a damping study.

`plot_tolerance` draws the safe rates of hammers within tolerances, and the most influential constants.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import ALONG_X, ALONG_Y, beside, dashed, dots, heading
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.printing.dots.judging import Limits
from printhammer.printing.rates.damping import DampingStudy
from printhammer.printing.rates.quality import Quality
from printhammer.printing.rates.safe_rate import SafeRate
from printhammer.printing.rates.tolerance import ToleranceYield
from printhammer.support.arrays import FloatArray

_MOST_SLOTS: Final = 64  # Largest number of slots shown; arbitrary
_US: Final = 1e6  # Microseconds in a second
_ROOM: Final = 1.25  # Half-width of the axes, relative to the limit or the largest deviation; arbitrary


@styled
def plot(quality: Quality) -> Figure:
    """Draw the dots of a pattern in the plane of force and arrival deviation, and in sequence.

    Left: force of every dot relative to the single pulse, against its arrival deviation, with the limits as a
    box. Right: both quantities against the slot, for at most 64 slots that include the worst dot.
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
    plane.set_xlabel("Arrival deviation  [µs]")
    plane.set_ylabel("Force deviation  [%]")
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
    """Draw the deviations of force and arrival time against the rate, and the safe rate.

    Bands extend from the smallest to the largest deviation of any dot of any pattern; the grey area is within
    the limits. Several safe rates, e.g. of different strategies, are overlaid.
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
    """Draw the limits as a box, and set axes limits that include box and dots.

    `late` and `share` are the deviations of the dots in arrival time [us] and force [%].
    """
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
    """Return the first slot to draw, chosen so that the worst dot is in the middle."""
    if len(quality.wanted) <= _MOST_SLOTS:
        return 0
    bounds = np.maximum([quality.limits.force, quality.limits.arrival], 1e-300)
    off = np.maximum(
        np.abs(quality.force / quality.nominal.force - 1.0) / bounds[0],
        np.abs(quality.arrival_deviation) / bounds[1],
    )
    # Lost dots, whose deviations are NaN, and extra contacts rank worse than any deviation.
    worst = int(np.argmax(np.where(np.isnan(off) | (quality.extra_contacts > 0), np.inf, off)))
    middle = int(quality.slot[worst]) - _MOST_SLOTS // 2
    return max(quality.judged_from, min(middle, len(quality.wanted) - _MOST_SLOTS))


COLOURS: Final = {"as it is": style.INK, "hard": style.BLUE, "elastomer": style.GREEN, "pack": style.ORANGE}
"""Colour of the bars and labels, by kind of material."""

_ROW: Final = 0.2  # Height of a row, inches; arbitrary
_BAR: Final = 0.66  # Height of a bar, as a fraction of the spacing; arbitrary


@styled
def plot_damping(study: DampingStudy) -> Figure:
    """Draw a damping study: safe rate, settle-out time and impulse, one row per material.

    All bars, including the impulse at the backstop, are for the same print force. A bar is hollow if the
    current exceeds the limit. Dashed lines show the unchanged hammer. A text replaces a missing bar.
    """
    count = len(study.materials)
    figure = new_figure(1.3 + _ROW * count, 7.6)
    axes = figure.subplots(1, 3, sharey=True, width_ratios=(1.25, 1.0, 1.0))
    prints = [status in ("ok", "current limit") for status in study.status.tolist()]
    none = f"not even {study.grid[0]:g} Hz"
    panels = (
        ("Safe rate  [Hz]", study.safe_rate, none),
        ("Settle-out  [ms]", 1e3 * study.settle_out, "does not settle"),
        ("Wear: impulse  [mN s a dot]", 1e3 * study.impulse, ""),
    )
    for ax, (name, values, missing) in zip(axes, panels, strict=True):
        status = study.status.tolist() if ax is axes[0] else [""] * count
        otherwise = [missing if well else str(text) for well, text in zip(prints, status, strict=True)]
        _panel(ax, study, values, otherwise)
        ax.set_xlabel(name)
    labels = [material.label.replace(" us", " µs") for material in study.materials]
    axes[0].set_yticks(range(count), labels, fontsize=style.TINY)
    axes[0].set_ylim(count - 0.4, -0.6)
    for tick, material in zip(axes[0].get_yticklabels(), study.materials, strict=True):
        tick.set_color(COLOURS[material.kind])
    kinds = [kind for kind in COLOURS if any(material.kind == kind for material in study.materials)]
    for place, kind in enumerate(kinds):
        where = place / len(kinds), 1.0
        beside(axes[0], kind, where, (0.0, 4.0), xycoords="axes fraction", color=COLOURS[kind])
    over = int((study.status == "current limit").sum())
    limit = f"; hollow: over {study.current_limit:g} A" if over else f", {study.current_limit:g} A at most"
    heading(axes[2], f"All print with {study.nominal.force:.1f} N{limit}", loc="right")
    sign(figure, study.hammer)
    return figure


def _panel(ax: Axes, study: DampingStudy, values: FloatArray, otherwise: list[str]) -> None:
    best = study.best
    for row, material in enumerate(study.materials):
        colour = COLOURS[material.kind]
        if not np.isfinite(values[row]):
            beside(ax, otherwise[row], (0.0, row), (3.0, 0.0), xycoords=ALONG_Y, va="center")
            continue
        hollow = study.status[row] == "current limit"
        inside, alpha = "white" if hollow else colour, 1.0 if row == best else 0.75
        look: dict[str, Any] = {"facecolor": inside, "edgecolor": colour, "alpha": alpha, "gid": f"bar-{row}"}
        ax.barh(row, values[row], height=_BAR, **look)
        text = f"{values[row]:.4g}" if values[row] >= 100.0 else f"{values[row]:.2f}"
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
        how = {"fontweight": "bold" if row == best else "normal", "bbox": box, "color": style.INK}
        beside(ax, text, (values[row], row), (2.0, 0.0), "left center", **how)
        if material.kind == "as it is":
            dashed(ax.axvline, values[row], lw=style.THIN, zorder=0.5)
    ax.set_xlim(0.0, 1.24 * float(np.nanmax(values, initial=1e-12)))
    ax.grid(axis="x", color=style.FAINT, lw=0.5)
    ax.set_axisbelow(True)
    ax.tick_params(axis="y", length=0.0)


@styled
def plot_tolerance(batch: ToleranceYield, *, bars: int = 8) -> Figure:
    """Draw a tolerance yield, and the constants with the largest influence on the yield.

    Left: fraction of hammers that print every pattern within limits, against the rate; or, for a single rate,
    the single-pulse dots of passing and failing hammers. Right: rank correlation of each constant with the
    safe rate, or with passing at the single rate; grey: range expected by chance.
    """
    figure = new_figure(3.6, 7.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1.0))
    if math.isnan(batch.rate):
        _rates(left, batch)
        outcome = np.nan_to_num(batch.safe_rates)
        title = "with the safe rate"
    else:
        _singles(left, batch)
        outcome = batch.passed.astype(float)
        title = "with passing"
    _correlations(right, batch, outcome, bars)
    heading(right, f"Rank correlation {title}")
    odd = int((batch.status != "ok").sum())
    remark = f"{odd} of {len(batch.status)} sampled hammers do not print." if odd else ""
    sign(figure, batch.hammer, remark)
    return figure


def _rates(ax: Axes, batch: ToleranceYield) -> None:
    shares = np.array([100.0 * batch.share_at(rate) for rate in batch.grid.tolist()])
    last = int(np.flatnonzero(shares > 0.0).max(initial=0)) + 2
    ax.step(batch.grid[:last], shares[:last], where="post", color=style.BLUE)
    ax.fill_between(batch.grid[:last], shares[:last], step="post", color=style.BLUE, alpha=0.15, lw=0.0)
    ax.set_ylim(0.0, 104.0)
    ax.set_xlabel("Slots per second  [Hz]")
    ax.set_ylabel("Hammers within limits at this rate and below  [%]")
    for share in (95.0, 50.0):
        ax.axhline(share, color=style.FAINT, lw=style.THIN, zorder=0)
    heading(ax, f"{len(batch.passed)} hammers")


def _singles(ax: Axes, batch: ToleranceYield) -> None:
    flights, forces = 1e6 * batch.single_flight_time, batch.single_force
    for which, colour, name in ((batch.passed, style.BLUE, "pass"), (~batch.passed, style.ORANGE, "fail")):
        dots(ax, flights[which], forces[which], 3.2, colour, alpha=0.8, label=f"{int(which.sum())} {name}")
    ax.set_xmargin(0.05)
    ax.set_xlabel("Single-pulse flight time  [µs]")
    ax.set_ylabel("Single-pulse force  [N]")
    ax.legend(fontsize=style.TINY, frameon=False, loc="best")
    share = f"{100.0 * batch.share:.1f} ± {100.0 * batch.share_error:.1f} %"
    heading(ax, f"{share} pass at {batch.rate:g} Hz")


def _correlations(ax: Axes, batch: ToleranceYield, outcome: np.ndarray, bars: int) -> None:
    from scipy.stats import rankdata

    ranks = rankdata(outcome)
    values = np.array([_correlation(rankdata(column), ranks) for column in batch.factors.T])
    order = np.argsort(-np.abs(values), kind="stable")[:bars]
    for height, k in enumerate(order.tolist()):
        ax.barh(height, values[k], height=0.62, color=style.BLUE if values[k] > 0.0 else style.ORANGE)
    chance = 2.0 / math.sqrt(len(outcome))
    ax.axvspan(-chance, chance, color=style.FAINT, alpha=0.6, lw=0.0, zorder=0)
    ax.axvline(0.0, color=style.INK, lw=style.THIN)
    ax.set_yticks(range(len(order)), [list(batch.spreads)[k] for k in order], fontsize=style.TINY)
    ax.set_ylim(max(len(order), 3) - 0.4, -0.6)
    ax.set_xlim(-1.0, 1.0)
    ax.tick_params(axis="y", length=0.0, labelcolor=style.MUTED)


def _correlation(first: np.ndarray, second: np.ndarray) -> float:
    apart = first - first.mean(), second - second.mean()
    size = math.sqrt(float((apart[0] ** 2).sum() * (apart[1] ** 2).sum()))
    return float((apart[0] * apart[1]).sum()) / size if size > 0.0 else 0.0
