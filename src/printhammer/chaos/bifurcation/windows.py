"""Windows of a bifurcation diagram, and whether a series of period doublings leads to the strange ones.

A window is an interval of the parameter in which all trains that were run have the same verdict. A value
stands for the interval half-way to its neighbours, so that widths of windows add up to the whole range.
Between two neighbours there may be more than a diagram shows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from printhammer.results import Declared, part

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from printhammer.support.arrays import FloatArray

SERIES: Final = (2, 4, 8)
"""Periods that, one after the other, count as a series of doublings."""

MOST_UNDECIDED: Final = 32
"""Trains without a period that are not strange, on a route, after which it is not followed further."""


class Window(Declared):
    """Neighbouring values of the parameter with the same verdict; values and width in SI."""

    verdict: str = part('"period-q", "strange" or "undecided"')
    period: int = part("number q; 0 where there is none")
    low: float = part("least value")
    high: float = part("largest value")
    width: float = part("width of the window up to half-way to the neighbours")
    columns: int = part("number of values")


class Route(Declared):
    """What one meets on the way to the first strange train."""

    way: Literal["rising", "falling"] = part("sense of the values of the parameter")
    before: tuple[Window, ...] = part(
        "the windows before the first strange train, in this order; all of them if there is none"
    )
    first: float | None = part(
        "value of the first strange train, SI",
        more="None if there is none, or the way was not followed so far",
    )
    complete: bool = part(
        "False where `MOST_UNDECIDED` trains without a period came first that are not strange, and the way"
        " was not followed further"
    )

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
        """The finding in a sentence, with the value in SI."""
        return self.worded("{:.9g}".format)

    def worded(self, shown: Callable[[float], str]) -> str:
        """Return the finding in a sentence, with the value as `shown` writes it."""
        values = f"With {self.way} values"
        way = ", ".join(window.verdict for window in self.before)
        if not self.complete:
            return (
                f"{values} {MOST_UNDECIDED} trains come that neither repeat nor are strange, and the way was"
                f" not followed further: {way}."
            )
        if self.first is None:
            return f"{values} no strange train comes: {way}."
        if not way:
            return f"{values} the very first train, at {shown(self.first)}, is strange."
        series = "a series of doublings" if self.cascade else "no series of doublings"
        return f"{values} the first strange train comes at {shown(self.first)} after {series}: {way}."


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
