"""The page in a browser: its header, its stories, the map under the pointer, views for each device."""

from collections.abc import Callable, Iterator

import pytest
from tests.studio.browser import Page

pytestmark = pytest.mark.slow

STUDIO = "window.studio.studio"
SETTLED = f"{STUDIO}?.frames.map?.detail === 'full' && !{STUDIO}.busy && !document.querySelector('.outdated')"
QUIET = f"!{STUDIO}.busy && !{STUDIO}.stale && !document.querySelector('.outdated')"
SEEN = f"{QUIET} && {STUDIO}.frames.dots.serial === Math.max(...{STUDIO}.sentAt.keys())"
"""The dots are those of the state that was sent last; questions have numbers of their own."""
SHOWN = "[...document.querySelectorAll('.panel')].filter((each) => each.checkVisibility())"


LINK = "#hammer=hendriks-1983"


@pytest.fixture
def page(tabs: Callable[..., Page]) -> Iterator[Page]:
    opened = tabs(LINK, 1440, 900)
    yield opened
    assert opened.complaints == []


@pytest.fixture
def own_page(address: str, fresh: Callable[..., Page]) -> Page:
    """The page opened for one test, which changes its tab or holds frames back."""
    opened = fresh(f"{address}{LINK}", 1440, 900)
    opened.wait(SETTLED)
    return opened


def choose(page: Page, name: str) -> None:
    page.run(f"{STUDIO}.choose({name!r}); 1")
    page.wait(f"{STUDIO}.described.name === {name!r} && {SETTLED}")
    page.wait(f"{STUDIO}.frames.map.serial === {STUDIO}.frames.motion.serial && {SETTLED}")
    page.run("new Promise((done) => setTimeout(done, 200))")


def test_one_header_row_and_controls_in_front_of_one_fold(page: Page) -> None:
    tops = page.run("[...document.querySelector('.bar').children].map((each) => each.offsetTop)")
    assert max(tops) - min(tops) < 10
    rows = page.run("[...document.querySelectorAll('.front [data-key]')].map((each) => each.dataset.key)")
    assert rows[:4] == ["rate", "pulses", "platen distance", "forms thickness"]
    assert not page.run("document.querySelector('.fold').open")
    label = page.run("document.querySelector('[for=control-backstop-stiffness]').textContent")
    assert label == "Hertz stiffness k"
    page.run("document.querySelector('.more summary').click()")
    assert page.run("document.querySelector('.more .pin').checkVisibility()")
    page.mouse("mousePressed", 700, 500)
    page.mouse("mouseReleased", 700, 500)
    assert not page.run("document.querySelector('.more').open")


def test_constants_of_forces_and_contacts_have_sliders(page: Page) -> None:
    choose(page, "relay-5v")
    page.run("document.querySelector('.fold').open = true")
    headings = page.run("[...document.querySelectorAll('.fold h3')].map((each) => each.textContent)")
    assert {"Spring", "Contact: make", "Contact: break"} <= set(headings)
    label = page.run("document.querySelector('[for=control-contact-make-position]').textContent")
    assert label == "make: position x0"
    slider = "document.querySelector('[data-key=\"contact.make.position\"]')"
    assert page.run(f"{slider}.closest('.row').querySelector('.unit').textContent") == "µm"
    page.run(f"{slider}.value = 250; {slider}.dispatchEvent(new Event('input'))")
    page.wait(QUIET)
    moved = page.run(f"{STUDIO}.store.state.constants['contact.make.position']")
    assert 0.15e-3 < moved < 0.4e-3
    assert page.run(f"{STUDIO}.frames.motion.contacts[0].position") == moved
    # The contact cannot lie behind the backstop.
    page.run(f"{STUDIO}.store.set({{ constants: {{ 'backstop.position': 1e-4 }} }}); 1")
    page.wait("document.querySelector('.status').textContent.includes('expected a position not before')")
    page.run(f"{STUDIO}.store.set({{ constants: {{}} }}); 1")
    page.wait(QUIET)


HEROES = {
    "One dot": "forces",
    "660 or 700 µs": "map",
    "Buzz printing": "phase",
    "The second dot lost": "map",
    "A strange train": "strobe",
    "Hung up": "map",
}
"""The large view of each story."""


