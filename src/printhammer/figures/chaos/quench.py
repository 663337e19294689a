"""The quench map: where the second dot is lost and how high the hammer comes; else how hard it prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements.map_marks import edges
from printhammer.figures.elements.scales import Scale, label
from printhammer.figures.elements.style import HAIR, INK, MUTED, SMALL, new_figure, sign, styled
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
def plot(found: QuenchMap) -> Figure:
    """Draw a quench map.

    Crosses: the two cases of Fig. 6 of the paper, where they lie in the plane.
    """
    figure = new_figure(4.6)
    ax = figure.add_subplot()
    across = Scale("Second firing after the first", "s", "ms")
    up = Scale("Width of the second pulse", "s", "ms")
    x, y = edges(across.shown(found.gaps)), edges(up.shown(found.widths))
    ax.set_facecolor(_FAILED)
    lost = np.ma.masked_where(~found.lost, np.nan_to_num(found.peak_share)).T
    printed = np.ma.masked_where(~found.struck, found.force_ratio).T
    mesh = None
    if found.struck.any():
        known = found.force_ratio[found.struck]
        low, high = np.quantile(known, [_FEW, 1.0 - _FEW])
        mesh = ax.pcolormesh(x, y, printed, cmap=PRINTED, vmin=low, vmax=high, rasterized=True)
        bar = figure.colorbar(mesh, ax=ax, pad=0.02, fraction=0.05, extend="both")
        bar.set_label("Printed: force over that of the first alone", fontsize=SMALL)
    if found.lost.any():
        mesh = ax.pcolormesh(x, y, lost, cmap=LOST, vmin=0.0, vmax=1.0, rasterized=True)
        # Beyond 1 where the second firing falls into the contact of the first dot.
        bar = figure.colorbar(mesh, ax=ax, pad=0.02, fraction=0.05, extend="max")
        bar.set_label("Lost: second peak, parts of the way to the pack", fontsize=SMALL)
    width = getattr(found.waveform, "width", None)
    if width is not None and y[0] < up.shown(width) < y[-1]:
        ax.axhline(float(up.shown(width)), color="white", lw=HAIR, ls=(0, (4, 3)), gid="first width")
        shown = [delay for delay in DELAYS if found.gaps[0] <= delay <= found.gaps[-1]]
        ax.plot(
            across.shown(shown),
            np.full(len(shown), float(up.shown(width))),
            ls="none",
            marker="x",
            ms=6.0,
            mew=1.4,
            color="white",
            gid="Fig. 6",
        )
    ax.set_xlim(float(x[0]), float(x[-1]))
    ax.set_ylim(float(y[0]), float(y[-1]))
    label(ax, "x", across)
    label(ax, "y", up)
    for spine in ax.spines.values():
        spine.set_color(INK if spine.get_visible() else MUTED)
    bad = int((found.status != "ok").sum())
    sign(figure, found.hammer, f"{bad} of {found.status.size} runs ended early." if bad else "")
    return figure
