import io
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from tests.errors import refused

import printhammer as ph
from printhammer.drive.trains import Drive
from printhammer.figures import page as drawn
from printhammer.figures.page import (
    INK,
    PAPER,
    Sheet,
    coloured,
    inked,
    summary,
    whole_sheet,
    zoom_slots,
    zoomed_sheet,
)
from printhammer.printing.dots.strategy import open_loop
from printhammer.printing.page.page import Page, print_page
from printhammer.printing.page.pattern import Pattern

MM = 1e-3


@pytest.fixture(scope="module")
def page(hammer: ph.Hammer) -> Page:
    """A page of two lines with lost dots and extra contacts."""
    dots = np.random.default_rng(3).random((2, 9, 40)) < 0.45
    return print_page(hammer, Pattern("noise", dots), 1500.0)


def collection(figure: Figure, gid: str) -> list[EllipseCollection]:
    return [artist for axes in figure.axes for artist in axes.collections if artist.get_gid() == gid]


@given(
    x=st.floats(3.0, 7.0),
    y=st.floats(3.0, 7.0),
    density=st.floats(0.01, 3.0),
    diameter=st.floats(0.5, 4.0),
)
def test_a_dot_holds_its_ink_and_lies_where_it_should(
    x: float, y: float, density: float, diameter: float
) -> None:
    pixel = 0.02 * MM
    sheet = Sheet(0.0, 10 * MM, 0.0, 10 * MM)
    found = inked(
        sheet, *(np.array([value * MM]) for value in (x, y)), np.array([density]), diameter * MM, pixel
    )
    assert found.shape == (500, 500)
    assert found.max() == pytest.approx(density)
    # A rim that is soft evenly to both sides adds next to nothing.
    total = density * math.pi / 4 * diameter**2
    assert found.sum() * (pixel / MM) ** 2 == pytest.approx(total, rel=0.02)
    middles = (np.arange(500) + 0.5) * pixel / MM
    assert found.sum(axis=0) @ middles / found.sum() == pytest.approx(x, abs=2e-3)
    assert found.sum(axis=1) @ middles / found.sum() == pytest.approx(y, abs=2e-3)


def test_densities_add_and_what_is_off_the_sheet_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    sheet = Sheet(0.0, 4 * MM, 0.0, 2 * MM)
    rng = np.random.default_rng(1)
    across, down = rng.uniform(-MM, 5 * MM, 200), rng.uniform(-MM, 3 * MM, 200)
    density = rng.uniform(0.0, 1.0, 200)
    whole = inked(sheet, across, down, density, 0.35 * MM, 0.02 * MM)
    ones = sum(
        inked(sheet, across[[n]], down[[n]], density[[n]], 0.35 * MM, 0.02 * MM) for n in range(len(density))
    )
    np.testing.assert_allclose(whole, ones, atol=1e-12)
    # The part of a larger sheet is the same picture.
    wide = inked(Sheet(-2 * MM, 6 * MM, -2 * MM, 4 * MM), across, down, density, 0.35 * MM, 0.02 * MM)
    np.testing.assert_allclose(wide[100:200, 100:300], whole, atol=1e-9)
    far = inked(sheet, across + 1.0, down, density, 0.35 * MM, 0.02 * MM)
    assert not far.any()
    monkeypatch.setattr(drawn, "_TOGETHER", 1)
    np.testing.assert_allclose(inked(sheet, across, down, density, 0.35 * MM, 0.02 * MM), whole, atol=1e-12)


def test_a_large_sheet_is_drawn_more_coarsely() -> None:
    size, rows, columns = Sheet(0.0, 10.0, 0.0, 10.0).pixels(1e-6)
    assert rows * columns <= 1.01 * drawn.MOST_PIXELS
    assert rows * size == pytest.approx(10.0, rel=1e-3)


def test_ink_lets_light_through_by_its_density() -> None:
    picture = coloured(np.array([[0.0, 0.30103, 1.0, 9.0]]))
    shares = (picture[0].astype(float) - INK) / (np.array(PAPER) - INK)
    np.testing.assert_allclose(shares, np.array([1.0, 0.5, 0.1, 0.0])[:, np.newaxis] * np.ones(3), atol=4e-3)


