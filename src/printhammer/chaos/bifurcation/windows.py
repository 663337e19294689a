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

from printhammer.chaos.bifurcation.builder import train_from, window_of_exponent
from printhammer.chaos.bifurcation.carry import SAME
from printhammer.chaos.bifurcation.columns import orbit_distance
from printhammer.chaos.strobe.train import exponents_of
from printhammer.chaos.strobe.verdict import SIGNIFICANT
from printhammer.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from printhammer.chaos.bifurcation.diagram import Bifurcation
    from printhammer.support.arrays import FloatArray

SERIES: Final = (2, 4, 8)
"""Periods that, one after the other, count as a series of doublings."""

MOST_UNDECIDED: Final = 32
"""Trains without a period that are not strange, on a route, after which it is not followed further."""


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
        The windows before the first strange train, in this order; all of them if there is none.
    first : float or None
        Value of the first strange train, SI; None if there is none, or it was not come to.
    complete : bool
        False where `MOST_UNDECIDED` trains without a period came first that are not strange, and the way was
        not followed further.
    """

    way: Literal["rising", "falling"]
    before: tuple[Window, ...]
    first: float | None
    complete: bool

    @property
    def periods(self) -> list[int]:
        """Periods of the windows before, those without one left out."""
        return [window.period for window in self.before if window.period]

    @property
    def cascade(self) -> bool:
        """Whether windows of the periods 2, 4 and 8 follow each other there."""
        return bool(doublings(self.before))

    @property
    def sentence(self) -> str:
        """The finding in a sentence."""
        way = ", ".join(window.verdict for window in self.before) or "nothing"
        if not self.complete:
            return (
                f"With {self.way} values {MOST_UNDECIDED} trains come that neither repeat nor are strange,"
                f" and the way was not followed further: {way}."
            )
        if self.first is None:
            return f"With {self.way} values no strange train comes: {way}."
        told = "a series of doublings" if self.cascade else "no series of doublings"
        return (
            f"With {self.way} values the first strange train comes at {self.first:.9g} after {told}: {way}."
        )


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
    return _grouped(diagram, row, range(len(diagram.values)))


def _grouped(diagram: Bifurcation, row: int, order: Sequence[int]) -> list[Window]:
    """Return the windows of neighbouring columns, which may ascend or descend."""
    names, cycles = diagram.verdicts[row].tolist(), diagram.cycles[row].tolist()
    widths = cells(diagram.values)
    found = []
    for name, group in itertools.groupby(order, key=lambda k: names[k]):
        places = sorted(group)
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
    """Return the first of each three windows in a row whose periods are 2, 4 and 8.

    Windows that are undecided do not count: where the period doubles, trains take long to settle.
    """
    decided = [window for window in windows if window.verdict != "undecided"]
    threes = zip(decided, decided[1:], decided[2:], strict=False)
    return [three[0] for three in threes if tuple(window.period for window in three) == SERIES]


def routes_of(diagram: Bifurcation, direction: str | None = None) -> tuple[Route, Route]:
    """Return the routes to the first strange train of a diagram, with rising and with falling values.

    Of trains without a period whose exponent is not known it is computed here, from one end of the range on
    up to the first strange one.

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
    names = diagram.verdicts[row].tolist()
    ends = diagram.values.tolist()
    known: dict[int, bool] = {}

    def strange(column: int) -> bool:
        if names[column] == "undecided" and column not in known:
            known[column] = _is_strange(diagram, row, column)
        return names[column] == "strange" or known.get(column, False)

    def route(way: Literal["rising", "falling"], order: Sequence[int]) -> Route:
        undecided = 0
        first = None
        for place, column in enumerate(order):
            if strange(column):
                first = place
                break
            undecided += names[column] == "undecided"
            if undecided > MOST_UNDECIDED:
                return Route(way, tuple(_grouped(diagram, row, order[:place])), None, False)
        before = tuple(_grouped(diagram, row, order[:first]))
        return Route(way, before, None if first is None else ends[order[first]], True)

    columns = range(len(names))
    return route("rising", columns), route("falling", columns[::-1])


def _is_strange(diagram: Bifurcation, row: int, column: int) -> bool:
    """Tell whether a train without a period is strange, by its exponent from its last point on."""
    x, v = (float(states[row, column, -1]) for states in (diagram.x, diagram.v))
    regime = diagram.regime.with_(diagram.parameter, float(diagram.values[column]))
    front = regime.hammer.front
    # Inside the pack, and between firings, the state that is kept is not all that a train goes on from.
    if diagram.status[row, column] != "ok" or diagram.phase or (front is not None and x > front):
        return False
    points = diagram.x.shape[2]
    (found,) = exponents_of(
        [train_from(regime, (x, v), points)], window_of_exponent(points), diagram.tolerance, threads=1
    )
    return bool(found.ok and found.smooth and found.value > SIGNIFICANT * found.standard_error)


def hysteresis(diagram: Bifurcation) -> npt.NDArray[np.bool_]:
    """Return at which values the directions of a diagram lead to different attractors, shape (C,).

    Periodic ones are different if their periods are, or if their orbits lie further apart than
    `printhammer.chaos.bifurcation.carry.SAME`; trains without a period are only told from periodic ones. All
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
