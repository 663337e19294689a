"""Figures of bifurcation diagrams: states at the firings against a parameter, and classification bands."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.chaos.bifurcation.diagram import Bifurcation, cells, hysteresis
from printhammer.errors import InputError
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import dots, legend_below, note
from printhammer.figures.elements.scales import Scale, label, scale
from printhammer.figures.elements.style import new_figure, sign, styled
from printhammer.hammer.names import PERIOD
from printhammer.support.arrays import FloatArray

SHADES: Final = {
    "period-1": style.BLUE,
    "period-2": style.YELLOW,
    "period-3": style.GREEN,
    "period-4": "#56b4e9",
    "other period": "#cc79a7",
    "strange": "#4d4d4d",
    "superstable": "#8a6d3b",
    "undecided": "#c4c4c4",
    "run ended early": "#7a1f1f",
}
"""Colour of the bands, by the classification of the motion."""

WAYS: Final = {"from rest": style.INK, "up": style.ORANGE, "down": "#7b3fa0"}
"""Colour of the points reached in only one direction of the sweep; distinct from the band colours."""

_POINT: Final = 0.7  # Size of a point, points; arbitrary
_MOST: Final = 3_000_000
"""Number of points above which the points are drawn smaller; arbitrary."""
_SPARSE: Final = 150
"""Number of parameter values up to which the points are drawn larger; arbitrary."""
_FEW: Final = 1e-3  # Fraction of the states outside the limits at either end; arbitrary


@styled
def plot(
    diagram: Bifurcation,
    *,
    show: Literal["x", "v"] = "x",
    orbits: Iterable[Any] = (),
    limits: tuple[float, float] | None = None,
) -> Figure:
    """Draw a bifurcation diagram with bands that classify the motion.

    Black points are reached in all directions of the sweep, orange points only with rising values, violet
    points only with falling values.

    Parameters
    ----------
    show : str, optional
        Quantity on the vertical axis: "x" for displacements at the firings, "v" for velocities.
    orbits : iterable, optional
        Orbits to draw on top in green: periodic orbits of `printhammer.orbits` (filled circles if stable,
        else open circles), branches of `printhammer.continuation` (solid if stable, else dotted), and
        collections of both.
    limits : tuple of float, optional
        Range of the vertical axis, SI. The default range excludes one point in a thousand at each end, and
        the figure states the number of excluded points.

    Raises
    ------
    InputError
        The diagram has no states, or an orbit belongs to another parameter or phase.
    """
    if show not in ("x", "v"):
        raise InputError.of("show", show, "'x' or 'v'")
    states = getattr(diagram, show)
    if not np.isfinite(states).any():
        raise InputError(
            "the diagram has no states to draw",
            key="states",
            expected="at least one run that reaches its recorded firings",
        )
    figure = new_figure(4.8)
    bands = len(diagram.directions)
    grid = figure.add_gridspec(2, 1, height_ratios=(10.0, 0.55 * bands), hspace=0.02)
    ax = figure.add_subplot(grid[0])
    strip = figure.add_subplot(grid[1], sharex=ax)
    across = parameter_scale(diagram)
    up = scale("displacement", float(np.nanmax(np.abs(states)))) if show == "x" else scale("velocity")
    _points(ax, diagram, states, across, up)
    for orbit in _each(orbits):
        _orbit(ax, diagram, orbit, show, across, up)
    low, high = limits or _most(states)
    ax.set_ylim(float(up.shown(low)), float(up.shown(high)))
    outside = int(((states < low) | (states > high)).sum())
    if outside:
        note(ax, f"{outside} of {int(np.isfinite(states).sum())} points outside", (0.98, 0.97), ha="right")
    if show == "x" and diagram.regime.hammer.position is not None:
        position = diagram.regime.hammer.position
        if low < position < high:
            level = float(up.shown(position))
            ax.axhline(level, color=style.MUTED, lw=style.HAIR, zorder=1.0, gid="backstop")
    values = across.shown(diagram.values)
    ax.set_xlim(float(values[0]), float(values[-1]) if len(values) > 1 else float(values[0]) * 1.02 + 1e-9)
    label(ax, "y", up, f"{up.label} at the firing" if not diagram.phase else up.label)
    ax.tick_params(axis="x", labelbottom=False, top=True, bottom=True)
    _bands(strip, diagram, across)
    label(strip, "x", across)
    _key(strip, diagram)
    bad = int((diagram.status != "ok").sum())
    sign(figure, diagram.regime.hammer, f"{bad} of {diagram.status.size} runs ended early." if bad else "")
    return figure


def parameter_scale(diagram: Bifurcation) -> Scale:
    """Return the scale of the parameter axis of a diagram: name and units."""
    note = diagram.regime.quantity(diagram.parameter)
    unit, meaning = note.si, note.meaning
    if diagram.parameter == PERIOD:
        time = scale("time", float(np.abs(diagram.values).max()))
        return Scale(meaning.capitalize(), time.si, time.unit)
    name = meaning.capitalize() if diagram.parameter == "rate" else f"{diagram.parameter}: {meaning}"
    return Scale(name, unit, unit)


def _most(states: FloatArray) -> tuple[float, float]:
    """Return axis limits that include all states but one in a thousand at each end."""
    known = states[np.isfinite(states)]
    low, high = (float(end) for end in np.quantile(known, [_FEW, 1.0 - _FEW]))
    room = 0.06 * (high - low) or 0.01 * abs(high) or 1.0
    return low - room, high + room


def _points(ax: Axes, diagram: Bifurcation, states: FloatArray, across: Scale, up: Scale) -> None:
    values = across.shown(diagram.values)
    apart = hysteresis(diagram)
    size = _POINT * (2.0 if len(values) <= _SPARSE else 1.0 if states.size <= _MOST else 0.5)
    several = len(diagram.directions) > 1
    for way, name in enumerate(diagram.directions):
        kinds = [(apart, WAYS[name], 3.0 + way)] if several else []
        if way == 0:
            kinds.append((~apart, style.INK, 2.0))
        for chosen, color, zorder in kinds:
            y = up.shown(states[way][chosen])
            gid = f"points {name}" if chosen is apart else "points"
            # Rasterise: hundreds of thousands of points would make a vector picture useless.
            how = {"alpha": 0.6, "rasterized": True, "zorder": zorder, "gid": gid}
            dots(ax, np.repeat(values[chosen], y.shape[1]), y.reshape(-1), size, color, **how)


def _each(orbits: Iterable[Any]) -> Iterable[Any]:
    """Iterate over the orbits and branches in nested collections."""
    for entry in [orbits] if hasattr(orbits, "multipliers") else orbits:
        if hasattr(entry, "multipliers"):
            yield entry
        else:
            yield from _each(entry)


def _orbit(ax: Axes, diagram: Bifurcation, orbit: Any, show: str, across: Scale, up: Scale) -> None:
    """Draw a periodic orbit as circles, or a branch as curves, over a diagram.

    `show` is the quantity on the vertical axis; `across` and `up` are the scales of the axes.
    """
    states = up.shown(getattr(orbit, show))
    if states.ndim == 2:
        if orbit.parameter != diagram.parameter or orbit.phase != diagram.phase:
            raise InputError(
                f"orbits: a branch in {orbit.parameter} at phase {orbit.phase:g}",
                key="orbits",
                expected=f"one in {diagram.parameter} at phase {diagram.phase:g}",
            )
        values, states, size = _insert_crossings(
            across.shown(orbit.values), states, np.abs(orbit.multipliers[:, 0])
        )
        for kind, look in (("stable", "-"), ("unstable", (0, (1.5, 1.5)))):
            shown = size <= 1.0 if kind == "stable" else size >= 1.0
            line = np.where(shown[:, np.newaxis], states, np.nan)
            ax.plot(values, line, color=style.GREEN, lw=style.THIN, ls=look, zorder=5.0, gid=f"{kind} branch")
        return
    if diagram.phase:
        raise InputError(
            "orbits: their states are at the firings",
            key="orbits",
            expected=f"a diagram of phase 0 for {orbit!r}",
        )
    kind, inside = ("stable", style.GREEN) if orbit.kind == "stable" else ("unstable", "white")
    at = np.full(len(states), float(across.shown(orbit.regime.value(diagram.parameter))))
    rim = {"mew": 0.8, "mec": style.GREEN, "mfc": inside}
    dots(ax, at, states, 3.2, style.GREEN, **rim, zorder=6.0, gid=f"{kind} orbit")


def _insert_crossings(
    values: FloatArray, states: FloatArray, size: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Insert points into a branch where the interpolated modulus of the multiplier is 1.

    Return the arrays of parameter values, states, and moduli (`size`), with the points inserted.
    """
    at = np.flatnonzero((size[1:] < 1.0) != (size[:-1] < 1.0))
    share = (1.0 - size[at]) / (size[at + 1] - size[at])
    middle = values[at] + share * (values[at + 1] - values[at])
    between = states[at] + share[:, np.newaxis] * (states[at + 1] - states[at])
    return (
        np.insert(values, at + 1, middle),
        np.insert(states, at + 1, between, axis=0),
        np.insert(size, at + 1, 1.0),
    )


