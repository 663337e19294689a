"""Every device in every verb: device defaults, and errors that name the missing part and the option."""

import math
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.text import Text
from tests import hammers
from tests.errors import refused

import printhammer as ph
from printhammer.control.learning.preparation import default_rate
from printhammer.control.least_work.burst import least_work
from printhammer.control.pulses import LARGEST_CURRENT, current_bound
from printhammer.drive.waveforms.drivers import Rail
from printhammer.figures import FIGURES
from printhammer.maps.frequency import HIGHEST, LOWEST, default_rates
from printhammer.printing.dots.judging import Limits, judge
from printhammer.printing.dots.nominal import SinglePulse
from printhammer.printing.dots.settling import undisturbed_rate
from printhammer.printing.rates.safe_rate import FIRST, LAST, STEP, grid_of
from printhammer.run import window

PAPER = 0.28e-3


def timed(monkeypatch: pytest.MonkeyPatch, flight: float) -> None:
    """Replace the simulation of the single pulse by a given flight time [s]."""
    monkeypatch.setattr(window, "window_of", lambda *_: window.Window(20.0 * flight, flight))


@pytest.mark.parametrize("scale", [1.0, 2.0, 5.0, 20.0, 100.0])
def test_default_rates_go_by_the_flight_time(scale: float, monkeypatch: pytest.MonkeyPatch) -> None:
    hammer = hammers.crude()
    timed(monkeypatch, 1.1 * PAPER * scale)
    assert window.time_scale(hammer) == scale
    assert default_rates(hammer, count=2).tolist() == [LOWEST / scale, HIGHEST / scale]
    grid, step = grid_of(hammer, None, None, None)
    assert (grid[0], step) == (FIRST / scale, STEP / scale)
    assert math.isclose(grid[-1], LAST / scale)
    # What is stated is not scaled.
    assert grid_of(hammer, "200 Hz", 400.0, None, 50.0 * scale)[0].tolist() == [
        200.0,
        250.0,
        300.0,
        350.0,
        400.0,
    ]


def test_pulses_at_the_default_rate_of_learning_interact() -> None:
    relay, paper = ph.load("relay-5v"), ph.load("hendriks-1983-1")
    rate = default_rate(relay, "own", current_bound(relay))
    # `tune` refuses rates at which the relay is at rest before the next pulse, and names the lowest rate.
    with pytest.raises(ph.InputError) as refusal:
        ph.tune(relay, rate=0.79 * rate)
    lowest = float(refusal.value.expected.removeprefix("a rate above ").removesuffix(" Hz"))
    assert rate == pytest.approx(1.25 * lowest, rel=1e-3)
    assert default_rate(paper, "switch", current_bound(paper)) == 1275.0


def test_learning_takes_driver_and_current_from_the_device() -> None:
    for learner in (ph.learn, ph.tune):
        with pytest.raises(ph.InputError) as refusal:
            learner(ph.load("relay-5v"), rate=1.0)
        assert refusal.value.expected.startswith("a rate above ")


def test_a_long_pulse_makes_a_device_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    timed(monkeypatch, math.nan)
    pulse = Rail(voltage=5.0, width=40.0 * PAPER)
    assert window.time_scale(hammers.crude(), pulse) == 20.0
    # Pulses at the highest default rate do not run into each other.
    assert HIGHEST / window.time_scale(hammers.crude(), pulse) * pulse.width < 1.2


def test_bounces_of_the_single_pulse_are_no_fault_of_others() -> None:
    dots: Any = SimpleNamespace(
        fired=np.ones((1, 2), bool),
        struck=np.ones((1, 2), bool),
        fired_at=np.array([[0.0, 1.0]]),
        flight_time=np.full((1, 2), 1e-3),
        peak_force=np.full((1, 2), 20.0),
        extra_contacts=np.array([[2, 3]]),
    )
    single = SinglePulse(20.0, 1e-3, extra_contacts=2)
    seen = judge(dots, np.ones((1, 2), bool), dots.fired_at, single, Limits())
    assert seen.extra_contacts.tolist() == [[0, 1]]
    assert seen.good.tolist() == [[True, False]]
    assert judge(dots, seen.wanted, dots.fired_at, single, Limits(extra_contacts=1)).passed.all()


