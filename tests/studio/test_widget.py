"""The widget: the same page as one module, its messages over the notebook's own channel."""

import json
import re
import shutil
import subprocess
import threading
from pathlib import Path
from typing import Any

import pytest
from tests.hammers import CRUDE
from tests.studio.server import STATE

from printhammer.hammer.hammer import load
from printhammer.studio import widget
from printhammer.studio.bundle import module, style
from printhammer.studio.files import page_files
from printhammer.studio.frames import unframe


def test_the_module_holds_every_part_before_it_is_needed() -> None:
    listed = json.loads(module().partition("const sources = ")[2].partition(";\nconst places")[0])
    seen: list[str] = []
    for name, text in listed:
        needed = re.findall(r'from "\./([\w./]+)"', text)
        assert set(needed) <= set(seen), name
        seen.append(name)
    assert seen[-1] == "mount.js"
    assert set(seen) == {name for name in page_files() if name.endswith(".js")} - {
        "page.js",
        "vendor/uPlot.iife.min.js",
    }


def test_nothing_is_fetched_from_elsewhere() -> None:
    names = re.compile(rb"(?:https?:)?//[\w-]+\.\w+")
    own = {name: data for name, data in page_files().items() if not name.startswith("vendor/")}
    found = {name: names.findall(data) for name, data in own.items()}
    # The name of a language is an address that nobody fetches.
    assert {place for list_ in found.values() for place in list_} <= {b"http://www.w3"}


def test_the_style_holds_that_of_the_curves() -> None:
    assert ".uplot" in style()
    assert ".studio" in style()


@pytest.mark.parametrize("name", sorted(name for name in page_files() if name.endswith(".js")))
def test_every_part_is_a_module_that_can_be_parsed(name: str, tmp_path: Path) -> None:
    if (program := shutil.which("node")) is None:
        return
    path = tmp_path / "part.mjs"
    path.write_bytes(page_files()[name])
    done = subprocess.run((program, "--check", path), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_message_is_answered_with_frames() -> None:
    hammer = load(CRUDE)
    made: Any = widget(hammer, height="500px")
    sent: list[bytes] = []
    arrived = threading.Event()

    def take(_content: Any, buffers: list[bytes]) -> None:
        sent.extend(buffers)
        arrived.set()

    made.send = take
    try:
        state = {**STATE, "hammer": hammer.name, "views": ["motion"]}
        made._take(made, {"text": "not a message"}, [])
        made._take(made, "neither", [])
        made._take(made, {"text": json.dumps({"kind": "state", "serial": 3, "state": state})}, [])
        assert arrived.wait(120)
    finally:
        made.close()
    heading, _ = unframe(sent[0])
    assert (heading["kind"], heading["serial"], made.height) == ("motion", 3, "500px")
