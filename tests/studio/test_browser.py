"""The studio end to end, in a headless Chromium."""

import base64
import json
import re
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from tests.hammers import CRUDE
from tests.studio.browser import Page
from tests.studio.server import Studio

import printhammer as ph
from printhammer.studio.bundle import module
from printhammer.studio.messages import answer, read_message
from printhammer.studio.pictures.engine import motion_frame
from printhammer.studio.states.shelf import Shelf

CTRL, SHIFT = 2, 8
AXE = Path(__file__).parent / "vendor" / "axe.min.js"
STATE = "window.studio.studio.store.state"
HELPERS = (Path(__file__).parent / "helpers.js").read_text("utf-8")
FRAMES = {"line": "line", "strobe": "strobe", "map": "map"}
VIEWS = ("motion", "sketch", "map", "forces", "phase", "strobe", "loops", "energy", "line")


def state(page: Page) -> dict[str, Any]:
    return page.run(STATE)


def settled(page: Page, condition: str) -> None:
    """Wait until a state is set and its curves are drawn."""
    page.wait(f"(() => {{ const state = {STATE}; return {condition}; }})()")
    page.wait("!window.studio.studio.busy && !window.studio.studio.stale")


def inked(page: Page, view: str) -> int:
    """Count the colours of a view's canvases, of which an empty one has one."""
    return page.run(f"helpers.inked({view!r})")


def drop(page: Page, name: str, text: str) -> None:
    page.run(f"helpers.drop({name!r}, {json.dumps(text)})")


def saved(page: Page, selector: str, value: str) -> str:
    """Choose an export and return the text that would be saved."""
    page.run(f"helpers.save({selector!r}, {value!r})")
    return page.wait("window.kept")


@pytest.mark.slow
def test_a_visit(page: Page, running: Studio) -> None:
    """Open, look, drag, click the map, pin, undo, reload, drop, export; no complaint, no foreign request."""
    page.run(HELPERS)
    for view in VIEWS:
        page.wait(f"window.studio.studio.frames[{FRAMES.get(view, 'dots')!r}]")
        assert inked(page, view) > 3, view

    # Drag a slider.
    box = page.box("[data-key='forms thickness']")
    middle = box["y"] + box["height"] / 2
    page.drag(*((box["x"] + part * box["width"], middle) for part in (0.5, 0.55, 0.62, 0.7)))
    settled(page, "state.constants['pack.thickness'] > 0")
    constants = state(page)["constants"]
    hammer = ph.load(CRUDE)
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

    # Reload from the address.
    # The address of before the pin holds the same rate.
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
        assert "NaN" not in re.sub(r'href="data:[^"]*"', "", picture), view
        assert "PNG" in saved(page, leave, "PNG")[:8], view

    assert page.complaints == []
    assert {
        urlsplit(address).netloc for address in page.requests if not address.startswith(("data:", "blob:"))
    } == {running.host}


@pytest.mark.slow
def test_the_keyboard_reaches_everything(page: Page) -> None:
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


@pytest.mark.slow
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


@pytest.mark.slow
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


def answered(data: bytes) -> str:
    """Return a script that hands a frame to the widget."""
    return f"helpers.take('{base64.b64encode(data).decode()}')"


@pytest.mark.slow
def test_the_widget_is_the_same_page(opened_browser: Any) -> None:
    """The one module of the widget, mounted on an empty page, sends and takes the messages of the page."""
    page = opened_browser()
    page.open("about:blank")
    page.run(HELPERS)
    page.run(
        "window.sent = []; window.model = { get: (name) => ({ height: '700px', state: 'rate=900' })[name],"
        " set() {}, save_changes() {}, on(_kind, take) { window.take = take; }, off() {},"
        " send: (message) => window.sent.push(JSON.parse(message.text)) }; 1"
    )
    page.run(f"window.text = {json.dumps(module())}; 1")
    page.run(
        "import(URL.createObjectURL(new Blob([window.text], { type: 'text/javascript' })))"
        ".then((made) => made.default.render({ model: window.model, el: document.body })).then(() => 1)"
    )
    assert page.run("document.querySelectorAll('.panel').length") == len(VIEWS)
    for number in range(2):
        kind, serial, content = read_message(json.dumps(page.wait(f"window.sent[{number}]")))
        page.run(answered(answer(kind, serial, content, Shelf())))
    kind, serial, found = read_message(json.dumps(page.wait("window.sent[2]")))
    assert (kind, found.rate) == ("state", 900.0)
    data, _ = motion_frame(found, serial)
    page.run(answered(data))
    page.wait("document.querySelector('.status').textContent.includes('steps')")
    # Keys of the studio are not for the notebook around it, where some of them cut cells.
    page.run("window.heard = 0; document.addEventListener('keydown', () => { window.heard += 1; }); 1")
    page.run("document.querySelector('.grid').focus()")
    page.press("p", "KeyP")
    page.wait("document.querySelector('.status').textContent.includes('pinned')")
    assert page.run("window.heard") == 0
    assert page.run("document.body.dataset.lmSuppressShortcuts") == "true"
    assert page.complaints == []