def test_the_bound_on_the_current_is_that_of_the_device() -> None:
    hammer = hammers.crude()
    assert current_bound(hammer) == LARGEST_CURRENT
    strong = hammer.replace({"waveform.amplitude": 3.0})
    assert strong.waveform.peak <= current_bound(strong) <= strong.waveform.peak + 0.11
    assert current_bound(strong, "1.5 A") == 1.5


@pytest.mark.parametrize(
    "words",
    [
        ("run", "relay-5v"),
        ("map", "relay-5v", "--rates", "2", "--times", "4"),
        ("quality", "relay-5v", "--rate", "10 Hz", "--pattern", "11"),
        ("duty", "relay-5v", "--thermal-resistance", "12 K/W", "--limit", "91 degC", "--ambient", "25 degC"),
        ("strobe", "relay-5v", "--period", "60 ms", "--points", "3", "--no-verdict"),
        ("basins", "relay-5v", "--quench", "--gaps", "10 ms, 20 ms, 2", "--widths", "10 ms, 20 ms, 2"),
    ],
)
def test_answers_about_a_relay_speak_of_closings(cli: Callable[..., Any], words: tuple[str, ...]) -> None:
    done = cli(*words)
    assert done.status == 0
    assert not re.search(r"\b(dots?|print(s|ed)?|paper|engraved)\b", done.out + done.err)
    assert words[0] == "strobe" or "closing" in done.out


def test_the_summary_and_the_files_of_a_relay_state_its_switching_times(
    cli: Callable[..., Any], tmp_path: Path
) -> None:
    table, picture = tmp_path / "timings.csv", tmp_path / "timings.svg"
    done = cli("run", "relay-5v", "--timings", table, "--timings", picture)
    assert done.status == 0
    for said in (
        "contact make",
        "contact break",
        "after switch-on",
        "after switch-off",
        "bounces for",
    ):
        assert said in " ".join(done.out.split())
    assert "operate_time [s]" in table.read_text("utf-8")
    assert "Time" in picture.read_text("utf-8")
    short = cli("run", "relay-5v", "--duration", "19 ms")
    assert "before the release of make and break" in " ".join(short.out.split())


def test_pictures_and_pages_of_a_relay_speak_of_closings() -> None:
    relay = ph.load("relay-5v")
    report = ph.quality(relay, 10.0, pattern="11")
    page = ph.print_page(relay, "I", 10.0)
    chart = ph.frequency_map(relay, [10.0], pulses=2, times=8)
    figures = [report.plot(), page.plot(), page.plot(view="zoom"), FIGURES[9].draw(relay, chart=chart)]
    texts = [text.get_text() for figure in figures for text in figure.findobj(Text)]
    said = "\n".join([*texts, repr(page), page.summary()._repr_html_(), repr(report)])
    assert not re.search(r"\b([Dd]ots?|[Pp]rint(s|ed))\b", said)
    assert said.count("closing") > 10


def test_refusals_of_a_relay_speak_of_closings(cli: Callable[..., Any]) -> None:
    done = cli("energy", "relay-5v", "--dots", "1")
    assert done.status == 2
    assert not re.search(r"(?<!-)\bdots?\b", done.err)


def test_the_noun_for_a_strike_is_no_physics() -> None:
    relay = ph.load("relay-5v")
    assert relay.strike == "closing"
    assert hammers.crude().strike == "dot"
    other = relay.replace("strike", "click")
    assert other.strike == "click"
    assert other.fingerprint == relay.fingerprint
    with refused("strike"):
        relay.replace("strike", "Two words")


