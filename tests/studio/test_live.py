"""The page that computes by itself: its reader of states beside Python's, and the page opened from a file."""

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.studio.browser import Page
from tests.studio.server import STATE
from tests.studio.test_state import JSON, SAMPLES

import printhammer as ph
from printhammer.printing.page.page import print_page
from printhammer.printing.page.pattern import Pattern
from printhammer.studio.bundle import merged
from printhammer.studio.live import content_of, live_page
from printhammer.studio.states.controls import fields_of
from printhammer.studio.states.shelf import Shelf
from printhammer.studio.states.state import READERS, VIEWS, ProtocolError, read_state

NAME = "hendriks-1983-1"


class OneHammer(Shelf):
    """A shelf with one hammer, whose module is all that has to be linked."""

    names = (NAME,)  # type: ignore[assignment]


READ = """
const { createInterface } = require("node:readline");
let readers;
createInterface({ input: process.stdin }).on("line", (line) => {
  const { limits, vocabulary, state } = JSON.parse(line);
  if (limits) { readers = readersOf(limits, vocabulary); console.log("0"); return; }
  try { readState(state, readers); console.log(JSON.stringify("")); }
  catch (error) {
    if (!(error instanceof Refusal)) throw error;
    console.log(JSON.stringify(error.message));
  }
});
"""


