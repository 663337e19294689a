"""Work in threads: pieces of a range, handed out one by one.

Works that ask: computations that leave what costs time to others, so that many share it.

A work is a generator. It yields a list of what it asks for, is sent the answers in the same order, and
returns its result. Works side by side ask together, and what they ask for is computed at once.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Final, TypeAlias, TypeVar

from printhammer.errors import InputError

A = TypeVar("A")
B = TypeVar("B")
Progress = Callable[[int, int], None]
Piece = Callable[[int, int], None]

PIECES_A_THREAD: Final = 32
_INTERVAL: Final = 0.1


def thread_count(threads: int | None) -> int:
    """Return a number of threads; by default that of the cores that this process may use."""
    if threads is None:
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    if threads < 1:
        raise InputError.of("threads", threads, "at least 1", written=str(threads))
    return int(threads)


def shifted(progress: Progress | None, begun: int, total: int) -> Progress | None:
    """Return what a part of some work calls as its progress: after `begun` numbers, of `total` in all."""
    return None if progress is None else lambda done, _all: progress(begun + done, total)


def mapped(
    function: Callable[[A], B],
    items: Sequence[A],
    threads: int | None = None,
    progress: Progress | None = None,
    *,
    length: int | None = None,
) -> list[B]:
    """Return the values of a function at some items, in their order, computed in threads.

    Arguments as for `in_threads`, `threads` by default as many as there are cores.
    """
    values: dict[int, B] = {}

    def work(begin: int, end: int) -> None:
        for i in range(begin, end):
            values[i] = function(items[i])

    in_threads([work], [len(items)], thread_count(threads), progress, None if length is None else [length])
    return [values[i] for i in range(len(items))]


def in_threads(
    works: Sequence[Piece],
    sizes: Sequence[int],
    threads: int,
    progress: Progress | None = None,
    lengths: Sequence[int] | None = None,
) -> None:
    """Do all of several works, each on a range of numbers from 0, in threads.

    Parameters
    ----------
    works : sequence of callable
        Each takes the first number of a piece and the one after its last.
    sizes : sequence of int
        Length of the range of each work.
    threads : int
        Number of threads; with one, the calling thread does all.
    progress : callable, optional
        Called now and then, in the calling thread, with how many numbers are done and how many there are.
    lengths : sequence of int, optional
        Length of the pieces of each work; by default such that a thread has a few dozen.

    Raises
    ------
    KeyboardInterrupt
        Where it is interrupted; the pieces under way are done before.
    """
    total = sum(sizes)
    if lengths is None:
        lengths = [max(1, total // (PIECES_A_THREAD * threads))] * len(works)
    pieces = [
        (work, first, min(first + length, size))
        for work, size, length in zip(works, sizes, lengths, strict=True)
        for first in range(0, size, length)
    ]
    if threads == 1 or len(pieces) <= 1:
        done = 0
        for work, first, last in pieces:
            work(first, last)
            done += last - first
            if progress is not None:
                progress(done, total)
        return
    _hand_out(pieces, threads, total, progress)


def _hand_out(
    pieces: Sequence[tuple[Piece, int, int]], threads: int, total: int, progress: Progress | None
) -> None:
    left = iter(pieces)
    lock = threading.Lock()
    stop = threading.Event()
    done = 0

    def worker() -> None:
        nonlocal done
        while not stop.is_set():
            with lock:
                piece = next(left, None)
            if piece is None:
                return
            work, first, last = piece
            work(first, last)
            with lock:
                done += last - first

    with ThreadPoolExecutor(threads) as pool:
        futures = {pool.submit(worker) for _ in range(threads)}
        try:
            while futures:
                finished, futures = wait(
                    futures, timeout=None if progress is None else _INTERVAL, return_when=FIRST_COMPLETED
                )
                for future in finished:
                    future.result()
                if progress is not None:
                    progress(done, total)
        finally:
            stop.set()


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
