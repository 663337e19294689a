"""Switching of contacts: displacement, coil current, and the state of each contact against time."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.errors import InputError
from printhammer.figures.elements import marks, style
from printhammer.figures.elements.curves import places, times_of
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.run.motion import Motion
from printhammer.run.switching.timings import Timing

_TRACE: Final = 0.6  # Height of a closed contact's trace, where the rows have a spacing of 1; arbitrary
_ROOM: Final = 0.08  # Room above and below the motion, as a fraction of its range; arbitrary


@styled
def plot_timings(motion: Motion, *, until: float | None = None) -> Figure:
    """Draw the switching of all contacts: displacement, coil current, and the state of each contact.

    The state of a contact is drawn as an oscilloscope shows it, high where the contact is closed. The text
    beside a trace states operate, release or reset time, and bounce time; dashed lines mark switch-on and
    switch-off.

    Parameters
    ----------
    motion : Motion
        Motion of a hammer with contacts.
    until : float, optional
        End of the time axis, s; by default the end of the motion.

    Raises
    ------
    InputError
        The hammer has no contact.
    """
    hammer, timings = motion.hammer, motion.timings
    if not timings:
        raise InputError(
            f"the hammer {hammer.name!r} has no contact to draw", key="contact", expected="a [[contact]]"
        )
    names = list(dict.fromkeys(each.contact for each in timings))
    end = motion.end if until is None else min(until, motion.end)
    grid, time = times_of(motion, end=end), scale("time", end)
    x, _v = motion.at(grid)
    figure = new_figure(3.6 + 0.45 * len(names))
    rows = figure.add_gridspec(3, 1, height_ratios=(3.2, 1.2, 0.4 + 0.5 * len(names)), hspace=0.05)
    panel = figure.add_subplot(rows[0])
    strip, traces = (figure.add_subplot(rows[row], sharex=panel) for row in (1, 2))
    every = [*places(hammer).values(), float(x.min()), float(x.max())]
    room = _ROOM * (max(every) - min(every))
    way = scale("displacement", max(map(abs, every)))
    panel.set_xlim(float(time.shown(grid[0])), float(time.shown(end)))
    panel.set_ylim(float(way.shown(min(every) - room)), float(way.shown(max(every) + room)))
    marks.place_lines(panel, hammer, way)
    marks.curve(panel, time.shown(grid), way.shown(x), "displacement")
    marks.closed(panel, motion, time, way, style.ORANGE)
    marks.name_lines(panel, hammer, way)
    label(panel, "y", way)
    marks.drive_strip(strip, [motion], [grid], end, [style.BLUE])
    strip.set_xlabel("")
    for row, name in enumerate(reversed(names)):
        _trace(traces, motion, name, row, end, time)
    traces.set_yticks([row + 0.5 * _TRACE for row in range(len(names))], list(reversed(names)))
    traces.tick_params(axis="y", length=0, right=False)
    traces.set_ylim(-0.25, len(names))
    label(traces, "x", time)
    for axes in (panel, strip):
        axes.tick_params(axis="x", labelbottom=False)
    for timing in timings:
        _mark(traces, timing, len(names) - 1 - names.index(timing.contact), time)
        for event in (timing.switched_on, timing.switched_off):
            for axes in (panel, strip, traces):
                if event is not None and event <= end:
                    axes.axvline(
                        float(time.shown(event)), color=style.MUTED, lw=style.HAIR, ls=(0, (4, 3)), zorder=1.0
                    )
    sign(figure, hammer, *filter(None, [motion.message]))
    return figure


def _trace(ax: Axes, motion: Motion, name: str, row: int, end: float, time: Scale) -> None:
    """Draw the state of the contact `name` against time as a rectangular trace, high while it is closed.

    `row` is the baseline of the trace, and `end` the end of the time axis, s.
    """
    own = [each for each in motion.closings if each.contact == name]
    is_closed = bool(own) and own[0].initial
    edges: list[float] = [] if is_closed else [motion.start]
    levels: list[float] = [] if is_closed else [0.0]
    for each in own:
        if each.initial:
            edges += [each.t_in, each.t_out or end, each.t_out or end]
            levels += [_TRACE, _TRACE, 0.0]
        else:
            edges += [each.t_in, each.t_in, each.t_out or end, each.t_out or end]
            levels += [0.0, _TRACE, _TRACE, 0.0]
    if levels[-1] == 0.0 and edges[-1] < end:
        edges, levels = [*edges, end], [*levels, 0.0]
    marks.curve(ax, time.shown(edges), row + np.array(levels), f"contact {name}", style.ORANGE, lw=style.THIN)


def _mark(ax: Axes, timing: Timing, row: int, time: Scale) -> None:
    """Write operate, release, reset and bounce times beside the contact's trace at height `row`."""
    phases = (
        (timing.switched_on, timing.operate_time, timing.operate_bounce),
        (timing.switched_off, timing.release_time, timing.release_bounce),
        (timing.switched_on, timing.reset_time, timing.reset_bounce),
    )
    for event, delay, bounce in phases:
        if event is None or delay is None or bounce is None:
            continue
        said = f"{time.shown(delay):.3g} {time.sign}"
        if bounce > 0.0:
            said += f", bounce {time.shown(bounce):.2g} {time.sign}"
        at = float(time.shown(event + delay + bounce))
        marks.beside(ax, said, (at, row + _TRACE), (3.0, 3.0), color=style.INK, zorder=4.0)
