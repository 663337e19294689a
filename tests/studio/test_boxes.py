"""Input boxes and sliders of the controls: displayed values, and messages about rejected input."""

import json
import subprocess

import pytest
from tests.studio.browser import HELPERS, Page

from printhammer.studio.bundle import merged
from printhammer.units import to_si

CTRL, SHIFT = 2, 8
STATE = "window.studio.studio.store.state"
RATE = "[data-number=rate]"


def typed(page: Page, selector: str, text: str, enter: bool = True) -> None:
    """Type into a box like a user, and press Enter."""
    page.run(f"document.querySelector({json.dumps(selector)}).focus()")
    page.run(f"document.querySelector({json.dumps(selector)}).select()")
    page.call("Input.insertText", text=text)
    if enter:
        for kind in ("keyDown", "keyUp"):
            page.call("Input.dispatchKeyEvent", type=kind, key="Enter", text="\r", windowsVirtualKeyCode=13)


def box(page: Page, selector: str = RATE) -> str:
    return page.run(f"document.querySelector({json.dumps(selector)}).value")


def problem(page: Page, selector: str = RATE) -> str:
    """Return the sentence below a box, if visible."""
    return page.run(
        f"(() => {{ const said = document.querySelector({json.dumps(selector)}).closest('.row')"
        ".querySelector('.problem'); return said.checkVisibility() ? said.textContent : ''; })()"
    )


@pytest.mark.slow
def test_a_number_out_of_range_becomes_the_nearest_end_and_that_is_said(page: Page) -> None:
    typed(page, RATE, "9000")
    assert page.run(f"{STATE}.rate") == 5000
    assert box(page) == "5000"
    assert "9000 Hz" in problem(page)
    assert "50 Hz to 5000 Hz" in problem(page)
    typed(page, RATE, "1300")
    assert (box(page), problem(page)) == ("1300", "")
    typed(page, "[data-number=pulses]", "3.4")
    assert page.run(f"{STATE}.pulses") == 3
    assert "whole" in problem(page, "[data-number=pulses]")


@pytest.mark.slow
@pytest.mark.parametrize("text", ["abc", "1/0", "3 V", "2+", "((((", "660us", " ", "__proto__", "1e999"])
def test_what_is_no_rate_is_said_and_changes_nothing(page: Page, text: str) -> None:
    typed(page, RATE, text)
    assert page.run(f"{STATE}.rate") == 1200
    assert box(page) == "1200"
    assert "was not taken" in problem(page)
    assert "50 Hz to 5000 Hz" in problem(page)
    assert page.run(f"document.querySelector({json.dumps(RATE)}).getAttribute('aria-invalid')") == "true"
    assert page.complaints == []


@pytest.mark.slow
def test_undo_reaches_a_box_in_use(page: Page) -> None:
    page.run("for (const part of document.querySelectorAll('details')) part.open = true")
    typed(page, RATE, "1500")
    assert page.run(f"{STATE}.rate") == 1500
    page.press("z", "KeyZ", CTRL)
    page.wait(f"{STATE}.rate === 1200")
    assert box(page) == "1200"
    page.press("z", "KeyZ", CTRL | SHIFT)
    page.wait(f"{STATE}.rate === 1500")
    assert box(page) == "1500"
    page.run("document.querySelector('#control-pattern').focus()")
    page.call("Input.insertText", text="101")
    page.wait(f"{STATE}.pattern === '101'")
    page.press("z", "KeyZ", CTRL)
    page.wait(f"{STATE}.pattern === ''")
    assert box(page, "#control-pattern") == ""
    # What is typed and not taken yet stays until it is taken or left.
    typed(page, RATE, "17", enter=False)
    page.run("window.studio.studio.store.set({ pulses: 4 })")
    assert box(page) == "17"


@pytest.mark.slow
def test_a_pattern_that_is_none_is_said(page: Page) -> None:
    page.run("for (const part of document.querySelectorAll('details')) part.open = true")
    typed(page, "#control-pattern", "10x1", enter=False)
    assert page.run(f"{STATE}.pattern") == ""
    assert "10x1" in problem(page, "#control-pattern")
    assert page.run("document.querySelector('#control-pattern').getAttribute('aria-invalid')") == "true"
    typed(page, "#control-pattern", "1" * 70, enter=False)
    assert page.run(f"{STATE}.pattern") == ""
    assert "at most 64" in problem(page, "#control-pattern")


