"""Words of dots: patterns are split where a device comes to rest, and each word is simulated once.

A slow device with a rigid backstop is exactly at rest some slots after a dot. A pattern is then a sequence of
*words*, the dots between such gaps, that do not affect each other. The test patterns contain few distinct
words: if a dot affects only the next slot, the words are rows of one to eight dots, and a row of 200.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from printhammer.derivatives.rows import DOTS, row_multipliers
from printhammer.hammer.hammer import Hammer
from printhammer.printing.dots.strategy import Strategy
from printhammer.printing.dots.trial import Case, Trial, attempt
from printhammer.run.effort import Effort
from printhammer.support.arrays import BoolArray, FloatArray

_MOST_SLOTS: Final = 3  # Largest number of slots to rest for which patterns are split; arbitrary

_ROW: Final = 24  # Number of dots to which rows are shortened if their last dots are equal; arbitrary
_SAME: Final = 4  # Number of dots at the end of a shortened row that have to be equal; arbitrary

# Relative difference below which two dots are equal; arbitrary, above the errors of integration
_EQUAL: Final = 1e-6


def words_of(patterns: Iterable[Sequence[int]], gap: int) -> list[tuple[int, ...]]:
    """Split patterns at gaps of `gap` slots or more; return distinct words, shifted to begin at slot 0."""
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
    """Simulate the words (groups of close dots) of patterns for all cases (hammer and rate).

    Each word is followed by one more dot, which must equal the first dot of the word, from rest: only then is
    the word independent of the dots that follow. Of a row only the first dots are simulated, and the last few
    of these dots must equal each other: the row has then reached its periodic orbit. The row remains on the
    orbit if errors do not grow, so the multiplier of the row must be at most 1 in absolute value.

    Parameters
    ----------
    cases, patterns, strategy, options
        As for `attempt`.
    undisturbed : float
        Rate up to which the device is at rest at each pulse, Hz.

    Returns
    -------
    tuple or None
        The trial, and the number of leading cases for which the words show that every dot of the patterns is
        within limits. None if the patterns are not split, since dots affect each other over too many slots.
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

    A multiplier is the factor by which a small deviation changes from dot to dot. Each row belongs to a
    hammer and a rate [Hz]; see `printhammer.derivatives.rows.row_multipliers`. The multipliers are NaN for a
    closed loop, which corrects errors itself.
    """
    if hasattr(strategy, "along"):
        return np.full(len(hammers), np.nan)
    slots = tuple(range(0, step * DOTS, step))
    drives = [strategy(hammer, [slots], rate)[0] for hammer, rate in zip(hammers, rates, strict=True)]
    return row_multipliers(hammers, drives, effort)


def _shortened(word: tuple[int, ...]) -> tuple[int, ...]:
    """Shorten a word that is a row of equally spaced dots to its first `_ROW` dots; return the word."""
    return word[:_ROW] if len(word) > _ROW and len(set(np.diff(word).tolist())) == 1 else word


def _are_equal(values: FloatArray) -> BoolArray:
    """Whether all values of a row equal the first value of the row, for each row of an array.

    The relative tolerance is `_EQUAL`; a row with NaN gives False.
    """
    return np.asarray(np.isclose(values, values[:, :1], rtol=_EQUAL, atol=0.0).all(axis=1))
