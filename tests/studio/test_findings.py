"""Values at the cursor, findings and pins, in a browser with the hammer of the paper."""

import json
from collections.abc import Callable, Iterator
from urllib.parse import quote

import pytest
from tests.studio.browser import HELPERS, Page

import printhammer as ph
from printhammer.hammer.file import VIEWS

pytestmark = pytest.mark.slow

STATE = "window.studio.studio.store.state"


@pytest.fixture
def opened(tabs: Callable[..., Page]) -> Iterator[Page]:
    page = tabs(f"#hammer=hendriks-1983&views={'-'.join(VIEWS)}", 1440, 900)
    page.wait("window.studio.studio.frames.strobe && window.studio.studio.frames.dots")
    yield page
    assert page.complaints == []


def readout(page: Page, view: str) -> str:
    return page.run(f"document.querySelector('.view-{view} .readout').textContent")


def test_every_plot_reads_at_the_same_time(opened: Page) -> None:
    assert readout(opened, "motion") == ""
    box = opened.box(".view-motion canvas")
    opened.mouse("mouseMoved", box["x"] + 0.3 * box["width"], box["y"] + 0.5 * box["height"], held=False)
    opened.wait("window.studio.studio.cursor > 0")
    opened.wait("document.querySelector('.view-phase .readout').textContent")
    time = opened.run("window.studio.studio.cursor")
    for view in ("motion", "forces", "phase", "loops", "map", "strobe", "energy", "line"):
        assert any(sign.isdigit() for sign in readout(opened, view)), view
    place = readout(opened, "phase").split(" µm")[0]
    assert place in readout(opened, "motion")
    hammer = ph.load("hendriks-1983")
    run = ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate=1200, pulses=9))
    assert float(place) == pytest.approx(1e6 * float(run.at([time])[0][0]), abs=0.2)


@pytest.mark.parametrize("view", ["phase", "loops", "map", "energy", "line", "forces"])
def test_the_pointer_in_any_plot_sets_the_time(opened: Page, view: str) -> None:
    selector = f".view-{view} .u-over" if view == "forces" else f".view-{view} canvas"
    box = opened.box(selector)
    for part in (0.3, 0.45, 0.6, 0.75):
        for high in (0.25, 0.5, 0.8):
            x, y = box["x"] + part * box["width"], box["y"] + high * box["height"]
            opened.mouse("mouseMoved", x, y, held=False)
    opened.wait("window.studio.studio.cursor > 0")
    opened.wait("document.querySelector('.view-motion .readout').textContent")


def test_the_rate_where_a_dot_is_lost_is_found(opened: Page) -> None:
    """One click selects the second dot; the run at that rate has lost the dot, just below it has not."""
    opened.run("document.querySelector('.find-lost').click()")
    opened.wait(f"{STATE}.rate !== 1200")
    rate = opened.run(f"{STATE}.rate")
    hammer = ph.load("hendriks-1983")

    def struck(rate: float) -> bool:
        return ph.simulate(hammer, ph.PulseTrain(hammer.waveform, rate=rate, pulses=9)).dots[1].struck

    assert 1470 < rate < 1476
    assert not struck(rate)
    assert struck(rate - 0.1)


def test_a_dot_is_looked_for_where_runs_end_early(opened: Page) -> None:
    """A pulse of 90 A drives the armature out of the range of the magnet before the second dot."""
    wave = {"shape": "half-sine", "amplitude": 90.0, "width": 3e-4, "quantity": "current"}
    opened.run(f"window.studio.studio.store.set({{ waveform: {json.dumps(wave)} }})")
    opened.wait("!window.studio.studio.busy && window.studio.studio.frames.dots.dots.length < 2")
    opened.run("document.querySelector('.find-lost').click()")
    opened.wait("document.querySelector('.status').textContent.includes('comes to the second dot')")


