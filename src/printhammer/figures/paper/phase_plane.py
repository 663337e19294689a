"""Figure 10: the phase plane of the armature after a single pulse."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.figures.elements.curves import fired, orbit, places, times_of
from printhammer.figures.elements.marks import arrows, curve, place_lines
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import BLUE, FAINT, HAIR, new_panel, sign, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer


@styled
def phase_plane(hammer: Hammer, *, duration: float | str | None = None) -> Figure:
    """Draw Fig. 10: velocity against displacement after a single pulse; arrows tell the direction of time.

    The motion lasts 4 ms unless another duration, s, or text with a unit, is given.
    """
    motion = fired(hammer, duration=duration)
    x, v = orbit(motion, times_of(motion))
    ends = [*places(hammer).values(), float(x.min()), float(x.max())]
    low, high = min(ends), max(ends)
    room = 0.06 * (high - low) or 1e-6
    slow, fast = float(v.min()), float(v.max())
    above = (fast - slow) or 1e-3
    way, speed = scale("displacement", max(abs(low), abs(high))), scale("velocity")
    figure, ax = new_panel(4.4)
    ax.set_xlim(float(way.shown(low - room)), float(way.shown(high + room)))
    # The names of the places are written above the orbit.
    ax.set_ylim(float(speed.shown(slow - 0.06 * above)), float(speed.shown(fast + 0.17 * above)))
    ax.axhline(0.0, color=FAINT, lw=HAIR, zorder=0.5)
    place_lines(ax, hammer, way, "x")
    curve(ax, way.shown(x), speed.shown(v), "orbit", BLUE, lw=1.1)
    ax.plot(way.shown(x[:1]), speed.shown(v[:1]), ls="none", marker="o", ms=4.0, color=BLUE, gid="start")
    arrows(ax, way.shown(x), speed.shown(v), 10, BLUE)
    label(ax, "x", way)
    label(ax, "y", speed)
    sign(figure, hammer, motion.message)
    return figure
