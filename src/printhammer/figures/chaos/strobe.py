"""Figures of strobe points in the plane of displacement and velocity: one train, or a panel of Fig. 11.

`plot_section` draws an impact map: velocity at touch against the time since the last firing.

`plot_train` draws histogram, return map and autocorrelation of the intervals between impacts.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.chaos import ImpactTrain, Section, Strobe
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import HALO, dashed, dots, freest, heading, note
from printhammer.figures.elements.scales import Scale, label, scale
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
from printhammer.run.regime import Window
from printhammer.units import from_si

_FEW: Final = 20
"""Smallest number of points for which an inset is drawn; arbitrary."""
_CYCLE: Final = 8
"""Largest period, in firings, whose points are marked by rings; arbitrary."""

_SMALL: Final = 0.04
"""Area of an aperiodic attractor, relative to the window, below which an inset enlarges it; arbitrary."""
# Lower left corners of an inset, fractions of the axes, best first; arbitrary
_PLACES: Final = ((0.55, 0.36), (0.06, 0.36), (0.06, 0.06), (0.55, 0.06))
_INSET: Final = (0.38, 0.42)
"""Width and height of an inset, as fractions of the axes; arbitrary."""

RING: Final[dict[str, Any]] = {
    "ls": "none",
    "marker": "o",
    "ms": 6.0,
    "mew": 0.9,
    "mfc": "none",
    "mec": style.ORANGE,
}
"""Style of the rings around the last points of a periodic train."""


@styled
def plot(strobe: Strobe, *, fit: bool = False) -> Figure:
    """Draw strobe points: velocity against displacement, with the backstop and the classification.

    Rings mark the last points of a periodic train. With `fit`, the axes limits follow the points instead of
    the window of Fig. 11.
    """
    figure, ax = new_panel(4.6)
    window = _close(strobe) if fit else strobe.window
    way, speed = scales_of(window)
    panel(ax, strobe, window, way, speed, size=2.2, named=False)
    judged = "" if strobe.verdict is None else f": {strobe.verdict.name.replace('-', ' ')}"
    heading(ax, f"{shown_period(strobe.period)}{judged}")
    label(ax, "x", way)
    label(ax, "y", speed)
    remarks = [] if strobe.ok else [f"The run ended early: {strobe.status}."]
    if strobe.verdict is not None and strobe.verdict.reason:
        remarks.append(f"Undecided: {strobe.verdict.reason}.")
    sign(figure, strobe.hammer, *remarks)
    return figure


def _close(strobe: Strobe) -> Window:
    """Return a window that fits the points; without points, the window of the hammer."""
    known = np.isfinite(strobe.x)
    if not known.any():
        return strobe.window
    ends = []
    for values, half in zip((strobe.x[known], strobe.v[known]), strobe.window.half_widths, strict=True):
        low, high = float(values.min()), float(values.max())
        room = 0.08 * (high - low) or 1e-3 * float(half)
        ends.append((low - room, high + room))
    return Window(*ends)


def scales_of(window: Window) -> tuple[Scale, Scale]:
    """Return the axis scales of displacement and velocity for a plot of a strobe window."""
    return scale("displacement", max(abs(end) for end in window.x)), scale("velocity")


def panel(
    ax: Axes,
    strobe: Strobe,
    window: Window,
    way: Scale,
    speed: Scale,
    size: float,
    *,
    named: bool = True,
    printed: str = "",
) -> None:
    """Draw the strobe points of a train inside a window; write the number of points outside the window.

    `size` is the diameter of a marker, in points. If `named`, strobe time and classification are written into
    the panel; `printed` is the classification in the paper, which is added if it differs from the computed
    classification.
    """
    ax.set_xlim(*(float(way.shown(end)) for end in window.x))
    ax.set_ylim(*(float(speed.shown(end)) for end in window.v))
    if strobe.hammer.position is not None:
        at = float(way.shown(strobe.hammer.position))
        ax.axvline(at, color=style.MUTED, lw=style.HAIR, zorder=1.0, gid="backstop")
    x, v = way.shown(strobe.x), speed.shown(strobe.v)
    dots(ax, x, v, size, style.BLUE, gid="points", zorder=3.0)
    judged = strobe.verdict
    if judged is not None and judged.period is not None and judged.period <= min(_CYCLE, len(x)):
        cycle = slice(len(x) - judged.period, None)
        ax.plot(x[cycle], v[cycle], **{**RING, "ms": size + 4.0}, gid="cycle", zorder=4.0)
    _draw_inset(ax, strobe, window, way, speed, size)
    if named:
        note(ax, shown_period(strobe.period), (0.97, 0.96), ha="right", color=style.INK)
    if named and judged is not None:
        note(ax, judged.name.replace("-", " "), (0.97, 0.04), ha="right", va="bottom", bbox=HALO)
        if printed and printed != judged.name:
            text = f"paper: {printed.replace('-', ' ')}"
            note(ax, text, (0.97, 0.15), ha="right", va="bottom", fontsize=style.TINY, bbox=HALO)
    outside = int(np.count_nonzero(np.isfinite(strobe.x) & ~window.inside(strobe.x, strobe.v)))
    if outside:
        note(ax, f"{outside} outside", (0.97, 0.86), ha="right", fontsize=style.TINY)


def _draw_inset(ax: Axes, strobe: Strobe, window: Window, way: Scale, speed: Scale, size: float) -> None:
    """Draw an inset that enlarges the attractor of an aperiodic train if the attractor is small.

    The first half of the points is ignored, since it may be a transient.
    """
    judged = strobe.verdict
    later = slice(len(strobe.x) // 2, None)
    x, v = strobe.x[later], strobe.v[later]
    inside = np.isfinite(x) & window.inside(x, v)
    if judged is None or judged.period is not None or inside.sum() < _FEW:
        return
    width, height = (float(np.ptp(values[inside])) for values in (x, v))
    whole = (window.x[1] - window.x[0]) * (window.v[1] - window.v[0])
    if not 0.0 < width * height < _SMALL * whole:
        return
    shown = np.column_stack(
        [
            (strobe.x - window.x[0]) / (window.x[1] - window.x[0]),
            (strobe.v - window.v[0]) / (window.v[1] - window.v[0]),
        ]
    )
    corner, _covered = freest(shown[np.isfinite(shown).all(axis=1)], _INSET, _PLACES)
    inset = ax.inset_axes((*corner, *_INSET), zorder=5.0)
    inset.set_gid("attractor")
    dots(inset, way.shown(x[inside]), speed.shown(v[inside]), 0.6 * size, style.BLUE, gid="attractor")
    inset.margins(0.08)
    inset.set(xticks=[], yticks=[])
    ax.indicate_inset_zoom(inset, edgecolor=style.MUTED, lw=style.HAIR, alpha=1.0)


def shown_period(period: float) -> str:
    """Format a strobe time [s] in ms with two decimals if that is exact, else with more digits."""
    number = from_si(period, "s", "ms")
    short = f"{number:.2f}"
    return f"{short if math.isclose(float(short), number, rel_tol=1e-9) else f'{number:.6g}'} ms"


@styled
def plot_section(section: Section) -> Figure:
    """Draw an impact map: velocity at the impacts on a surface against the time since the last firing.

    The time axis covers the whole period.
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
    """Draw the statistics of the intervals between the impacts of a train.

    The panels show the histogram of the intervals, each interval against the preceding interval, and the
    autocorrelation, which for independent intervals lies between the dashed lines at 19 of 20 lags.
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
    returns.set(
        xlabel=f"Interval  [{time.sign}]", ylabel=f"Next interval  [{time.sign}]", xlim=ends, ylim=ends
    )
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
