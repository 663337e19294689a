"""What bursts of least work cost against the rate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.figures.elements import style
from printhammer.figures.elements.scales import Scale, label
from printhammer.figures.elements.style import new_figure, sign, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.control.least_work.rates import LeastWorkRates


@styled
def plot(found: LeastWorkRates) -> Figure:
    """Draw net and positive work, and the least positive work of any current, against the rate.

    Crosses at the bottom: rates at which no current was found.
    """
    figure = new_figure(3.6)
    ax = figure.add_subplot()
    across = Scale("Rate", "Hz", "Hz")
    rates = across.shown(found.rates)
    ax.plot(
        rates, found.positive_ratio, "o-", color=style.ORANGE, lw=style.LINE, ms=4.0, label="positive work W+"
    )
    ax.plot(
        rates,
        found.bound_ratio,
        color=style.INK,
        lw=style.THIN,
        ls=(0, (4, 3)),
        label="least W+ of any current",
    )
    ax.plot(rates, found.net_ratio, "s-", color=style.BLUE, lw=style.LINE, ms=4.0, label="net work W")
    missing = found.status != "ok"
    if missing.any():
        ax.plot(rates[missing], [0.04] * int(missing.sum()), "x", color=style.MUTED, label="no current found")
    ax.set_ylim(bottom=0.0)
    ax.set_ylabel("Work over what the pack absorbs")
    label(ax, "x", across)
    ax.legend(fontsize=style.SMALL, loc="lower right", frameon=False)
    ax.set_title(f"Bursts of {found.count} dots", loc="left", fontsize=style.SMALL)
    ax.margins(x=0.03)
    sign(figure, found.hammer)
    return figure
