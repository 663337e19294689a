"""A worker as the studio sees it: a process, or a thread where a process would not know a hammer's parts."""

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
    """Takes one order at a time; what comes of it lies in `messages`, see `printhammer.studio.workers.child`.

    Where it has ended by itself, a message ``("ended",)`` says so.
    """

    def __init__(self) -> None:
        self.messages: queue.SimpleQueue[tuple[Any, ...]] = queue.SimpleQueue()
        self.key: Any = None
        self.compiling = ""
        self._since = 0.0
        self.heard = time.monotonic()

    def begin(self, order: Order) -> None:
        """Have an order done."""
        raise NotImplementedError

    def supersede(self) -> None:
        """Tell it that what it does is no longer wanted."""
        raise NotImplementedError

    def end(self) -> None:
        """End it, whatever it does."""
        raise NotImplementedError

    def next(self, seconds: float) -> tuple[Any, ...] | None:
        """Return the next message, or None where none comes in some time."""
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
        """For how long it has been compiling, s."""
        return time.monotonic() - self._since if self.compiling else 0.0

    @property
    def silent(self) -> float:
        """Time since it was heard of, s; none while it compiles."""
        return 0.0 if self.compiling else time.monotonic() - self.heard


class ProcessWorker(Worker):
    """A process of its own.

    Parameters
    ----------
    modules : sequence of str, optional
        What it imports first: modules with parts that do not come with the program.
    command : tuple of str, optional
        What the interpreter is started with; it has to end in `printhammer.studio.workers.child.main`.
    """

    def __init__(
        self,
        modules: Sequence[str] = (),
        command: tuple[str, ...] = ("-m", "printhammer.studio.workers.child"),
    ) -> None:
        super().__init__()
        # Found where this process has found it, also where a notebook has changed the path.
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
        """Have an order done."""
        self.heard = time.monotonic()
        self._write(order)

    def supersede(self) -> None:
        """Tell it that what it does is no longer wanted."""
        self._write(None)

    def end(self) -> None:
        """End it, whatever it does."""
        self.process.kill()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(5)
        with suppress(OSError):
            self.process.stdin.close()  # type: ignore[union-attr]

    def _write(self, content: Order | None) -> None:
        source = self.process.stdin
        # One that is gone says so by its last message.
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
    """A thread of this process, which ends where its work asks whether to go on."""

    def __init__(self) -> None:
        from printhammer.studio.workers.child import Workshop

        super().__init__()
        self._workshop = Workshop(self.messages.put)
        threading.Thread(target=self._workshop.run, name="studio-worker", daemon=True).start()

    def begin(self, order: Order) -> None:
        """Have an order done."""
        self.heard = time.monotonic()
        self._workshop.take(order)

    def supersede(self) -> None:
        """Tell it that what it does is no longer wanted."""
        self._workshop.supersede()

    def end(self) -> None:
        """Have it end when it can."""
        self._workshop.take(None)
        self._workshop.supersede()


def hire() -> Worker:
    """Return a new worker: a process, or a thread where parts were registered in the program that runs."""
    from printhammer.parts import PARTS

    modules = {part.__module__ for part in PARTS.values()}
    outside = sorted(name for name in modules if not name.startswith("printhammer."))
    return ThreadWorker() if "__main__" in outside else ProcessWorker(outside)
