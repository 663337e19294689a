"""The opening: what moves above its curve above what it prints, stories one click away, a tour."""

from typing import Any

import pytest
from tests.studio.browser import Page

from printhammer.hammer.file import VIEWS

STATE = "window.studio.studio.store.state"
SEEN = "!window.studio.studio.busy && !window.studio.studio.stale"
LATEST = "window.studio.studio.frames.dots.serial === Math.max(...window.studio.studio.sentAt.keys())"
"""The dots are those of the state that was sent last; questions have numbers of their own."""


@pytest.mark.slow
def test_the_map_takes_half_beside_the_column_of_the_opening(page: Page) -> None:
    for size in ((1280, 720), (1440, 900), (1920, 1080)):
        page.size(*size)
        page.wait(f"innerWidth === {size[0]}")
        sketch, motion, line, other = (
            page.box(f".view-{view}") for view in ("sketch", "motion", "line", "map")
        )
        assert sketch["x"] == motion["x"] == line["x"]
        assert sketch["y"] < motion["y"] < line["y"]
        assert other["x"] < sketch["x"]
        assert motion["width"] < other["width"] < 1.3 * motion["width"]
        assert other["height"] > 0.8 * size[1]
        assert motion["height"] >= sketch["height"]


@pytest.mark.slow
def test_every_view_is_enlarged_and_made_small_again(page: Page) -> None:
    for view in ("motion", "map", "sketch"):
        small = page.box(f".view-{view}")
        page.run(f"document.querySelector('.view-{view} .enlarge').click()")
        large = page.box(f".view-{view}")
        assert large["width"] > 900
        assert large["height"] > 500
        page.run(f"document.querySelector('.view-{view} .enlarge').click()")
        assert page.box(f".view-{view}") == small


@pytest.mark.slow
def test_it_moves_at_first_unless_motion_is_not_wanted(opened_browser: Any, address: str) -> None:
    for still in (True, False):
        page = opened_browser()
        page.size(1280, 720, still=still)
        page.open(address)
        page.wait("window.studio?.studio?.frames.dots")
        if still:
            page.run("new Promise((done) => setTimeout(done, 400))")
            assert page.run("window.studio.studio.cursor") == 0
        else:
            page.wait("window.studio.studio.cursor > 2e-4")
            page.run(
                "document.querySelector('.undo')"
                ".dispatchEvent(new PointerEvent('pointerdown', { bubbles: true }))"
            )
            held = page.run("window.studio.studio.cursor")
            page.run("new Promise((done) => setTimeout(done, 200))")
            assert page.run("window.studio.studio.cursor") == pytest.approx(held, abs=1e-4)
        assert page.complaints == []
        page.call("Page.close")


