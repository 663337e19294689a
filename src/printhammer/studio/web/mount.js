// The studio in an element: `mount(element, send)` returns what takes the server's frames.
import { energyView, lineView } from "./bars.js";
import { buildControls } from "./controls.js";
import { forcesView, motionView } from "./curves.js";
import { element as make } from "./dom.js";
import { decode } from "./frames.js";
import { bindKeys } from "./keys.js";
import { mapView } from "./map.js";
import { layout } from "./panels.js";
import { loopsView, phaseView, strobeView } from "./planes.js";
import { sketchView } from "./sketch.js";
import { bare, fromText, START, Store, toText, VIEWS } from "./state.js";
import { readColours } from "./theme.js";
import { setSystem, setUnits } from "./units.js";

const MAKERS = { motion: motionView, sketch: sketchView, map: mapView, forces: forcesView, phase: phaseView, strobe: strobeView, loops: loopsView, energy: energyView, line: lineView };
const QUICK = ["motion", "forces", "phase"];

/**
 * Build the studio.
 * element: where; send: takes the text of a message; address: { read, write, address } of the state, if there is one.
 */
export function mount(element, send, address = { read: () => "", write: () => {}, address: () => "" }) {
  const studio = {
    element, store: new Store({ ...START }), frames: {}, ghosts: [], overlay: null, cursor: 0, cursorFrom: null, window: null,
    described: null, offered: [], limits: {}, shapes: {}, views: {}, serial: Math.floor(Math.random() * 2 ** 40), sentAt: new Map(), busy: false, stale: false,
  };
  let follow = () => {};
  let writing = 0;
  let begun = false;
  let before = null;
  let patience = 0;
  const asked = new Map();

  const message = (kind, content) => {
    studio.serial += 1;
    send(JSON.stringify({ kind, serial: studio.serial, ...content }));
    return studio.serial;
  };
  /** Ask the server a question; the answer is a frame. */
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
    clearTimeout(patience);
    patience = setTimeout(() => { if (studio.busy) studio.say("computing; laws that are new to this machine are compiled once: some ten seconds before the curves, as many before the map"); }, 1200);
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

  /** Describe the hammer of a state anew, then take the state: as a step of the history, or as it is there already. */
  async function load(state, step = true) {
    const frame = await studio.ask("hammer", { name: state.text ? "" : state.hammer, text: state.text });
    if (frame.kind === "refusal") {
      studio.say(frame.reason, true);
      if (!studio.described && (state.text || state.hammer)) await load({ ...START });
      return;
    }
    Object.assign(studio, { described: frame.hammer, offered: frame.offered, limits: frame.limits, shapes: frame.shapes });
    setUnits(frame.units);
    const waveform = state.waveform ?? (frame.hammer.waveform ? null : { shape: "half-sine", amplitude: 1, width: 3e-4, quantity: studio.quantity() });
    studio.parts.hammers.replaceChildren(...[...frame.offered, ...(state.text ? ["dropped"] : [])].map((name) => make("option", { value: name }, name)));
    studio.parts.hammers.value = state.text ? "dropped" : frame.asked;
    studio.parts.honesty.textContent = honesty(frame.hammer);
    studio.parts.honesty.title = frame.hammer.note;
    follow = buildControls(studio.parts.controls, studio);
    studio.loaded = state.text || frame.asked;
    const whole = { ...state, hammer: state.text ? "" : frame.asked, waveform };
    if (!begun) studio.store.begin(whole);
    else if (step) studio.store.set(whole);
    else studio.store.tell();
    begun = true;
  }
  studio.choose = (name) => load({ ...studio.store.state, hammer: name, text: "", constants: {}, waveform: null });
  studio.open = (text) => { if (text !== toText(studio.store.state)) load(fromText(text)); };
  studio.preset = (patch) => studio.store.set(patch);

  studio.drop = async (file) => {
    if (file.size > studio.limits.file) {
      studio.say(`${file.name} has ${file.size} bytes, expected at most ${studio.limits.file}`, true);
      return;
    }
    const frame = await studio.ask("drop", { name: file.name, text: await file.text() });
    if (frame.kind === "refusal") studio.say(frame.reason, true);
    else if (frame.what === "hammer") load({ ...studio.store.state, hammer: "", text: frame.text, constants: {}, waveform: null });
    else if (frame.what === "displacement") {
      studio.overlay = frame;
      studio.say(`${frame.name} laid over the motion`);
      redrawAll();
    } else studio.store.set({ waveform: { shape: "sampled", times: [...frame.data.t], values: [...frame.data.values], quantity: frame.what } });
  };

  studio.store.listeners.add((state) => {
    const wanted = state.text || state.hammer;
    if (wanted !== studio.loaded) { load(state, false); return; }
    // Pins are the page's own.
    const same = Boolean(before) && Object.keys(state).every((key) => key === "pins" || state[key] === before[key]);
    before = state;
    if (!same) {
      studio.changedAt ??= globalThis.event?.timeStamp ?? performance.now();
      studio.sendState();
    }
    follow();
    for (const view of shownViews()) view.update("state");
    studio.layout.show(state.views);
    clearTimeout(writing);
    writing = setTimeout(() => address.write(toText(studio.store.state)), 150);
  });

  studio.parts = layout(studio, MAKERS);
  studio.layout = studio.parts.layout;
  studio.hint("The equation and the source of a constant are told here, where its control is pointed at or focused.");
  studio.address = address.address;
  bindKeys(studio);
  readColours(element.querySelector(".studio"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", studio.theme);
  load(fromText(address.read()));

  return {
    studio,
    open: studio.open,
    connected: () => { if (studio.described) { studio.busy = false; studio.sendState(); } studio.say("ready"); },
    lost: (reason, again) => {
      studio.busy = false;
      studio.say(`the connection ended${reason ? `: ${reason}` : ""}; press Enter here to connect again`, true);
      studio.parts.status.tabIndex = 0;
      studio.parts.status.onclick = again;
      studio.parts.status.onkeydown = (event) => { if (event.key === "Enter") again(); };
    },
    receive: (buffer) => {
      const frame = decode(buffer);
      if (asked.has(frame.serial)) {
        asked.get(frame.serial)(frame);
        asked.delete(frame.serial);
        return;
      }
      if (frame.kind === "motion" || frame.kind === "refusal") {
        studio.busy = false;
        if (studio.stale) studio.sendState();
      }
      if (frame.kind === "refusal") { studio.say(frame.reason, true); return; }
      studio.frames[frame.kind] = frame;
      if (frame.kind === "motion") {
        studio.say(frame.message || `${frame.steps} steps, ${frame.status}`, frame.status !== "ok");
        const t = frame.data.t;
        studio.cursor = Math.min(studio.cursor, t[t.length - 1]);
      }
      arrived(frame);
    },
  };
}

function honesty(hammer) {
  const counts = {};
  for (const { status } of hammer.constants) counts[status] = (counts[status] ?? 0) + 1;
  return Object.entries(counts).map(([status, count]) => `${count} ${status}`).join(", ");
}
