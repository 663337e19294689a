"""The page in Firefox, if installed: curves, slider, map, views, files; the same numbers as in Chromium."""

from collections.abc import Iterator
from typing import Any

import pytest
from tests.studio.firefox import Tab

pytestmark = pytest.mark.slow
STUDIO = "window.studio.studio"
SEEN = f"!{STUDIO}.busy && !{STUDIO}.stale"
NUMBERS = (
    f"[[...{STUDIO}.frames.motion.data.x], {STUDIO}.frames.dots.dots, [...{STUDIO}.frames.map.data.codes]]"
)
RIGHT = "\ue014"  # the right arrow in WebDriver


@pytest.fixture(scope="module")
def tab(address: str, opened_firefox: Tab) -> Iterator[Tab]:
    """The page on opening; the file itself is the only request, and no error is logged."""
    tab = opened_firefox
    tab.open(address, 1440, 900)
    tab.wait("window.studio?.studio?.frames.map?.detail === 'full'")
    yield tab
    assert tab.complaints == []
    assert [place for place in tab.requests if not place.startswith(("blob:", "file:", "data:"))] == []


def test_the_first_curves_and_the_map_are_there(tab: Tab) -> None:
    assert tab.run(f"{STUDIO}.frames.dots.dots.length") == 9
    assert tab.run("[...document.querySelectorAll('.panel')].filter((each) => !each.hidden).length") == 4
    # What is drawn has many colours; an empty canvas has one.
    colours = (
        "(() => { const canvas = document.querySelector('.view-map canvas');"
        " const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);"
        " return new Set(new Uint32Array(data.buffer)).size; })()"
    )
    assert tab.run(colours) > 100
    tab.wait("document.querySelector('.view-map .caption').textContent.includes('lost')")


def test_a_slider_and_the_map_move_the_curves(tab: Tab) -> None:
    before = tab.run(f"[...{STUDIO}.frames.motion.data.x]")
    box = tab.box("[data-key='forms thickness']")
    middle = box["y"] + box["height"] / 2
    tab.drag(*((box["x"] + part * box["width"], middle) for part in (0.5, 0.6, 0.7)))
    tab.wait(f"{STUDIO}.store.state.constants['pack.thickness'] > 0 && {SEEN}")
    assert tab.run(f"[...{STUDIO}.frames.motion.data.x]") != before
    tab.run("document.querySelector('[data-key=rate]').focus()")
    tab.press(RIGHT)
    tab.wait(f"{STUDIO}.store.state.rate > 1200 && {SEEN}")
    box = tab.box(".view-map canvas")
    tab.drag((box["x"] + 0.5 * box["width"], box["y"] + 0.25 * box["height"]))
    tab.wait(f"{STUDIO}.store.state.rate > 1400 && {SEEN}")
    fired = tab.run(f"{STUDIO}.frames.motion.fired")
    assert fired[1] - fired[0] == pytest.approx(1.0 / tab.run(f"{STUDIO}.store.state.rate"))
    for _ in range(3):
        tab.run("document.querySelector('.undo').click()")
    tab.wait(f"{STUDIO}.store.state.rate === 1200 && {SEEN}")
    tab.wait(f"{STUDIO}.frames.map.detail === 'full'")


def test_every_view_is_drawn_and_a_file_is_read(tab: Tab) -> None:
    views = ["motion", "sketch", "map", "forces", "phase", "strobe", "loops", "energy", "line"]
    tab.run(f"{STUDIO}.store.set({{ views: {views} }})")
    tab.wait(f"{STUDIO}.frames.strobe?.verdict && {STUDIO}.frames.line?.data.x")
    for view in views:
        assert tab.run(f"Object.keys({STUDIO}.views['{view}'].table()).length") > 0
    text = "time [us],displacement [um]\\n0,50\\n200,180\\n400,60\\n"
    tab.run(f"{STUDIO}.drop(new File(['{text}'], 'measured.csv'))")
    tab.wait("document.querySelector('.residual').textContent.startsWith('residual')")
    # The link holds all of it.
    tab.wait(f"location.hash.slice(1) === {STUDIO}.link()")
    tab.run(f"{STUDIO}.store.set({{ views: ['motion', 'sketch', 'map', 'line'], trace: null }})")
    tab.wait(SEEN)


def test_the_numbers_are_those_of_chromium(tab: Tab, page: Any) -> None:
    """Bit-identical, since the mathematical functions are part of the modules."""
    assert tab.run(NUMBERS) == page.run(NUMBERS)
