"""Figures of periodic orbits: over strobe points in the plane of states, and against time."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.chaos.orbits.collection import Orbits
from printhammer.chaos.orbits.orbit import Orbit
from printhammer.chaos.strobe.points import strobe as strobed
from printhammer.errors import InputError
from printhammer.figures.chaos.strobe import shown_period
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import (
    ALONG_X,
    HALO,
    beside,
    dots,
    heading,
    name_lines,
    note,
    place_lines,
)
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.run.motion import Motion
from printhammer.run.regime import Regime
from printhammer.support.arrays import FloatArray

POINTS: Final = 600  # Arbitrary
"""Number of strobe points drawn under the orbits, after a third as many discarded firings."""

_MARKS: Final = (("o", style.BLUE), ("s", style.ORANGE), ("^", style.GREEN), ("D", style.YELLOW))
"""Marker and colour of orbits of 1, 2, 3 and 4 firings."""
_LONGER: Final = ("x", style.MUTED)
_TRACES: Final = 4  # Orbits drawn against time; arbitrary
_ROOM: Final = 0.07  # Margin around the points, as a fraction of their range; arbitrary
_SIZE: Final = 5.0  # Size of a mark, points; arbitrary
_LINES: Final = ("-", "--", "-.", ":")


@styled
def plot(orbits: Orbits, *, points: int = POINTS, longest: int | None = None) -> Figure:
    """Draw the states of orbits at the firings, over strobe points of the train from rest.

    `points` is the number of strobe points. Stable orbits are filled marks, all other orbits open marks; the
    panel below shows the first four orbits against time. Orbits with a period above `longest` firings are
    omitted.
    """
    shown = [orbit for orbit in orbits if longest is None or orbit.firings <= longest]
    traced = shown[:_TRACES]
    figure = new_figure(6.6 if traced else 4.6)
    rows = figure.add_gridspec(2 if traced else 1, 1, height_ratios=(1.7, 1.0) if traced else (1.0,))
    ax = figure.add_subplot(rows[0])
    under = _strobe_points(orbits.regime, points)
    _plane(ax, orbits.regime, shown, under)
    counts = ", ".join(f"{count} {kind}" for kind, count in orbits.counts.items())
    heading(ax, f"{shown_period(orbits.regime.period)}: {counts or 'no orbit found'}")
    if traced:
        _traces(figure.add_subplot(rows[1]), traced)
    sign(figure, orbits.regime.hammer)
    return figure


@styled
def plot_orbit(orbit: Orbit) -> Figure:
    """Draw one orbit in the plane of displacement and velocity, and against time.

    Marks show the states at the firings.
    """
    if not orbit.ok:
        raise InputError(
            f"orbit: expected an orbit that was found, not {orbit.name}: {orbit.status}", key="orbit"
        )
    figure = new_figure(3.4, width=1.35 * style.WIDTH)
    left, right = figure.subplots(1, 2)
    motion = orbit.motion()
    way, speed = scale("displacement", float(np.abs(motion.x).max())), scale("velocity")
    curve = way.shown(motion.x), speed.shown(motion.v)
    left.plot(*curve, color=style.INK, lw=style.THIN, gid="curve", zorder=2.0)
    _mark(left, orbit, way, speed)
    _room(left, *curve)
    place_lines(left, orbit.regime.hammer, way, side="x")
    label(left, "x", way)
    label(left, "y", speed)
    heading(left, f"{shown_period(orbit.regime.period)}: {orbit.name}")
    _traces(right, [orbit])
    multipliers = ", ".join(_number(multiplier) for multiplier in orbit.multipliers)
    note(right, f"multipliers {multipliers}", (0.03, 0.97), fontsize=style.TINY, bbox=HALO)
    sign(figure, orbit.regime.hammer)
    return figure


def _strobe_points(regime: Regime, points: int) -> FloatArray:
    """Compute strobe points of the train from rest, shape (n, 2); empty without a rest state."""
    if points < 1:
        return np.zeros((0, 2))
    own: dict[str, Any] = (
        {"drive": regime.drive}
        if regime.drive is not None
        else {"period": regime.period, "waveform": regime.waveform, "overlap": regime.overlap}
    )
    try:
        strobe = strobed(regime.hammer, points=points, transient=points // 3, verdict=False, **own)
    except InputError:
        return np.zeros((0, 2))
    known = np.isfinite(strobe.x)
    return np.column_stack([strobe.x[known], strobe.v[known]])


def _plane(ax: Axes, regime: Regime, orbits: list[Orbit], under: FloatArray) -> None:
    every = np.concatenate([under, *(np.column_stack([orbit.x, orbit.v]) for orbit in orbits)])
    way, speed = scale("displacement", float(np.abs(every[:, 0]).max(initial=0.0))), scale("velocity")
    name = "train from rest" if len(under) else None
    how = {"marker": ".", "gid": "points", "zorder": 1.5, "label": name}
    dots(ax, way.shown(under[:, 0]), speed.shown(under[:, 1]), 3.0, "#9a9a9a", **how)
    named: set[str] = set()
    for orbit in orbits:
        kind = "stable" if orbit.stable else "not stable"
        firings = str(orbit.firings) if orbit.firings <= len(_MARKS) else f"{len(_MARKS) + 1} or more"
        name = f"period {firings}, {kind}"
        _mark(ax, orbit, way, speed, None if name in named else name)
        named.add(name)
    if len(every):
        _room(ax, way.shown(every[:, 0]), speed.shown(every[:, 1]))
    else:
        window = regime.window
        ax.set_xlim(*(float(way.shown(end)) for end in window.x))
        ax.set_ylim(*(float(speed.shown(end)) for end in window.v))
    for name, place in (("backstop", regime.hammer.position), ("pack", regime.hammer.front)):
        low, high = ax.get_xlim()
        if place is not None and low < float(way.shown(place)) < high:
            ax.axvline(float(way.shown(place)), color=style.MUTED, lw=style.HAIR, zorder=1.0).set_gid(name)
            beside(ax, name, (float(way.shown(place)), 0.0), (2, 3), xycoords=ALONG_X, zorder=4.0)
    label(ax, "x", way, "Displacement at the firing")
    label(ax, "y", speed)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize=style.TINY, loc="best", framealpha=0.85, edgecolor=style.FAINT, ncols=1)


def _mark(ax: Axes, orbit: Orbit, way: Scale, speed: Scale, name: str | None = None) -> None:
    """Mark the states of an orbit at its firings: filled if the orbit is stable, else open."""
    marker, colour = _style(orbit)
    longer = marker == _LONGER[0]
    ax.plot(
        way.shown(orbit.x),
        speed.shown(orbit.v),
        ls="none",
        marker="P" if longer and orbit.stable else marker,
        ms=0.6 * _SIZE if longer else _SIZE,
        mew=0.6 if longer else style.THIN,
        mec=colour,
        mfc=colour if orbit.stable else "white" if orbit.firings == 1 else "none",
        gid="orbit",
        zorder=4.0 - 0.1 * min(orbit.firings, 10),
        label=name,
    )


def _style(orbit: Orbit) -> tuple[str, str]:
    return _MARKS[orbit.firings - 1] if orbit.firings <= len(_MARKS) else _LONGER


def _traces(ax: Axes, orbits: list[Orbit]) -> None:
    """Draw the displacement of orbits against the time from their first firing."""
    motions = [orbit.motion() for orbit in orbits]
    hammer = orbits[0].regime.hammer
    way = scale("displacement", max(float(np.abs(motion.x).max()) for motion in motions))
    time = scale("time", max(orbit.period for orbit in orbits))
    for k, (orbit, motion) in enumerate(zip(orbits, motions, strict=True)):
        since, x = _from_firing(orbit, motion)
        ax.plot(
            time.shown(since),
            way.shown(x),
            ls=_LINES[k % len(_LINES)],
            lw=style.THIN,
            color=_style(orbit)[1],
            gid="trace",
            label=f"{orbit.name}, |µ| = {abs(orbit.multipliers[0]):.3g}",
            zorder=3.0,
        )
    longest = max(orbits, key=lambda orbit: orbit.period)
    ax.set_xlim(0.0, float(time.shown(longest.period)))
    low, high = ax.get_ylim()
    ax.set_ylim(low - 0.03 * (high - low), high + (0.26 if len(orbits) > 1 else 0.13) * (high - low))
    for k in range(1, longest.firings):
        ax.axvline(float(time.shown(k * longest.regime.period)), color=style.FAINT, lw=style.HAIR, zorder=0.5)
    place_lines(ax, hammer, way)
    name_lines(ax, hammer, way)
    label(ax, "x", time, "Time from the first firing")
    label(ax, "y", way)
    if len(orbits) > 1:
        ax.legend(fontsize=style.TINY, loc="upper right", framealpha=0.85, edgecolor=style.FAINT, ncols=2)


def _from_firing(orbit: Orbit, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Return times since the first firing [s] and displacements [m] over one period of an orbit."""
    since = motion.t - motion.start + orbit.phase * orbit.regime.period
    if orbit.phase == 0.0:
        return since, motion.x
    late = int(np.searchsorted(since, (1.0 - 1e-9) * orbit.period))
    # The last point repeats the first point.
    times = np.concatenate([since[late:-1] - orbit.period, since[:late]])
    return times, np.concatenate([motion.x[late:-1], motion.x[:late]])


def _room(ax: Axes, x: FloatArray, v: FloatArray) -> None:
    """Set axes limits that include all points, with a small margin."""
    for values, put in ((x, ax.set_xlim), (v, ax.set_ylim)):
        low, high = float(values.min()), float(values.max())
        room = _ROOM * (high - low) or 1e-2 * abs(high) or 1e-9
        put(low - room, high + room)


def _number(multiplier: complex) -> str:
    """Format a Floquet multiplier; a real multiplier without an imaginary part."""
    real = f"{multiplier.real:.4g}"
    return real if multiplier.imag == 0.0 else f"{real} {multiplier.imag:+.4g} i"
