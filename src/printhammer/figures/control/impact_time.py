"""Errors of times of impact that are estimated from the coil."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import heading
from printhammer.figures.elements.style import new_figure, sign, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.control.sensing.impact_time import ImpactTime

_DASHES: Final = ("-", (0, (4, 2)), (0, (1, 1.5)))
_MILLI: Final = 1e3
_MICRO: Final = 1e6


@styled
def plot(study: ImpactTime) -> Figure:
    """Draw standard deviation and size of the bias against the noise, a line for each rate and converter.

    Orange: on the nominal hammer. Blue: over units, whose differences no averaging takes away.
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
    below.set_ylabel("Size of the bias  [µs]")
    below.set_xlabel(f"Noise of a sample of the {study.signal}  [m{study.unit}]")
    above.tick_params(axis="x", labelbottom=False)
    for ax in (above, below):
        ax.set_ylim(bottom=0.0)
    above.legend(fontsize=style.SMALL, loc="best", frameon=False)
    heading(above, "Error of the time of impact; orange: nominal hammer, blue: units")
    sign(figure, study.hammer)
    return figure
