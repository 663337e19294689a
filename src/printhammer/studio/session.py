"""Session of one studio page: only the latest state is served, and slow jobs do not delay fast ones.

Requests about hammers and files are answered in this process, by a dedicated thread. Requests about states
that are not displayed, and states themselves, go to worker processes: first the curves and dots of a state,
then, in parallel, the map and the detailed views. A worker that is told that its state is outdated and does
not return is terminated; a worker that compiles is left to finish, since its code will be needed, and another
worker serves the newer state meanwhile.
"""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.studio.bounds import PATIENCE
from printhammer.studio.frames import frame, nothing, refusal
from printhammer.studio.messages import answer, read_message
from printhammer.studio.pictures.ahead import frames_ahead
from printhammer.studio.pictures.keys import KEYS, kernel_key
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import ProtocolError, State
from printhammer.studio.workers.crew import PATIENT, Crew
from printhammer.studio.workers.order import ASKED, Order

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.studio.workers.worker import Worker

logger = logging.getLogger(__name__)

_VIEWS: Final = {"curves": (), "map": ("map",), "detail": ("line", "strobe")}
_FAILING: Final = {"map": "the map", "line": "the printed line", "strobe": "the strobe section"}
_BEFORE: Final = "this still belongs to what was set before"
_NOT_YET: Final = "being computed"
_TICK: Final = 0.02
_TOLD: Final = 1.0
_LATE: Final = 0.25
_SPARE: Final = 5.0
_MOST_QUESTIONS: Final = 16