def _bands(strip: Axes, diagram: Bifurcation, across: Scale) -> None:
    """Draw one band per direction, coloured by the classification of the motion."""
    starts = np.concatenate([[0.0], np.cumsum(cells(diagram.values))]) + diagram.values[0]
    for way, name in enumerate(diagram.directions):
        place = 0
        level = len(diagram.directions) - 1 - way
        for window in diagram.windows(name):
            stopped = diagram.status[way, place : place + window.columns] != "ok"
            ends = across.shown([starts[place], starts[place + window.columns]])
            shade = SHADES[_kind(window.verdict, bool(stopped.all()))]
            strip.barh(level, ends[1] - ends[0], left=ends[0], height=0.9, color=shade, lw=0.0)
            place += window.columns
    strip.set_yticks(range(len(diagram.directions)), list(reversed(diagram.directions)), fontsize=style.SMALL)
    strip.set_ylim(-0.5, len(diagram.directions) - 0.5)
    strip.tick_params(axis="y", length=0.0)


def _kind(verdict: str, stopped: bool) -> str:
    if stopped:
        return "run ended early"
    return verdict if verdict in SHADES else "other period"


def _key(strip: Axes, diagram: Bifurcation) -> None:
    """Draw the legend of the bands, and of the points reached in only one direction of the sweep."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    kinds = {
        _kind(verdict, status != "ok")
        for verdict, status in zip(diagram.verdicts.flat, diagram.status.flat, strict=True)
    }
    handles: list[Any] = [
        Patch(color=shade, label=kind.replace("-", " ")) for kind, shade in SHADES.items() if kind in kinds
    ]
    if len(diagram.directions) > 1 and hysteresis(diagram).any():
        handles += [
            Line2D([], [], ls="none", marker="o", ms=3.0, mew=0.0, color=WAYS[name], label=f"{name} only")
            for name in diagram.directions
        ]
    apart = {"handlelength": 1.0, "handletextpad": 0.4, "columnspacing": 1.2}
    legend_below(strip, handles=handles, ncols=4, **apart)
