// Stories from the paper: each a state, one click away, and what to notice in it.
import { element as make } from "./dom.js";

const PAPER = { hammer: "hendriks-1983", text: "", constants: {}, waveform: null, overlap: "add", pattern: "", low: 500, high: 2000 };

export const STORIES = [
  {
    name: "One dot", state: { rate: 1000, pulses: 1 },
    notice: "Fired once, the armature flies to the paper, prints, and comes back. The backstop takes a blow several times as hard as the paper, and some bounces follow: a next firing meets them.",
  },
  {
    name: "660 or 700 µs", state: { rate: 1e6 / 660, pulses: 2 }, other: { rate: 1e6 / 700, pulses: 2 }, switches: ["660 µs", "700 µs"],
    notice: "Figure 6. After 660 µs the second pulse pulls while the armature still comes back, and the dot is lost; 40 µs later it catches it on the rise and prints harder than the first.",
  },
  {
    name: "Buzz printing", state: { rate: 1460, pulses: 12 },
    notice: "Figure 7. Fired in step with the return from the paper, the armature turns round before the backstop: every dot is printed, in the end with four tenths of the force.",
  },
  {
    name: "The second dot lost", state: { rate: 1520, pulses: 9, low: 1300, high: 1800 },
    notice: "Drag the line in the map up from 1300 Hz: the dots become irregular, and from about 1473 Hz on the second is lost, and above 1555 Hz the third. Red in the map is a lost dot.",
  },
  {
    name: "A strange train", state: { rate: 1050, pulses: 40, low: 900, high: 1300 },
    notice: "Figure 11. Wait for the strobe section: an endless train at this rate never repeats itself. Its points lie on a curve, and the largest exponent is above zero.",
  },
  {
    name: "Hung up", state: { rate: 2200, pulses: 9, low: 1400, high: 2600 },
    notice: "At very high rates the armature never comes back to the backstop. It hovers at the paper, and dots are weak or lost.",
  },
];

/** Build the row of stories and the place that says what to notice. */
export function storyRow(studio) {
  const note = make("p", { class: "notice", role: "note", hidden: true });
  const buttons = STORIES.map((story) => make("button", { type: "button", class: "story", "aria-pressed": "false", onclick: () => open(story) }, story.name));
  let told = null;

  function open(story, state = story.state) {
    told = story;
    studio.store.set({ ...PAPER, ...state });
    const each = (entry, text) => make("button", { type: "button", class: "switch", "aria-pressed": String(entry === state), onclick: () => open(story, entry) }, text);
    const switches = story.switches ? [each(story.state, story.switches[0]), each(story.other, story.switches[1])] : [];
    note.replaceChildren(make("span", {}, make("b", {}, `${story.name}. `), story.notice), ...switches, make("button", { type: "button", class: "shut", "aria-label": "close the story", onclick: shut }, "×"));
    note.hidden = false;
    mark();
  }
  function shut() {
    told = null;
    note.hidden = true;
    mark();
    studio.parts.grid.focus({ preventScroll: true });
  }
  function mark() { buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(STORIES[k] === told))); }
  // A story is left as soon as another hammer is taken; what is turned in it belongs to it.
  studio.store.listeners.add((state) => { if (told && (state.text || state.hammer !== PAPER.hammer)) shut(); });
  return { buttons, note, open: (k) => open(STORIES[k]), shut };
}
