"""The damping study as a chart: for every material its safe rate, settle-out time and wear, in rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import ALONG_Y, beside
from printhammer.figures.elements.style import new_figure, sign, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.printing.rates.damping import DampingStudy
    from printhammer.support.arrays import FloatArray

COLOURS: Final = {"as it is": style.INK, "hard": style.BLUE, "elastomer": style.GREEN, "pack": style.ORANGE}
"""Colour of each kind of material."""

_ROW: Final = 0.2
_BAR: Final = 0.66


@styled
def plot(found: DampingStudy) -> Figure:
    """Draw a damping study.

    A row a material. Bars: safe rate, settle-out time, change of momentum at the backstop, all at the same
    print force. Hollow: that takes more current than is allowed. Dashed: the hammer as it is. What is not
    known is said instead of a bar.
    """
    count = len(found.materials)
    figure = new_figure(1.3 + _ROW * count, 7.6)
    axes = figure.subplots(1, 3, sharey=True, width_ratios=(1.25, 1.0, 1.0))
    prints = [status in ("ok", "current limit") for status in found.status.tolist()]
    none = f"not even {found.grid[0]:g} Hz"
    panels = (
        ("Safe rate  [Hz]", found.safe_rate, none),
        ("Settle-out  [ms]", 1e3 * found.settle_out, "not in 20 ms"),
        ("Wear: impulse  [mN s a dot]", 1e3 * found.impulse, ""),
    )
    for ax, (name, values, missing) in zip(axes, panels, strict=True):
        status = found.status.tolist() if ax is axes[0] else [""] * count
        told = [missing if well else str(text) for well, text in zip(prints, status, strict=True)]
        _panel(ax, found, values, told)
        ax.set_xlabel(name)
    labels = [one.label.replace(" us", " µs") for one in found.materials]
    axes[0].set_yticks(range(count), labels, fontsize=style.TINY)
    axes[0].set_ylim(count - 0.4, -0.6)
    for tick, one in zip(axes[0].get_yticklabels(), found.materials, strict=True):
        tick.set_color(COLOURS[one.kind])
    kinds = [kind for kind in COLOURS if any(one.kind == kind for one in found.materials)]
    for place, kind in enumerate(kinds):
        beside(
            axes[0],
            kind,
            (place / len(kinds), 1.0),
            (0.0, 4.0),
            xycoords="axes fraction",
            color=COLOURS[kind],
        )
    over = int((found.status == "current limit").sum())
    limit = f"; hollow: over {found.current_limit:g} A" if over else f", {found.current_limit:g} A at most"
    axes[2].set_title(f"All print with {found.nominal.force:.1f} N{limit}", loc="right", fontsize=style.SMALL)
    sign(figure, found.hammer)
    return figure


def _panel(ax: Axes, found: DampingStudy, values: FloatArray, otherwise: list[str]) -> None:
    best = found.best
    for row, one in enumerate(found.materials):
        colour = COLOURS[one.kind]
        if not np.isfinite(values[row]):
            beside(ax, otherwise[row], (0.0, row), (3.0, 0.0), xycoords=ALONG_Y, va="center")
            continue
        hollow = found.status[row] == "current limit"
        ax.barh(
            row,
            values[row],
            height=_BAR,
            facecolor="white" if hollow else colour,
            edgecolor=colour,
            alpha=1.0 if row == best else 0.75,
            gid=f"bar-{row}",
        )
        beside(
            ax,
            f"{values[row]:.4g}" if values[row] >= 100.0 else f"{values[row]:.2f}",
            (values[row], row),
            (2.0, 0.0),
            "left center",
            fontweight="bold" if row == best else "normal",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
            color=style.INK,
        )
        if one.kind == "as it is":
            ax.axvline(values[row], color=style.MUTED, lw=style.THIN, ls=(0, (4, 3)), zorder=0.5)
    ax.set_xlim(0.0, 1.24 * float(np.nanmax(values, initial=1e-12)))
    ax.grid(axis="x", color=style.FAINT, lw=0.5)
    ax.set_axisbelow(True)
    ax.tick_params(axis="y", length=0.0)
