"""Figures 2, 4, 5 and 10: static forces, total force, force loops, phase plane.

Figure 4: total force on the armature against time. Figure 5: total force against displacement over one cycle,
with the loops of settle-out in an inset.

Figure 10: phase plane of the armature after a single pulse.

Figure 2: magnetic force against displacement at several currents, the spring force and its reflection.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.errors import InputError
from printhammer.figures.elements import style
from printhammer.figures.elements.curves import fired, orbit, places, reach, shown_until, times_of
from printhammer.figures.elements.curves import total_force as force_at
from printhammer.figures.elements.marks import (
    HALO,
    arrows,
    contact_spans,
    curve,
    drive_strip,
    freest,
    legend_above,
    note,
    occupied,
    place_lines,
)
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import (
    BLUE,
    FAINT,
    HAIR,
    MUTED,
    TINY,
    new_figure,
    new_panel,
    sign,
    styled,
    with_strip,
)
from printhammer.hammer.hammer import Hammer
from printhammer.run.motion import Motion
from printhammer.support.arrays import BoolArray, FloatArray


@styled
def total_force(hammer: Hammer, *, duration: float | str | None = None) -> Figure:
    """Draw Fig. 4: the sum of all forces on the armature, equation (2), after a single pulse.

    Impacts on a rigid backstop have no finite force and are not drawn. By default the time axis ends when the
    armature has settled.
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
    """Return the remark that a force diagram omits rigid impacts; empty if there are no rigid impacts."""
    impacts = any(c.surface == "backstop" and c.peak_force is None and not c.initial for c in motion.contacts)
    return "The rigid backstop changes the velocity at once; its impulses are not drawn." if impacts else ""


_INSERTS: Final = ((0.52, 0.46), (0.44, 0.4), (0.36, 0.32), (0.3, 0.26))
"""Candidate sizes of the inset, width and height as fractions of the axes, largest first; arbitrary."""

_NOTE: Final = (0.4, 0.09)  # Width and height of the note on loops, fractions of the axes; arbitrary


@styled
def force_loops(hammer: Hammer, *, duration: float | str | None = None) -> Figure:
    """Draw Fig. 5: the sum of all forces, equation (2), against displacement after a single pulse.

    The area of a clockwise loop is energy given to the armature, the area of a counter-clockwise loop energy
    lost by the armature; arrow heads show the direction. The inset shows the motion after the second touch of
    the backstop, if any. The motion lasts 4 ms by default; `duration` is in s, or text with a unit.
    """
    motion = fired(hammer, duration=duration)
    times = times_of(motion)
    x, total = motion.at(times)[0], force_at(motion, times)
    ends = [*places(hammer).values(), float(x.min()), float(x.max())]
    room = 0.05 * (max(ends) - min(ends)) or 1e-6
    way, force = scale("displacement", max(map(abs, ends))), scale("force")
    figure, ax = new_panel(4.8)
    ax.set_xlim(float(way.shown(min(ends) - room)), float(way.shown(max(ends) + room)))
    low, high = float(total.min()), float(total.max())
    above = (high - low) or 1.0
    # Leave room above the curve for the names of the positions.
    ax.set_ylim(float(force.shown(low - 0.08 * above)), float(force.shown(high + 0.21 * above)))
    ax.axhline(0.0, color=FAINT, lw=HAIR, zorder=0.5)
    place_lines(ax, hammer, way, "x")
    curve(ax, way.shown(x), force.shown(total), "force", BLUE, lw=1.0)
    touches = [c.t_in for c in motion.contacts if c.surface == "backstop" and not c.initial and c.peak_force]
    settling = touches[1] if len(touches) > 1 else math.inf
    # Settle-out oscillates along nearly one line: its arrows are drawn in the inset only.
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
    """Add the inset of the settle-out, if any, and a note on the meaning of the loops.

    `x` and `total` are the displacement [m] and the total force [N]; `late` is the mask of the settle-out;
    `way` and `force` are the scales of the axes.
    """
    points = occupied(ax)
    if late.any():
        left, bottom, width, height = box = _place(points)
        _insert(ax, box, motion, way.shown(x[late]), force.shown(total[late]), way, force)
        # No label may cover the inset and its tick labels.
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
    """Choose left, bottom, width and height of the inset, as fractions of the axes.

    The inset is as large as possible without covering `points`, and preferably upper right.
    """
    boxes = []
    for width, height in _INSERTS:
        corners = [
            (left, bottom)
            for left in np.linspace(0.915 - width, 0.05, 12).tolist()
            for bottom in np.linspace(0.73 - height, 0.05, 12).tolist()
        ]
        # Include the room of tick labels and title.
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


@styled
def phase_plane(hammer: Hammer, *, duration: float | str | None = None) -> Figure:
    """Draw Fig. 10: velocity against displacement after a single pulse, with arrows in the direction of time.

    The motion lasts 4 ms by default; `duration` is in s, or text with a unit.
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
    # Leave room above the orbit for the names of the positions.
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


CURRENTS: Final = (0.0, 0.5, 1.0, 1.5, 2.0)
"""Coil currents drawn in the paper's Fig. 2, A."""

_POINTS: Final = 400  # Points of a static curve: more than a picture resolves; arbitrary
_HALF_WIDTH, _ENOUGH, _PREFERRED = 0.04, 0.055, 0.3
"""Half-width, sufficient clearance and preferred position of a label, in fractions of the axes; arbitrary."""


