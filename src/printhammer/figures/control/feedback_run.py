"""A run with feedback: motion, what the sensor showed, and the current."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from printhammer.figures.elements import style
from printhammer.figures.elements.style import new_figure, sign, styled, with_strip
from printhammer.units import from_si

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from printhammer.control.feedback.comparison import Feedback


@styled
def plot(found: Feedback) -> Figure:
    """Draw the run of a comparison.

    Displacement, the samples that the controller looked at, the times at which touches are wanted (short
    lines at the front of the pack); below, the current and its bounds.
    """
    figure = new_figure(4.6)
    panel, strip = with_strip(figure, 2.6)
    run, hammer = found.run.motion, found.driven
    assert hammer.front is not None
    ms, um = from_si(1.0, "s", "ms"), from_si(1.0, "m", "um")
    front, stop = um * hammer.front, um * hammer.origin
    low, high = um * float(run.x.min()), um * float(run.x.max())
    room = 0.08 * (high - low)
    panel.axhspan(front, high + 2.0 * room, color=style.SURFACES["pack"], alpha=0.14, lw=0.0)
    panel.axhspan(low - room, stop, color=style.SURFACES["backstop"], alpha=0.25, lw=0.0)
    panel.plot(ms * run.t, um * run.x, color=style.INK, lw=style.LINE, gid="displacement")
    panel.plot(
        ms * found.run.times,
        um * found.run.shown,
        color=style.ORANGE,
        ls="none",
        marker=".",
        ms=2.0,
        label="what the sensor showed",
        gid="samples",
    )
    panel.vlines(
        ms * found.run.due,
        front - 0.6 * room,
        front + 0.6 * room,
        color=style.BLUE,
        lw=style.LINE,
        label="touch wanted",
        gid="due",
    )
    panel.set_ylim(low - room, high + 2.0 * room)
    panel.set_ylabel("Displacement  [µm]")
    panel.set_title(
        f"Slots {found.run.pattern} at {found.rate:.6g} Hz with feedback", loc="left", fontsize=style.SMALL
    )
    panel.legend(fontsize=style.SMALL, frameon=False, loc="upper right", ncols=2)
    strip.plot(ms * run.t, run.current, color=style.BLUE, lw=style.THIN, gid="current")
    strip.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0)
    for bound in (-found.driver.current, found.driver.current):
        strip.axhline(bound, color=style.MUTED, lw=style.HAIR, ls=(0, (4, 3)))
    strip.set_ylim(-1.2 * found.driver.current, 1.2 * found.driver.current)
    strip.set_ylabel("Current  [A]")
    strip.set_xlabel("Time  [ms]")
    first, last = float(found.run.due[0]), float(found.run.due[-1])
    span = found.single.flight_time
    panel.set_xlim(ms * (first - 1.3 * span), ms * min(last + 3.0 * span, float(np.max(run.t))))
    sign(figure, hammer)
    return figure
