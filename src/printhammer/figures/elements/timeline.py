"""Displacement against time, with the drive in a slim strip below: Figs. 3, 6, 7 and any motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from printhammer.figures.elements import style
from printhammer.figures.elements.curves import places, times_of
from printhammer.figures.elements.marks import (
    curve,
    drive_strip,
    firings,
    legend_above,
    name_lines,
    place_lines,
)
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import new_figure, sign, styled, with_strip

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer
    from printhammer.run.motion import Motion
    from printhammer.support.arrays import FloatArray

_LOOKS: Final = (
    (style.BLUE, "-", style.LINE),
    (style.ORANGE, "-", style.LINE),
    (style.GREEN, "-", style.LINE),
)
_HEADROOM: Final = 0.08


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
    """Draw one or more motions of one hammer against time, with the drive below.

    Its lines have the gids "displacement" and "current" (or "force"), followed by " 1", " 2" where there are
    several motions.

    Parameters
    ----------
    motions : sequence of Motion
        Up to three motions of one hammer.
    until : float
        End of the time axis, s.
    labels : sequence of str, optional
        A name for each motion.
    heading : str, optional
        What is shown, written above the panel where there are no names.
    show_firings : bool, optional
        Mark the firings by triangles.
    remarks : sequence of str, optional
        Sentences shown above the figure; those of runs that stopped early are added.
    height : float, optional
        Height of the figure, in.
    """
    hammer = motions[0].hammer
    figure = new_figure(height)
    panel, strip = with_strip(figure)
    grids = [times_of(motion, 0.0, until) for motion in motions]
    paths = [motion.at(grid)[0] for motion, grid in zip(motions, grids, strict=True)]
    low, high = _limits(hammer, paths)
    way, time = scale("displacement", max(abs(low), abs(high))), scale("time", until)

    panel.set_xlim(0.0, float(time.shown(until)))
    panel.set_ylim(float(way.shown(low)), float(way.shown(high)))
    place_lines(panel, hammer, way)
    several = len(motions) > 1
    for number, (motion, grid, path) in enumerate(zip(motions, grids, paths, strict=True)):
        colour, dash, width = _LOOKS[number % len(_LOOKS)]
        gid = f"displacement {number + 1}" if several else "displacement"
        # Later motions lie under earlier ones where they agree.
        order = 3.0 - 0.1 * number
        curve(panel, time.shown(grid), way.shown(path), gid, colour, ls=dash, lw=width, zorder=order)
        if show_firings:
            firings(
                panel,
                motion.drive.times[motion.drive.times <= until],
                time,
                colour if several else style.BLUE,
            )
    drive_strip(strip, motions, grids, until, [look[0] for look in _LOOKS[: len(motions)]])
    name_lines(panel, hammer, way)
    if labels:
        _legend(figure, labels)
    elif heading:
        panel.set_title(heading, loc="left", fontsize=style.SMALL, color=style.INK, pad=4.0)
    label(panel, "y", way)
    messages = [motion.message for motion in motions if motion.message]
    sign(figure, hammer, *remarks, *messages)
    return figure


def _limits(hammer: Hammer, paths: Sequence[FloatArray]) -> tuple[float, float]:
    """Return limits of the displacement, m, that hold the motions and the places of the hammer."""
    every = [*places(hammer).values(), *(float(end) for path in paths for end in (path.min(), path.max()))]
    low, high = min(every), max(every)
    room = _HEADROOM * (high - low) or 1e-6
    return low - room, high + room


def _legend(figure: Figure, labels: Sequence[str]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=_LOOKS[number][0], ls=_LOOKS[number][1], lw=style.THIN + 0.5, label=text)
        for number, text in enumerate(labels)
    ]
    legend_above(figure.axes[0], handles)
