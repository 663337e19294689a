"""A studio of its own process, and a page that is only its messages; helpers only."""

import json
import secrets
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from tests.hammers import CRUDE
from websockets.sync.client import ClientConnection, connect

from printhammer.studio.frames import unframe
from printhammer.studio.states.state import START

SCRIPT = """
import sys
from printhammer.hammer.hammer import load
from printhammer.studio import serve
ready = lambda address: print(address, flush=True)
serve(load(sys.argv[1]), port=int(sys.argv[2]), token=sys.argv[3], ready=ready)
"""
STATE: dict[str, Any] = {**START, "hammer": "", "views": ["motion", "map", "strobe"]}
"""A state of the crude hammer, whose name is filled in by `Studio.state`."""


@dataclass(frozen=True)
class Studio:
    """A running studio."""

    address: str
    name: str
    process: "subprocess.Popen[str]"

    @property
    def host(self) -> str:
        return self.address.split("/")[2]

    @property
    def token(self) -> str:
        return self.address.partition("token=")[2]

    def state(self, **changed: Any) -> dict[str, Any]:
        return {**STATE, "hammer": self.name, **changed}

    def connect(self, token: str | None = None, **options: Any) -> connect:
        origin = options.pop("origin", f"http://{self.host}")
        address = f"ws://{self.host}/socket?token={self.token if token is None else token}"
        return connect(address, origin=origin, max_size=None, **options)


@contextmanager
def studio(hammer: str = str(CRUDE), port: int = 0, token: str = "") -> Iterator[Studio]:
    """Run a studio with a hammer, by default the crude one, and a token of its own."""
    from printhammer.hammer.hammer import load

    token = token or secrets.token_urlsafe(24)
    command = (sys.executable, "-c", SCRIPT, hammer, str(port), token)
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield Studio(process.stdout.readline().strip(), load(hammer).name, process)
    finally:
        process.terminate()
        process.wait(20)
        process.stdout.close()


def say(socket: ClientConnection, kind: str, serial: int, **content: Any) -> None:
    """Send a message."""
    socket.send(json.dumps({"kind": kind, "serial": serial, **content}))


def frames(socket: ClientConnection, last: str, **told: Any) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Receive frames up to one of a kind whose heading holds what is told."""
    found = []
    while True:
        heading, arrays = unframe(bytes(socket.recv(timeout=60)))
        found.append((heading, arrays))
        if heading["kind"] == last and all(heading.get(name) == value for name, value in told.items()):
            return found
