"""One page and what is computed for it: the latest state wins, what is quick goes first.

Two threads: the first answers a state with its curves, its dots and a preview of its map, whatever else is
under way; the second follows with the map in full detail, the strobe section and its verdict, and gives up as
soon as there is a newer state.
"""

from __future__ import annotations

import json
import logging
import threading
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.studio.bounds import LARGEST_FILE, LARGEST_MESSAGE, LONGEST_REASON
from printhammer.studio.frames import frame
from printhammer.studio.pictures.chart import FULL, PREVIEW, map_frame, map_key, try_map
from printhammer.studio.pictures.engine import dots_frame, motion_frame
from printhammer.studio.pictures.printed import line_frame, line_key
from printhammer.studio.pictures.questions import QUESTIONS
from printhammer.studio.pictures.section import (
    AT_ONCE,
    LATER,
    VERDICT_WORK,
    check_strobe,
    strobe_frame,
    strobe_key,
)
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import ProtocolError, State, read_state
from printhammer.studio.work import GivenUp, Patience

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.run.motion import Motion

logger = logging.getLogger(__name__)

_KEYS: Final[dict[str, Callable[[State], Any]]] = {"map": map_key, "line": line_key, "strobe": strobe_key}
_NOTHING: Final[dict[str, dict[str, Any]]] = {"map": {"detail": "none"}, "strobe": {"verdict": None}}

REST: Final = 0.3
"""Seconds without a newer state after which more strobe points and the verdict on a train follow."""


class Session:
    """The work for one page.

    Parameters
    ----------
    send : callable
        Takes a frame to the page and returns when it is on its way; raises where the page is gone.
    shelf : Shelf, optional
        The hammers that are offered; by default those that come with the program.
    """

    def __init__(self, send: Callable[[bytes], None], shelf: Shelf | None = None) -> None:
        self._send = send
        self._shelf = shelf or Shelf()
        self._tried: State | None = None
        self._change = threading.Condition()
        self._latest: tuple[int, State] | None = None
        self._answered = 0
        self._detail: tuple[int, State, Motion | None] | None = None
        self._questions: list[tuple[str, int, Any]] = []
        self._closed = False
        self._sent: dict[str, Any] = {}
        self._threads = [
            threading.Thread(target=self._run, args=(work,), name=f"studio-{name}", daemon=True)
            for name, work in (("quick", self._quick), ("detail", self._details))
        ]
        for thread in self._threads:
            thread.start()

    def receive(self, text: str) -> None:
        """Take a message of the page.

        Raises
        ------
        ProtocolError
            It is none that the page would send.
        """
        kind, serial, content = read_message(text, self._shelf)
        with self._change:
            if kind == "state":
                self._latest = (serial, content)
            elif len(self._questions) < 16:
                self._questions.append((kind, serial, content))
            else:
                raise ProtocolError("more than 16 questions wait for their answer")
            self._change.notify_all()

    def close(self) -> None:
        """End; what is under way is given up, and nothing is sent any more."""
        with self._change:
            self._closed = True
            self._change.notify_all()

    def join(self, timeout: float | None = None) -> None:
        """Wait for both threads."""
        for thread in self._threads:
            thread.join(timeout)

    def _run(self, work: Callable[[], None]) -> None:
        try:
            while not self._closed:
                work()
        except OSError:
            # The page is gone.
            self.close()

    def _tell(self, data: bytes) -> None:
        if not self._closed:
            self._send(data)

    def _quick(self) -> None:
        with self._change:
            self._change.wait_for(lambda: self._closed or self._questions or self._waiting())
            if self._closed:
                return
            questions, self._questions = self._questions, []
            taken = self._latest if self._waiting() else None
            if taken is not None:
                self._answered = taken[0]
        for kind, serial, content in questions:
            self._sure(self._answer, serial, kind, content)
        if taken is not None:
            self._sure(self._first, *taken)

    def _sure(self, work: Callable[..., None], serial: int, *content: Any) -> None:
        """Do some work; where it fails in a way nobody thought of, that is told, and the page lives on."""
        try:
            work(serial, *content)
        except OSError:
            raise
        except GivenUp:
            return
        except Exception as error:
            logger.exception("%s, message %d", work.__name__, serial)
            reason = f"this could not be computed, {type(error).__name__}: {error}"
            self._tell(refusal(serial, reason))

    def _answer(self, serial: int, kind: str, content: Any) -> None:
        self._tell(answer(kind, serial, content, self._shelf))

    def _waiting(self) -> bool:
        return self._latest is not None and self._latest[0] != self._answered

    def _first(self, serial: int, state: State) -> None:
        try:
            data, motion = motion_frame(state, serial)
        except InputError as error:
            self._tell(refusal(serial, str(error)))
            return
        self._tell(data)
        if "map" in state.views and self._sent.get("preview") != map_key(state):
            self._preview(serial, state)
        # Where no view shows the dots, they wait for the map.
        shown = not {"energy", "line"}.isdisjoint(state.views)
        with self._change:
            self._detail = (serial, state, None if shown else motion)
            self._change.notify_all()
        if shown:
            self._tell(dots_frame(serial, motion))

    def _preview(self, serial: int, state: State) -> None:
        try:
            self._tried = try_map(state, self._tried)
            # Not given up for a newer state: a coarse map is to arrive while a slider moves. The browser
            # draws meanwhile, and has another core for that.
            self._tell(map_frame(state, serial, PREVIEW, lambda: self._closed, 1))
        except InputError as error:
            self._tell(nothing("map", serial, error))
            self._sent["map"] = map_key(state)
        self._sent["preview"] = map_key(state)

    def _details(self) -> None:
        with self._change:
            self._change.wait_for(lambda: self._closed or self._detail)
            taken, self._detail = self._detail, None
        if self._closed or taken is None:
            return
        self._sure(self._second, *taken)

    def _second(self, serial: int, state: State, motion: Motion | None) -> None:
        def newer() -> bool:
            return self._closed or self._latest is None or self._latest[0] != serial

        self._follow("map", serial, state, lambda: self._tell(map_frame(state, serial, FULL, newer)))
        if motion is not None:
            self._tell(dots_frame(serial, motion))
        if state.line.strip():
            self._follow("line", serial, state, lambda: self._tell(line_frame(state, serial, newer)))
        self._follow("strobe", serial, state, lambda: self._section(serial, state, newer))

    def _follow(self, view: str, serial: int, state: State, work: Callable[[], None]) -> None:
        """Do the work for a view that is shown and not yet sent as it is, or tell why it cannot be done."""
        key = _KEYS[view](state)
        if view not in state.views or self._sent.get(view) == key:
            return
        try:
            work()
        except InputError as error:
            self._tell(nothing(view, serial, error))
        self._sent[view] = key

    def _section(self, serial: int, state: State, newer: Callable[[], bool]) -> None:
        patience = Patience(newer, "the strobe section")
        check_strobe(state)
        for points in AT_ONCE:
            patience.check()
            self._tell(strobe_frame(state, serial, points))
        with self._change:
            if self._change.wait_for(newer, REST):
                raise GivenUp
        for points in LATER:
            patience.check()
            begun = patience.spent
            self._tell(strobe_frame(state, serial, points, exponent=True))
        patience.check(VERDICT_WORK * (patience.spent - begun))
        self._tell(strobe_frame(state, serial, LATER[-1], judged=True))


