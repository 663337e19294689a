"""Works that ask: computations that leave what costs time to others, so that many share it.

A work is a generator. It yields a list of what it asks for, is sent the answers in the same order, and
returns its result. Works side by side ask together, and what they ask for is computed at once.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import TypeAlias, TypeVar

A = TypeVar("A")
B = TypeVar("B")
C = TypeVar("C")
D = TypeVar("D")
T = TypeVar("T")
Work: TypeAlias = Generator[list[A], list[B], T]


def together(works: Sequence[Work[A, B, T]]) -> Work[A, B, list[T]]:
    """Do works side by side: those that are not over ask together. Returns their results in order."""
    ends: dict[int, T] = {}
    answers: dict[int, list[B] | None] = dict.fromkeys(range(len(works)))
    while answers:
        asked = {}
        for k, own in answers.items():
            try:
                # A generator begins with None.
                asked[k] = works[k].send(own)  # type: ignore[arg-type]
            except StopIteration as end:
                ends[k] = end.value
        shown = iter((yield [each for own in asked.values() for each in own])) if asked else iter(())
        answers = {k: [next(shown) for _ in own] for k, own in asked.items()}
    return [ends[k] for k in range(len(works))]


def translated(work: Work[A, B, T], answer: Callable[[list[A]], Work[C, D, list[B]]]) -> Work[C, D, T]:
    """Do a work whose questions are answered by works that ask for something else."""
    answers: list[B] | None = None
    while True:
        try:
            # A generator begins with None.
            asked = work.send(answers)  # type: ignore[arg-type]
        except StopIteration as end:
            result: T = end.value
            return result
        answers = yield from answer(asked)


def answered(work: Work[A, B, T], answer: Callable[[list[A]], list[B]]) -> T:
    """Do a work to its end, its questions answered by a function."""
    answers: list[B] | None = None
    while True:
        try:
            asked = work.send(answers)  # type: ignore[arg-type]
        except StopIteration as end:
            result: T = end.value
            return result
        answers = answer(asked)