def test_the_page_shows_every_dot_and_every_lost_one(page: Page) -> None:
    figure = page.plot()
    assert page.lost.any()
    (off,) = collection(figure, "placement error")
    assert len(off.get_offsets()) == page.printed.sum()
    np.testing.assert_allclose(off.get_array(), page.placement_error[page.printed] * 1e6)
    np.testing.assert_allclose(off.get_offsets()[:, 0], page.places[0][page.printed])
    (crosses,) = [line for axes in figure.axes for line in axes.lines if line.get_gid() == "lost"]
    assert len(crosses.get_xdata()) == page.lost.sum()
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert any(title.startswith("Printed at 1500 Hz, open loop") for title in titles)
    assert {"Wanted", "Difference"} <= set(titles)
    assert any("Region of largest error: print line" in title for title in titles)
    assert any(summary(page) == text.get_text() for text in figure.texts)
    # A page may look perfect with most dots out of limits.
    assert page.good.sum() < page.printed.sum()
    assert f"{page.good.sum()} within limits" in summary(page)


def test_the_printed_picture_is_darker_where_dots_are(page: Page) -> None:
    figure = page.plot()
    printed, wanted = (figure.axes[number].images[0].get_array().astype(int) for number in (0, 1))
    assert printed.shape == wanted.shape
    # Lost and light dots leave more light.
    assert printed.sum() > wanted.sum()
    sheet = whole_sheet(page)
    size, _rows, _columns = sheet.pixels(page.head.pitch / 10)
    across, down = page.intended
    for dot in np.flatnonzero(page.lost)[:5]:
        row, column = int((down[dot] - sheet.top) / size), int((across[dot] - sheet.left) / size)
        assert wanted[row, column, 0] < 60
        assert printed[row, column, 0] > wanted[row, column, 0]


def test_the_worst_place_has_rings_where_dots_are_wanted(page: Page) -> None:
    figure = page.plot(view="zoom")
    line, first = page.worst_place(zoom_slots(page))
    sheet = zoomed_sheet(page)
    inside = (page.line == line) & (page.slot >= first) & (page.slot < first + zoom_slots(page))
    (rings,) = collection(figure, "wanted")
    (lost,) = collection(figure, "lost")
    assert len(rings.get_offsets()) >= (inside & page.printed).sum()
    assert len(lost.get_offsets()) >= (inside & page.lost).sum() > 0
    assert sheet.left < first * page.head.pitch < sheet.right


def test_the_sheet_has_its_true_size(page: Page) -> None:
    figure = page.plot(view="sheet")
    sheet = whole_sheet(page)
    np.testing.assert_allclose(figure.get_size_inches(), [sheet.width / 25.4e-3, sheet.height / 25.4e-3])


@pytest.mark.parametrize("wires", [9, 24])
def test_short_and_long_pages_are_drawn(hammer: ph.Hammer, wires: int) -> None:
    for text in (".", "many lines\n" * 5):
        figure = print_page(hammer, Pattern.from_text(text, wires), 900.0).plot()
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=40)
        assert buffer.getvalue().startswith(b"\x89PNG")


def test_a_view_that_is_none_is_refused(page: Page) -> None:
    with refused("view"):
        page.plot(view="back")


def test_a_page_on_which_nothing_is_printed_is_drawn(hammer: ph.Hammer) -> None:
    def weak(driven: ph.Hammer, patterns: Any, rate: float) -> list[Drive]:
        return [drive.scaled(0.1) for drive in open_loop(driven, patterns, rate)]

    found = print_page(hammer, "Hi", 1000.0, strategy=weak)
    assert found.lost.all()
    assert "26 lost" in summary(found)
    for view in ("page", "zoom"):
        figure = found.plot(view=view)
        paper = figure.axes[0].images[0].get_array()
        assert (paper == np.array(PAPER)).all()
