"""Statistics of an impact train: how regular the times are at which a surface is touched.

What a platen hears, or a vibration sensor sees, is a train of impacts. The intervals between them, their
coefficient of variation and their autocorrelation tell a regular train from an irregular one without any
state; the Fano factor tells whether the irregularity adds up (D. R. Cox and P. A. W. Lewis, The Statistical
Analysis of Series of Events, 1966, chapters 4 and 5).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, SupportsIndex, Unpack

import numpy as np

from printhammer.chaos.impacts.sections import Section, section
from printhammer.drive.input import read_array, read_count, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Column, Result, column, derived, part, provenance, scalar
from printhammer.run.regime import Firing, Regime

if TYPE_CHECKING:
    import numpy.typing as npt

    from printhammer.support.arrays import FloatArray, IntArray

BINS: Final = 60
"""Number of bins of the histogram unless told otherwise."""

LAGS: Final = 40
"""Largest lag of the autocorrelation unless told otherwise; at most a quarter of the intervals."""

_FEWEST: Final = 8
_SAME: Final = 1e-9
"""Part of an interval up to which differences count as none."""


class ImpactTrain(Result):
    """Intervals between impacts, and what they tell."""

    times: FloatArray = column("s", "time of the impact", "impact", name="t")
    intervals: FloatArray = part("times between successive impacts, s", more="one fewer", repr=False)
    mean: float = scalar("s", "mean of the intervals")
    deviation: float = scalar("s", "standard deviation of the intervals")
    variation: float = scalar(
        "1",
        "coefficient of variation, deviation over mean",
        more="0 for a clock, 1 for a Poisson process",
    )
    edges: FloatArray = part("edges of the bins of the histogram, s", more="one more than bins", repr=False)
    counts: IntArray = column("1", "intervals in the bin", "bin", name="count", dtype=np.int32)
    autocorrelation: FloatArray = column(
        "1",
        "autocorrelation of the intervals",
        "lag",
        more="from lag 0 on; nan where all intervals are the same",
    )
    window: float = scalar("s", "length of the windows in which impacts are counted")
    windows: int = scalar(
        "1",
        "number of windows",
        more="they follow each other from half a mean interval before the first impact on",
    )
    fano: float = scalar(
        "1",
        "variance over mean of the numbers of impacts in the windows",
        more="1 for a Poisson process, nan for fewer than two windows",
    )
    source: Section | None = part("where the times come from", repr=False)

    @property
    def title(self) -> str:
        """One line that says what this is."""
        return "impact train"

    @property
    @derived("s", "time since the impact before", "impact")
    def interval(self) -> FloatArray:
        """The intervals, NaN before the first."""
        return np.concatenate([[np.nan], self.intervals])

    @property
    def hammer(self) -> Hammer | None:
        """The hammer, where it is known."""
        return None if self.source is None else self.source.hammer

    @property
    def significant(self) -> float:
        """What the autocorrelation of n independent intervals exceeds once in twenty lags, 1.96/sqrt(n)."""
        return 1.96 / math.sqrt(len(self.intervals))

    @property
    def provenance(self) -> dict[str, Any]:
        """Where the times come from."""
        return provenance() if self.source is None else self.source.provenance

    def notes(self) -> dict[str, Any]:
        """Return which touches were looked for, for the attributes of the Dataset."""
        return {name: getattr(self.source, name, None) for name in ("surface", "first", "last", "wanted")}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return times over `impact`, histogram over `bin` and autocorrelation over `lag`."""
        number = np.arange(1, len(self.times) + 1, dtype=np.int32)
        places = {
            "impact": ("1", "number of the impact", "impact", number),
            "lower_edge": ("s", "lower edge of the bin", "bin", self.edges[:-1]),
            "upper_edge": ("s", "upper edge of the bin", "bin", self.edges[1:]),
            "lag": ("1", "lag", "lag", np.arange(len(self.autocorrelation), dtype=np.int32)),
        }
        return super().entries() | {
            name: (Column(unit, meaning, (dim,), "coordinate", name=name), values)
            for name, (unit, meaning, dim, values) in places.items()
        }


