// What can be found: the rate where a dot is lost, and the next rate at which a train never repeats itself.
import { ordinal } from "./captions.js";
import { element as make } from "./dom.js";
import { bare } from "./state.js";
import { shown } from "./units.js";

const GRID = 120; // rates that are looked at from end to end of the map
const CLOSE = 1e-6; // of a rate, to which a border is told
const SURE = 3; // standard errors by which an exponent is above zero
const MOST = 12;

/** Build the row of what can be found. */
export function findRow(studio) {
  const dot = make("select", { "aria-label": "which dot", class: "find-dot" }, ...Array.from({ length: MOST }, (_each, k) => make("option", { value: k + 1 }, ordinal(k + 1))));
  dot.value = "2";
  const lost = make("button", { type: "button", class: "find-lost", onclick: () => search(lost, (ended) => lostRate(Number(dot.value), ended)), title: "Find the lowest rate of the map at which this dot is lost" }, "dot lost");
  const strange = make("button", { type: "button", class: "find-strange", onclick: () => search(strange, strangeRate), title: "Find the next rate at which an endless train never repeats itself" }, "strange rate");
  let running = null;

  /** Search until something is found, or until the state is changed or the button is pressed once more. */
  async function search(button, work) {
    if (running) { running.over = true; return; }
    const own = { over: false, state: studio.store.state };
    running = own;
    button.setAttribute("aria-busy", "true");
    try {
      const answer = await work(() => own.over || studio.store.state !== own.state);
      if (answer) studio.say(answer.text, !answer.rate);
      if (answer?.rate) studio.store.set({ rate: answer.rate, ...(answer.pulses ? { pulses: answer.pulses } : {}) }, "find");
      if (answer?.rate) requestAnimationFrame(() => studio.hint(answer.text));
      if (!answer) studio.say("the search was ended");
    } finally {
      button.removeAttribute("aria-busy");
      running = null;
    }
  }
  const asked = (kind, patch) => studio.ask(kind, { state: { ...bare(studio.store.state), ...patch } });
  const rates = () => {
    const { low, high } = studio.store.state;
    return [Math.min(low, high), Math.max(low, high)];
  };
  const rounded = (rate, way) => {
    const step = 10 ** (Math.floor(Math.log10(rate)) - 5);
    return Number(((way > 0 ? Math.ceil(rate / step) : Math.floor(rate / step)) * step).toPrecision(7));
  };

  /** The lowest rate of the map from which on a dot is lost: first on a grid, then by halves. */
  async function lostRate(number, ended) {
    const { state } = studio.store;
    const fired = state.pattern ? [...state.pattern].filter((mark) => mark === "1").length : Math.max(state.pulses, number + 1);
    if (fired < number) return { text: `the pattern fires ${fired} times, there is no ${ordinal(number)} dot` };
    const pulses = state.pattern ? state.pulses : Math.min(fired, studio.limits.MOST_PULSES);
    // Nothing is known where a run is refused, or ends before its firing.
    const gone = async (rate) => {
      const dot = (await asked("dots", { rate, pulses })).dots?.[number - 1];
      return dot ? !dot.struck : null;
    };
    const [low, high] = rates();
    // The map tells where to look, and the runs whether it is so: a touch may be too short for it.
    const seen = studio.frames.map?.detail === "full" ? (studio.views.map.lost?.().list ?? []).filter(([, , k]) => k === number - 1).map(([row]) => row) : [];
    const rows = studio.frames.map?.data.codes?.shape[0] ?? 2;
    const places = [...Array.from({ length: GRID + 1 }, (_each, k) => low + (k / GRID) * (high - low)), ...seen.map((row) => low + (row / (rows - 1)) * (high - low))].sort((a, b) => a - b);
    let [kept, unknown] = [null, 0];
    for (const rate of places) {
      if (ended()) return null;
      const is = await gone(rate);
      if (is === null) { unknown += 1; continue; }
      if (!is) { kept = rate; continue; }
      if (kept === null) return { rate: rounded(rate, 1), pulses, text: `the ${ordinal(number)} dot is lost already at ${shown(rate, "Hz", 6)}, the lowest rate ${unknown ? "whose run comes so far" : "of the map"}` };
      let [struck, is_lost] = [kept, rate];
      while (is_lost - struck > CLOSE * is_lost && !ended()) {
        const middle = 0.5 * (struck + is_lost);
        if (await gone(middle)) is_lost = middle;
        else struck = middle;
      }
      return { rate: rounded(is_lost, 1), pulses, text: `the ${ordinal(number)} dot is lost from ${shown(is_lost, "Hz", 6)} on, a firing every ${shown(1 / is_lost, "s", 5)}` };
    }
    const range = `from ${shown(low, "Hz")} to ${shown(high, "Hz")}`;
    if (kept === null) return { text: `no run ${range} comes to the ${ordinal(number)} dot` };
    return { text: `the ${ordinal(number)} dot is struck ${range}, wherever ${unknown ? "a run comes so far" : "it was looked for"}` };
  }

  /** The next rate upward, and from the low end again, whose endless train has an exponent above zero. */
  async function strangeRate(ended) {
    const [low, high] = rates();
    const step = (high - low) / GRID;
    const from = Math.min(Math.max(studio.store.state.rate, low), high);
    for (let k = 1; k <= GRID; k += 1) {
      if (ended()) return null;
      const rate = Number((from + k * step > high ? low + ((from + k * step - high) % (high - low)) : from + k * step).toPrecision(6));
      studio.say(`looking for a strange rate: ${shown(rate, "Hz")}, ${k} of ${GRID}; press again to end it`);
      const frame = await asked("exponent", { rate });
      // What is refused at one rate is so at all.
      if (frame.kind === "refusal") return { text: `no strange rate is looked for: ${frame.reason}` };
      const { exponent } = frame;
      if (!exponent || !(exponent.value > SURE * exponent.standard_error)) continue;
      const { verdict } = await asked("verdict", { rate });
      if (verdict?.verdict === "strange") return { rate, text: `an endless train at ${shown(rate, "Hz", 6)} never repeats itself, exponent ${verdict.exponent_per_firing.toPrecision(2)} per firing` };
    }
    return { text: `no strange train among ${GRID} rates from ${shown(low, "Hz")} to ${shown(high, "Hz")}` };
  }
  return make("span", { class: "finds" }, dot, lost, strange);
}
