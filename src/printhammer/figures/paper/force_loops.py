"""Figure 5: total force against displacement over one cycle, with the loops of settle-out in an insert."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.figures.elements.curves import fired, places, times_of, total_force
from printhammer.figures.elements.marks import HALO, arrows, curve, note, place_lines
from printhammer.figures.elements.room import freest, occupied
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import BLUE, FAINT, HAIR, MUTED, TINY, new_panel, sign, styled
from printhammer.figures.paper.total_force import rigid_remark

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from printhammer.hammer.hammer import Hammer
    from printhammer.run.motion import Motion
    from printhammer.support.arrays import BoolArray, FloatArray

_INSERTS: Final = ((0.52, 0.46), (0.44, 0.4), (0.36, 0.32), (0.3, 0.26))
"""Widths and heights that the insert may have, of the axes."""

_NOTE: Final = (0.4, 0.09)


@styled
def force_loops(hammer: Hammer, *, duration: float | str | None = None) -> Figure:
    """Draw Fig. 5: the sum of all forces, equation (2), against displacement after a single pulse.

    A clockwise loop is energy given to the armature, a counter-clockwise one energy lost; arrow heads tell
    which. The insert shows what follows the second touch of the backstop, where there is one. The motion
    lasts 4 ms unless another duration, s, or text with a unit, is given.
    """
    motion = fired(hammer, duration=duration)
    times = times_of(motion)
    x, total = motion.at(times)[0], total_force(motion, times)
    ends = [*places(hammer).values(), float(x.min()), float(x.max())]
    room = 0.05 * (max(ends) - min(ends)) or 1e-6
    way, force = scale("displacement", max(map(abs, ends))), scale("force")
    figure, ax = new_panel(4.8)
    ax.set_xlim(float(way.shown(min(ends) - room)), float(way.shown(max(ends) + room)))
    low, high = float(total.min()), float(total.max())
    above = (high - low) or 1.0
    # The names of the places are written above the curve.
    ax.set_ylim(float(force.shown(low - 0.08 * above)), float(force.shown(high + 0.21 * above)))
    ax.axhline(0.0, color=FAINT, lw=HAIR, zorder=0.5)
    place_lines(ax, hammer, way, "x")
    curve(ax, way.shown(x), force.shown(total), "force", BLUE, lw=1.0)
    touches = [c.t_in for c in motion.contacts if c.surface == "backstop" and not c.initial and c.peak_force]
    settling = touches[1] if len(touches) > 1 else math.inf
    # Settle-out runs to and fro on nearly one line: its arrows are in the insert.
    cycle = times < settling
    arrows(ax, way.shown(x[cycle]), force.shown(total[cycle]), 10, BLUE, 8.0)
    _annotate(ax, motion, times >= settling, x, total, way, force)
    label(ax, "x", way)
    label(ax, "y", force, "Total force")
    sign(figure, hammer, motion.message, rigid_remark(motion))
    return figure


def _annotate(
    ax: Axes,
    motion: Motion,
    late: BoolArray,
    x: FloatArray,
    total: FloatArray,
    way: Scale,
    force: Scale,
) -> None:
    """Add the insert, if there is a settle-out to show, and what the loops mean, where there is room."""
    points = occupied(ax)
    if late.any():
        left, bottom, width, height = box = _place(points)
        _insert(ax, box, motion, way.shown(x[late]), force.shown(total[late]), way, force)
        # What the insert covers, its tick labels included, is taken.
        covered = np.meshgrid(
            np.linspace(left - 0.07, left + width, 30), np.linspace(bottom - 0.07, bottom + height + 0.05, 30)
        )
        points = np.concatenate([points, np.column_stack([axis.ravel() for axis in covered])])
    corners = [
        (at, level) for level in (0.02, 0.1, 0.7, 0.2, 0.3, 0.42, 0.55) for at in (0.11, 0.3, 0.5, 0.6, 0.02)
    ]
    (left, bottom), _covered = freest(points, _NOTE, corners)
    text = "clockwise: energy given to the armature\ncounter-clockwise: energy lost"
    note(ax, text, (left + 0.01, bottom + 0.015), va="bottom", fontsize=TINY, bbox=HALO)


def _place(points: FloatArray) -> tuple[float, float, float, float]:
    """Return left, bottom, width and height of the insert: as large as fits, best at the upper right."""
    boxes = []
    for width, height in _INSERTS:
        corners = [
            (left, bottom)
            for left in np.linspace(0.915 - width, 0.05, 12).tolist()
            for bottom in np.linspace(0.73 - height, 0.05, 12).tolist()
        ]
        # Its tick labels and title need room too.
        (left, bottom), covered = freest(points, (width + 0.07, height + 0.12), corners)
        boxes.append((covered, (left + 0.07, bottom + 0.07, width, height)))
        if covered == 0:
            break
    return min(boxes, key=lambda entry: entry[0])[1]


def _insert(
    ax: Axes,
    box: tuple[float, float, float, float],
    motion: Motion,
    near: FloatArray,
    push: FloatArray,
    way: Scale,
    force: Scale,
) -> None:
    inset = ax.inset_axes(box)
    room_x, room_y = 0.06 * (np.ptp(near) or 1.0), 0.08 * (np.ptp(push) or 1.0)
    inset.set_xlim(near.min() - room_x, near.max() + room_x)
    inset.set_ylim(push.min() - room_y, push.max() + 2.0 * room_y)
    inset.tick_params(labelsize=TINY, length=2.5)
    inset.axhline(0.0, color=FAINT, lw=HAIR, zorder=0.5)
    place_lines(inset, motion.hammer, way, "x")
    curve(inset, near, push, "settle-out", BLUE, lw=0.7)
    arrows(inset, near, push, 9, BLUE, 6.0)
    inset.set_title(f"settle-out  [{way.sign}, {force.sign}]", fontsize=TINY, color=MUTED, pad=3.0)
