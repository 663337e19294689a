"""Web application of the studio: the page, its files, and the WebSocket of each page."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from starlette.applications import Starlette
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from printhammer.studio.bounds import MOST_TABS
from printhammer.studio.files import KINDS, page_files
from printhammer.studio.guard import HEADERS, Guard
from printhammer.studio.session import Session
from printhammer.studio.states.state import ProtocolError

if TYPE_CHECKING:
    from collections.abc import Callable

    from starlette.requests import Request

    from printhammer.studio.states.shelf import Shelf
    from printhammer.studio.workers.crew import Crew

REFUSED: Final = 1008
BUSY: Final = 1013
"""WebSocket close codes: access refused, too many pages (RFC 6455, section 7.4, and the IANA registry)."""

_PATIENCE: Final = 20.0


def application(guard: Guard, shelf: Shelf, crew: Crew) -> Starlette:
    """Build the web application (Starlette).

    Parameters
    ----------
    guard : Guard
        Access control.
    shelf : Shelf
        Hammers that the studio offers.
    crew : Crew
        Workers of all pages.
    """
    tabs: set[Session] = set()

    def page(request: Request) -> Response:
        # The page is the same for everybody; access to the socket depends on the token.
        if reason := guard.refuse(request.headers, request.query_params.get("token")):
            return _refused(reason)
        return _file("index.html")

    def part(request: Request) -> Response:
        # These files are the same for everybody, and contain nothing about the user.
        if reason := guard.refuse(request.headers):
            return _refused(reason)
        return _file(request.path_params["name"])

    async def socket(connection: WebSocket) -> None:
        token = connection.query_params.get("token", "")
        if reason := guard.refuse(connection.headers, token, origin=True):
            await connection.close(REFUSED, reason)
            return
        await connection.accept()
        if len(tabs) >= MOST_TABS:
            await connection.close(BUSY, f"the studio is open {MOST_TABS} times already")
            return
        crew.warm("curves", "map")
        session = Session(_sender(connection), shelf, crew)
        tabs.add(session)
        try:
            await _listen(connection, session)
        finally:
            session.close()
            tabs.discard(session)

    return Starlette(
        routes=[
            Route("/", page),
            WebSocketRoute("/socket", socket),
            Route("/{name:path}", part),
        ]
    )


def _refused(reason: str) -> Response:
    return PlainTextResponse(f"printhammer studio: {reason}\n", 403, headers=HEADERS)


def _file(name: str) -> Response:
    content = page_files().get(name)
    if content is None:
        return PlainTextResponse("there is no such file\n", 404, headers=HEADERS)
    return Response(content, media_type=KINDS[f".{name.rpartition('.')[2]}"], headers=HEADERS)


async def _listen(connection: WebSocket, session: Session) -> None:
    try:
        while True:
            message = await connection.receive()
            if message["type"] == "websocket.disconnect":
                return
            if message.get("text") is None:
                raise ProtocolError("the message is expected to be text")
            session.receive(message["text"])
    except WebSocketDisconnect:
        return
    except ProtocolError as error:
        with suppress(RuntimeError, WebSocketDisconnect):
            # A close reason has at most 123 bytes.
            await connection.close(REFUSED, str(error).encode()[:120].decode(errors="ignore"))


def _sender(connection: WebSocket) -> Callable[[bytes], None]:
    """Return a function that sends a frame and waits until the browser has accepted it, to avoid a queue."""
    loop = asyncio.get_running_loop()

    def send(data: bytes) -> None:
        try:
            asyncio.run_coroutine_threadsafe(connection.send_bytes(data), loop).result(_PATIENCE)
        except (RuntimeError, WebSocketDisconnect, TimeoutError, asyncio.CancelledError) as error:
            raise ConnectionError("the page is gone") from error

    return send
