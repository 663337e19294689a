"""Figure of a fit: data and law, residuals, their distribution, and correlation of the constants."""

from __future__ import annotations

from itertools import cycle
from textwrap import fill
from typing import Final, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.errors import InputError
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import beside, dots, heading, inside, note
from printhammer.figures.elements.scales import Name, Scale, label, scale
from printhammer.figures.elements.style import foot, new_figure, styled
from printhammer.identify.result import Fit
from printhammer.support.arrays import FloatArray

_COLOURS: Final = (style.BLUE, style.GREEN, style.YELLOW, style.INK, "#56b4e9", "#cc79a7", style.MUTED)
_KINDS: Final = {
    "displacement": "displacement",
    "gap": "displacement",
    "indentation": "displacement",
    "force": "force",
    "time": "time",
    "current": "current",
    "impact speed": "velocity",
    "rebound speed": "velocity",
}
"""Axis scale of each measured quantity, by name; other quantities are drawn as pure numbers."""

_MANY: Final = 400
"""Number of data points above which the points are drawn smaller; arbitrary."""

_LEGEND: Final = 8  # Largest number of entries in a legend; arbitrary
_NAMED: Final = 6
"""Largest number of outliers that are labelled with their line numbers; arbitrary."""


@styled
def plot(fit: Fit) -> Figure:
    """Draw a fit: data with the law, residuals, correlation and quantiles.

    Left: data with the law, residuals below; right: correlation of the constants, and residuals against
    normal quantiles. Rejected outliers are ringed.
    """
    if not len(fit.data):
        raise InputError(
            "the constants were computed without a table", key="table", expected="a fit to data to draw"
        )
    figure = new_figure(5.6, 7.6)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.6, 1.0), height_ratios=(1.35, 1.0))
    top, below = figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[1, 0])
    across = _scale(fit.axes[0][0], fit.abscissa)
    up = _scale(fit.axes[1][0], fit.data)
    _data(top, fit, across, up)
    _residuals(below, fit, across, up)
    if len(fit.keys) > 1:
        _correlation(figure.add_subplot(grid[0, 1]), fit)
        _quantiles(figure.add_subplot(grid[1, 1]), fit)
    else:
        _quantiles(figure.add_subplot(grid[:, 1]), fit)
    remark = fill(f"The data reject the law: {fit.rejected}.", 118) if fit.rejected else ""
    foot(figure, f"{fit.kind} · {' and '.join(fit.source)}", remark)
    return figure


def _scale(name: str, values: FloatArray) -> Scale:
    if name not in _KINDS:
        return Scale(name, "1", "1")
    return scale(cast(Name, _KINDS[name]), float(np.abs(values).max()))


def _size(fit: Fit) -> float:
    return 3.2 if len(fit.data) < _MANY else 1.0


def _data(ax: Axes, fit: Fit, across: Scale, up: Scale) -> None:
    x, measured, law = across.shown(fit.abscissa), up.shown(fit.data), up.shown(fit.fitted)
    for number, (name, colour) in enumerate(zip(fit.series_names, cycle(_COLOURS), strict=False)):
        mine = np.flatnonzero((fit.series == number) & ~fit.outliers)
        order = mine[np.argsort(x[mine], kind="stable")]
        dots(ax, x[order], measured[order], _size(fit), colour)
        if _is_curve(law[order]):
            ax.plot(x[order], law[order], lw=style.THIN, color=colour, label=name)
        else:
            ax.plot(x[order], law[order], ls="none", marker="_", ms=5.0, color=colour, label=name)
    _ring(ax, fit, x, measured)
    if len(fit.series_names) <= _LEGEND:
        columns = 1 + (len(fit.series_names) > 4)
        ax.legend(fontsize=style.TINY, loc="best", ncols=columns, framealpha=0.85, edgecolor="none")
    label(ax, "x", across, fit.axes[0][0].capitalize())
    label(ax, "y", up, fit.axes[1][0].capitalize())
    ax.margins(0.03, 0.06)


def _is_curve(values: FloatArray) -> bool:
    """Whether the fitted values, sorted by the abscissa, form a single curve rather than several."""
    return float(np.abs(np.diff(values)).sum()) <= 4.0 * float(np.ptp(values)) if len(values) > 1 else False


