"""Sweeps on a dask cluster: one task per block; a member that kills its worker is isolated and recorded."""

from __future__ import annotations

import asyncio
import logging
import math
import time
from asyncio import CancelledError as TaskCancelled
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError as FutureCancelled
from contextlib import contextmanager
from importlib import import_module
from queue import Empty, SimpleQueue
from typing import Any, Final

from printhammer.errors import InputError, PrinthammerError, missing_extra
from printhammer.results.provenance import versions
from printhammer.support.arrays import FloatArray
from printhammer.sweep.members import Base
from printhammer.sweep.outputs import WORKER_LOST, Outputs
from printhammer.sweep.plan import Plan
from printhammer.sweep.work import Index, Results, run_chunk

ANSWER: Final = 5.0
"""Time limit for the answer of a scheduler, s; arbitrary."""

NO_WORKERS: Final = 60.0
"""Time without any worker after which a sweep stops, s; arbitrary."""

_INTERVAL: Final = 0.5  # Interval between checks of the cluster, s; arbitrary
_COUNT_EVERY: Final = 2.0  # Interval between counts of the workers' threads, s; arbitrary
_ALIVE: Final = ("running", "connecting")
_TASKS_A_THREAD: Final = 3  # Number of tasks submitted per thread, so that no worker idles; arbitrary
_PARTS: Final = 8  # Number of pieces into which a block that kills its worker is split; arbitrary


class _GoneError(Exception):
    """Raised when the scheduler no longer knows a task."""


def run_dask(
    plan: Plan,
    todo: Sequence[Index],
    write: Callable[[Index, Results], None],
    tell: Callable[[float], None],
    client: Any,
) -> None:
    """Compute blocks on a cluster, and write each finished block in this process.

    The scheduler repeats a task whose worker is killed. A task that has killed several workers is abandoned
    by the scheduler; it is postponed until all other tasks are done, then computed alone on the cluster, in
    ever smaller pieces; a member that still kills its worker is recorded as lost. `client` is a
    `distributed.Client` of the scheduler; the other arguments are as for `run_local`.

    Raises
    ------
    InputError
        The scheduler is unreachable, no worker is left, a worker has other software versions or cannot do the
        work, or `write` raises the error.
    """
    tasks = _Tasks(client, plan)
    try:
        for index in tasks.side_by_side(todo, write, tell):
            write(index, tasks.alone(plan.rows(plan.blocks.members(index))))
            tell(0.0)
    except _GoneError:
        raise InputError("the scheduler has stopped; completed blocks are kept", key="scheduler") from None
    finally:
        tasks.cancel()


