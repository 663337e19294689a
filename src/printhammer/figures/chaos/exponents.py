"""Figures of Lyapunov exponents: running estimates of a train, charts of many trains, and the 0-1 test.

`plot_correlation` draws correlation sums and their local slopes against the distance, with the plateau.

`plot_finite_time` draws histograms of the finite-time exponents of a train, one per averaging length.

`plot_recurrence` draws a recurrence plot and lists its quantities.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.chaos import (
    CorrelationDimension,
    FiniteTime,
    Lyapunov,
    LyapunovChart,
    Recurrence,
    ZeroOne,
)
from printhammer.chaos.exponents.zero_one import CHAOTIC, REGULAR
from printhammer.figures.chaos.strobe import shown_period
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import HALO, beside, dashed, dots, heading, note
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import (
    BLUE,
    INK,
    MUTED,
    ORANGE,
    SMALL,
    new_figure,
    new_panel,
    sign,
    styled,
)
from printhammer.support.arrays import FloatArray

_COLOURS: Final = (style.BLUE, style.ORANGE)
_SIGMAS: Final = 3.0
"""Half-width of bands and error bars, in standard errors, as in the test of an exponent's sign."""


@styled
def plot(spectrum: Lyapunov) -> Figure:
    """Draw the running estimates of both Lyapunov exponents of a train against the number of firings.

    Bands are three standard errors wide on either side.
    """
    figure = new_figure(4.6)
    upper, lower = figure.subplots(2, 1, sharex=True)
    counts, means, errors = spectrum.running()
    for k, (ax, colour) in enumerate(zip((upper, lower), _COLOURS, strict=True)):
        _running(ax, counts, means[:, k], errors[:, k], colour)
        ax.set_ylabel(f"$\\lambda_{k + 1}$  [1/firing]")
        value, error = float(spectrum.exponents[k]), float(spectrum.standard_errors[k])
        low, high = ax.get_ylim()
        at, side = ((0.98, 0.96), "top") if value < 0.5 * (low + high) else ((0.98, 0.05), "bottom")
        note(ax, f"{value:+.4g} ± {error:.2g}", at, ha="right", va=side, color=colour, bbox=HALO)
    upper.axhline(0.0, color=style.MUTED, lw=style.HAIR, zorder=1.0, gid="zero")
    lower.set_xlabel("Number of firings averaged over")
    lower.set_xscale("log")
    # Set the limits even if no estimate is finite.
    lower.set_xlim(max(0.9 * float(counts[0]), 0.5), 1.1 * float(counts[-1]))
    heading(upper, _title(spectrum))
    remarks = [] if spectrum.ok else [f"The run ended early: {spectrum.status}."]
    if not spectrum.smooth:
        remarks.append("The armature touches a surface at zero velocity, where the motion has no derivative.")
    sign(figure, spectrum.hammer, *remarks)
    return figure


def _title(spectrum: Lyapunov) -> str:
    parts = [shown_period(spectrum.period), spectrum.verdict.name.replace("-", " ")]
    if not math.isnan(spectrum.dimension):
        error = f" ± {spectrum.dimension_error:.1g}" if spectrum.dimension_error else ""
        parts.append(f"dimension {spectrum.dimension:.4g}{error}")
    if spectrum.zero_one is not None:
        parts.append(f"0-1 test: {spectrum.zero_one.verdict}")
    return ", ".join(parts)


