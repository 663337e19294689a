"""The studio end to end, in a headless Chromium."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.studio.browser import HELPERS, Page
from tests.studio.conftest import WHOLE

import printhammer as ph
from printhammer.hammer.file import VIEWS
from printhammer.studio import bounds

pytestmark = pytest.mark.slow

CTRL, SHIFT = 2, 8
AXE = Path(__file__).parent / "vendor" / "axe.min.js"
STATE = "window.studio.studio.store.state"
PAINTED = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))"
FRAMES = {"line": "line", "strobe": "strobe", "map": "map"}


@pytest.fixture
def page(tabs: Callable[..., Page]) -> Page:
    """The page with all views, for tests that change only its state."""
    return tabs(WHOLE)


def state(page: Page) -> dict[str, Any]:
    return page.run(STATE)


def settled(page: Page, condition: str) -> None:
    """Wait until a state is set and its curves are drawn."""
    page.wait(f"(() => {{ const state = {STATE}; return {condition}; }})()")
    page.wait("!window.studio.studio.busy && !window.studio.studio.stale")
    # What has been computed is painted in the next animation frame.
    page.run(PAINTED)


def inked(page: Page, view: str) -> int:
    """Count the colours of a view's canvases; an empty canvas has one colour."""
    return page.run(f"helpers.inked({view!r})")


def drop(page: Page, name: str, text: str) -> None:
    page.run(f"helpers.drop({name!r}, {json.dumps(text)})")


def saved(page: Page, selector: str, value: str) -> str:
    """Choose an export and return the text of the saved file."""
    page.run(f"helpers.save({selector!r}, {value!r})")
    return page.wait("window.kept")


def test_a_visit(whole_page: Page) -> None:
    """View, drag, click the map, pin, undo, reload, drop, export; no error is logged."""
    page = whole_page
    page.run(HELPERS)
    for view in VIEWS:
        page.wait(f"window.studio.studio.frames[{FRAMES.get(view, 'dots')!r}]")
        page.run(PAINTED)
        assert inked(page, view) > 3, view

    # Drag a slider.
    box = page.box("[data-key='forms thickness']")
    middle = box["y"] + box["height"] / 2
    page.drag(*((box["x"] + part * box["width"], middle) for part in (0.5, 0.55, 0.62, 0.7)))
    settled(page, "state.constants['pack.thickness'] > 0")
    constants = state(page)["constants"]
    hammer = ph.load("hendriks-1983-1")
    assert constants["pack.thickness"] > hammer.pack.thickness
    assert constants["pack.thickness"] + constants["pack.front"] == pytest.approx(hammer.platen)
    places = page.run("window.studio.studio.frames.motion.places")
    assert places["front"] == pytest.approx(constants["pack.front"])

    # Click the map: every view follows.
    before = state(page)["rate"]
    box = page.box(".view-map canvas")
    page.drag((box["x"] + 0.5 * box["width"], box["y"] + 0.25 * box["height"]))
    settled(page, f"state.rate !== {before}")
    rate = state(page)["rate"]
    assert 1400.0 < rate < 2000.0
    fired = page.run("window.studio.studio.frames.motion.fired")
    assert fired[1] - fired[0] == pytest.approx(1.0 / rate)
    page.wait(f"window.studio.studio.frames.strobe?.rate === {rate}")

    # Pin, then undo and redo.
    page.run("document.querySelector('.pin').click()")
    assert page.run("window.studio.studio.ghosts.length") == 1
    page.run("document.querySelector('.grid').focus(); document.body.focus()")
    page.run("document.querySelector('.undo').click()")
    settled(page, f"state.rate === {before}")
    page.run("document.querySelector('.undo').click()")
    settled(page, "Object.keys(state.constants).length === 0")
    page.run("document.querySelector('.redo').click()")
    page.run("document.querySelector('.redo').click()")
    settled(page, f"state.rate === {rate}")
    kept = state(page)

    # Reload from the address, in which the rate was before the pin.
    page.wait(f"location.hash.includes('rate={rate:g}') && location.hash.includes('pins=')")
    page.call("Page.reload")
    page.wait("window.studio?.studio?.frames.map?.detail === 'full'")
    assert state(page) == kept
    page.run(HELPERS)

    # Drop a hammer, a measured curve, and something else.
    drop(page, "other.toml", hammer.replace("mass", 1.1 * hammer.mass).to_toml())
    settled(page, "state.text.length > 100")
    drop(page, "measured.csv", "time [us],displacement [um]\n0,50\n200,180\n400,60\n")
    page.wait("window.studio.studio.overlay?.name === 'measured.csv'")
    drop(page, "letter.txt", "Dear Sir")
    page.wait("document.querySelector('.status').classList.contains('bad')")
    page.run("document.querySelector('.undo').click()")
    page.run("document.querySelector('.undo').click()")
    settled(page, "state.text === ''")

    # Everything leaves.
    assert ph.Hammer.from_toml(saved(page, "select.out", "hammer, TOML")).pack.thickness == pytest.approx(
        kept["constants"]["pack.thickness"]
    )
    assert "[train]" in saved(page, "select.out", "drive, TOML")
    page.wait("window.studio.studio.frames.strobe?.data.x && window.studio.studio.frames.line?.data.x")
    assert saved(page, ".view-line .leave", "CSV").startswith(
        "wanted_x [m],wanted_y [m],x [m],y [m],darkness"
    )
    for view in VIEWS:
        page.wait(f"window.studio.studio.views['{view}'].table()")
        leave = f".view-{view} .leave"
        assert saved(page, leave, "CSV").count("\n") >= 9, view
        picture = saved(page, leave, "SVG")
        assert picture.startswith("<svg"), view
        assert picture.count("<path") > 3, view
        assert "hendriks-1983-1, " in picture, view
        assert "Hz, printhammer " in picture, view
        assert "NaN" not in re.sub(r'href="data:[^"]*"', "", picture), view
        # The key of lost dots lies above the map.
        assert view != "map" or picture.rindex(">lost dot<") > picture.rindex("<image"), view
        assert "PNG" in saved(page, leave, "PNG")[:8], view
    assert page.complaints == []