def test_stories_show_what_they_tell_and_figure_6_shows_both_curves(page: Page) -> None:
    """Each story is one click away, and its text and remarks are correct."""
    struck: dict[str, list[bool]] = {}
    force: dict[str, list[float]] = {}
    lost = f"{STUDIO}.views.map.lost()"
    for k, (name, hero) in enumerate(HEROES.items()):
        page.run(f"document.querySelectorAll('.story')[{k}].click()")
        page.wait(SEEN)
        assert name in page.run("document.querySelector('.notice').textContent")
        large = page.run("document.querySelector('.with-hero > .panel:not([hidden])').classList[1]")
        assert large == f"view-{hero}"
        remarks = page.run(f"{STUDIO}.remarks()")
        assert all(0 <= time < 1e-2 for time, _ in remarks)
        assert len(remarks) >= (k != 4)
        assert page.run(f"{STUDIO}.ghosts.length") == (k == 1)
        struck[name] = page.run(f"{STUDIO}.frames.dots.dots.map((dot) => dot.struck)")
        force[name] = page.run(f"{STUDIO}.frames.dots.dots.map((dot) => dot.peak_force ?? 0)")
        if name == "660 or 700 µs":
            for other, said, second in (("700 µs", "lost", False), ("660 µs", "prints again", True)):
                page.wait(f"{STUDIO}.ghosts.length === 1 && {STUDIO}.ghosts[0].name === {other!r}")
                page.wait(f"{STUDIO}.remarks().some(([, text]) => text.includes({said!r}))")
                assert page.run(f"{STUDIO}.frames.dots.dots.map((dot) => dot.struck)") == [True, second]
                first, again = page.run(f"{STUDIO}.frames.dots.dots.map((dot) => dot.peak_force ?? 0)")
                assert (again > first) == second
                interval = 700e-6 if second else 660e-6
                assert page.run(f"1 / {STUDIO}.store.state.rate") == pytest.approx(interval, abs=1e-12)
                page.run("document.querySelector('.notice .switch[aria-pressed=false]').click()")
                page.wait(SEEN)
        if name == "The second dot lost":
            page.wait(f"{STUDIO}.frames.map.detail === 'full' && {lost}.first")
            assert page.run(f"{lost}.list.length") > 100
        if name == "A strange train":
            page.wait(f"{STUDIO}.frames.strobe?.verdict?.verdict === 'strange'")
            page.wait(
                "document.querySelector('.view-strobe .caption').textContent.includes('never repeats itself')"
            )
    low = page.run(
        f"(({{ data, places, fired }}) => Math.min(...[...data.x].filter((_x, k) => data.t[k] > 6e-4"
        f" && data.t[k] < fired.at(-1))) - places.backstop)({STUDIO}.frames.motion)"
    )
    assert low > 0.0
    assert struck["One dot"] == [True]
    assert struck["660 or 700 µs"] == [True, False]
    assert all(struck["Buzz printing"])
    assert all(0.3 < each / force["One dot"][0] < 0.5 for each in force["Buzz printing"][4:])
    assert struck["The second dot lost"][:3] == [True, False, True]
    page.run(f"{STUDIO}.store.set({{ rate: 1000 }}); 1")
    assert page.run(f"{STUDIO}.remarks()") == []
    page.run("document.querySelector('.notice .shut').click()")
    assert page.run(f"{STUDIO}.window === null && {STUDIO}.remarks === null")
    assert not page.run("document.querySelector('.notice').checkVisibility()")
    page.run("document.querySelector('.undo').click()")
    assert page.run(f"{STUDIO}.store.state.rate") == 2200


def test_the_word_is_printed_anew_under_the_finger(page: Page) -> None:
    texts = "window.texts = []; { const { fillText } = CanvasRenderingContext2D.prototype;"
    texts += " CanvasRenderingContext2D.prototype.fillText = function note(text, ...rest)"
    texts += " { window.texts.push(text); return fillText.call(this, text, ...rest); }; } 1"
    page.run(texts)
    box = page.box(".view-map canvas")
    x, (top, bottom) = box["x"] + 300, (box["y"] + 60, box["y"] + 400)
    page.mouse("mousePressed", x, bottom)
    rates = []
    for k in range(5):
        page.mouse("mouseMoved", x, bottom + (top - bottom) * k / 4)
        page.wait(f"!{STUDIO}.busy && {STUDIO}.frames.line.serial === {STUDIO}.frames.motion.serial")
        rates.append(page.run(f"{STUDIO}.store.state.rate"))
    good = page.run(f"{STUDIO}.frames.line.good")
    page.wait(f"window.texts.some((text) => / Hz: {good} of 107 dots good/.test(text))")
    page.mouse("mouseReleased", x, top)
    assert rates == sorted(rates)
    assert rates[-1] > rates[0] + 500


def test_views_suit_the_device(page: Page) -> None:
    choose(page, "bouncing-ball")
    titles = page.run(f"{SHOWN}.map((each) => each.ariaLabel)")
    assert sorted(titles) == ["Ball", "Frequency-time map", "Motion"]
    shown = "[...document.querySelectorAll('.tabs button')].filter((each) => each.checkVisibility())"
    assert page.run(f"{shown}.map((each) => each.textContent)") == ["Map", "Forces", "Phase plane", "Strobe"]
    forces = page.run(f"Object.keys({STUDIO}.views.forces.table())")
    assert forces == ["time [s]", "total [N]", "drive [N]", "spring [N]"]
    captions = page.run(f"{SHOWN}.map((each) => each.querySelector('.caption').textContent).join()")
    status = page.run("document.querySelector('.status').textContent")
    assert "the ball is not at rest" in status
    for word in ("armature", "dot", "backstop", "paper"):
        assert word not in captions + status


