"""The safe rate: how fast a hammer prints any pattern of dots well.

R(limits) is the largest rate of a grid such that at it and at every rate of the grid below it all dots are
within limits: those of all 255 patterns of eight slots from rest, and those of the binary de Bruijn cycle of
order 8, in which every word of eight slots occurs once, after 64 slots of it.

The grid begins at 100 Hz unless told otherwise: ten milliseconds are several times the time in which such a
hammer settles, so that below that every dot is a single pulse from rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.printing.dots.judging import FAULTS
from printhammer.printing.dots.limits import Limits
from printhammer.printing.dots.nominal import nominal as single_pulse
from printhammer.printing.dots.slots import LEAD_IN, SLOTS, cycle_with_lead_in, eight_slot_patterns, slots_of
from printhammer.printing.dots.strategy import name_of, open_loop
from printhammer.printing.dots.trial import Case, attempt
from printhammer.run.problem import TOLERANCE

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt
    import xarray as xr

    from printhammer.hammer.hammer import Hammer
    from printhammer.printing.dots.nominal import SinglePulse
    from printhammer.printing.dots.strategy import Strategy
    from printhammer.printing.dots.trial import Trial
    from printhammer.support.arrays import FloatArray

FIRST: Final = 100.0
"""First rate of the grid, Hz."""

LAST: Final = 4000.0
"""Last rate of the grid, Hz."""

STEP: Final = 5.0
"""Step of the grid, Hz."""

MOST_RATES: Final = 10_000
"""Number of rates above which a grid is refused."""

_TOGETHER: Final = 16


@dataclass(frozen=True)
class Failure:
    """The dot that is off first at the first rate that does not pass.

    Attributes
    ----------
    rate : float
        Slots per second, Hz.
    pattern : str
        The slots up to this dot, 1 where a dot is wanted; in the cycle the eight slots that end with it.
    in_cycle : bool
        Whether it is a dot of the cycle.
    slot : int
        Number of its slot; in the cycle counted from the end of the lead-in.
    fault : str
        One of `printhammer.printing.dots.judging.FAULTS`.
    deviation : float
        Of the force, in parts of the single-pulse force, or of the arrival, s, or number of extra contacts;
        NaN where the fault is another one.
    share : float
        Part of the patterns that do not pass at this rate; of a failure in the cycle, part of its dots.
    """

    rate: float
    pattern: str
    in_cycle: bool
    slot: int
    fault: str
    deviation: float
    share: float

    @property
    def text(self) -> str:
        """One sentence."""
        where = (
            f"in the cycle after {self.pattern[:-1]}" if self.in_cycle else f"of the pattern {self.pattern}"
        )
        what = {
            "force": f"has a force off by {100.0 * self.deviation:+.2f} %",
            "arrival": f"arrives {1e6 * self.deviation:+.1f} µs off",
            "extra contacts": f"has {self.deviation:.0f} extra contacts",
            "lost": "is lost",
            "not run": "is not run: the run ended early",
        }[self.fault]
        return f"At {self.rate:g} Hz the last dot {where} {what}."


@dataclass(frozen=True)
class SafeRate:
    """How fast a hammer prints any pattern well.

    Attributes
    ----------
    hammer : Hammer
        What is driven.
    strategy : str
        How, in words.
    limits : Limits
        How far a dot may be off.
    nominal : SinglePulse
        The single-pulse dot by which the others are judged.
    rate : float
        The safe rate, Hz; NaN where not even the first rate passes.
    failure : Failure or None
        What is wrong first at the next rate; None where the grid ends before.
    rates : array, shape (R,)
        Rates that were run, Hz.
    passed : bool array, shape (R,)
        Which of them pass.
    force_low, force_high : array, shape (R,)
        Least and largest deviation of the force of any dot, in parts of the single-pulse force; NaN where no
        dot is printed.
    arrival_low, arrival_high : array, shape (R,)
        Likewise of the arrival, s.
    lost, extra_contacts : int array, shape (R,)
        Number of lost dots and of extra contacts.
    cycle_run : bool array, shape (R,)
        Whether the cycle was run; it is not where a pattern does not pass.
    peak_drive : float
        Largest absolute value of the drives at the safe rate, A, or N of a force; NaN where there is none.
    step : float
        Of the grid, Hz.
    tolerance : float
        Of the integration.
    """

    hammer: Hammer
    strategy: str
    limits: Limits
    nominal: SinglePulse
    rate: float
    failure: Failure | None
    rates: FloatArray = field(repr=False)
    passed: npt.NDArray[np.bool_] = field(repr=False)
    force_low: FloatArray = field(repr=False)
    force_high: FloatArray = field(repr=False)
    arrival_low: FloatArray = field(repr=False)
    arrival_high: FloatArray = field(repr=False)
    lost: npt.NDArray[np.int64] = field(repr=False)
    extra_contacts: npt.NDArray[np.int64] = field(repr=False)
    cycle_run: npt.NDArray[np.bool_] = field(repr=False)
    peak_drive: float
    step: float
    tolerance: float

    @property
    def at_least(self) -> bool:
        """Whether all rates of the grid pass, so that the safe rate may be higher."""
        return self.failure is None

    def to_dataset(self) -> xr.Dataset:
        """Return the rates as a Dataset over `rate`, with units and provenance in the attributes."""
        from printhammer.printing.rates.quality_tables import safe_rate_dataset

        return safe_rate_dataset(self)

    def plot(self, **options: Any) -> Any:
        """Draw the deviations against the rate; returns a matplotlib figure."""
        # By name, so that physics does not depend on pictures.
        return import_module("printhammer.figures.printing.quality").plot_safe_rate(self, **options)


class _Row(NamedTuple):
    passed: bool
    force: tuple[float, float]
    arrival: tuple[float, float]
    lost: int
    extra_contacts: int
    cycle_run: bool


def safe_rate(
    hammer: Hammer,
    strategy: Strategy = open_loop,
    *,
    limits: Limits | None = None,
    nominal: SinglePulse | None = None,
    first: float | str = FIRST,
    last: float | str = LAST,
    step: float | str = STEP,
    stop: bool = True,
    cycle: bool = True,
    tolerance: float = TOLERANCE,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> SafeRate:
    """Find the largest rate up to which a hammer prints every pattern well.

    Parameters
    ----------
    hammer : Hammer
        What is driven.
    strategy : Strategy, optional
        How; by default open loop.
    limits : Limits, optional
        How far a dot may be off; by default 10 % of the force, 50 us, no extra contacts.
    nominal : SinglePulse, optional
        The single-pulse dot by which the others are judged; by default that of the hammer. For a hammer that
        differs from the one that a drive was made for, that of the latter.
    first, last, step : float or str, optional
        The grid of rates, Hz, or text with a unit.
    stop : bool, optional
        Whether to stop at the first rate that does not pass; otherwise the rates up to the last one are run
        as well, for a chart.
    cycle : bool, optional
        Whether the dots of the cycle have to be within limits too, beside those of the patterns from rest.
    tolerance : float, optional
        As for `printhammer.simulate`.
    threads : int, optional
        By default as many as there are cores; the result does not depend on it.
    progress : callable, optional
        Called with the rate, Hz, up to which all is run.

    Returns
    -------
    SafeRate
        The rate, what limits it, and the deviations at every rate that was run.

    Raises
    ------
    InputError
        An argument is not what is described above; a hammer whose single pulse makes no dot; a strategy whose
        drives do not fit.
    """
    grid = rate_grid(first, last, step)
    bounds = Limits() if limits is None else limits
    single = single_pulse(hammer, tolerance=tolerance) if nominal is None else nominal
    patterns = from_rest(every=strategy is not open_loop)
    around_it = [slots_of(cycle_with_lead_in())]
    options: dict[str, Any] = {"limits": bounds, "tolerance": tolerance, "threads": threads}
    rows: list[_Row] = []
    failure: Failure | None = None
    safe, best = math.nan, None
    for begin in range(0, len(grid), _TOGETHER):
        cases = [Case(hammer, single, rate) for rate in grid[begin : begin + _TOGETHER].tolist()]
        trial = attempt(cases, patterns, strategy, **options)
        good = np.flatnonzero(trial.passed)
        if stop and failure is None and not trial.passed.all():
            good = good[good < np.argmin(trial.passed)]
        around = None
        if cycle and good.size:
            around = attempt([cases[k] for k in good], around_it, strategy, judged_from=LEAD_IN, **options)
        for k, case in enumerate(cases):
            place = int(np.searchsorted(good, k))
            run = around if around is not None and place < good.size and good[place] == k else None
            row = _row(trial, k, run, place)
            rows.append(row)
            if failure is None and row.passed:
                safe, best = case.rate, (trial, k, run, place)
            elif failure is None:
                failure = _failure(trial, k) if run is None else _failure(run, place, in_cycle=True)
                if stop:
                    break
        if progress is not None:
            progress(float(grid[min(len(rows), len(grid)) - 1]))
        if stop and failure is not None:
            break
    return SafeRate(
        hammer=hammer,
        strategy=name_of(strategy),
        limits=bounds,
        nominal=single,
        rate=safe,
        failure=failure,
        rates=grid[: len(rows)],
        passed=np.array([row.passed for row in rows]),
        force_low=np.array([row.force[0] for row in rows]),
        force_high=np.array([row.force[1] for row in rows]),
        arrival_low=np.array([row.arrival[0] for row in rows]),
        arrival_high=np.array([row.arrival[1] for row in rows]),
        lost=np.array([row.lost for row in rows]),
        extra_contacts=np.array([row.extra_contacts for row in rows]),
        cycle_run=np.array([row.cycle_run for row in rows]),
        # Dear where pulses overlap, so only of the rate that is found.
        peak_drive=math.nan if best is None else _peak(*best),
        step=read_positive(step, "Hz", "step"),
        tolerance=tolerance,
    )


def rate_grid(first: float | str, last: float | str, step: float | str) -> FloatArray:
    """Return a grid of rates, Hz.

    Raises
    ------
    InputError
        A number is not positive, the last rate is below the first, or there are too many.
    """
    low, high, apart = (
        read_positive(value, "Hz", name) for value, name in ((first, "first"), (last, "last"), (step, "step"))
    )
    if high < low:
        raise InputError(f"last = {last!r}: expected a rate not below the first one, {low:g} Hz")
    # The last rate belongs to the grid also where the division is rounded down.
    count = math.floor((high - low) / apart * (1.0 + 1e-12)) + 1
    if count > MOST_RATES:
        raise InputError(f"{count} rates, expected at most {MOST_RATES}")
    return np.array([low + apart * number for number in range(count)])


def from_rest(*, every: bool) -> list[tuple[int, ...]]:
    """Return the patterns of eight slots, by the numbers of the slots at which dots are wanted.

    Parameters
    ----------
    every : bool
        Whether to return all 255, or only the 128 that begin with a dot: in an open loop from rest the others
        are some of these, later.
    """
    found = [slots_of(row) for row in eight_slot_patterns()]
    return [slots for slots in found if every or slots[0] == 0]


def _members(trial: Trial, case: int) -> slice:
    count = len(trial.patterns)
    return slice(case * count, (case + 1) * count)


def _row(trial: Trial, case: int, around: Trial | None, place: int) -> _Row:
    parts = [(trial, _members(trial, case))]
    if around is not None:
        parts.append((around, _members(around, place)))
    passed = all(bool(one.judgement.passed[rows].all()) for one, rows in parts)

    def ends(name: str) -> tuple[float, float]:
        values = np.concatenate([getattr(one.judgement, name)[rows].ravel() for one, rows in parts])
        known = values[~np.isnan(values)]
        return (float(known.min()), float(known.max())) if known.size else (math.nan, math.nan)

    def total(name: str) -> int:
        return sum(int(getattr(one.judgement, name)[rows].sum()) for one, rows in parts)

    force, arrival = ends("force_deviation"), ends("arrival_deviation")
    return _Row(passed, force, arrival, total("lost"), total("extra_contacts"), around is not None)


def _peak(trial: Trial, case: int, around: Trial | None, place: int) -> float:
    drives = list(trial.drives[_members(trial, case)])
    if around is not None:
        drives += around.drives[_members(around, place)]
    return max(drive.peak for drive in drives)


def _failure(trial: Trial, case: int, *, in_cycle: bool = False) -> Failure:
    """Return the failure that comes in the earliest slot, of several that of the first pattern."""
    rows = _members(trial, case)
    faults, slots = trial.judgement.faults[rows], trial.slots[rows]
    wrong = faults >= 0
    row, dot = np.unravel_index(int(np.argmin(np.where(wrong, slots, np.iinfo(np.int64).max))), slots.shape)
    slot, judgement = int(slots[row, dot]), trial.judgement
    member = rows.start + int(row)
    deviation = {
        "force": judgement.force_deviation,
        "arrival": judgement.arrival_deviation,
        "extra contacts": judgement.extra_contacts,
    }.get(FAULTS[faults[row, dot]])
    since = slot - SLOTS + 1 if in_cycle else 0
    wanted = set(trial.patterns[int(row)])
    return Failure(
        rate=trial.cases[case].rate,
        pattern="".join("1" if number in wanted else "0" for number in range(since, slot + 1)),
        in_cycle=in_cycle,
        slot=slot - LEAD_IN if in_cycle else slot,
        fault=FAULTS[faults[row, dot]],
        deviation=math.nan if deviation is None else float(deviation[member, dot]),
        share=float(wrong.sum() / judgement.wanted[rows].sum() if in_cycle else wrong.any(axis=1).mean()),
    )