class _Tasks:
    """Tasks of one sweep on a cluster."""

    def __init__(self, client: Any, plan: Plan) -> None:
        self._client = client
        self._plan = plan
        self._futures: dict[Any, Index] = {}
        self._done: SimpleQueue[Any] = SimpleQueue()
        self._idle = 0.0
        self._counted, self._count = -math.inf, 0

    def side_by_side(
        self, todo: Sequence[Index], write: Callable[[Index, Results], None], tell: Callable[[float], None]
    ) -> list[Index]:
        """Compute blocks concurrently; return the indices of the blocks that killed several workers.

        The arguments are as for `run_local`.
        """
        left = deque(todo)
        suspects: list[Index] = []
        while left or self._futures:
            while left and len(self._futures) < max(2, _TASKS_A_THREAD * self._threads()):
                index = left.popleft()
                self._submit(self._plan.rows(self._plan.blocks.members(index)), index)
            if (finished := self._next()) is not None:
                index, results = finished
                if results is None:
                    suspects.append(index)
                else:
                    write(index, results)
            tell(0.0)
        return suspects

    def alone(self, rows: FloatArray) -> Results:
        """Compute the members with the axis values `rows` in one task, and return their results.

        If the task kills its worker, it is split recursively; the pieces are computed one at a time.
        """
        import numpy as np

        self._submit(rows, ())
        while (finished := self._next()) is None:
            pass
        if finished[1] is not None:
            return finished[1]
        if len(rows) == 1:
            lost = self._plan.spec.outputs.empty(1)
            lost["status"][:] = WORKER_LOST
            return lost
        parts = [self.alone(part) for part in np.array_split(rows, min(_PARTS, len(rows)))]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    def cancel(self) -> None:
        """Cancel all unfinished tasks."""
        if self._futures and self._client.status == "running":
            self._client.cancel(list(self._futures), force=True)

    def _submit(self, rows: FloatArray, index: Index) -> None:
        if self._client.status not in _ALIVE:
            raise _GoneError
        spec = self._plan.spec
        future = self._client.submit(_task, spec.base, spec.outputs, rows, versions(), pure=False)
        self._await(future, index)

    def _await(self, future: Any, index: Index) -> None:
        self._futures[future] = index
        future.add_done_callback(self._done.put)

    def _next(self) -> tuple[Index, Results | None] | None:
        """Wait for a task to end; return the index of its block and its results.

        The results are None if the task killed several workers. Return None if no task ends for `_INTERVAL`
        seconds, or if the scheduler repeats the task that ended.
        """
        try:
            future = self._done.get(timeout=_INTERVAL)
        except Empty:
            self._check_workers()
            return None
        self._idle = 0.0
        index = self._futures.pop(future)
        if future.status == "lost":
            # The worker was killed before it returned the results; the scheduler repeats the task.
            self._await(future, index)
            return None
        return index, self._result(future)

    def _result(self, future: Any) -> Results | None:
        """Return the results of a finished task; None if the task killed several workers."""
        if future.status == "error":
            error = future.exception()
        else:
            try:
                answer: Results | str = future.result()
            except (FutureCancelled, TaskCancelled, OSError):
                # The task returns its own errors as text.
                raise _GoneError from None
            except Exception as late:  # noqa: BLE001 - reported in a sentence
                # Several workers were killed before they returned the results.
                error = late
            else:
                if isinstance(answer, str):
                    raise InputError(answer)
                return answer
        if isinstance(error, import_module("distributed").KilledWorker):
            return None
        raise InputError(_unable(error)) from error

    def _threads(self) -> int:
        """Return the number of threads of the workers, refreshed every few seconds."""
        now = time.monotonic()
        if now - self._counted >= _COUNT_EVERY:
            self._counted = now
            try:
                self._count = sum(self._client.nthreads().values())
            except OSError:
                # The scheduler is closing; the futures report the loss of their tasks.
                self._count = 0
        return self._count

    def _check_workers(self) -> None:
        """Raise an error if the scheduler is unreachable, or has had no worker for `NO_WORKERS` seconds."""
        if self._client.status not in _ALIVE:
            raise _GoneError
        self._idle = 0.0 if self._threads() else self._idle + _INTERVAL
        if self._idle >= NO_WORKERS:
            raise InputError(
                f"the cluster has had no worker for {NO_WORKERS:g} s; completed blocks are kept", key="worker"
            )


def _task(base: Base, outputs: Outputs, rows: FloatArray, wanted: dict[str, str]) -> Results | str:
    """Compute a block on a worker; return the results, or an error message if the computation fails.

    `rows` are the axis values of the members, and `wanted` the software versions that the worker must have.
    """
    for name, version in versions().items():
        if version != wanted[name]:
            return f"a worker of the cluster has {name} {version}: expected {wanted[name]}"
    try:
        return run_chunk(base, outputs, rows)
    except PrinthammerError as error:
        return f"a worker of the cluster cannot do the work: {error}"
    except Exception as error:  # noqa: BLE001 - a client may hang on an error that it cannot unpickle
        return _unable(error)


def _unable(error: BaseException) -> str:
    return f"a worker of the cluster failed ({type(error).__name__}: {error}); completed blocks are kept"


@contextmanager
def client_of(dask: Any) -> Iterator[Any]:
    """Open a client of a cluster for the duration of the context, without log output.

    `dask` is the address of a scheduler, or an existing `distributed.Client`, which is yielded unchanged.
    """
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise missing_extra("a cluster needs dask", "cluster") from None
    if isinstance(dask, distributed.Client):
        yield dask
        return
    with _quiet():
        try:
            asyncio.run(asyncio.wait_for(_knock(distributed, dask), ANSWER))
            client = distributed.Client(dask, timeout=ANSWER, set_as_default=False)
        except (OSError, TimeoutError, ValueError, TypeError, AttributeError) as error:
            reason = str(error).partition("\n")[0] or type(error).__name__
            raise InputError(
                f"{dask}: no dask scheduler answers there ({reason})", key="dask", value=dask
            ) from None
        try:
            yield client
        finally:
            client.close(timeout=ANSWER)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the loggers of dask; errors are reported in one sentence instead."""
    loggers = [
        logging.getLogger(name) for name in logging.root.manager.loggerDict if name.startswith("distributed")
    ]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


async def _knock(distributed: Any, address: str) -> None:
    """Raise an error early if no scheduler answers; a client would wait long before failing."""
    comm = await distributed.comm.connect(address, timeout=ANSWER)
    await comm.close()
