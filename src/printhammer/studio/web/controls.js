// The controls: what is turned most in front, below a fold a row for each constant, with unit, range, hint and reset; they can be searched.
import { element } from "./dom.js";
import { isDriver } from "./pulses.js";
import { choiceRow, sliderRow, textRow } from "./rows.js";
import { START } from "./state.js";
import { waveformEditor } from "./waveform.js";
import { large, moverOf, prints } from "./words.js";

const TITLES = { train: "Firings", map: "Map", magnet: "Magnet", spring: "Spring", pack: "Pack", backstop: "Backstop", coil: "Coil" };

/** Build the controls for a hammer, what is turned most in front; returns how they follow the state. */
export function buildControls(holder, studio) {
  const rows = [];
  const search = element("input", { type: "search", placeholder: "search the controls", "aria-label": "search the controls", class: "search" });
  const front = element("div", { class: "rows front" });
  const fold = element("details", { class: "fold" }, element("summary", {}, "All constants ", studio.parts.honesty));
  holder.replaceChildren(search, front, fold);
  const { described } = studio;
  const start = { ...START, ...described.start };
  const put = (place, row) => {
    place.append(row.element);
    rows.push(row);
    return row;
  };
  const add = (place, options) => put(place, sliderRow(options, studio));

  const rate = {
    id: "rate", name: "rate", hint: "Firings per second; a time between them is written 1/660us.", unit: "Hz", low: Math.min(50, start.low), high: Math.min(5000, 5 * start.high), log: true,
    get: (state) => state.rate, set: (value) => ({ rate: value }), reset: () => ({ rate: start.rate }),
  };
  add(front, rate);
  // On a phone the rate stays below the view.
  studio.parts.pinned.replaceChildren();
  add(studio.parts.pinned, { ...rate, id: "pinned rate" });
  const most = studio.limits.MOST_PULSES;
  const count = add(front, {
    id: "pulses", name: "pulses", hint: "Number of firings, or of periods of a sinusoidal force.", unit: "1", low: 1, high: most, whole: true,
    get: (state) => state.pulses, set: (value) => ({ pulses: value }), reset: () => ({ pulses: start.pulses }),
  });
  for (const control of described.combined) add(front, { ...control, id: control.key, name: control.key, hint: control.meaning, ...moving(control, studio) });
  if (prints(described)) {
    put(front, textRow({
      name: "line", hint: `Text that is printed, nine wires high, slot by slot at this rate, at most ${studio.limits.LONGEST_TEXT} characters; empty: the dots of the burst.`, wanted: `at most ${studio.limits.LONGEST_TEXT} characters`,
      get: (state) => state.line, set: (value) => (value.length <= studio.limits.LONGEST_TEXT ? { line: value } : null),
    }, studio));
  }
  rows.push(waveformEditor(front, studio, sliderRow));

  const sections = new Map();
  const section = (name, title = TITLES[name] ?? name) => {
    if (!sections.has(name)) sections.set(name, fold.appendChild(element("section", { class: "rows" }, element("h3", {}, title))));
    return sections.get(name);
  };
  // What a voltage drives is looked at first.
  const listed = [...described.constants, ...described.open ?? []].sort((one, other) => (other.section === "coil") - (one.section === "coil"));
  const mover = moverOf(described);
  const titles = { ...TITLES, armature: large(mover) };
  for (const constant of listed) {
    const meaning = constant.meaning.replace("armature", mover).replace("mass of the mass", "mass");
    const [list, entry] = constant.section.split(".");
    add(section(constant.section, entry ? `${large(list)}: ${entry}` : titles[constant.section]), {
      ...constant, id: constant.key, name: constant.unit === "degC" ? "temperature" : entry ? `${entry}: ${constant.key.split(".").at(-1)}` : meaning, title: constant.key,
      hint: `${constant.key}: ${meaning}${constant.unit === "1" ? "" : `, ${constant.unit}`}. ${constant.equation}. ${constant.status}: ${constant.source}.`,
      get: (state) => state.constants[constant.key] ?? constant.value,
      set: (value) => ({ constants: { ...studio.store.state.constants, [constant.key]: value } }),
      reset: () => {
        const { [constant.key]: _gone, ...rest } = studio.store.state.constants;
        return { constants: rest };
      },
    });
  }
  put(section("train"), textRow({
    name: "pattern", hint: `Which slots are fired, such as 1101, at most ${most}; empty: all pulses.`, wanted: `0 and 1, at least one 1, at most ${most} in all`,
    get: (state) => state.pattern, set: (value) => (/^[01]*1[01]*$|^$/.test(value) && value.length <= most ? { pattern: value } : null),
  }, studio));
  const overlap = put(section("train"), choiceRow("overlap", "What overlapping pulses do: add up, or the latest replaces the others, as that of a driver always does.", ["add", "replace"], (state) => state.overlap, (value) => ({ overlap: value }), studio));
  for (const end of ["low", "high"]) {
    add(section("map"), {
      id: end, name: `${end === "low" ? "lowest" : "highest"} rate`, hint: "End of the map's axis of firing rates.", unit: "Hz", low: Math.min(50, start.low), high: Math.min(10000, 10 * start.high), log: true,
      get: (state) => state[end], set: (value) => ({ [end]: value }), reset: () => ({ [end]: start[end] }),
    });
  }
  searched(holder, search, fold);
  return () => {
    const { state } = studio.store;
    const what = (state.waveform ?? described.waveform)?.shape === "sine" ? "periods" : "pulses";
    count.element.querySelector("label").textContent = what;
    count.element.querySelector(".number").ariaLabel = `${what}, number`;
    // Of a driver the latest firing always replaces those before it.
    overlap.element.querySelector("select").disabled = isDriver(studio, state.waveform ?? described.waveform);
    for (const row of rows) row.follow(state);
  };
}

