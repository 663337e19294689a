// The controls: one row for each constant, with unit, range, hint and reset.
import { element } from "./dom.js";
import { digits, shown, unitOf } from "./units.js";
import { waveformEditor } from "./waveform.js";

const STEPS = 1000;
const TITLES = { armature: "Armature and geometry", magnet: "Magnet", spring: "Spring", pack: "Pack", backstop: "Backstop", coil: "Coil" };

/** Build the controls for a hammer; returns how they follow the state. */
export function buildControls(holder, studio) {
  const rows = [];
  holder.replaceChildren();
  const { described } = studio;
  const add = (group, options) => {
    const row = sliderRow(options, studio);
    group.append(row.element);
    rows.push(row);
  };

  const drive = group(holder, "Drive", true);
  add(drive, {
    id: "rate", name: "rate", hint: "Firings per second.", unit: "Hz", low: 50, high: 5000, log: true,
    get: (state) => state.rate, set: (value) => ({ rate: value }), reset: () => ({ rate: 1200 }),
  });
  add(drive, {
    id: "pulses", name: "pulses", hint: "Number of firings.", unit: "1", low: 1, high: studio.limits.pulses, whole: true,
    get: (state) => state.pulses, set: (value) => ({ pulses: value }), reset: () => ({ pulses: 9 }),
  });
  const pattern = textRow("pattern", "Which slots are fired, such as 1101; empty: all pulses.", (state) => state.pattern, (value) => (/^[01]*1[01]*$|^$/.test(value) ? { pattern: value.slice(0, studio.limits.pulses) } : null), studio);
  drive.append(pattern.element);
  rows.push(pattern);
  const overlap = choiceRow("overlap", "What overlapping pulses do: add up, or the latest replaces the others.", ["add", "replace"], (state) => state.overlap, (value) => ({ overlap: value }), studio);
  drive.append(overlap.element);
  rows.push(overlap);

  const line = textRow("line", "Text that is printed, nine wires high, slot by slot at this rate; empty: the dots of the burst.", (state) => state.line, (value) => ({ line: value.slice(0, studio.limits.line) }), studio);
  drive.append(line.element);
  rows.push(line);

  const pulse = group(holder, "Pulse", true);
  rows.push(waveformEditor(pulse, studio, sliderRow));

  if (described.combined.length) {
    const paper = group(holder, "Paper", true);
    for (const control of described.combined) add(paper, { ...control, id: control.key, name: control.key, hint: control.meaning, ...moving(control, studio) });
  }
  const sections = new Map();
  for (const constant of described.constants) {
    if (!sections.has(constant.section)) sections.set(constant.section, group(holder, TITLES[constant.section] ?? constant.section, false));
    add(sections.get(constant.section), {
      ...constant, id: constant.key, name: constant.symbol, title: constant.meaning,
      hint: `${constant.key}: ${constant.meaning}${constant.unit === "1" ? "" : `, ${constant.unit}`}. ${constant.equation}. ${constant.status}: ${constant.source}.`,
      get: (state) => state.constants[constant.key] ?? constant.value,
      set: (value) => ({ constants: { ...studio.store.state.constants, [constant.key]: value } }),
      reset: () => {
        const { [constant.key]: _gone, ...rest } = studio.store.state.constants;
        return { constants: rest };
      },
    });
  }
  const limits = group(holder, "Map", false);
  for (const [end, start] of [["low", 500], ["high", 2000]]) {
    add(limits, {
      id: end, name: `${end === "low" ? "lowest" : "highest"} rate`, hint: "End of the map's axis of firing rates.", unit: "Hz", low: 50, high: 10000, log: true,
      get: (state) => state[end], set: (value) => ({ [end]: value }), reset: () => ({ [end]: start }),
    });
  }
  return () => { for (const row of rows) row.follow(studio.store.state); };
}