def test_the_keyboard_reaches_everything(whole_page: Page) -> None:
    page = whole_page
    page.run("document.querySelector('[data-key=\"rate\"]').focus()")
    page.press("ArrowRight")
    settled(page, "state.rate > 1200")
    page.press("z", "KeyZ", CTRL)
    settled(page, "state.rate === 1200")
    # A slider leaves letters and numbers to the studio.
    page.press("p", "KeyP")
    page.wait("window.studio.studio.ghosts.length === 1")
    page.press("u", "KeyU")
    page.wait("window.studio.studio.ghosts.length === 0")
    page.run("document.querySelector('.view-map canvas').focus()")
    page.press("ArrowUp")
    settled(page, "state.rate === 1207.5")
    page.press("p", "KeyP")
    page.wait("window.studio.studio.ghosts.length === 1")
    page.press("u", "KeyU")
    page.wait("window.studio.studio.ghosts.length === 0")
    page.press(" ", "Space")
    page.wait("window.studio.studio.cursor > 0")
    page.press(" ", "Space")
    page.press("9", "Digit9")
    settled(page, "!state.views.includes('line')")
    page.press("!", "Digit1", SHIFT)
    page.wait("document.querySelector('.view-motion').classList.contains('large')")
    page.press("Escape")
    page.wait("!document.querySelector('.grid').classList.contains('one')")
    page.press("t", "KeyT")
    page.wait("getComputedStyle(document.querySelector('.studio')).getPropertyValue('--dark').trim() === '1'")
    page.press("?", "Slash", SHIFT)
    page.wait("document.querySelector('dialog').open")
    assert page.complaints == []


def test_answered_columns_are_saved_as_the_file_beside_the_table(page: Page) -> None:
    page.run(
        "(() => { window.links = []; window.files = []; window.made = URL.createObjectURL;"
        " URL.createObjectURL = (file) => { window.files.push(file); return window.made(file); };"
        " HTMLAnchorElement.prototype.click = function () { window.links.push(this); };"
        " window.studio.studio.drop(new File(['time [us],a\\n0,0\\n10,5\\n20,0\\n'], 'trace.csv')); })()"
    )
    page.wait("document.querySelector('dialog .asking')")
    page.run(
        "(() => { document.querySelector(\"[aria-label='what a is']\").value = 'current';"
        " document.querySelector(\"[aria-label='unit of a']\").value = '100 mA';"
        " document.querySelector('dialog .asking button[value=save]').click(); })()"
    )
    settled(page, "state.waveform !== null")
    assert state(page)["waveform"]["values"] == pytest.approx([0.0, 0.5, 0.0])
    assert page.run("links.map((link) => link.download)") == ["trace.csv.toml"]
    assert page.run("files[0].text()") == ('[columns]\ntime = "1"\ncurrent = "2*100 mA"\n')
    page.run("delete HTMLAnchorElement.prototype.click; URL.createObjectURL = window.made")


