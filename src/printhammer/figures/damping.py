"""The damping study as a chart: settle-out, wear and safe rate against how little the backstop gives back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    SMALL,
    THIN,
    TINY,
    new_figure,
    sign,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.printing.damping import DampingStudy
    from printhammer.segments import FloatArray

LOOKS: Final = {
    "as it is": ("*", INK, 11.0),
    "hard": ("o", BLUE, 5.0),
    "elastomer": ("s", GREEN, 5.0),
    "pack": ("^", ORANGE, 5.5),
}
"""Marker, colour and size of each kind of material."""


@styled
def plot(found: DampingStudy) -> Figure:
    """Draw a damping study.

    Parameters
    ----------
    found : DampingStudy
        From `printhammer.damping_study`.

    Returns
    -------
    Figure
        A marker a material: settle-out time, energy that the backstop takes, and safe rate, each against the
        restitution of the first touch of the backstop. Hollow: the print force takes more current than is
        allowed. Dashed: the hammer as it is. A cross on the lower edge: no rate of the grid passes.
    """
    figure = new_figure(6.6)
    axes = figure.subplots(3, 1, sharex=True)
    panels = (
        ("Settle-out  [ms]", 1e3 * found.settle_out),
        ("Backstop takes  [mJ a dot]", 1e3 * found.loss),
        ("Safe rate  [Hz]", found.safe_rate),
    )
    for ax, (name, values) in zip(axes, panels, strict=True):
        _panel(ax, found, values)
        ax.set_ylabel(name)
    none = np.isnan(found.safe_rate) & np.isfinite(found.restitution)
    axes[2].plot(
        found.restitution[none],
        np.full(int(none.sum()), 0.02),
        "x",
        ms=5.0,
        color=MUTED,
        transform=axes[2].get_xaxis_transform(),
        gid="no safe rate",
    )
    axes[2].set_xlabel("Restitution of the first touch of the backstop")
    axes[2].set_xlim(-0.03, max(1.0, float(np.nanmax(found.restitution, initial=0.0))) + 0.03)
    axes[0].legend(loc="best", fontsize=TINY, frameon=False, ncols=2, handletextpad=0.2)
    best = found.best
    if best is not None:
        axes[2].annotate(
            found.materials[best].label.replace(" us", " µs"),
            (found.restitution[best], found.safe_rate[best]),
            xytext=(7.0, 0.0),
            textcoords="offset points",
            va="center",
            fontsize=TINY,
            color=INK,
        )
    axes[0].set_title(
        f"The same print force, {found.nominal.force:.1f} N, at {found.current_limit:g} A or less",
        loc="left",
        fontsize=SMALL,
    )
    odd = [status for status in found.status.tolist() if status not in ("ok", "current limit")]
    told = (
        f"{len(odd)} of {len(found.materials)} materials not drawn: {', '.join(sorted(set(odd)))}."
        if odd
        else ""
    )
    sign(figure, found.hammer, told)
    return figure


def _panel(ax: Axes, found: DampingStudy, values: FloatArray) -> None:
    kinds = np.array([one.kind for one in found.materials])
    for kind, (marker, colour, size) in LOOKS.items():
        for over in (False, True):
            which = (kinds == kind) & ((found.status == "current limit") == over) & np.isfinite(values)
            if not which.any():
                continue
            ax.plot(
                found.restitution[which],
                values[which],
                marker,
                ms=size,
                mew=0.9,
                color=colour,
                mfc="white" if over else colour,
                label=f"{kind}, over the current limit" if over else kind,
                gid=kind,
            )
    as_it_is = values[kinds == "as it is"]
    if as_it_is.size and np.isfinite(as_it_is[0]):
        ax.axhline(as_it_is[0], color=MUTED, lw=THIN, ls=(0, (4, 3)), zorder=0)
    ax.grid(axis="y", color=FAINT, lw=0.5)
    ax.set_axisbelow(True)
    low, high = ax.get_ylim()
    ax.set_ylim(min(low, 0.0) if low < 0.2 * high else low, high)
