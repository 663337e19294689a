// Stories from the paper: each a state, one click away, with the views that show it, and what to notice in it.
import { element as make } from "./dom.js";
import { bare, START, VIEWS } from "./state.js";

const PAPER = { hammer: "hendriks-1983", text: "", constants: {}, waveform: null, overlap: "add", pattern: "", low: 500, high: 2000 };
const BESIDE = ["motion", "sketch", "line"];

const peakOf = ({ data: { t, x } }, from = 0, to = Infinity, way = 1) => {
  let best = -1;
  for (let k = 0; k < t.length; k += 1) if (t[k] >= from && t[k] <= to && (best < 0 || way * x[k] > way * x[best])) best = k;
  return best < 0 ? from : t[best];
};
const strongest = ({ data }, name) => data.t[data[name].reduce((best, force, k) => (Math.abs(force) > Math.abs(data[name][best]) ? k : best), 0)];

/**
 * Entries: `state`; `view`, the large one; `window`, the times that are shown, s; `remarks` on a run, each a time and a text;
 * `other`, a second run, whose curve is shown behind the first.
 */
const STORIES = [
  {
    name: "One dot", view: "forces", state: { rate: 1000, pulses: 1 }, window: [0, 1.5e-3],
    remarks: (motion) => [[peakOf(motion), "prints"], [strongest(motion, "F backstop"), "the hardest blow"]],
    notice: "Fired once, the armature flies to the paper, prints, and comes back. The backstop takes a blow several times as hard as the paper, and some bounces follow: a next firing meets them.",
  },
  {
    name: "660 or 700 µs", view: "map", state: { rate: 1e6 / 660, pulses: 2 }, other: { rate: 1e6 / 700, pulses: 2 }, switches: ["660 µs", "700 µs"], window: [0, 2.2e-3],
    remarks: (motion, dots) => [[motion.fired[1], "second pulse"], ...(dots?.dots[1] ? [[peakOf(motion, motion.fired[1]), dots.dots[1].struck ? "prints again" : "falls short: lost"]] : [])],
    notice: "Figure 6. After 660 µs the second pulse pulls while the armature still comes back, and the dot is lost; 40 µs later it catches it on the rise and prints harder than the first. The other run is the grey curve.",
  },
  {
    name: "Buzz printing", view: "phase", state: { rate: 1460, pulses: 12 }, window: null,
    remarks: (motion) => [[peakOf(motion, motion.fired[9], motion.fired[10], -1), "turns before the backstop"]],
    notice: "Figure 7. Fired in step with the return from the paper, the armature turns round before the backstop: every dot is printed, in the end with four tenths of the force.",
  },
  {
    name: "The second dot lost", view: "map", state: { rate: 1520, pulses: 9, low: 1300, high: 1800 }, window: [0, 3e-3],
    remarks: (motion, dots) => (dots?.dots[1] && !dots.dots[1].struck ? [[peakOf(motion, motion.fired[1], motion.fired[2]), "does not reach the paper"]] : []),
    notice: "Drag the line in the map up from 1300 Hz: the dots become irregular, and from about 1473 Hz on the second is lost, and above 1555 Hz the third. Red in the map is a lost dot.",
  },
  {
    name: "A strange train", view: "strobe", state: { rate: 1050, pulses: 40, low: 900, high: 1300 }, window: [0, 1.2e-2], remarks: () => [],
    notice: "Figure 11. Wait for the strobe section: an endless train at this rate never repeats itself. Its points lie on a curve, and the largest exponent is above zero.",
  },
  {
    name: "Hung up", view: "map", state: { rate: 2200, pulses: 9, low: 1400, high: 2600 }, window: null,
    remarks: (motion) => [[peakOf(motion, motion.fired[3], motion.fired[8], -1), "comes no further back"]],
    notice: "At very high rates the armature never comes back to the backstop. It hovers at the paper, and dots are weak or lost.",
  },
];

/** Build the row of stories and the place that says what to notice. */
export function storyRow(studio) {
  const note = make("p", { class: "notice", role: "note", hidden: true });
  const buttons = STORIES.map((story) => make("button", { type: "button", class: "story", "aria-pressed": "false", onclick: () => open(story) }, story.name));
  let told = null;
  let set = null; // the entries of the state that is told
  let begins = false;

  function open(story, state = story.state) {
    leave();
    told = story;
    set = { ...PAPER, ...state };
    begins = true;
    const views = VIEWS.filter((view) => view === story.view || BESIDE.includes(view));
    studio.store.set({ ...set, line: studio.store.state.line || START.line, views });
    studio.remarks = () => (isTold() ? story.remarks(studio.frames.motion, studio.frames.dots) : []);
    if (story.other) behind(story, state === story.other ? 0 : 1);
    const each = (entry, text) => make("button", { type: "button", class: "switch", "aria-pressed": String(entry === state), onclick: () => open(story, entry) }, text);
    const switches = story.switches ? [each(story.state, story.switches[0]), each(story.other, story.switches[1])] : [];
    note.replaceChildren(make("span", {}, make("b", {}, `${story.name}. `), story.notice), ...switches, make("button", { type: "button", class: "shut", "aria-label": "close the story", onclick: shut }, "×"));
    note.hidden = false;
    mark();
  }
  /** Show the other run of a story behind the one that is set. */
  async function behind(story, which) {
    const state = { ...bare(studio.store.state), ...PAPER, ...[story.state, story.other][which] };
    const motion = await studio.ask("curves", { state });
    if (told !== story || motion.kind === "refusal") return;
    studio.companion = { name: story.switches[which], state, motion };
    for (const view of studio.store.state.views) studio.views[view].draw();
  }
  const isTold = () => told && Object.entries(set).every(([key, value]) => JSON.stringify(studio.store.state[key]) === JSON.stringify(value));
  function leave() {
    [told, set, studio.companion, studio.remarks] = [null, null, null, null];
    studio.zoom(null);
  }
  function shut() {
    leave();
    note.hidden = true;
    mark();
    studio.parts.grid.focus({ preventScroll: true });
  }
  function mark() { buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(STORIES[k] === told))); }
  // A story is left as soon as another hammer is taken; what is turned in it belongs to it.
  studio.store.listeners.add((state) => { if (told && (state.text || state.hammer !== PAPER.hammer)) shut(); });
  // Its times are shown, and played once, as soon as its run is there.
  studio.element.addEventListener("painted", ({ detail }) => {
    if (!begins || detail.kind !== "dots" || studio.busy || studio.stale || !isTold()) return;
    begins = false;
    studio.zoom(told.window);
    studio.views.sketch.playOnce();
  });
  return { buttons, note, open: (k) => open(STORIES[k]), shut };
}
