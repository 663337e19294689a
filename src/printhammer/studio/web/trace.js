// The trace of an oscilloscope that is laid over the motion: its name, its offsets, and how far the run is from it.
import { displacementAt } from "./curves.js";
import { element as make } from "./dom.js";
import { sliderRow } from "./rows.js";
import { shown } from "./units.js";

/** Return the RMS distance of a motion from a trace with its offsets, m, and the number of points within the run. */
function residualOf(motion, { t, values, dt, dx }) {
  const [first, last] = [motion.data.t[0], motion.data.t.at(-1)];
  let [sum, count] = [0, 0];
  t.forEach((time, k) => {
    const at = time + dt;
    if (!(at >= first && at <= last) || !Number.isFinite(values[k])) return;
    sum += (values[k] + dx - displacementAt(motion, at)) ** 2;
    count += 1;
  });
  return { rms: count ? Math.sqrt(sum / count) : null, count };
}

/** Build the row of the trace; a change of it is a step of the history. */
export function traceRow(studio) {
  const name = make("input", { type: "text", "aria-label": "name of the trace", maxlength: 60, size: 18, spellcheck: "false" });
  const residual = make("output", { class: "residual", role: "status" });
  const rows = make("div", { class: "offsets" });
  const holder = make("section", { class: "trace", "aria-label": "measured trace", hidden: true },
    make("span", { class: "chip" }, make("i", { "aria-hidden": "true" }), name, make("button", { type: "button", title: "take the trace away", "aria-label": "take the trace away", onclick: () => studio.store.set({ trace: null }) }, "×")), rows, residual);
  const change = (patch, control) => studio.store.set({ trace: { ...studio.store.state.trace, ...patch } }, control);
  name.addEventListener("change", () => { if (name.value.trim()) change({ name: name.value.trim() }); else name.value = studio.store.state.trace.name; });
  let [laid, made] = [null, null];
  let offsets = [];

  /** Build the sliders of the offsets, as wide as the trace is long and high. */
  function build({ t, values }) {
    const known = values.filter(Number.isFinite);
    const ends = { dt: 0.5 * (t.at(-1) - t[0]) || 1e-3, dx: Math.max(...known) - Math.min(...known) || 1e-4 };
    const offset = (key, what, unit) => sliderRow({
      id: `trace.${key}`, name: what, hint: `Offset in ${what.split(" ")[0]} that is added to the trace.`, unit, low: -ends[key], high: ends[key], value: 0,
      get: (state) => state.trace?.[key] ?? 0, set: (value) => ({ trace: { ...studio.store.state.trace, [key]: value } }), reset: () => ({ trace: { ...studio.store.state.trace, [key]: 0 } }),
    }, studio);
    offsets = [offset("dt", "time offset", "s"), offset("dx", "displacement offset", "m")];
    rows.replaceChildren(...offsets.map((row) => row.element));
  }
  function tell() {
    const { trace } = studio.store.state;
    if (!trace || !studio.frames.motion) return;
    const { rms, count } = residualOf(studio.frames.motion, trace);
    residual.textContent = rms === null ? "no point within the run" : `residual ${shown(rms, "m", 3)} RMS over ${count} points`;
  }
  studio.store.listeners.add((state) => {
    const trace = state.trace ?? null;
    if (trace !== laid) {
      laid = trace;
      holder.hidden = !trace;
      if (trace && trace.t !== made) { made = trace.t; build(trace); }
      if (trace && document.activeElement !== name) name.value = trace.name;
      studio.overlay = trace && { what: "displacement", name: trace.name, data: { t: Array.from(trace.t, (time) => time + trace.dt), values: Array.from(trace.values, (value) => value + trace.dx) } };
      for (const view of state.views) studio.views[view]?.draw();
    }
    if (trace) for (const row of offsets) row.follow(state);
    tell();
  });
  studio.element.addEventListener("painted", ({ detail }) => { if (detail.kind === "motion") tell(); });
  return holder;
}
