"""The inside of a worker: takes orders, does them one by one, and hears meanwhile of newer states.

``python -m printhammer.studio.workers.child`` imports the modules that are named behind it, reads orders from
its input and writes messages to its output, pickled both: it is started by the studio, whose pipes nobody
else holds. It ends where its input does, so that nothing computes on behind a studio that was killed.
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
    """Does orders and hands over what comes of them.

    Parameters
    ----------
    send : callable
        Takes a message: ``("frame", view, whole, data)``, ``("compiling", sentence)``, empty at its end, and
        ``("done",)`` after every order.
    alone : bool, optional
        Whether the process is for it alone.
    """

    def __init__(self, send: Callable[[tuple[Any, ...]], None], *, alone: bool = False) -> None:
        self.tried: State | None = None
        self._alone = alone
        self._send = send
        self._newer = threading.Event()
        self._orders: queue.SimpleQueue[Order | None] = queue.SimpleQueue()

    def take(self, order: Order | None) -> None:
        """Take an order, or None for the end."""
        self._newer.clear()
        self._orders.put(order)

    def supersede(self) -> None:
        """Hear that what is under way is no longer wanted."""
        self._newer.set()

    def run(self) -> None:
        """Do orders until the end."""
        # Heavy modules are loaded before the first order comes.
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
        """Leave the cores to what is looked at first, where this is a process of its own."""
        if self._alone:
            self._alone = False
            with suppress(AttributeError, OSError):
                os.nice(5)

    def tell(self, data: bytes, view: str, *, whole: bool = True) -> None:
        """Hand over a frame."""
        self._send(("frame", view, whole, data))

    def newer(self) -> bool:
        """Whether there is a newer state."""
        return self._newer.is_set()

    def rest(self, seconds: float) -> bool:
        """Wait for a newer state; return whether one has come."""
        return self._newer.wait(seconds)


def main() -> None:
    """Work for the process that holds the other ends of the pipes."""
    with suppress(ValueError, AttributeError):
        # Ctrl-C is for the studio, which ends its workers.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    source, target = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    # What is printed by chance is no message.
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
        # Whatever is under way, nobody is left to see it.
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    workshop.run()


if __name__ == "__main__":
    main()
