"""The page that computes by itself, opened from a file: agreement with Python, four views, hostile links."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.studio.browser import Page
from tests.studio.conftest import WHOLE
from tests.studio.reading import without_modules

import printhammer as ph
from printhammer.printing.page.page import print_page
from printhammer.printing.page.pattern import Pattern
from printhammer.studio import Shelf, live_page
from printhammer.studio.bundle import page_files

NAME = "hendriks-1983-1"


def test_the_page_begins_from_a_file(
    opened_browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The scripts of the page run and describe its hammer, here a hammer whose module is left out."""
    without_modules(monkeypatch)
    path = tmp_path / "page.html"
    path.write_text(live_page(Shelf(ph.load(NAME), only=True), "rate=900&pulses=3"), "utf-8")
    page = opened_browser()
    page.open(path.as_uri())
    page.wait("!!window.studio?.studio?.described && !!document.querySelector('[data-key=rate]')")
    assert page.run("window.studio.studio.store.state.rate") == 900
    page.call("Page.close")


FULL = "window.studio?.studio?.frames.map?.detail === 'full'"
FULL += (
    " && window.studio.studio.frames.strobe?.data.x.length === 400 && !document.querySelector('.outdated')"
)


@pytest.fixture
def live(tabs: Callable[..., Page]) -> Iterator[Page]:
    page = tabs(WHOLE)
    page.wait(FULL)
    yield page
    assert page.complaints == []


@pytest.mark.slow
def test_a_page_from_a_file_shows_what_python_computes(live: Page) -> None:
    hammer = ph.load(NAME)
    drive = ph.PulseTrain(hammer.waveform, rate=1200.0, pulses=9)
    motion = ph.simulate(hammer, drive)
    dots = live.run("window.studio.studio.frames.dots.dots")
    assert [dot["struck"] for dot in dots] == [dot.struck for dot in motion.dots]
    first = motion.dots[0]
    assert dots[0]["flight_time"] == pytest.approx(first.flight_time, rel=1e-4)
    assert dots[0]["peak_force"] == pytest.approx(first.peak_force, rel=1e-3)
    assert dots[0]["loading_work"] == pytest.approx(first.loading_work, rel=1e-3)
    energy = live.run("window.studio.studio.frames.dots.energy")
    assert energy["coil_work"] == pytest.approx(motion.energy.coil_work, rel=1e-3)
    printed = print_page(hammer, Pattern.from_text("HAMMER"), 1200.0)
    counts = live.run("(({ wanted, good, lost }) => [wanted, good, lost])(window.studio.studio.frames.line)")
    assert counts == [printed.lost.size, printed.good.sum(), printed.lost.sum()]
    points = live.run("[...window.studio.studio.frames.strobe.data.x].slice(0, 20)")
    section = ph.strobe(hammer, rate=1200.0, points=20, verdict=False)
    assert points == pytest.approx(section.x.tolist(), rel=1e-6)
    chart = ph.frequency_map(hammer, rates=[500.0, 2000.0], times=[1e-3], pulses=9)
    shown = live.run("[500, 2000].map((rate) => window.studio.studio.views.map.valueAt(1e-3, rate))")
    stroke = hammer.front - hammer.position
    assert abs(shown - chart["displacement"].to_numpy()[:, 0]).max() < 5e-3 * stroke


HOSTILE = [
    ("pulses=999&pattern=zzz", "pulses is expected to be a whole number from 1 to 64"),
    ("hammer=no-such", f"{NAME} is shown instead"),
    ("text=<img src=x onerror=alert(1)>", "expected a TOML file"),
    ("mass=1", "mass = 1 kg: expected"),
    ("__proto__=5&views=sky", "views is expected to be one of"),
]


@pytest.mark.slow
def test_hostile_links_do_no_harm(address: str, fresh: Callable[..., Page]) -> None:
    page = fresh(f"{address}#{HOSTILE[0][0]}")
    for k, (link, reason) in enumerate(HOSTILE):
        if k:
            page.run(f"location.hash = {json.dumps(link)}; 1")
        page.wait(f"document.querySelector('.status').textContent.includes({json.dumps(reason)})")
        assert page.run("document.querySelectorAll('#studio img').length") == 0


@pytest.mark.slow
def test_what_a_link_sets_is_kept_where_the_hammer_opens_with_another_value(
    address: str, fresh: Callable[..., Page]
) -> None:
    page = fresh(f"{address}#hammer=bouncing-ball&rate=1200&low=500")
    state = page.run("window.studio.studio.store.state")
    assert (state["rate"], state["low"], state["high"]) == (1200, 500, 100)
    assert state["waveform"] == page.run("window.studio.studio.described.start.waveform")


@pytest.mark.slow
def test_a_link_that_cannot_be_read_is_refused_with_its_reason(
    address: str, fresh: Callable[..., Page]
) -> None:
    page = fresh(address)
    page.wait("!window.studio.studio.busy")
    page.run(
        "const { studio: s } = window.studio; const { ask } = s;"
        " const no = { kind: 'refusal', reason: 'no such link' };"
        " s.ask = (kind, content) => (kind === 'open' ? Promise.resolve(no) : ask(kind, content)); 1"
    )
    page.run("window.studio.open('rate=800').then(() => 1)")
    page.wait("document.querySelector('.status').textContent === 'no such link'")
    page.run("window.studio.open('x'.repeat(800001)); 1")
    page.wait("document.querySelector('.status').textContent.includes('800001 characters')")


@pytest.mark.slow
def test_a_notebook_shows_the_page_and_follows_its_state(address: str, opened_browser: Any) -> None:
    page = opened_browser()
    page.open("about:blank")
    html = Path(address.removeprefix("file://")).read_text("utf-8")
    kept = {"state": "rate=900", "height": "700px", "page": html}
    page.run(
        f"window.heard = {{}}; window.kept = {json.dumps(kept)};"
        "window.model = { get: (name) => kept[name], set: (name, value) => { kept[name] = value; },"
        " save_changes() {}, on: (kind, call) => { heard[kind] = call; }, off() {} }; 1"
    )
    script = json.dumps(page_files()["widget.mjs"].decode())
    page.run(
        f"import(URL.createObjectURL(new Blob([{script}], {{ type: 'text/javascript' }})))"
        ".then((made) => made.default.render({ model, el: document.body })).then(() => 1)"
    )
    inside = "document.querySelector('iframe').contentWindow.studio?.studio"
    page.wait(f"{inside}?.frames.motion && {inside}.store.state.rate === 900")
    page.run(f"{inside}.store.set({{ rate: 910 }}); 1")
    page.wait("new URLSearchParams(kept.state).get('rate') === '910'")
    page.run("kept.state = 'rate=950&pulses=2'; heard['change:state'](); 1")
    page.wait(f"{inside}.store.state.rate === 950 && {inside}.frames.motion.fired.length === 2")
    assert page.complaints == []
    page.call("Page.close")
