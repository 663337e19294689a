"""Windows of a bifurcation diagram, and whether a series of period doublings leads to the strange ones.

A window is an interval of the parameter in which all trains that were run have the same verdict. A value
stands for the interval half-way to its neighbours, so that widths of windows add up to the whole range.
Between two neighbours there may be more than a diagram shows.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from printhammer.chaos.bifurcation_carry import SAME
from printhammer.chaos.bifurcation_columns import orbit_distance
from printhammer.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.chaos.bifurcation import Bifurcation
    from printhammer.segments import FloatArray

SERIES: Final = (2, 4, 8)
"""Periods that, one after the other, count as a series of doublings."""


@dataclass(frozen=True)
class Window:
    """Neighbouring values of the parameter with the same verdict.

    Attributes
    ----------
    verdict : str
        "period-q", "strange" or "undecided".
    period : int
        q; 0 where there is none.
    low, high : float
        Least and largest value, SI.
    width : float
        Width of the window up to half-way to the neighbours, SI.
    columns : int
        Number of values.
    """

    verdict: str
    period: int
    low: float
    high: float
    width: float
    columns: int


@dataclass(frozen=True)
class Route:
    """What one meets on the way to the first strange train.

    Attributes
    ----------
    way : str
        "rising" or "falling" values of the parameter.
    before : tuple of Window
        The windows before the first strange one, in this order; all of them if there is none.
    first : float or None
        Value of the first strange train, SI.
    judged : str
        "exponent" where strange trains are known by their exponents; "no period" where these were not
        computed, and every train without a period is taken for one.
    """

    way: Literal["rising", "falling"]
    before: tuple[Window, ...]
    first: float | None
    judged: Literal["exponent", "no period"]

    @property
    def periods(self) -> list[int]:
        """Periods of the windows before, 0 for one without."""
        return [window.period for window in self.before]

    @property
    def cascade(self) -> bool:
        """Whether windows of the periods 2, 4 and 8 follow each other there."""
        return bool(doublings(self.before))

    @property
    def sentence(self) -> str:
        """The finding in a sentence."""
        kind = "strange train" if self.judged == "exponent" else "train without a period"
        way = ", ".join(str(window.verdict) for window in self.before) or "nothing"
        if self.first is None:
            return f"With {self.way} values no {kind} comes: {way}."
        told = "a series of doublings" if self.cascade else "no series of doublings"
        return f"With {self.way} values the first {kind} comes at {self.first:.9g} after {told}: {way}."


def windows_of(diagram: Bifurcation, direction: str | None = None) -> list[Window]:
    """Return the windows of a diagram, from the least value to the largest.

    Parameters
    ----------
    diagram : Bifurcation
        The diagram.
    direction : str, optional
        Which direction, where it has two; by default the first.

    Raises
    ------
    InputError
        The diagram has no such direction.
    """
    row = _row(diagram, direction)
    names, cycles = diagram.verdicts[row].tolist(), diagram.cycles[row].tolist()
    widths = cells(diagram.values)
    found = []
    for name, group in itertools.groupby(range(len(names)), key=lambda k: names[k]):
        places = list(group)
        first, last = places[0], places[-1]
        found.append(
            Window(
                verdict=name,
                period=int(cycles[first]),
                low=float(diagram.values[first]),
                high=float(diagram.values[last]),
                width=float(widths[first : last + 1].sum()),
                columns=len(places),
            )
        )
    return found


def cells(values: FloatArray) -> FloatArray:
    """Return for how wide an interval each of some ascending values stands."""
    if len(values) < 2:
        return np.zeros(len(values))
    edges = np.concatenate([values[:1], 0.5 * (values[1:] + values[:-1]), values[-1:]])
    return np.diff(edges)


def doublings(windows: Sequence[Window]) -> list[Window]:
    """Return the first of each three windows in a row whose periods are 2, 4 and 8."""
    threes = zip(windows, windows[1:], windows[2:], strict=False)
    return [three[0] for three in threes if tuple(window.period for window in three) == SERIES]


def routes_of(diagram: Bifurcation, direction: str | None = None) -> tuple[Route, Route]:
    """Return the routes to the first strange train of a diagram, with rising and with falling values.

    Parameters
    ----------
    diagram : Bifurcation
        The diagram.
    direction : str, optional
        Which direction, where it has two; by default the first.

    Raises
    ------
    InputError
        The diagram has no such direction.
    """
    found = windows_of(diagram, direction)
    measured = bool(np.isfinite(diagram.exponents).any())

    def strange(window: Window) -> bool:
        return window.verdict == "strange" if measured else window.period == 0

    def route(way: Literal["rising", "falling"], order: Sequence[Window]) -> Route:
        before = list(itertools.takewhile(lambda window: not strange(window), order))
        rest = order[len(before) :]
        first = None if not rest else rest[0].low if way == "rising" else rest[0].high
        return Route(way, tuple(before), first, "exponent" if measured else "no period")

    return route("rising", found), route("falling", found[::-1])


def hysteresis(diagram: Bifurcation) -> npt.NDArray[np.bool_]:
    """Return at which values the directions of a diagram lead to different attractors, shape (C,).

    Periodic ones are different if their periods are, or if their orbits lie further apart than
    `printhammer.chaos.bifurcation_carry.SAME`; trains without a period are only told from periodic ones. All
    false where there is but one direction.
    """
    found = np.zeros(len(diagram.values), np.bool_)
    if len(diagram.directions) < 2:
        return found
    half = diagram.regime.window.half_widths
    for k, (one, other) in enumerate(diagram.cycles.T.tolist()):
        if one != other:
            found[k] = True
        elif one:
            orbits = [
                np.column_stack([diagram.x[way, k, -one:], diagram.v[way, k, -one:]]) / half for way in (0, 1)
            ]
            found[k] = orbit_distance(*orbits) > SAME
    return found


def _row(diagram: Bifurcation, direction: str | None) -> int:
    if direction is None:
        return 0
    if direction not in diagram.directions:
        known = " and ".join(diagram.directions)
        raise InputError(f"direction = {direction!r}, expected what the diagram has: {known}")
    return diagram.directions.index(direction)
