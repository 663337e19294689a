// Rows of the controls: a slider with a number beside it, a text, a choice.
import { element } from "./dom.js";
import { readQuantity } from "./quantity.js";
import { digits, shown, unitOf } from "./units.js";

const STEPS = 1000;
const FINE = 0.1; // of a step, with Shift
const NOTCH = 5; // steps of a wheel

/** A slider with a number; options: id, name, symbol, hint, unit (SI), low, high, log, whole, get, set, reset. */
export function sliderRow(options, studio) {
  const { id, name, unit, low, high, log, whole } = options;
  const value = (part) => (log ? low * (high / low) ** part : low + part * (high - low));
  const part = (number) => (log ? Math.log(number / low) / Math.log(high / low) : (number - low) / (high - low));
  const round = (number) => (whole ? Math.round(number) : Number(number.toPrecision(6)));
  const label = `control-${id.replace(/\W/g, "-")}`;
  const slider = element("input", { type: "range", min: 0, max: STEPS, step: whole ? STEPS / (high - low) : 1, id: label, "data-key": id });
  const box = element("input", { type: "text", inputmode: "text", class: "number", "aria-label": `${name}, number`, "data-number": id, spellcheck: "false", autocomplete: "off" });
  const sign = element("span", { class: "unit" });
  const reset = element("button", { type: "button", class: "reset", title: `reset ${name}`, "aria-label": `reset ${name}` }, "↺");
  const ends = [element("span", { class: "end" }), element("span", { class: "end" })];
  const words = problemOf(box, `number-${id.replace(/\W/g, "-")}`);
  let seen = "";
  let editing = false;
  const change = (number, control = id) => {
    const wanted = round(Math.min(Math.max(number, low), high));
    if (wanted === options.get(studio.store.state)) return;
    const patch = options.set(wanted);
    if (patch) studio.store.set(patch, control);
  };
  const nudge = (steps) => {
    const now = options.get(studio.store.state);
    change(whole ? now + Math.sign(steps) : value(Math.min(Math.max(part(now) + steps / STEPS, 0), 1)));
  };

  slider.addEventListener("input", () => change(value(slider.value / STEPS)));
  slider.addEventListener("dblclick", () => studio.store.set(options.reset(), id));
  slider.addEventListener("keydown", (event) => {
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!way || !event.shiftKey) return;
    event.preventDefault();
    nudge(way * FINE);
  });
  slider.addEventListener("wheel", (event) => {
    // Without Shift only the slider in use, so that the list of controls can be scrolled.
    if (!event.shiftKey && document.activeElement !== slider) return;
    event.preventDefault();
    nudge(-Math.sign(event.deltaY || event.deltaX) * NOTCH * (event.shiftKey ? FINE : 1));
  }, { passive: false });
  slider.addEventListener("pointerdown", (event) => {
    if (!event.shiftKey || event.button !== 0) return;
    // Ten times as far for the same change.
    event.preventDefault();
    slider.focus();
    slider.setPointerCapture(event.pointerId);
    const [from, begun] = [event.clientX, part(options.get(studio.store.state))];
    const move = (moved) => change(value(Math.min(Math.max(begun + (FINE * (moved.clientX - from)) / slider.clientWidth, 0), 1)));
    slider.addEventListener("pointermove", move);
    for (const kind of ["pointerup", "pointercancel"]) slider.addEventListener(kind, () => slider.removeEventListener("pointermove", move), { once: true });
  });

  box.addEventListener("input", () => { edit(true); words.clear(); });
  box.addEventListener("blur", () => { edit(false); show(); });
  box.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && editing) { event.stopPropagation(); edit(false); words.clear(); show(); }
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (way) { event.preventDefault(); edit(false); words.clear(); nudge(way * NOTCH * (event.shiftKey ? FINE : 1)); }
  });
  box.addEventListener("change", () => {
    edit(false);
    take(box.value);
    show();
  });
  /** Take what was typed; what cannot be taken as it is, is told. */
  function take(text) {
    const read = readQuantity(text, unit, unitOf(unit));
    const reach = `expected ${shown(low, unit, 6)} to ${shown(high, unit, 6)}`;
    words.clear();
    if (read.problem) { words.tell(`${name}: “${text.trim().slice(0, 40)}” was not taken, ${read.problem}; ${reach}`); return; }
    if (whole && !Number.isInteger(read.value)) words.tell(`${name}: ${digits(read.value, 6)} is no whole number; it became ${Math.round(Math.min(Math.max(read.value, low), high))}`);
    // A bound that is typed as it is shown is not beyond it.
    const near = 1e-5 * (high - low);
    if (read.value < low - near || read.value > high + near) words.tell(`${name}: ${shown(read.value, unit, 6)} is out of range and became the nearest end; ${reach}`);
    change(read.value);
  }
  function edit(on) {
    editing = on;
    box.toggleAttribute("data-editing", on);
  }
  reset.addEventListener("click", () => { words.clear(); studio.store.set(options.reset(), `reset ${id}`); });
  const row = element("div", { class: "row" }, element("label", { for: label, title: options.title ?? options.hint }, name, ...(options.symbol ? [" ", element("i", { class: "symbol" }, options.symbol)] : [])), box, sign, reset, element("div", { class: "reach" }, ends[0], slider, ends[1]), words.element);
  hinted(row, `${options.hint.replace(/[^.]$/, "$&.")} Shift for fine steps, the wheel when it is in use, a double click to reset.`, studio);
  row.dataset.words = `${name} ${options.symbol ?? ""} ${id} ${options.title ?? ""} ${options.hint}`.toLowerCase();

  function show() {
    const number = options.get(studio.store.state);
    box.value = digits(number * unitOf(unit).factor, whole ? 6 : 5);
  }
  function follow(state) {
    const number = options.get(state);
    const now = `${number} ${unitOf(unit).name}`;
    if (now === seen) return;
    // What was said of a number is over as soon as there is another one.
    if (seen && !words.fresh()) words.clear();
    seen = now;
    slider.value = String(Math.round(part(number) * STEPS));
    slider.setAttribute("aria-valuetext", shown(number, unit));
    if (!editing) show();
    sign.textContent = unitOf(unit).name;
    sign.title = unitOf(unit).name;
    ends.forEach((end, k) => { end.textContent = digits([low, high][k] * unitOf(unit).factor, 3); });
    const start = options.value ?? null;
    row.classList.toggle("changed", start !== null && Math.abs(number - start) > 1e-9 * Math.abs(start));
  }
  return { element: row, follow };
}

