// A tour of two minutes: what the parts of the page are, one after the other, each marked while it is told.
import { said } from "./captions.js";
import { element as make } from "./dom.js";
import { OPENING, VIEWS } from "./state.js";
import { moverOf, prints, viewsOf } from "./words.js";

const STEPS = [
  [".view-sketch", "The actuator, to scale along its stroke. The coil lifts the armature off its magnet on the left; it flies to the pack of ribbon and paper on the platen. Press ▶ or Space to let it move, three hundred times as slowly as it is."],
  [".view-motion", "The same against time: blue where its face is, orange the current. The thin line is the time that is shown in all views; move it with the pointer. Drag over a part to enlarge it, Escape shows all."],
  [".view-line", "What comes of it: a dot for each firing, below the moment at which it touches the paper, as large as its force. Under it a text, as this hammer prints it at this rate."],
  ['[data-key="rate"]', "The firing rate. Everything follows while you turn it. Type into the box beside it what you like: 1500, 1.5 kHz or 1/660us; Shift makes fine steps, a double click goes back."],
  [".view-map", "All rates at once: time to the right, rate upward, blue at the backstop, orange in the paper, red where a dot is lost. Drag across it: the rate follows, and the word is printed anew below the pointer."],
  [".view-forces", "Why it is so: the forces of the five equations. The backstop takes the hardest blows, and what it does not take is left for the next firing."],
  [".view-strobe", "The state at every firing of an endless train. One point: it repeats itself. A few: with a longer period. A cloud on a curve: it never does."],
  [".more", "In the menu a run is pinned: it stays behind the next ones in grey. Undo goes back over everything, and the address of the page always holds what you see."],
  [".strip", "Six stories from the paper begin here, each with what to notice. That is all: the key ? lists the keys."],
];
/** What steps tell of a device that does not print on paper. */
const OTHERWISE = {
  ".view-sketch": (mover) => `The ${mover}, to scale along the direction of motion. Press ▶ or Space to let it move.`,
  ".view-motion": () => "The same against time: blue the displacement, orange the drive. The thin line is the time that is shown in all views; move it with the pointer. Drag over a part to enlarge it, Escape shows all.",
  ".view-line": () => "What comes of it: a dot for each firing, below the moment of its touch, as large as its force.",
  ".view-map": () => "All rates at once: time to the right, rate upward, the colour is the displacement. Drag across it: the rate follows.",
  ".view-forces": () => "Why it is so: the forces against time.",
};
const EACH = 14; // s, of two minutes

/** Return what a step tells of a device that does not print on paper, if that differs. */
function toldOf(where, described) {
  const isPrinter = prints(described) && !described.struck;
  return isPrinter || !OTHERWISE[where] ? null : said(OTHERWISE[where](moverOf(described)), described);
}

/** Return how the tour begins, and its element. */
export function tourOf(studio, stories) {
  const text = make("span", { "aria-live": "polite" });
  const place = make("span", { class: "place" });
  const back = make("button", { type: "button", onclick: () => go(at - 1) }, "Back");
  const next = make("button", { type: "button", class: "next", onclick: () => go(at + 1) }, "Next");
  const holder = make("div", { class: "notice coach", role: "region", "aria-label": "tour", hidden: true }, text, place, back, next, make("button", { type: "button", class: "shut", "aria-label": "end the tour", onclick: () => end() }, "×"));
  const viewAt = (where) => /^\.view-(\w+)$/.exec(where)?.[1];
  let steps = STEPS;
  let at = -1;
  let marked = null;
  let timer = 0;

  function go(k) {
    clearTimeout(timer);
    if (k >= steps.length) { end(); return; }
    at = Math.max(k, 0);
    const [where, what] = steps[at];
    const view = viewAt(where);
    if (view) studio.hero(view);
    marked?.classList.remove("marked");
    const target = studio.parts.page.querySelector(where);
    // A view that is hidden cannot be shown to anybody.
    marked = target?.closest(".row") ?? target;
    marked?.classList.add("marked");
    marked?.closest("details")?.setAttribute("open", "");
    marked?.scrollIntoView({ block: "nearest", behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
    text.textContent = what;
    place.textContent = `${at + 1} of ${steps.length}`;
    back.disabled = at === 0;
    next.textContent = at + 1 < steps.length ? "Next" : "Done";
    timer = setTimeout(() => go(at + 1), 1000 * EACH);
  }
  function end() {
    clearTimeout(timer);
    marked?.classList.remove("marked");
    marked = null;
    holder.hidden = true;
    studio.parts.grid.focus({ preventScroll: true });
  }
  holder.addEventListener("keydown", (event) => { if (event.key === "Escape") { event.stopPropagation(); end(); } });
  // Whoever reads on, or turns something, is not hurried.
  holder.addEventListener("pointerenter", () => clearTimeout(timer));
  studio.store.listeners.add(() => clearTimeout(timer));
  return {
    element: holder,
    begin: () => {
      stories.shut();
      const known = viewsOf(studio.described);
      steps = STEPS.filter(([where]) => !viewAt(where) || known.includes(viewAt(where))).map(([where, what]) => [where, toldOf(where, studio.described) ?? what]);
      if (studio.store.state.views.join() !== OPENING.join()) studio.store.set({ views: OPENING });
      if (studio.parts.grid.classList.contains("one")) studio.enlarge(VIEWS.find((name) => studio.parts.grid.querySelector(`.view-${name}.large`)));
      holder.hidden = false;
      go(0);
      next.focus();
    },
  };
}
