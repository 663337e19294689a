"""The widget: the same page as one module, its messages over the notebook's own channel."""

import json
import re
import shutil
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.hammers import CRUDE
from tests.studio.server import STATE

from printhammer.hammer.hammer import load
from printhammer.studio import widget
from printhammer.studio.bundle import PLACE, module, style
from printhammer.studio.bundle import page as saved_page
from printhammer.studio.files import page_files
from printhammer.studio.frames import unframe


@pytest.mark.parametrize(("whole", "last"), [(module, "mount.js"), (saved_page, "kept.js")])
def test_a_bundle_holds_every_part_before_it_is_needed(whole: Callable[[], str], last: str) -> None:
    listed = json.loads(whole().partition("const sources = ")[2].partition(";\nconst places")[0])
    seen: list[str] = []
    for name, text in listed:
        needed = re.findall(r'from "\./([\w./]+)"', text)
        assert set(needed) <= set(seen), name
        seen.append(name)
    assert seen[-1] == last
    own = {name for name in page_files() if name.endswith(".js") and not name.startswith("engine/")}
    own -= {"page.js", "vendor/uPlot.iife.min.js"}
    assert set(seen) == own - ({"kept.js"} - {last})


def test_the_page_that_is_saved_holds_no_end_of_a_script_but_its_own() -> None:
    assert saved_page().count("</script>") == 2
    assert saved_page().count(PLACE) == 1 + exports_of_place()


def exports_of_place() -> int:
    """Return how often the module that fills the page names its place."""
    return page_files()["exports.js"].decode().count(PLACE)


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
