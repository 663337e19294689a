"""What a hammer prints before, while and after it learns its table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import heading
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.printing.dots.slots import LEAD_IN
from printhammer.printing.rates.quality import PITCH
from printhammer.units import from_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.control.learning.result import Learning

_FIRST: Final = LEAD_IN + 128  # First slot that is drawn: from here on dots and gaps are mixed
_SLOTS: Final = 88  # Number of slots of the cycle that are drawn
_HEIGHT: Final = 0.42  # Height of a line, in
_SIZE: Final = 20.0  # Area of a dot of the nominal force
_CONTRAST: Final = 4.0  # How much more than the force the area of a dot differs
_SMALLEST: Final = 0.1  # Least area, in parts of that of the nominal force


@styled
def plot(learning: Learning) -> Figure:
    """Draw a line at each stage: each dot where it strikes, its area four times as far off as its force.

    Dots beyond the limits are orange, and a lost dot is a cross at its slot.
    """
    stages = learning.dots.size
    figure = new_figure(1.1 + _HEIGHT * stages)
    ax = figure.subplots()
    drawn = (learning.slot >= _FIRST) & (learning.slot < _FIRST + _SLOTS)
    place = PITCH * (learning.slot[drawn] - _FIRST)
    speed = PITCH * learning.rate
    for row in range(stages):
        late, force = learning.arrival_deviation[row, drawn], learning.force_deviation[row, drawn]
        lost, good = np.isnan(late), learning.good[row, drawn].astype(bool)
        x = from_si(1.0, "m", "mm") * (place + speed * np.nan_to_num(late))
        size = _SIZE * np.maximum(1.0 + _CONTRAST * np.nan_to_num(force), _SMALLEST)
        for which, colour in ((good, style.BLUE), (~good & ~lost, style.ORANGE)):
            ax.scatter(x[which], np.full(which.sum(), row), s=size[which], c=colour, linewidths=0.0)
        ax.scatter(x[lost], np.full(lost.sum(), row), s=_SIZE, c=style.ORANGE, marker="x", linewidths=0.8)
    shares = 100.0 * learning.share
    names = [
        f"{int(dots)} dots" + ("" if learned else ", open loop")
        for dots, learned in zip(learning.dots, learning.learned, strict=True)
    ]
    ax.set_yticks(range(stages), names)
    ax.set_ylim(stages - 0.4, -0.6)
    ax.margins(x=0.03)
    right = ax.secondary_yaxis("right")
    right.set_yticks(range(stages), [f"{share:.0f} %" for share in shares])
    ax.set_xlabel("Place on the paper  [mm]")
    heading(ax, f"What is printed after so many test dots, at {learning.rate:.6g} Hz")
    heading(ax, "within limits", loc="right")
    sign(figure, learning.hammer)
    return figure
