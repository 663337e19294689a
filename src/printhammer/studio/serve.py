"""Local HTTP server of the studio, accessible only to the user who started it."""

from __future__ import annotations

import socket
from pathlib import Path
from typing import TYPE_CHECKING, Final

from printhammer.errors import InputError, missing_extra

if TYPE_CHECKING:
    from collections.abc import Callable

    from printhammer.hammer.hammer import Hammer

PORT: Final = 19830
"""Default port of the studio, always the same, so that links and open pages remain valid."""


def serve(
    hammer: Hammer | None = None,
    *,
    port: int | None = None,
    state: str | Path | None = None,
    ready: Callable[[str], None] | None = None,
    token: str | None = None,
) -> None:
    """Run the studio until it is interrupted.

    Parameters
    ----------
    hammer : Hammer, optional
        Hammer to open; by default the first shipped hammer.
    port : int, optional
        Port on 127.0.0.1, 0 for a free one; by default `PORT`, or a free port if that is taken.
    state : path, optional
        Saved state to open; the page reports entries that cannot be used.
    ready : callable, optional
        Called with the address of the page when it is ready.
    token : str, optional
        Token required in the address; by default that of the user, see `printhammer.studio.token`.

    Raises
    ------
    InputError
        The extra `studio` is not installed, the port cannot be used, or the file is not a state.
    """
    try:
        import uvicorn

        from printhammer.studio.app import application
    except ImportError as error:
        raise missing_extra(f"the studio needs {error.name}", "studio") from None
    from printhammer.studio.bounds import LARGEST_MESSAGE
    from printhammer.studio.guard import HOSTS, Guard
    from printhammer.studio.states.links import open_file
    from printhammer.studio.states.shelf import Shelf
    from printhammer.studio.token import user_token
    from printhammer.studio.workers.crew import Crew

    shelf = Shelf(hammer)
    if state is not None:
        open_file(Path(state), shelf)
    listening = _listen(HOSTS[0], port)
    guard = Guard(listening.getsockname()[1], token or user_token())
    crew = Crew()
    config = uvicorn.Config(
        application(guard, shelf, crew),
        log_level="warning",
        access_log=False,
        lifespan="off",
        ws="websockets-sansio",
        ws_max_size=LARGEST_MESSAGE,
        ws_per_message_deflate=False,
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    crew.warm("curves")
    try:
        if ready is not None:
            ready(guard.address)
        uvicorn.Server(config).run(sockets=[listening])
    finally:
        crew.close()


def _listen(host: str, port: int | None) -> socket.socket:
    if port is None:
        try:
            return _listen(host, PORT)
        except InputError:
            port = 0
    if not 0 <= port <= 65535:
        raise InputError.of("port", port, "a number from 0 to 65535", written=str(port))
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
        listening.listen(64)
    except OSError as error:
        listening.close()
        raise InputError(
            f"port = {port}: it cannot be used ({error.strerror})", key="port", value=port
        ) from None
    return listening
