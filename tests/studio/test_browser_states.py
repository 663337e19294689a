"""Links, files, marks and connections, in a headless Chromium."""

import json
import socket
from pathlib import Path
from typing import Any

import pytest
from tests.hammers import CRUDE
from tests.studio.browser import Page
from tests.studio.server import Studio, studio
from tests.studio.test_browser import HELPERS, drop, saved, settled, state

import printhammer as ph

STATUS = "document.querySelector('.status').textContent"
OUTDATED = "[...document.querySelectorAll('.outdated')].map((panel) => panel.dataset.why)"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("link", "reason"),
    [
        ("pulses=999&pattern=zzz", "pulses is expected to be a whole number from 1 to 64"),
        ("rate=1e99", "rate is expected to be a finite number from 10 to 20000"),
        ("line=" + 300 * "x", "line is expected to be a text of at most 200 characters"),
        ("waveform=[1]", "waveform.shape is expected"),
        ("hammer=no-such", "hendriks-1983 is shown instead"),
        ("text=<img src=x onerror=alert(1)>", "expected a TOML file"),
        ("views=sky&colour=5", "constants.colour is not known"),
    ],
)
def test_a_link_that_cannot_be_taken_is_told_and_the_page_lives(
    running: Studio, opened_browser: Any, link: str, reason: str
) -> None:
    page = opened_browser()
    page.open(running.address + "#" + link)
    page.wait("window.studio?.studio?.frames.motion")
    text = page.run(STATUS)
    assert reason.replace("hendriks-1983", running.name) in text
    page.run("window.studio.studio.store.set({ rate: 1000 }); 1")
    settled(page, "state.rate === 1000")
    page.wait(f"{STATUS}.includes('steps')")
    assert page.complaints == []
    page.call("Page.close")


@pytest.mark.slow
def test_a_refused_state_leaves_nothing_that_looks_like_its_own(page: Page) -> None:
    views = page.run("document.querySelectorAll('.panel:not([hidden])').length")
    page.run("window.studio.studio.store.set({ constants: { mass: 1 } }); 1")
    page.wait(f"{OUTDATED}.length === {views}")
    assert all(why.startswith("not computed: mass = 1 kg: expected") for why in page.run(OUTDATED))
    page.run("document.querySelector('.undo').click()")
    page.wait(f"{OUTDATED}.length === 0")
    assert page.complaints == []


@pytest.mark.slow
def test_a_studio_that_is_restarted_is_found_again(opened_browser: Any) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    token = 32 * "t"
    with studio(port=port, token=token) as running:
        page = opened_browser()
        page.open(running.address)
        page.wait("window.studio?.studio?.frames.motion")
        page.run("window.studio.studio.store.set({ rate: 777 }); 1")
        settled(page, "state.rate === 777")
        page.wait("location.hash.includes('rate=777')")
        link = page.run("window.studio.studio.address()")
        assert token not in link
        assert token not in page.run("location.href")
    page.wait(f"{OUTDATED}.length > 0")
    assert "trying to connect again" in page.run(STATUS)
    with studio(port=port, token=token):
        page.wait(f"{OUTDATED}.length === 0")
        assert state(page)["rate"] == 777
        # In this browser the link works without the token, also in another tab.
        other = opened_browser()
        other.open(link)
        other.wait("window.studio?.studio?.frames.motion")
        assert state(other)["rate"] == 777
        other.call("Page.close")
    page.call("Page.close")


@pytest.mark.slow
def test_a_page_that_has_no_token_says_what_to_do(opened_browser: Any) -> None:
    with studio() as running:
        page = opened_browser()
        page.open(f"http://{running.host}/")
        page.wait(f"{STATUS}.includes('open the address that the studio printed')")
        page.call("Page.close")


