"""Processes that compute for a verb, and end with it at once when it is interrupted."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from concurrent.futures import Executor


@contextmanager
def worker_pool(workers: int) -> Iterator[Executor | None]:
    """Lend so many processes; for one worker None, since this process does it."""
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
        # What they are at may take a minute, and nobody waits for it any more.
        for child in set(active_children()) - others:
            child.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _leave_interrupts() -> None:
    """Leave Ctrl-C, which all processes of a terminal get, to the one that asked for the work."""
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
