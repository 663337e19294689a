"""Statistics of an impact train: how regular the times are at which a surface is touched.

What a platen hears, or a vibration sensor sees, is a train of impacts. The intervals between them, their
coefficient of variation and their autocorrelation tell a regular train from an irregular one without any
state; the Fano factor tells whether the irregularity adds up (D. R. Cox and P. A. W. Lewis, The Statistical
Analysis of Series of Events, 1966, chapters 4 and 5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, SupportsIndex, Unpack

import numpy as np

from printhammer.chaos.impacts.sections import Section, section
from printhammer.drive.input import read_count, read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.run.regime import Regime

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

    from printhammer.run.regime import Firing
    from printhammer.support.arrays import FloatArray

BINS: Final = 60
"""Number of bins of the histogram unless told otherwise."""

LAGS: Final = 40
"""Largest lag of the autocorrelation unless told otherwise; at most a quarter of the intervals."""

_FEWEST: Final = 8
_SAME: Final = 1e-9
"""Part of an interval up to which differences count as none."""


@dataclass(frozen=True)
class ImpactTrain:
    """Intervals between impacts, and what they tell.

    Attributes
    ----------
    times : array, shape (n + 1,)
        Times of the impacts, s.
    intervals : array, shape (n,)
        Times between successive ones, s.
    mean, deviation : float
        Mean and standard deviation of the intervals, s.
    variation : float
        Coefficient of variation, deviation over mean: 0 for a clock, 1 for a Poisson process.
    edges : array, shape (m + 1,)
        Edges of the bins of the histogram, s.
    counts : int array, shape (m,)
        Intervals in each bin.
    autocorrelation : array, shape (l + 1,)
        Of the intervals, at the lags 0, 1, ... l; NaN where all intervals are the same.
    window : float
        Length of the windows in which impacts are counted, s.
    windows : int
        Number of windows; they follow each other from half a mean interval before the first impact on.
    fano : float
        Variance over mean of the numbers of impacts in the windows: 1 for a Poisson process; NaN for fewer
        than two windows.
    source : Section or None
        Where the times come from.
    """

    times: FloatArray = field(repr=False)
    intervals: FloatArray = field(repr=False)
    mean: float
    deviation: float
    variation: float
    edges: FloatArray = field(repr=False)
    counts: npt.NDArray[np.int64] = field(repr=False)
    autocorrelation: FloatArray = field(repr=False)
    window: float
    windows: int
    fano: float
    source: Section | None = field(repr=False)

    @property
    def hammer(self) -> Hammer | None:
        """The hammer, where it is known."""
        return None if self.source is None else self.source.hammer

    @property
    def significant(self) -> float:
        """What the autocorrelation of n independent intervals exceeds once in twenty lags, 1.96/sqrt(n)."""
        return 1.96 / math.sqrt(len(self.intervals))

    def to_dataset(self) -> xr.Dataset:
        """Return times over `impact`, histogram over `bin` and autocorrelation over `lag`."""
        import xarray as xr

        after = np.concatenate([[np.nan], self.intervals])
        data = {
            "t": ("impact", self.times, {"units": "s", "long_name": "time of the impact"}),
            "interval": ("impact", after, {"units": "s", "long_name": "time since the impact before"}),
            "count": (
                "bin",
                self.counts.astype(np.int32),
                {"units": "1", "long_name": "intervals in the bin"},
            ),
            "autocorrelation": (
                "lag",
                self.autocorrelation,
                {"units": "1", "long_name": "autocorrelation of the intervals"},
            ),
        }
        coords = {
            "impact": ("impact", np.arange(1, len(self.times) + 1, dtype=np.int32)),
            "lower_edge": ("bin", self.edges[:-1], {"units": "s", "long_name": "lower edge of the bin"}),
            "upper_edge": ("bin", self.edges[1:], {"units": "s", "long_name": "upper edge of the bin"}),
            "lag": ("lag", np.arange(len(self.autocorrelation), dtype=np.int32)),
        }
        names = ("mean", "deviation", "variation", "window", "windows", "fano")
        attrs = {
            "title": "impact train",
            **{name: getattr(self, name) for name in names},
            **({} if self.source is None else self.source.provenance),
        }
        return xr.Dataset(data, coords=coords, attrs=attrs)

    def plot(self, **options: Any) -> Any:
        """Draw histogram, return map and autocorrelation of the intervals; returns a matplotlib figure."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.chaos.impact_train").plot(self, **options)


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
    try:
        times = np.array(touches, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"touches = {touches!r}, expected times, s") from None
    if times.ndim != 1 or times.size <= _FEWEST:
        why = f" ({source.remark})" if source is not None and source.remark else ""
        raise InputError(f"touches: {times.size} times, expected at least {_FEWEST + 1}{why}")
    if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
        raise InputError("touches: expected finite, ascending times, s")
    return times