@styled
def statics(hammer: Hammer, *, currents: Sequence[float] = CURRENTS) -> Figure:
    """Draw Fig. 2: net magnetic force, equation (3), at several currents, and spring force, equation (4).

    Parameters
    ----------
    currents : sequence of float, optional
        Coil currents [A]; currents outside the range of the magnet's law are skipped.

    Raises
    ------
    InputError
        The hammer has no magnet or no defined stroke, or no current is in range.
    """
    from printhammer.hammer.static_force import StaticForce

    if hammer.magnet is None:
        raise InputError(f"the hammer {hammer.name!r} has no magnet, whose force Fig. 2 shows", key="magnet")
    low, high = getattr(hammer.magnet, "current_range", (-np.inf, np.inf))
    inside = [current for current in currents if low <= current <= high]
    if not inside:
        raise InputError(
            f"currents = {list(currents)} A: none is in the range {low:g} to {high:g} A of the magnet's law",
            key="currents",
            value=list(currents),
        )
    start, end = reach(hammer)
    x = np.linspace(start, end, _POINTS)
    if places(hammer):
        x = np.unique(np.concatenate([x, list(places(hammer).values())]))
        x = x[(x >= start) & (x <= end)]
    figure, ax = new_panel(4.6)
    way, force = scale("displacement", end), scale("force")
    static = StaticForce(hammer)
    curves = {
        f"{current:g} A": force.shown([static.magnet(place, current) for place in x.tolist()])
        for current in inside
    }
    spring = None
    if hammer.spring is not None:
        spring = force.shown([static.spring(place) for place in x.tolist()])

    ax.set_xlim(float(way.shown(start)), float(way.shown(end)))
    ax.set_ylim(*_limits(hammer, x, [*curves.values()], spring))
    ax.axhline(0.0, color=style.FAINT, lw=style.HAIR, zorder=0.5)
    place_lines(ax, hammer, way, "x")
    for (name, values), colour in zip(curves.items(), _colours(len(curves)), strict=True):
        curve(ax, way.shown(x), values, f"magnet {name}", colour)
    if spring is not None:
        curve(ax, way.shown(x), spring, "spring", style.ORANGE)
        curve(ax, way.shown(x), -spring, "spring reflected", style.ORANGE, ls=(0, (4, 2)))
        ax.legend(
            handles=ax.lines[-2:],
            labels=["spring force", "its reflection"],
            loc="upper center",
            bbox_to_anchor=(0.71, 1.0),
            fontsize=style.SMALL,
            edgecolor="none",
        )
    lines = way.shown(list(places(hammer).values()))
    _label_curves(ax, way.shown(x), lines, curves, [] if spring is None else [spring, -spring])
    label(ax, "x", way)
    label(ax, "y", force)
    sign(figure, hammer)
    return figure


def _limits(
    hammer: Hammer, x: FloatArray, family: list[FloatArray], spring: FloatArray | None
) -> tuple[float, float]:
    """Compute force limits of the axes that include every curve over the stroke."""
    ends = list(places(hammer).values())
    stroke = (x >= min(ends)) & (x <= max(ends)) if len(ends) > 1 else np.full(x.shape, True)
    curves = [*family, *([] if spring is None else [spring, -spring])]
    values = np.concatenate([curve[stroke] for curve in curves])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    room = 0.1 * (high - low) or 1.0
    # Leave room above the curves for the names of the positions.
    return low - room, high + 2.2 * room


def _colours(count: int) -> list[str]:
    if count == 1:
        return [style.BLUE]
    picks = np.linspace(0, len(style.FAMILY) - 1, count).round().astype(int)
    return [style.FAMILY[pick] for pick in reversed(picks)]


def _label_curves(
    ax: Axes, x: FloatArray, lines: FloatArray, curves: dict[str, FloatArray], further: list[FloatArray]
) -> None:
    """Label each of `curves` far from the other curves, the curves `further`, and the position lines.

    `x` are the abscissas of all curves, and `lines` the abscissas of the vertical lines, in data units.
    """
    (left, right), (bottom, top) = ax.get_xlim(), ax.get_ylim()
    across = (x - left) / (right - left)
    up = {name: (values - bottom) / (top - bottom) for name, values in curves.items()}
    marked = ((lines - left) / (right - left)).tolist()
    placed: list[tuple[float, float]] = []
    for name, height in up.items():
        others = [other for key, other in up.items() if key != name]
        others += [(values - bottom) / (top - bottom) for values in further]
        clear = np.full(x.shape, 1.0)
        for other in others:
            # A label is wider than high: measure the clearance over its whole width.
            distance = np.abs(other - height)
            near = np.array(
                [np.nanmin(distance[np.abs(across - at) < _HALF_WIDTH], initial=1.0) for at in across]
            )
            clear = np.minimum(clear, near)
        for line in marked:
            clear = np.where(np.abs(across - line) < 1.3 * _HALF_WIDTH, 0.0, clear)
        for column, level in placed:
            clear[(np.abs(across - column) < 2.2 * _HALF_WIDTH) & (np.abs(height - level) < _ENOUGH)] = -1.0
        clear[~((across > 0.06) & (across < 0.94) & (height > 0.05) & (height < 0.95))] = -1.0
        merit = np.minimum(clear, _ENOUGH) - 0.02 * np.abs(across - _PREFERRED)
        row = int(np.nanargmax(merit))
        placed.append((float(across[row]), float(height[row])))
        ax.annotate(
            name,
            (x[row], curves[name][row]),
            ha="center",
            va="center",
            fontsize=style.SMALL,
            color=style.FAMILY[-1],
            zorder=5.0,
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.9, "pad": 1.0},
        )
