"""Worker process: runs jobs one by one, and listens for newer states meanwhile.

``python -m printhammer.studio.workers.child`` imports the modules listed as arguments, reads jobs from its
input and writes messages to its output, both pickled; only the studio holds the other ends of the pipes. The
process ends with its input, so that no computation outlives a killed studio.
"""

from __future__ import annotations

import logging
import os
import pickle
import queue
import signal
import sys
import threading
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Any

from printhammer.studio import compiling
from printhammer.studio.frames import refusal
from printhammer.studio.work import GivenUp

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.studio.states.state import State
    from printhammer.studio.workers.order import Order

logger = logging.getLogger(__name__)


class Workshop:
    """Runner of queued jobs.

    Parameters
    ----------
    send : callable
        Sends a message: ``("frame", view, whole, data)``, ``("compiling", sentence)``, with an empty sentence
        at the end, and ``("done",)`` after every job.
    alone : bool, optional
        Whether the process runs nothing else.
    """

    def __init__(self, send: Callable[[tuple[Any, ...]], None], *, alone: bool = False) -> None:
        self.tried: State | None = None
        self._alone = alone
        self._send = send
        self._newer = threading.Event()
        self._orders: queue.SimpleQueue[Order | None] = queue.SimpleQueue()

    def take(self, order: Order | None) -> None:
        """Add a job to the queue; None ends the worker."""
        self._newer.clear()
        self._orders.put(order)

    def supersede(self) -> None:
        """Signal to the running job that a newer state has arrived."""
        self._newer.set()

    def run(self) -> None:
        """Run queued jobs in order of arrival, until the queue delivers None."""
        # Load heavy modules before the first job arrives.
        from printhammer.studio.workers.jobs import ROLES

        compiling.listen(lambda sentence: self._send(("compiling", sentence)))
        while (order := self._orders.get()) is not None:
            if order.role == "detail":
                self._step_back()
            try:
                ROLES[order.role](order, self)
            except GivenUp:
                pass
            except OSError:
                return
            except Exception as error:
                logger.exception("%s, message %d", order.role, order.serial)
                reason = f"this could not be computed, {type(error).__name__}: {error}"
                self.tell(refusal(order.serial, reason), "refusal")
            self._send(("done",))

    def _step_back(self) -> None:
        """Lower the priority of this process, so that the curves and the map are computed first."""
        if self._alone:
            self._alone = False
            with suppress(AttributeError, OSError):
                os.nice(5)

    def tell(self, data: bytes, view: str, *, whole: bool = True) -> None:
        """Send a frame of a view; `whole` states that no more accurate frame of the view follows."""
        self._send(("frame", view, whole, data))

    def newer(self) -> bool:
        """Whether a newer state has arrived."""
        return self._newer.is_set()

    def rest(self, seconds: float) -> bool:
        """Wait up to `seconds` for a newer state; return whether one arrived."""
        return self._newer.wait(seconds)


def main() -> None:
    """Run the jobs that arrive on the standard input, and write messages to the standard output."""
    with suppress(ValueError, AttributeError):
        # Ctrl-C is meant for the studio, which ends its workers.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    source, target = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    # Stray prints must not mix with messages.
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    lock = threading.Lock()

    def send(message: tuple[Any, ...]) -> None:
        with lock:
            pickle.dump(message, target, pickle.HIGHEST_PROTOCOL)
            target.flush()

    for module in sys.argv[1:]:
        import_module(module)
    workshop = Workshop(send, alone=True)

    def listen() -> None:
        with suppress(EOFError, OSError, pickle.UnpicklingError):
            while True:
                order = pickle.load(source)
                if order is None:
                    workshop.supersede()
                else:
                    workshop.take(order)
        # Nobody is left to receive the result.
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    workshop.run()


if __name__ == "__main__":
    main()
