"""Distributions of finite-time exponents: histograms over stretches of several lengths."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements.marks import heading
from printhammer.figures.elements.style import INK, new_panel, sign, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.chaos import FiniteTime

_BINS: Final = 60


@styled
def plot(finite: FiniteTime) -> Figure:
    """Draw the densities of the exponents of stretches of each length, and that of the whole train."""
    figure, ax = new_panel(4.2)
    ends = min(row.min() for row in finite.values), max(row.max() for row in finite.values)
    bins = np.linspace(*ends, _BINS + 1).tolist() if ends[0] < ends[1] else _BINS
    for length, row in zip(finite.lengths, finite.values, strict=True):
        ax.hist(row, bins, density=True, histtype="step", lw=1.1, label=f"{length} firings")
    ax.axvline(float(finite.lyapunov.exponents[0]), color=INK, lw=0.9)
    ax.set(xlabel="Exponent of a stretch  [1/firing]", ylabel="Density")
    ax.legend(frameon=False)
    heading(ax, "Finite-time exponents, and that of the whole train")
    sign(figure, finite.lyapunov.hammer)
    return figure
