"""Headless Chromium, driven by its own protocol; helpers only."""

import base64
import itertools
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--disable-sync",
    "--mute-audio",
    "--remote-debugging-port=0",
)
HELPERS = (Path(__file__).parent / "helpers.js").read_text("utf-8")
"""Script that the tests run inside a page."""
WAIT = 60.0


def chromium() -> str | None:
    """Return the path of a Chromium program, or None."""
    return next(filter(None, map(shutil.which, NAMES)), None)


class Wire:
    """Connection to a tab of a browser; collects its console messages and network requests."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.numbers = itertools.count(1)
        self.complaints: list[str] = []
        self.requests: list[str] = []

    def call(self, method: str, **arguments: Any) -> dict[str, Any]:
        """Send a command and return its answer."""
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": arguments}))
        while True:
            message = json.loads(self.socket.recv(timeout=WAIT))
            if message.get("id") == number:
                assert "error" not in message, message["error"]
                return message["result"]
            self._note(message)

    def _note(self, message: dict[str, Any]) -> None:
        """Record a message of the browser that is not a response."""
        raise NotImplementedError

    def run(self, script: str) -> Any:
        """Run a script in the page, which may return a promise, and return its value."""
        raise NotImplementedError

    def wait(self, condition: str, seconds: float = WAIT) -> Any:
        """Wait until a script returns a true value, and return that value."""
        end = time.monotonic() + seconds
        while not (found := self.run(condition)):
            assert time.monotonic() < end, f"waited for {condition}; {self.complaints}"
            time.sleep(0.05)
        return found


class Page(Wire):
    """One tab of a Chromium."""

    def __init__(self, socket: ClientConnection) -> None:
        super().__init__(socket)
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def _note(self, message: dict[str, Any]) -> None:
        told = message.get("params", {})
        match message.get("method"):
            case "Runtime.exceptionThrown":
                self.complaints.append(json.dumps(told["exceptionDetails"])[:2000])
            case "Runtime.consoleAPICalled" if told["type"] in ("error", "warning", "assert"):
                self.complaints.append(json.dumps(told["args"])[:2000])
            case "Log.entryAdded" if told["entry"]["level"] in ("error", "warning"):
                self.complaints.append(f"{told['entry']['text']} {told['entry'].get('url', '')}")
            case "Network.requestWillBeSent":
                self.requests.append(told["request"]["url"])
            case "Network.webSocketCreated":
                self.requests.append(told["url"])

    def run(self, script: str) -> Any:
        """Run a script in the page, which may return a promise, and return its value."""
        found = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def open(self, address: str) -> None:
        """Go to an address."""
        self.call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete'")

    def size(
        self, width: int, height: int, dark: bool = False, ratio: float = 1.0, still: bool = True
    ) -> None:
        """Set the size of the window, its pixel ratio, and the user's preferences for colours and motion."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=ratio,
            mobile=False,
        )
        self.prefer(
            {
                "prefers-color-scheme": "dark" if dark else "light",
                "prefers-reduced-motion": "reduce" if still else "no-preference",
            }
        )

    def prefer(self, preferences: dict[str, str]) -> None:
        """Set media features, such as the preferences of the user."""
        features = [{"name": name, "value": value} for name, value in preferences.items()]
        self.call("Emulation.setEmulatedMedia", features=features)

    def picture(self, path: Path, selector: str | None = None) -> None:
        """Save a screenshot of the page or of one element as PNG."""
        clip: dict[str, Any] = {}
        if selector is not None:
            box = self.box(selector)
            clip = {"clip": {**box, "scale": 1}}
        path.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png", **clip)["data"]))

    def box(self, selector: str) -> dict[str, float]:
        """Scroll to an element if it is not visible, and return its position and size."""
        return self.run(
            f"(() => {{ const found = document.querySelector({json.dumps(selector)});"
            " found.scrollIntoViewIfNeeded(); const b = found.getBoundingClientRect();"
            " return {x: b.x, y: b.y, width: b.width, height: b.height}; })()"
        )

    def mouse(self, kind: str, x: float, y: float, held: bool = True, **more: Any) -> None:
        """Move, press ("mousePressed") or release ("mouseReleased") the left button."""
        told = {"button": "left" if held else "none", "buttons": int(held), "clickCount": 1, **more}
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **told)

    def drag(self, *places: tuple[float, float]) -> None:
        """Press at the first position, move through the others, release at the last."""
        self.mouse("mousePressed", *places[0])
        for place in places:
            self.mouse("mouseMoved", *place)
        self.mouse("mouseReleased", *places[-1])

    def press(self, name: str, code: str = "", modifiers: int = 0) -> None:
        """Press and release a key."""
        text = {"text": name} if len(name) == 1 and not modifiers else {}
        codes = {"ArrowRight": 39, "ArrowLeft": 37, "ArrowUp": 38, "ArrowDown": 40}
        more = {"windowsVirtualKeyCode": codes[name]} if name in codes else {}
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent",
                type=kind,
                key=name,
                code=code or name,
                modifiers=modifiers,
                **text,
                **more,
            )


@contextmanager
def started(command: list[str], pattern: str) -> Iterator[str]:
    """Start a browser, yield the address that it writes after `pattern`, and terminate the browser."""
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    assert process.stderr is not None
    try:
        found = (re.search(rf"{pattern} (ws://\S+)", line) for line in process.stderr)
        address = next(filter(None, found), None)
        assert address is not None, f"{command[0]} did not start"
        yield address[1]
    finally:
        process.terminate()
        process.wait(20)
        process.stderr.close()


@contextmanager
def browser() -> Iterator[Any]:
    """Start a Chromium and yield a function that opens a new tab."""
    program = chromium()
    assert program is not None
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder, ExitStack() as stack:
        command = [program, *FLAGS, f"--user-data-dir={folder}", "about:blank"]
        host = stack.enter_context(started(command, "DevTools listening on")).split("/")[2]

        def tab() -> Page:
            from urllib.request import Request, urlopen

            with urlopen(Request(f"http://{host}/json/new?about:blank", method="PUT")) as answer:
                found = json.load(answer)
            return Page(stack.enter_context(connect(found["webSocketDebuggerUrl"], max_size=None)))

        yield tab
