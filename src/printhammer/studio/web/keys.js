// Keys of the studio; inside a field only those with Ctrl.
import { VIEWS } from "./state.js";

export const HELP = [
  ["Space", "play or pause"], [", and .", "time cursor back and forth"], ["Shift + 1 to 9", "enlarge a view"], ["1 to 9", "show or hide a view"], ["Escape", "all views again; whole time axis"],
  ["P, U", "pin this run, take all pins away"], ["Ctrl+Z, Ctrl+Shift+Z", "undo, redo"], ["/", "search the controls"], ["Shift + ← →", "fine steps of a slider"], ["T", "light or dark"], ["↑ ↓ in the map", "firing rate"], ["?", "these keys"],
];

export function bindKeys(studio) {
  studio.parts.page.addEventListener("keydown", (event) => {
    // A slider has no use for letters and numbers.
    const typing = event.target.matches('input:not([type="range"]), select, textarea');
    if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") {
      // What is being typed and not yet taken is the browser's to undo.
      if (event.target.hasAttribute("data-editing")) return;
      event.preventDefault();
      if (event.shiftKey) studio.redo();
      else studio.undo();
      return;
    }
    if (typing || event.ctrlKey || event.metaKey || event.altKey || studio.parts.dialog.open) return;
    const number = /^Digit([1-9])$/.exec(event.code)?.[1];
    const t = studio.frames.motion?.data.t;
    const actions = {
      " ": () => studio.views.sketch.toggle(), p: studio.pin, u: studio.unpin, t: studio.toggleTheme, "?": studio.help, "/": studio.search,
      ",": () => studio.setCursor(studio.cursor - (t?.at(-1) ?? 0) / 500), ".": () => studio.setCursor(studio.cursor + (t?.at(-1) ?? 0) / 500),
      Escape: () => {
        if (studio.parts.grid.classList.contains("one")) studio.enlarge(VIEWS.find((name) => studio.parts.grid.querySelector(`.view-${name}.large`)));
        studio.zoom(null);
      },
    };
    const action = number ? () => (event.shiftKey ? studio.enlarge(VIEWS[number - 1]) : studio.parts.page.querySelector(`[data-view=${VIEWS[number - 1]}]`).click()) : actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    // A button has a use of its own for the space bar.
    if (!action || (event.key === " " && event.target.matches("button, summary"))) return;
    event.preventDefault();
    action();
  });
}
