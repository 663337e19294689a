"""The workers of a studio: lent to the pages one order at a time, ended where they do not come back."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, Final

from printhammer.studio.workers.worker import Worker, hire

if TYPE_CHECKING:
    from collections.abc import Callable

MOST: Final = 3
"""Workers of a role, at most: one that compiles is no reason for others to wait."""


class Crew:
    """Workers by the roles that they play.

    Parameters
    ----------
    new : callable, optional
        Makes a worker; by default `printhammer.studio.workers.worker.hire`.
    """

    def __init__(self, new: Callable[[], Worker] = hire) -> None:
        self._hire = new
        self._change = threading.Condition()
        self._idle: dict[str, list[Worker]] = {}
        self._busy: dict[str, list[Worker]] = {}
        self._closed = False

    def warm(self, *roles: str) -> None:
        """Have a worker ready for each of some roles, before it is needed."""
        for role in roles:
            with self._change:
                if self._idle.get(role) or self._busy.get(role):
                    continue
                self._idle.setdefault(role, []).append(self._hire())

    def lend(self, role: str, key: Any, wanted: Callable[[], bool]) -> Worker | None:
        """Return a worker that is free, if need be after a while; None once it is no longer wanted.

        Parameters
        ----------
        role : str
            What it is to do.
        key
            What decides which machine code it needs: while another compiles that, it is waited for.
        wanted : callable
            Whether there is still use for it.
        """
        with self._change:
            while wanted() and not self._closed:
                idle, busy = self._idle.setdefault(role, []), self._busy.setdefault(role, [])
                if not any(worker.key == key and worker.compiling for worker in busy):
                    if not idle and len(busy) < MOST:
                        idle.append(self._hire())
                    if idle:
                        # The one that was busy last has loaded what it needs.
                        worker = next((one for one in reversed(idle) if one.key == key), idle[-1])
                        idle.remove(worker)
                        worker.key = key
                        busy.append(worker)
                        return worker
                self._change.wait(0.05)
        return None

    def give_back(self, role: str, worker: Worker) -> None:
        """Take a worker back that has done its order."""
        with self._change:
            if worker in self._busy[role]:
                self._busy[role].remove(worker)
                self._idle[role].append(worker)
            self._change.notify_all()

    def dismiss(self, role: str, worker: Worker) -> None:
        """End a worker that is busy, and have another one in its place."""
        worker.end()
        with self._change:
            if worker in self._busy[role]:
                self._busy[role].remove(worker)
            if not self._closed and not self._idle[role]:
                self._idle[role].append(self._hire())
            self._change.notify_all()

    def leave(self, role: str, worker: Worker) -> None:
        """Let a worker finish what it compiles, which will be needed; nobody waits for the rest."""

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
        """End all."""
        with self._change:
            self._closed = True
            workers = [worker for each in (*self._idle.values(), *self._busy.values()) for worker in each]
            self._change.notify_all()
        for worker in workers:
            worker.end()


PATIENT: Final = 1.5
"""Seconds after which a worker that was told to stop, and does not compile, is ended."""
