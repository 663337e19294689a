// The studio in an element: `mount(element, send)` returns what takes the frames that answer its messages.
import { askColumns } from "./asking.js";
import { energyView, lineView } from "./bars.js";
import { buildControls } from "./controls.js";
import { forcesView, motionView } from "./curves.js";
import { element as make } from "./dom.js";
import { thinned } from "./engine/table.js";
import { save } from "./exports.js";
import { bindKeys } from "./keys.js";
import { mapView } from "./map.js";
import { marksFor } from "./marks.js";
import { layout } from "./panels.js";
import { loopsView, phaseView, strobeView } from "./planes.js";
import { sketchView } from "./sketch.js";
import { bare, fromText, OPENING, pinsOf, START, Store, toText, traceOf, VIEWS } from "./state.js";
import { readColours } from "./theme.js";
import { setSystem, setUnits } from "./units.js";
import { openingOf } from "./words.js";

const MAKERS = { motion: motionView, sketch: sketchView, map: mapView, forces: forcesView, phase: phaseView, strobe: strobeView, loops: loopsView, energy: energyView, line: lineView };
const LARGEST_TABLE = 50e6; // bytes of a measured table
const DROPPED = "dropped ";
const LONGEST = 800000; // characters of a link
const QUICK = ["motion", "forces", "phase"];

/**
 * Build the studio.
 * element: where; send: takes the text of a message; address: { read, write, address } of the state, if there is one.
 */
