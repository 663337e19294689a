"""Worker from the studio's side: a process, or a thread if a process would not know a hammer's parts."""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from printhammer.studio.workers.order import Order


class Worker:
    """Worker that runs one job at a time; its messages are described in `workers.child`.

    A worker that ended by itself sends a message ``("ended",)``.
    """

    def __init__(self) -> None:
        self.messages: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
        self.key: Any = None
        self.compiling = ""
        self._since = 0.0
        self.heard = time.monotonic()

    def begin(self, order: Order) -> None:
        """Send a job to the worker, which starts it at once."""
        raise NotImplementedError

    def supersede(self) -> None:
        """Tell the worker that a newer state has arrived, so that it stops its job."""
        raise NotImplementedError

    def end(self) -> None:
        """Terminate the worker at once."""
        raise NotImplementedError

    def next(self, seconds: float) -> tuple[Any, ...] | None:
        """Return the next message, or None after a timeout."""
        try:
            message = self.messages.get(timeout=seconds)
        except queue.Empty:
            return None
        self.heard = time.monotonic()
        if message[0] == "compiling":
            self.compiling, self._since = message[1], self.heard
        return message

    @property
    def compiled(self) -> float:
        """Duration of the compilation in progress, s; 0 if the worker is not compiling."""
        return time.monotonic() - self._since if self.compiling else 0.0

    @property
    def silent(self) -> float:
        """Time since the last message, s; 0 while the worker compiles."""
        return 0.0 if self.compiling else time.monotonic() - self.heard


class ProcessWorker(Worker):
    """Worker in a separate process.

    Parameters
    ----------
    modules : sequence of str, optional
        Modules to import first: those that register further parts.
    command : tuple of str, optional
        Arguments of the interpreter, which has to run `printhammer.studio.workers.child.main`.
    """

    def __init__(
        self,
        modules: Sequence[str] = (),
        command: tuple[str, ...] = ("-m", "printhammer.studio.workers.child"),
    ) -> None:
        super().__init__()
        # Use the import path of this process, which a notebook may have changed.
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        self.process = subprocess.Popen(
            (sys.executable, *command, *modules),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment,
        )
        self._writing = threading.Lock()
        threading.Thread(target=self._listen, name="studio-worker", daemon=True).start()

    def begin(self, order: Order) -> None:
        """Send a job to the worker, which starts it at once."""
        self.heard = time.monotonic()
        self._write(order)

    def supersede(self) -> None:
        """Tell the worker that a newer state has arrived, so that it stops its job."""
        self._write(None)

    def end(self) -> None:
        """Terminate the process."""
        self.process.kill()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(5)
        with suppress(OSError):
            self.process.stdin.close()  # type: ignore[union-attr]

    def _write(self, content: Order | None) -> None:
        source = self.process.stdin
        # A process that is gone reports that by its last message.
        with self._writing, suppress(OSError, ValueError):
            pickle.dump(content, source, pickle.HIGHEST_PROTOCOL)  # type: ignore[arg-type]
            source.flush()  # type: ignore[union-attr]

    def _listen(self) -> None:
        output = self.process.stdout
        with suppress(EOFError, OSError, ValueError, pickle.UnpicklingError):
            while True:
                self.messages.put(pickle.load(output))  # type: ignore[arg-type]
        self.messages.put(("ended",))
        output.close()  # type: ignore[union-attr]


class ThreadWorker(Worker):
    """Worker in a thread of this process; to stop, its job has to check for newer states."""

    def __init__(self) -> None:
        from printhammer.studio.workers.child import Workshop

        super().__init__()
        self._workshop = Workshop(self.messages.put)
        threading.Thread(target=self._workshop.run, name="studio-worker", daemon=True).start()

    def begin(self, order: Order) -> None:
        """Send a job to the worker, which starts it at once."""
        self.heard = time.monotonic()
        self._workshop.take(order)

    def supersede(self) -> None:
        """Tell the worker that a newer state has arrived, so that it stops its job."""
        self._workshop.supersede()

    def end(self) -> None:
        """Ask the thread to end after its current job."""
        self._workshop.take(None)
        self._workshop.supersede()


def hire() -> Worker:
    """Return a new worker: a process, or a thread if the running program registered parts."""
    from printhammer.parts import PARTS

    modules = {part.__module__ for part in PARTS.values()}
    outside = sorted(name for name in modules if not name.startswith("printhammer."))
    return ThreadWorker() if "__main__" in outside else ProcessWorker(outside)