/** A text; `set` returns the change of the state, or nothing where the text is not taken, `wanted` says what is. */
export function textRow({ name, hint, wanted, get, set }, studio) {
  const box = element("input", { type: "text", id: `control-${name}`, class: "wide", spellcheck: "false", autocomplete: "off" });
  const words = problemOf(box, box.id);
  let last = null;
  box.addEventListener("input", () => {
    const patch = set(box.value.trim());
    words.clear();
    if (!patch) { words.tell(`${name}: “${box.value.trim().slice(0, 40)}” was not taken; expected ${wanted}`); return; }
    studio.store.set(patch, name);
  });
  box.addEventListener("blur", () => { if (box.getAttribute("aria-invalid") === "true") { words.clear(); box.value = get(studio.store.state); } });
  const row = element("div", { class: "row text" }, element("label", { for: box.id, title: hint }, name), box, words.element);
  hinted(row, hint, studio);
  row.dataset.words = `${name} ${hint}`.toLowerCase();
  function follow(state) {
    const now = get(state);
    const typed = box.getAttribute("aria-invalid") === "true" && now === last;
    last = now;
    if (typed || box.value.trim() === now) return;
    words.clear();
    box.value = now;
  }
  return { element: row, follow };
}

export function choiceRow(name, hint, choices, get, set, studio) {
  const box = element("select", { id: `control-${name}`, class: "wide" }, ...choices.map((choice) => element("option", { value: choice }, choice)));
  box.addEventListener("change", () => studio.store.set(set(box.value)));
  const row = element("div", { class: "row text" }, element("label", { for: box.id, title: hint }, name), box);
  hinted(row, hint, studio);
  row.dataset.words = `${name} ${hint}`.toLowerCase();
  return { element: row, follow: (state) => { box.value = get(state); } };
}

function hinted(row, hint, studio) {
  for (const kind of ["pointerenter", "focusin"]) row.addEventListener(kind, () => studio.hint(hint));
}

/** A sentence below a box about what was typed into it. */
function problemOf(box, id) {
  const made = element("p", { class: "problem", role: "alert", id: `${id}-problem`, hidden: true });
  let at = 0;
  return {
    element: made,
    fresh: () => performance.now() - at < 100,
    tell: (text) => {
      at = performance.now();
      made.textContent = text;
      made.hidden = false;
      box.setAttribute("aria-invalid", "true");
      box.setAttribute("aria-describedby", made.id);
    },
    clear: () => {
      made.hidden = true;
      made.textContent = "";
      box.setAttribute("aria-invalid", "false");
      box.removeAttribute("aria-describedby");
    },
  };
}