export function mount(element, send, address = { read: () => "", write: () => {}, address: () => "" }) {
  const studio = {
    element, store: new Store({ ...START }), frames: {}, pinned: [], companion: null, remarks: null, overlay: null, cursor: 0, cursorFrom: null, window: null,
    described: null, offered: [], limits: {}, shapes: {}, drivers: [], decays: [], views: {}, serial: Math.floor(Math.random() * 2 ** 40), sentAt: new Map(), busy: false, stale: false,
  };
  // Runs that stay behind the one that is set: those that are pinned, and that of a story.
  Object.defineProperty(studio, "ghosts", { get: () => [...studio.pinned, ...(studio.companion ? [studio.companion] : [])] });
  let follow = () => {};
  let writing = 0;
  let begun = false;
  let before = null;
  const asked = new Map();
  const dropped = new Map(); // names by the texts of hammers that were dropped

  const message = (kind, content) => {
    studio.serial += 1;
    send(JSON.stringify({ kind, serial: studio.serial, ...content }));
    return studio.serial;
  };
  /** Ask a question; the answer is a frame. */
  studio.ask = (kind, content) => new Promise((done) => { asked.set(message(kind, content), done); });

  /** Send the state; one is under way at a time, and the latest follows it. */
  studio.sendState = () => {
    if (!studio.described) return;
    if (studio.busy) { studio.stale = true; return; }
    studio.busy = true;
    studio.stale = false;
    const now = studio.changedAt ?? performance.now();
    studio.sentAt.set(message("state", { state: bare(studio.store.state) }), now);
    studio.changedAt = null;
    marks.sent(studio.serial, now);
    for (const serial of studio.sentAt.keys()) if (serial < studio.serial - 64) studio.sentAt.delete(serial);
  };

  studio.quantity = () => (studio.described.constants.some((constant) => constant.section === "magnet") ? "current" : "force");
  studio.setCursor = (time, from = null) => {
    const t = studio.frames.motion?.data.t;
    if (!t) return;
    studio.cursor = Math.min(Math.max(time, t[0]), t[t.length - 1]);
    studio.cursorFrom = from;
    turn();
  };
  studio.zoom = (range) => {
    studio.window = range;
    for (const name of ["motion", "forces"]) studio.views[name]?.draw();
  };
  studio.hint = (text) => { studio.parts.hint.textContent = text; };
  studio.say = (text, bad = false) => {
    studio.parts.status.textContent = text;
    studio.parts.status.title = text;
    studio.parts.status.classList.toggle("bad", bad);
  };
  studio.showText = (title, text) => {
    const box = make("textarea", { readonly: true, rows: 14, "aria-label": title });
    box.value = text;
    studio.parts.dialog.replaceChildren(make("h2", {}, title), box, make("form", { method: "dialog" }, make("button", {}, "Close")));
    studio.parts.dialog.showModal();
    box.select();
  };

  const shownViews = () => studio.store.state.views.map((name) => studio.views[name]).filter(Boolean);
  let turning = 0;
  /** Draw all cursors anew with the next picture. */
  function turn() {
    turning ||= requestAnimationFrame(() => {
      turning = 0;
      for (const view of shownViews()) view.cursor();
    });
  }
  let later = false;
  /** Draw at once what has arrived, to be seen with the next picture; what matters less comes with the one after. */
  function arrived(frame) {
    const first = frame.kind === "motion" ? QUICK : VIEWS;
    for (const name of studio.store.state.views) if (first.includes(name)) studio.views[name].update(frame.kind);
    const { kind, detail, serial } = frame;
    requestAnimationFrame(() => {
      report({ kind, detail, serial });
      if (frame.kind !== "motion" || later) return;
      later = true;
      requestAnimationFrame(() => {
        later = false;
        for (const name of studio.store.state.views) if (!first.includes(name)) studio.views[name].update("motion");
        follow();
      });
    });
  }

  /** Tell, after the next paint, how long a state took to be seen. */
  function report(seen) {
    const channel = new MessageChannel();
    channel.port1.onmessage = () => {
      const took = studio.sentAt.has(seen.serial) ? performance.now() - studio.sentAt.get(seen.serial) : null;
      element.dispatchEvent(new CustomEvent("painted", { detail: { ...seen, took } }));
    };
    channel.port2.postMessage(0);
  }

  const redrawAll = () => { for (const name of studio.store.state.views) studio.views[name]?.draw(); };
  studio.units = (system) => { setSystem(system); follow(); redrawAll(); };
  studio.theme = () => { readColours(element.querySelector(".studio")); redrawAll(); follow(); };

  /**
   * Describe the hammer of a state anew, then take the state: as a step of the history, or as it is there already.
   * What the hammer sets on opening takes the place of entries other than `told`.
   */
  async function load(state, { step = true, told = [] } = {}) {
    const frame = await studio.ask("hammer", { name: state.text ? "" : state.hammer, text: state.text });
    if (frame.kind === "refusal") {
      studio.say(frame.reason, true);
      if (step) return;
      // The state is there already, the curves are those of another one; the next state is sent even where it is the one before.
      marks.none(`not computed: ${frame.reason}`, studio.serial);
      before = null;
      return;
    }
    const views = openingOf(frame.hammer);
    if (views !== OPENING) frame.hammer = { ...frame.hammer, start: { ...frame.hammer.start, views } };
    Object.assign(studio, { described: frame.hammer, offered: frame.offered, limits: frame.limits, shapes: frame.shapes, drivers: frame.drivers, decays: frame.decays, unitTable: frame.units, version: frame.version });
    setUnits(frame.units);
    // A hammer without a pulse opens with one that shows it.
    const start = state.waveform ? {} : Object.fromEntries(Object.entries(frame.hammer.start).filter(([key]) => state[key] === null || !told.includes(key)));
    if (state.text) dropped.set(state.text, frame.hammer.name);
    studio.parts.hammers.replaceChildren(
      ...frame.offered.map((name) => make("option", { value: name }, name)),
      ...[...dropped].map(([text, name]) => make("option", { value: `${DROPPED}${[...dropped.keys()].indexOf(text)}` }, `${name} (dropped)`)),
    );
    studio.parts.hammers.value = state.text ? `${DROPPED}${[...dropped.keys()].indexOf(state.text)}` : frame.asked;
    studio.parts.honesty.textContent = honesty(frame.hammer);
    studio.parts.honesty.title = frame.hammer.note;
    studio.layout.describe(frame.hammer);
    follow = buildControls(studio.parts.controls, studio);
    studio.loaded = state.text || frame.asked;
    const whole = { ...state, hammer: state.text ? "" : frame.asked, ...start };
    if (!begun) studio.store.begin(whole);
    else if (step) studio.store.set(whole);
    else studio.store.tell();
    begun = true;
  }
  /** Choose a hammer by its name in the list: one that is offered, or one that was dropped. */
  studio.choose = (name) => {
    const text = name.startsWith(DROPPED) ? [...dropped.keys()][Number(name.slice(DROPPED.length))] : "";
    const { state } = studio.store;
    const before = Object.fromEntries(Object.keys(studio.described?.start ?? {}).map((key) => [key, START[key]]));
    return load({ ...state, ...before, hammer: text ? "" : name, text, constants: {}, waveform: null });
  };
  /** Take a state from outside as far as it can be taken, and tell what cannot. */
  async function take({ state, notes }) {
    await load({ ...START, ...state }, { told: Object.keys(state) });
    if (notes.length) studio.say(notes.join("; "), true);
    studio.notes = notes.join("; ");
  }
  /** The state as text of a link. */
  studio.link = () => toText(studio.store.state, studio.described?.start);
  studio.open = async (text) => {
    if (begun && text === studio.link()) return;
    const notes = text.length > LONGEST ? [`the link has ${text.length} characters, expected at most ${LONGEST}`] : [];
    const read = notes.length ? "" : text;
    const frame = await studio.ask("open", { state: fromText(read) });
    if (frame.kind === "refusal") { await take({ state: {}, notes: [...notes, frame.reason] }); return; }
    let trace = null;
    try { trace = traceOf(read); } catch ({ message: reason }) { notes.push(reason); }
    await take({ state: { ...frame.state, pins: pinsOf(read), trace }, notes: [...notes, ...frame.notes] });
  };
  /** Take the state of a pin up again, in the views that are shown; a pin of a link may hold anything. */
  studio.resume = async (state) => {
    const frame = await studio.ask("open", { state });
    if (frame.kind === "refusal") studio.say(frame.reason, true);
    else await take({ state: { ...frame.state, views: studio.store.state.views }, notes: frame.notes });
  };
  studio.preset = (patch) => studio.store.set(patch);

  let dropping = Promise.resolve();
  /** Read a file that was dropped, after those before it: a dialog asks about one at a time. */
  studio.drop = (file) => {
    dropping = dropping.catch(() => {}).then(() => readDropped(file));
    return dropping;
  };
  async function readDropped(file) {
    const isTable = !/\.(toml|json)$/i.test(file.name);
    const most = isTable ? LARGEST_TABLE : file.name.toLowerCase().endsWith(".json") ? studio.limits.LARGEST_MESSAGE : studio.limits.LARGEST_FILE;
    if (file.size > most) {
      studio.say(`${file.name} has ${file.size} bytes, expected at most ${most}`, true);
      return;
    }
    const decodedText = decoded(await file.arrayBuffer());
    const text = isTable ? thinned(decodedText, studio.limits.LARGEST_FILE) : decodedText;
    const ask = (columns) => studio.ask("drop", { name: file.name, text, columns });
    let frame = await ask(null);
    if (frame.what === "columns") {
      const answer = await askColumns(studio.parts.dialog, frame);
      if (!answer) return;
      frame = await ask(answer.columns);
      if (answer.isSaved && frame.beside) save(`${file.name}.toml`, frame.beside, "text/plain");
    }
    if (frame.kind === "refusal") studio.say(frame.reason, true);
    else if (frame.what === "state") await take(frame);
    else if (frame.what === "hammer") {
      const state = { ...studio.store.state, hammer: "", text: frame.text, constants: {}, waveform: null };
      await load(state, { told: Object.keys(state).filter((key) => state[key] !== START[key]) });
    }
    else if (frame.what === "drive") { studio.store.set(frame.patch); studio.say(`the drive is that of ${frame.name}`); }
    else if (frame.what === "curves") lay(frame);
  }
  /** Show measured curves: a displacement over the motion, a current, force or voltage as the pulse that is fired. */
  function lay({ name, data }) {
    const quantity = ["current", "force", "voltage"].find((kind) => kind in data);
    const shown = [];
    const patch = {};
    if (data.displacement) {
      patch.trace = { name, t: [...data.t], values: [...data.displacement], dt: 0, dx: 0 };
      shown.push("its displacement is laid over the motion");
    }
    if (quantity) {
      shown.push(`its ${quantity} is the pulse that is fired`);
      // The firing is at time 0 of the record; nothing is driven before.
      const begin = data.t.findIndex((time) => time >= 0);
      const waveform = { shape: "sampled", times: [...data.t.slice(begin)], values: [...data[quantity].slice(begin)], quantity };
      // What was measured together is compared with one such pulse.
      Object.assign(patch, { waveform, ...(data.displacement ? { pulses: 1, pattern: "" } : {}) });
    }
    studio.store.set(patch);
    studio.notes = `${name}: ${shown.join(", ")}`;
    studio.say(studio.notes);
  }

  // A drive that was copied as text can be pasted again, where no field takes the text.
  element.ownerDocument.addEventListener("paste", (event) => {
    if (event.target.closest?.("input, textarea, select")) return;
    const text = event.clipboardData?.getData("text") ?? "";
    if (/^\s*format\s*=/.test(text)) studio.drop(new File([text], "pasted.toml"));
  });

  studio.store.listeners.add((state) => {
    const wanted = state.text || state.hammer || studio.offered[0];
    if (wanted !== studio.loaded) { load(state, { step: false }); return; }
    // Pins and the trace are the page's own.
    const same = Boolean(before) && Object.keys(state).every((key) => key === "pins" || key === "trace" || state[key] === before[key]);
    before = state;
    if (!same) {
      if (begun) studio.notes = "";
      studio.changedAt ??= globalThis.event?.timeStamp ?? performance.now();
      studio.sendState();
    }
    follow();
    for (const view of shownViews()) view.update("state");
    studio.layout.show(state.views);
    clearTimeout(writing);
    writing = setTimeout(() => address.write(studio.link()), 150);
  });

  studio.parts = layout(studio, MAKERS);
  studio.layout = studio.parts.layout;
  const marks = marksFor((name) => element.querySelector(`.view-${name}`));
  studio.hint("Point at a control, or focus it, to read the equation and the source of its constant here.");
  studio.address = address.address;
  bindKeys(studio);
  readColours(element.querySelector(".studio"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", studio.theme);
  studio.open(address.read());

  return { studio, open: studio.open, accept };

  /** Take a frame: the answer to a question, or what views are drawn from. */
  function accept(frame) {
    if (asked.has(frame.serial)) {
      asked.get(frame.serial)(frame);
      asked.delete(frame.serial);
      return;
    }
    if (frame.kind === "refusal") {
      studio.busy = false;
      studio.say(frame.reason, true);
      if (studio.stale) studio.sendState();
      else marks.none(`not computed: ${frame.reason}`, frame.serial);
      return;
    }
    marks.arrived(frame);
    if (frame.kind === "motion") {
      studio.busy = false;
      // What has arrived is marked anew where a newer state follows it.
      if (studio.stale) studio.sendState();
    }
    studio.frames[frame.kind] = frame;
    if (frame.kind === "motion") {
      const text = frame.message || `${frame.steps} steps, ${frame.status}`;
      // What a link or a file held, and could not be taken, is told until something else is set.
      if (!studio.notes) studio.say(text, frame.status !== "ok");
      const t = frame.data.t;
      studio.cursor = Math.min(studio.cursor, t[t.length - 1]);
    }
    arrived(frame);
  }
}

function honesty(hammer) {
  const counts = {};
  for (const { status } of hammer.constants) counts[status] = (counts[status] ?? 0) + 1;
  return Object.entries(counts).map(([status, count]) => `${count} ${status}`).join(", ");
}

/** Text of a file in UTF-8 or UTF-16, else in Latin-1 as Windows extends it. */
function decoded(buffer) {
  const [first, second] = new Uint8Array(buffer);
  const wide = (first === 0xff && second === 0xfe && "utf-16le") || (first === 0xfe && second === 0xff && "utf-16be");
  try {
    return new TextDecoder(wide || "utf-8", { fatal: true }).decode(buffer);
  } catch {
    return new TextDecoder("windows-1252").decode(buffer);
  }
}
