"""The history of a dot: how many slots ago the dots before it were printed.

A history of length n holds the gaps, in slots, from the dot to the one before it, from that one to the one
before, and so on, n of them. A gap longer than the reach G tells nothing any more: the hammer is at rest by
then, whatever was printed before. It is written as 0, "rest", and so is everything that lies before it.

Histories are numbered with the latest gap as the most significant of n digits to the base G + 1, which is the
index that the firmware computes. Numbers of which a digit follows a rest stand for the same dot as the number
that is all rest from there on.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from printhammer.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.support.arrays import IntArray

REST: Final = 0  # Gap of a dot that is printed from rest
MOST_GAPS: Final = 4  # Largest number of gaps in a history
MOST_REACH: Final = 8  # Largest reach, slots
History = tuple[int, ...]


def checked_size(gaps: int, reach: int) -> tuple[int, int]:
    """Return number of gaps and reach.

    Raises
    ------
    InputError
        They are not whole numbers within bounds.
    """
    for name, value, most in (("history", gaps, MOST_GAPS), ("reach", reach, MOST_REACH)):
        if isinstance(value, bool) or not 1 <= value <= most:
            raise InputError(f"{name} = {value!r}, expected a whole number from 1 to {most}")
    return int(gaps), int(reach)


def entries_of(gaps: int, reach: int) -> int:
    """Return the number of numbers of histories."""
    return int((reach + 1) ** gaps)


def plain(history: Sequence[int]) -> History:
    """Return a history in which everything before a rest is rest."""
    known = list(itertools.takewhile(lambda gap: gap != REST, history))
    return (*known, *[REST] * (len(history) - len(known)))


def number_of(history: Sequence[int], reach: int) -> int:
    """Return the number of a history."""
    number = 0
    for gap in plain(history):
        number = number * (reach + 1) + gap
    return number


def histories(gaps: int, reach: int) -> list[History]:
    """List all histories that differ, those with more rest first, so that what comes before is known."""
    every = itertools.product(range(reach + 1), repeat=gaps)
    return sorted((row for row in every if row == plain(row)), key=lambda row: (gaps - row.count(REST), row))


def shared_numbers(gaps: int, reach: int) -> IntArray:
    """Return for every number that of the history it stands for, shape (entries,)."""
    every = itertools.product(range(reach + 1), repeat=gaps)
    return np.array([number_of(row, reach) for row in every], np.int64)


def histories_of(slots: Sequence[int], gaps: int, reach: int) -> IntArray:
    """Return the number of the history of each dot of a pattern that begins at rest.

    The last one, of dots + 1, is that of a dot long after, which is printed from rest: all rest. `slots` are
    those at which dots are wanted, ascending.

    Raises
    ------
    InputError
        The slots do not ascend.
    """
    steps = np.diff(np.asarray(slots, np.int64))
    if (steps < 1).any():
        raise InputError(f"slots = {tuple(slots)}, expected ascending numbers")
    recent = [REST] * gaps
    numbers = [number_of(recent, reach)]
    for step in steps.tolist():
        recent = [step if step <= reach else REST, *recent[:-1]]
        numbers.append(number_of(recent, reach))
    return np.array([*numbers, number_of([REST] * gaps, reach)], np.int64)


def gap_text(gap: int) -> str:
    """Return a gap in words."""
    return "rest" if gap == REST else str(gap)


def history_text(history: Sequence[int]) -> str:
    """Return a history in words, such as "1-2-rest"."""
    return "-".join(map(gap_text, history))


def pattern_of(history: Sequence[int], before: Sequence[int] = ()) -> tuple[int, ...]:
    """Return the slots of a pattern whose last dot has a history.

    `before` are further gaps, the latest first, of dots still earlier; for a history without rest only.
    """
    gaps = [gap for gap in (*plain(history), *before) if gap != REST]
    return tuple(itertools.accumulate(reversed(gaps), initial=0))
