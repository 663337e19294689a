"""Figures of sensitivities: bar charts sorted by magnitude, one panel per quantity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.derivatives.sensitivities import Sensitivities
from printhammer.errors import InputError
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import beside, heading, note
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.support.arrays import FloatArray

SHOWN: Final = ("flight_time", "impact_speed", "peak_force", "net_loss")
"""Quantities drawn by default: flight time, impact speed, peak force and net loss."""

_COLUMNS: Final = 2  # Panels in a row; arbitrary
_BAR: Final = 0.62  # Height of a bar, as a fraction of the spacing; arbitrary


@styled
def plot(
    table: Sensitivities, *, dot: int | None = None, quantities: Sequence[str] = SHOWN, bars: int = 8
) -> Figure:
    """Draw the largest sensitivities of one dot, or of the whole run, as bars.

    The length of a bar is the relative change of the quantity per relative change of the constant: a bar of 2
    means that a change of the constant by 1 % changes the quantity by 2 %. Constants that are zero have no
    bar.

    Parameters
    ----------
    dot : int, optional
        Index of the firing, from 0; by default the first printed dot.
    quantities : sequence of str, optional
        Names of quantities of a dot or of the run; one panel per quantity.
    bars : int, optional
        Largest number of constants in a panel.
    """
    if bars < 1:
        raise InputError.of("bars", bars, "at least 1", written=str(bars))
    if not quantities:
        raise InputError("quantities: expected at least one to draw", key="quantities")
    number = _dot(table, dot, quantities)
    rows = math.ceil(len(quantities) / _COLUMNS)
    figure = new_figure(0.5 + rows * (0.9 + 0.19 * bars), 7.2)
    columns = min(_COLUMNS, len(quantities))
    for place, name in enumerate(quantities):
        ax = figure.add_subplot(rows, columns, place + 1)
        _panel(ax, table, _sensitivities(table, name, number), bars)
        of_dot = f", dot {number + 1}" if name in table.quantities and len(table.dots) > 1 else ""
        heading(ax, name.replace("_", " ") + of_dot)
        if place >= len(quantities) - columns:
            ax.set_xlabel("Change in % per 1 % of the constant", fontsize=style.SMALL)
    remarks = [] if table.ok else [f"The run ended early: {table.status}."]
    if not table.smooth:
        remarks.append("The armature touches a surface at zero velocity: the later motion has no derivative.")
    sign(figure, table.hammer, *remarks)
    return figure


def _dot(table: Sensitivities, dot: int | None, quantities: Sequence[str]) -> int:
    """Return the index of the dot to draw, by default the first printed dot; InputError for a lost dot."""
    struck = [k for k in range(len(table.dots)) if k not in table.lost]
    if all(name in table.run_quantities for name in quantities):
        return 0
    if dot is None:
        if not struck:
            raise InputError("all dots are lost", key="dot", expected="at least one printed dot")
        return struck[0]
    if not 0 <= dot < len(table.dots):
        raise InputError.of("dot", dot, f"a number from 0 to {len(table.dots) - 1}", written=str(dot))
    if dot not in struck:
        raise InputError(f"dot = {dot} is lost and has no sensitivities", key="dot", value=dot)
    return dot


def _sensitivities(table: Sensitivities, name: str, dot: int) -> FloatArray:
    if name in table.quantities:
        return np.asarray(table.logarithmic[dot, table.quantities.index(name)])
    if name in table.run_quantities:
        return np.asarray(table.run_logarithmic[table.run_quantities.index(name)])
    known = ", ".join((*table.quantities, *table.run_quantities))
    raise InputError(
        f"quantity = {name!r} is not known", key="quantity", value=name, expected=f"one of {known}"
    )


def _panel(ax: Axes, table: Sensitivities, values: FloatArray, bars: int) -> None:
    """Draw the bars of one quantity, without constants whose sensitivity rounds to zero."""
    sizes = np.where(np.isfinite(values), np.abs(values), 0.0)
    order = [int(k) for k in np.argsort(-sizes, kind="stable")[:bars] if sizes[k] >= 5e-4]
    if not order:
        note(ax, "no sensitivity", (0.5, 0.5), ha="center", va="baseline", zorder=3.0)
        ax.set_yticks([])
        return
    longest = float(sizes[order[0]])
    for height, k in enumerate(order):
        value = float(values[k])
        colour, shift, side = (style.BLUE, 3.0, "left") if value > 0.0 else (style.ORANGE, -3.0, "right")
        ax.barh(height, value, height=_BAR, color=colour, gid=f"bar-{table.constants[k]}")
        text = f"{value:+.3g}".replace("-", "−")
        beside(ax, text, (value, height), (shift, 0.0), f"{side} center", color=style.INK)
    ax.axvline(0.0, color=style.INK, lw=style.HAIR)
    # Leave room for the numbers at the ends of the bars.
    least = min(float(values[k]) for k in order)
    most = max(float(values[k]) for k in order)
    ax.set_xlim(min(least, 0.0) - 0.32 * longest, max(most, 0.0) + 0.32 * longest)
    ax.set_ylim(max(len(order), 3) - 0.4, -0.6)
    ax.set_yticks(range(len(order)), [table.constants[k] for k in order], fontsize=style.TINY)
    ax.tick_params(axis="y", length=0.0)
