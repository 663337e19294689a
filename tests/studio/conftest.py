"""Fixtures for tests in a browser; tests are skipped with a reason if the browser is missing."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from tests.studio.browser import Page, browser, chromium
from tests.studio.firefox import Tab, firefox, opened

from printhammer.hammer.file import VIEWS
from printhammer.hammer.hammer import load
from printhammer.studio import Shelf, live_page
from printhammer.studio.bundle import page_files

NEEDS = {"opened_browser": ("Chromium", chromium), "opened_firefox": ("Firefox", firefox)}
"""Browsers by the fixture that starts them."""
HAMMERS = ("hendriks-1983-1", "hendriks-1983", "bouncing-ball", "duffing-holmes", "relay-5v")
"""Hammers of the page of the tests, the first of which is shown."""
WHOLE = f"#views={'-'.join(VIEWS)}"
"""Link to the page with all views."""
left_out: dict[str, int] = {}


def pytest_collection_modifyitems(config: pytest.Config, items: list[Any]) -> None:
    for fixture, (name, program) in NEEDS.items():
        if program() is not None:
            continue
        without = [item for item in items if fixture in getattr(item, "fixturenames", ())]
        left_out[name] = len(without)
        config.hook.pytest_deselected(items=without)
        items[:] = [item for item in items if item not in without]


def pytest_terminal_summary(terminalreporter: Any) -> None:
    for name, count in left_out.items():
        if count:
            terminalreporter.write_line(f"{count} tests in a browser left out: no {name} found")


@pytest.fixture(scope="session")
def address(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The page as a file, with a few hammers."""
    path = tmp_path_factory.mktemp("studio") / "page.html"
    path.write_text(live_page(Shelf(*map(load, HAMMERS), only=True)), "utf-8")
    return path.as_uri()


@pytest.fixture(scope="module")
def opened_browser() -> Iterator[Any]:
    with browser() as tab:
        yield tab


@pytest.fixture(scope="module")
def opened_firefox() -> Iterator[Tab]:
    with opened() as tab:
        yield tab


@contextmanager
def visited(address: str, opened_browser: Any) -> Iterator[Page]:
    """Open a page; check that the page requests only its own file."""
    opened = opened_browser()
    opened.size(1280, 720)
    opened.open(address)
    opened.wait("window.studio?.studio?.frames.map?.detail === 'full'")
    yield opened
    assert [place for place in opened.requests if not place.startswith(("blob:", "file:", "data:"))] == []
    opened.call("Page.close")


COMPLETE = """(({ busy, stale, frames, store: { state }, loaded, offered }) => {
  const { motion, map, dots } = frames;
  const isShown = (view) => !(view in motion.outdated) || frames[view]?.serial === motion.serial;
  return !busy && !stale && loaded === (state.text || state.hammer || offered[0])
    && dots?.serial === motion.serial && state.views.every(isShown)
    && (!state.views.includes("map") || map.detail === "full");
})(window.studio.studio)"""
"""Whether the state is shown, and its whole map where there is one."""
AGAIN = """(({ studio }) => {
  document.querySelector("dialog[open]")?.close();
  document.activeElement.blur();
  for (const part of document.querySelectorAll("details")) part.open = false;
  studio.notes = "";
  studio.store.begin(%s);
  studio.setCursor(0);
})(window.studio)"""
"""Sets the state with which a page opened, without a history."""


@pytest.fixture(scope="module")
def tabs(address: str, opened_browser: Any) -> Iterator[Callable[..., Page]]:
    """Pages by their links, opened once for all tests of a module; every test starts from the same state."""
    tabs: dict[str, tuple[Page, str]] = {}
    with ExitStack() as stack:

        def tab(link: str = "", width: int = 1280, height: int = 720) -> Page:
            if link not in tabs:
                opened = stack.enter_context(visited(f"{address}{link}", opened_browser))
                tabs[link] = opened, opened.run("JSON.stringify(window.studio.studio.store.state)")
            found, state = tabs[link]
            found.call("Page.bringToFront")
            found.size(width, height)
            found.complaints.clear()
            found.run(AGAIN % state)
            found.wait(COMPLETE)
            return found

        yield tab


@pytest.fixture
def page(tabs: Callable[..., Page]) -> Page:
    """The page as it opens, with four views."""
    return tabs()


@pytest.fixture
def fresh(opened_browser: Any) -> Iterator[Callable[..., Page]]:
    """Open pages for one test; check at its end that no page reported an error."""
    pages: list[Page] = []

    def fresh(address: str, width: int = 1280, height: int = 720, still: bool = True) -> Page:
        page: Page = opened_browser()
        pages.append(page)
        page.size(width, height, still=still)
        page.open(address)
        page.wait("window.studio?.studio?.frames.motion")
        return page

    yield fresh
    for page in pages:
        assert page.complaints == []
        page.call("Page.close")


@pytest.fixture
def whole_page(address: str, opened_browser: Any) -> Iterator[Page]:
    """The page with all views, opened for one test."""
    with visited(f"{address}{WHOLE}", opened_browser) as opened:
        yield opened


@pytest.fixture(scope="session")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the modules of the page, for Node."""
    root = tmp_path_factory.mktemp("web")
    (root / "package.json").write_text('{"type": "module"}', "utf-8")
    for name, content in page_files().items():
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).write_bytes(content)
    return root
