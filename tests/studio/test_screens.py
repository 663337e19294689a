"""The page on common screens: pixel ratios, small windows, zoom."""

import io
import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.studio.browser import HELPERS, Page
from tests.studio.conftest import COMPLETE, WHOLE

from printhammer.hammer.file import VIEWS

pytestmark = pytest.mark.slow

RATIOS = (1.0, 1.25, 1.5, 2.0)
SIZES = ((1440, 900), (1280, 720), (1024, 768), (670, 900), (390, 844))
DRAWN = "new Promise((done) => setTimeout(() => requestAnimationFrame(done), 280))"
"""Waits until a new size is drawn, and captions are written."""


@pytest.fixture
def page(tabs: Callable[..., Page]) -> Page:
    return tabs(WHOLE)


def resized(page: Page, width: int, height: int, ratio: float) -> None:
    page.size(width, height, ratio=ratio)
    page.wait(f"innerWidth === {width} && devicePixelRatio === {ratio}")
    page.run(DRAWN)


def pixels(page: Page, path: Path, selector: str) -> Any:
    """Return the image of an element as grey levels on a grid that is independent of the pixel ratio."""
    import numpy as np
    from PIL import Image

    page.picture(path, selector)
    with Image.open(io.BytesIO(path.read_bytes())) as picture:
        return np.asarray(picture.convert("L").resize((48, 36), Image.Resampling.BOX), dtype=float)


@pytest.mark.parametrize("ratio", RATIOS)
def test_nothing_is_cut_or_overlaps(page: Page, tmp_path: Path, ratio: float) -> None:
    """At every size, with all controls and a story open; a window of 1440 px at 200 % zoom has 720 px."""
    page.run(HELPERS)
    for width, height in (*SIZES, (720, 450)):
        resized(page, width, height, ratio)
        page.picture(tmp_path / f"{width}.png")
        assert page.run("helpers.misfits()") == [], (width, ratio)
        assert page.run("helpers.drawn()") == [], (width, ratio)
    for story in range(6):
        page.run(f"document.querySelectorAll('.story')[{story}].click()")
        page.wait(COMPLETE)
        page.run(DRAWN)
        assert page.run("helpers.drawn()") == [], (story, ratio)
    page.run("for (const part of document.querySelectorAll('details')) part.open = true")
    for width, height in ((1440, 900), (720, 450)):
        resized(page, width, height, ratio)
        page.run("document.querySelector('.side').classList.add('open')")
        assert page.run("helpers.misfits()") == [], (width, ratio)
    page.run("document.querySelector('.side').classList.remove('open')")
    page.run("document.querySelector('.notice .shut').click()")
    assert page.complaints == []


def test_a_picture_is_the_same_at_every_pixel_ratio(page: Page, tmp_path: Path) -> None:
    import numpy as np

    for view in ("motion", "forces", "map", "phase", "line"):
        seen = []
        for ratio in RATIOS:
            resized(page, 1440, 900, ratio)
            seen.append(pixels(page, tmp_path / f"{view}-{ratio}.png", f".view-{view}"))
        assert seen[0].std() > 5.0
        for other in seen[1:]:
            assert np.abs(other - seen[0]).mean() < 4.0, view


@pytest.mark.parametrize("width", [1024, 670, 390])
def test_views_stack_on_small_screens(page: Page, width: int) -> None:
    resized(page, width, 800, 1.0)
    boxes = page.run(
        "[...document.querySelectorAll('.panel')].filter((panel) => panel.checkVisibility())"
        ".map((panel) => panel.getBoundingClientRect().toJSON())"
    )
    assert {box["left"] for box in boxes} == {boxes[0]["left"]}
    assert all(box["width"] > 0.65 * width for box in boxes)
    tops = sorted((box["top"], box["bottom"]) for box in boxes)
    assert all(upper[1] <= lower[0] for upper, lower in itertools.pairwise(tops))
    assert len(boxes) == len(VIEWS)
    assert page.run("document.documentElement.scrollHeight > 2000")


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1920, 1080), (2560, 1080)])
def test_everything_fits_on_the_screen(page: Page, width: int, height: int) -> None:
    page.size(width, height)
    page.wait(f"innerWidth === {width}")
    size = page.run("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
    assert size == [width, height]
    for view in VIEWS:
        box = page.box(f".view-{view}")
        assert box["width"] > 250, view
        assert box["height"] > 180, view
        assert box["x"] + box["width"] <= width
        assert box["y"] + box["height"] <= height


def test_controls_are_a_sheet_on_a_phone(page: Page) -> None:
    resized(page, 390, 844, 2.0)
    assert not page.run("document.querySelector('[data-key=rate]').checkVisibility()")
    page.run("document.querySelector('.sheet').click()")
    box = page.box("[data-key=rate]")
    assert box["width"] >= 150
    assert 400 < box["y"] < 844
    assert page.run("document.querySelector('.sheet').getAttribute('aria-expanded')") == "true"
    page.run("document.querySelector('.sheet').click()")


def test_forced_colours_leave_everything_to_be_seen(page: Page, tmp_path: Path) -> None:
    """With forced colours, curves and pressed buttons remain distinct from their background."""
    page.prefer(
        {"forced-colors": "active", "prefers-color-scheme": "dark", "prefers-reduced-motion": "reduce"}
    )
    page.run(HELPERS)
    page.run(DRAWN)
    page.picture(tmp_path / "forced.png")
    for view in ("motion", "forces", "phase", "map", "line"):
        assert page.run(f"helpers.inked({view!r})") > 3, view
    colours = (
        "((each) => { const style = getComputedStyle(each); return [style.backgroundColor, style.color]; })"
    )
    pressed, other = (
        page.run(f"{colours}(document.querySelector('{selector}'))")
        for selector in (".chooser [aria-pressed=true]", ".pin")
    )
    assert pressed != other
    assert pressed[0] != pressed[1]
    assert page.complaints == []
