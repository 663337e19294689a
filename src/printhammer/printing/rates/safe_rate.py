"""The safe rate: how fast a hammer prints any pattern of dots well.

R(limits) is the largest rate of a grid such that at it and at every rate of the grid below it all dots are
within limits: those of all 255 patterns of eight slots from rest, and those of long patterns. These are the
binary de Bruijn cycle of order 8, in which every word of eight slots occurs once, after 64 slots of it, rows
of 200 slots, and a line of text.

By default the grid begins at 100 Hz: ten milliseconds are several times the time in which such a
hammer settles, so that below that every dot is a single pulse from rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal, Unpack

import numpy as np
import numpy.typing as npt

from printhammer.derivatives.rows import DOTS, row_multipliers
from printhammer.drive.input import read_positive
from printhammer.errors import InputError
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import FAULTS, Limits
from printhammer.printing.dots.long_patterns import Kind, long_patterns
from printhammer.printing.dots.nominal import SinglePulse
from printhammer.printing.dots.nominal import nominal as single_pulse
from printhammer.printing.dots.strategy import (
    SLOTS,
    Strategy,
    eight_slot_patterns,
    name_of,
    open_loop,
    slots_of,
)
from printhammer.printing.dots.trial import Case, Trial, attempt
from printhammer.results import Declared, Result, column, coordinate, part, scalar
from printhammer.results.summary import (
    Facts,
    Summary,
    styled,
)
from printhammer.run.effort import DEFAULT, Effort, InThreads, computation
from printhammer.support.arrays import BoolArray, FloatArray, IntArray

FIRST: Final = 100.0  # First rate of the grid, Hz

LAST: Final = 4000.0  # Last rate of the grid, Hz

STEP: Final = 5.0  # Step of the grid, Hz

MOST_RATES: Final = 10_000  # Number of rates above which a grid is refused

_AT_ONCE: Final = 16  # Number of rates of one ensemble
_HAMMERS_AT_ONCE: Final = 32


class Failure(Declared):
    """The dot that is off first at the first rate that does not pass."""

    rate: float = scalar("Hz", "slots per second")
    pattern: str = part(
        "the slots up to this dot, 1 where a dot is wanted; of a long pattern the last eight at most"
    )
    kind: Literal["from rest"] | Kind = part('"from rest", or the kind of the long pattern')
    slot: int = part("number of its slot; in the cycle counted from the end of the lead-in")
    dot: int = part("number of the dot in its pattern, counted from 1")
    fault: str = part("one of `printhammer.printing.dots.judging.FAULTS`")
    deviation: float = part(
        "of the force, in parts of the single-pulse force, or of the arrival, s, or number of extra contacts",
        more="NaN where the fault is another one",
    )
    share: float = part(
        "fraction of the patterns from rest that do not pass at this rate; in a long pattern, of its dots"
    )

    @property
    def text(self) -> str:
        """One sentence."""
        where = {
            "from rest": f"the last dot of the pattern {self.pattern}",
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
        return f"At {self.rate:g} Hz {where} {what}."


class SafeRate(Result):
    """How fast a hammer prints any pattern well."""

    hammer: Hammer = part("what is driven")
    strategy: str = scalar("", "how, in words")
    limits: Limits = part("how far a dot may be off")
    nominal: SinglePulse = part("the single-pulse dot by which the others are judged")
    rate: float = scalar(
        "Hz", "the safe rate", more="NaN where not even the first rate passes", name="safe_rate"
    )
    failure: Failure | None = part(
        "what is wrong first at the next rate", more="None where the grid ends before"
    )
    rates: FloatArray = coordinate("Hz", "slots per second", "rate", more="those that were run", name="rate")
    passed: BoolArray = column("1", "whether all dots are within limits", "rate", dtype=np.int8)
    force_low: FloatArray = column(
        "1",
        "least deviation of a force from that of the single pulse",
        "rate",
        more="in parts of the latter; NaN where no dot is printed, as in all three that follow",
    )
    force_high: FloatArray = column("1", "largest deviation of a force from that of the single pulse", "rate")
    arrival_low: FloatArray = column("s", "earliest arrival, less slot time and nominal flight time", "rate")
    arrival_high: FloatArray = column("s", "latest arrival, less slot time and nominal flight time", "rate")
    lost: IntArray = column("1", "number of lost dots", "rate", dtype=np.int32)
    extra_contacts: IntArray = column("1", "number of extra contacts", "rate", dtype=np.int32)
    long_run: BoolArray = column(
        "1",
        "whether the long patterns were run after those from rest",
        "rate",
        more="they are not where one of these does not pass",
        dtype=np.int8,
    )
    multiplier: FloatArray = column(
        "1",
        "factor by which a small error in a row grows from dot to dot",
        "rate",
        more="negative where it alternates; NaN where the row is no periodic orbit, and for a closed loop",
    )
    peak_drive: float = scalar(
        "A",
        "largest absolute value of the drives at the safe rate",
        more="N of a force; NaN where there is no safe rate",
    )
    step: float = scalar("Hz", "step of the grid")
    tolerance: float = part("error allowed in one step of the integration")

    @property
    def title(self) -> str:
        """What it is, in a line."""
        return f"safe rate of {self.hammer.name}"

    def summary(self) -> Summary:
        """Return the safe rate and what limits it."""
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
            ("row", _said_of_row(growth[0]) if np.isfinite(growth).any() else None),
            ("because", "the grid ends" if self.failure is None else self.failure.text),
            ("grid", f"{first:g} to {last:g} Hz, every {self.step:g} Hz"),
        ]
        return Summary([Facts(rows)])

    @property
    def at_least(self) -> bool:
        """Whether all rates of the grid pass, so that the safe rate may be higher."""
        return self.failure is None

    def notes(self) -> dict[str, Any]:
        """Return the limits, what fails first and the single pulse."""
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
    first: float | str = FIRST,
    last: float | str = LAST,
    step: float | str = STEP,
    stop: bool = True,
    long: bool = True,
    progress: Callable[[float], None] | None = None,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[InThreads],
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
    long : bool, optional
        Whether the dots of the cycle, of rows and of a line of text have to be within limits too, beside
        those of the patterns from rest.
    progress : callable, optional
        Called with the rate, Hz, up to which all is run.

    Returns
    -------
    SafeRate
        The rate, what limits it, and the deviations at every rate that was run.
    """
    grid = rate_grid(first, last, step)
    bounds = Limits() if limits is None else limits
    single = single_pulse(hammer, tolerance=effort.tolerance) if nominal is None else nominal
    patterns = from_rest(every=strategy is not open_loop)
    options: dict[str, Any] = {"limits": bounds, "effort": effort}
    rows: list[dict[str, Any]] = []
    growth: list[FloatArray] = []
    failure: Failure | None = None
    safe = math.nan
    best: list[tuple[Trial, int]] = []
    for begin in range(0, len(grid), _AT_ONCE):
        cases = [Case(hammer, single, rate) for rate in grid[begin : begin + _AT_ONCE].tolist()]
        trial = attempt(cases, patterns, strategy, **options)
        rates = [case.rate for case in cases]
        growth.append(multipliers([hammer] * len(cases), rates, strategy, effort.quiet))
        good = np.flatnonzero(trial.passed)
        if stop and failure is None and not trial.passed.all():
            good = good[good < np.argmin(trial.passed)]
        lasting = None
        if long and good.size:
            lasting = attempt_long([cases[k] for k in good], strategy, **options)
        for k, case in enumerate(cases):
            runs = [(trial, k)]
            if lasting is not None and k in good:
                runs.append((lasting, int(np.searchsorted(good, k))))
            rows.append(_row(runs))
            if failure is None and rows[-1]["passed"]:
                safe, best = case.rate, runs
            elif failure is None:
                failure = _failure(*runs[-1], long=len(runs) > 1)
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
        # Dear where pulses overlap, so only of the rate that is found.
        peak_drive=max(
            (drive.peak for trial, case in best for drive in trial.drives[trial.rows(case)]), default=math.nan
        ),
        multiplier=np.concatenate(growth)[: len(rows)],
        step=read_positive(step, "Hz", "step"),
        tolerance=effort.tolerance,
        **{name: np.array([row[name] for row in rows]) for name in rows[0]},
    )


