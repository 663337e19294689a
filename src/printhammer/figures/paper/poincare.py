"""Figure 11: Poincaré plots at gradually increasing rates, with the classification of each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from string import ascii_lowercase
from typing import Final, Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from printhammer.chaos import Strobe
from printhammer.errors import InputError
from printhammer.figures.chaos.strobe import RING, panel, scales_of, shown_period
from printhammer.figures.elements.curves import waveform_of
from printhammer.figures.elements.marks import note
from printhammer.figures.elements.scales import Scale, label
from printhammer.figures.elements.style import INK, SMALL, new_figure, sign, styled
from printhammer.hammer.hammer import Hammer
from printhammer.run.scheme_runs import Reading, Scheme

PERIODS: Final = tuple(hundredths / 1e5 for hundredths in range(135, 75, -5))
"""Strobe times of the panels of Fig. 11, s: from 1.35 ms down to 0.80 ms."""

POINTS: Final = 200
"""Number of strobe points in each panel of Fig. 11."""

_COLUMNS: Final = 3  # Panels in a row; arbitrary


@styled
def poincare(
    hammer: Hammer,
    *,
    strobes: Sequence[Strobe] | None = None,
    periods: Sequence[float | str] = PERIODS,
    points: int = POINTS,
    printed: Mapping[float, str] | None = None,
    scheme: Scheme | None = None,
    reading: Reading = "firings",
) -> Figure:
    """Draw Fig. 11: the states at the first firings of trains, one panel per strobe time.

    The vertical line is the backstop; circles are the last points of a train with a period of up to 8
    firings.

    Parameters
    ----------
    strobes : sequence of Strobe, optional
        Strobe points from `printhammer.chaos.strobes`; by default those of the hammer.
    periods : sequence, optional
        Strobe times [s] or text with a unit.
    points : int, optional
        Points in each panel, counted from the first firing.
    printed : mapping, optional
        Classifications printed in the paper, such as "period-2", by strobe time, s; a panel shows its printed
        classification if the computed one differs.
    scheme : str, optional
        Integration scheme of the 1983 paper, "runge-kutta-4" or "trapezoid", used with the step sizes of the
        paper, see `printhammer.chaos.strobe.points`; by default the accurate integrator.
    reading : str, optional
        Rule that decides where the integrators of the 1983 paper take short steps, one of
        `printhammer.run.scheme_runs.READINGS`.
    """
    from matplotlib.lines import Line2D

    waveform_of(hammer)
    shown = _strobe_points(hammer, periods, points, scheme, reading) if strobes is None else list(strobes)
    if not shown:
        raise InputError("strobes: expected at least one train to draw", key="strobes")
    window = shown[0].window
    way, speed = scales_of(window)
    rows = -(-len(shown) // _COLUMNS)
    columns = min(_COLUMNS, len(shown))
    figure = new_figure(0.7 + 1.75 * rows)
    grid = figure.add_gridspec(rows, columns, wspace=0.02, hspace=0.02)
    for i, strobe in enumerate(shown):
        row, column = divmod(i, columns)
        ax = figure.add_subplot(grid[row, column])
        said = [name for t, name in (printed or {}).items() if math.isclose(t, strobe.period, rel_tol=1e-9)]
        panel(ax, strobe, window, way, speed, size=1.6, printed=said[0] if said else "")
        if len(shown) <= len(ascii_lowercase):
            note(ax, f"({ascii_lowercase[i]})", (0.03, 0.96), color=INK)
        ax.locator_params(axis="both", nbins=5)
        lowest = i + columns >= len(shown)
        ax.tick_params(labelbottom=lowest, labelleft=column == 0)
        _edge(ax, "x", way, lowest, row == 0)
        _edge(ax, "y", speed, column == 0, i + 1 == len(shown) or column == columns - 1)
    if any(line.get_gid() == "cycle" for ax in figure.axes for line in ax.lines):
        circles = Line2D([], [], label="last points of a periodic train", **RING)
        figure.legend(
            handles=[circles], loc="outside lower left", fontsize=SMALL, frameon=False, handletextpad=0.2
        )
    by_scheme = (
        [f"Computed by {scheme}, step sizes of 1983, rule for short steps: {reading}."] if scheme else []
    )
    early = (
        f"The run at {shown_period(strobe.period)} ended early: {strobe.status}."
        for strobe in shown
        if not strobe.ok
    )
    sign(figure, hammer, *by_scheme, *early)
    return figure


def _strobe_points(
    hammer: Hammer,
    periods: Sequence[float | str],
    points: int,
    scheme: Scheme | None,
    reading: Reading,
) -> list[Strobe]:
    """Compute the strobe points of the panels, accurately or with a scheme of the 1983 paper."""
    if scheme is None:
        from printhammer.chaos import strobes

        return strobes(hammer, periods, points=points)
    from printhammer.chaos.strobe.points import scheme_strobes

    return scheme_strobes(hammer, periods, scheme, reading=reading, points=points)


def _edge(ax: Axes, side: Literal["x", "y"], shown: Scale, here: bool, opposite: bool) -> None:
    """Label the axis of a panel, and its secondary axis in the other unit system, at the figure's edges.

    `here` and `opposite` state whether the panel lies at the edge of the axis and at the opposite edge.
    """
    other = label(ax, side, shown)
    if not here:
        ax.set(**{f"{side}label": ""})
    if other is not None and not opposite:
        other.remove()
        ax.tick_params(axis=side, top=side == "x", right=side == "y")
