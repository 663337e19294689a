"""The damping study as a chart: for every material its safe rate, settle-out time and wear, in rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import ALONG_Y, beside, dashed, heading
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
def plot(study: DampingStudy) -> Figure:
    """Draw a damping study.

    A row a material. Bars: safe rate, settle-out time, change of momentum at the backstop, all at the same
    print force. Hollow: that takes more current than is allowed. Dashed: the hammer as it is. What is not
    known is said instead of a bar.
    """
    count = len(study.materials)
    figure = new_figure(1.3 + _ROW * count, 7.6)
    axes = figure.subplots(1, 3, sharey=True, width_ratios=(1.25, 1.0, 1.0))
    prints = [status in ("ok", "current limit") for status in study.status.tolist()]
    none = f"not even {study.grid[0]:g} Hz"
    panels = (
        ("Safe rate  [Hz]", study.safe_rate, none),
        ("Settle-out  [ms]", 1e3 * study.settle_out, "not in 20 ms"),
        ("Wear: impulse  [mN s a dot]", 1e3 * study.impulse, ""),
    )
    for ax, (name, values, missing) in zip(axes, panels, strict=True):
        status = study.status.tolist() if ax is axes[0] else [""] * count
        otherwise = [missing if well else str(text) for well, text in zip(prints, status, strict=True)]
        _panel(ax, study, values, otherwise)
        ax.set_xlabel(name)
    labels = [material.label.replace(" us", " µs") for material in study.materials]
    axes[0].set_yticks(range(count), labels, fontsize=style.TINY)
    axes[0].set_ylim(count - 0.4, -0.6)
    for tick, material in zip(axes[0].get_yticklabels(), study.materials, strict=True):
        tick.set_color(COLOURS[material.kind])
    kinds = [kind for kind in COLOURS if any(material.kind == kind for material in study.materials)]
    for place, kind in enumerate(kinds):
        where = place / len(kinds), 1.0
        beside(axes[0], kind, where, (0.0, 4.0), xycoords="axes fraction", color=COLOURS[kind])
    over = int((study.status == "current limit").sum())
    limit = f"; hollow: over {study.current_limit:g} A" if over else f", {study.current_limit:g} A at most"
    heading(axes[2], f"All print with {study.nominal.force:.1f} N{limit}", loc="right")
    sign(figure, study.hammer)
    return figure


def _panel(ax: Axes, study: DampingStudy, values: FloatArray, otherwise: list[str]) -> None:
    best = study.best
    for row, material in enumerate(study.materials):
        colour = COLOURS[material.kind]
        if not np.isfinite(values[row]):
            beside(ax, otherwise[row], (0.0, row), (3.0, 0.0), xycoords=ALONG_Y, va="center")
            continue
        hollow = study.status[row] == "current limit"
        inside, alpha = "white" if hollow else colour, 1.0 if row == best else 0.75
        look: dict[str, Any] = {"facecolor": inside, "edgecolor": colour, "alpha": alpha, "gid": f"bar-{row}"}
        ax.barh(row, values[row], height=_BAR, **look)
        text = f"{values[row]:.4g}" if values[row] >= 100.0 else f"{values[row]:.2f}"
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
        how = {"fontweight": "bold" if row == best else "normal", "bbox": box, "color": style.INK}
        beside(ax, text, (values[row], row), (2.0, 0.0), "left center", **how)
        if material.kind == "as it is":
            dashed(ax.axvline, values[row], lw=style.THIN, zorder=0.5)
    ax.set_xlim(0.0, 1.24 * float(np.nanmax(values, initial=1e-12)))
    ax.grid(axis="x", color=style.FAINT, lw=0.5)
    ax.set_axisbelow(True)
    ax.tick_params(axis="y", length=0.0)
