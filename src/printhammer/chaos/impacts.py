"""Impact maps: Poincaré sections at the impacts on backstop or pack; and statistics of impact trains.

At a touch the displacement is that of the surface, so that the remaining state variables are the velocity and
the time since the last firing. These two variables follow an iterated map from touch to touch. The map is the
analogue of the strobe map, with a section defined by the position of the armature instead of the time of
firing.

*Statistics of an impact train.*

A vibration sensor records a train of impacts. The intervals between them, their coefficient of variation and
their autocorrelation separate a regular train from an irregular one without knowledge of the state; the Fano
factor shows whether the irregularity accumulates (D. R. Cox and P. A. W. Lewis, The Statistical Analysis of
Series of Events, 1966, chapters 4 and 5).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, Literal, SupportsIndex, Unpack, get_args

import numpy as np
import numpy.typing as npt

from printhammer.chaos.strobe.train import Train
from printhammer.drive.base import Overlap
from printhammer.drive.input import MOST_PULSES, read_array, read_count, read_positive
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Column, Result, column, derived, part, provenance, scalar
from printhammer.run.effort import DEFAULT, Effort, Keywords, computation
from printhammer.run.problem import TOLERANCE, Problem, check_tolerance
from printhammer.run.regime import Firing, Regime, regimes_of
from printhammer.run.simulate import touches_of
from printhammer.run.start import initial_state
from printhammer.support.arguments import checked
from printhammer.support.arrays import FloatArray, IntArray

Surface = Literal["pack", "backstop"]
SURFACES: Final = get_args(Surface)

TOUCHES: Final = 1000
"""Default number of impacts in a Poincaré section; arbitrary."""

_FIRINGS_A_TOUCH: Final = 10  # Default maximum number of firings per requested touch; arbitrary


class Section(Result):
    """Poincaré section: states of a hammer at its impacts on one surface."""

    hammer: Hammer = part("the hammer")
    drive: Drive = part("the drive")
    period: float = scalar("s", "time between firings")
    surface: Surface = scalar("", '"pack" or "backstop"')
    first: int = scalar(
        "1",
        "first of the firings between which touches were recorded",
        more="the very first firing is number 1",
    )
    last: int = scalar("1", "last of the firings between which touches were recorded")
    t: FloatArray = column("s", "time of touch", "touch")
    v: FloatArray = column("m/s", "velocity at touch", "touch")
    firing: IntArray = column(
        "1", "number of the latest firing", "touch", more="at or before the touch", dtype=np.int32
    )
    since: FloatArray = column("s", "time since the last firing", "touch")
    t_out: FloatArray = column(
        "s", "time of departure", "touch", more="nan if the contact is open at the end of the run"
    )
    v_out: FloatArray = column(
        "m/s", "velocity at departure", "touch", more="nan if the contact is open at the end of the run"
    )
    wanted: int = scalar(
        "1",
        "number of touches requested",
        more="fewer are recorded if the surface is not touched often enough",
    )
    status: str = part("status of the run")
    tolerance: float = part("tolerance of the integration")

    @property
    def title(self) -> str:
        """Title of the section: surface of the impacts, name of the hammer, and firing period."""
        return f"touches of the {self.surface} by {self.hammer.name}, fired every {self.period:.9g} s"

    @property
    @derived("1", "number of the touch", "touch", kind="coordinate", dtype=np.int32)
    def touch(self) -> IntArray:
        """Numbers of the impacts, counted from 1."""
        return np.arange(1, len(self.t) + 1)

    @property
    def ok(self) -> bool:
        """Whether the run was completed."""
        return self.status == "ok"

    @property
    def per_firing(self) -> float:
        """Mean number of impacts per firing; NaN if only one firing is covered."""
        fired = self.last - self.first
        return int((self.firing < self.last).sum()) / fired if fired else float("nan")

    @property
    def remark(self) -> str:
        """Remark that the section has fewer impacts than requested, with the reason; else empty."""
        if len(self.t) == self.wanted:
            return ""
        why = "" if self.ok else f"; the run ended early: {self.status}"
        return (
            f"{len(self.t)} of {self.wanted} touches of the {self.surface} from firing {self.first} to"
            f" {self.last}{why}"
        )


@checked
def section(
    hammer: Hammer | Regime,
    *,
    surface: Surface = "backstop",
    touches: SupportsIndex = TOUCHES,
    transient: SupportsIndex = 0,
    firings: SupportsIndex | None = None,
    state: tuple[float, float] | None = None,
    tolerance: float = TOLERANCE,
    **firing: Unpack[Firing],
) -> Section:
    """Compute a Poincaré section: the states of a hammer at its impacts on backstop or pack.

    Parameters
    ----------
    hammer : Hammer or Regime
        The hammer, or a regime, whose phase is ignored.
    surface : str, optional
        "backstop" or "pack".
    touches : int, optional
        Number of touches to record.
    transient : int, optional
        Number of firings to discard before the first touch.
    firings : int, optional
        Maximum number of firings; by default ten per requested touch.
    state, tolerance, **firing
        As for `printhammer.strobe`.

    Returns
    -------
    Section
        Section with a status; a run that ends early, or has too few touches, raises no exception.
    """
    counts = _counts(touches, transient, firings)
    check_tolerance(tolerance)
    train = Train.of(Regime.of(hammer, **firing), counts[1] + counts[2], state)
    return _section(train, surface, counts, tolerance)


@computation
def sections(
    hammers: Hammer | Regime | Sequence[Hammer | Regime],
    periods: Sequence[float | str] | npt.ArrayLike | None = None,
    *,
    surface: Surface = "backstop",
    touches: SupportsIndex = TOUCHES,
    transient: SupportsIndex = 0,
    firings: SupportsIndex | None = None,
    waveform: Waveform | None = None,
    overlap: Overlap | None = None,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[Keywords],
) -> list[Section]:
    """Compute Poincaré sections of many trains from rest, in parallel; see `section`.

    Parameters
    ----------
    hammers, periods, waveform, overlap
        Hammers with firing periods, or regimes alone; see `printhammer.run.regime.regimes_of`.
    surface, touches, transient, firings
        As for `section`, for all trains.

    Returns
    -------
    list of Section
        One section per train.
    """
    counts = _counts(touches, transient, firings)
    regimes = regimes_of(hammers, periods, waveform=waveform, overlap=overlap)
    trains = [Train.of(regime, counts[1] + counts[2]) for regime in regimes]
    return effort.mapped(lambda train: _section(train, surface, counts, effort.tolerance), trains)


def _counts(
    touches: SupportsIndex, transient: SupportsIndex, firings: SupportsIndex | None
) -> tuple[int, int, int]:
    """Validate the number of touches to record, the number of firings to discard, and the firing limit.

    Returns the three numbers, with the default firing limit for None.
    """
    wanted, skipped = read_count(touches, "touches"), read_count(transient, "transient", least=0)
    room = MOST_PULSES - skipped - 1
    limit = min(_FIRINGS_A_TOUCH * wanted, room) if firings is None else read_count(firings, "firings")
    if not 1 <= limit <= room:
        raise InputError(
            f"firings = {limit} after a transient of {skipped}",
            key="firings",
            value=limit,
            expected=f"at most {MOST_PULSES - 1} together",
        )
    return wanted, skipped, limit


def _section(train: Train, surface: Surface, counts: tuple[int, int, int], tolerance: float) -> Section:
    wanted, skipped, limit = counts
    if surface not in SURFACES:
        raise InputError.of("surface", surface, " or ".join(SURFACES))
    if getattr(train.hammer, surface) is None:
        raise InputError(
            f"surface = {surface!r}: the hammer {train.hammer.name!r} has no {surface}",
            key="surface",
            value=surface,
        )
    state = initial_state(train.hammer, train.state)
    problem = Problem(train.hammer, train.drive, state, 0.0, tolerance)
    firing = np.arange(1, skipped + limit + 2)
    times = train.times(firing)
    touches = touches_of(problem, surface, float(times[skipped]), float(times[-1]), wanted)
    t, v, t_out, v_out = touches.rows.T.copy()
    latest = np.searchsorted(times, t, side="right") - 1
    # Touches are recorded up to the last requested touch, or to the end of the run.
    until = t[-1] if len(t) == wanted else touches.reached
    return Section(
        hammer=train.hammer,
        drive=train.drive,
        period=train.period,
        surface=surface,
        first=skipped + 1,
        last=max(int(np.searchsorted(times, until, side="right")), skipped + 1),
        t=t,
        v=v,
        firing=firing[latest],
        since=t - times[latest],
        t_out=t_out,
        v_out=v_out,
        wanted=wanted,
        status=touches.status,
        tolerance=tolerance,
    )


BINS: Final = 60
"""Default number of bins of the histogram of intervals; arbitrary."""

LAGS: Final = 40  # Arbitrary
"""Default for the largest lag of the autocorrelation; at most a quarter of the number of intervals."""

_FEWEST: Final = 8  # Smallest number of intervals for the statistics of a train; arbitrary
_SAME: Final = 1e-9
"""Relative difference below which all intervals are equal, so that their autocorrelation is undefined."""


class ImpactTrain(Result):
    """Times of a train of impacts, with the statistics of the intervals between them."""

    times: FloatArray = column("s", "time of the impact", "impact", name="t")
    intervals: FloatArray = part(
        "times between successive impacts, s", more="one interval fewer than times", repr=False
    )
    mean: float = scalar("s", "mean of the intervals")
    deviation: float = scalar("s", "standard deviation of the intervals")
    variation: float = scalar(
        "1",
        "coefficient of variation, i.e. standard deviation over mean",
        more="0 for a clock, 1 for a Poisson process",
    )
    edges: FloatArray = part(
        "edges of the bins of the histogram, s", more="one edge more than bins", repr=False
    )
    counts: IntArray = column("1", "intervals in the bin", "bin", name="count", dtype=np.int32)
    autocorrelation: FloatArray = column(
        "1",
        "autocorrelation of the intervals",
        "lag",
        more="from lag 0 on; nan if all intervals are equal",
    )
    window: float = scalar("s", "length of the windows in which impacts are counted")
    windows: int = scalar(
        "1",
        "number of windows",
        more="successive windows, from half a mean interval before the first impact on",
    )
    fano: float = scalar(
        "1",
        "variance over mean of the numbers of impacts in the windows",
        more="1 for a Poisson process, nan for fewer than two windows",
    )
    source: Section | None = part("section from which the times come", repr=False)

    @property
    def title(self) -> str:
        """Title of the result: "impact train"."""
        return "impact train"

    @property
    @derived("s", "time since the preceding impact", "impact")
    def interval(self) -> FloatArray:
        """Time since the preceding impact, s; NaN for the first impact."""
        return np.concatenate([[np.nan], self.intervals])

    @property
    def hammer(self) -> Hammer | None:
        """Hammer of the section; None if the times were given as an array."""
        return None if self.source is None else self.source.hammer

    @property
    def significant(self) -> float:
        """Bound that the autocorrelation of n independent intervals exceeds in 5 % of cases, 1.96/sqrt(n)."""
        return 1.96 / math.sqrt(len(self.intervals))

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the Poincaré section from which the impact times were taken."""
        return provenance() if self.source is None else self.source.provenance

    def notes(self) -> dict[str, Any]:
        """Return the Dataset attributes: surface of the section, range of firings, requested touches."""
        return {name: getattr(self.source, name, None) for name in ("surface", "first", "last", "wanted")}

    def entries(self) -> dict[str, tuple[Column, Any]]:
        """Return the Dataset variables: times along `impact`, histogram, autocorrelation along `lag`."""
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
    """Compute statistics of the impacts of a section, or of a series of times.

    Parameters
    ----------
    touches : Section, Regime, Hammer or array
        A section from `printhammer.section`; or a regime, or a hammer with the keywords `firing`, whose
        section is computed; or at least nine impact times [s], ascending.
    window : float or str, optional
        Length of the windows for the Fano factor, s, or text with a unit; by default ten periods of the
        drive, or ten mean intervals without a drive. With a window of one period, every train with one dot
        per period would appear perfectly regular.
    bins : int, optional
        Number of bins of the histogram, between the shortest and the longest interval.
    lags : int, optional
        Largest lag of the autocorrelation, limited to a quarter of the number of intervals.
    **firing
        Firing of the hammer: period or rate, waveform and drive, as for `printhammer.Regime.of`.

    Returns
    -------
    ImpactTrain
        Intervals, histogram, autocorrelation and Fano factor.

    Raises
    ------
    InputError
        There are too few times, they are not ascending or not finite, or the window is not positive.
    """
    if isinstance(touches, Regime | Hammer):
        touches = section(touches, **firing)
    elif firing:
        raise InputError(
            "touches = times", key="times", expected=f"no {' or '.join(firing)} with an array of times"
        )
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
    """Compute the autocorrelation of a series for the lags from 0 to `longest`.

    The sums of the products of deviations are divided by the sum at lag 0 (G. E. P. Box and G. M. Jenkins,
    Time Series Analysis, 1970, section 2.1.5). The result is NaN if the numbers of the series are equal up to
    1e-9 of the largest.
    """
    away = series - series.mean()
    whole = float((away**2).sum())
    if whole <= len(series) * (_SAME * float(np.abs(series).max())) ** 2:
        return np.full(longest + 1, np.nan)
    sums = [float((away[: len(away) - lag] * away[lag:]).sum()) for lag in range(longest + 1)]
    return np.array(sums) / whole


def _range(intervals: FloatArray) -> tuple[float, float]:
    """Return the lower and upper end [s] of the histogram of intervals.

    The range is at least 0.001 of the mean interval wide.
    """
    low, high = float(intervals.min()), float(intervals.max())
    room = max(0.0, 0.5 * (1e-3 * float(intervals.mean()) - (high - low)))
    return low - room, high + room


def _fano(times: FloatArray, length: float) -> tuple[int, float]:
    """Divide impact times [s] into windows of a length [s]; return the number of windows and the Fano factor.

    The Fano factor is the variance of the number of impacts in a window, divided by the mean number.
    """
    # Windows start half an interval before the first impact, so that impacts of a clock avoid the edges.
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
        raise InputError(
            f"touches: {times.size} times", key="touches", expected=f"at least {_FEWEST + 1}{why}"
        )
    if not np.isfinite(times).all() or (np.diff(times) <= 0.0).any():
        raise InputError("touches: expected finite, ascending times, s", key="touches")
    return times
