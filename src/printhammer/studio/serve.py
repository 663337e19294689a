"""The server of the studio: on this machine, for its user alone."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

from printhammer.errors import InputError, missing_extra

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.hammer.hammer import Hammer


def serve(
    hammer: Hammer | None = None,
    *,
    port: int = 0,
    ready: Callable[[str], None] | None = None,
    token: str | None = None,
) -> None:
    """Run the studio until it is interrupted.

    Parameters
    ----------
    hammer : Hammer, optional
        The hammer that it opens with; by default the first one that comes with the program.
    port : int, optional
        Port on 127.0.0.1; by default a free one.
    ready : callable, optional
        Called with the address of the page once it can be opened.
    token : str, optional
        What the address has to hold; by default a new random one.

    Raises
    ------
    InputError
        The extra `studio` is not installed, or the port cannot be used.
    """
    try:
        import uvicorn

        from printhammer.studio.app import application
    except ImportError as error:
        raise missing_extra(f"the studio needs {error.name}", "studio") from None
    from printhammer.studio.bounds import LARGEST_MESSAGE
    from printhammer.studio.guard import HOSTS, Guard
    from printhammer.studio.states.shelf import Shelf
    from printhammer.studio.workers.crew import Crew

    listening = _listen(HOSTS[0], port)
    guard = Guard(listening.getsockname()[1], token)
    crew = Crew()
    config = uvicorn.Config(
        application(guard, Shelf(hammer), crew),
        log_level="warning",
        access_log=False,
        lifespan="off",
        ws="websockets-sansio",
        ws_max_size=LARGEST_MESSAGE,
        ws_per_message_deflate=False,
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    crew.warm("curves", "map", "detail")
    try:
        if ready is not None:
            ready(guard.address)
        uvicorn.Server(config).run(sockets=[listening])
    finally:
        crew.close()


def _listen(host: str, port: int) -> socket.socket:
    if not 0 <= port <= 65535:
        raise InputError(f"port = {port}, expected a number from 0 to 65535")
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
        listening.listen(64)
    except OSError as error:
        listening.close()
        raise InputError(f"port = {port}: it cannot be used ({error.strerror})") from None
    return listening
