"""Parsing of the messages from a page, and answers to its questions on files and hammers."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from printhammer.errors import InputError
from printhammer.studio.bounds import LARGEST_FILE, LARGEST_MESSAGE
from printhammer.studio.frames import frame, refusal
from printhammer.studio.states.records import MOST_COLUMNS, QUANTITIES
from printhammer.studio.states.state import ProtocolError, read_state
from printhammer.studio.workers.order import ASKED

if TYPE_CHECKING:
    from printhammer.studio.states.shelf import Shelf

LONGEST_UNIT: Final = 40
"""Largest length of the unit of a column, characters."""


def read_message(text: str, shelf: Shelf | None = None) -> tuple[str, int, Any]:
    """Parse a message from the page: kind, serial number and content.

    Raises
    ------
    ProtocolError
        The message is not one that the page can send.
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
    contents: dict[str, set[str]] = {
        "state": {"state"},
        "open": {"state"},
        "page": set(),
        "hammer": {"name", "text"},
        "texts": {"state"},
        "drop": {"name", "text", "columns"},
    }
    contents |= {kind: {"state"} for kind in ASKED}
    if not isinstance(kind, str) or kind not in contents:
        raise ProtocolError(f"kind is expected to be one of {', '.join(contents)}")
    if set(message) != {"kind", "serial", *contents[kind]}:
        raise ProtocolError(
            f"a message of kind {kind} has the keys kind, serial, {', '.join(sorted(contents[kind]))}"
        )
    if kind in ("open", "page"):
        return kind, serial, message.get("state")
    if kind in ASKED:
        # A pin of a link may hold anything, and does not end the connection.
        try:
            return kind, serial, read_state(message["state"], shelf)
        except ProtocolError as error:
            return kind, serial, str(error)
    if "state" in contents[kind]:
        return kind, serial, read_state(message["state"], shelf)
    pair = (message["name"], message["text"])
    if not all(isinstance(part, str) and len(part) <= LARGEST_FILE for part in pair):
        raise ProtocolError(f"name and text are expected to be texts of at most {LARGEST_FILE} characters")
    return kind, serial, pair if kind == "hammer" else (*pair, _columns(message["columns"]))


def _columns(content: Any) -> list[tuple[str, str]] | None:
    """Parse the columns that the user declared for a table dropped on the page; None if undeclared."""
    if content is None:
        return None
    told = []
    for row in content if isinstance(content, list) and len(content) <= MOST_COLUMNS else [None]:
        pair = tuple(row) if isinstance(row, list) else ()
        if len(pair) != 2 or pair[0] not in ("", *QUANTITIES) or not isinstance(pair[1], str):
            raise ProtocolError("columns is expected to be a list of quantities and units")
        told.append((str(pair[0]), pair[1][:LONGEST_UNIT]))
    return told


def answer(kind: str, serial: int, content: Any, shelf: Shelf) -> bytes:
    """Return the answer frame to a question on a link, a dropped file, a hammer, or a state as texts."""
    from printhammer.studio.bundle import page
    from printhammer.studio.states.controls import describe, vocabulary
    from printhammer.studio.states.drops import dropped
    from printhammer.studio.states.links import taken
    from printhammer.studio.states.state import dropped_hammer
    from printhammer.studio.states.texts import texts_of

    try:
        if kind == "hammer":
            name, text = content
            hammer = dropped_hammer(text) if text else shelf.hammer(name or shelf.names[0])
            heading = {
                "offered": shelf.names,
                "asked": name or shelf.names[0],
                "text": text,
                **vocabulary(hammer),
            }
            return frame("hammer", serial, hammer=describe(hammer), **heading)
        if kind == "open":
            # A page whose link contains no state opens with the start state of the studio.
            table, notes = taken(content, shelf) if content else shelf.start
            return frame("open", serial, state=table, notes=notes)
        if kind == "page":
            return frame("page", serial, html=page())
        if kind == "drop":
            name, text, columns = content
            return dropped(serial, name, text, columns, shelf)
        return frame("texts", serial, texts=texts_of(content))
    except InputError as error:
        return refusal(serial, str(error))