/** Show only the rows in whose name, key, meaning or source all words of the search occur. */
function searched(holder, search, fold) {
  const none = holder.appendChild(element("p", { class: "none", hidden: true }, "no control is called so"));
  let open = null;
  search.addEventListener("input", () => {
    const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
    open ??= fold.open;
    let left = 0;
    for (const each of holder.querySelectorAll(".rows")) {
      const title = (each.querySelector("h3")?.textContent ?? "drive pulse").toLowerCase();
      let count = 0;
      for (const row of each.querySelectorAll("[data-words]")) {
        row.hidden = !words.every((word) => row.dataset.words.includes(word) || title.includes(word));
        count += Number(!row.hidden);
      }
      left += count;
      each.hidden = words.length > 0 && count === 0;
    }
    fold.open = words.length ? true : open;
    none.hidden = left > 0;
    if (!words.length) open = null;
  });
  search.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    search.value = "";
    search.dispatchEvent(new Event("input"));
  });
}

/** A control that moves several constants: its value is that of the first, less where that one starts. */
export function moving(control, studio) {
  const base = Object.fromEntries(studio.described.constants.map((constant) => [constant.key, constant.value]));
  const keys = Object.keys(control.moves);
  const now = (state, key) => state.constants[key] ?? base[key];
  const ends = Object.fromEntries(studio.described.constants.map(({ key, low, high }) => [key, [low, high]]));
  /** A change, as far as every constant that it moves can follow, whatever other controls have done. */
  const within = (state, wanted) => keys.reduce((change, key) => {
    const [share, at] = [control.moves[key], now(state, key)];
    const [low, high] = ends[key].map((end) => (end - at) / share).sort((a, b) => a - b);
    return Math.min(Math.max(change, low), high);
  }, wanted);
  const value = (state) => control.value + (now(state, keys[0]) - base[keys[0]]) / control.moves[keys[0]];
  return {
    get: value,
    set: (wanted) => {
      const { state } = studio.store;
      const change = within(state, wanted - value(state));
      const constants = { ...state.constants };
      for (const key of keys) constants[key] = Math.min(Math.max(now(state, key) + control.moves[key] * change, ends[key][0]), ends[key][1]);
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
