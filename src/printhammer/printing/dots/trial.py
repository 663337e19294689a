"""Trial printing: simulate patterns under a strategy as one ensemble, and compare the dots with limits.

A slow device with a rigid backstop is exactly at rest some slots after a dot. A pattern is then a sequence of
*words*, the dots between such gaps, that do not affect each other. The words of all test patterns are few:
for dots that affect only the next slot they are rows of one to eight dots, and a row of 200.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Any, Final, NamedTuple, Unpack

import numpy as np

from printhammer.derivatives.rows import DOTS, row_multipliers
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

_MOST_SLOTS: Final = 3  # Largest number of slots to rest for which patterns are split; arbitrary

_ROW: Final = 24  # Number of dots to which rows are shortened if their last dots are equal; arbitrary
_SAME: Final = 4  # Number of dots at the end of a shortened row that have to be equal; arbitrary

# Relative difference below which two dots are equal; arbitrary, above the errors of integration
_EQUAL: Final = 1e-6


class Case(NamedTuple):
    """Case of a trial: hammer, single-pulse dot for comparison, and slot rate, Hz."""

    hammer: Hammer
    nominal: SinglePulse
    rate: float


class Trial(Declared):
    """Dots of all patterns in all cases (hammer and rate); members are ordered by case, then by pattern."""

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
        """Return the member indices of a case, as a slice with one member per pattern."""
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

    Each member has a status: a simulation that fails raises no exception, and its pattern does not pass.
    """
    own = [checked_drives(strategy, case.hammer, patterns, case.rate) for case in cases]
    drives = joined(own)
    every = list(patterns) * len(cases)
    slots = np.full((len(every), max(len(pattern) for pattern in patterns)), -1)
    for row, pattern in zip(slots, every, strict=True):
        row[: len(pattern)] = pattern
    rates = np.repeat([case.rate for case in cases], len(patterns))
    due = FIRST_SLOT + slots / rates[:, np.newaxis]
    # A drive may fire its last dot ahead of the slot or after it.
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
    """Return the waveform whose length sets the simulation time: from the strategy, hammer or drive."""
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

    With `stop`, the long patterns are simulated only up to the first case that fails. The result holds for
    each case its one or two trials, with the index of the case in the trial.
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


def words_of(patterns: Iterable[Sequence[int]], gap: int) -> list[tuple[int, ...]]:
    """Split patterns into words of dots less than `gap` slots apart; list the distinct words, from slot 0.

    Patterns are split where consecutive dots are `gap` slots or more apart.
    """
    words = set()
    for slots in patterns:
        ends = [k + 1 for k, (a, b) in enumerate(itertools.pairwise(slots)) if b - a >= gap]
        for begin, end in itertools.pairwise([0, *ends, len(slots)]):
            words.add(tuple(slot - slots[begin] for slot in slots[begin:end]))
    return sorted(words)


def attempt_words(
    cases: Sequence[Case],
    patterns: Iterable[Sequence[int]],
    undisturbed: float,
    strategy: Strategy,
    **options: Any,
) -> tuple[Trial, int] | None:
    """Simulate the words (groups of close dots) of patterns in all cases (hammer and rate), by rate.

    Each word is followed by one more dot, which has to equal the first dot of the word, from rest: only then
    is the word separate from what follows. Of a row only the first dots are simulated, and the last of these
    have to be equal: the row has then reached its periodic orbit. It stays there if no error grows from dot
    to dot, so that the multiplier of the row must be at most 1 in absolute value.

    Parameters
    ----------
    cases, patterns, strategy, options
        As for `attempt`.
    undisturbed : float
        Rate up to which each pulse finds the device at rest, Hz.

    Returns
    -------
    tuple or None
        The trial, and the number of leading cases in which every dot of the patterns is within limits.
        None where the patterns are not split, since dots affect each other over too many slots.
    """
    if not undisturbed > 0.0:
        return None
    gap = max(math.ceil(max(case.rate for case in cases) / undisturbed), 1)
    if gap > _MOST_SLOTS:
        return None
    words = sorted({_shortened(word) for word in words_of(patterns, gap)})
    trial = attempt(cases, [(*word, word[-1] + gap) for word in words], strategy, **options)
    passed = trial.passed
    for values in (trial.dots.flight_time, trial.dots.peak_force):
        by_case = values.reshape(len(cases), len(words), -1)
        for k, word in enumerate(words):
            passed = passed & _are_equal(by_case[:, k, [0, len(word)]])
            if len(word) == _ROW:
                passed = passed & _are_equal(by_case[:, k, _ROW - _SAME : _ROW])
    hammers, rates = [case.hammer for case in cases], [case.rate for case in cases]
    for step in {word[1] for word in words if len(word) == _ROW}:
        passed &= np.abs(multipliers(hammers, rates, strategy, options["effort"].quiet, step)) <= 1.0
    return trial, len(cases) if passed.all() else int(np.argmin(passed))


def multipliers(
    hammers: Sequence[Hammer],
    rates: Sequence[float],
    strategy: Strategy,
    effort: Effort,
    step: int = 1,
) -> FloatArray:
    """Compute the multipliers of rows with a dot in every `step`-th slot, shape (hammers,).

    Each row belongs to a hammer and a rate, Hz; see `printhammer.derivatives.rows.row_multipliers`. The
    multipliers are NaN for a closed loop, which corrects errors itself.
    """
    if hasattr(strategy, "along"):
        return np.full(len(hammers), np.nan)
    slots = tuple(range(0, step * DOTS, step))
    drives = [strategy(hammer, [slots], rate)[0] for hammer, rate in zip(hammers, rates, strict=True)]
    return row_multipliers(hammers, drives, effort)


def _shortened(word: tuple[int, ...]) -> tuple[int, ...]:
    """Return the first `_ROW` dots of a longer row of equally spaced dots; other words are unchanged."""
    return word[:_ROW] if len(word) > _ROW and len(set(np.diff(word).tolist())) == 1 else word


def _are_equal(values: FloatArray) -> BoolArray:
    """Whether all values of a row equal its first value within `_EQUAL`; False for a row with NaN."""
    return np.asarray(np.isclose(values, values[:, :1], rtol=_EQUAL, atol=0.0).all(axis=1))
