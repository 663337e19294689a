"""The safe rate: the largest slot rate up to which a hammer prints every pattern within limits.

R(limits) is the largest rate of a grid such that, at this rate and at every lower rate of the grid, all dots
are within limits: the dots of all 255 patterns of eight slots from rest, and of the long patterns. The long
patterns are the binary de Bruijn cycle of order 8, which contains every word of eight slots exactly once,
after a lead-in of 64 slots; rows of 200 slots; and a line of text.

By default the grid of the paper's hammer begins at 100 Hz: 10 ms is several times the settle-out time of such
a hammer, so below 100 Hz every dot is a single pulse from rest. The grid of a slower device is scaled down,
see `printhammer.run.window.time_scale`. For a device that returns exactly to rest, the grid of the open loop
begins with the last rate at which the device is at rest at each pulse.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import FAULTS, Limits
from printhammer.printing.dots.nominal import SinglePulse
from printhammer.printing.dots.nominal import nominal as single_pulse
from printhammer.printing.dots.settling import undisturbed_rate
from printhammer.printing.dots.strategy import (
    SLOTS,
    Kind,
    Strategy,
    eight_slot_patterns,
    long_patterns,
    name_of,
    open_loop,
    slots_of,
)
from printhammer.printing.dots.trial import Case, Trial, attempt, attempt_long, attempt_patterns
from printhammer.printing.rates.words import attempt_words, multipliers
from printhammer.results import Declared, Result, column, coordinate, part, scalar
from printhammer.results.summary import (
    Facts,
    Summary,
    styled,
)
from printhammer.run.effort import DEFAULT, Effort, InThreads, computation
from printhammer.run.window import scaled_rate
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

FIRST: Final = 100.0  # First rate of the grid of the paper's hammer, Hz; arbitrary

LAST: Final = 4000.0  # Last rate of the grid of the paper's hammer, Hz; arbitrary

STEP: Final = 5.0  # Step of the grid of the paper's hammer, Hz; arbitrary

MOST_RATES: Final = 10_000  # Largest number of rates in a grid; arbitrary

_AT_FIRST: Final = 2  # Number of rates in the first ensemble, doubled for each further ensemble; arbitrary
_FEW: Final = 3  # Number of slots of the patterns that are simulated first; arbitrary
_AT_ONCE: Final = 16  # Largest number of rates per ensemble; arbitrary
_HAMMERS_AT_ONCE: Final = 32  # Number of hammers per ensemble; arbitrary


class Failure(Declared):
    """First dot outside the limits at the lowest slot rate that fails."""

    rate: float = scalar("Hz", "slot rate")
    pattern: str = part(
        "slots up to the failed dot, 1 for a dot; at most the last eight slots of a long pattern"
    )
    kind: Literal["from rest"] | Kind = part('"from rest", or the kind of the long pattern')
    slot: int = part("index of the slot; in the cycle counted from the end of the lead-in")
    dot: int = part("number of the dot in its pattern, counted from 1")
    fault: str = part("fault of the dot, one of `printhammer.printing.dots.judging.FAULTS`")
    deviation: float = part(
        "relative force deviation, arrival deviation, s, or number of extra contacts, depending on the fault",
        more="NaN for the other faults",
    )
    share: float = part(
        "fraction of the patterns from rest that fail at this rate; for a long pattern, fraction of its dots"
    )

    @property
    def text(self) -> str:
        """Description of the failure in one sentence: rate, pattern, dot and fault."""
        where = {
            "from rest": f"pattern {self.pattern}: its last dot",
            "cycle": f"the last dot in the cycle after {self.pattern[:-1]}",
            "row": f"dot {self.dot} of a row",
            "text": f"the last dot in a line of text after {self.pattern[:-1]}",
        }[self.kind]
        what = {
            "force": f"has a force off by {100.0 * self.deviation:+.2f} %",
            "arrival": f"arrives {1e6 * self.deviation:+.1f} µs off",
            "extra contacts": f"has {self.deviation:.0f} extra contacts",
            "lost": "is lost",
            "not run": "is not run: the run ended early",
        }[self.fault]
        return f"At {self.rate:g} Hz, {where} {what}."


class SafeRate(Result):
    """The largest rate up to which a hammer prints every pattern within limits."""

    hammer: Hammer = part("driven hammer")
    strategy: str = scalar("", "name of the drive strategy")
    limits: Limits = part("limits on the dots")
    nominal: SinglePulse = part("single-pulse dot with which all dots are compared")
    rate: float = scalar("Hz", "safe rate", more="NaN if not even the first rate passes", name="safe_rate")
    failure: Failure | None = part(
        "first failure at the next rate", more="None if every rate of the grid passes"
    )
    rates: FloatArray = coordinate("Hz", "slot rate", "rate", more="simulated rates only", name="rate")
    passed: BoolArray = column("1", "whether all dots are within limits", "rate", dtype=np.int8)
    force_low: FloatArray = column(
        "1",
        "smallest (most negative) deviation of a force from the single-pulse force",
        "rate",
        more="relative to the single-pulse force; NaN if no dot is printed, as in the next three columns",
    )
    force_high: FloatArray = column("1", "largest deviation of a force from the single-pulse force", "rate")
    arrival_low: FloatArray = column(
        "s", "earliest arrival, minus slot time and single-pulse flight time", "rate"
    )
    arrival_high: FloatArray = column(
        "s", "latest arrival, minus slot time and single-pulse flight time", "rate"
    )
    lost: IntArray = column("1", "number of lost dots", "rate", dtype=np.int32)
    extra_contacts: IntArray = column("1", "number of extra contacts", "rate", dtype=np.int32)
    long_run: BoolArray = column(
        "1",
        "whether the long patterns were simulated",
        "rate",
        more="only if all patterns from rest pass",
        dtype=np.int8,
    )
    multiplier: FloatArray = column(
        "1",
        "multiplier of a small error from dot to dot in a row",
        "rate",
        more="negative if the error alternates; NaN for a row without a periodic orbit and for a closed loop",
    )
    peak_drive: float = scalar(
        "A",
        "largest absolute value of the drives at the safe rate",
        more="in N for a force; NaN if there is no safe rate",
    )
    step: float = scalar("Hz", "step of the rate grid")
    tolerance: float = part("error tolerance per integration step")

    @property
    def title(self) -> str:
        """One-line title with the name of the hammer."""
        return f"safe rate of {self.hammer.name}"

    def summary(self) -> Summary:
        """Summarise the safe rate and its limiting failure."""
        none, waveform = math.isnan(self.rate), self.hammer.waveform
        more = "at least " if self.at_least else ""
        first, last = float(self.rates[0]), float(self.rates[-1])
        growth = self.multiplier[self.rates == self.rate]
        rows = [
            ("limits", self.limits.said),
            ("drive", self.strategy),
            (
                "safe rate",
                f"{styled('bad', 'none')}: not even {first:g} Hz"
                if none
                else styled("best", f"{more}{self.rate:g} Hz"),
            ),
            ("peak", None if none else f"{self.peak_drive:.3f} {waveform.unit if waveform else ''}"),
            ("row", _row_text(growth[0]) if np.isfinite(growth).any() else None),
            ("because", "the grid ends" if self.failure is None else self.failure.text),
            ("grid", f"{first:g} to {last:g} Hz, every {self.step:g} Hz"),
        ]
        return Summary([Facts(rows)])

    @property
    def at_least(self) -> bool:
        """Whether all rates of the grid pass, so that the safe rate may be higher."""
        return self.failure is None

    def notes(self) -> dict[str, Any]:
        """Return limits, first failure and single-pulse dot, as attributes of the Dataset."""
        return {
            "limits": self.limits.text,
            "first_failure": "" if self.failure is None else self.failure.text,
            "single_force": self.nominal.force,
            "single_flight_time": self.nominal.flight_time,
        }


@computation
def safe_rate(
    hammer: Hammer,
    strategy: Strategy = open_loop,
    *,
    limits: Limits | None = None,
    nominal: SinglePulse | None = None,
    first: float | str | None = None,
    last: float | str | None = None,
    step: float | str | None = None,
    stop: bool = True,
    long: bool = True,
    progress: Callable[[float], None] | None = None,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[InThreads],
) -> SafeRate:
    """Find the largest rate up to which a hammer prints every pattern within limits.

    Parameters
    ----------
    hammer : Hammer
        The hammer to drive.
    strategy : Strategy, optional
        Drive strategy; by default open loop.
    limits : Limits, optional
        Limits on the dots; by default 10 % of the force, 50 us, no extra contacts.
    nominal : SinglePulse, optional
        Single-pulse dot with which all dots are compared; by default that of `hammer`. If the drive was
        designed for another hammer, pass the single-pulse dot of that other hammer.
    first, last, step : float or str, optional
        The grid of rates [Hz] or text with a unit; by default 100 Hz to 4 kHz, every 5 Hz, scaled down for a
        device slower than the paper's hammer. In open loop the default grid omits lower rates at which the
        device is exactly at rest at each pulse.
    stop : bool, optional
        Whether to stop at the first rate that does not pass; otherwise all rates of the grid are simulated,
        as required for a chart.
    long : bool, optional
        Whether the cycle, the rows and the line of text must pass too, besides the patterns from rest.
    progress : callable, optional
        Called with the last simulated rate, Hz.

    Returns
    -------
    SafeRate
        The rate, its limiting failure, and the deviations at every simulated rate.
    """
    grid, apart = grid_of(hammer, first, last, step)
    bounds = Limits() if limits is None else limits
    single = single_pulse(hammer, tolerance=effort.tolerance) if nominal is None else nominal
    # In a closed loop, and with a table, dots affect each other even if the armature is at rest in between.
    apart_below = undisturbed_rate(hammer) if strategy is open_loop else 0.0
    if first is None and nominal is None:
        below = int(np.searchsorted(grid, apart_below, side="right"))
        grid = grid[max(below - 1, 0) :]
    patterns = from_rest(every=strategy is not open_loop)
    every = [*patterns, *(pattern.slots for pattern in long_patterns())]
    options: dict[str, Any] = {"limits": bounds, "effort": effort}
    rows: list[dict[str, Any]] = []
    growth: list[FloatArray] = []
    failure: Failure | None = None
    safe = math.nan
    best: list[tuple[Trial, int]] = []
    size = _AT_FIRST
    while len(rows) < len(grid):
        cases = [Case(hammer, single, rate) for rate in grid[len(rows) :][:size].tolist()]
        size = min(2 * size, _AT_ONCE)
        if stop:
            # Most devices fail in the second or third slot, so short patterns are simulated first.
            quick = attempt(cases, [each for each in patterns if each[-1] < _FEW], strategy, **options).passed
            cases = cases[: int(np.argmin(quick)) + 1] if not quick.all() else cases
        brief = attempt_words(cases, every, apart_below, strategy, **options) if long else None
        runs = [] if brief is None else [[(brief[0], k)] for k in range(brief[1])]
        left = cases[len(runs) :]
        if left:
            # A failed rate is simulated again with the full patterns, for the report.
            left = left[:1] if stop and brief is not None else left
            runs += attempt_patterns(left, patterns, strategy, long=long, stop=stop, **options)
        cases = cases[: len(runs)]
        growth.append(
            multipliers([hammer] * len(cases), [case.rate for case in cases], strategy, effort.quiet)
        )
        for case, own in zip(cases, runs, strict=True):
            rows.append(_row(own, long=len(own) > 1 or (brief is not None and own[0][0] is brief[0])))
            if failure is None and rows[-1]["passed"]:
                safe, best = case.rate, own
            elif failure is None:
                failure = _failure(*own[-1], long=len(own) > 1)
                if stop:
                    break
        if progress is not None:
            progress(float(grid[len(rows) - 1]))
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
        # Expensive where pulses overlap, so computed only at the safe rate.
        peak_drive=max(
            (drive.peak for trial, case in best for drive in trial.drives[trial.rows(case)]), default=math.nan
        ),
        multiplier=np.concatenate(growth)[: len(rows)],
        step=apart,
        tolerance=effort.tolerance,
        **{name: np.array([row[name] for row in rows]) for name in rows[0]},
    )


def _row_text(growth: float) -> str:
    """Describe in words the multiplier of a row of dots.

    The multiplier, `growth`, is the factor by which a small deviation changes from one dot to the next.
    """
    more = ": dots alternate, within limits" if growth < -1.0 else ""
    return f"multiplier {growth:+.3f} from dot to dot{more}"


def grid_of(
    hammer: Hammer,
    first: float | str | None,
    last: float | str | None,
    step: float | str | None,
    spacing: float = STEP,
) -> tuple[FloatArray, float]:
    """Return a grid of rates and its step [Hz], with default values for arguments that are None.

    `spacing` is the default step for the paper's hammer, Hz; defaults scale with the time scale of the
    hammer.
    """
    values = [
        scaled_rate(hammer, default) if value is None else read_positive(value, "Hz", name)
        for name, value, default in (("first", first, FIRST), ("last", last, LAST), ("step", step, spacing))
    ]
    return rate_grid(*values), values[2]


def rate_grid(first: float | str, last: float | str, step: float | str) -> FloatArray:
    """Return a grid of rates [Hz] from `first` to at most `last`."""
    low, high, apart = (
        read_positive(value, "Hz", name) for value, name in ((first, "first"), (last, "last"), (step, "step"))
    )
    if high < low:
        raise InputError.of("last", last, f"a rate not below the first rate, {low:g} Hz")
    # The last rate belongs to the grid even if the division is rounded down.
    count = math.floor((high - low) / apart * (1.0 + 1e-12)) + 1
    if count > MOST_RATES:
        raise InputError(f"{count} rates", key="rates", expected=f"at most {MOST_RATES}")
    return np.array([low + apart * number for number in range(count)])


def grid_notes(grid: FloatArray) -> dict[str, float]:
    """Return the dataset attributes that describe a grid of rates, Hz."""
    step = float(grid[1] - grid[0]) if len(grid) > 1 else 0.0
    return {"first_rate": float(grid[0]), "last_rate": float(grid[-1]), "step": step}


def from_rest(*, every: bool) -> list[tuple[int, ...]]:
    """Return the patterns of eight slots, each as the indices of the slots with a dot.

    With `every`, all 255 patterns; otherwise the 128 that begin with a dot, which are enough in open loop
    from rest since the other patterns are delayed copies of these 128.
    """
    patterns = [slots_of(row) for row in eight_slot_patterns()]
    return [slots for slots in patterns if every or slots[0] == 0]


def _row(runs: Sequence[tuple[Trial, int]], *, long: bool) -> dict[str, Any]:
    """Compute the columns of `SafeRate` at one slot rate from the trials at that rate.

    `runs` pairs each trial with the index of its case; `long` states whether long patterns were simulated.
    """

    def joined(name: str) -> npt.NDArray[Any]:
        return np.concatenate(
            [getattr(trial.judgement, name)[trial.rows(case)].ravel() for trial, case in runs]
        )

    row: dict[str, Any] = {
        "passed": bool(joined("passed").all()),
        "lost": int(joined("lost").sum()),
        "extra_contacts": int(joined("extra_contacts").sum()),
        "long_run": long,
    }
    for name in ("force", "arrival"):
        values = joined(f"{name}_deviation")
        known = values[~np.isnan(values)]
        row[f"{name}_low"], row[f"{name}_high"] = (
            (float(known.min()), float(known.max())) if known.size else (math.nan, math.nan)
        )
    return row


def _failure(trial: Trial, case: int, *, long: bool) -> Failure:
    """Return the failure in the earliest slot of all patterns in a case; the first pattern wins a tie.

    In a trial of the long patterns (`long`), only the first pattern that does not pass is searched.
    """
    rows, judgement = trial.rows(case), trial.judgement
    faults, slots = judgement.faults[rows], trial.slots[rows]
    wrong = faults >= 0
    first = int(np.argmax(wrong.any(axis=1)))
    if long:
        wrong[first + 1 :] = False
    row, dot = np.unravel_index(int(np.argmin(np.where(wrong, slots, np.iinfo(np.int64).max))), slots.shape)
    slot, fault, member = int(slots[row, dot]), FAULTS[faults[row, dot]], rows.start + int(row)
    deviation = {
        "force": judgement.force_deviation,
        "arrival": judgement.arrival_deviation,
        "extra contacts": judgement.extra_contacts,
    }.get(fault)
    since = max(slot - SLOTS + 1, 0) if long else 0
    wanted = set(trial.patterns[int(row)])
    kind = long_patterns()[int(row)].kind if long else "from rest"
    begin = long_patterns()[int(row)].judged_from if long else 0
    return Failure(
        rate=trial.cases[case].rate,
        pattern="".join("1" if number in wanted else "0" for number in range(since, slot + 1)),
        kind=kind,
        slot=slot - begin,
        dot=int(dot) + 1,
        fault=fault,
        deviation=math.nan if deviation is None else float(deviation[member, dot]),
        share=float(wrong.sum() / judgement.wanted[rows][first].sum() if long else wrong.any(axis=1).mean()),
    )


def all_pass(
    cases: Sequence[Case],
    strategy: Strategy = open_loop,
    *,
    limits: Limits,
    effort: Effort,
) -> BoolArray:
    """Whether all patterns, from rest and long, are within limits, for each case (hammer and rate).

    For the arguments see `printhammer.printing.dots.trial.attempt`.
    """
    options: dict[str, Any] = {"limits": limits, "effort": effort}
    patterns = from_rest(every=strategy is not open_loop)
    passed = np.zeros(len(cases), dtype=np.bool_)
    for begin in range(0, len(cases), _HAMMERS_AT_ONCE):
        some = cases[begin : begin + _HAMMERS_AT_ONCE]
        passed[begin : begin + len(some)] = attempt(some, patterns, strategy, **options).passed
    left = np.flatnonzero(passed)
    for begin in range(0, left.size, _HAMMERS_AT_ONCE):
        piece = left[begin : begin + _HAMMERS_AT_ONCE]
        passed[piece] = attempt_long([cases[k] for k in piece.tolist()], strategy, **options).passed
    return passed


def safe_rates(
    hammers: Sequence[Hammer],
    singles: Sequence[SinglePulse],
    grid: FloatArray,
    strategy: Strategy = open_loop,
    *,
    limits: Limits,
    effort: Effort,
) -> FloatArray:
    """Compute the safe rates [Hz] of many hammers on an ascending grid of rates [Hz].

    For the other arguments see `all_pass`. The dots of each hammer are compared with its own entry of
    `singles`; progress counts the hammers whose safe rate is known. The rate is NaN if not even the first
    rate of the grid passes, and the last rate of the grid if all pass.
    """
    rates = np.full(len(hammers), np.nan)
    alive = np.arange(len(hammers))
    for rate in grid.tolist():
        cases = [Case(hammers[k], singles[k], rate) for k in alive.tolist()]
        alive = alive[all_pass(cases, strategy, limits=limits, effort=effort.quiet)]
        rates[alive] = rate
        effort.report(len(hammers) - alive.size, len(hammers))
        if not alive.size:
            break
    return rates