def test_the_next_strange_rate_is_found(opened: Page) -> None:
    opened.run("window.studio.studio.store.set({ rate: 1000, low: 900, high: 1200 })")
    opened.run("document.querySelector('.find-strange').click()")
    opened.wait(f"{STATE}.rate !== 1000", 120)
    rate = opened.run(f"{STATE}.rate")
    section = "window.studio.studio.frames.strobe"
    opened.wait(f"{section}.rate === {rate} && {section}.verdict")
    assert opened.run("window.studio.studio.frames.strobe.verdict.verdict") == "strange"


def test_pins_have_names_and_stay_in_the_address(opened: Page) -> None:
    opened.run("window.studio.studio.pin()")
    opened.run("window.studio.studio.store.set({ rate: 1500 })")
    opened.wait("!window.studio.studio.busy")
    opened.run("window.studio.studio.pin()")
    opened.run("window.studio.studio.store.set({ rate: 1400 })")
    opened.wait("window.studio.studio.ghosts.length === 2")
    opened.run(
        "(() => { const box = document.querySelector('.chip input'); box.value = 'as <b>built</b>';"
        " box.dispatchEvent(new Event('change')); })()"
    )
    opened.wait("document.querySelector('.apart').textContent.includes('at most')")
    # The address follows a little later than the state.
    opened.wait("['built', '1500'].every((text) => location.hash.includes(text))")
    opened.call("Page.reload")
    opened.wait("window.studio?.studio?.ghosts.length === 2")
    names = opened.run("window.studio.studio.ghosts.map((ghost) => ghost.name)")
    assert names == ["as <b>built</b>", "1500 Hz"]
    fired = opened.run("window.studio.studio.ghosts.map((ghost) => ghost.motion.fired[1])")
    assert fired == pytest.approx([1 / 1200, 1 / 1500])
    opened.wait("document.querySelector('.apart').textContent.includes('at most')")
    opened.run("document.querySelector('.chip button').click()")
    opened.wait(f"{STATE}.rate === 1200")
    assert opened.run(f"{STATE}.pins.length") == 2
    opened.run("window.studio.studio.unpin()")
    opened.wait("window.studio.studio.ghosts.length === 0")
    opened.run("document.querySelector('.undo').click()")
    opened.wait(f"{STATE}.rate === 1400")


HOSTILE = [
    "[1]",
    "{",
    "[[]]",
    json.dumps([{"name": "x", "state": {"rate": 1e99}}]),
    json.dumps([{"name": "x" * 1000, "state": {"__proto__": 1, "views": ["zzz"]}}] * 9),
    json.dumps([{"name": "<img src=x onerror=alert(1)>", "state": {"waveform": [1]}}]),
]


def test_pins_of_hostile_links_harm_nothing(address: str, fresh: Callable[..., Page]) -> None:
    page = fresh(f"{address}#rate=1100&pins={quote(HOSTILE[0])}")
    for k, pins in enumerate(HOSTILE):
        if k:
            page.run(f"location.hash = 'rate=1100&pins=' + encodeURIComponent({json.dumps(pins)}); 1")
        page.wait(f"{STATE}.rate === 1100 && !window.studio.studio.busy")
        page.run("window.studio.studio.store.set({ rate: 1300 })")
        page.wait("!window.studio.studio.busy && window.studio.studio.frames.motion.fired[1] < 1 / 1290")
        assert page.run("document.querySelectorAll('.chips .chip').length") <= 4
        assert page.run("window.studio.studio.ghosts.length") == 0


def test_a_pin_of_a_link_is_opened_as_far_as_it_is_a_state(address: str, fresh: Callable[..., Page]) -> None:
    """A pin without a hammer, with a hammer that the page lacks, and with invalid entries."""
    page = fresh(address)
    for state, reason in (
        ({}, ""),
        ({"hammer": "mine"}, "expected one of"),
        ({"constants": None, "pattern": 3}, "constants is expected"),
    ):
        pins = json.dumps([{"name": "a", "state": {"rate": 700, **state}}])
        page.run(f"location.hash = 'rate=900&pins=' + encodeURIComponent({json.dumps(pins)}); 1")
        page.wait(f"{STATE}.rate === 900 && !!document.querySelector('.chip button')")
        page.wait("window.studio.studio.frames.motion.fired[1] === 1 / 900 && !window.studio.studio.busy")
        page.run("setTimeout(() => document.querySelector('.chip button').click(), 0); 1")
        page.wait("window.studio.studio.frames.motion.fired[1] === 1 / 700")
        assert reason in page.run("document.querySelector('.status').textContent")
        assert page.run(f"{STATE}.hammer") == page.run("window.studio.studio.offered[0]")
        assert page.run(f"{STATE}.pins.length") == 1
        page.run("window.studio.studio.store.set({ rate: 1300 })")
        page.wait("window.studio.studio.frames.motion.fired[1] === 1 / 1300")