@pytest.mark.slow
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


@pytest.mark.slow
def test_strobe_points_arrive_with_an_exponent_and_then_the_verdict(page: Page) -> None:
    page.run(
        "window.painted = []; const { studio } = window.studio; window.before = studio.serial;"
        " document.getElementById('studio').addEventListener('painted', ({ detail }) => {"
        " const { strobe } = studio.frames;"
        " if (detail.kind === 'strobe' && strobe.serial > window.before)"
        " window.painted.push({ points: strobe.data.x.length, exponent: !!strobe.exponent,"
        " verdict: !!strobe.verdict }); }); studio.store.set({ rate: 1310 }); 1"
    )
    page.wait("window.painted.some(({ verdict }) => verdict)")
    painted = page.run("window.painted")
    counts = [each["points"] for each in painted]
    assert counts == sorted(counts)
    assert len(set(counts)) >= 4
    assert counts[0] < counts[-1]
    assert any(each["exponent"] and not each["verdict"] for each in painted)
    assert page.complaints == []


@pytest.mark.slow
def test_a_view_that_would_take_too_long_says_so_and_shows_nothing_old(page: Page) -> None:
    page.run(HELPERS)
    hammer = ph.load(CRUDE).replace("backstop.stiffness", 1e20)
    drop(page, "stiff.toml", hammer.to_toml())
    page.wait("window.studio.studio.frames.map?.reason && window.studio.studio.frames.strobe?.reason")
    assert "steps" in page.run("window.studio.studio.frames.map.reason")
    assert inked(page, "map") > 1
    assert page.run("window.studio.studio.views.map.table()") is None
    page.run("document.querySelector('.undo').click()")
    page.wait("window.studio.studio.frames.map.detail === 'full'")
    assert page.complaints == []


@pytest.mark.slow
def test_rates_that_failed_are_counted_in_the_map(page: Page) -> None:
    page.run(HELPERS)
    # So strong a current drives the armature away from where the law of the magnet holds.
    pulse = {"shape": "half-sine", "amplitude": -90.0, "width": 4e-4, "quantity": "current"}
    page.run(f"window.studio.studio.store.set({{ waveform: {json.dumps(pulse)} }}); 1")
    page.wait("window.studio.studio.frames.map.failed === 512")
    assert "512 of 512 runs failed" in saved(page, ".view-map .leave", "SVG")
    page.wait("document.querySelector('.status').classList.contains('bad')")
    assert page.complaints == []


@pytest.mark.slow
def test_two_tabs_are_independent(page: Page, running: Studio, opened_browser: Any) -> None:
    other = opened_browser()
    other.open(running.address + "#rate=700&pulses=2")
    other.wait("window.studio?.studio?.frames.dots")
    assert (state(page)["rate"], state(other)["rate"]) == (1200, 700)
    assert len(page.run("window.studio.studio.frames.motion.fired")) == 9
    assert len(other.run("window.studio.studio.frames.motion.fired")) == 2
    other.call("Page.close")
    page.run("document.querySelector('[data-key=\"rate\"]').focus()")
    page.press("ArrowRight")
    settled(page, "state.rate > 1200")


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), [(1280, 720), (1920, 1080), (2560, 1080)])
def test_everything_fits_on_the_screen(page: Page, width: int, height: int) -> None:
    page.size(width, height)
    page.wait(f"innerWidth === {width}")
    overflow = page.run("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
    assert overflow == [width, height]
    for view in VIEWS:
        box = page.box(f".view-{view}")
        assert box["width"] > 250, view
        assert box["height"] > 180, view
        assert box["x"] + box["width"] <= width
        assert box["y"] + box["height"] <= height


@pytest.mark.slow
def test_a_rail_in_the_place_of_the_current_and_back(page: Page) -> None:
    """Drivers, decay path and temperature are controls, both curves are there, and undo leads back."""
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
    assert page.run("document.querySelector('[data-key=\"coil.temperature\"]').checkVisibility()")
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