def test_the_pulse_is_dragged_at_its_handles(page: Page) -> None:
    before = page.run("window.studio.studio.described.waveform")
    plane = page.box(".pulse canvas")
    # The axes of the editor: 1.3 times the peak above, 0.12 times below, and a quarter more than the pulse.
    pulse = page.run("window.studio.studio.frames.motion.pulse")
    left, right, top, bottom = 42, 8, 6, 30
    wide, high = plane["width"] - left - right, plane["height"] - top - bottom
    span, peak = 1.25 * pulse["t"][-1], max(pulse["value"])

    def place(t: float, value: float) -> tuple[float, float]:
        down = top + high * (1.3 * peak - value) / (1.42 * peak)
        return plane["x"] + left + wide * t / span, plane["y"] + down

    start = place(before["width"], 0.0)
    page.drag(start, (start[0] + 10, start[1]), (start[0] + 0.1 * wide, start[1]))
    settled(page, "state.waveform !== null")
    wider = state(page)["waveform"]
    assert wider["width"] == pytest.approx(before["width"] + 0.1 * span, rel=0.02)
    assert wider["amplitude"] == before["amplitude"]
    page.run("document.querySelector('[aria-label=\"reset pulse\"]').click()")
    settled(page, "state.waveform === null")
    at = pulse["t"][pulse["value"].index(peak)]
    page.drag(place(at, peak), place(at, 0.9 * peak), place(at, 0.5 * peak))
    settled(page, "state.waveform !== null")
    assert state(page)["waveform"]["amplitude"] == pytest.approx(0.5 * before["amplitude"], rel=0.05)
    assert max(page.run("window.studio.studio.frames.motion.pulse.value")) == pytest.approx(
        0.5 * peak, rel=0.05
    )


def test_presets_patterns_shapes_and_units(page: Page) -> None:
    page.run(HELPERS)
    page.run("window.studio.studio.store.set({ views: ['motion', 'energy'] }); 1")
    page.run("helpers.choose('[aria-label=preset]', 'two pulses')")
    settled(page, "state.pulses === 2")
    assert len(page.run("window.studio.studio.frames.motion.fired")) == 2
    page.run("helpers.type('#control-pattern', '1011')")
    settled(page, "state.pattern === '1011'")
    assert page.run("window.studio.studio.frames.motion.fired") == pytest.approx([0.0, 0.002, 0.003])
    page.run("window.studio.studio.store.set({ views: ['motion', 'energy', 'map'] }); 1")
    page.wait("window.studio.studio.frames.map?.pattern === '1011'")
    page.run("helpers.type('#control-pattern', '10x1')")
    assert state(page)["pattern"] == "1011"
    assert page.run("document.querySelector('#control-pattern').getAttribute('aria-invalid')") == "true"
    page.run("helpers.choose('#control-shape', 'half-sine')")
    settled(page, "state.waveform.shape === 'half-sine'")
    page.run("helpers.choose('[aria-label=units]', '1')")
    assert page.run("document.querySelector('[data-number=\"forms thickness\"]').value") == "7"
    page.run("helpers.enter('[data-number=\"forms thickness\"]', '8')")
    settled(page, "Math.abs(state.constants['pack.thickness'] - 8 * 25.4e-6) < 1e-9")
    page.run("helpers.enter('[data-number=\"rate\"]', 'fast')")
    assert page.run("document.querySelector('[data-number=rate]').value") == "1000"
    assert page.complaints == []


@pytest.mark.parametrize("dark", [False, True])
def test_no_serious_finding_about_accessibility(page: Page, dark: bool) -> None:
    page.size(1280, 720, dark=dark)
    page.run("for (const part of document.querySelectorAll('details')) part.open = true")
    page.run(AXE.read_text("utf-8") + "; 1")
    found = page.run("axe.run(document, { resultTypes: ['violations'] })")
    serious = {
        finding["id"]: [node["target"] for node in finding["nodes"]][:5]
        for finding in found["violations"]
        if finding["impact"] in ("serious", "critical")
    }
    assert serious == {}


def test_rates_that_failed_are_counted_in_the_map(page: Page) -> None:
    page.run(HELPERS)
    # So strong a current drives the armature away from where the law of the magnet holds.
    pulse = {"shape": "half-sine", "amplitude": -90.0, "width": 4e-4, "quantity": "current"}
    page.run(f"window.studio.studio.store.set({{ waveform: {json.dumps(pulse)} }}); 1")
    page.wait("window.studio.studio.frames.map.failed === 512")
    assert "512 of 512 runs failed" in saved(page, ".view-map .leave", "SVG")
    page.wait("document.querySelector('.status').classList.contains('bad')")
    assert page.complaints == []


