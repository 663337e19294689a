"""The opening page: actuator above its curve and its dots, stories, and the tour."""

from collections.abc import Callable

import pytest
from tests.studio.browser import Page

from printhammer.hammer.file import VIEWS

pytestmark = pytest.mark.slow


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


def test_a_tour_of_a_ball_tells_of_no_armature(page: Page) -> None:
    page.run("window.studio.studio.choose('bouncing-ball').then(() => 1)")
    page.wait("window.studio.studio.loaded === 'bouncing-ball' && !window.studio.studio.busy")
    page.run("document.querySelector('.tour').click()")
    told = []
    for _ in range(8):
        told.append(page.run("document.querySelector('.coach').textContent"))
        page.run("document.querySelector('.coach .next').click()")
    assert not page.run("document.querySelector('.coach').checkVisibility()")
    assert "The ball" in told[0]
    for word in ("armature", "coil", "dot", "backstop", "printed"):
        assert not any(word in text for text in told), word
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
