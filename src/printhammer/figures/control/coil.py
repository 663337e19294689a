"""Figures of a coil: dead time and pulse width against rail voltage and temperature.

`plot_duty` draws the highest continuous rate of a coil against the ambient temperature.

`plot_impact_time` draws the errors of impact times estimated from the coil signal.
"""

from __future__ import annotations

import itertools
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.control.dead_time import DeadTime
from printhammer.control.duty import ThermalDuty
from printhammer.control.impact_time import ImpactTime
from printhammer.control.thermal_limit import ThermalLimit
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import heading
from printhammer.figures.elements.scales import scale
from printhammer.figures.elements.style import new_figure, new_panel, sign, styled


@styled
def plot_dead_time(table: DeadTime) -> Figure:
    """Draw dead time and pulse width against the rail voltage, one line per temperature.

    Thin dashed lines: nominal pulse. Bold lines: pulses that give the same impact speed.
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
    heading(times, f"Equal impact speed, {table.blow:.3g} m/s; dashed: nominal pulse")
    widths.set_xlim(*times.get_xlim())
    sign(figure, table.hammer)
    return figure


_COLOURS: Final = (style.BLUE, style.ORANGE, style.GREEN, style.YELLOW)


@styled
def plot_duty(duty: ThermalDuty) -> Figure:
    """Draw the highest continuous rate of a coil against ambient temperature, down to a rate of zero."""
    figure, ax = new_panel(3.4)
    ax.plot(duty.ambient, duty.rate, "o", color=style.BLUE, ms=4.5)
    reach = np.array([min(float(duty.ambient.min()), 0.0), duty.limit])
    ax.plot(
        reach, (duty.limit - reach) / (duty.limit_heat * duty.coil.whole), color=style.BLUE, lw=style.THIN
    )
    heading(ax, f"{1e3 * duty.limit_heat:.3g} mJ per dot at {duty.limit:g} °C, {duty.coil.whole:g} K/W")
    _axes(ax)
    return figure


@styled
def plot_limit(limit: ThermalLimit) -> Figure:
    """Draw the manufacturer's highest rates against ambient temperature, one colour per rail voltage.

    Lines show the highest rates for the fitted temperature limit of the winding.
    """
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
    heading(ax, f"Common temperature limit of the winding, {limit.limit:.1f} °C")
    _axes(ax)
    return figure


def _axes(ax: Axes) -> None:
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("Ambient temperature  [°C]")
    ax.set_ylabel("Highest continuous rate  [Hz]")
    ax.margins(x=0.03)


_DASHES: Final = ("-", (0, (4, 2)), (0, (1, 1.5)))  # Dashes of successive lines
_MILLI: Final = 1e3  # Milliseconds in a second
_MICRO: Final = 1e6  # Microseconds in a second


@styled
def plot_impact_time(study: ImpactTime) -> Figure:
    """Draw standard deviation and bias magnitude of estimated impact times against the sensor noise.

    Orange: nominal hammer. Blue: individual units, whose constants deviate from the nominal constants.
    """
    figure = new_figure(5.2)
    grid = figure.add_gridspec(2, 1)
    above = figure.add_subplot(grid[0])
    below = figure.add_subplot(grid[1], sharex=above)
    shades = np.linspace(0.4, 1.0, study.sampling_rate.size)
    for j, k in itertools.product(range(study.sampling_rate.size), range(study.bits.size)):
        name = f"{1e-3 * study.sampling_rate[j]:g} kHz, {study.bits[k]} bits"
        look: dict[str, Any] = {"ls": _DASHES[k % len(_DASHES)], "alpha": float(shades[j]), "lw": style.LINE}
        cell = slice(None), j, k
        noise = _MILLI * study.noise
        above.plot(noise, _MICRO * study.deviation[cell], "o", color=style.ORANGE, **look, ms=3.0, label=name)
        above.plot(noise, _MICRO * study.unit_deviation[cell], "s", color=style.BLUE, **look, ms=3.0)
        below.plot(noise, _MICRO * np.abs(study.bias[cell]), "o", color=style.ORANGE, **look, ms=3.0)
        below.plot(noise, _MICRO * np.abs(study.unit_bias[cell]), "s", color=style.BLUE, **look, ms=3.0)
    above.set_ylabel("Standard deviation  [µs]")
    below.set_ylabel("Magnitude of the bias  [µs]")
    below.set_xlabel(f"Noise of a sample of the {study.signal}  [m{study.unit}]")
    above.tick_params(axis="x", labelbottom=False)
    for ax in (above, below):
        ax.set_ylim(bottom=0.0)
    above.legend(fontsize=style.SMALL, loc="best", frameon=False)
    heading(above, "Error of the impact time; orange: nominal hammer, blue: units")
    sign(figure, study.hammer)
    return figure
