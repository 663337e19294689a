"""Figure 4: total force on the armature against time after a single pulse."""

from __future__ import annotations

from typing import TYPE_CHECKING

from printhammer.figures.elements import style
from printhammer.figures.elements.curves import fired, shown_until, times_of
from printhammer.figures.elements.curves import total_force as force_at
from printhammer.figures.elements.marks import contact_spans, curve, drive_strip, legend_above
from printhammer.figures.elements.scales import label, scale
from printhammer.figures.elements.style import new_figure, sign, styled, with_strip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer
    from printhammer.run.motion import Motion


@styled
def total_force(hammer: Hammer, *, duration: float | str | None = None) -> Figure:
    """Draw Fig. 4: the sum of all forces on the armature, equation (2), after a single pulse.

    The impacts on a rigid backstop have no finite force and are not drawn. The time shown ends, unless given,
    when the armature has settled, at most after 4 ms.
    """
    from matplotlib.patches import Patch

    motion = fired(hammer, duration=duration)
    until = motion.end if duration is not None else shown_until(motion)
    times = times_of(motion, 0.0, until)
    total = force_at(motion, times)
    time, force = scale("time", until), scale("force")
    figure = new_figure(4.2)
    panel, strip = with_strip(figure)
    panel.set_xlim(0.0, float(time.shown(until)))
    low, high = min(float(total.min()), 0.0), max(float(total.max()), 0.0)
    room = 0.08 * (high - low) or 1.0
    panel.set_ylim(float(force.shown(low - room)), float(force.shown(high + room)))
    panel.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0.6)
    contact_spans(panel, motion, until, time)
    curve(panel, time.shown(times), force.shown(total), "total force", style.INK, lw=1.0)
    touched = {contact.surface for contact in motion.contacts}
    handles = [
        Patch(color=style.SURFACES[name], alpha=0.3, lw=0.0, label=f"touches the {name}")
        for name in ("pack", "backstop")
        if name in touched
    ]
    if handles:
        legend_above(panel, handles, handlelength=1.2)
    drive_strip(strip, [motion], [times], until, [style.BLUE])
    label(panel, "y", force, "Total force")
    sign(figure, hammer, motion.message, rigid_remark(motion))
    return figure


def rigid_remark(motion: Motion) -> str:
    """Return one sentence on what a force diagram cannot show of this motion; empty if nothing."""
    impacts = any(c.surface == "backstop" and c.peak_force is None and not c.initial for c in motion.contacts)
    return "The rigid backstop changes the velocity at once; its impulses are not drawn." if impacts else ""