class Session:
    """Jobs and answers for one page, until the page closes.

    Parameters
    ----------
    send : callable
        Sends a frame to the page and returns when it is sent; raises if the page has been closed.
    shelf : Shelf, optional
        Hammers that the studio offers; by default the shipped hammers.
    crew : Crew, optional
        Workers; by default private workers that end with the session.
    """

    def __init__(
        self, send: Callable[[bytes], None], shelf: Shelf | None = None, crew: Crew | None = None
    ) -> None:
        self._send = send
        self._shelf = shelf or Shelf()
        self._crew = crew or Crew()
        self._owns_crew = crew is None
        self._change = threading.Condition()
        self._latest: tuple[int, State] | None = None
        self._accepted: tuple[int, State] | None = None
        self._questions: list[tuple[str, int, Any]] = []
        self._asked: list[tuple[str, int, Any]] = []
        self._closed = False
        self._served: dict[str, int] = {}
        self._told: dict[str, float] = {}
        # Views displayed by the page, and views complete in their final form.
        self._shown: dict[str, Any] = {}
        self._whole: dict[str, Any] = {}
        works: dict[str, Callable[[], None]] = {"questions": self._answers, "asked": self._answers_of_states}
        works |= {role: lambda role=role: self._serve(role) for role in _VIEWS}  # type: ignore[misc]
        self._threads = [
            threading.Thread(target=self._run, args=(work,), name=f"studio-{name}", daemon=True)
            for name, work in works.items()
        ]
        for thread in self._threads:
            thread.start()

    def receive(self, text: str) -> None:
        """Queue a message from the page: the latest state replaces earlier ones; questions wait in line.

        Raises
        ------
        ProtocolError
            The message is not one that the page can send.
        """
        kind, serial, content = read_message(text, self._shelf)
        with self._change:
            if kind == "state":
                self._latest = (serial, content)
            elif len(questions := self._asked if kind in ASKED else self._questions) < _MOST_QUESTIONS:
                questions.append((kind, serial, content))
            else:
                raise ProtocolError(f"more than {_MOST_QUESTIONS} questions wait for their answer")
            self._change.notify_all()

    def close(self) -> None:
        """Close the session: cancel the running jobs, and send no further frame."""
        with self._change:
            self._closed = True
            self._change.notify_all()
        if self._owns_crew:
            self._crew.close()

    def join(self, timeout: float | None = None) -> None:
        """Wait until all threads of the session have ended, at most `timeout` seconds each."""
        for thread in self._threads:
            thread.join(timeout)

    def _run(self, work: Callable[[], None]) -> None:
        try:
            while not self._closed:
                work()
        except OSError:
            # The browser has closed the page.
            self.close()

    def _tell(self, data: bytes) -> None:
        if not self._closed:
            self._send(data)

    def _answers(self) -> None:
        with self._change:
            self._change.wait_for(lambda: self._closed or self._questions)
            questions, self._questions = self._questions, []
        for kind, serial, content in questions:
            if self._closed:
                return
            try:
                data = answer(kind, serial, content, self._shelf)
            except Exception as error:
                logger.exception("%s, message %d", kind, serial)
                reason = f"this could not be answered, {type(error).__name__}: {error}"
                data = refusal(serial, reason)
            self._tell(data)

    def _answers_of_states(self) -> None:
        with self._change:
            self._change.wait_for(lambda: self._closed or self._asked)
            if self._closed:
                return
            kind, serial, content = self._asked.pop(0)
        if isinstance(content, str):
            self._tell(refusal(serial, content))
        else:
            self._safely(Order("asked", serial, content, (kind,), {}))

    def _serve(self, role: str) -> None:
        """Wait for a state that `role` has not served yet; run a job for the views that changed."""
        with self._change:
            self._change.wait_for(lambda: self._closed or self._waiting(role))
            taken = self._waiting(role)
        if self._closed or taken is None:
            return
        serial, state = taken
        own = [view for view in _VIEWS[role] if view in _computed(state)]
        views = tuple(view for view in own if self._whole.get(view) != KEYS[view](state))
        if views or role == "curves":
            self._safely(Order(role, serial, state, views, self._outdated(state) if role == "curves" else {}))
        with self._change:
            self._served[role] = serial
            self._change.notify_all()

    def _safely(self, order: Order) -> None:
        """Run a job; report an unexpected exception to the page, and keep the session alive."""
        try:
            self._work(order)
        except OSError:
            raise
        except Exception as error:
            logger.exception("%s, message %d", order.role, order.serial)
            self._tell(refusal(order.serial, f"this could not be computed, {type(error).__name__}: {error}"))

    def _waiting(self, role: str) -> tuple[int, State] | None:
        latest = self._latest if role == "curves" else self._accepted
        if latest is None or latest[0] == self._served.get(role):
            return None
        serial, state = latest
        # The map comes first; it compiles machine code that the printed line needs as well.
        behind = role == "detail" and "map" in state.views and self._served.get("map") != serial
        return None if behind else latest

    def _outdated(self, state: State) -> dict[str, str]:
        """Return, for each displayed view that does not show `state`, the reason, by view."""
        return {
            view: _BEFORE if view in self._shown else _NOT_YET
            for view in _computed(state)
            if self._shown.get(view) != KEYS[view](state)
        }

    def _work(self, order: Order) -> None:
        """Run a job on a worker, and forward the messages of the worker to the page."""
        role, serial = order.role, order.serial

        def newer() -> bool:
            # A question is not replaced by a later state.
            later = role != "asked" and (self._latest is None or self._latest[0] != serial)
            return self._closed or later

        try:
            key = kernel_key(order.state)
        except InputError as error:
            # The worker would raise the same error.
            self._tell(refusal(serial, str(error)))
            return

        def wanted() -> bool:
            if role == "asked":
                return not self._closed
            # Deliver a coarse map even while a slider moves and newer states arrive.
            waiting = self._waiting(role)
            return not self._closed and waiting is not None and waiting[0] == serial

        worker = self._crew.lend(role, key, wanted)
        if worker is None:
            return
        try:
            done = self._follow(order, worker, newer)
        except OSError:
            self._crew.leave(role, worker)
            raise
        if done:
            self._crew.give_back(role, worker)
        self._end_progress(order)

    def _follow(self, order: Order, worker: Worker, newer: Callable[[], bool]) -> bool:
        """Forward a worker's messages until its job ends; return False if it was terminated or left."""
        role = order.role
        worker.begin(order)
        superseded, ahead = False, role == "curves"
        begun = time.monotonic()
        while True:
            message = worker.next(_TICK)
            if newer() and not superseded:
                superseded = True
                worker.supersede()
                worker.heard = time.monotonic()
            if message is None:
                if ahead and time.monotonic() > begun + _LATE:
                    ahead = False
                    self._tell_ahead(order)
                if superseded and self._ends(order, worker):
                    return False
                if worker.silent > PATIENCE + _SPARE:
                    self._crew.dismiss(role, worker)
                    self._give_up(order, f"would take more than {PATIENCE:g} s for this hammer")
                    return False
                if worker.compiling and time.monotonic() > self._told.get(role, 0.0) + _TOLD:
                    self._told[role] = time.monotonic()
                    self._progress(order, worker.compiling, worker.compiled)
            elif message[0] == "done":
                return True
            elif message[0] == "ended":
                self._crew.dismiss(role, worker)
                self._give_up(order, "could not be computed: its process has ended")
                return False
            elif message[0] == "frame":
                ahead = False
                _kind, view, whole, data = message
                self._note(order, view, whole)
                self._tell(data)
            elif not message[1]:
                self._end_progress(order)

    def _tell_ahead(self, order: Order) -> None:
        """Send precomputed pictures if the state is the opening state of a shipped hammer."""
        for data in frames_ahead(order.state, order.serial):
            self._tell(data)

    def _progress(self, order: Order, what: str, seconds: float = 0.0) -> None:
        self._tell(frame("progress", order.serial, role=order.role, what=what, seconds=seconds))

    def _end_progress(self, order: Order) -> None:
        if self._told.pop(order.role, None) is not None:
            self._progress(order, "")

    def _note(self, order: Order, view: str, whole: bool) -> None:
        """Record that the page now displays `view` for the state of a job."""
        with self._change:
            if view in KEYS:
                self._shown[view] = KEYS[view](order.state)
                # What was complete before is no longer shown.
                self._whole[view] = self._shown[view] if whole else None
            elif view == "motion":
                self._accepted = (order.serial, order.state)
            self._change.notify_all()

    def _ends(self, order: Order, worker: Worker) -> bool:
        """Terminate a worker that does not stop, or leave it to compile; return whether it was given up."""
        if self._closed and self._owns_crew:
            return True
        if worker.compiling:
            latest = self._latest
            if not self._closed and (latest is None or self._same_kernel(worker, latest[1])):
                return False
            self._crew.leave(order.role, worker)
            return True
        if worker.silent > PATIENT:
            self._crew.dismiss(order.role, worker)
            return True
        return False

    def _same_kernel(self, worker: Worker, state: State) -> bool:
        try:
            return bool(kernel_key(state) == worker.key)
        except InputError:
            return False

    def _give_up(self, order: Order, why: str) -> None:
        if order.role in ("curves", "asked"):
            what = "the curves" if order.role == "curves" else "what was asked"
            self._tell(refusal(order.serial, f"{what} {why}"))
            return
        for view in order.views:
            if self._whole.get(view) != KEYS[view](order.state):
                self._note(order, view, whole=True)
                self._tell(nothing(view, order.serial, f"{_FAILING[view]} {why}"))


def _computed(state: State) -> list[str]:
    """Return the views of a state that need a job of their own; a printed line without text needs none."""
    return [view for view in KEYS if view in state.views and (view != "line" or state.line.strip())]
