"""Quench map: the effect of a second pulse as a function of its time and its width.

Fig. 6 of F. Hendriks, *Bounce and Chaotic Motion in Impact Print Hammers* (1983), shows two cases: fired
again after 660 µs, the hammer is braked and prints no second dot; after 700 µs the hammer makes a complete
excursion. The quench map extends the two cases to a plane: the time between two firings against the width of
the second pulse, with an unchanged first pulse. Where pulses overlap, their currents add.

A drive fires a single waveform. To fire two different pulses without compiling another kernel, one waveform
contains both pulses, far apart. The drive has four firings, timed so that only the first pulse, at the start
of the run, and the second pulse, at the second firing, fall into the run; the other two firings serve only to
assign the dots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from copy import copy
from typing import Any, ClassVar, Final, Self, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.chaos.basins.basins import Range, check_cells, read_axis
from printhammer.drive.input import read_positive
from printhammer.drive.segments import table
from printhammer.drive.sequence import PulseSequence
from printhammer.drive.trains import Drive, PulseTrain
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.results import Result, column, coordinate, derived, part, provenance, scalar
from printhammer.results.summary import (
    FactRow,
    Facts,
    Summary,
    interval,
    quantity,
)
from printhammer.run.effort import DISPLAY, Effort, Keywords, computation
from printhammer.run.ensemble import Ensemble
from printhammer.run.regime import waveform_of
from printhammer.run.simulate import simulate
from printhammer.run.window import time_scale
from printhammer.support.arrays import BoolArray, FloatArray, TextArray

TAIL: Final = 1e-3
"""Default time after the second firing within which a pack contact is the second dot, s; arbitrary."""

_PIECE: Final = 8192  # Number of cells integrated in one batch, which bounds the memory; arbitrary
_SPACING: Final = 5e-6  # Spacing of the samples of the first run at the default tail, s; arbitrary
_FINE: Final = 8
"""Number of samples of the refined run on either side of the highest sample of the first run; arbitrary."""
_PEAK_TOLERANCE: Final = 1e-8
"""Largest tolerance of the refined run, since `DISPLAY_TOLERANCE` misses peaks by 1e-4 of the stroke."""
_FIRST, _SECOND = 2, 3  # Indices of the firings of the first and the second pulse


class QuenchMap(Result):
    """Effect of a second pulse as a function of the time between the firings and of its width."""

    hammer: Hammer = part("the hammer")
    waveform: Waveform = part("first pulse; the second pulse differs in width")
    gaps: FloatArray = coordinate("s", "time between the two firings", "gap", name="gap")
    widths: FloatArray = coordinate("s", "width of the second pulse", "width", name="width")
    struck: BoolArray = column(
        "1", "whether the second firing printed a dot", "gap width", more="False for a lost dot"
    )
    peak: FloatArray = column(
        "m",
        "largest local maximum after the second firing",
        "gap width",
        more="nan without a maximum; for a lost dot interpolated, accurate to 1e-5 of the stroke",
    )
    force: FloatArray = column(
        "N", "largest pack force of the second dot", "gap width", more="nan for a lost dot"
    )
    flight_time: FloatArray = column(
        "s",
        "flight time of the second dot",
        "gap width",
        more="from firing to touch; nan for a lost dot",
    )
    status: TextArray = column("", "status of the run", "gap width")
    single_force: float = scalar(
        "N", "largest pack force of the first pulse alone", more="nan if it makes no dot"
    )
    single_flight_time: float = scalar(
        "s", "flight time of the first pulse alone", more="nan if it makes no dot"
    )
    tail: float = scalar("s", "time after the second firing within which a contact counts as the second dot")
    tolerance: float = part("tolerance of the integration")

    @property
    def title(self) -> str:
        """Title of the quench map, with the name of the hammer."""
        return f"quench map of {self.hammer.name}"

    def summary(self) -> Summary:
        """Summarise the number of lost second dots, and the forces and flight times of the printed dots."""
        struck, lost = self.struck, int(self.lost.sum())
        first = f"{quantity(self.single_force, 'N')}, flight time {quantity(self.single_flight_time, 's')}"
        rows: list[FactRow] = [
            ("second dots", f"{int(struck.sum())} struck, {lost} of {self.status.size} lost"),
            ("first alone", first),
        ]
        if struck.any() and np.isfinite(self.single_force):
            ratio = self.force_ratio[struck]
            rows.append(("force ratio", f"{ratio.min():.3f} to {ratio.max():.3f}"))
            rows.append(("flies shorter by", interval(self.flight_gain[struck], "s")))
        return Summary([Facts(rows)])

    @property
    def provenance(self) -> dict[str, Any]:
        """Provenance of the map: hammer, first pulse as the waveform, overlap rule "add", and tolerance."""
        return provenance(hammer=self.hammer, waveform=self.waveform, overlap="add", tolerance=self.tolerance)

    @property
    def lost(self) -> BoolArray:
        """Mask of the cells whose second dot is lost; False where the run ended early."""
        return np.asarray(~self.struck & (self.status == "ok"))

    @property
    @derived("1", "second peak, 0 at the backstop and 1 at the pack", "gap width")
    def peak_share(self) -> FloatArray:
        """Peak displacement after the second firing, as a fraction of the way from backstop to pack front."""
        front = self.hammer.front
        assert front is not None
        return (self.peak - self.hammer.origin) / (front - self.hammer.origin)

    @property
    @derived("1", "ratio of the force of the second dot to that of the first pulse alone", "gap width")
    def force_ratio(self) -> FloatArray:
        """Ratio of the peak pack force of the second dot to that of the first pulse fired alone."""
        return self.force / self.single_force

    @property
    @derived("s", "flight time of the first pulse alone minus that of the second dot", "gap width")
    def flight_gain(self) -> FloatArray:
        """Flight time of the first pulse fired alone minus the flight time of the second dot, s."""
        return self.single_flight_time - self.flight_time


class TwoPulses(Waveform):
    """Waveform that contains two different pulses, far apart in time, for a drive of a single waveform."""

    shape: ClassVar[str] = "two pulses"
    first: Waveform
    second: Waveform
    apart: float
    largest: float

    def segments(self) -> FloatArray:
        """Return the segment table of the waveform.

        The waveform is zero until the first pulse begins, `apart` seconds after the start; the second pulse
        begins at twice this time.
        """
        rows = [
            (number * self.apart + row[0], *row[1:])
            for number, pulse in enumerate((self.first, self.second), 1)
            for row in pulse.segments().tolist()
        ]
        return table(rows[:-1], rows[-1][0])

    def scaled(self, factor: float) -> Self:
        """Return a copy of the waveform with both pulses multiplied by `factor`."""
        scaled = {"first": self.first.scaled(factor), "second": self.second.scaled(factor)}
        return self.model_copy(update={**scaled, "largest": abs(factor) * self.largest})

    @property
    def peak(self) -> float:
        """Largest absolute value of any pulse of the quench map.

        The value is the same for all runs of the map, so that all runs are integrated with the same scales.
        """
        return self.largest


class TwoPulseDrive(Drive):
    """Drive that fires two different pulses; its run starts at `begin`, when the first pulse is fired."""

    def __init__(self, waveform: TwoPulses, gap: float) -> None:
        super().__init__(waveform, self.firings(waveform.apart, gap))
        self.pulses = waveform.first, waveform.second

    @staticmethod
    def firings(apart: float, gap: float) -> FloatArray:
        """Compute the four firing times [s]: two before the run, and the two firings that print the dots.

        `apart` is the time between the two pulses in the waveform, `gap` the time between the last two
        firings; both in seconds.
        """
        return np.array([gap, apart, 2.0 * apart, 2.0 * apart + gap])

    @property
    def begin(self) -> float:
        """Start time of the run, s: the firing of the first pulse."""
        return float(self._times[_FIRST])

    def with_firings(self, times: FloatArray) -> Self:
        """Return a copy of the drive with new firing times [s], in the form returned by `firings`."""
        result = copy(self)
        result._times = times
        return result


@computation
def quench_map(
    hammer: Hammer,
    *,
    gaps: Range | None = None,
    widths: Range | None = None,
    waveform: Waveform | None = None,
    tail: float | str | None = None,
    effort: Effort = DISPLAY,
    **_keywords: Unpack[Keywords],
) -> QuenchMap:
    """Compute the quench map: fire twice from rest, and record the second dot.

    Parameters
    ----------
    hammer : Hammer
        A hammer with a pack.
    gaps : tuple, optional
        Smallest value, largest value and number of values of the time between the two firings, s; the two
        limits, which are included, may be text with a unit. By default 128 values from 0.5 to 0.9 ms,
        multiplied by `printhammer.run.window.time_scale` of the device.
    widths : tuple, optional
        As `gaps`, for the width of the second pulse; by default 128 values from 0.5 to 1.5 times the width of
        the first pulse.
    waveform : Waveform, optional
        The first pulse, which needs a width; by default the waveform of the hammer.
    tail : float or str, optional
        Time after the second firing within which a pack contact counts as the second dot, s, or text with a
        unit; by default 1 ms, multiplied by `time_scale` like `gaps`.

    Returns
    -------
    QuenchMap
        The second dot, and a status, for each cell; a run that ends early raises no exception.
    """
    pulse = waveform_of(hammer, waveform)
    width = getattr(pulse, "width", None)
    if not isinstance(width, float):
        raise InputError(
            f"waveform: a {pulse.shape} has no width", key="waveform", expected="a pulse with a width"
        )
    if hammer.front is None:
        raise InputError(
            f"the hammer {hammer.name!r} has no pack", key="pack", expected="a hammer with a pack"
        )
    scale = time_scale(hammer, pulse)
    times = read_axis((0.5e-3 * scale, 0.9e-3 * scale, 128) if gaps is None else gaps, "gaps", "s")
    wide = read_axis((0.5 * width, 1.5 * width, 128) if widths is None else widths, "widths", "s")
    for name, axis in (("gaps", times), ("widths", wide)):
        if not axis[0] > 0.0:
            raise InputError(f"{name}: {axis[0]:.9g} s", key=name, expected="times above 0 s")
    wait = TAIL * scale if tail is None else read_positive(tail, "s", "tail")
    check_cells(times.size, wide.size)
    alone = simulate(
        hammer, PulseTrain(pulse), duration=pulse.support + wait, tolerance=effort.tolerance
    ).dots[0]
    seconds = [type(pulse)(**{**dict(pulse), "width": width}) for width in wide.tolist()]
    drives = two_pulse_drives(pulse, seconds, float(times[-1]) + max(wait, pulse.support))
    rows = max(1, _PIECE // wide.size)
    pieces = []
    for first in range(0, times.size, rows):
        part = effort.within(first * wide.size, times.size * wide.size)
        pieces.append(_piece(hammer, drives, times[first : first + rows], wait, part))
    struck, status, peak, force, flight = (
        np.concatenate(parts).reshape(times.size, wide.size) for parts in zip(*pieces, strict=True)
    )
    return QuenchMap(
        hammer=hammer,
        waveform=pulse,
        gaps=times,
        widths=wide,
        struck=struck,
        peak=peak,
        force=force,
        flight_time=flight,
        status=status,
        single_force=math.nan if alone.peak_force is None else alone.peak_force,
        single_flight_time=math.nan if alone.flight_time is None else alone.flight_time,
        tail=wait,
        tolerance=effort.tolerance,
    )


def two_pulse_drives(first: Waveform, seconds: Sequence[Waveform], last: float) -> list[TwoPulseDrive]:
    """Build one drive for each second pulse in `seconds`; each drive fires `first`, then the second pulse.

    A run begins in the rest state at the time `begin` of its drive, and lasts at most `last` seconds. The
    second pulse is fired after half of this time; `TwoPulseDrive.with_firings` sets other times.
    """
    largest = max(first.peak, *(second.peak for second in seconds))
    # A power of two, so that sums of it with other times are rounded the same way everywhere.
    apart = 2.0 ** math.ceil(math.log2(last + first.support))
    return [
        TwoPulseDrive(
            TwoPulses(first=first, second=second, apart=apart, largest=largest, quantity=first.quantity),
            0.5 * last,
        )
        for second in seconds
    ]


def _piece(
    hammer: Hammer, drives: Sequence[TwoPulseDrive], gaps: FloatArray, tail: float, effort: Effort
) -> tuple[npt.NDArray[Any], ...]:
    """Simulate all drives at a block of gaps [s]; each run ends `tail` seconds after the second firing.

    Returns five arrays over the runs, in this order: whether the second firing printed a dot; the status of
    the run; the peak displacement after the second firing [m]; the peak pack force of the second dot [N]; and
    its flight time [s].
    """
    begin, number = 0.0, 1
    every: list[Drive]
    if drives[0].pulses[0].replaces:
        # Each pulse of a driver replaces the one before: no pulse may be active before the first firing.
        every = [PulseSequence(drive.pulses, [0.0, gap]) for gap in gaps.tolist() for drive in drives]
    else:
        begin, number = drives[0].begin, _SECOND
        firings = [TwoPulseDrive.firings(0.5 * begin, gap) for gap in gaps.tolist()]
        every = [drive.with_firings(times) for times in firings for drive in drives]
    ends = np.repeat(begin + gaps + tail, len(drives))
    span = float(gaps[-1] - gaps[0]) + tail
    step = _SPACING * max(1.0, tail / TAIL)
    grid = begin + float(gaps[0]) + np.linspace(0.0, span, max(4, math.ceil(span / step) + 1))
    result = Ensemble(hammer, every, ends, starts=begin, tolerance=effort.tolerance).run(
        dots=True, times=grid, **effort.running
    )
    dots, x = result.dots, result.x
    assert dots is not None
    assert x is not None
    assert hammer.front is not None
    second = dots.struck[:, number]
    after = np.repeat(begin + gaps, len(drives))
    turned, times = _highest(grid, x.astype(np.float64), after)
    lost = np.flatnonzero(result.ok & ~second & np.isfinite(turned))
    if lost.size:
        # Repeat with a finer tolerance and grid: the first run and its parabola locate a peak too coarsely.
        offsets = (grid[1] - grid[0]) * np.linspace(-1.0, 1.0, 2 * _FINE + 1)
        moments = np.clip(times[lost, np.newaxis] + offsets, after[lost, np.newaxis], ends[lost, np.newaxis])
        strobes = [np.unique(row) for row in moments]
        sharp = min(effort.tolerance, _PEAK_TOLERANCE)
        closer = Ensemble(hammer, [every[k] for k in lost], ends[lost], starts=begin, tolerance=sharp).run(
            strobes=strobes, threads=effort.threads
        )
        assert closer.strobes is not None
        top = _top(closer.strobes.t, closer.strobes.x, closer.strobes.v)
        turned[lost] = np.where(np.isfinite(top), top, turned[lost])
    peak = np.where(second, np.fmax(hammer.front + dots.indentation[:, number], turned), turned)
    return (
        second,
        np.array(result.status_names, "U16"),
        np.where(result.ok, peak, np.nan),
        dots.peak_force[:, number],
        dots.flight_time[:, number],
    )


def _highest(grid: FloatArray, x: FloatArray, after: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Find the largest local maximum of the displacement of each run after the time `after` [s] of the run.

    The displacements `x` [m], shape (M, T), are sampled at the evenly spaced times `grid` [s]; samples after
    the end of a run are NaN. Returns the maxima [m] and their times [s]; the maximum is NaN for a run that
    has none.
    """
    before, here, following = x[:, :-2], x[:, 1:-1], x[:, 2:]
    bend = before - 2.0 * here + following
    slope = 0.5 * (following - before)
    top = (here > before) & (here >= following) & (bend < 0.0)
    shift = np.divide(-slope, bend, out=np.zeros_like(here), where=top)
    times = grid[1:-1] + shift * (grid[1] - grid[0])
    late = times > after[:, np.newaxis]
    heights = np.where(top & late, here + 0.5 * slope * shift, -np.inf)
    place = heights.argmax(axis=1)[:, np.newaxis]
    highest = np.take_along_axis(heights, place, axis=1)[:, 0]
    return np.where(np.isfinite(highest), highest, np.nan), np.take_along_axis(times, place, axis=1)[:, 0]


def _top(t: FloatArray, x: FloatArray, v: FloatArray) -> FloatArray:
    """Find the largest local maximum [m] of the displacement of each run, shape (M,), by interpolation.

    Times `t` [s], displacements `x` [m] and velocities `v` [m/s] of the samples have the shape (M, T). The
    velocity is assumed to be linear between samples. The result is NaN for a run without a maximum.
    """
    falls = (v[:, :-1] > 0.0) & (v[:, 1:] <= 0.0)
    drop = np.where(falls, v[:, :-1] - v[:, 1:], 1.0)
    heights = x[:, :-1] + 0.5 * np.diff(t, axis=1) * v[:, :-1] ** 2 / drop
    highest = np.where(falls, heights, -np.inf).max(axis=1)
    return np.where(np.isfinite(highest), highest, np.nan)
