"""Ways to drive side by side: how far dots are off in all patterns, and the second of two dots by the gap."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.units import from_si

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.control.feedback.comparison import Feedback
    from printhammer.support.arrays import FloatArray

_COLOURS: Final = (style.ORANGE, style.YELLOW, style.GREEN)
_MARKS: Final = ("s", "^", "D")
_BINS: Final = 41
_REACH: Final = 4.0


@styled
def plot(found: Feedback) -> Figure:
    """Draw a comparison of feedback with other ways to drive.

    Above: how many dots of all patterns are off by how much, lost ones not among them; what is farther off
    than the axis reaches is counted at its ends. Below: the second of two dots, by the time between their
    slots. Between the dashed lines a dot is within limits.
    """
    figure = new_figure(5.6)
    grid = figure.add_gridspec(2, 2)
    above = [figure.add_subplot(grid[0, column]) for column in range(2)]
    below = [figure.add_subplot(grid[1, column]) for column in range(2)]
    units = (("Force off  [%]", 100.0), ("Arrival off  [µs]", from_si(1.0, "s", "us")))
    limits = (found.limits.force, found.limits.arrival)
    for column, ((name, factor), limit) in enumerate(zip(units, limits, strict=True)):
        values = (found.force, found.arrival)[column] * factor
        pairs = (found.gap_force, found.gap_arrival)[column] * factor
        _histogram(above[column], found, values, limit * factor)
        above[column].set_xlabel(name)
        _by_gap(below[column], found, pairs, limit * factor)
        below[column].set_ylabel(name)
        below[column].set_xlabel("Time between two slots  [ms]")
    above[0].set_ylabel("Share of the dots")
    above[0].set_title(
        f"All dots of the patterns of eight slots at {found.rate:.6g} Hz", loc="left", fontsize=style.SMALL
    )
    above[1].set_title("what is farther off: at the ends", loc="right", fontsize=style.SMALL)
    below[0].set_title("The second of two dots", loc="left", fontsize=style.SMALL)
    # Room for the legend above the bars.
    above[1].set_ylim(0.0, (1.1 + 0.14 * len(found.strategies)) * above[1].get_ylim()[1])
    above[1].legend(fontsize=style.SMALL, frameon=False, loc="upper right")
    remarks = [
        f"{name}: {int(lost)} dots are lost"
        for name, lost in zip(found.strategies, found.lost, strict=True)
        if lost
    ]
    sign(figure, found.driven, "; ".join(remarks) + "." if remarks else "")
    return figure


def _look(found: Feedback, number: int) -> tuple[str, str]:
    """Return colour and marker of a strategy: feedback is the last."""
    if number == len(found.strategies) - 1:
        return style.BLUE, "o"
    return _COLOURS[number % len(_COLOURS)], _MARKS[number % len(_MARKS)]


def _histogram(ax: Axes, found: Feedback, values: FloatArray, limit: float) -> None:
    """Count dots by how far they are off."""
    reach = _REACH * limit
    edges = np.linspace(-reach, reach, _BINS + 1)
    for number, name in enumerate(found.strategies):
        known = values[number][np.isfinite(values[number])]
        if not known.size:
            continue
        counts, _ = np.histogram(np.clip(known, -reach, reach), edges)
        passed = 100.0 * found.passed[number].mean()
        colour, _marker = _look(found, number)
        ax.stairs(
            counts / known.size,
            edges,
            color=colour,
            fill=number == len(found.strategies) - 1,
            alpha=0.75 if number == len(found.strategies) - 1 else 1.0,
            lw=style.THIN,
            label=f"{name}: {passed:.0f} % of the patterns",
            gid=name,
        )
    _limits(ax.axvline, limit)
    ax.set_xlim(-reach, reach)


def _by_gap(ax: Axes, found: Feedback, values: FloatArray, limit: float) -> None:
    """Draw how far the second of two dots is off."""
    gaps = from_si(1.0, "s", "ms") * found.gaps
    reach = _REACH * limit
    for number, name in enumerate(found.strategies):
        colour, marker = _look(found, number)
        ax.plot(
            gaps,
            np.clip(values[number], -reach, reach),
            color=colour,
            marker=marker,
            ms=2.6,
            lw=style.THIN,
            label=name,
            gid=name,
        )
    _limits(ax.axhline, limit)
    ax.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0)
    ax.set_ylim(-1.05 * reach, 1.05 * reach)
    ax.set_xlim(float(gaps[0]), float(gaps[-1]) if len(gaps) > 1 else float(gaps[0]) + 1.0)


def _limits(line: object, limit: float) -> None:
    for end in (-limit, limit):
        line(end, color=style.MUTED, lw=style.HAIR, ls=(0, (4, 3)))  # type: ignore[operator]
