"""Tolerance yield: how the safe rates of a production are spread, and what makes a hammer fail."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import dots, heading
from printhammer.figures.elements.style import new_figure, sign, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.printing.rates.tolerance import ToleranceYield


@styled
def plot(batch: ToleranceYield, *, bars: int = 8) -> Figure:
    """Draw a tolerance yield, with the constants that matter most.

    Left: the part of the hammers that print every pattern well up to a rate, or, of one rate, the
    single-pulse dots of those that pass and of those that do not. Right: the rank correlation of each
    constant with the safe rate, or with passing; grey: what chance does.
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
    remark = f"{odd} of {len(batch.status)} draws make no hammer that prints." if odd else ""
    sign(figure, batch.hammer, remark)
    return figure


def _rates(ax: Axes, batch: ToleranceYield) -> None:
    shares = np.array([100.0 * batch.share_at(rate) for rate in batch.grid.tolist()])
    last = int(np.flatnonzero(shares > 0.0).max(initial=0)) + 2
    ax.step(batch.grid[:last], shares[:last], where="post", color=style.BLUE)
    ax.fill_between(batch.grid[:last], shares[:last], step="post", color=style.BLUE, alpha=0.15, lw=0.0)
    ax.set_ylim(0.0, 104.0)
    ax.set_xlabel("Slots per second  [Hz]")
    ax.set_ylabel("Hammers that print well up to here  [%]")
    for share in (95.0, 50.0):
        ax.axhline(share, color=style.FAINT, lw=style.THIN, zorder=0)
    heading(ax, f"{len(batch.passed)} hammers")


def _singles(ax: Axes, batch: ToleranceYield) -> None:
    flights, forces = 1e6 * batch.single_flight_time, batch.single_force
    for which, colour, name in ((batch.passed, style.BLUE, "pass"), (~batch.passed, style.ORANGE, "do not")):
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