@pytest.mark.slow
def test_boxes_take_units_and_arithmetic(page: Page) -> None:
    for text, rate in (
        ("1/660us", 1e6 / 660),
        ("1.5 kHz", 1500),
        ("2*600", 1200),
        ("1/(0,5ms+0.2 ms)", 1e4 / 7),
    ):
        typed(page, RATE, text)
        assert page.run(f"{STATE}.rate") == pytest.approx(rate, rel=1e-5), text
        assert problem(page) == ""
    typed(page, "[data-number='forms thickness']", "8 mil")
    assert page.run(f"{STATE}.constants['pack.thickness']") == pytest.approx(8 * 25.4e-6)
    typed(page, "[data-number='waveform.width']", "0.2 ms")
    assert page.run(f"{STATE}.waveform.width") == pytest.approx(2e-4)


def test_the_units_of_boxes_are_those_of_the_program() -> None:
    """A unit that both the unit table and a box accept has the same size in both."""
    known = {
        "m": "m mm um in mil",
        "s": "s ms us",
        "N": "N lbf",
        "kg": "kg g oz lb",
        "Pa": "Pa GPa ksi psi",
        "Hz": "Hz kHz",
        "J": "J mJ",
        "A": "A mA",
        "N/m": "N/m N/mm lbf/in",
    }
    pairs = [(unit, si) for si, units in known.items() for unit in units.split()]
    script = merged("quantity.js") + (
        f"console.log(JSON.stringify({json.dumps(pairs)}.map(([unit, si]) =>"
        " readQuantity(`2 ${unit}`, si, { name: si, factor: 1 }).value)))"
    )
    done = subprocess.run(["node"], input=script, check=True, capture_output=True, text=True)
    for (unit, si), value in zip(pairs, json.loads(done.stdout), strict=True):
        assert value == pytest.approx(to_si(2.0, unit, si), rel=1e-12), unit


@pytest.mark.slow
def test_sliders_are_wide_fine_with_shift_and_wheel_and_reset_by_a_double_click(page: Page) -> None:
    slider = "[data-key=rate]"
    widths = page.run(
        "[...document.querySelectorAll('.controls input[type=range]')]"
        ".filter((each) => each.checkVisibility()).map((each) => each.getBoundingClientRect().width)"
    )
    assert min(widths) >= 150
    page.run(f"document.querySelector('{slider}').focus()")
    page.press("ArrowRight")
    page.wait(f"{STATE}.rate > 1200")
    coarse = page.run(f"{STATE}.rate") - 1200
    page.press("ArrowLeft")
    before = page.run(f"{STATE}.rate")
    page.press("ArrowRight", modifiers=SHIFT)
    page.wait(f"{STATE}.rate > {before}")
    assert page.run(f"{STATE}.rate") - before == pytest.approx(0.1 * coarse, rel=0.2)

    place = page.box(slider)
    x, y = place["x"] + 20, place["y"] + place["height"] / 2
    before = page.run(f"{STATE}.rate")
    page.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-100)
    page.wait(f"{STATE}.rate > {before}")
    assert page.run(f"{STATE}.rate") < 1.1 * before

    for count in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            page.mouse(kind, x, y, clickCount=count)
    page.wait(f"{STATE}.rate === 1200")
    assert page.complaints == []


@pytest.mark.slow
def test_a_drag_with_shift_is_ten_times_as_fine(page: Page) -> None:
    place = page.box("[data-key=rate]")
    x, y = place["x"] + 30, place["y"] + place["height"] / 2
    for kind, at in (("mousePressed", x), ("mouseMoved", x + 40), ("mouseReleased", x + 40)):
        page.mouse(kind, at, y, modifiers=SHIFT)
    whole = page.run("Math.log(5000 / 50)")
    moved = page.run(f"Math.log({STATE}.rate / 1200)")
    assert moved == pytest.approx(0.1 * 40 / place["width"] * whole, rel=0.05)


