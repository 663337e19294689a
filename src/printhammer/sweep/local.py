"""Sweeps on this machine: blocks of work in threads."""

from __future__ import annotations

import threading
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Final

from printhammer.support.threads import thread_count
from printhammer.sweep.work import Results, run_chunk

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from printhammer.sweep.plan import Plan

Index = tuple[int, ...]

_INTERVAL: Final = 0.1


class _StopError(Exception):
    """Ends the work of a block that is no longer wanted."""


def run_local(
    plan: Plan,
    todo: Iterable[Index],
    write: Callable[[Index, Results], None],
    tell: Callable[[float], None],
    threads: int | None = None,
) -> None:
    """Do blocks of work in threads, by default as many as there are cores, and write each when it is done.

    `write` takes the place of a block in the chunk grid and its results, in this thread; `tell` is called now
    and then with the number of members of blocks under way that are done, possibly not whole.

    Raises
    ------
    InputError
        As `run_chunk`, or from `write`.
    KeyboardInterrupt
        Where it is interrupted; blocks under way are dropped.
    """
    blocks = list(todo)
    workers = thread_count(threads)
    at_once = max(1, min(workers, len(blocks)))
    stop = threading.Event()
    shares: dict[Index, float] = {}

    def work(index: Index) -> Results:
        members = plan.blocks.members(index)

        def progress(share: float) -> None:
            shares[index] = share * len(members)
            if stop.is_set():
                raise _StopError

        progress(0.0)
        rows = plan.rows(members)
        return run_chunk(
            plan.spec.base, plan.spec.outputs, rows, threads=workers // at_once, progress=progress
        )

    left = iter(blocks)
    under_way: dict[Future[Results], Index] = {}
    with ThreadPoolExecutor(at_once) as pool:
        try:
            while True:
                # One more than can be under way, so that no thread waits for the disk.
                while len(under_way) <= at_once and (index := next(left, None)) is not None:
                    under_way[pool.submit(work, index)] = index
                if not under_way:
                    return
                finished, _ = wait(under_way, timeout=_INTERVAL, return_when=FIRST_COMPLETED)
                for future in finished:
                    index = under_way.pop(future)
                    write(index, future.result())
                    shares.pop(index, None)
                tell(sum(list(shares.values())))
        finally:
            stop.set()
            for future in under_way:
                future.cancel()
