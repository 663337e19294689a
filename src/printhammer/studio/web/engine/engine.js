// What computes for the page: it answers the messages of the studio with workers.
import { adopter } from "./adopt.js";
import { crewOf } from "./crew.js";
import { dropped } from "./files.js";
import { codesOf, pictureOf } from "./map.js";
import { checkConstant, readState, Refusal, taken } from "./read.js";
import { textsOf } from "./texts.js";

const DEVICE = ["hammer", "text", "constants", "waveform"];
const KEYS = { map: [...DEVICE, "pattern", "pulses", "overlap", "low", "high"], strobe: [...DEVICE, "rate", "overlap"], line: [...DEVICE, "rate", "line", "overlap"] };
const WORKS = { strobe: "section", line: "line" };
const QUESTIONS = ["curves", "dots", "exponent", "verdict"];
const BEFORE = "this still belongs to what was set before";
const NOT_YET = "being computed";
const JUDGED = [1001, 2000]; // firings by which an endless train is classified
const SCREENED = 200; // firings for the exponent at one rate of a search
const NOTHING = { map: { detail: "none" }, strobe: { verdict: null } };

/** Start the engine; `receive` takes its frames. Returns what takes the text of a message. */
export function engineOf(shelf, script, receive, page, crew = crewOf(script, shelf)) {
  shelf.adopt = adopter(shelf);
  let latest = null; // the newest state, with its number
  let drawn = 0; // the number of the newest state whose map is drawn
  const [shown, whole] = [{}, {}]; // the keys of what views show, and of what is complete
  const seen = {}; // the numbers of the states that views show
  const keyOf = (state, names) => JSON.stringify(names.map((name) => state[name]));
  const section = () => ({ counts: shelf.limits.POINTS_OF_SECTION, judged: JUDGED });
  const hasPack = ({ hammer }) => shelf.hammers[hammer].described.places.front !== null;
  const isWanted = (state, view) => state.views.includes(view) && (view !== "line" || (state.line.trim() && hasPack(state)));
  const refuse = (serial, reason) => receive({ kind: "refusal", serial, reason: reason.slice(0, shelf.limits.LONGEST_REASON), data: {} });

  /** Read a state and check what can be checked without its run. */
  function read(content) {
    const state = readState(content, shelf.readers);
    state.hammer = state.text ? shelf.adopt(state.text) : state.hammer || shelf.names[0];
    if (!Object.hasOwn(shelf.hammers, state.hammer)) throw new Refusal(`hammer = '${state.hammer}': expected one of ${shelf.names.join(", ")}`);
    const { described } = shelf.hammers[state.hammer];
    for (const [key, value] of Object.entries(state.constants)) checkConstant(described, key, value);
    if (!state.waveform && !described.waveform) throw new Refusal(`the hammer '${described.name}' has no [waveform]: expected one set in the editor`);
    if (!(shelf.quantity(state) in shelf.hammers[state.hammer].modules)) throw new Refusal(shelf.sentences.kinds);
    return state;
  }

  function compute(serial, state) {
    latest = serial;
    crew.send("curves", "curves", state, {}, () => latest === serial, (answer) => {
      if (!answer) return;
      if (answer.reason) { refuse(serial, answer.reason); return; }
      const outdated = {};
      for (const [view, names] of Object.entries(KEYS)) if (isWanted(state, view) && shown[view] !== keyOf(state, names)) outdated[view] = shown[view] ? BEFORE : NOT_YET;
      const [motion, dots] = answer.frames;
      receive({ ...motion, serial, outdated });
      receive({ ...dots, serial });
      const isBehind = (view) => isWanted(state, view) && whole[view] !== keyOf(state, KEYS[view]);
      // A view that is complete for this state takes no late frame of an older one, whose orders are dropped.
      for (const view of state.views) if (view in KEYS && !isBehind(view)) seen[view] = serial;
      if (isBehind("map")) draw(serial, state);
      else drawn = serial;
      if (isBehind("line")) follow(serial, state, "line");
      if (isBehind("strobe")) follow(serial, state, "strobe", section());
    });
  }

  /** Give frames of a view for a state, until it shows a newer one. */
  const shower = (serial, state, view) => (frame) => {
    if (serial < (seen[view] ?? 0)) return;
    seen[view] = serial;
    shown[view] = keyOf(state, KEYS[view]);
    whole[view] = null; // what was complete is no longer shown
    receive({ ...frame, serial });
  };
  const complete = (serial, view) => { if (seen[view] === serial) whole[view] = shown[view]; };
  const empty = (view, reason) => ({ kind: view, reason, ...NOTHING[view], data: {} });

  /** Order a view that is behind; show it whenever there is more of it, until the state is replaced. */
  async function follow(serial, state, view, more = {}) {
    const show = shower(serial, state, view);
    const onward = ({ frame }) => { if (frame) show(frame); };
    const answer = await new Promise((done) => { crew.send("map", WORKS[view], state, more, () => latest === serial, done, onward); });
    if (!answer) return;
    if (answer.reason) { show(empty(view, answer.reason)); return; }
    for (const frame of answer.frames) show(frame);
    complete(serial, view);
  }

  /** Draw the map of a state: coarse at once, then whole, unless the state is replaced meanwhile. */
  async function draw(serial, state) {
    const show = shower(serial, state, "map");
    if (state.low >= state.high) { show(empty("map", `map: rates from ${state.low} Hz to ${state.high} Hz: expected ascending ones`)); return; }
    drawn = serial;
    // A coarse map is delivered even while a slider moves; of several that wait, the newest.
    const sizes = [[shelf.limits.PREVIEW[shelf.quantity(state) === "voltage"], false, () => drawn === serial], [shelf.limits.FULL, true, () => latest === serial]];
    for (const [size, full, wanted] of sizes) {
      const parts = await pictureOf(crew, state, size, full, wanted);
      if (!parts) return;
      if (parts.reason) { show(empty("map", parts.reason)); return; }
      const frame = await codesOf(crew, parts, state);
      show({ detail: full ? "full" : "preview", ...frame });
      if (full && !frame.reason) complete(serial, "map");
    }
  }

  const answers = {
    hammer: (serial, { name, text }) => {
      const asked = text ? shelf.adopt(text) : name || shelf.names[0];
      if (!Object.hasOwn(shelf.hammers, asked)) throw new Refusal(`hammer = '${asked.slice(0, 100)}': expected one of ${shelf.names.join(", ")}`);
      const { described, units } = shelf.hammers[asked];
      return { kind: "hammer", hammer: described, offered: shelf.names, asked: text ? "" : asked, text, units, limits: shelf.limits, version: shelf.version, ...shelf.vocabulary };
    },
    open: (serial, { state }) => ({ kind: "open", ...taken(state && Object.keys(state).length ? state : shelf.start, shelf) }),
    texts: (serial, { state }) => ({ kind: "texts", texts: textsOf(read(state), shelf) }),
    page: () => ({ kind: "page", html: page() }),
    drop: (serial, content) => ({ kind: "drop", ...dropped(content, shelf) }),
  };

  function ask(kind, serial, state) {
    if (kind === "exponent" || kind === "verdict") { judge(kind, serial, state); return; }
    crew.send("curves", "curves", state, {}, () => true, ({ reason, frames }) => {
      if (reason) refuse(serial, reason);
      else receive({ ...frames[kind === "curves" ? 0 : 1], serial, outdated: {} });
    });
  }

  /** Answer what the exponent or the class of the endless train of a state is. */
  function judge(kind, serial, state) {
    const isVerdict = kind === "verdict";
    let last = null;
    const done = ({ reason }) => {
      if (isVerdict && reason) refuse(serial, reason);
      else receive(isVerdict ? { ...last, serial } : { kind: "exponent", serial, exponent: last?.exponent ?? null, reason: reason ?? "", data: {} });
    };
    const more = isVerdict ? section() : { counts: [SCREENED], judged: null };
    crew.send("map", "section", state, more, () => true, done, ({ frame }) => { last = frame ?? last; });
  }

  return (text) => {
    const { kind, serial, ...content } = JSON.parse(text);
    // An answer never comes before its question has returned.
    queueMicrotask(() => {
      try {
        if (kind === "state") compute(serial, read(content.state));
        else if (QUESTIONS.includes(kind)) ask(kind, serial, read(content.state));
        else receive({ serial, data: {}, ...answers[kind](serial, content) });
      } catch (error) {
        if (kind === "state") latest = null;
        refuse(serial, error instanceof Refusal ? error.message : `this could not be answered, ${error}`);
      }
    });
  };
}
