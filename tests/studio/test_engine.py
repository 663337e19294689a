"""Order in which the page shows maps and sections; the test itself answers the jobs of the workers."""

from pathlib import Path
from typing import Any

from tests.studio.reading import evaluated

ENGINE = """
const { engineOf } = await import("./engine/engine.js");
const state = {
  hammer: "one", text: "", constants: {}, waveform: null, rate: 900, pulses: 1, pattern: "", overlap: "add",
  low: 500, high: 1000, line: "", views: ["map"],
};
const described = { constants: [], open: [], waveform: {}, places: {} };
const shelf = {
  names: ["one"], hammers: { one: { described, modules: { force: 0 } } }, quantity: () => "force",
  limits: { PREVIEW: { false: [2, 2] }, FULL: [4, 4], POINTS_OF_SECTION: [], LONGEST_REASON: 99 },
  readers: Object.fromEntries(Object.keys(state).map((key) => [key, (entry) => entry])),
};
const orders = [];
const order = (_team, work, asked, _more, wanted, done, onward) => {
  if (wanted()) orders.push({ work, state: asked, done, onward });
  else done(null);
};
const shown = [];
const receive = ({ kind, serial, detail, reason }) => {
  if (kind === "map" || kind === "strobe") shown.push([serial, reason || (detail ?? kind)]);
};
const send = engineOf(shelf, "", receive, null, { count: 1, send: order });
const pause = () => new Promise((next) => { setTimeout(next, 0); });
const CODES = { low: 0, high: 1, data: { codes: {} } };
const PIECE = { x: [0], ok: [true], end: 1, places: {}, struck: null };
const CURVES = [{ kind: "motion" }, { kind: "dots" }];
const ANSWERS = { curves: CURVES, piece: [PIECE], codes: [CODES], section: [] };
const set = async (serial, patch) => {
  send(JSON.stringify({ kind: "state", serial, state: { ...state, ...patch } }));
  await pause();
};
/** Answer the first order of a work for a map from a rate; returns whether there is one. */
const answer = async (work, low) => {
  const place = orders.findIndex((order) => order.work === work && order.state.low === low);
  if (place < 0) return false;
  const [order] = orders.splice(place, 1);
  // A section comes in frames on the way, and its end has none.
  if (work === "section") order.onward({ frame: { kind: "strobe", data: {} } });
  order.done({ frames: structuredClone(ANSWERS[work]) });
  await pause();
  return true;
};
const draw = async (low) => {
  for (;;) {
    const answered = [];
    for (const work of ["curves", "piece", "codes", "section"]) answered.push(await answer(work, low));
    if (!answered.includes(true)) return;
  }
};
"""


def shown(modules: Path, script: str) -> Any:
    """Numbers of states and the views drawn for them, in the order of display."""
    return evaluated(modules, f"{ENGINE}{script}console.log(JSON.stringify(shown));")


def test_a_map_that_comes_late_does_not_replace_that_of_a_newer_state(modules: Path) -> None:
    late = (
        "await set(1, {}); await answer('curves', 500); await answer('piece', 500);"
        "await set(2, { low: 600 }); await answer('curves', 600); await answer('piece', 600);"
        "await answer('codes', 600); await answer('codes', 500); await draw(600);"
    )
    assert shown(modules, late) == [[2, "preview"], [2, "full"]]


def test_a_map_that_comes_late_does_not_replace_a_complete_one_to_which_the_page_went_back(
    modules: Path,
) -> None:
    back = (
        "await set(1, {}); await draw(500);"
        "await set(2, { low: 600 }); await answer('curves', 600); await answer('piece', 600);"
        "await set(3, {}); await answer('curves', 500); await answer('codes', 600); await draw(600);"
        "await draw(500);"
    )
    assert shown(modules, back) == [[1, "preview"], [1, "full"]]


def test_a_map_that_follows_a_refused_one_is_drawn_again(modules: Path) -> None:
    back = (
        "await set(1, {}); await draw(500); await set(2, { low: 1000 }); await draw(1000);"
        "await set(3, {}); await draw(500);"
    )
    first, second, refused, *again = shown(modules, back)
    assert [first, second] == [[1, "preview"], [1, "full"]]
    assert refused[0] == 2
    assert "expected ascending ones" in refused[1]
    assert again == [[3, "preview"], [3, "full"]]


def test_a_section_that_is_complete_is_not_ordered_again(modules: Path) -> None:
    same = (
        "const views = ['strobe']; await set(1, { views }); await draw(500);"
        "await set(2, { views, line: 'A' }); await draw(500);"
        "await set(3, { views, rate: 950 }); await draw(500);"
    )
    assert shown(modules, same) == [[1, "strobe"], [3, "strobe"]]
