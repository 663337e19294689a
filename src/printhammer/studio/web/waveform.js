// The pulse that is fired: its curve with handles to drag, its shape, and a row for each of its constants.
import { axes, curve, line } from "./axes.js";
import { element } from "./dom.js";
import { surface } from "./pen.js";
import { choicesOf, decayVoltage, hasRow, isDriver, isOffered, longest, reachOf, startOf } from "./pulses.js";
import { choiceRow } from "./rows.js";
import { colours } from "./theme.js";
import { unitOf } from "./units.js";

const UNITS = { current: "A", force: "N", voltage: "V" };
const MARGIN = { left: 42, right: 8, top: 6, bottom: 30 };

export function waveformEditor(group, studio, sliderRow) {
  // A continuous force drives an armature without a magnet only.
  const shapes = Object.keys(studio.shapes).filter((shape) => shape !== "sampled" && (shape !== "sine" || studio.quantity() === "force"));
  const choice = element("select", { id: "control-shape", class: "wide", "aria-label": "shape of the pulse" });
  const reset = element("button", { type: "button", class: "reset", title: "reset", "aria-label": "reset pulse" }, "↺");
  const holder = element("div", { class: "pulse" });
  const rows = element("div");
  group.append(element("div", { class: "row text choice", "data-words": "shape pulse waveform" }, element("label", { for: "control-shape" }, "shape"), choice, reset), holder, rows);
  let made = null;
  let list = [];
  let plane = null;
  let grip = null;

  const current = () => studio.store.state.waveform ?? studio.described.waveform ?? null;
  const put = (patch, control) => studio.store.set({ waveform: { ...current(), ...patch } }, control);
  choice.addEventListener("change", () => {
    studio.store.set({ waveform: startOf(studio, choice.value, current() ?? {}) });
  });
  // A hammer without a pulse of its own goes back to the one that it opens with.
  reset.addEventListener("click", () => studio.store.set({ waveform: studio.described.waveform ? null : studio.described.start.waveform ?? null }));

  const area = surface(holder, (pen, width, height) => {
    const frame = studio.frames.motion;
    if (!frame?.pulse) return;
    const c = colours();
    const { t, value } = frame.pulse;
    const [time, amount] = [unitOf("s"), unitOf(UNITS[frame.quantity])];
    const longest = grip?.span ?? Math.max(t.at(-1) * 1.25, 1e-5);
    const most = Math.max(...value.map(Math.abs), 1e-9);
    const [low, high] = grip?.ends ?? [Math.min(...value) < -0.01 * most ? -1.3 * most : -0.12 * most, 1.3 * most];
    plane = axes(pen, width, height, { low: 0, high: longest, label: time.name, factor: time.factor }, { low, high, label: amount.name, factor: amount.factor }, MARGIN);
    const colour = frame.quantity === "voltage" ? c.volts : c.drive;
    pen.strokeStyle = colour;
    pen.lineWidth = 1.6;
    curve(pen, plane, t, value);
    for (const { x, y } of handles(frame)) {
      pen.fillStyle = c.panel;
      pen.strokeStyle = colour;
      pen.beginPath();
      pen.arc(plane.X(x), plane.Y(y), 5, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
    }
    pen.strokeStyle = c.muted;
    line(pen, plane.box.x, plane.Y(0), plane.box.x + plane.box.w, plane.Y(0));
  }, "The pulse against time: current, force, or voltage of the supply");

  /** Handles: the top sets the amplitude, the one on the axis the width. */
  function handles(frame) {
    const wave = current();
    if (!wave || wave.shape === "sampled") return [];
    const { t, value } = frame.pulse;
    const peak = value.reduce((best, part, k) => (Math.abs(part) > Math.abs(value[best]) ? k : best), 0);
    const end = (wave.rise && wave.shape === "trapezoid" ? wave.rise : 0) + wave.width;
    if (wave.width === undefined) return [{ kind: "amplitude", x: t[peak], y: value[peak] }];
    return [{ kind: isDriver(studio, wave) ? "voltage" : "amplitude", x: t[peak], y: value[peak] }, { kind: "width", x: Math.min(end, t.at(-1)), y: 0 }];
  }

  area.canvas.addEventListener("pointerdown", (event) => {
    const frame = studio.frames.motion;
    if (!plane || !frame?.pulse) return;
    const bounds = area.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - bounds.left, event.clientY - bounds.top];
    const near = handles(frame).map((handle) => ({ ...handle, away: Math.hypot(plane.X(handle.x) - x, plane.Y(handle.y) - y) })).sort((a, b) => a.away - b.away)[0];
    if (!near || near.away > 24) return;
    // The axes stay while a handle is dragged.
    grip = { kind: near.kind, from: { x, y, wave: current(), value: near.y }, span: plane.x(plane.box.x + plane.box.w), ends: [plane.y(plane.box.y + plane.box.h), plane.y(plane.box.y)] };
    area.canvas.setPointerCapture(event.pointerId);
  });
  area.canvas.addEventListener("pointermove", (event) => {
    if (!grip) return;
    const bounds = area.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - bounds.left, event.clientY - bounds.top];
    const { wave, value } = grip.from;
    const patch = {};
    if (grip.kind === "width") patch.width = Math.min(Math.max(wave.width + plane.x(x) - plane.x(grip.from.x), 5e-6), longest(wave.width));
    else if (value !== 0) patch[grip.kind] = wave[grip.kind] * Math.min(Math.max((value + plane.y(y) - plane.y(grip.from.y)) / value, 0.02), 5);
    for (const name of Object.keys(patch)) patch[name] = Number(patch[name].toPrecision(5));
    put(patch, `waveform.${grip.kind}`);
  });
  for (const kind of ["pointerup", "pointercancel"]) area.canvas.addEventListener(kind, () => { grip = null; area.draw(); });

  function follow() {
    const wave = current();
    const kinds = wave?.shape === "sampled" ? [...shapes, "sampled"] : shapes;
    if (choice.options.length !== kinds.length) choice.replaceChildren(...grouped(kinds));
    for (const option of choice.options) option.disabled = !isOffered(studio, option.value, wave);
    choice.value = wave?.shape ?? "";
    const choices = wave ? choicesOf(studio, wave) : [];
    const kind = [wave?.shape, wave?.quantity, ...choices.map((each) => each.get(wave))].join();
    if (wave && kind !== made) {
      made = kind;
      const fields = wave.shape === "sampled" ? [] : studio.shapes[wave.shape].filter(({ name }) => hasRow(wave, name));
      list = fields.map((field) => fieldRow(field, wave));
      list.splice(list.length && choices.length ? 2 : 0, 0, ...choices.map(pathRow));
      rows.replaceChildren(...list.map((row) => row.element));
    }
    for (const row of list) row.follow(studio.store.state);
    if (!grip) area.draw();
  }

  function fieldRow(field, wave) {
    const { name, unit, meaning } = field;
    const of = (from) => (name === "decay_voltage" ? decayVoltage(from) : from[name]);
    const { waveform: first } = studio.described;
    const alike = first?.shape === wave.shape && (name !== "decay_voltage" || first.decay === wave.decay);
    const kept = (alike && typeof first[name] === "number") || name === "decay_voltage" ? (alike ? first : wave)[name] : wave[name];
    const own = kept ?? of(wave);
    return sliderRow({
      id: `waveform.${name}`, name: name.replaceAll("_", " "), hint: `waveform.${name}: ${meaning}.`, title: meaning, unit: unit === "A" && name === "amplitude" ? UNITS[wave.quantity] : unit, ...reachOf(studio, wave, field, own), value: own,
      get: () => (current() ? of(current()) ?? own : own), set: (value) => ({ waveform: { ...current(), [name]: value } }), reset: () => ({ waveform: { ...current(), [name]: kept ?? null } }),
    }, studio);
  }

  function pathRow({ name, hint, choices, get, set }) {
    return choiceRow(name, hint, choices, () => get(current()), (value) => ({ waveform: { ...current(), ...set(value, current()) } }), studio);
  }

  /** Options of the shapes: what is given as a curve, and the drivers, which need a magnet whose flux linkage is known. */
  function grouped(kinds) {
    const option = (kind) => element("option", { value: kind }, kind);
    const of = (driver) => kinds.filter((kind) => studio.drivers.includes(kind) === driver).map(option);
    const { rail, quantities } = studio.described;
    const why = !rail ? "driver: needs a coil whose flux linkage is known" : quantities.includes("voltage") ? "driver of the coil, by voltage" : "driver: needs a page whose first hammer this is";
    return [element("optgroup", { label: "a curve of current, force or voltage" }, ...of(false)), element("optgroup", { label: why }, ...of(true))];
  }
  return { follow, draw: area.draw };
}
