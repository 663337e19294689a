"""One page and what is computed for it: the latest state wins, what is quick goes first.

Two threads: the first answers a state with its curves, its dots and a preview of its map, whatever else is
under way; the second follows with the map in full detail, the strobe section and its verdict, and gives up as
soon as there is a newer state.
"""

from __future__ import annotations

import json
import threading
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.studio import engine
from printhammer.studio.frames import frame
from printhammer.studio.printed import line_frame, line_key
from printhammer.studio.state import ProtocolError, State, names, offered, read_state

if TYPE_CHECKING:
    from collections.abc import Callable

REST: Final = 0.15
"""Seconds without a newer state after which the verdict on a train is worked out."""


class Session:
    """The work for one page.

    Parameters
    ----------
    send : callable
        Takes a frame to the page and returns when it is on its way; raises where the page is gone.
    """

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self._send = send
        self._change = threading.Condition()
        self._latest: tuple[int, State] | None = None
        self._answered = 0
        self._detail: tuple[int, State] | None = None
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
        kind, serial, content = read_message(text)
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
        for question in questions:
            self._tell(answer(*question))
        if taken is not None:
            self._first(*taken)

    def _waiting(self) -> bool:
        return self._latest is not None and self._latest[0] != self._answered

    def _first(self, serial: int, state: State) -> None:
        try:
            data, motion = engine.motion_frame(state, serial)
            self._tell(data)
            if reason := engine.too_long(motion):
                raise InputError(reason)
            if "map" in state.views and self._sent.get("preview") != engine.map_key(state):
                # Never given up: a coarse map is to arrive while a slider moves. The browser draws meanwhile,
                # and has another core for that.
                self._tell(engine.map_frame(state, serial, engine.PREVIEW, lambda: False, threads=1))
                self._sent["preview"] = engine.map_key(state)
        except InputError as error:
            self._tell(frame("refusal", serial, reason=str(error)))
            return
        with self._change:
            self._detail = (serial, state)
            self._change.notify_all()
        self._tell(engine.dots_frame(serial, motion))

    def _details(self) -> None:
        with self._change:
            self._change.wait_for(lambda: self._closed or self._detail)
            taken, self._detail = self._detail, None
        if self._closed or taken is None:
            return
        try:
            self._second(*taken)
        except engine.GivenUp:
            return
        except InputError as error:
            self._tell(frame("refusal", taken[0], reason=str(error)))

    def _second(self, serial: int, state: State) -> None:
        def newer() -> bool:
            return self._closed or self._latest is None or self._latest[0] != serial

        if "map" in state.views and self._sent.get("map") != engine.map_key(state):
            self._tell(engine.map_frame(state, serial, engine.FULL, newer))
            self._sent["map"] = engine.map_key(state)
        if "line" in state.views and state.line.strip() and self._sent.get("line") != line_key(state):
            self._tell(line_frame(state, serial, newer))
            self._sent["line"] = line_key(state)
        if "strobe" in state.views and self._sent.get("strobe") != engine.strobe_key(state):
            if newer():
                raise engine.GivenUp
            self._tell(engine.strobe_frame(state, serial, engine.SECTION[0], judged=False))
            with self._change:
                if self._change.wait_for(newer, REST):
                    raise engine.GivenUp
            self._tell(engine.strobe_frame(state, serial, engine.SECTION[1], judged=True))
            self._sent["strobe"] = engine.strobe_key(state)


def read_message(text: str) -> tuple[str, int, Any]:
    """Read a message: its kind, the serial number of the page, and its content.

    Raises
    ------
    ProtocolError
        It is none that the page would send.
    """
    from printhammer.studio.bounds import LARGEST_FILE, LARGEST_MESSAGE

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
    if not isinstance(kind, str) or kind not in contents:
        raise ProtocolError(f"kind is expected to be one of {', '.join(contents)}")
    if set(message) != {"kind", "serial", *contents[kind]}:
        raise ProtocolError(
            f"a message of kind {kind} has the keys kind, serial, {', '.join(sorted(contents[kind]))}"
        )
    if "state" in contents[kind]:
        return kind, serial, read_state(message["state"])
    pair = (message["name"], message["text"])
    if not all(isinstance(part, str) and len(part) <= LARGEST_FILE for part in pair):
        raise ProtocolError(f"name and text are expected to be texts of at most {LARGEST_FILE} characters")
    return kind, serial, pair


def answer(kind: str, serial: int, content: Any) -> bytes:
    """Return the answer to a question: what a hammer is, what a dropped file holds, a state as texts."""
    from printhammer.studio.controls import describe, vocabulary
    from printhammer.studio.drops import dropped
    from printhammer.studio.state import dropped_hammer
    from printhammer.studio.texts import texts_of

    try:
        if kind == "hammer":
            name, text = content
            hammer = dropped_hammer(text) if text else offered(name or names()[0])
            told = {"offered": names(), "asked": name or names()[0], "text": text, **vocabulary()}
            return frame("hammer", serial, hammer=describe(hammer), **told)
        if kind == "drop":
            return dropped(serial, *content)
        return frame("texts", serial, texts=texts_of(content))
    except InputError as error:
        return frame("refusal", serial, reason=str(error))