def nothing(view: str, serial: int, reason: object) -> bytes:
    """Return that there is nothing to show in a view, and why."""
    return frame(view, serial, reason=str(reason), **_NOTHING.get(view, {}))


def refusal(serial: int, reason: str) -> bytes:
    """Return that something is refused, and why."""
    return frame("refusal", serial, reason=reason[:LONGEST_REASON])


def read_message(text: str, shelf: Shelf | None = None) -> tuple[str, int, Any]:
    """Read a message: its kind, the serial number of the page, and its content.

    Raises
    ------
    ProtocolError
        It is none that the page would send.
    """
    if len(text) > LARGEST_MESSAGE:
        raise ProtocolError(f"the message has {len(text)} characters, expected at most {LARGEST_MESSAGE}")
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        raise ProtocolError("the message is expected to be JSON") from None
    if not isinstance(message, dict):
        raise ProtocolError("the message is expected to be a table")
    kind, serial = message.get("kind"), message.get("serial")
    if isinstance(serial, bool) or not isinstance(serial, int) or not 0 < serial < 2**53:
        raise ProtocolError("serial is expected to be a positive whole number")
    contents = {"state": {"state"}, "hammer": {"name", "text"}, "texts": {"state"}, "drop": {"name", "text"}}
    contents |= {kind: {"state"} for kind in QUESTIONS}
    if not isinstance(kind, str) or kind not in contents:
        raise ProtocolError(f"kind is expected to be one of {', '.join(contents)}")
    if set(message) != {"kind", "serial", *contents[kind]}:
        raise ProtocolError(
            f"a message of kind {kind} has the keys kind, serial, {', '.join(sorted(contents[kind]))}"
        )
    if kind in QUESTIONS:
        # A pin of a link may hold anything, and is no reason to end the connection.
        try:
            return kind, serial, read_state(message["state"], shelf)
        except ProtocolError as error:
            return kind, serial, str(error)
    if "state" in contents[kind]:
        return kind, serial, read_state(message["state"], shelf)
    pair = (message["name"], message["text"])
    if not all(isinstance(part, str) and len(part) <= LARGEST_FILE for part in pair):
        raise ProtocolError(f"name and text are expected to be texts of at most {LARGEST_FILE} characters")
    return kind, serial, pair


def answer(kind: str, serial: int, content: Any, shelf: Shelf) -> bytes:
    """Return the answer to a question: what a hammer is, what a dropped file holds, a state as texts."""
    from printhammer.studio.states.controls import describe, vocabulary
    from printhammer.studio.states.drops import dropped
    from printhammer.studio.states.state import dropped_hammer
    from printhammer.studio.states.texts import texts_of

    try:
        if kind == "hammer":
            name, text = content
            hammer = dropped_hammer(text) if text else shelf.hammer(name or shelf.names[0])
            heading = {"offered": shelf.names, "asked": name or shelf.names[0], "text": text, **vocabulary()}
            return frame("hammer", serial, hammer=describe(hammer), **heading)
        if kind == "drop":
            return dropped(serial, *content)
        if kind in QUESTIONS:
            return refusal(serial, content) if isinstance(content, str) else QUESTIONS[kind](content, serial)
        return frame("texts", serial, texts=texts_of(content))
    except InputError as error:
        return refusal(serial, str(error))
