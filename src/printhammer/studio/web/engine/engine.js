// What computes for the page: it answers the messages of the studio as a server would, with workers.
import { crewOf } from "./crew.js";
import { codesOf, pictureOf } from "./map.js";
import { checkConstant, readFile, readState, Refusal, taken } from "./read.js";
import { textsOf } from "./texts.js";

const MAP = ["hammer", "text", "constants", "waveform", "pattern", "pulses", "overlap", "low", "high"];
const SECTION = ["hammer", "text", "constants", "waveform", "rate", "overlap"];
const LATER = ["line"]; // views that are not computed here
const QUESTIONS = ["curves", "dots", "exponent", "verdict"];
const BEFORE = "this still belongs to what was set before";
const NOT_YET = "being computed";
const NOTHING = { map: { detail: "none" }, strobe: { verdict: null } };

/** Start the engine; `receive` takes its frames. Returns what takes the text of a message. */
export function engineOf(shelf, script, receive, page) {
  const crew = crewOf(script, shelf);
  let latest = null; // the newest state, with its number
  const map = { shown: null, whole: null, serial: 0 };
  const keyOf = (state, names = MAP) => JSON.stringify(names.map((name) => state[name]));
  const strobe = { shown: null, whole: null };
  const refuse = (serial, reason) => receive({ kind: "refusal", serial, reason: reason.slice(0, shelf.limits.LONGEST_REASON), data: {} });

  /** Read a state and check what can be checked without its run. */
  function read(content) {
    const state = readState(content, shelf.readers);
    if (state.text) throw new Refusal(shelf.noFiles);
    state.hammer ||= shelf.names[0];
    if (!Object.hasOwn(shelf.hammers, state.hammer)) throw new Refusal(`hammer = '${state.hammer}': expected one of ${shelf.names.join(", ")}`);
    const { described } = shelf.hammers[state.hammer];
    for (const [key, value] of Object.entries(state.constants)) checkConstant(described, key, value);
    if (!state.waveform && !described.waveform) throw new Refusal(`the hammer '${described.name}' has no [waveform]: expected one set in the editor`);
    return state;
  }

  function compute(serial, state) {
    latest = serial;
    crew.send("curves", "curves", state, {}, () => latest === serial, (answer) => {
      if (!answer) return;
      if (answer.reason) { refuse(serial, answer.reason); return; }
      const outdated = {};
      if (state.views.includes("map") && map.shown !== keyOf(state)) outdated.map = map.shown ? BEFORE : NOT_YET;
      if (state.views.includes("strobe") && strobe.shown !== keyOf(state, SECTION)) outdated.strobe = strobe.shown ? BEFORE : NOT_YET;
      const [motion, dots] = answer.frames;
      receive({ ...motion, serial, outdated });
      receive({ ...dots, serial });
      for (const view of LATER) if (state.views.includes(view) && (view !== "line" || state.line.trim())) receive({ kind: view, serial, reason: shelf.sentences[view], ...NOTHING[view], data: {} });
      if (state.views.includes("map") && map.whole !== keyOf(state)) draw(serial, state);
      if (state.views.includes("strobe") && strobe.whole !== keyOf(state, SECTION)) follow(serial, state);
    });
  }

  /** Follow an endless train: more and more of its points, until the state is replaced. */
  async function follow(serial, state) {
    for (const points of shelf.limits.POINTS_OF_SECTION) {
      const answer = await new Promise((done) => { crew.send("map", "section", state, { points }, () => latest === serial, done); });
      if (!answer || latest !== serial) return;
      strobe.shown = keyOf(state, SECTION);
      receive(answer.reason ? { kind: "strobe", serial, reason: answer.reason, ...NOTHING.strobe, data: {} } : { ...answer.frames[0], last: shelf.limits.POINTS_OF_SECTION.at(-1), serial });
      if (answer.reason) return;
    }
    strobe.whole = strobe.shown;
  }

  /** Draw the map of a state: coarse at once, then whole, unless the state is replaced meanwhile. */
  async function draw(serial, state) {
    const key = keyOf(state);
    if (state.low >= state.high) {
      receive({ kind: "map", serial, reason: `map: rates from ${state.low} Hz to ${state.high} Hz: expected ascending ones`, ...NOTHING.map, data: {} });
      return;
    }
    map.serial = serial;
    // A coarse map is delivered even while a slider moves; of several that wait, the newest.
    const sizes = [[shelf.limits.PREVIEW[shelf.hammers[state.hammer].circuit], () => map.serial === serial], [shelf.limits.FULL, () => latest === serial]];
    for (const [size, wanted] of sizes) {
      const whole = size === shelf.limits.FULL;
      const parts = await pictureOf(crew, state, size, whole, wanted);
      if (!parts) return;
      if (parts.reason) {
        receive({ kind: "map", serial, reason: parts.reason, ...NOTHING.map, data: {} });
        return;
      }
      map.shown = key;
      if (whole) map.whole = key;
      receive({ detail: whole ? "full" : "preview", ...await codesOf(crew, parts, state), serial });
    }
  }

  const answers = {
    hammer: (serial, { name, text }) => {
      if (text) throw new Refusal(shelf.noFiles);
      const asked = name || shelf.names[0];
      if (!Object.hasOwn(shelf.hammers, asked)) throw new Refusal(`hammer = '${asked.slice(0, 100)}': expected one of ${shelf.names.join(", ")}`);
      const { described, units } = shelf.hammers[asked];
      return { kind: "hammer", hammer: described, offered: shelf.names, asked, text: "", units, ...shelf.vocabulary };
    },
    open: (serial, { state }) => ({ kind: "open", ...(state && Object.keys(state).length ? taken(state, shelf) : shelf.start) }),
    texts: (serial, { state }) => ({ kind: "texts", texts: textsOf(read(state), shelf) }),
    page: () => ({ kind: "page", html: page() }),
    drop: (serial, { name, text }) => {
      if (!/\.json$/i.test(name)) throw new Refusal(/\.toml$/i.test(name) ? shelf.noFiles : shelf.sentences.tables);
      return { kind: "drop", what: "state", ...readFile(text, name, shelf) };
    },
  };

  function ask(kind, serial, state) {
    if (kind === "exponent" || kind === "verdict") throw new Refusal(shelf.sentences.strobe);
    crew.send("curves", "curves", state, {}, () => true, ({ reason, frames }) => {
      if (reason) refuse(serial, reason);
      else receive({ ...frames[kind === "curves" ? 0 : 1], serial, outdated: {} });
    });
  }

  return (text) => {
    const { kind, serial, ...content } = JSON.parse(text);
    // Answers come later, as those of a server do.
    queueMicrotask(() => {
      try {
        if (kind === "state") compute(serial, read(content.state));
        else if (QUESTIONS.includes(kind)) ask(kind, serial, read(content.state));
        else receive({ serial, ...answers[kind](serial, content), data: {} });
      } catch (error) {
        if (kind === "state") latest = null;
        refuse(serial, error instanceof Refusal ? error.message : `this could not be answered, ${error}`);
      }
    });
  };
}
