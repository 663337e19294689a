"""Windows of a bifurcation diagram, and whether a series of period doublings leads to the strange ones.

A window is an interval of the parameter in which all trains that were run have the same verdict. A value
stands for the interval half-way to its neighbours, so that widths of windows add up to the whole range.
Between two neighbours there may be more than a diagram shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

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
        series = "a series of doublings" if self.cascade else "no series of doublings"
        return (
            f"With {self.way} values the first strange train comes at {self.first:.9g} after {series}: {way}."
        )


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
