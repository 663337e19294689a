"""The opening page: actuator above its curve and its dots, stories, and the tour."""

from collections.abc import Callable

import pytest
from tests.studio.browser import Page

from printhammer.hammer.file import VIEWS

pytestmark = pytest.mark.slow

STATE = "window.studio.studio.store.state"
SEEN = "!window.studio.studio.busy && !window.studio.studio.stale"
LATEST = "window.studio.studio.frames.dots.serial === Math.max(...window.studio.studio.sentAt.keys())"
"""The dots are those of the state that was sent last; questions have numbers of their own."""


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


def test_every_view_is_enlarged_and_made_small_again(page: Page) -> None:
    for view in ("motion", "map", "sketch"):
        small = page.box(f".view-{view}")
        page.run(f"document.querySelector('.view-{view} .enlarge').click()")
        large = page.box(f".view-{view}")
        assert large["width"] > 900
        assert large["height"] > 500
        page.run(f"document.querySelector('.view-{view} .enlarge').click()")
        assert page.box(f".view-{view}") == small


def test_it_moves_at_first_unless_motion_is_not_wanted(address: str, fresh: Callable[..., Page]) -> None:
    page = fresh(address)
    page.run("new Promise((done) => setTimeout(done, 400))")
    assert page.run("window.studio.studio.cursor") == 0
    page = fresh(address, still=False)
    page.wait("window.studio.studio.cursor > 2e-4")
    page.run(
        "document.querySelector('.undo').dispatchEvent(new PointerEvent('pointerdown', { bubbles: true }))"
    )
    held = page.run("window.studio.studio.cursor")
    page.run("new Promise((done) => setTimeout(done, 200))")
    assert page.run("window.studio.studio.cursor") == pytest.approx(held, abs=1e-4)


def test_the_stories_show_what_they_tell(address: str, fresh: Callable[..., Page]) -> None:
    """With the hammer of the paper; each story is one click away, and its text is correct."""
    page = fresh(address, 1440, 900)
    page.wait("window.studio.studio.frames.dots")
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
