"""Pool of workers, lent to the pages for one job at a time, and terminated if they do not return."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, Final

from printhammer.studio.workers.worker import Worker, hire

if TYPE_CHECKING:
    from collections.abc import Callable

MOST: Final = 3
"""Largest number of workers per role, so that compilation in one does not block others."""


class Crew:
    """Pool of workers, free and busy, by role.

    Parameters
    ----------
    new : callable, optional
        Creates a worker; by default `printhammer.studio.workers.worker.hire`.
    """

    def __init__(self, new: Callable[[], Worker] = hire) -> None:
        self._hire = new
        self._change = threading.Condition()
        self._idle: dict[str, list[Worker]] = {}
        self._busy: dict[str, list[Worker]] = {}
        self._closed = False

    def warm(self, *roles: str) -> None:
        """Start a worker for each role in advance."""
        for role in roles:
            with self._change:
                if self._idle.get(role) or self._busy.get(role):
                    continue
                self._idle.setdefault(role, []).append(self._hire())

    def lend(self, role: str, key: Any, wanted: Callable[[], bool]) -> Worker | None:
        """Return a free worker, waiting for one if necessary; None if the job is no longer wanted.

        Parameters
        ----------
        role : str
            Role of the worker.
        key
            Key of the machine code; while another worker compiles it, wait.
        wanted : callable
            Whether the job still needs a worker.
        """
        with self._change:
            while wanted() and not self._closed:
                idle, busy = self._idle.setdefault(role, []), self._busy.setdefault(role, [])
                if not any(worker.key == key and worker.compiling for worker in busy):
                    if not idle and len(busy) < MOST:
                        idle.append(self._hire())
                    if idle:
                        # The most recently used worker has loaded the necessary code.
                        worker = next((one for one in reversed(idle) if one.key == key), idle[-1])
                        idle.remove(worker)
                        worker.key = key
                        busy.append(worker)
                        return worker
                self._change.wait(0.05)
        return None

    def give_back(self, role: str, worker: Worker) -> None:
        """Return a worker that has finished its job to the pool."""
        with self._change:
            if worker in self._busy[role]:
                self._busy[role].remove(worker)
                self._idle[role].append(worker)
            self._change.notify_all()

    def dismiss(self, role: str, worker: Worker) -> None:
        """Terminate a busy worker, and start a replacement."""
        worker.end()
        with self._change:
            if worker in self._busy[role]:
                self._busy[role].remove(worker)
            if not self._closed and not self._idle[role]:
                self._idle[role].append(self._hire())
            self._change.notify_all()

    def leave(self, role: str, worker: Worker) -> None:
        """Let a worker finish its compilation, whose code will be needed, then return it to the pool."""

        def wait() -> None:
            worker.supersede()
            while (message := worker.next(0.2)) is None or message[0] not in ("done", "ended"):
                if self._closed or worker.silent > PATIENT:
                    self.dismiss(role, worker)
                    return
            if message[0] == "ended":
                self.dismiss(role, worker)
            else:
                self.give_back(role, worker)

        threading.Thread(target=wait, name="studio-leave", daemon=True).start()

    def close(self) -> None:
        """Terminate all workers."""
        with self._change:
            self._closed = True
            workers = [worker for each in (*self._idle.values(), *self._busy.values()) for worker in each]
            self._change.notify_all()
        for worker in workers:
            worker.end()


PATIENT: Final = 1.5
"""Time after which a worker is terminated if it was asked to stop and is not compiling, s."""
