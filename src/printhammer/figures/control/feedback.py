"""Feedback beside other ways to drive: how far dots are off, the second of two by the gap, and one run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.marks import dashed, dots, heading
from printhammer.figures.elements.scales import scale
from printhammer.figures.elements.style import new_figure, sign, styled, with_strip
from printhammer.figures.elements.timeline import between_surfaces, current_between
from printhammer.support.arrays import FloatArray
from printhammer.units import from_si

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.control.feedback.comparison import Feedback

_COLOURS: Final = (style.ORANGE, style.YELLOW, style.GREEN)
_MARKS: Final = ("s", "^", "D")
_BINS: Final = 41
_REACH: Final = 4.0


@styled
def plot(feedback: Feedback) -> Figure:
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
    limits = (feedback.limits.force, feedback.limits.arrival)
    for column, ((name, factor), limit) in enumerate(zip(units, limits, strict=True)):
        values = (feedback.force, feedback.arrival)[column] * factor
        pairs = (feedback.gap_force, feedback.gap_arrival)[column] * factor
        _histogram(above[column], feedback, values, limit * factor)
        above[column].set_xlabel(name)
        _by_gap(below[column], feedback, pairs, limit * factor)
        below[column].set_ylabel(name)
        below[column].set_xlabel("Time between two slots  [ms]")
    above[0].set_ylabel("Share of the dots")
    heading(above[0], f"All dots of the patterns of eight slots at {feedback.rate:.6g} Hz")
    heading(above[1], "what is farther off: at the ends", loc="right")
    heading(below[0], "The second of two dots")
    # Room for the legend above the bars.
    room = 1.1 + 0.14 * len(feedback.strategies)
    highest = above[1].get_ylim()[1]
    above[1].set_ylim(0.0, room * highest)
    for ax, top, limit, (_name, factor) in zip(above, (1.0, 1.0 / room), limits, units, strict=True):
        dashed(ax.axvline, -limit * factor, limit * factor, ymax=top)
        ax.set_yticks([tick for tick in ax.get_yticks() if 0.0 <= tick <= min(1.0, highest)])
    above[1].legend(fontsize=style.SMALL, frameon=False, loc="upper right")
    remarks = [
        f"{name}: {int(lost)} dots are lost"
        for name, lost in zip(feedback.strategies, feedback.lost, strict=True)
        if lost
    ]
    sign(figure, feedback.driven, "; ".join(remarks) + "." if remarks else "")
    return figure


def _look(feedback: Feedback, number: int) -> tuple[str, str]:
    """Return colour and marker of a strategy: feedback is the last."""
    if number == len(feedback.strategies) - 1:
        return style.BLUE, "o"
    return _COLOURS[number % len(_COLOURS)], _MARKS[number % len(_MARKS)]


def _histogram(ax: Axes, feedback: Feedback, values: FloatArray, limit: float) -> None:
    """Count dots by how far they are off."""
    reach = _REACH * limit
    edges = np.linspace(-reach, reach, _BINS + 1)
    for number, name in enumerate(feedback.strategies):
        known = values[number][np.isfinite(values[number])]
        if not known.size:
            continue
        counts, _ = np.histogram(np.clip(known, -reach, reach), edges)
        text = f"{name}: {100.0 * feedback.passed[number].mean():.0f} % of the patterns"
        colour, _marker = _look(feedback, number)
        last = number == len(feedback.strategies) - 1
        how: dict[str, Any] = {
            "fill": last,
            "alpha": 0.75 if last else 1.0,
            "lw": style.THIN,
            "label": text,
            "gid": name,
        }
        ax.stairs(counts / known.size, edges, color=colour, **how)
    ax.set_xlim(-reach, reach)


def _by_gap(ax: Axes, feedback: Feedback, values: FloatArray, limit: float) -> None:
    """Draw how far the second of two dots is off."""
    gaps = from_si(1.0, "s", "ms") * feedback.gaps
    reach = _REACH * limit
    for number, name in enumerate(feedback.strategies):
        colour, marker = _look(feedback, number)
        how: dict[str, Any] = {"marker": marker, "ms": 2.6, "lw": style.THIN, "label": name, "gid": name}
        ax.plot(gaps, np.clip(values[number], -reach, reach), color=colour, **how)
    dashed(ax.axhline, -limit, limit)
    ax.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0)
    ax.set_ylim(-1.05 * reach, 1.05 * reach)
    ax.set_xlim(float(gaps[0]), float(gaps[-1]) if len(gaps) > 1 else float(gaps[0]) + 1.0)


@styled
def plot_run(feedback: Feedback) -> Figure:
    """Draw the run of a comparison.

    Displacement, the samples that the controller looked at, the times at which touches are wanted (short
    lines at the front of the pack); below, the current and its bounds.
    """
    figure = new_figure(4.6)
    panel, strip = with_strip(figure, 2.6)
    run, hammer = feedback.run, feedback.driven
    assert hammer.front is not None
    ms, um = scale("time").factor, scale("displacement").factor
    room = between_surfaces(panel, hammer, run.motion, 2.0)
    samples = {"marker": ".", "mew": None, "label": "what the sensor showed", "gid": "samples"}
    dots(panel, ms * run.times, um * run.shown, 2.0, style.ORANGE, **samples)
    front = um * hammer.front
    due: dict[str, Any] = {"color": style.BLUE, "lw": style.LINE, "label": "touch wanted", "gid": "due"}
    panel.vlines(ms * run.due, front - 0.6 * room, front + 0.6 * room, **due)
    heading(panel, f"Slots {run.pattern} at {feedback.rate:.6g} Hz with feedback")
    panel.legend(fontsize=style.SMALL, frameon=False, loc="upper right", ncols=2)
    current_between(strip, run.motion, feedback.driver.current)
    strip.set_ylim(-1.2 * feedback.driver.current, 1.2 * feedback.driver.current)
    strip.set_xlabel("Time  [ms]")
    first, last = float(run.due[0]), float(run.due[-1])
    span = feedback.single.flight_time
    panel.set_xlim(ms * (first - 1.3 * span), ms * min(last + 3.0 * span, float(np.max(run.motion.t))))
    sign(figure, hammer)
    return figure
