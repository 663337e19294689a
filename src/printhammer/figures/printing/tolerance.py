"""Tolerance yield: how the safe rates of a production are spread, and what makes a hammer fail."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.style import new_figure, sign, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.printing.rates.tolerance import ToleranceYield


@styled
def plot(found: ToleranceYield, *, bars: int = 8) -> Figure:
    """Draw a tolerance yield.

    Left: the part of the hammers that print every pattern well up to a rate, or, of one rate, the
    single-pulse dots of those that pass and of those that do not. Right: the rank correlation of each
    constant with the safe rate, or with passing; grey: what chance does.

    Parameters
    ----------
    bars : int, optional
        Largest number of constants shown.
    """
    figure = new_figure(3.6, 7.4)
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1.0))
    if math.isnan(found.rate):
        _rates(left, found)
        outcome = np.nan_to_num(found.safe_rates)
        title = "with the safe rate"
    else:
        _singles(left, found)
        outcome = found.passed.astype(float)
        title = "with passing"
    _correlations(right, found, outcome, bars)
    right.set_title(f"Rank correlation {title}", loc="left", fontsize=style.SMALL)
    odd = int((found.status != "ok").sum())
    sign(
        figure, found.hammer, f"{odd} of {len(found.status)} draws make no hammer that prints." if odd else ""
    )
    return figure


def _rates(ax: Axes, found: ToleranceYield) -> None:
    shares = np.array([100.0 * found.share_at(rate) for rate in found.grid.tolist()])
    last = int(np.flatnonzero(shares > 0.0).max(initial=0)) + 2
    ax.step(found.grid[:last], shares[:last], where="post", color=style.BLUE)
    ax.fill_between(found.grid[:last], shares[:last], step="post", color=style.BLUE, alpha=0.15, lw=0.0)
    ax.set_ylim(0.0, 104.0)
    ax.set_xlabel("Slots per second  [Hz]")
    ax.set_ylabel("Hammers that print well up to here  [%]")
    for share in (95.0, 50.0):
        ax.axhline(share, color=style.FAINT, lw=style.THIN, zorder=0)
    told = f"{len(found.passed)} hammers"
    ax.set_title(told, loc="left", fontsize=style.SMALL)


def _singles(ax: Axes, found: ToleranceYield) -> None:
    for which, colour, name in ((found.passed, style.BLUE, "pass"), (~found.passed, style.ORANGE, "do not")):
        ax.plot(
            1e6 * found.single_flight_time[which],
            found.single_force[which],
            "o",
            ms=3.2,
            mew=0.0,
            alpha=0.8,
            color=colour,
            label=f"{int(which.sum())} {name}",
        )
    ax.set_xmargin(0.05)
    ax.set_xlabel("Single-pulse flight time  [µs]")
    ax.set_ylabel("Single-pulse force  [N]")
    ax.legend(fontsize=style.TINY, frameon=False, loc="best")
    share = f"{100.0 * found.share:.1f} ± {100.0 * found.share_error:.1f} % pass at {found.rate:g} Hz"
    ax.set_title(share, loc="left", fontsize=style.SMALL)


def _correlations(ax: Axes, found: ToleranceYield, outcome: np.ndarray, bars: int) -> None:
    ranks = _ranks(outcome)
    values = np.array([_correlation(_ranks(column), ranks) for column in found.factors.T])
    order = np.argsort(-np.abs(values), kind="stable")[:bars]
    for height, k in enumerate(order.tolist()):
        ax.barh(height, values[k], height=0.62, color=style.BLUE if values[k] > 0.0 else style.ORANGE)
    chance = 2.0 / math.sqrt(len(outcome))
    ax.axvspan(-chance, chance, color=style.FAINT, alpha=0.6, lw=0.0, zorder=0)
    ax.axvline(0.0, color=style.INK, lw=style.THIN)
    ax.set_yticks(range(len(order)), [list(found.spreads)[k] for k in order], fontsize=style.TINY)
    ax.set_ylim(max(len(order), 3) - 0.4, -0.6)
    ax.set_xlim(-1.0, 1.0)
    ax.tick_params(axis="y", length=0.0, labelcolor=style.MUTED)


def _ranks(values: np.ndarray) -> np.ndarray:
    """Return ranks; equal values share theirs."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    return (ends - 0.5 * (counts - 1.0))[place]


def _correlation(first: np.ndarray, second: np.ndarray) -> float:
    apart = first - first.mean(), second - second.mean()
    size = math.sqrt(float((apart[0] ** 2).sum() * (apart[1] ** 2).sum()))
    return float((apart[0] * apart[1]).sum()) / size if size > 0.0 else 0.0
