"""The quench map: where the second dot is lost and how high the hammer comes; else how hard it prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements.map_marks import edges
from printhammer.figures.elements.marks import dashed, dots, legend_above
from printhammer.figures.elements.scales import Scale, label
from printhammer.figures.elements.style import INK, MUTED, SMALL, new_panel, sign, styled
from printhammer.figures.paper.two_pulses import DELAYS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.chaos.basins.quench import QuenchMap

PRINTED: Final = "viridis"
LOST: Final = "bone"
"""Colours of the force of printed dots, and of the second peak where the dot is lost; both monotonous."""

_FAILED: Final = "#d55e00"
_FEW: Final = 0.01


@styled
def plot(quenches: QuenchMap) -> Figure:
    """Draw a quench map.

    Crosses: the two cases of Fig. 6 of the paper, where they lie in the plane.
    """
    figure, ax = new_panel(4.6)
    across = Scale("Second firing after the first", "s", "ms")
    up = Scale("Width of the second pulse", "s", "ms")
    x, y = edges(across.shown(quenches.gaps)), edges(up.shown(quenches.widths))
    ax.set_facecolor(_FAILED)
    lost = np.ma.masked_where(~quenches.lost, np.nan_to_num(quenches.peak_share)).T
    printed = np.ma.masked_where(~quenches.struck, quenches.force_ratio).T
    mesh = None
    if quenches.struck.any():
        known = quenches.force_ratio[quenches.struck]
        low, high = np.quantile(known, [_FEW, 1.0 - _FEW])
        mesh = ax.pcolormesh(x, y, printed, cmap=PRINTED, vmin=low, vmax=high, rasterized=True)
        bar = figure.colorbar(mesh, ax=ax, pad=0.02, fraction=0.05, extend="both")
        bar.set_label("Printed: force over that of the first alone", fontsize=SMALL)
    if quenches.lost.any():
        mesh = ax.pcolormesh(x, y, lost, cmap=LOST, vmin=0.0, vmax=1.0, rasterized=True)
        # Beyond 1 where the second firing falls into the contact of the first dot.
        bar = figure.colorbar(mesh, ax=ax, pad=0.02, fraction=0.05, extend="max")
        bar.set_label("Lost: second peak, parts of the way to the pack", fontsize=SMALL)
    width = getattr(quenches.waveform, "width", None)
    if width is not None and y[0] < up.shown(width) < y[-1]:
        dashed(
            ax.axhline,
            float(up.shown(width)),
            color="white",
            label="width of the first pulse",
            gid="first width",
        )
        shown = [delay for delay in DELAYS if quenches.gaps[0] <= delay <= quenches.gaps[-1]]
        level = np.full(len(shown), float(up.shown(width)))
        crosses = {"marker": "x", "mew": 1.4, "label": "the two cases of Fig. 6", "gid": "Fig. 6"}
        if shown:
            dots(ax, across.shown(shown), level, 6.0, "white", **crosses)
        # White on grey, as the marks are white on the map.
        box = {
            "frameon": True,
            "facecolor": MUTED,
            "edgecolor": "none",
            "framealpha": 1.0,
            "labelcolor": "white",
        }
        legend_above(ax, ax.get_legend_handles_labels()[0], **box)
    ax.set_xlim(float(x[0]), float(x[-1]))
    ax.set_ylim(float(y[0]), float(y[-1]))
    label(ax, "x", across)
    label(ax, "y", up)
    for spine in ax.spines.values():
        spine.set_color(INK if spine.get_visible() else MUTED)
    bad = int((quenches.status != "ok").sum())
    sign(figure, quenches.hammer, f"{bad} of {quenches.status.size} runs ended early." if bad else "")
    return figure