def _running(ax: Axes, counts: Any, means: FloatArray, errors: FloatArray, colour: str) -> None:
    known = np.isfinite(means)
    ax.plot(counts[known], means[known], color=colour, lw=style.LINE, gid="running", zorder=3.0)
    sure = known & np.isfinite(errors)
    reach = _SIGMAS * errors[sure]
    band = (means[sure] - reach, means[sure] + reach)
    ax.fill_between(counts[sure], *band, color=colour, alpha=0.18, lw=0.0, zorder=2.0, gid="band")
    # Estimates over the first few firings are meaningless and do not set the limits.
    settled = sure & (counts >= counts[-1] // 20)
    if settled.any():
        low = float((means - _SIGMAS * np.where(sure, errors, 0.0))[settled].min())
        high = float((means + _SIGMAS * np.where(sure, errors, 0.0))[settled].max())
        room = max(0.25 * (high - low), 0.02 * max(abs(low), abs(high)), 1e-6)
        ax.set_ylim(low - room, high + room)
    ax.tick_params(axis="both", which="both", top=True, right=True)


@styled
def plot_chart(chart: LyapunovChart) -> Figure:
    """Draw both Lyapunov exponents and K of the 0-1 test of many trains against the firing period.

    Error bars extend three standard errors on either side. Open marks are trains for which the exponent and
    the 0-1 test disagree, or either is undecided.
    """
    figure = new_figure(6.0)
    grid = figure.add_gridspec(3, 1, height_ratios=(3.0, 2.0, 2.0), hspace=0.04)
    axes = [figure.add_subplot(grid[0])]
    axes += [figure.add_subplot(grid[row], sharex=axes[0]) for row in (1, 2)]
    time = scale("time", float(chart.period.max()))
    at = time.shown(chart.period)
    order = np.argsort(at, kind="stable")
    agree = np.array([a == b != "undecided" for a, b in zip(chart.growth, chart.zero_one, strict=True)])
    for k, (ax, colour) in enumerate(zip(axes, _COLOURS, strict=False)):
        _bars(ax, at, chart.exponents[:, k], chart.standard_errors[:, k], colour, agree, order)
        ax.set_ylabel(f"$\\lambda_{k + 1}$  [1/firing]")
    axes[0].axhline(0.0, color=style.MUTED, lw=style.HAIR, zorder=1.0, gid="zero")
    _bars(axes[2], at, chart.k, np.zeros(len(at)), style.INK, agree, order)
    dashed(axes[2].axhline, REGULAR, CHAOTIC, zorder=1.0)
    axes[2].set_ylim(-0.25, 1.15)
    axes[2].set_ylabel("K of the 0-1 test")
    label(axes[2], "x", time, "Time between firings")
    for ax in axes[:2]:
        ax.tick_params(labelbottom=False)
    for ax in axes:
        ax.tick_params(axis="both", top=True, right=True)
    width = float(at.max() - at.min()) or 0.1 * float(at.max())
    axes[0].set_xlim(float(at.min()) - 0.04 * width, float(at.max()) + 0.04 * width)
    sign(figure, chart.hammer, *_remarks(chart, agree))
    return figure


def _bars(
    ax: Axes, at: FloatArray, values: FloatArray, errors: FloatArray, colour: str, agree: Any, order: Any
) -> None:
    finite = np.isfinite(values)
    joined = order[finite[order]]
    ax.plot(at[joined], values[joined], color=style.FAINT, lw=style.THIN, zorder=1.5)
    reach = _SIGMAS * np.where(np.isfinite(errors), errors, 0.0)
    for filled in (True, False):
        some = finite & (agree == filled)
        mark: dict[str, Any] = {"ms": 3.5, "mew": 0.9, "mec": colour, "mfc": colour if filled else "white"}
        bar: dict[str, Any] = {"yerr": reach[some], "ecolor": colour, "elinewidth": style.THIN}
        ax.errorbar(at[some], values[some], fmt="o", zorder=3.0, **mark, **bar)


def _remarks(chart: LyapunovChart, agree: Any) -> list[str]:
    remarks = []
    other = int(np.count_nonzero(~agree))
    if other:
        remarks.append(
            f"{other} of {len(agree)} trains (open marks): exponent and 0-1 test differ, or one is undecided."
        )
    infinite = int(np.count_nonzero(np.isneginf(chart.exponents[:, 0])))
    if infinite:
        remarks.append(
            f"{infinite} trains forget their past altogether: exponents minus infinity, not drawn."
        )
    stopped = sum(status != "ok" for status in chart.status)
    if stopped:
        remarks.append(f"{stopped} runs ended early.")
    return remarks


@styled
def plot_zero_one(test: ZeroOne) -> Figure:
    """Draw the data of a 0-1 test: translation variables, mean square displacement, and correlations.

    The path of the translation variables (p, q) and their mean square displacement are those for the angle
    with the median correlation, which is ringed in the right panel.
    """
    figure = new_figure(2.9)
    path, growth, angles = figure.subplots(1, 3)
    path.plot(test.p, test.q, color=style.BLUE, lw=style.HAIR, gid="path")
    path.set(xlabel="$p_c$", ylabel="$q_c$")
    path.margins(0.06)
    path.set_aspect("equal", adjustable="datalim")
    steps = np.arange(1, len(test.displacement) + 1)
    growth.plot(steps, test.displacement, color=style.BLUE, lw=style.THIN, gid="displacement")
    growth.set(xlabel="Steps n", ylabel="Mean square displacement")
    dots(angles, test.angles, test.correlations, 2.4, style.BLUE, gid="k")
    ringed = test.angles[test.shown], test.correlations[test.shown]
    angles.plot(*ringed, marker="o", ms=7.0, mfc="none", mec=style.ORANGE)
    dashed(angles.axhline, REGULAR, CHAOTIC)
    angles.set(xlabel="Angle c  [rad]", ylabel="Correlation $K_c$", ylim=(-1.1, 1.1))
    for ax in (path, growth, angles):
        ax.tick_params(axis="both", top=True, right=True)
        ax.ticklabel_format(axis="both", style="sci", scilimits=(-3, 4))
        ax.locator_params(axis="both", nbins=5)
    figure.suptitle(f"0-1 test: {test.phrase}: {test.verdict}", x=0.01, ha="left", fontsize=style.SMALL)
    if test.reason:
        figure.supxlabel(test.reason, x=0.01, ha="left", fontsize=style.SMALL, color=style.ORANGE)
    return figure


@styled
def plot_correlation(correlation: CorrelationDimension) -> Figure:
    """Draw correlation sums, their local slopes below, and the dimension if there is a plateau."""
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


_BINS: Final = 60  # Bins of a histogram; arbitrary


@styled
def plot_finite_time(finite: FiniteTime) -> Figure:
    """Draw histograms of finite-time exponents, one per averaging length, and the exponent of the train."""
    figure, ax = new_panel(4.2)
    ends = min(row.min() for row in finite.values), max(row.max() for row in finite.values)
    bins = np.linspace(*ends, _BINS + 1).tolist() if ends[0] < ends[1] else _BINS
    for length, row in zip(finite.lengths, finite.values, strict=True):
        ax.hist(row, bins, density=True, histtype="step", lw=1.1, label=f"{length} firings")
    ax.axvline(float(finite.lyapunov.exponents[0]), color=INK, lw=0.9)
    ax.set(xlabel="Finite-time exponent  [1/firing]", ylabel="Density")
    ax.legend(frameon=False)
    heading(ax, "Finite-time exponents; line: exponent of the whole train")
    sign(figure, finite.lyapunov.hammer)
    return figure


_NAMES: Final = {
    "rate": "recurrence rate",
    "determinism": "determinism",
    "mean_diagonal": "mean diagonal",
    "longest_diagonal": "longest diagonal",
    "entropy": "entropy",
    "laminarity": "laminarity",
    "trapping": "trapping time",
    "longest_vertical": "longest vertical",
}


@styled
def plot_recurrence(recurrence: Recurrence) -> Figure:
    """Draw a recurrence plot: a point for each pair of states closer than the threshold.

    The quantities of the recurrence quantification analysis are listed beside the plot.
    """
    from matplotlib.colors import ListedColormap

    figure, ax = new_panel(4.6)
    count = len(recurrence.matrix)
    ax.imshow(
        recurrence.matrix,
        origin="lower",
        cmap=ListedColormap(["white", INK]),
        vmin=0,
        vmax=1,
        extent=(0.5, count + 0.5, 0.5, count + 0.5),
        # Average if there are more points than pixels, so that no line vanishes.
        interpolation="antialiased",
        interpolation_stage="rgba",
    )
    ax.set(xlabel="Index of the state", ylabel="Index of the state")
    ax.tick_params(axis="both", top=True, right=True)
    lines = [f"threshold  {recurrence.threshold:.3g}"]
    lines += [f"{_NAMES[name]}  {_shown(value)}" for name, value in recurrence.quantities.items()]
    how = {"xycoords": "axes fraction", "fontsize": SMALL, "linespacing": 1.7}
    beside(ax, "\n".join(lines), (1.0, 1.0), (8, 0), "left top", **how)
    return figure


def _shown(value: float) -> str:
    if isinstance(value, int):
        return str(value)
    return "–" if math.isnan(value) else f"{value:.3g}"
