"""Pool of worker processes of a verb, which are terminated if the verb is interrupted."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor


@contextmanager
def worker_pool(workers: int) -> Iterator[Executor | None]:
    """Yield a pool of `workers` processes; None for a single worker, whose work this process does."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import active_children, get_context

    if workers == 1:
        yield None
        return
    others = set(active_children())
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_leave_interrupts)
    try:
        yield pool
    except BaseException:
        # Their current task may take a minute, and its result is no longer needed.
        for child in set(active_children()) - others:
            child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _leave_interrupts() -> None:
    """Ignore SIGINT in a worker: only the main process handles Ctrl-C, which the terminal sends to all."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
