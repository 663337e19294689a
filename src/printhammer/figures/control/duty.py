"""Thermal duty: the largest rate of a coil against the ambient temperature."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import heading
from printhammer.figures.elements.style import new_panel, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.control.duty.duty import ThermalDuty
    from printhammer.control.duty.limit import ThermalLimit

_COLOURS: Final = (style.BLUE, style.ORANGE, style.GREEN, style.YELLOW)


@styled
def plot(duty: ThermalDuty) -> Figure:
    """Draw the rate that a coil stands for ever, which falls to zero at its limit."""
    figure, ax = new_panel(3.4)
    ax.plot(duty.ambient, duty.rate, "o", color=style.BLUE, ms=4.5)
    reach = np.array([min(float(duty.ambient.min()), 0.0), duty.limit])
    ax.plot(
        reach, (duty.limit - reach) / (duty.limit_heat * duty.coil.whole), color=style.BLUE, lw=style.THIN
    )
    heading(ax, f"{1e3 * duty.limit_heat:.3g} mJ a dot at {duty.limit:g} °C, {duty.coil.whole:g} K/W")
    _axes(ax)
    return figure


@styled
def plot_limit(limit: ThermalLimit) -> Figure:
    """Draw stated rates, and the lines to the one limit at which all of them end."""
    figure, ax = new_panel(3.4)
    for number, rail in enumerate(np.unique(limit.voltage).tolist()):
        rows = limit.voltage == rail
        colour = _COLOURS[number % len(_COLOURS)]
        name = f"{rail:g} V" if rail else "stated"
        ax.plot(limit.ambient[rows], limit.rate[rows], "o", color=colour, ms=4.5, label=name)
        start = float(limit.ambient[rows].min())
        rate = (limit.limit - start) / float(limit.warming[rows][0])
        ax.plot([start, limit.limit], [rate, 0.0], color=colour, lw=style.THIN)
    ax.legend(fontsize=style.SMALL, loc="upper right", frameon=False)
    heading(ax, f"One limit of the winding, {limit.limit:.1f} °C")
    _axes(ax)
    return figure


def _axes(ax: Axes) -> None:
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("Ambient temperature  [°C]")
    ax.set_ylabel("Dots a second, for ever  [Hz]")
    ax.margins(x=0.03)
