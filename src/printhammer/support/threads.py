"""Thread pools over index ranges, and coroutines whose queries are answered in common batches.

`in_threads` splits ranges of indices into chunks, which threads fetch one at a time.

A `Work` is a generator that delegates expensive evaluations: it yields a list of queries, receives the
answers in the same order, and returns its result. `together` merges the queries of several works, so that one
vectorised call answers them all.
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

PIECES_A_THREAD: Final = 32  # Number of chunks per thread, to balance chunks of unequal cost; arbitrary
_INTERVAL: Final = 0.1  # Interval between progress reports, s; arbitrary


def thread_count(threads: int | None) -> int:
    """Return the number of threads; None stands for the number of CPU cores available to this process."""
    if threads is None:
        if hasattr(os, "sched_getaffinity"):
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    if threads < 1:
        raise InputError.of("threads", threads, "at least 1", written=str(threads))
    return int(threads)


def shifted(progress: Progress | None, begun: int, total: int) -> Progress | None:
    """Return a progress callback for a later stage, which starts when `begun` of `total` steps are done."""
    return None if progress is None else lambda done, _all: progress(begun + done, total)


def mapped(
    function: Callable[[A], B],
    items: Sequence[A],
    threads: int | None = None,
    progress: Progress | None = None,
    *,
    length: int | None = None,
) -> list[B]:
    """Map a function over items in threads; return the values in input order.

    `threads` is the number of threads, by default the number of cores; `progress` is as for `in_threads`, and
    `length` is the number of items that a thread fetches at a time.
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
    """Run several functions in threads, each over the indices of its own range, in chunks.

    Parameters
    ----------
    works : sequence of callable
        Functions, called with the first index of a chunk and the index after its last.
    sizes : sequence of int
        Length of the range of each function.
    threads : int
        Number of threads; with 1, the calling thread computes everything.
    progress : callable, optional
        Called periodically, in the calling thread, with the number of indices done and the total number.
    lengths : sequence of int, optional
        Length of the chunks of each function; by default a thread gets a few dozen chunks.

    Raises
    ------
    KeyboardInterrupt
        On Ctrl-C, after the chunks in progress are finished.
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
    """Run several `Work` coroutines in step, with one batch of queries per step; return their results."""
    ends: dict[int, T] = {}
    answers: dict[int, list[B] | None] = dict.fromkeys(range(len(works)))
    while answers:
        asked = {}
        for k, own in answers.items():
            try:
                # The first value sent to a generator has to be None.
                asked[k] = works[k].send(own)  # type: ignore[arg-type]
            except StopIteration as end:
                ends[k] = end.value
        shown = iter((yield [each for own in asked.values() for each in own])) if asked else iter(())
        answers = {k: [next(shown) for _ in own] for k, own in asked.items()}
    return [ends[k] for k in range(len(works))]


def translated(work: Work[A, B, T], answer: Callable[[list[A]], Work[C, D, list[B]]]) -> Work[C, D, T]:
    """Adapt a `Work` coroutine: the coroutine `answer` answers its queries by queries of another kind."""
    answers: list[B] | None = None
    while True:
        try:
            # The first value sent to a generator has to be None.
            asked = work.send(answers)  # type: ignore[arg-type]
        except StopIteration as end:
            result: T = end.value
            return result
        answers = yield from answer(asked)


def answered(work: Work[A, B, T], answer: Callable[[list[A]], list[B]]) -> T:
    """Run a `Work` coroutine to its end; the function `answer` evaluates the queries."""
    answers: list[B] | None = None
    while True:
        try:
            asked = work.send(answers)  # type: ignore[arg-type]
        except StopIteration as end:
            result: T = end.value
            return result
        answers = answer(asked)
