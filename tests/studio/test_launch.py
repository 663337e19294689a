"""The page as a file: its initial state, the folder that stores it, its components, the widget."""

import json
import os
import random
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from tests.errors import refused
from tests.hammers import CRUDE
from tests.studio.reading import without_modules

from printhammer.hammer.hammer import load
from printhammer.studio import Shelf, launch, live_page, widget
from printhammer.studio.bundle import deltas, merged, page_files, sources
from printhammer.studio.live import content_of

TEXT = CRUDE.read_text("utf-8")


def state_file(folder: Path, **state: Any) -> str:
    path = folder / "state.json"
    path.write_text(json.dumps({"kind": launch.KIND, "format": launch.FORMAT, "state": state}), "utf-8")
    return str(path)


def test_a_page_begins_with_a_file_or_the_text_of_an_address(tmp_path: Path) -> None:
    assert launch.read_start("rate=900&pulses=3") == ("rate=900&pulses=3", None)
    assert launch.read_start("file:///a/page.html#rate=900") == ("rate=900", None)
    # A name of a file has at most 255 bytes, a link with pins has more.
    long = f"rate=900&line={'H' * 5000}"
    assert launch.read_start(long) == (long, None)
    assert launch.read_start(state_file(tmp_path, rate=777.0, hammer="tung-shaw-1988")) == (
        {"rate": 777.0, "hammer": "tung-shaw-1988"},
        None,
    )
    start, own = launch.read_start(state_file(tmp_path, rate=777.0, hammer="", text=TEXT))
    assert own is not None
    assert own.fingerprint == load(CRUDE).fingerprint
    assert start == {"rate": 777.0, "hammer": own.name, "text": ""}


@pytest.mark.parametrize(
    ("content", "key"),
    [
        ("", "state"),
        ("{", "state"),
        ("[" * 100_000, "state"),
        ('{"kind": "printhammer studio state", "format": 9}', "format"),
        ('{"kind": "printhammer studio state", "format": 1, "state": 3}', "state"),
        (" " * 2_000_000, "characters"),
    ],
)
def test_what_is_no_state_file_is_refused_in_one_sentence(tmp_path: Path, content: str, key: str) -> None:
    path = tmp_path / "a.json"
    path.write_text(content, "utf-8")
    with refused(key, file="a.json"):
        launch.read_start(str(path))


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("x = [", "text"),
        ("name = 'a'", "format"),
        ('name = "a"\n[waveform]\nshape = "sampled"\nfile = "/etc/passwd"\n', "waveform.file"),
        ('format = 1\nname = "a"\n[magnet]\nlaw = "table"\nfile = "t.csv"\n', "magnet.file"),
        ('name = "a"\n[[force]]\nlaw = "sampled"\nname = "a"\nfile = "/etc/passwd"\n', "force.file"),
        # These would take minutes to read.
        ("a." * 150_000 + "b = 1", "text"),
        ("x = {" + "a." * 150_000 + "b = 1}", "text"),
        ("[" + "a." * 150_000 + "b]", "text"),
    ],
)
def test_a_hammer_inside_a_file_names_no_other_file(tmp_path: Path, text: str, key: str) -> None:
    with refused(key):
        launch.read_start(state_file(tmp_path, text=text))


def test_hammers_of_ones_own_come_first() -> None:
    own = load(CRUDE).replace("name", "mine")
    shelf = Shelf(own, load("relay-5v").replace({"mass": 2e-3}))
    assert shelf.names[:3] == ["mine", "relay-5v", "hendriks-1983"]
    assert [shelf.is_shipped(name) for name in shelf.names[:3]] == [False, False, True]
    assert Shelf(own, only=True).names == ["mine"]
    assert len(Shelf(only=True).names) == len(shelf.names) - 1


def test_two_hammers_of_ones_own_have_two_names() -> None:
    own = load(CRUDE)
    assert Shelf(own, load(CRUDE), only=True).names == [own.name]
    with refused("name", own.name):
        Shelf(own, own.replace({"mass": 2e-3}))


