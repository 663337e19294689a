"""Bursts of least work: motion, current and energies of one, and what they cost against the rate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import beside, heading, legend_above
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import new_figure, new_panel, sign, styled
from printhammer.figures.elements.timeline import between_surfaces, current_between
from printhammer.run.energy import coil_power

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.control.least_work.burst import LeastWork
    from printhammer.control.least_work.rates import LeastWorkRates

_AFTER: Final = 0.08


@styled
def plot(burst: LeastWork) -> Figure:
    """Draw a burst of least work.

    Above: displacement, current, and the power of the coil, filled where it gives and where it takes back.
    Below: the work of the coil and the losses, in parts of what the pack absorbs.
    """
    figure = new_figure(6.6)
    grid = figure.add_gridspec(4, 1, height_ratios=(2.6, 1.2, 1.4, 1.3))
    motion = figure.add_subplot(grid[0])
    current = figure.add_subplot(grid[1], sharex=motion)
    power = figure.add_subplot(grid[2], sharex=motion)
    run, hammer = burst.motion, burst.hammer
    assert hammer.front is not None
    between_surfaces(motion, hammer, run, 2.2)
    ms, um = scale("time").factor, scale("displacement").factor
    for contact, force in zip(burst.contacts, burst.forces.tolist(), strict=True):
        place = (ms * contact.t_peak, um * (hammer.front + contact.depth))
        beside(motion, f"{force:.3f}", place, (0.0, 3.0), "center baseline")
    heading(motion, f"{len(burst.contacts)} dots at {burst.rate:.6g} Hz, force over that of a single pulse")
    current_between(current, run, burst.largest)
    span = 1.15 * burst.largest
    current.set_ylim(min(1.15 * float(run.current.min()), -0.2 * span), span)
    watts = coil_power(hammer, run.x, run.v, run.force["magnet"])
    power.fill_between(
        ms * run.t,
        np.maximum(watts, 0.0),
        0.0,
        color=style.ORANGE,
        lw=0.0,
        label="the coil gives",
        gid="given",
    )
    power.fill_between(
        ms * run.t, np.minimum(watts, 0.0), 0.0, color=style.GREEN, lw=0.0, gid="taken back"
    ).set_label("the coil takes back")
    legend_above(power, power.get_legend_handles_labels()[0])
    power.set_ylabel("Coil power  [W]")
    power.set_xlabel("Time  [ms]")
    motion.set_xlim(0.0, ms * min((1.0 + _AFTER) * burst.rest_time, run.end))
    for ax in (motion, current):
        ax.tick_params(axis="x", labelbottom=False)
    _ledger(figure.add_subplot(grid[3]), burst)
    few = burst.adequate < burst.count
    sign(figure, hammer, f"{burst.adequate} of {burst.count} dots are adequate." if few else "")
    return figure


def _ledger(ax: Axes, burst: LeastWork) -> None:
    absorbed = burst.ledger.pack_loss
    if not absorbed > 0.0:
        ax.text(0.5, 0.5, "The pack absorbed nothing.", ha="center", va="center", transform=ax.transAxes)
        ax.set_axis_off()
        return
    bars = [
        ("absorbed by the pack", 1.0, style.YELLOW),
        ("net work W", burst.net_ratio, style.BLUE),
        ("positive work W+", burst.positive_ratio, style.ORANGE),
        ("W, single pulses", burst.single_ratio, style.MUTED),
        ("lost at the backstop", burst.ledger.backstop_loss / absorbed, style.SURFACES["backstop"]),
    ]
    rows = np.arange(len(bars))[::-1]
    longest = max(value for _name, value, _colour in bars)
    ax.barh(rows, [value for _, value, _ in bars], color=[colour for *_, colour in bars], height=0.66)
    for row, (_name, value, _colour) in zip(rows.tolist(), bars, strict=True):
        ax.text(
            value + 0.01 * longest, row, f"{round(value, 3) + 0.0:.3f}", va="center", fontsize=style.SMALL
        )
    ends = [rows[2] - 0.45, rows[2] + 0.45]
    ax.plot([burst.bound_ratio] * 2, ends, color=style.INK, lw=style.LINE, gid="least positive work")
    ax.set_yticks(rows, [name for name, *_ in bars], fontsize=style.SMALL)
    ax.set_xlim(0.0, 1.1 * longest)
    ax.set_xlabel("Energy over what the pack absorbs (line: least W+ of any current)")


@styled
def plot_rates(bursts: LeastWorkRates) -> Figure:
    """Draw net and positive work, and the least positive work of any current, against the rate.

    Crosses at the bottom: rates at which no current was found.
    """
    figure, ax = new_panel(3.6)
    across = Scale("Rate", "Hz", "Hz")
    rates = across.shown(bursts.rates)
    thick: dict[str, Any] = {"lw": style.LINE, "ms": 4.0}
    ax.plot(rates, bursts.positive_ratio, "o-", color=style.ORANGE, label="positive work W+", **thick)
    least = "least W+ of any current"
    ax.plot(rates, bursts.bound_ratio, color=style.INK, lw=style.THIN, ls=(0, (4, 3)), label=least)
    ax.plot(rates, bursts.net_ratio, "s-", color=style.BLUE, label="net work W", **thick)
    missing = bursts.status != "ok"
    if missing.any():
        ax.plot(rates[missing], [0.04] * int(missing.sum()), "x", color=style.MUTED, label="no current found")
    ax.set_ylim(bottom=0.0)
    ax.set_ylabel("Work over what the pack absorbs")
    label(ax, "x", across)
    ax.legend(fontsize=style.SMALL, loc="lower right", frameon=False)
    heading(ax, f"Bursts of {bursts.count} dots")
    ax.margins(x=0.03)
    sign(figure, bursts.hammer)
    return figure