def _residuals(ax: Axes, fit: Fit, across: Scale, up: Scale) -> None:
    x, residuals = across.shown(fit.abscissa), up.shown(fit.residuals)
    ax.axhline(0.0, color=style.MUTED, lw=style.HAIR, zorder=1.0)
    used = ~fit.outliers
    half = 1.96 * float(up.shown(fit.residual_scale)) * _spread(fit)
    order = np.argsort(x[used], kind="stable")
    if np.ptp(half) == 0.0:
        ax.axhspan(-half[0], half[0], color=style.FAINT, alpha=0.6, lw=0.0, zorder=0.5)
    else:
        reach = half[used][order]
        ax.vlines(x[used][order], -reach, reach, color=style.FAINT, lw=2.4, zorder=0.5)
    for number, colour in zip(range(len(fit.series_names)), cycle(_COLOURS), strict=False):
        mine = used & (fit.series == number)
        dots(ax, x[mine], residuals[mine], _size(fit), colour)
    top = 1.15 * max(float(np.abs(residuals[used]).max()), float(half[used].max())) or 1.0
    inside = fit.outliers & (np.abs(residuals) <= top)
    _ring(ax, fit, x, np.clip(residuals, -0.9 * top, 0.9 * top))
    ax.set_ylim(-top, top)
    beyond = int(fit.outliers.sum()) - int(inside.sum())
    if beyond:
        corner = {"ha": "right", "va": "bottom", "color": style.ORANGE, "fontsize": style.TINY}
        note(ax, f"{beyond} beyond", (0.98, 0.05), **corner)
    label(ax, "x", across, fit.axes[0][0].capitalize())
    label(ax, "y", up, "Data − law")
    ax.margins(x=0.03)


def _spread(fit: Fit) -> FloatArray:
    """Compute the standard deviation of each datum, normalised by the RMS over all data except outliers."""
    used = ~fit.outliers
    spread = 1.0 / np.sqrt(fit.weights)
    return np.asarray(spread / np.sqrt(np.mean(spread[used] ** 2)))


def _ring(ax: Axes, fit: Fit, x: FloatArray, y: FloatArray) -> None:
    rows = np.flatnonzero(fit.outliers)
    dots(ax, x[rows], y[rows], 5.0, style.BLUE, mew=0.9, mfc="none", mec=style.ORANGE, zorder=4.0)
    if len(rows) <= _NAMED and len(fit.lines):
        for row in rows:
            beside(ax, f"line {fit.lines[row]}", (float(x[row]), float(y[row])), (5, -2), color=style.ORANGE)


def _correlation(ax: Axes, fit: Fit) -> None:
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("correlation", [style.BLUE, "white", style.ORANGE])
    correlation = fit.correlation
    n = len(fit.keys)
    ax.imshow(correlation, vmin=-1.0, vmax=1.0, cmap=colours, aspect="equal")
    for row in range(n):
        for column in range(n):
            value = float(correlation[row, column])
            shade = "white" if abs(value) > 0.7 else style.INK
            inside(ax, f"{round(value, 2) + 0.0:.2f}", column, row, shade)
    names = [_short(key) for key in fit.keys]
    ax.set_xticks(range(n), names, fontsize=style.TINY, rotation=30.0, ha="right", rotation_mode="anchor")
    ax.set_yticks(range(n), names, fontsize=style.TINY)
    ax.tick_params(length=0.0)
    heading(ax, "Correlation")


def _short(key: str) -> str:
    """Shorten the key of a constant for the label of the correlation matrix."""
    plain = key if " " in key else key.rpartition(".")[2]
    for section in ("magnet.", "spring.", "backstop."):
        plain = plain.replace(section, "")
    return fill(plain, 16)


def _quantiles(ax: Axes, fit: Fit) -> None:
    """Draw sorted residuals, in standard deviations, against normal quantiles."""
    from scipy.stats import norm

    used = ~fit.outliers
    scale_of = fit.residual_scale * _spread(fit)[used]
    ordered = np.sort(fit.residuals[used] / np.where(scale_of > 0.0, scale_of, 1.0))
    at = norm.ppf((np.arange(1, len(ordered) + 1) - 0.375) / (len(ordered) + 0.25))
    end = 1.1 * max(float(np.abs(ordered).max()), float(np.abs(at).max()))
    ax.plot([-end, end], [-end, end], color=style.MUTED, lw=style.HAIR)
    dots(ax, at, ordered, 0.8 * _size(fit) + 0.4, style.BLUE)
    ax.set(xlim=(-end, end), ylim=(-end, end))
    ax.set_aspect("equal")
    ax.set_xlabel("Normal quantile")
    ax.set_ylabel("Residual / standard deviation")
    ax.tick_params(top=True, right=True)