def test_hammers_of_the_same_laws_share_modules_and_each_names_its_quantities(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    without_modules(monkeypatch)
    names = ("hendriks-1983", "hendriks-1983-1", "braille-embosser", "dot-peen", "tung-shaw-1988")
    content = content_of(Shelf(*map(load, names), only=True))
    found = {name: entry["modules"] for name, entry in content["hammers"].items()}
    first, second, third, fourth, last = (found[name] for name in names)
    assert (set(first), set(third), set(last)) == ({"current", "voltage"}, {"voltage"}, {"force"})
    assert (first, third) == (second, fourth)
    assert len(content["modules"]) == 4
    described = [content["hammers"][name]["described"]["quantities"] for name in names]
    assert [set(each) for each in described] == [set(found[name]) for name in names]


def test_the_state_of_a_page_cannot_end_its_script(monkeypatch: pytest.MonkeyPatch) -> None:
    without_modules(monkeypatch)
    page = live_page(Shelf(load(CRUDE), only=True), {"line": "</script><script>alert(1)"})
    assert page.count("</script>") == 3
    (start,) = re.findall(r'id="start">(.*?)</script>', page)
    assert json.loads(start)["state"]["line"] == "</script><script>alert(1)"


def test_pages_are_kept_under_their_content_and_the_oldest_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(launch, "_cache", lambda: tmp_path / "cache")
    first = launch.keep_page("a")
    assert launch.keep_page("a") == first
    assert first.read_text("utf-8") == "a"
    pages = [launch.keep_page(f"page {k}") for k in range(7)]
    for age, page in enumerate([first, *pages]):
        os.utime(page, (1e9 - age, 1e9 - age))
    # A page that another program removes while the ages are read has no age.
    gone = first.parent / "studio-gone.html"
    gone.symlink_to("removed")
    assert launch.keep_page("page 6") == pages[-1]
    latest = launch.keep_page("page 7")
    # The oldest is left out, not one that has just been opened again.
    assert set(first.parent.iterdir()) == {first, *pages, latest, gone} - {pages[-2]}


@pytest.mark.parametrize("last", ["engine/page.js", "engine/worker.js"])
def test_a_bundle_holds_every_part_before_it_is_needed(last: str) -> None:
    seen: list[str] = []
    for name, text in sources(last):
        needed = re.findall(r'from "\./([\w./]+)"', text)
        assert set(needed) <= set(seen), name
        seen.append(name)
    assert seen[-1] == last


def test_every_script_of_the_page_is_used() -> None:
    used = {name for last in ("engine/page.js", "engine/worker.js") for name, _ in sources(last)}
    assert used == {name for name in page_files() if name.endswith(".js")} - {"vendor/uPlot.iife.min.js"}


def test_every_exported_name_has_a_user() -> None:
    """In another script of the page, or in a test."""
    scripts = {name: content.decode() for name, content in page_files().items() if name.endswith(".js")}
    tests = " ".join(path.read_text("utf-8") for path in Path(__file__).parent.glob("*.py"))
    words = {name: set(re.findall(r"\w+", content)) for name, content in {**scripts, "": tests}.items()}
    for name, content in scripts.items():
        others = set().union(*(found for other, found in words.items() if other != name))
        exported = re.findall(r"^export (?:async )?(?:function\*?|const|class) (\w+)", content, re.MULTILINE)
        assert set(exported) <= others, name


def test_copies_are_undone_by_the_page() -> None:
    draw = random.Random(1)
    pieces = [bytes(range(k, 200 + k)) for k in range(5)] + [b"ab" * 300, b"", b"x"]
    contents = [
        b"".join(
            draw.choice(pieces) if draw.random() < 0.7 else draw.randbytes(draw.randrange(60))
            for _ in range(draw.randrange(12))
        )
        for _ in range(200)
    ]
    script = merged("engine/shelf.js") + (
        f"console.log(JSON.stringify({json.dumps([(deltas(each).hex(), len(each)) for each in contents])}"
        '.map(([hex, size]) => Buffer.from(unpack(Buffer.from(hex, "hex"), size)).toString("hex"))));'
    )
    done = subprocess.run(["node"], input=script, check=True, capture_output=True, text=True)
    assert [bytes.fromhex(each) for each in json.loads(done.stdout)] == contents


def test_what_is_repeated_far_apart_is_packed_once() -> None:
    part, between = random.Random(1).randbytes(50_000), random.Random(2).randbytes(100_000)
    assert len(deltas(part + between + part)) < 151_000


def test_nothing_is_fetched_from_elsewhere() -> None:
    names = re.compile(rb"(?:https?:)?//[\w-]+\.\w+")
    own = {name: data for name, data in page_files().items() if not name.startswith("vendor/")}
    found = {name: names.findall(data) for name, data in own.items()}
    # The name of a language is an address that nobody fetches.
    assert {place for list_ in found.values() for place in list_} <= {b"http://www.w3"}


@pytest.mark.parametrize("name", sorted(name for name in page_files() if name.endswith(".js")))
def test_every_part_is_a_module_that_can_be_parsed(name: str, tmp_path: Path) -> None:
    if (program := shutil.which("node")) is None:
        return
    path = tmp_path / "part.mjs"
    path.write_bytes(page_files()[name])
    done = subprocess.run((program, "--check", path), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_script_of_workers_declares_no_name_twice() -> None:
    script = f"new Function({json.dumps(merged('engine/worker.js'))});"
    assert subprocess.run(["node", "--eval", script], check=False).returncode == 0


def test_the_widget_holds_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    without_modules(monkeypatch)
    hammer = load(CRUDE)
    made: Any = widget(hammer, state="rate=900", height="500px")
    assert ".uplot" in made.page
    assert (made.page, made.state, made.height) == (live_page(Shelf(hammer, only=True)), "rate=900", "500px")
