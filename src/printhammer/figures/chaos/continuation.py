"""Figures of branches of periodic orbits against a parameter: stable solid, unstable dashed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.chaos.continuation.branch import Branch
from printhammer.chaos.continuation.crossings import CROSSINGS
from printhammer.chaos.continuation.regimes import Branches
from printhammer.errors import InputError
from printhammer.figures.elements import style
from printhammer.figures.elements.marks import legend_in_columns
from printhammer.figures.elements.style import new_panel, sign, styled
from printhammer.support.arrays import FloatArray

# Colour of an orbit period, in firings
_COLOURS: Final = {1: style.BLUE, 2: style.ORANGE, 3: style.GREEN, 4: style.YELLOW}
_SHOWN: Final = {
    "x": ("Displacement at the section", "m", "µm", 1e6),
    "v": ("Velocity at the section", "m/s", "m/s", 1.0),
    "flight_time": ("Flight time", "s", "µs", 1e6),
    "impact_speed": ("Impact speed", "m/s", "m/s", 1.0),
    "peak_force": ("Peak force", "N", "N", 1.0),
}
_MARKS: Final[dict[str, dict[str, Any]]] = {
    "fold": {"marker": "o", "ms": 4.5, "mfc": "white"},
    "period doubling": {"marker": "s", "ms": 4.5, "mfc": "white"},
    "Neimark-Sacker": {"marker": "D", "ms": 4.5, "mfc": "white"},
    "pitchfork": {"marker": "x", "ms": 5.0},
    "transcritical": {"marker": "+", "ms": 6.0},
    "branching": {"marker": "*", "ms": 5.0},
    "grazing": {"marker": "|", "ms": 13.0},
}
_TURNS: Final = ("fold", "period doubling", "Neimark-Sacker", *CROSSINGS)
_UNSTABLE: Final[dict[str, Any]] = {"lw": style.HAIR, "ls": (0, (4, 2)), "zorder": 2.0}
_AXIS: Final = {"s": ("ms", 1e3), "1": ("", 1.0)}


@styled
def plot(
    branches: Branch | Branches,
    *,
    show: str = "v",
    grazings: bool = True,
    limits: tuple[float, float] | None = None,
) -> Figure:
    """Draw branches of periodic orbits against their parameter.

    The colour shows the orbit period, in firings.

    Parameters
    ----------
    branches : Branch or Branches
        Results of `printhammer.continuation` or `printhammer.regimes`.
    show : str, optional
        Quantity of the vertical axis: "x", "v", "flight_time", "impact_speed" or "peak_force".
    grazings : bool, optional
        Whether grazings are marked in addition to bifurcations.
    limits : tuple of float, optional
        Limits of the vertical axis, SI.
    """
    drawn: list[Branch] = list(getattr(branches, "found", [branches]))
    if not drawn:
        raise InputError("branches: expected at least one to draw", key="branches")
    if show not in _SHOWN:
        raise InputError.of("show", show, f"one of {', '.join(_SHOWN)}")
    figure, ax = new_panel(4.4)
    heading, factor = axis_of(drawn[0].parameter, drawn[0].unit)
    name, _, shown, times = _SHOWN[show]
    for branch in drawn:
        draw(ax, branch, show, (factor, times))
    marked = _mark(ax, drawn, show, (factor, times), grazings)
    ax.set_xlim(*(factor * end for end in drawn[0].bounds))
    if limits is not None:
        ax.set_ylim(*(times * end for end in limits))
    else:
        ax.margins(y=0.04)
    ax.set_xlabel(heading)
    ax.set_ylabel(f"{name}  [{shown}]")
    _legend(ax, drawn, marked)
    sign(figure, drawn[0].regime.hammer, *_remarks(drawn))
    return figure


def axis_of(name: str, si: str) -> tuple[str, float]:
    """Return the axis label of a parameter, and the factor from its SI unit to the unit of the axis.

    `si` is the SI unit of the parameter.
    """
    unit, factor = _AXIS.get(si, (si, 1.0))
    title = name[:1].upper() + name[1:] if "." not in name else name
    return f"{title}  [{unit}]" if unit else title, factor


def draw(ax: Axes, branch: Branch, show: str, factors: tuple[float, float]) -> None:
    """Draw a branch as lines, solid where stable; `factors` convert parameter and quantity to axis units."""
    values, table, stable = _with_points(branch, show)
    colour = colour_of(branch.firings)
    begin = 0
    for i in range(1, len(stable) + 1):
        if i < len(stable) and stable[i] == stable[begin]:
            continue
        part = slice(begin, i + 1)
        look: dict[str, Any] = (
            {"lw": style.LINE, "ls": "-", "zorder": 3.0} if stable[begin] else dict(_UNSTABLE)
        )
        for k in range(branch.firings):
            (line,) = ax.plot(factors[0] * values[part], factors[1] * table[part, k], color=colour, **look)
            line.set_gid("stable" if stable[begin] else "unstable")
        begin = i


def _with_points(branch: Branch, show: str) -> tuple[FloatArray, FloatArray, list[bool]]:
    """Return the curve of a branch, with its bifurcations inserted as points.

    The result is the parameter values, the values of the quantity `show`, and whether each segment between
    consecutive points is stable.
    """
    table = getattr(branch, show)
    values, rows, stable = [branch.values[0]], [table[0]], []
    inside: dict[int, list[Any]] = {}
    for event in branch.events:
        if event.kind in _TURNS:
            inside.setdefault(event.after, []).append(event)
    for i in range(len(branch) - 1):
        for event in inside.get(i, []):
            values.append(event.value)
            rows.append(_at_event(branch, event, table))
            stable.append(bool(branch.stable[i]))
        if show in ("x", "v") and branch.phases[i] != branch.phases[i + 1]:
            # The section changes here: only the quantity shown jumps.
            values.append(branch.values[i])
            rows.append(np.full_like(table[i], np.nan))
            stable.append(bool(branch.stable[i]))
        values.append(branch.values[i + 1])
        rows.append(table[i + 1])
        stable.append(bool(branch.stable[i + 1]) if i in inside else bool(branch.stable[i]))
    return np.array(values), np.array(rows), stable


def _at_event(branch: Branch, event: Any, table: FloatArray) -> FloatArray:
    """Interpolate a quantity at an event of a branch, such as a fold, by the arc length of the branch.

    `table` contains the values of the quantity, one row per point of the branch.
    """
    i, nodes = event.after, branch.curve.nodes
    span = nodes[i + 1].arc - nodes[i].arc
    share = min(max((event.point.node.arc - nodes[i].arc) / span, 0.0), 1.0) if span > 0.0 else 0.5
    return np.asarray(table[i] + share * (table[i + 1] - table[i]))


def _mark(
    ax: Axes, branches: Sequence[Branch], show: str, factors: tuple[float, float], grazings: bool
) -> list[str]:
    """Mark the bifurcations and, with `grazings`, the grazings of branches; return the kinds that occur.

    `factors` convert parameter and quantity to axis units.
    """
    kinds: list[str] = []
    for branch in branches:
        table = getattr(branch, show)
        for event in branch.events:
            if event.kind not in _MARKS or (event.kind == "grazing" and not grazings):
                continue
            row = _at_event(branch, event, table)
            colour = style.INK if event.kind == "grazing" else colour_of(branch.firings)
            places = np.full(branch.firings, factors[0] * event.value)
            look = {"ls": "none", "mec": colour, "mew": style.THIN, "zorder": 4.0, **_MARKS[event.kind]}
            ax.plot(places, factors[1] * row, gid=event.kind, **look)
            if event.kind not in kinds:
                kinds.append(event.kind)
    return kinds


def colour_of(firings: int) -> str:
    """Return the line colour of orbits with a given period in firings."""
    return _COLOURS.get(firings, style.INK)


def _legend(ax: Axes, branches: Sequence[Branch], kinds: Sequence[str]) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=colour_of(firings), lw=style.LINE, label=f"period {firings}, stable")
        for firings in sorted({branch.firings for branch in branches})
    ]
    handles.append(Line2D([], [], color=style.MUTED, lw=style.HAIR, ls=_UNSTABLE["ls"], label="unstable"))
    for kind, look in _MARKS.items():
        if kind in kinds:
            handles.append(Line2D([], [], ls="none", mec=style.INK, mew=style.THIN, label=kind, **look))
    size = style.TINY + 0.5 if len(handles) > 6 else style.SMALL
    legend_in_columns(ax, handles, 3 if len(handles) > 4 else len(handles), size)


def _remarks(branches: Sequence[Branch]) -> list[str]:
    """Return a remark on the branch ends before the parameter bounds, with the number for each reason."""
    reasons = {
        "length": "at the maximum number of steps",
        "lost": "where Newton's method does not converge",
        "no value": "where there is no strobe map",
        "grazing": "in a grazing of the rigid backstop",
    }
    counts = Counter(stop.reason for branch in branches for stop in branch.stops if stop.reason in reasons)
    if not counts:
        return []
    ends = ", ".join(f"{number} {reasons[reason]}" for reason, number in sorted(counts.items()))
    return [f"Branches end before the bounds: {ends}."]
