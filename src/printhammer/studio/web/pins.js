// Pins: runs that stay behind the next ones, by name, kept in the state; and how far two of them are apart.
import { displacementAt } from "./curves.js";
import { element as make } from "./dom.js";
import { bare, MOST_PINS } from "./state.js";
import { shown } from "./units.js";

const NOW = "now";

/** Return the largest distance of two motions, m, and when it is, s. */
export function distance(one, other) {
  const [a, b] = [one.data, other.data];
  const last = Math.min(a.t.at(-1), b.t.at(-1));
  let found = { most: 0, when: 0 };
  for (const time of [...a.t, ...b.t]) {
    if (time > last) continue;
    const away = Math.abs(displacementAt(one, time) - displacementAt(other, time));
    if (away > found.most) found = { most: away, when: time };
  }
  return found;
}

/** Build the row of pins. */
export function pinRow(studio) {
  const list = make("div", { class: "chips" });
  const apart = make("div", { class: "apart", role: "status" });
  const pair = [make("select", { "aria-label": "distance from" }), make("select", { "aria-label": "distance to" })];
  const between = make("div", { class: "between", hidden: true }, make("span", {}, "distance of"), pair[0], make("span", {}, "and"), pair[1], make("span", {}, ":"), apart);
  const holder = make("section", { class: "pins", "aria-label": "pins", hidden: true }, list, between);
  const motions = new Map(); // frames of runs by the text of their state
  let made = null;

  const NONE = [];
  const pinsOf = () => studio.store.state.pins ?? NONE;
  const keyOf = (pin) => JSON.stringify(pin.state);

  studio.pin = () => {
    if (!studio.frames.motion) return;
    const { state } = studio.store;
    if (pinsOf().length >= MOST_PINS) { studio.say(`there are ${MOST_PINS} pins already; take one away first`, true); return; }
    const taken = new Set(pinsOf().map((pin) => pin.name));
    let name = `${Number(state.rate.toPrecision(5))} Hz`;
    for (let k = 2; taken.has(name); k += 1) name = `${Number(state.rate.toPrecision(5))} Hz (${k})`;
    const pin = { name, state: bare(state) };
    // What is seen already need not be computed once more.
    if (!studio.busy && !studio.stale) motions.set(keyOf(pin), studio.frames.motion);
    studio.store.amend({ pins: [...pinsOf(), pin] });
    studio.say(`pinned as ${name}, ${pinsOf().length} of ${MOST_PINS}`);
  };
  studio.unpin = () => {
    if (pinsOf().length) studio.store.amend({ pins: [] });
    studio.say("pins taken away");
    redraw();
  };
  const redraw = () => { for (const name of studio.store.state.views) studio.views[name]?.draw(); };

  /** Have a motion for each pin, and show them as ghosts. */
  async function follow() {
    const pins = pinsOf();
    if (pins === made) return;
    made = pins;
    build(pins);
    for (const pin of pins) {
      const key = keyOf(pin);
      if (motions.has(key)) continue;
      const frame = await studio.ask("curves", { state: pin.state });
      if (frame.kind === "refusal") { studio.say(`the pin ${pin.name} cannot be shown: ${frame.reason}`, true); motions.set(key, null); } else motions.set(key, frame);
    }
    if (pinsOf() !== pins) return;
    for (const key of [...motions.keys()]) if (!pins.some((pin) => keyOf(pin) === key)) motions.delete(key);
    studio.pinned = pins.map((pin) => ({ ...pin, motion: motions.get(keyOf(pin)) })).filter((ghost) => ghost.motion);
    redraw();
    tell();
  }

  function build(pins) {
    holder.hidden = !pins.length;
    list.replaceChildren(...pins.map((pin, k) => {
      const name = make("input", { type: "text", value: pin.name, "aria-label": `name of pin ${k + 1}`, maxlength: 40, size: Math.max(pin.name.length, 6), spellcheck: "false" });
      const change = (patch) => studio.store.amend({ pins: patch ? pins.map((each) => (each === pin ? { ...pin, ...patch } : each)) : pins.filter((each) => each !== pin) });
      name.addEventListener("change", () => { if (name.value.trim()) change({ name: name.value.trim() }); else name.value = pin.name; });
      return make("span", { class: `chip pin-${k + 1}` }, make("i", { "aria-hidden": "true" }), name,
        make("button", { type: "button", title: `take ${pin.name} up again`, "aria-label": `take ${pin.name} up again`, onclick: () => studio.resume(pin.state) }, "open"),
        make("button", { type: "button", title: `take the pin ${pin.name} away`, "aria-label": `take the pin ${pin.name} away`, onclick: () => change(null) }, "×"));
    }));
    const choices = [NOW, ...pins.map((_pin, k) => String(k))];
    pair.forEach((select, side) => {
      const kept = pins.length > 1 ? select.value : "";
      select.replaceChildren(...choices.map((choice) => make("option", { value: choice }, choice === NOW ? "what is set" : pins[choice].name)));
      select.value = choices.includes(kept) ? kept : choices[side === 0 ? 1 : Math.min(2, choices.length - 1)] ?? NOW;
      if (side === 1 && select.value === pair[0].value) select.value = NOW;
    });
    between.hidden = !pins.length;
  }

  function tell() {
    const pins = pinsOf();
    if (!pins.length) return;
    const [one, other] = pair.map(({ value }) => (value === NOW ? studio.frames.motion : motions.get(keyOf(pins[value] ?? { state: null }))));
    if (!one || !other) { apart.textContent = ""; return; }
    const { most, when } = distance(one, other);
    apart.textContent = most ? `${shown(most, "m", 3)} at most, at ${shown(when, "s", 4)}` : "none";
  }
  for (const select of pair) select.addEventListener("change", tell);
  studio.store.listeners.add(follow);
  studio.element.addEventListener("painted", ({ detail }) => { if (detail.kind === "motion" && !holder.hidden) tell(); });
  return holder;
}
