"""Dead time and pulses of the same blow against rail and temperature."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import heading
from printhammer.figures.elements.scales import scale
from printhammer.figures.elements.style import new_figure, sign, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.control.dead_time.table import DeadTime


@styled
def plot(table: DeadTime) -> Figure:
    """Draw times from switching on to impact and widths against the rail, a line for each temperature.

    Thin and dashed: with the hammer's own pulse. Bold: with the pulses that give the same blow.
    """
    figure = new_figure(5.2)
    grid = figure.add_gridspec(2, 1)
    times, widths = figure.add_subplot(grid[0]), figure.add_subplot(grid[1])
    ms = scale("time").factor
    rows = np.argsort(table.voltage)
    volts = table.voltage[rows]
    shades = np.linspace(0.35, 1.0, table.temperature.size)
    for j, degrees in enumerate(table.temperature.tolist()):
        look: dict[str, Any] = {"color": style.ORANGE, "alpha": float(shades[j])}
        times.plot(volts, ms * table.time[rows, j], ls=(0, (4, 3)), lw=style.THIN, **look)
        name = f"{degrees:g} °C"
        for ax, values in ((times, table.width_time), (widths, table.width)):
            ax.plot(volts, ms * values[rows, j], "o-", ms=3.5, lw=style.LINE, label=name, **look)
    widths.axhline(ms * table.own_width, color=style.MUTED, lw=style.THIN, ls=(0, (4, 3)))
    times.tick_params(axis="x", labelbottom=False)
    times.set_ylabel("To impact  [ms]")
    widths.set_ylabel("Width  [ms]")
    widths.set_xlabel("Rail  [V]")
    times.legend(fontsize=style.SMALL, loc="best", frameon=False)
    heading(times, f"Same blow, {table.blow:.3g} m/s; dashed: own pulse")
    widths.set_xlim(*times.get_xlim())
    sign(figure, table.hammer)
    return figure
