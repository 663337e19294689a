"""Headless Firefox, driven by WebDriver BiDi; helpers only."""

import json
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from tests.studio.browser import Wire, started
from websockets.sync.client import ClientConnection, connect

NAMES = ("firefox-esr", "firefox")
EVENTS = ["log.entryAdded", "network.beforeRequestSent"]


def firefox() -> str | None:
    """Return the path of a Firefox program, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Tab(Wire):
    """One tab of a Firefox."""

    def __init__(self, socket: ClientConnection) -> None:
        super().__init__(socket)
        self.call("session.new", capabilities={})
        self.call("session.subscribe", events=EVENTS)
        self.context = self.call("browsingContext.getTree")["contexts"][0]["context"]

    def _note(self, message: dict[str, Any]) -> None:
        told = message.get("params", {})
        match message.get("method"):
            case "log.entryAdded" if told["level"] in ("error", "warn"):
                self.complaints.append(str(told["text"])[:2000])
            case "network.beforeRequestSent":
                self.requests.append(told["request"]["url"])

    def run(self, expression: str) -> Any:
        """Evaluate an expression in the page, which may be a promise, and return its value."""
        found = self.call(
            "script.evaluate",
            expression=f"(async () => JSON.stringify((await ({expression})) ?? null))()",
            target={"context": self.context},
            awaitPromise=True,
        )
        assert found["type"] == "success", found["exceptionDetails"]
        return json.loads(found["result"]["value"])

    def open(self, address: str, width: int, height: int) -> None:
        """Open an address in a window of a given size."""
        size = {"width": width, "height": height}
        self.call("browsingContext.setViewport", context=self.context, viewport=size)
        self.call("browsingContext.navigate", context=self.context, url=address, wait="complete")

    def box(self, selector: str) -> dict[str, float]:
        """Return the position and size of an element."""
        return self.run(f"document.querySelector({json.dumps(selector)}).getBoundingClientRect()")

    def drag(self, *places: tuple[float, float]) -> None:
        """Press at the first position, move through the others, release at the last."""
        moves = [{"type": "pointerMove", "x": round(x), "y": round(y), "duration": 50} for x, y in places[1:]]
        x, y = places[0]
        press = [{"type": "pointerMove", "x": round(x), "y": round(y)}, {"type": "pointerDown", "button": 0}]
        actions = [*press, *moves, {"type": "pointerUp", "button": 0}]
        mouse = {"type": "pointer", "id": "mouse", "actions": actions}
        self.call("input.performActions", context=self.context, actions=[mouse])

    def press(self, key: str) -> None:
        """Press and release a key."""
        actions = [{"type": kind, "value": key} for kind in ("keyDown", "keyUp")]
        keys = {"type": "key", "id": "keys", "actions": actions}
        self.call("input.performActions", context=self.context, actions=[keys])


@contextmanager
def opened() -> Iterator[Tab]:
    """Start a Firefox and yield its tab."""
    program = firefox()
    assert program is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        command = [program, "--headless", "--no-remote", "--profile", folder, "--remote-debugging-port=0"]
        with (
            started(command, "WebDriver BiDi listening on") as address,
            connect(f"{address}/session", max_size=None) as socket,
        ):
            yield Tab(socket)