class Reader:
    """The reader of the page in Node."""

    def __init__(self) -> None:
        self.process = subprocess.Popen(
            ["node", "--eval", merged("engine/read.js") + READ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        content = content_of(OneHammer(), hammers=False)
        self.ask({name: content[name] for name in ("limits", "vocabulary")})

    def ask(self, message: dict[str, Any]) -> Any:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        print(json.dumps(message), file=self.process.stdin, flush=True)
        return json.loads(self.process.stdout.readline())


@pytest.fixture(scope="module")
def reader() -> Any:
    made = Reader()
    yield made
    assert made.process.stdin is not None
    assert made.process.stdout is not None
    made.process.stdin.close()
    made.process.stdout.close()
    assert made.process.wait(20) == 0


WAVES = [
    SAMPLES,
    fields_of(ph.load(NAME).waveform),
    fields_of(ph.load("relay-5v").waveform),
    {"shape": "half-sine", "amplitude": 101.0, "width": 1e-3, "quantity": "current"},
    {"shape": "half-sine", "amplitude": 101.0, "width": 1e-3, "quantity": "voltage"},
    {"shape": "half-sine", "amplitude": 1.0, "width": 0.51, "quantity": "force"},
    {"shape": "half-sine", "amplitude": 1.0, "quantity": "force"},
    {"shape": "half-sine", "amplitude": 1.0, "width": 0.1, "quantity": "force", "colour": 1},
    {"shape": "constructor"},
]
VALUES = st.sampled_from(
    [0, 1, 64, 65, 9.5, 10.0, 2e4, 2.1e4, -1, "", "101", "000", "12", "add", "x" * 201, [], ["map"], ["sky"]]
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(key=st.sampled_from(sorted(STATE)), value=VALUES | st.sampled_from(WAVES) | JSON)
def test_the_page_takes_what_python_takes_and_refuses_the_rest(reader: Reader, key: str, value: Any) -> None:
    try:
        written = json.dumps({**STATE, key: value}, allow_nan=False)
    except ValueError:
        return
    state = json.loads(written)
    try:
        read_state(state)
        refused = ""
    except ProtocolError as error:
        refused = str(error)
    assert bool(reader.ask({"state": state})) == bool(refused)


@pytest.mark.parametrize("wave", WAVES)
def test_a_pulse_is_read_as_python_reads_it(reader: Reader, wave: Any) -> None:
    try:
        READERS["waveform"](wave)
        refused = ""
    except ProtocolError as error:
        refused = str(error)
    assert reader.ask({"state": {**STATE, "waveform": wave}}) == refused


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("live") / "page.html"
    path.write_text(live_page(OneHammer()), "utf-8")
    return path


def test_the_script_of_workers_declares_no_name_twice() -> None:
    script = f"new Function({json.dumps(merged('engine/worker.js'))});"
    assert subprocess.run(["node", "--eval", script], check=False).returncode == 0


WHOLE = "window.studio?.studio?.frames.map?.detail === 'full'"
WHOLE += (
    " && window.studio.studio.frames.strobe?.data.x.length === 400 && !document.querySelector('.outdated')"
)


@pytest.fixture
def live(written: Path, opened_browser: Any) -> Any:
    page = opened_browser()
    page.size(1280, 720)
    page.open(f"{written.as_uri()}#views={'-'.join(VIEWS)}")
    page.wait(WHOLE)
    yield page
    assert page.complaints == []
    assert [place for place in page.requests if not place.startswith(("blob:", "file:", "data:"))] == []
    page.call("Page.close")


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


@pytest.mark.slow
def test_a_rate_is_followed_and_a_superseded_state_dropped(live: Page) -> None:
    script = "for (let rate = 900; rate <= 1000; rate += 1) window.studio.studio.store.set({ rate }); 1"
    live.run(script)
    live.wait("window.studio.studio.frames.motion.fired[1] === 1e-3 && !window.studio.studio.busy")
    live.wait(WHOLE)
    live.run("window.studio.studio.store.set({ pattern: '1101' }); 1")
    live.wait("window.studio.studio.frames.motion.fired.length === 3")
    live.wait(f"window.studio.studio.frames.map.pattern === '1101' && {WHOLE}")


@pytest.mark.slow
def test_changed_constants_and_pulses_are_computed_as_by_python(live: Page) -> None:
    hammer = ph.load(NAME)
    wide = hammer.waveform.model_copy(update={"width": 1.1 * hammer.waveform.width})
    heavy = hammer.replace({"mass": 1.1 * hammer.mass})
    thick = hammer.replace({"pack.front": 1.05 * hammer.pack.front})
    for changed, wave, patch in (
        (heavy, hammer.waveform, {"constants": {"mass": heavy.mass}}),
        (thick, hammer.waveform, {"constants": {"pack.front": thick.pack.front}}),
        (hammer, wide, {"constants": {}, "waveform": fields_of(wide)}),
        (hammer, hammer.waveform, {"constants": {}, "waveform": None}),
    ):
        before = live.run("window.studio.studio.frames.dots.serial")
        live.run(f"window.studio.studio.store.set({json.dumps(patch)}); 1")
        live.wait(f"window.studio.studio.frames.dots.serial !== {before} && !window.studio.studio.busy")
        shown = live.run("window.studio.studio.frames.dots.dots[0]")
        dot = ph.simulate(changed, ph.PulseTrain(wave, rate=1200.0, pulses=9)).dots[0]
        assert shown["flight_time"] == pytest.approx(dot.flight_time, rel=1e-4)
        assert shown["peak_force"] == pytest.approx(dot.peak_force, rel=1e-3)
    live.wait(WHOLE)


SHOWN = "[...document.querySelectorAll('.panel')].filter((each) => each.checkVisibility())"
SHOWN += ".map((each) => each.classList[1])"


@pytest.mark.slow
def test_it_opens_with_four_views_and_on_a_phone_with_one(written: Path, opened_browser: Any) -> None:
    for width, count in ((1440, 4), (390, 1)):
        page = opened_browser()
        page.size(width, 900)
        page.open(written.as_uri())
        page.wait("window.studio?.studio?.frames.map?.detail === 'full'")
        assert len(page.run(SHOWN)) == count
        half = page.box(".view-map")
        assert half["width"] * half["height"] > 0.3 * width * 900
        page.run("document.querySelector('[data-tab=forces]').click(); 1")
        assert "view-forces" in page.run(SHOWN)
        assert "view-map" not in page.run(SHOWN)
        assert page.run("document.querySelector('.pinned').checkVisibility()") is (width == 390)
        assert page.complaints == []
        page.call("Page.close")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("link", "reason"),
    [
        ("pulses=999&pattern=zzz", "pulses is expected to be a whole number from 1 to 64"),
        ("hammer=no-such", f"{NAME} is shown instead"),
        ("text=<img src=x onerror=alert(1)>", "opened by `printhammer studio FILE`"),
        ("mass=1", "mass = 1 kg: expected"),
        ("__proto__=5&views=sky", "views is expected to be one of"),
    ],
)
def test_a_hostile_link_does_no_harm(written: Path, opened_browser: Any, link: str, reason: str) -> None:
    page = opened_browser()
    page.open(f"{written.as_uri()}#{link}")
    page.wait("window.studio?.studio?.frames.motion")
    assert reason in page.run("document.querySelector('.status').textContent")
    assert page.run("document.querySelectorAll('#studio img').length") == 0
    assert page.complaints == []
    page.call("Page.close")