def test_a_trace_has_offsets_a_name_a_residual_and_an_undo(page: Page) -> None:
    # The motion itself, 5 um too high and 40 us too late.
    page.run(
        f"{{ const {{ store, frames }} = {STUDIO}; const {{ t, x }} = frames.motion.data;"
        " store.set({ trace: { name: 'scope', t: [...t].map((time) => time + 4e-5),"
        " values: [...x].map((place) => place + 5e-6), dt: -4e-5, dx: 0 } }); } 1"
    )
    residual = "parseFloat(document.querySelector('.residual').textContent.slice(9))"
    assert page.run(residual) == pytest.approx(5.0, abs=0.01)
    page.run(f"{STUDIO}.store.set({{ trace: {{ ...{STUDIO}.store.state.trace, dx: -5e-6 }} }}); 1")
    assert page.run(residual) < 1e-3
    assert page.run("document.querySelector('.trace [type=text]').value") == "scope"
    page.run(f"{STUDIO}.undo(); 1")
    assert page.run(residual) == pytest.approx(5.0, abs=0.01)
    assert page.run(f"{STUDIO}.overlay.data.t.length") > 100
    page.run(f"{STUDIO}.undo(); 1")
    assert page.run(f"{STUDIO}.overlay === null && document.querySelector('.trace').hidden")
    # The link contains a trace as a file would give it, of fewer points than the motion.
    page.run(
        f"{{ const {{ store, frames }} = {STUDIO}; const of = (name) =>"
        " [...frames.motion.data[name]].filter((_each, k) => k % 4 === 0);"
        " store.set({ trace: { name: 'scope', t: of('t').map((time) => time + 4e-5),"
        " values: of('x').map((place) => place + 5e-6), dt: -4e-5, dx: 0 } }); } 1"
    )
    page.wait(f"location.hash.slice(1) === {STUDIO}.link()")
    page.call("Page.reload")
    page.wait("document.querySelector('.residual')?.textContent.startsWith('residual')")
    assert page.run(residual) == pytest.approx(5.0, abs=0.01)
    assert page.run("document.querySelector('.trace [type=text]').value") == "scope"


def test_a_page_that_becomes_wide_or_narrow_shows_what_is_chosen(own_page: Page) -> None:
    page = own_page
    shown = f"{SHOWN}.map((each) => each.classList[1])"
    page.size(390, 844)
    page.wait(f"{shown}.join() === 'view-map'")
    half = page.box(".view-map")
    assert half["width"] * half["height"] > 0.3 * 390 * 844
    assert page.run("document.querySelector('.pinned').checkVisibility()")
    page.run("document.querySelectorAll('.story')[4].click()")
    page.wait(f"{shown}.join() === 'view-strobe'")
    page.size(1440, 900)
    page.wait(f"{shown}.length === 4 && {shown}.includes('view-strobe')")
    assert not page.run("document.querySelector('.pinned').checkVisibility()")
    page.run("document.querySelector('[data-tab=forces]').click(); 1")
    assert "view-forces" in page.run(shown)
    assert "view-strobe" not in page.run(shown)


def test_a_state_that_follows_another_is_marked_while_it_takes_long(own_page: Page) -> None:
    page = own_page
    page.run(
        "{ const { accept } = window.studio; let first = true; window.held = [];"
        " window.studio.accept = (frame) => { if (frame.kind !== 'motion' || first) accept(frame);"
        " else window.held.push(() => accept(frame));"
        " if (frame.kind === 'motion') first = false; };"
        f" {STUDIO}.store.set({{ rate: 900 }}); {STUDIO}.store.set({{ rate: 950 }}); }} 1"
    )
    page.wait("window.held.length === 1")
    page.wait("document.querySelector('.view-motion.outdated') !== null")
    seen = "getComputedStyle(document.querySelector('.view-motion .body > *')).opacity"
    assert float(page.run(seen)) < 0.5
    said = "getComputedStyle(document.querySelector('.view-motion'), '::after')"
    assert "for what is set now" in page.run(f"{said}.content")
    assert page.run(f"{said}.display") != "none"
    assert page.run(f"{STUDIO}.frames.motion.fired[1]") == pytest.approx(1 / 900)
    page.run("window.held[0](); 1")
    page.wait("!document.querySelector('.view-motion.outdated')")
    assert page.run(f"{STUDIO}.frames.motion.fired[1]") == pytest.approx(1 / 950)


def test_files_dropped_together_are_asked_about_one_after_the_other(page: Page) -> None:
    """Two tables without units: each table opens its own dialog."""
    title = "document.querySelector('dialog[open] h2')?.textContent ?? ''"
    page.run(
        "(() => { const files = new DataTransfer();"
        " const text = 'time,displacement\\n0,50\\n10,51\\n20,52\\n';"
        " for (const name of ['one.csv', 'two.csv']) files.items.add(new File([text], name));"
        " const event = new DragEvent('drop', { dataTransfer: files, bubbles: true, cancelable: true });"
        " document.querySelector('.studio').dispatchEvent(event); })()"
    )
    for name in ("one.csv", "two.csv"):
        page.wait(f"({title}).includes('{name}')")
        page.run("document.querySelector('dialog[open] button[value=use]').click()")
        page.wait(f"window.studio.studio.store.state.trace?.name === '{name}'")
    assert page.complaints == []