def _said_of_row(growth: float) -> str:
    """Return the multiplier of a row, and what comes of it, in words."""
    more = ": dots alternate, within limits" if growth < -1.0 else ""
    return f"multiplier {growth:+.3f} from dot to dot{more}"


def rate_grid(first: float | str, last: float | str, step: float | str) -> FloatArray:
    """Return a grid of rates, Hz."""
    low, high, apart = (
        read_positive(value, "Hz", name) for value, name in ((first, "first"), (last, "last"), (step, "step"))
    )
    if high < low:
        raise InputError.of("last", last, f"a rate not below the first one, {low:g} Hz", said=": expected")
    # The last rate belongs to the grid also where the division is rounded down.
    count = math.floor((high - low) / apart * (1.0 + 1e-12)) + 1
    if count > MOST_RATES:
        raise InputError(f"{count} rates", key="rates", expected=f"at most {MOST_RATES}")
    return np.array([low + apart * number for number in range(count)])


def grid_notes(grid: FloatArray) -> dict[str, float]:
    """Return what the attributes of a Dataset say of a grid of rates, Hz."""
    step = float(grid[1] - grid[0]) if len(grid) > 1 else 0.0
    return {"first_rate": float(grid[0]), "last_rate": float(grid[-1]), "step": step}


def from_rest(*, every: bool) -> list[tuple[int, ...]]:
    """Return the patterns of eight slots, by the numbers of the slots at which dots are wanted.

    That is `every` one of the 255, or only the 128 that begin with a dot: in an open loop from rest the
    others are some of these, later.
    """
    patterns = [slots_of(row) for row in eight_slot_patterns()]
    return [slots for slots in patterns if every or slots[0] == 0]


