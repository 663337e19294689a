"""Sweeps on a dask cluster: each block a task; what kills its worker is found and recorded."""

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
"""Seconds in which a scheduler must answer."""

NO_WORKERS: Final = 60.0
"""Seconds without any worker after which a sweep gives up."""

_INTERVAL: Final = 0.5
_COUNT_EVERY: Final = 2.0
_ALIVE: Final = ("running", "connecting")
_TASKS_A_THREAD: Final = 3
_PARTS: Final = 8


class _GoneError(Exception):
    """The scheduler does not know a task any more."""


def run_dask(
    plan: Plan,
    todo: Sequence[Index],
    write: Callable[[Index, Results], None],
    tell: Callable[[float], None],
    client: Any,
) -> None:
    """Do blocks of work on a cluster, and write each, here, when it is done.

    A task whose worker is killed is done again elsewhere by the scheduler. A task that the scheduler gives up
    because it has cost several workers is put aside until all others are done, then done alone on the
    cluster, in ever smaller parts; a member that still kills its worker is recorded as lost. The arguments
    are those of `run_local`, and a `distributed.Client` of the scheduler.

    Raises
    ------
    InputError
        The scheduler or the last worker is gone, a worker has other versions or cannot do the work, or from
        `write`.
    """
    tasks = _Tasks(client, plan)
    try:
        for index in tasks.side_by_side(todo, write, tell):
            write(index, tasks.alone(plan.rows(plan.blocks.members(index))))
            tell(0.0)
    except _GoneError:
        raise InputError("the dask scheduler is gone, what is done is kept", key="scheduler") from None
    finally:
        tasks.cancel()


class _Tasks:
    """The tasks of one sweep on a cluster."""

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
        """Do blocks side by side; return those that cost several workers."""
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
        """Do some members with nothing beside them, in smaller parts where that kills the worker."""
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
        """Give up all tasks that are still under way."""
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
        """Wait a while for a task; return its block and its results, None for these if it cost workers."""
        try:
            future = self._done.get(timeout=_INTERVAL)
        except Empty:
            self._watch()
            return None
        self._idle = 0.0
        index = self._futures.pop(future)
        if future.status == "lost":
            # Its worker was killed before it handed the results over: the scheduler has it done again.
            self._await(future, index)
            return None
        return index, self._result(future)

    def _result(self, future: Any) -> Results | None:
        """Return the results of a task that is done; None if it cost several workers."""
        if future.status == "error":
            error = future.exception()
        else:
            try:
                answer: Results | str = future.result()
            except (FutureCancelled, TaskCancelled, OSError):
                # What goes wrong in the work itself comes as text.
                raise _GoneError from None
            except Exception as late:  # noqa: BLE001 - told as a sentence
                # The worker was killed before it handed its results over, and what came after it as well.
                error = late
            else:
                if isinstance(answer, str):
                    raise InputError(answer)
                return answer
        if isinstance(error, import_module("distributed").KilledWorker):
            return None
        raise InputError(_unable(error)) from error

    def _threads(self) -> int:
        """Count the threads of the workers; asked for every few seconds only."""
        now = time.monotonic()
        if now - self._counted >= _COUNT_EVERY:
            self._counted = now
            try:
                self._count = sum(self._client.nthreads().values())
            except OSError:
                # The scheduler is going; what that means for the tasks comes with their futures.
                self._count = 0
        return self._count

    def _watch(self) -> None:
        """Give up where the scheduler is gone, or no worker has come for a while."""
        if self._client.status not in _ALIVE:
            raise _GoneError
        self._idle = 0.0 if self._threads() else self._idle + _INTERVAL
        if self._idle >= NO_WORKERS:
            raise InputError(
                f"the cluster has had no worker for {NO_WORKERS:g} s, what is done is kept", key="worker"
            )


def _task(base: Base, outputs: Outputs, rows: FloatArray, wanted: dict[str, str]) -> Results | str:
    """Do the work of a block on a worker of the same versions; return what is wrong as a sentence."""
    for name, version in versions().items():
        if version != wanted[name]:
            return f"a worker of the cluster has {name} {version}, expected {wanted[name]}"
    try:
        return run_chunk(base, outputs, rows)
    except PrinthammerError as error:
        return f"a worker of the cluster cannot do the work: {error}"
    except Exception as error:  # noqa: BLE001 - a client may wait for ever for an error it cannot unpickle
        return _unable(error)


def _unable(error: BaseException) -> str:
    return (
        f"a worker of the cluster cannot do the work ({type(error).__name__}: {error}), what is done is kept"
    )


@contextmanager
def client_of(dask: Any) -> Iterator[Any]:
    """Give a client of a cluster, by the address of its scheduler; one made here is closed, and logs nothing.

    A `distributed.Client` is given back as it is.
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
    """Keep the loggers of dask still: what is wrong is told in one sentence of our own."""
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
    """Fail early where nobody answers; a client that does not get through is slow to give up."""
    comm = await distributed.comm.connect(address, timeout=ANSWER)
    await comm.close()