def test_curves_are_marked_while_a_hammer_is_set_that_the_page_lacks(opened: Page) -> None:
    marked = "document.querySelector('.view-motion').classList.contains('outdated')"
    opened.run("window.studio.studio.store.set({ hammer: 'mine' })")
    opened.wait(marked)
    opened.run("document.querySelector('.undo').click()")
    opened.wait(f"!{marked}")


def test_the_actuator_reads_the_current_of_its_time(opened: Page) -> None:
    """Points of a curve are not evenly spaced in time."""
    hammer = ph.load("hendriks-1983")
    drive = ph.PulseTrain(hammer.waveform, rate=1200, pulses=9)
    for time in (1.1e-4, 9.6e-4, 6.002e-3):
        drawn = next(text for text in sketched(opened, time) if text.endswith(" A"))
        current = float(drive.value([time])[0])
        assert float(drawn.split()[-2]) == pytest.approx(current, rel=0.02, abs=2e-3)


def test_contacts_of_a_relay_open_and_close_at_their_positions(opened: Page) -> None:
    relay = ph.load("relay-5v")
    opened.run("window.studio.studio.store.set({ hammer: 'relay-5v', rate: 20, pulses: 3 })")
    opened.wait("!window.studio.studio.busy && window.studio.studio.loaded === 'relay-5v'")
    seen = set()
    for moved in ({}, {"contact.make.position": 0.3e-3, "contact.break.position": 0.1e-3}):
        opened.run(f"window.studio.studio.store.set({{ constants: {moved} }})")
        opened.wait("!window.studio.studio.busy && !window.studio.studio.stale")
        device = relay.replace(moved) if moved else relay
        motion = ph.simulate(device, ph.PulseTrain(device.waveform, rate=20.0, pulses=3))
        make, separation = (device.constants[f"contact.{name}.position"].si for name in ("make", "break"))
        for time in (0.0, 4e-3, 5e-3, 15e-3, 40e-3, 60e-3):
            x = float(motion.at([time])[0][0])
            states = [
                f"make {'closed' if x > make else 'open'}",
                f"break {'closed' if x < separation else 'open'}",
            ]
            assert set(states) <= set(sketched(opened, time))
            opened.run(f"window.studio.studio.setCursor({time})")
            scrub = "document.querySelector('.view-sketch .scrub').getAttribute('aria-valuetext')"
            opened.wait(f"{scrub}.endsWith('{', '.join(states)}')")
            seen |= set(states)
    assert len(seen) == 4


def test_the_motion_of_a_relay_shows_its_contacts_by_name(opened: Page) -> None:
    opened.run("window.studio.studio.store.set({ hammer: 'relay-5v', rate: 20, pulses: 3, constants: {} })")
    opened.wait("!window.studio.studio.busy && window.studio.studio.loaded === 'relay-5v'")
    opened.wait("!window.studio.studio.stale")
    opened.run(HELPERS)
    texts = opened.run("helpers.painted('motion', 500, 300).texts")
    assert {"make", "break", "pole", "backstop"} <= set(texts)


def sketched(page: Page, time: float) -> list[str]:
    """Return the texts of the drawing of the actuator at a given time, s."""
    page.run(f"{HELPERS}; window.studio.studio.cursor = {time}")
    return page.run("helpers.painted('sketch', 500, 200).texts")
