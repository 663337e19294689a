"""Impact maps: velocity at touch against the time since the last firing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.figures.chaos.strobe import shown_period
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import dots, heading, note
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import new_panel, sign, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.chaos import Section


@styled
def plot(section: Section) -> Figure:
    """Draw the touches of a surface: velocity against the time since the last firing.

    The whole period is shown.
    """
    figure, ax = new_panel(4.2)
    time, speed = scale("time", section.period), scale("velocity")
    colour = style.BLUE if section.surface == "backstop" else style.ORANGE
    ax.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=1.0)
    dots(ax, time.shown(section.since), speed.shown(section.v), 2.2, colour, gid="touches", zorder=3.0)
    ax.set_xlim(0.0, float(time.shown(section.period)))
    ax.margins(y=0.08)
    fired = f"fired every {shown_period(section.period)}"
    heading(ax, f"{len(section.t)} touches of the {section.surface}, {fired}")
    if not len(section.t):
        note(ax, "no touches", (0.5, 0.5), ha="center", va="center", color=style.YELLOW)
    label(ax, "x", time, "Time since the last firing")
    label(ax, "y", speed, "Velocity at touch")
    sign(figure, section.hammer, f"{section.remark}." if section.remark else "")
    return figure