@pytest.mark.slow
def test_controls_are_searched_and_state_their_range(page: Page) -> None:
    page.run("document.querySelector('.grid').focus()")
    page.press("/", "Slash")
    assert page.run("document.activeElement.className") == "search"
    page.call("Input.insertText", text="stiffness")
    seen = page.run(
        "[...document.querySelectorAll('[data-number]')].filter((each) => each.checkVisibility())"
        ".map((each) => each.dataset.number)"
    )
    assert "pack.stiffness" in seen
    assert "rate" not in seen
    page.press("Escape")
    assert page.run("document.querySelector('[data-number=rate]').checkVisibility()")
    ends = page.run(
        "[...document.querySelector('[data-key=rate]').closest('.row').querySelectorAll('.end')]"
        ".map((end) => end.textContent)"
    )
    assert ends == ["50", "5000"]


@pytest.mark.slow
def test_undo_knows_its_limits(page: Page) -> None:
    undo = "document.querySelector('.undo').getAttribute('aria-disabled')"
    assert page.run(undo) == "true"
    page.run("window.studio.studio.store.set({ rate: 1300 })")
    assert page.run(undo) == "false"
    page.run("document.querySelector('.undo').click()")
    assert page.run(undo) == "true"
    page.wait("!window.studio.studio.busy && !window.studio.studio.stale")
    page.run("document.querySelector('.undo').click()")
    assert "200 steps" in page.run("document.querySelector('.status').textContent")


@pytest.mark.slow
def test_targets_are_at_least_24_pixels(page: Page) -> None:
    page.run("for (const part of document.querySelectorAll('details')) part.open = true")
    small = page.run(
        "[...document.querySelectorAll('.studio button, .studio select, .studio input, .studio summary')]"
        ".filter((each) => each.checkVisibility()).map((each) => [each.outerHTML.slice(0, 80),"
        " each.getBoundingClientRect()]).filter(([, box]) => box.width < 24 || box.height < 24)"
        ".map(([text]) => text)"
    )
    assert small == []


@pytest.mark.slow
def test_forces_hold_their_total(page: Page) -> None:
    ends = page.run(
        "(() => { const { data } = window.studio.studio.frames.motion; const total = data['F total'];"
        " return [Math.min(...total), Math.max(...total)]; })()"
    )
    page.run(HELPERS)
    rows = page.run("helpers.painted('forces', 600, 400).heights")
    assert ends[1] > 0.0
    assert min(rows) >= 8.0
    assert max(rows) <= 400.0


@pytest.mark.slow
def test_a_hammer_without_a_pulse_goes_back_to_the_one_it_opens_with(page: Page) -> None:
    page.run("window.studio.studio.choose('bouncing-ball').then(() => 1)")
    opened = page.wait(f"{STATE}.hammer === 'bouncing-ball' && {STATE}.waveform")
    typed(page, "[data-number='waveform.amplitude']", "0.25")
    assert page.run(f"{STATE}.waveform.amplitude") == 0.25
    page.run("document.querySelector('[aria-label=\"reset pulse\"]').click()")
    assert page.run(f"{STATE}.waveform") == opened
    assert page.complaints == []


@pytest.mark.slow
def test_the_drag_of_a_damped_hammer_is_among_the_forces(page: Page) -> None:
    page.run(HELPERS)
    names = "helpers.painted('forces', 600, 400).texts"
    assert "drag" not in page.run(names)
    page.run("window.studio.studio.choose('duffing-holmes').then(() => 1)")
    page.wait("'F drag' in window.studio.studio.frames.motion.data")
    assert "drag" in page.run(names)
    assert "drag" in page.run("Object.keys(window.studio.studio.views.forces.table()).join(' ')")
    # A sinusoidal force has periods and no pulses.
    label = "document.querySelector('[for=control-pulses]').textContent"
    assert page.run(label) == "periods"
    page.run("window.studio.studio.choose('hendriks-1983').then(() => 1)")
    page.wait("!('F drag' in window.studio.studio.frames.motion.data)")
    assert "drag" not in page.run(names)
    assert page.run(label) == "pulses"