@pytest.mark.slow
def test_the_stories_show_what_they_tell(opened_browser: Any, address: str) -> None:
    """With the hammer of the paper; each is one click away, and what its text says is so."""
    page = opened_browser()
    page.size(1440, 900)
    page.open(address)
    page.wait("window.studio?.studio?.frames.dots")
    struck = "window.studio.studio.frames.dots.dots.map((dot) => dot.struck)"
    force = "window.studio.studio.frames.dots.dots.map((dot) => dot.peak_force ?? 0)"

    def open_story(name: str) -> None:
        page.run(
            f"[...document.querySelectorAll('.story')].find((each) => each.textContent === '{name}').click()"
        )
        page.wait(SEEN)
        page.wait(LATEST)
        assert name in page.run("document.querySelector('.notice').textContent")

    open_story("One dot")
    assert page.run(struck) == [True]
    single = page.run(force)[0]
    open_story("660 or 700 µs")
    assert page.run(struck) == [True, False]
    page.run("[...document.querySelectorAll('.switch')][1].click()")
    page.wait(f"Math.abs(1 / {STATE}.rate - 700e-6) < 1e-12")
    page.wait(SEEN)
    page.wait(LATEST)
    assert page.run(struck) == [True, True]
    assert page.run(force)[1] > page.run(force)[0]
    open_story("Buzz printing")
    assert all(page.run(struck))
    assert all(0.3 < each / single < 0.5 for each in page.run(force)[4:])
    open_story("The second dot lost")
    assert page.run(struck)[:3] == [True, False, True]
    page.wait("window.studio.studio.frames.map.detail === 'full'")
    page.wait("window.studio.studio.views.map.lost().first")
    lost = page.run(
        "(() => { const { list } = window.studio.studio.views.map.lost(); return list.length; })()"
    )
    assert lost > 100
    open_story("Hung up")
    low = page.run(
        "(() => { const { data, places, fired } = window.studio.studio.frames.motion; let low = 1;"
        " data.t.forEach((t, k) => { if (t > 6e-4 && t < fired.at(-1))"
        " low = Math.min(low, data.x[k]); });"
        " return low - places.backstop; })()"
    )
    assert low > 0.0
    open_story("A strange train")
    page.wait("window.studio.studio.frames.strobe?.verdict?.verdict === 'strange'")
    page.wait("document.querySelector('.view-strobe .caption').textContent.includes('never repeats itself')")
    page.run("document.querySelector('.notice .shut').click()")
    assert not page.run("document.querySelector('.notice').checkVisibility()")
    page.run("document.querySelector('.undo').click()")
    assert page.run(f"{STATE}.rate") == 2200
    assert page.complaints == []
    page.call("Page.close")


@pytest.mark.slow
def test_a_tour_marks_what_it_tells(page: Page) -> None:
    page.run("document.querySelector('.tour').click()")
    for step in range(1, 10):
        assert f"{step} of 9" in page.run("document.querySelector('.coach').textContent")
        assert page.run("document.querySelectorAll('.marked').length") == 1
        assert page.run("document.querySelector('.marked').checkVisibility()")
        page.run("document.querySelector('.coach .next').click()")
    assert not page.run("document.querySelector('.coach').checkVisibility()")
    assert page.run("document.querySelectorAll('.marked').length") == 0
    assert page.complaints == []


@pytest.mark.slow
def test_pictures_tell_their_result_to_those_who_do_not_see_them(page: Page) -> None:
    page.run(f"window.studio.studio.store.set({{ views: {list(VIEWS)} }}); 1")
    page.wait("[...document.querySelectorAll('.caption')].every((each) => each.textContent)")
    said = page.run(
        "Object.fromEntries([...document.querySelectorAll('.panel')].map((panel) => [panel.classList[1],"
        " panel.querySelector('[role=img]')?.ariaLabel ?? panel.querySelector('canvas').ariaDescription]))"
    )
    assert "Nine dots" in said["view-motion"]
    assert "N at the backstop" in said["view-forces"]
    assert "lost" in said["view-map"]
    assert all(len(text) > 30 for text in said.values()), said


def click(page: Page, selector: str) -> None:
    """Click in the middle of an element with the mouse."""
    box = page.box(selector)
    page.drag((box["x"] + box["width"] / 2, box["y"] + box["height"] / 2))


@pytest.mark.slow
def test_figure_6_takes_two_clicks_and_the_lost_dot_two(opened_browser: Any, address: str) -> None:
    """By the mouse alone, from an empty page."""
    page = opened_browser()
    page.size(1440, 900)
    page.open(address)
    page.wait("window.studio?.studio?.frames.map?.detail === 'full'")
    struck = "window.studio.studio.frames.dots?.dots.map((dot) => Number(dot.struck)).join('')"
    click(page, ".story:nth-of-type(2)")
    page.wait(f"{struck} === '10'")
    click(page, ".notice .switch:nth-of-type(2)")
    page.wait(f"{struck} === '11'")
    click(page, ".notice .shut")
    click(page, ".more > summary")
    click(page, ".find-lost")
    page.wait(f"{struck}?.slice(0, 3) === '101'")
    assert page.run(f"{STATE}.rate") == pytest.approx(1473, rel=3e-3)
    assert page.complaints == []
    page.call("Page.close")
