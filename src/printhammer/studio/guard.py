"""Access control of the studio: only its own pages, with the user's token, from this machine."""

from __future__ import annotations

import secrets
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

HOSTS: Final = ("127.0.0.1", "localhost")
"""Host names by which a browser on this machine may address the page."""

HEADERS: Final = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:;"
        " connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cache-Control": "no-store",
}
"""HTTP headers of every response: no external resources, no embedding in other pages."""


class Guard:
    """Access checks of the studio's server.

    Parameters
    ----------
    port : int
        Port of the server.
    token : str, optional
        Token required in the address; by default a new random one.
    """

    def __init__(self, port: int, token: str | None = None) -> None:
        self.port = port
        self.token = token or secrets.token_urlsafe(24)

    @property
    def address(self) -> str:
        """Address of the studio page, with the token."""
        return f"http://{HOSTS[0]}:{self.port}/?token={self.token}"

    def refuse(self, headers: Mapping[str, str], token: str | None = None, origin: bool = False) -> str:
        """Return the reason to refuse a request, or "".

        Parameters
        ----------
        headers : mapping
            Headers of the request.
        token : str, optional
            Token in the address of the request; None if the request needs no token.
        origin : bool, optional
            Whether the request must come from a page of this server.
        """
        # Another name for 127.0.0.1 would let a foreign page use the server as its own (DNS rebinding).
        if headers.get("host", "") not in {f"{name}:{self.port}" for name in HOSTS}:
            return f"the host is expected to be {HOSTS[0]}:{self.port}"
        if origin and headers.get("origin", "") not in {f"http://{name}:{self.port}" for name in HOSTS}:
            return "the request is expected to come from a page of the studio"
        if token is not None and not secrets.compare_digest(token.encode(), self.token.encode()):
            return "the address is expected to hold the token that the studio printed"
        return ""
