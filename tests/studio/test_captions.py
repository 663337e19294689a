"""Texts of captions and controls, in Node: modules of the page without a page."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.studio.reading import evaluated, without_modules

from printhammer.hammer.hammer import load
from printhammer.studio import Shelf
from printhammer.studio.live import content_of

SAY = """
const { captionOf } = await import("./captions.js");
const floats = ([name, list]) => [name, Float32Array.from(list)];
const seen = ({ view, frames, rigid, first }) => {
  for (const frame of Object.values(frames)) {
    if (frame.data) frame.data = Object.fromEntries(Object.entries(frame.data).map(floats));
  }
  if (frames.map) frames.map.data.codes.shape = [512, 512];
  const store = { state: { rate: 1000, line: "" } };
  const studio = { frames, described: { rigid }, store, views: { map: { lost: () => ({ first }) } } };
  return captionOf(view, studio).replaceAll("\\u00a0", " ");
};
console.log(JSON.stringify(%s.map(seen)));
"""
FORCES = {f"F {name}": [0.0, 0.0] for name in ("backstop", "damping", "pack")}
PLACES = {"backstop": 0.0, "front": 1e-4, "platen": 2e-4}
MAP = {"reason": "", "front": 1e-4, "data": {"codes": [0], "struck": [1]}}


def motion(x: tuple[float, ...] = (0.0, 0.0), **more: Any) -> dict[str, Any]:
    data = {"t": [0.0, 1e-3], "x": x, "v": [0.0, 1.0], **FORCES}
    return {"fired": [0.0], "places": PLACES, "data": data, **more}


def dots(*rows: tuple[float, float, float]) -> dict[str, Any]:
    listed = [
        {"struck": True, "flight_time": flight, "loading_work": work, "net_loss": loss}
        for flight, work, loss in rows
    ]
    return {"dots": listed, "quality": {"struck": len(rows)}, "energy": {}}


def said(modules: Path, *cases: dict[str, Any]) -> list[str]:
    filled = [{"rigid": False, "first": None, **case} for case in cases]
    return list(evaluated(modules, SAY % json.dumps(filled)))


def test_captions_claim_only_what_was_computed(modules: Path) -> None:
    coarse = {**MAP, "data": {"codes": [0]}}
    whole, lost = {**MAP}, {"dot": 5, "rate": 1450.1}
    end_at_pole = motion((0.0, 1.5e-4))
    back = motion((0.0, 1.5e-4, 1e-6), data={"t": [0, 1, 2], "x": [0, 1.5e-4, 1e-6], "v": [0, 1, 0]})
    texts = said(
        modules,
        {"view": "map", "frames": {"motion": motion(), "map": coarse}},
        {"view": "map", "frames": {"motion": motion(), "map": whole}},
        {"view": "map", "frames": {"motion": motion(), "map": whole}, "first": lost},
        {"view": "forces", "frames": {"motion": motion()}, "rigid": True},
        {"view": "loops", "frames": {"motion": motion()}, "rigid": True},
        {"view": "phase", "frames": {"motion": end_at_pole}},
        {"view": "phase", "frames": {"motion": back}},
    )
    assert "lost" not in texts[0]
    assert "At none of the 512 rates of the map a dot is lost." in texts[1]
    assert "1450 Hz is the lowest with a lost dot: the fifth." in texts[2]
    assert "N at the backstop" not in texts[3] + texts[4]
    assert "rigid" in texts[3]
    assert "back to the backstop" not in texts[5]
    assert "back to the backstop" in texts[6]


def test_a_sinusoidal_force_has_periods_and_no_firings(modules: Path) -> None:
    def strobe(verdict: str) -> dict[str, Any]:
        return {"status": "ok", "verdict": {"verdict": verdict, "exponent_per_firing": 0.5}}

    sine = motion(sine=1.0)
    texts = said(
        modules,
        *(
            {"view": "strobe", "frames": {"motion": sine, "strobe": strobe(verdict)}}
            for verdict in ("period-1", "period-3", "strange", "undecided")
        ),
        {"view": "strobe", "frames": {"motion": motion(), "strobe": strobe("period-3")}},
    )
    assert not any("firing" in text for text in texts[:4])
    assert "as many periods of the force" in texts[1]
    assert "as many firings" in texts[4]


def test_a_flight_too_short_and_a_dot_pushed_again_are_told_apart(modules: Path) -> None:
    soon = dots((2.8e-4, 1.0, 0.7), (6.81e-7, 1.0, 0.7), (2.5e-4, 1.0, 0.7))
    again = dots((2.8e-4, 1.0, 0.7), (2.8e-4, 1.0, 1.2))
    texts = said(
        modules,
        {"view": "motion", "frames": {"motion": motion(), "dots": soon}},
        {"view": "energy", "frames": {"motion": motion(), "dots": soon}},
        {"view": "energy", "frames": {"motion": motion(), "dots": again}},
    )
    assert "From firing to paper 2.5e-4 to 2.8e-4" in texts[0]
    assert "one touch too soon after a firing to be its own" in texts[0]
    assert "keeps 70 %" in texts[1]
    assert "%" not in texts[2]
    assert "pushed again" in texts[2]


WORDS = """
const { worded, burstText, said } = await import("./captions.js");
const dots = [{ struck: true }, { struck: false }];
const burst = burstText({ dots });
const relay = { strike: "closing", struck: "pole" };
console.log(JSON.stringify([
  worded(burst, "closing"), worded("Dot to paper", "hit"), burstText({ dots }, true),
  said("Dot to paper", relay), said("back at the backstop", { strike: "dot", mover: "ball" }),
]));
"""


def test_a_device_has_its_own_word_and_an_oscillator_loses_no_dot(modules: Path) -> None:
    closing, hit, firings, pole, table = evaluated(modules, WORDS)
    assert closing == "Two closings, the second lost"
    assert hit == "Hit to pack"
    assert firings == "Two firings"
    assert pole == "Closing to pole"
    assert table == "back at the table"


NAMES = """
const { titleOf, viewsOf, moverOf, openingOf } = await import("./words.js");
const device = (mover, strike, front, rigid, ...sections) => ({
  mover, strike, rigid, places: { backstop: 0, front }, constants: sections.map((section) => ({ section })),
});
const devices = [
  { ...device("block", "dot", null, true), views: ["line", "phase", "motion"] },
  { ...device("block", "dot", null, true), views: ["line"] },
  device("armature", "dot", 1, false, "magnet", "pack"),
  device("armature", "closing", 1, true, "magnet", "pack"),
  device("ball", "dot", null, true), device("mass", "dot", null, true),
];
console.log(JSON.stringify(devices.map((each) => ({
  views: viewsOf(each), opening: openingOf(each), mover: moverOf(each),
  titles: viewsOf(each).map((view) => titleOf(view, each)),
}))));
"""


def test_views_and_titles_suit_the_device(modules: Path) -> None:
    block, empty, hammer, relay, ball, oscillator = evaluated(modules, NAMES)
    assert block["views"] == ["phase", "motion"]
    assert block["opening"] == ["motion", "phase"]
    # A list of which no view is possible says nothing.
    assert empty["views"] == ball["views"]
    assert hammer["opening"] == ball["opening"] == ["motion", "sketch", "map", "line"]
    assert len(hammer["views"]) == len(relay["views"]) == 9
    assert {"Printed line", "Energy per dot", "Actuator"} <= set(hammer["titles"])
    assert {"Closings", "Energy per closing", "Actuator"} <= set(relay["titles"])
    for textbook, mover in ((ball, "ball"), (oscillator, "mass")):
        assert textbook["mover"] == mover
        assert set(hammer["views"]) - set(textbook["views"]) == {"line", "energy", "loops"}
        assert mover.capitalize() in textbook["titles"]


MOVE = """
const { moving } = await import("./controls.js");
const constants = [
  { key: "platen", value: 4, low: 2, high: 5 }, { key: "pack.front", value: 2, low: 1, high: 2.5 },
  { key: "pack.thickness", value: 2, low: 1, high: 3 },
];
const studio = { described: { constants }, store: { state: { constants: {} } } };
const controls = [
  moving({ value: 4, moves: { platen: 1, "pack.front": 1 } }, studio),
  moving({ value: 2, moves: { "pack.thickness": 1, "pack.front": -1 } }, studio),
];
for (const [which, wanted] of %s) Object.assign(studio.store.state, controls[which].set(wanted));
console.log(JSON.stringify(studio.store.state.constants));
"""


def test_two_controls_that_move_a_constant_leave_it_in_its_range(modules: Path) -> None:
    steps = [[int(k % 2), float(w)] for k, w in enumerate(np.random.default_rng(1).uniform(-9.0, 9.0, 40))]
    for count in (1, 2, 3, 40):
        found = evaluated(modules, MOVE % json.dumps(steps[:count]))
        assert 2.0 <= found.get("platen", 4.0) <= 5.0
        assert 1.0 <= found["pack.front"] <= 2.5
        assert 1.0 <= found.get("pack.thickness", 2.0) <= 3.0


SECTION = """
const { sectionEnds } = await import("./planes.js");
console.log(JSON.stringify(%s.map((values) => sectionEnds(values, [0, 10]))));
"""


def test_a_strobe_section_is_scaled_to_its_settled_points(modules: Path) -> None:
    settling = [9.0] * 100
    attractor = [4.0 + 0.01 * k for k in range(100)]
    ends = evaluated(modules, SECTION % [settling + 2 * attractor, settling + 200 * [4.0], [4.0, 7.0]])
    # A point alone is drawn in the middle of 5 % of the extent of the run.
    np.testing.assert_allclose(ends, [[4.0, 4.99], [3.75, 4.25], [4.0, 7.0]])


LINK = """
const { fromText, toText, START } = await import("./state.js");
const [state, start] = %s;
console.log(JSON.stringify(fromText(toText({ ...START, ...state }, start))));
"""


def test_a_link_states_every_entry_that_the_hammer_would_set(modules: Path) -> None:
    """Entries equal to the initial entries of a page, for a hammer with other initial entries."""
    start = {"rate": 20.0, "pulses": 3, "low": 10.0, "line": ""}
    assert evaluated(modules, LINK % json.dumps([{"rate": 1200}, start])) == {
        "rate": 1200,
        "pulses": 9,
        "low": 500,
        "line": "HAMMER",
    }


TRACE = """
const { toText, traceOf, START } = await import("./state.js");
const written = (trace) => new URLSearchParams({ trace: JSON.stringify(trace) }).toString();
const answer = (text) => { try { return traceOf(text); } catch ({ message }) { return message; } };
const [trace, wrong] = %s;
const text = toText({ ...START, trace });
const refused = wrong.map((each) => answer(written(each)));
console.log(JSON.stringify([answer(text), answer(""), text.length, ...refused]));
"""


def test_a_trace_travels_in_a_link(modules: Path) -> None:
    """With 9 digits of time and 6 of displacement; other formats are rejected."""
    times = 0.1 + np.arange(2000) * 1e-7
    trace = {"name": "scope", "t": times.tolist(), "values": (1e-4 * np.sin(1e6 * times)).tolist()}
    trace |= {"dt": -0.1, "dx": 2e-6}
    small = {**trace, "t": [0.0, 1.0], "values": [0.0, 1.0]}
    wrong = [
        None,
        [],
        "scope",
        {**trace, "t": []},
        {**small, "t": [0.0, 0.0]},
        {**small, "t": [1.0]},
        {**small, "values": [0.0, "1"]},
        {**small, "values": [0.0, 1e10]},
        {**small, "values": [0.0, None]},
        {**small, "dt": None},
        {**small, "name": 1},
        {**small, "t": list(range(2001)), "values": list(range(2001))},
    ]
    found, none, length, *refused = evaluated(modules, TRACE % json.dumps([trace, wrong]))
    assert none is None
    assert length < 100_000
    assert (found["name"], found["dt"], found["dx"]) == ("scope", -0.1, 2e-6)
    np.testing.assert_allclose(found["t"], times, rtol=1e-8)
    np.testing.assert_allclose(found["values"], trace["values"], rtol=1e-5)
    assert len(refused) == len(wrong)
    assert all(isinstance(text, str) and text.startswith("trace is expected") for text in refused)


SHAPES = """
const { isOffered } = await import("./pulses.js");
const [hammers, { shapes, drivers }] = %s;
const offered = hammers.map(({ described, modules }) => {
  const store = { state: { constants: {} } };
  const coil = described.constants.some(({ section }) => section === "magnet");
  const studio = { described, shapes, drivers, store, quantity: () => (coil ? "current" : "force") };
  const { waveform } = described.waveform ? described : described.start;
  return Object.keys(shapes).filter((shape) => isOffered(studio, shape, waveform));
});
console.log(JSON.stringify(offered));
"""


def test_only_pulses_are_offered_whose_kernel_the_page_has(
    modules: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_modules(monkeypatch)
    names = ("hendriks-1983", "hendriks-1983-1", "braille-embosser", "tung-shaw-1988")
    content = content_of(Shelf(*map(load, names), only=True))
    given = [list(content["hammers"].values()), content["vocabulary"]]
    drivers, every = set(content["vocabulary"]["drivers"]), set(content["vocabulary"]["shapes"])
    first, second, braille, oscillator = map(set, evaluated(modules, SHAPES % json.dumps(given)))
    assert first == second == every
    assert braille == drivers | {"sampled"}
    assert oscillator == every - drivers