@pytest.mark.slow
def test_a_state_goes_out_as_a_file_and_comes_back(page: Page) -> None:
    page.run(HELPERS)
    drop(page, "mine.toml", ph.load(CRUDE).replace("name", "mine").to_toml())
    settled(page, "state.text.length > 100")
    chosen = "document.querySelector('[aria-label=hammer]').selectedOptions[0].textContent"
    assert page.run(chosen) == "mine (dropped)"
    page.run("window.studio.studio.store.set({ rate: 850 }); 1")
    settled(page, "state.rate === 850")
    text = saved(page, "select.out", "state, file")
    assert json.loads(text)["state"]["rate"] == 850
    page.run("window.studio.studio.choose(window.studio.studio.offered[0]); 1")
    settled(page, "state.text === ''")
    page.run("window.studio.studio.store.set({ rate: 900 }); 1")
    drop(page, "state.json", text)
    settled(page, "state.rate === 850")
    assert page.run(chosen) == "mine (dropped)"
    drop(page, "bad.json", "{")
    page.wait(f"{STATUS}.includes('bad.json: expected a state file')")
    assert page.complaints == []


@pytest.mark.slow
def test_what_an_oscilloscope_wrote_is_seen_after_its_units_were_asked_for(page: Page) -> None:
    page.run(HELPERS)
    rows = "".join(f"{10 * k};{50 + 4 * k},5;0,{min(k, 9)}\n" for k in range(40))
    drop(page, "scope.csv", "time;displacement;current\n" + rows)
    page.wait("document.querySelector('dialog').open")
    page.run("document.querySelector('dialog button[value=use]').click()")
    settled(page, "state.waveform?.shape === 'sampled' && state.pulses === 1")
    assert page.run("window.studio.studio.overlay.data.values[1]") == pytest.approx(54.5e-6)
    assert state(page)["waveform"]["values"][9] == pytest.approx(0.9)
    page.wait(f"{STATUS}.includes('its displacement is laid over the motion, its current is the pulse')")
    # Longer than a message may be.
    long = "".join(f"{k / 40:.5f},{k % 5}.000000\n" for k in range(40_000))
    drop(page, "long.csv", "time [us],current [mA]\n" + long)
    settled(page, "state.waveform?.times.length > 1900")
    assert state(page)["waveform"]["times"][-1] == pytest.approx(1e-3, rel=1e-3)
    drop(page, "scope.csv", "a;b\n0;1\n1;2\n")
    page.wait("document.querySelector('dialog').open")
    page.run("document.querySelector('dialog button[value=\"\"]').click()")
    page.wait("!document.querySelector('dialog').open")
    assert page.complaints == []


@pytest.mark.slow
def test_a_saved_page_shows_its_curves_without_a_server(
    page: Page, opened_browser: Any, tmp_path: Path
) -> None:
    page.run(HELPERS)
    page.run("window.studio.studio.store.set({ rate: 925, line: '</script><b>' }); 1")
    settled(page, "state.rate === 925")
    page.wait("window.studio.studio.frames.line?.serial === window.studio.studio.serial")
    page.wait("window.studio.studio.frames.strobe?.rate === 925")
    file = tmp_path / "studio-page.html"
    file.write_text(saved(page, "select.out", "page, read only"), "utf-8")
    shown = opened_browser()
    shown.size(1280, 720)
    shown.open(file.as_uri())
    shown.wait("!!document.querySelector('.saved')")
    shown.run(HELPERS)
    shown.wait(f"{STATUS}.includes('steps')")
    for view in ("motion", "map", "forces", "phase", "strobe", "loops", "energy", "line"):
        shown.wait(f"helpers.inked({view!r}) > 3")
    assert shown.run("document.querySelector('[data-number=rate]').value") == "925"
    assert shown.run("document.querySelector('.side').inert")
    assert shown.run(f"{OUTDATED}.length") == 0
    shown.press("z", "KeyZ", 2)
    assert shown.complaints == []
    assert all(address.startswith(("file:", "data:", "blob:")) for address in shown.requests)
    shown.picture(tmp_path / "kept.png")
    shown.call("Page.close")