def impact_train(
    touches: Section | Regime | Hammer | npt.ArrayLike,
    *,
    window: float | str | None = None,
    bins: SupportsIndex = BINS,
    lags: SupportsIndex = LAGS,
    **firing: Unpack[Firing],
) -> ImpactTrain:
    """Return the statistics of the impacts of a section, or of a series of times.

    Parameters
    ----------
    touches : Section, Regime, Hammer or array
        From `printhammer.section`; or a regime, or a hammer and how it is fired, of which that is taken; or
        times of impacts, s, ascending. At least nine.
    window : float or str, optional
        Length of the windows for the Fano factor, s, or text with a unit; by default ten periods of the
        drive, or ten mean intervals where there is none. In a window of one period every train that prints
        once a period looks like a clock.
    bins : int, optional
        Number of bins of the histogram, between the shortest and the longest interval.
    lags : int, optional
        Largest lag of the autocorrelation; no more than a quarter of the intervals is taken.
    **firing
        How a hammer is fired, as for `printhammer.Regime.of`.

    Returns
    -------
    ImpactTrain
        The statistics.

    Raises
    ------
    InputError
        There are too few times, they are not ascending or not finite; a window that is not positive.
    """
    if isinstance(touches, Regime | Hammer):
        touches = section(touches, **firing)
    elif firing:
        raise InputError(f"times are given, expected no {' or '.join(firing)} beside them")
    source = touches if isinstance(touches, Section) else None
    times = _times(touches.t if isinstance(touches, Section) else touches, source)
    intervals = np.diff(times)
    mean, deviation = float(intervals.mean()), float(intervals.std(ddof=1))
    length = 10.0 * (mean if source is None else source.period)
    if window is not None:
        length = read_positive(window, "s", "window")
    number, shown = read_count(bins, "bins"), min(read_count(lags, "lags"), len(intervals) // 4)
    count, fano = _fano(times, length)
    edges = np.linspace(*_range(intervals), number + 1)
    return ImpactTrain(
        times=times,
        intervals=intervals,
        mean=mean,
        deviation=deviation,
        variation=deviation / mean,
        edges=edges,
        counts=np.histogram(intervals, edges)[0].astype(np.int64),
        autocorrelation=autocorrelation(intervals, shown),
        window=length,
        windows=count,
        fano=fano,
        source=source,
    )


def autocorrelation(series: FloatArray, longest: int) -> FloatArray:
    """Return the autocorrelation of a series at the lags from 0 to `longest`.

    The sums of the products of deviations are divided by that at lag 0, as G. E. P. Box and G. M. Jenkins do
    (Time Series Analysis, 1970, section 2.1.5). NaN where the numbers differ by no more than 1e-9 of the
    largest.
    """
    away = series - series.mean()
    whole = float((away**2).sum())
    if whole <= len(series) * (_SAME * float(np.abs(series).max())) ** 2:
        return np.full(longest + 1, np.nan)
    sums = [float((away[: len(away) - lag] * away[lag:]).sum()) for lag in range(longest + 1)]
    return np.array(sums) / whole


def _range(intervals: FloatArray) -> tuple[float, float]:
    """Return the ends of the histogram: a thousandth of the mean apart at least."""
    low, high = float(intervals.min()), float(intervals.max())
    room = max(0.0, 0.5 * (1e-3 * float(intervals.mean()) - (high - low)))
    return low - room, high + room


def _fano(times: FloatArray, length: float) -> tuple[int, float]:
    """Return how many windows of a length, s, there are, and the Fano factor of the impacts in them."""
    # Half an interval before the first impact, so that those of a clock do not fall on the edges.
    begin = times[0] - 0.5 * (times[-1] - times[0]) / (len(times) - 1)
    windows = int((times[-1] - begin) // length)
    if windows < 2:
        return windows, math.nan
    edges = begin + length * np.arange(windows + 1)
    numbers = np.diff(np.searchsorted(times, edges, side="right"))
    return windows, float(numbers.var(ddof=1) / numbers.mean()) if numbers.any() else math.nan


def _times(touches: npt.ArrayLike, source: Section | None) -> FloatArray:
    times = read_array(touches, "touches", "times, s")
    if times.ndim != 1 or times.size <= _FEWEST:
        why = f" ({source.remark})" if source is not None and source.remark else ""
        raise InputError(f"touches: {times.size} times, expected at least {_FEWEST + 1}{why}")
    if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
        raise InputError("touches: expected finite, ascending times, s")
    return times
