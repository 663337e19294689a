"""Tests in a browser: run where a Chromium is found; where none is, they are left out and that is said."""

from collections.abc import Iterator
from typing import Any

import pytest
from tests.studio.browser import Page, browser, chromium
from tests.studio.server import Studio, studio

NEEDS = "opened_browser"
left_out: list[str] = []


def pytest_collection_modifyitems(config: pytest.Config, items: list[Any]) -> None:
    if chromium() is not None:
        return
    without = [item for item in items if NEEDS in getattr(item, "fixturenames", ())]
    left_out.extend(item.nodeid for item in without)
    config.hook.pytest_deselected(items=without)
    items[:] = [item for item in items if item not in without]


def pytest_terminal_summary(terminalreporter: Any) -> None:
    if left_out:
        terminalreporter.write_line(f"{len(left_out)} tests in a browser left out: no Chromium found")


@pytest.fixture(scope="module")
def running() -> Iterator[Studio]:
    with studio() as started:
        yield started


@pytest.fixture(scope="module")
def opened_browser() -> Iterator[Any]:
    with browser() as tab:
        yield tab


@pytest.fixture
def page(running: Studio, opened_browser: Any) -> Iterator[Page]:
    opened = opened_browser()
    opened.size(1280, 720)
    opened.open(running.address)
    opened.wait("window.studio?.studio?.frames.map?.detail === 'full'")
    yield opened
    opened.call("Page.close")
