// The pulse that is fired: its curve with handles to drag, its shape, and a row for each of its constants.
import { axes, curve, line } from "./axes.js";
import { element } from "./dom.js";
import { surface } from "./pen.js";
import { colours } from "./theme.js";
import { unitOf } from "./units.js";

const MARGIN = { left: 42, right: 8, top: 6, bottom: 30 };
const START = { amplitude: 1, width: 3e-4, rise: 5e-5, decay: 5e-5, fall: 5e-5 };
const LONGEST = 2e-3;

export function waveformEditor(group, studio, sliderRow) {
  const shapes = Object.keys(studio.shapes).filter((shape) => shape !== "sampled");
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
    const before = current() ?? {};
    const wanted = { shape: choice.value };
    for (const { name } of studio.shapes[choice.value]) wanted[name] = before[name] ?? START[name];
    wanted.quantity = before.quantity ?? studio.quantity();
    studio.store.set({ waveform: wanted });
  });
  // A hammer without a pulse of its own goes back to the one that it opens with.
  reset.addEventListener("click", () => studio.store.set({ waveform: studio.described.waveform ? null : studio.described.start.waveform ?? null }));

  const area = surface(holder, (pen, width, height) => {
    const frame = studio.frames.motion;
    if (!frame?.pulse) return;
    const c = colours();
    const { t, value } = frame.pulse;
    const [time, amount] = [unitOf("s"), unitOf(frame.quantity === "force" ? "N" : "A")];
    const longest = grip?.span ?? Math.max(t.at(-1) * 1.25, 1e-5);
    const most = Math.max(...value.map(Math.abs), 1e-9);
    const [low, high] = grip?.ends ?? [Math.min(...value) < -0.01 * most ? -1.3 * most : -0.12 * most, 1.3 * most];
    plane = axes(pen, width, height, { low: 0, high: longest, label: time.name, factor: time.factor }, { low, high, label: amount.name, factor: amount.factor }, MARGIN);
    pen.strokeStyle = c.drive;
    pen.lineWidth = 1.6;
    curve(pen, plane, t, value);
    for (const { x, y } of handles(frame)) {
      pen.fillStyle = c.panel;
      pen.strokeStyle = c.drive;
      pen.beginPath();
      pen.arc(plane.X(x), plane.Y(y), 5, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
    }
    pen.strokeStyle = c.muted;
    line(pen, plane.box.x, plane.Y(0), plane.box.x + plane.box.w, plane.Y(0));
  }, "The pulse, current or force against time");

  /** Handles: the top sets the amplitude, the one on the axis the width. */
  function handles(frame) {
    const wave = current();
    if (!wave || wave.shape === "sampled") return [];
    const { t, value } = frame.pulse;
    const peak = value.reduce((best, part, k) => (Math.abs(part) > Math.abs(value[best]) ? k : best), 0);
    const end = (wave.rise && wave.shape === "trapezoid" ? wave.rise : 0) + wave.width;
    return [{ kind: "amplitude", x: t[peak], y: value[peak] }, { kind: "width", x: Math.min(end, t.at(-1)), y: 0 }];
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
    if (grip.kind === "width") patch.width = Math.min(Math.max(wave.width + plane.x(x) - plane.x(grip.from.x), 5e-6), LONGEST);
    else if (value !== 0) patch.amplitude = wave.amplitude * Math.min(Math.max((value + plane.y(y) - plane.y(grip.from.y)) / value, 0.02), 5);
    for (const name of Object.keys(patch)) patch[name] = Number(patch[name].toPrecision(5));
    put(patch, `waveform.${grip.kind}`);
  });
  for (const kind of ["pointerup", "pointercancel"]) area.canvas.addEventListener(kind, () => { grip = null; area.draw(); });

  function follow() {
    const wave = current();
    const kinds = wave?.shape === "sampled" ? [...shapes, "sampled"] : shapes;
    if (choice.options.length !== kinds.length) choice.replaceChildren(...kinds.map((kind) => element("option", { value: kind }, kind)));
    choice.value = wave?.shape ?? "";
    const kind = `${wave?.shape}${wave?.quantity}`;
    if (wave && kind !== made) {
      made = kind;
      list = wave.shape === "sampled" ? [] : studio.shapes[wave.shape].map((field) => fieldRow(field, wave));
      rows.replaceChildren(...list.map((row) => row.element));
    }
    for (const row of list) row.follow(studio.store.state);
    if (!grip) area.draw();
  }

  function fieldRow({ name, unit, meaning, positive }, wave) {
    const own = studio.described.waveform?.shape === wave.shape ? studio.described.waveform[name] : wave[name];
    const most = unit === "s" ? Math.max(LONGEST / 2, 2 * own) : 3 * (Math.abs(own) || 1);
    return sliderRow({
      id: `waveform.${name}`, name, hint: `waveform.${name}: ${meaning}.`, title: meaning, unit: unit === "A" && wave.quantity === "force" ? "N" : unit,
      low: unit === "s" ? (positive ? 1e-6 : 0) : -most, high: most, value: own,
      get: () => current()?.[name] ?? own, set: (value) => ({ waveform: { ...current(), [name]: value } }), reset: () => ({ waveform: { ...current(), [name]: own } }),
    }, studio);
  }
  return { follow, draw: area.draw };
}
