"""Displacement against time, with the drive in a slim strip below: Figs. 3, 6, 7 and any motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.figures.elements import marks, style
from printhammer.figures.elements.curves import places, times_of
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import new_figure, sign, styled, with_strip
from printhammer.hammer.hammer import Hammer
from printhammer.run.motion import Motion

_COLOURS: Final = (style.BLUE, style.ORANGE, style.GREEN)
_HEADROOM: Final = 0.08  # Room above the motion, as a fraction of its range; arbitrary


@styled
def timeline(
    motions: Sequence[Motion],
    until: float,
    *,
    labels: Sequence[str] = (),
    heading: str = "",
    show_firings: bool = False,
    remarks: Sequence[str] = (),
    height: float = 4.2,
) -> Figure:
    """Draw motions of one hammer against time, with the drive in a strip below.

    The lines have the SVG ids "displacement" and "current" (or "force"), with " 1", " 2" appended if there
    are several motions.

    Parameters
    ----------
    motions : sequence of Motion
        Up to three motions of one hammer.
    until : float
        End of the time axis, s.
    labels : sequence of str, optional
        Name of each motion, for the legend.
    heading : str, optional
        Heading above the panel, if there are no labels.
    show_firings : bool, optional
        Whether to mark the firings by triangles.
    remarks : sequence of str, optional
        Sentences shown above the figure; messages of runs that stopped early are added.
    height : float, optional
        Height of the figure, in inches.
    """
    hammer = motions[0].hammer
    figure = new_figure(height)
    panel, strip = with_strip(figure)
    grids = [times_of(motion, 0.0, until) for motion in motions]
    paths = [motion.at(grid)[0] for motion, grid in zip(motions, grids, strict=True)]
    every = [*places(hammer).values(), *(float(end) for path in paths for end in (path.min(), path.max()))]
    room = _HEADROOM * (max(every) - min(every)) or 1e-6
    low, high = min(every) - room, max(every) + room
    way, time = scale("displacement", max(abs(low), abs(high))), scale("time", until)

    panel.set_xlim(0.0, float(time.shown(until)))
    panel.set_ylim(float(way.shown(low)), float(way.shown(high)))
    marks.place_lines(panel, hammer, way)
    several = len(motions) > 1
    for number, (motion, grid, path) in enumerate(zip(motions, grids, paths, strict=True)):
        colour = _COLOURS[number % len(_COLOURS)]
        gid = f"displacement {number + 1}" if several else "displacement"
        # Where motions coincide, the first one is on top.
        order = 3.0 - 0.1 * number
        marks.curve(panel, time.shown(grid), way.shown(path), gid, colour, zorder=order)
        marks.closed(panel, motion, time, way, colour)
        if show_firings:
            fired = motion.drive.times[motion.drive.times <= until]
            marks.firings(panel, fired, time, colour if several else style.BLUE)
    marks.drive_strip(strip, motions, grids, until, _COLOURS[: len(motions)])
    marks.name_lines(panel, hammer, way)
    if labels:
        from matplotlib.lines import Line2D

        lines = zip(_COLOURS, labels, strict=False)
        handles = [Line2D([], [], color=colour, lw=style.THIN + 0.5, label=text) for colour, text in lines]
        marks.legend_above(panel, handles)
    elif heading:
        marks.heading(panel, heading, color=style.INK, pad=4.0)
    label(panel, "y", way)
    messages = [motion.message for motion in motions if motion.message]
    sign(figure, hammer, *remarks, *messages)
    return figure


def between_surfaces(ax: Axes, hammer: Hammer, motion: Motion, above: float) -> float:
    """Draw displacement [µm] against time [ms], with pack and backstop tinted; return the lower margin, µm.

    The lower margin is 8 % of the range of the motion; `above` is the ratio of upper to lower margin.
    """
    ms, um = scale("time").factor, scale("displacement").factor
    assert hammer.front is not None
    low, high = um * float(motion.x.min()), um * float(motion.x.max())
    room = _HEADROOM * (high - low)
    top = high + above * room
    ax.axhspan(um * hammer.front, top, color=style.SURFACES["pack"], alpha=0.14, lw=0.0)
    ax.axhspan(low - room, um * hammer.origin, color=style.SURFACES["backstop"], alpha=0.25, lw=0.0)
    ax.plot(ms * motion.t, um * motion.x, color=style.INK, lw=style.LINE, gid="displacement")
    ax.set_ylim(low - room, top)
    ax.set_ylabel("Displacement  [µm]")
    return room


def current_between(ax: Axes, motion: Motion, largest: float) -> None:
    """Draw current [A] against time [ms], with dashed lines at plus and minus the limit `largest` [A]."""
    ax.plot(scale("time").factor * motion.t, motion.current, color=style.BLUE, lw=style.THIN, gid="current")
    ax.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0)
    marks.dashed(ax.axhline, -largest, largest)
    ax.set_ylabel("Current  [A]")
