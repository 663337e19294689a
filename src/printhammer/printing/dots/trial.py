"""Trial printing: simulate patterns under a strategy, and compare the dots with limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Unpack

import numpy as np

from printhammer.drive.batch import firings_of, joined
from printhammer.drive.trains import Drive
from printhammer.drive.waveforms.shapes import Waveform
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.judging import Judgement, Limits, judge
from printhammer.printing.dots.nominal import SinglePulse
from printhammer.printing.dots.strategy import (
    FIRST_SLOT,
    Strategy,
    checked_drives,
    long_patterns,
    open_loop,
)
from printhammer.results import Declared, column, part
from printhammer.run.effort import DEFAULT, Effort, Keywords, computation
from printhammer.run.ensemble import DotTable, Ensemble, ExtraDots
from printhammer.run.waits import waits_of
from printhammer.run.window import longest_of
from printhammer.support.arrays import BoolArray, FloatArray, IntArray


class Case(NamedTuple):
    """Case of a trial: hammer, single-pulse dot for comparison, and slot rate, Hz."""

    hammer: Hammer
    nominal: SinglePulse
    rate: float


class Trial(Declared):
    """Dots of all patterns in all cases (hammer and rate).

    The ensemble members, one for each pattern in each case, are ordered by case, then by pattern.
    """

    cases: tuple[Case, ...] = part("hammers and rates")
    patterns: tuple[tuple[int, ...], ...] = part("indices of the slots with a dot")
    drives: Sequence[Drive] = part("drive of each member")
    slots: IntArray = column(
        "1", "index of the slot of each firing; -1 where there is no firing", "member firing"
    )
    due: FloatArray = column("s", "slot time of each firing", "member firing")
    ends: FloatArray = column("s", "end times of the simulations", "member")
    dots: DotTable = part("dots of the firings")
    judgement: Judgement = part("deviations and faults of the dots")
    statuses: tuple[str, ...] = part("status of each simulation")
    extra: ExtraDots | None = part("extra contacts", more="if requested", default=None)

    @property
    def passed(self) -> BoolArray:
        """Whether every pattern passes, for each case."""
        return np.asarray(self.judgement.passed.reshape(len(self.cases), -1).all(axis=1))

    def rows(self, case: int) -> slice:
        """Return the slice of ensemble members that belong to a case, one member per pattern."""
        return slice(case * len(self.patterns), (case + 1) * len(self.patterns))


@computation
def attempt(
    cases: Sequence[Case],
    patterns: Sequence[tuple[int, ...]],
    strategy: Strategy = open_loop,
    *,
    limits: Limits,
    judged_from: int | Sequence[int] = 0,
    extra: bool = False,
    effort: Effort = DEFAULT,
    **_keywords: Unpack[Keywords],
) -> Trial:
    """Simulate all patterns in all cases from rest, and compare the dots with the limits.

    A pattern lists the indices of its slots with a dot, at least one. Slots before `judged_from`, one index
    for all patterns or one for each, are a lead-in. With `extra`, every extra contact is recorded.

    Each ensemble member has a status. A simulation that fails raises no exception; its pattern does not pass.
    """
    own = [checked_drives(strategy, case.hammer, patterns, case.rate) for case in cases]
    drives = joined(own)
    every = list(patterns) * len(cases)
    slots = np.full((len(every), max(len(pattern) for pattern in patterns)), -1)
    for row, pattern in zip(slots, every, strict=True):
        row[: len(pattern)] = pattern
    rates = np.repeat([case.rate for case in cases], len(patterns))
    due = FIRST_SLOT + slots / rates[:, np.newaxis]
    # A drive may fire its last dot before or after the slot.
    fired = [fired_of(strategy, case.hammer, each[0]) for case, each in zip(cases, own, strict=True)]
    waits = waits_of([case.hammer for case in cases], fired, effort.threads)
    ends = np.maximum(firings_of(drives).last, due.max(axis=1)) + np.repeat(waits, len(patterns))
    hammers = [case.hammer for case in cases for _ in patterns]
    result = Ensemble(hammers, drives, ends, tolerance=effort.tolerance).run(
        dots=True, extra=extra, **effort.running
    )
    dots = result.dots
    assert dots is not None
    nominals = [case.nominal for case in cases for _ in patterns]
    begin = np.tile(np.broadcast_to(judged_from, (len(patterns),)), len(cases))
    judgement = judge(dots, slots >= begin[:, np.newaxis], due, nominals, limits, result.ok)
    return Trial(
        cases=tuple(cases),
        patterns=tuple(patterns),
        drives=drives,
        slots=slots,
        due=due,
        ends=ends,
        dots=dots,
        judgement=judgement,
        statuses=tuple(result.status_names),
        extra=result.extra,
    )


def fired_of(strategy: Strategy, hammer: Hammer, drive: Drive) -> Waveform:
    """Return the pulse whose width determines the simulation time.

    The pulse is the waveform of the strategy, else of the hammer, else the longest waveform of the drive.
    """
    own = getattr(strategy, "waveform", None)
    return own if isinstance(own, Waveform) else hammer.waveform or longest_of(drive)


def attempt_long(cases: Sequence[Case], strategy: Strategy = open_loop, **options: Any) -> Trial:
    """Simulate the long patterns in all cases (hammer and rate); options as for `attempt`."""
    patterns = long_patterns()
    begin = [pattern.judged_from for pattern in patterns]
    return attempt(cases, [pattern.slots for pattern in patterns], strategy, judged_from=begin, **options)


def attempt_patterns(
    cases: Sequence[Case],
    patterns: Sequence[tuple[int, ...]],
    strategy: Strategy,
    *,
    long: bool,
    stop: bool,
    **options: Any,
) -> list[list[tuple[Trial, int]]]:
    """Simulate patterns in all cases and, with `long`, the long patterns in the cases that pass.

    With `stop`, the long patterns are simulated only up to the first case that fails. The result lists, for
    each case, one or two trials with the index of the case in each trial.
    """
    trial = attempt(cases, patterns, strategy, **options)
    runs = [[(trial, k)] for k in range(len(cases))]
    good = np.flatnonzero(trial.passed).tolist()
    if stop and not trial.passed.all():
        good = [k for k in good if k < np.argmin(trial.passed)]
    if long and good:
        lasting = attempt_long([cases[k] for k in good], strategy, **options)
        for place, k in enumerate(good):
            runs[k].append((lasting, place))
    return runs