def test_a_page_is_saved_with_what_is_set_and_a_state_comes_back_as_a_file(
    page: Page, opened_browser: Any, tmp_path: Path
) -> None:
    page.run(HELPERS)
    page.run("window.studio.studio.store.set({ rate: 925, line: '</script><b>' }); 1")
    settled(page, "state.rate === 925")
    state_file = saved(page, "select.out", "state, file")
    page.run(
        "helpers.save('select.out', ''); [...document.querySelectorAll('button')]"
        ".find((each) => each.textContent === 'save as a page').click()"
    )
    path = tmp_path / "studio-page.html"
    path.write_text(page.wait("window.kept"), "utf-8")
    shown = opened_browser()
    shown.open(path.as_uri())
    shown.wait("!!window.studio?.studio?.frames.motion")
    assert (state(shown)["rate"], state(shown)["line"]) == (925, "</script><b>")
    shown.run("window.studio.studio.store.set({ rate: 1000 }); 1")
    shown.wait("window.studio.studio.frames.motion.fired[1] === 1e-3")
    shown.run(HELPERS)
    # Longer than the limit of hammer files, shorter than that of states.
    drop(shown, "state.json", state_file + " " * bounds.LARGEST_FILE)
    settled(shown, "state.rate === 925")
    drop(shown, "bad.json", "{")
    shown.wait("document.querySelector('.status').textContent.includes('bad.json: expected a state file')")
    assert shown.complaints == page.complaints == []
    shown.call("Page.close")


def test_a_rail_in_the_place_of_the_current_and_back(page: Page) -> None:
    """Drivers, decay path and temperature are controls, both curves are drawn, undo restores the state."""
    page.run(HELPERS)
    motion = "window.studio.studio.frames.motion"
    page.run("window.studio.studio.store.set({ views: ['motion', 'energy'], pulses: 1 }); 1")
    settled(page, "state.pulses === 1")
    own = page.run(f"{motion}.peak")

    def took(shape: str) -> float:
        page.run(f"helpers.choose('#control-shape', '{shape}')")
        settled(page, f"state.waveform.shape === '{shape}'")
        page.wait(f"{motion}.quantity === 'voltage' && {motion}.data.u")
        return page.run(f"{motion}.peak")

    assert took("rail") == pytest.approx(own, rel=0.2)
    page.run("for (const part of document.querySelectorAll('details')) part.open = true")
    assert page.run("document.querySelector('[data-key=\"coil.temperature\"]').checkVisibility()")
    # A window that changes its size between two answers draws the axis of the former drive once more.
    page.run(f"{motion}.data.u = undefined")
    page.size(1300, 800)
    page.run(PAINTED)
    assert page.complaints == []
    assert took("chopper") < own
    assert page.run("document.querySelector('[data-key=\"waveform.off_time\"]')") is None
    page.run("helpers.choose('#control-chopped', 'fixed time')")
    settled(page, "state.waveform.off_time > 0 && state.waveform.lower === null")
    for shape in ("peak-and-hold", "capacitor", "bridge", "rail"):
        assert took(shape) > 0.2 * own
    page.run("helpers.choose('#control-decay', 'zener')")
    settled(page, "state.waveform.decay_voltage === state.waveform.voltage")
    page.wait("window.studio.studio.frames.dots.serial === window.studio.studio.serial")
    cold = page.run(f"{motion}.peak")
    page.run("helpers.enter('[data-number=\"coil.temperature\"]', '120 °C')")
    settled(page, "state.constants['coil.temperature'] === 120")
    page.wait(f"{motion}.peak < 0.95 * {cold}")
    rail = state(page)["waveform"]["voltage"]
    plane, pulse = page.box(".pulse canvas"), page.run(f"{motion}.pulse")
    grip = (plane["x"] + 42, plane["y"] + 6 + (plane["height"] - 36) * 0.3 / 1.42)
    assert max(pulse["value"]) == rail
    page.drag(grip, (grip[0], grip[1] + 5), (grip[0], grip[1] + 20))
    settled(page, f"state.waveform.voltage < 0.9 * {rail}")
    page.wait("document.querySelector('.view-motion .caption').textContent.includes('The coil takes up to')")
    assert saved(page, ".view-motion .leave", "CSV").startswith(
        "time [s],displacement [m],voltage [V],current [A]"
    )
    assert "voltage, V" in saved(page, ".view-motion .leave", "SVG")
    warm = ph.Hammer.from_toml(saved(page, "select.out", "hammer, TOML"))
    assert warm.coil.temperature == 120.0
    kept = state(page)
    page.wait("location.hash.includes('coil.temperature=120') && location.hash.includes('zener')")
    page.call("Page.reload")
    page.wait("window.studio?.studio?.frames.dots")
    assert state(page) == kept
    page.run(HELPERS)
    page.run("helpers.choose('#control-shape', 'half-sine')")
    settled(page, "state.waveform.quantity === 'current'")
    page.wait(f"{motion}.quantity === 'current' && !{motion}.data.u")
    page.run("document.querySelector('.undo').click()")
    settled(page, "state.waveform.shape === 'rail'")
    page.wait(f"{motion}.data.u")
    assert page.complaints == []