/** A control that moves several constants: its value is that of the first, less where that one starts. */
function moving(control, studio) {
  const base = Object.fromEntries(studio.described.constants.map((constant) => [constant.key, constant.value]));
  const keys = Object.keys(control.moves);
  const now = (state, key) => state.constants[key] ?? base[key];
  const value = (state) => control.value + (now(state, keys[0]) - base[keys[0]]) / control.moves[keys[0]];
  return {
    get: value,
    set: (wanted) => {
      const { state } = studio.store;
      const change = wanted - value(state);
      const constants = { ...state.constants };
      for (const key of keys) constants[key] = now(state, key) + control.moves[key] * change;
      return { constants };
    },
    reset: () => {
      const { state } = studio.store;
      const change = control.value - value(state);
      const constants = { ...state.constants };
      for (const key of keys) {
        constants[key] = now(state, key) + control.moves[key] * change;
        if (Math.abs(constants[key] - base[key]) < 1e-12) delete constants[key];
      }
      return { constants };
    },
  };
}

function group(holder, title, open) {
  const body = element("div", { class: "rows" });
  holder.append(element("details", { open }, element("summary", {}, title), body));
  return body;
}

/** A slider with a number beside it; options: id, name, hint, unit (SI), low, high, log, whole, get, set, reset. */
function sliderRow(options, studio) {
  const { id, name, unit, low, high, log, whole } = options;
  const value = (part) => (log ? low * (high / low) ** part : low + part * (high - low));
  const part = (number) => (log ? Math.log(number / low) / Math.log(high / low) : (number - low) / (high - low));
  const round = (number) => (whole ? Math.round(number) : Number(number.toPrecision(6)));
  const label = `control-${id.replace(/\W/g, "-")}`;
  const slider = element("input", { type: "range", min: 0, max: STEPS, step: whole ? STEPS / (high - low) : 1, id: label, "data-key": id });
  const box = element("input", { type: "text", inputmode: "decimal", class: "number", "aria-label": `${name}, number`, "data-number": id });
  const sign = element("span", { class: "unit" });
  const reset = element("button", { type: "button", class: "reset", title: "reset", "aria-label": `reset ${name}` }, "↺");
  let seen = "";
  const change = (number) => {
    const patch = options.set(round(Math.min(Math.max(number, low), high)));
    if (patch) studio.store.set(patch, id);
  };
  slider.addEventListener("input", () => change(value(slider.value / STEPS)));
  box.addEventListener("change", () => {
    const number = Number(box.value.replace(",", ".")) / unitOf(unit).factor;
    if (Number.isFinite(number)) change(number);
    seen = "";
    follow(studio.store.state);
  });
  reset.addEventListener("click", () => studio.store.set(options.reset(), `reset ${id}`));
  const row = element("div", { class: "row" }, element("label", { for: label, title: options.title ?? options.hint }, name), slider, box, sign, reset);
  hinted(row, options.hint, studio);

  function follow(state) {
    const number = options.get(state);
    const now = `${number} ${unitOf(unit).name}`;
    if (now === seen) return;
    seen = now;
    slider.value = String(Math.round(part(number) * STEPS));
    slider.setAttribute("aria-valuetext", shown(number, unit));
    if (document.activeElement !== box) box.value = digits(number * unitOf(unit).factor, whole ? 6 : 5);
    sign.textContent = unitOf(unit).name;
    sign.title = unitOf(unit).name;
    const start = options.value ?? null;
    row.classList.toggle("changed", start !== null && Math.abs(number - start) > 1e-9 * Math.abs(start));
  }
  return { element: row, follow };
}

function textRow(name, hint, get, set, studio) {
  const box = element("input", { type: "text", id: `control-${name}`, class: "wide", spellcheck: "false", autocomplete: "off" });
  box.addEventListener("input", () => {
    const patch = set(box.value.trim());
    box.setAttribute("aria-invalid", String(!patch));
    if (patch) studio.store.set(patch, name);
  });
  const row = element("div", { class: "row" }, element("label", { for: box.id, title: hint }, name), box);
  hinted(row, hint, studio);
  return { element: row, follow: (state) => { if (document.activeElement !== box) box.value = get(state); } };
}

function choiceRow(name, hint, choices, get, set, studio) {
  const box = element("select", { id: `control-${name}`, class: "wide" }, ...choices.map((choice) => element("option", { value: choice }, choice)));
  box.addEventListener("change", () => studio.store.set(set(box.value)));
  const row = element("div", { class: "row" }, element("label", { for: box.id, title: hint }, name), box);
  hinted(row, hint, studio);
  return { element: row, follow: (state) => { box.value = get(state); } };
}

function hinted(row, hint, studio) {
  for (const kind of ["pointerenter", "focusin"]) row.addEventListener(kind, () => studio.hint(hint));
}
