"""The verb `studio`: it writes the page and opens it; invalid input is rejected."""

import json
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.hammers import CRUDE
from tests.studio.reading import without_modules

import printhammer as ph
from printhammer.cli import runner
from printhammer.kernel.compile.modules import WebModule
from printhammer.studio import launch, live


@pytest.fixture
def opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Pages opened in the browser; they are written to the folder of the test."""
    without_modules(monkeypatch)
    found: list[str] = []
    monkeypatch.setattr(webbrowser, "open", found.append)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(launch, "_cache", lambda: tmp_path / "cache")
    return found


def start_of(page: str) -> Any:
    return json.loads(page.partition('id="start">')[2].partition("</script>")[0])


def test_the_page_is_written_and_opened(opened: list[str], cli: Callable) -> None:
    done = cli("studio", CRUDE, "--only", "--state", "rate=900&line=<b>")
    assert done.status == 0
    path = Path(done.out.strip().removeprefix("The studio is the page "))
    assert opened == [path.as_uri()]
    assert start_of(path.read_text("utf-8")) == {"text": "rate=900&line=<b>"}
    assert cli("studio", CRUDE, "--only", "--no-open").status == 0
    assert len(opened) == 1
    assert len(list(path.parent.iterdir())) == 2


def test_the_compilation_of_a_module_is_announced(
    opened: list[str], cli: Callable, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said: list[str] = []
    monkeypatch.setattr(runner, "say", said.append)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    module = WebModule("no sources", lambda: b"\0asm", "a law that no shipped hammer has")
    monkeypatch.setattr(live, "page_module", lambda _laws: module)
    assert cli("studio", CRUDE, "--only", "--no-open").status == 0
    (sentence,) = [each for each in said if "a law that no shipped hammer has" in each]
    assert sentence.startswith("compiling WebAssembly")
    assert opened == []


def test_a_page_is_written_to_be_sent_around(opened: list[str], cli: Callable, tmp_path: Path) -> None:
    state = tmp_path / "state.json"
    text = ph.load(CRUDE).replace("name", "mine").to_toml()
    content = {"kind": launch.KIND, "format": launch.FORMAT, "state": {"text": text, "rate": 777.0}}
    state.write_text(json.dumps(content), "utf-8")
    out = tmp_path / "page.html"
    assert cli("studio", "tung-shaw-1988", "--only", "--state", state, "--out", out).status == 0
    assert start_of(out.read_text("utf-8"))["state"] == {"text": "", "rate": 777.0, "hammer": "mine"}
    assert opened == []
    assert cli("studio", "--out", out).status == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("no-such",), "no-such"),
        (("--state", "no-such.json"), "no-such.json"),
        (("--state", str(CRUDE)), "expected a state file"),
        (("--out", "page.png"), "--out page.png: expected a name"),
        (("--port", "80"), "--port"),
    ],
)
def test_what_it_cannot_use_is_refused(
    opened: list[str], refused: Callable, words: tuple[str, ...], said: str
) -> None:
    refused("studio", *words, said=said)
    assert opened == []