def attempt_long(cases: Sequence[Case], strategy: Strategy = open_loop, **options: Any) -> Trial:
    """Print the long patterns in all cases, with options of `printhammer.printing.dots.trial.attempt`."""
    patterns = long_patterns()
    begin = [pattern.judged_from for pattern in patterns]
    return attempt(cases, [pattern.slots for pattern in patterns], strategy, judged_from=begin, **options)


def multipliers(
    hammers: Sequence[Hammer],
    rates: Sequence[float],
    strategy: Strategy,
    effort: Effort,
    step: int = 1,
) -> FloatArray:
    """Compute the multipliers of rows with a dot in every `step`-th slot, (rows,).

    Each row has a hammer and a rate, Hz; see `printhammer.derivatives.rows.row_multipliers`. NaN for a closed
    loop, which corrects errors itself.
    """
    if hasattr(strategy, "along"):
        return np.full(len(hammers), np.nan)
    slots = tuple(range(0, step * DOTS, step))
    drives = [strategy(hammer, [slots], rate)[0] for hammer, rate in zip(hammers, rates, strict=True)]
    return row_multipliers(hammers, drives, effort)


def _row(runs: Sequence[tuple[Trial, int]]) -> dict[str, Any]:
    """Return what a safe rate says of one rate, by the names of its fields, from the runs of some cases."""

    def joined(name: str) -> npt.NDArray[Any]:
        return np.concatenate(
            [getattr(trial.judgement, name)[trial.rows(case)].ravel() for trial, case in runs]
        )

    row: dict[str, Any] = {
        "passed": bool(joined("passed").all()),
        "lost": int(joined("lost").sum()),
        "extra_contacts": int(joined("extra_contacts").sum()),
        "long_run": len(runs) > 1,
    }
    for name in ("force", "arrival"):
        values = joined(f"{name}_deviation")
        known = values[~np.isnan(values)]
        row[f"{name}_low"], row[f"{name}_high"] = (
            (float(known.min()), float(known.max())) if known.size else (math.nan, math.nan)
        )
    return row


def _failure(trial: Trial, case: int, *, long: bool) -> Failure:
    """Return the failure that comes in the earliest slot, of several that of the first pattern.

    Of long patterns that of the first one that does not pass.
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
    """Return whether all patterns, from rest and long ones, are within limits, for each hammer at a rate.

    Arguments as for `printhammer.printing.dots.trial.attempt`.
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
    """Return the safe rates of some hammers on a grid of ascending rates, Hz; arguments as for `all_pass`.

    Each hammer is judged by its own one of `singles`; progress is the number of hammers whose rate
    is found, and of all. The rate is NaN where not even the first one of the grid passes, and the last
    one where all pass.
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