def test_words_and_units_of_the_studio_are_no_physics() -> None:
    ball = ph.load("bouncing-ball")
    assert (ball.mover, ball.struck, ball.shown_units) == ("ball", "", {"m": "mm", "s": "ms"})
    assert hammers.crude().mover == "armature"
    other = ball.replace("length_unit", "m").replace("struck", "floor").replace("mover", "drop")
    assert (other.mover, other.struck, other.shown_units["m"]) == ("drop", "floor", "m")
    assert other.fingerprint == ball.fingerprint
    for key, value in (("mover", "A ball"), ("struck", "2"), ("length_unit", "km"), ("time_unit", "um")):
        with refused(key):
            ball.replace(key, value)


def test_views_of_the_studio_are_listed_in_the_file() -> None:
    block, ball = ph.load("housner-1963"), ph.load("bouncing-ball")
    assert block.views == ("phase", "motion", "sketch", "forces")
    assert ball.views == ()
    other = ph.Hammer.from_toml(ball.replace("views", ["map", "line"]).to_toml())
    assert other.views == ("map", "line")
    assert other.fingerprint == ball.fingerprint
    assert other.replace("views", None).views == ()
    for views in ([], "map", ["map", "map"], ["plan"], [1], [["map"]]):
        with refused("views", value=views):
            ball.replace("views", views)


def test_pulses_that_do_not_interact_need_no_table() -> None:
    """The relay is exactly at rest 34 ms after a pulse."""
    relay = ph.load("relay-5v")
    slowest = undisturbed_rate(relay)
    assert 25.0 < slowest < 30.0
    dots = ph.simulate(relay, ph.PulseTrain(relay.waveform, rate=slowest, pulses=3)).dots
    flights = [dot.flight_time for dot in dots]
    # Sums of times differ in the last bits.
    np.testing.assert_allclose(flights, flights[0], rtol=1e-9)
    assert undisturbed_rate(hammers.crude()) == 0.0
    with refused("rate", value=20.0):
        ph.tune(relay, rate="20 Hz")


@pytest.mark.slow
def test_the_safe_rate_of_a_device_begins_where_pulses_interact() -> None:
    peen = ph.load("dot-peen")
    found = ph.safe_rate(peen, long=False)
    assert found.rates[0] <= undisturbed_rate(peen) < found.rates[1]
    first, last = float(found.rates[0]) - 0.5, float(found.rates[-1])
    whole = ph.safe_rate(peen, first=first, last=last, step=0.5, long=False)
    assert whole.rate == found.rate
    assert whole.failure == found.failure


def test_a_burst_needs_a_current() -> None:
    device = ph.load("relay-5v")
    with refused("waveform", file="relay-5v.toml"):
        least_work(device, 20.0, dots=1)


@pytest.mark.parametrize("name", ["impact-wire", "dot-peen", "relay-5v"])
def test_a_record_of_the_current_is_as_long_as_the_pulse(name: str) -> None:
    """The window contains the touch and the end of the pulse, and is 4 ms for a fast device."""
    hammer = ph.load(name)
    (dot,) = ph.simulate(hammer, ph.PulseTrain(hammer.waveform)).dots
    times = ph.measure("current", hammer, sensor={"sampling_rate": "100 kHz"}).values["time"]
    width: float = hammer.waveform.width  # type: ignore[union-attr]
    assert times[-1] > max(float(dot.flight_time or math.inf), width)
    assert bool(abs(times[-1] - 4e-3) < 1e-6) is (name == "impact-wire")


@pytest.mark.parametrize("verb", ["quality pot-magnet --rate 3Hz --pattern 11", "map pot-magnet --rates 2"])
def test_a_device_whose_armature_does_not_return_says_so(cli: Callable[..., Any], verb: str) -> None:
    outcome = cli(*verb.split())
    assert "is not at rest, but 100 % of the stroke away: a pull-in" in " ".join(outcome.out.split())
    assert "of the stroke away" not in cli(*verb.replace("pot-magnet", "relay-5v").split()).out


def test_whole_parameter_values_are_written_out(cli: Callable[..., Any]) -> None:
    """Periods from 80 ms to 140 ms, in steps that two digits resolve."""
    options = ["--values", "4", "--firings", "30", "--refine", "0", "--no-exponents"]
    assert not re.search(r"e\+\d", cli("bifurcation", "pot-magnet", *options).out)
