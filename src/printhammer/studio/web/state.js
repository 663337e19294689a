// The state that the user has set, its history, and its text in the address.
export const VIEWS = ["motion", "sketch", "map", "forces", "phase", "strobe", "loops", "energy", "line"];

/** The views with which a page opens: the map, and beside it what moves, its curve and what it prints. */
export const OPENING = ["motion", "sketch", "map", "line"];

const NUMBERS = ["rate", "pulses", "low", "high"];
const TEXTS = ["hammer", "text", "pattern", "overlap", "line"];
const JOINED = 700; // ms within which changes of one control are one step of the history
export const DEEPEST = 200; // steps of the history

export const MOST_PINS = 4;
const MOST_SAMPLES = 2000; // of a trace
const LARGEST = 1e9; // of its numbers, SI

export const START = Object.freeze({
  hammer: "", text: "", constants: {}, waveform: null, rate: 1200, pulses: 9, pattern: "", overlap: "add",
  low: 500, high: 2000, line: "HAMMER", views: OPENING,
});

export class Store {
  constructor(state) {
    this.state = state;
    this.past = [];
    this.future = [];
    this.listeners = new Set();
    this.last = { control: null, at: 0 };
  }

  /** Change the state; changes of one control shortly after each other are undone together. */
  set(patch, control = null) {
    const now = performance.now();
    const same = control !== null && control === this.last.control && now - this.last.at < JOINED;
    if (!same) {
      this.past.push(this.state);
      if (this.past.length > DEEPEST) this.past.shift();
    }
    this.last = { control, at: now };
    this.future = [];
    this.state = Object.freeze({ ...this.state, ...patch });
    this.tell();
  }

  /** Change what is no step of the history, such as pins. */
  amend(patch) {
    this.state = Object.freeze({ ...this.state, ...patch });
    this.tell();
  }

  /** Begin with a state, without a past. */
  begin(state) {
    this.past = [];
    this.future = [];
    this.state = Object.freeze({ ...state });
    this.tell();
  }

  undo() { this.step(this.past, this.future); }
  redo() { this.step(this.future, this.past); }

  step(from, to) {
    if (!from.length) return;
    to.push(this.state);
    const { pins } = this.state;
    this.state = Object.freeze({ ...from.pop(), ...(pins ? { pins } : {}) });
    this.last = { control: null, at: 0 };
    this.tell();
  }

  tell() { for (const listener of this.listeners) listener(this.state); }
}

/** Text of a state for an address: what differs from `START`, and every entry that the hammer would set on opening, `start`. */
export function toText(state, start = {}) {
  const found = new URLSearchParams();
  for (const name of [...TEXTS, ...NUMBERS]) if (state[name] !== START[name] || name in start) found.set(name, state[name]);
  for (const [key, value] of Object.entries(state.constants)) found.set(key, value);
  if (state.waveform) found.set("waveform", JSON.stringify(state.waveform));
  if (state.pins?.length) found.set("pins", JSON.stringify(state.pins.map(({ name, state: pinned }) => ({ name, state: Object.fromEntries(Object.entries(pinned).filter(([key, value]) => JSON.stringify(value) !== JSON.stringify(START[key]))) }))));
  if (state.trace) found.set("trace", JSON.stringify({ ...state.trace, ...rounded(state.trace) }));
  if (state.views.join() !== OPENING.join() || "views" in start) found.set("views", state.views.join("-"));
  return found.toString();
}

const short = new WeakMap(); // columns of traces for a link, by their times
/** Return the columns of a trace with as many digits as a picture shows; times that begin late keep their steps. */
function rounded({ t, values }) {
  const digits = (list, count) => Array.from(list, (number) => Number(number.toPrecision(count)));
  if (!short.has(t)) short.set(t, { t: digits(t, 9), values: digits(values, 6) });
  return short.get(t);
}

/** Return the trace of a text, null where there is none; throws a sentence where it is not as a link holds it. */
export function traceOf(text) {
  const written = new URLSearchParams(text).get("trace");
  if (written === null) return null;
  const { name, t, values, dt, dx } = Object(parsed(written));
  const isColumn = (list) => Array.isArray(list) && list.length > 1 && list.length <= MOST_SAMPLES && list.every((number) => typeof number === "number" && Math.abs(number) <= LARGEST);
  const fine = typeof name === "string" && isColumn(t) && isColumn(values) && t.length === values.length && isColumn([dt, dx]) && t.every((time, k) => !k || time > t[k - 1]);
  if (!fine) throw new Error(`trace is expected to have a name, 2 to ${MOST_SAMPLES} ascending times t, as many values, and the offsets dt and dx; it is not used`);
  return { name: name.slice(0, 60), t, values, dt, dx };
}

/** Return a state without what only the page keeps. */
export function bare({ pins: _pins, trace: _trace, ...state }) { return state; }

/** Return the pins of a text; what is none is left out. */
export function pinsOf(text) {
  let list = [];
  try { list = JSON.parse(new URLSearchParams(text).get("pins") ?? "[]"); } catch { /* none */ }
  if (!Array.isArray(list)) return [];
  const fine = list.filter((pin) => typeof pin?.name === "string" && typeof pin.state === "object" && pin.state !== null && !Array.isArray(pin.state));
  return fine.slice(0, MOST_PINS).map(({ name, state }) => ({ name: name.slice(0, 40), state: { ...bare(START), ...bare(state) } }));
}

/** Return what a text tells, as it stands there; `taken` says what of it can be used. */
export function fromText(text) {
  const told = {};
  const constants = {};
  for (const [key, value] of new URLSearchParams(text)) {
    if (key === "pins" || key === "trace") continue;
    if (TEXTS.includes(key)) told[key] = value;
    else if (key === "views") told.views = value.split("-");
    else if (key === "waveform") told.waveform = parsed(value);
    else if (NUMBERS.includes(key)) told[key] = number(value);
    else constants[key] = number(value);
  }
  if (Object.keys(constants).length) told.constants = constants;
  return told;
}

function number(text) { return text.trim() !== "" && Number.isFinite(Number(text)) ? Number(text) : text; }

function parsed(text) {
  try { return JSON.parse(text); } catch { return text; }
}
