// The studio as a page that computes by itself: the state in the address, workers, no server.
import { mount } from "../mount.js";
import { engineOf } from "./engine.js";
import { shelfOf } from "./shelf.js";

/** Unpack what is embedded, and begin. */
export async function begin() {
  // As it was before anything was built, for a page to keep.
  const html = `<!doctype html>\n${document.documentElement.outerHTML}`;
  const text = (id) => document.getElementById(id).textContent;
  const shelf = await shelfOf(text("content"));
  // A page that was saved begins with what was set in it.
  const kept = text("start");
  if (kept.startsWith("{")) shelf.start = { state: JSON.parse(kept).state, notes: [] };
  let page = null;
  const send = engineOf(shelf, JSON.parse(text("worker")), (frame) => page.accept(frame), () => html);
  page = mount(document.getElementById("studio"), send, {
    read: () => location.hash.slice(1),
    write: (hash) => history.replaceState(null, "", `#${hash}`),
    address: () => location.href,
  });
  window.studio = page;
  window.addEventListener("hashchange", () => page.open(location.hash.slice(1)));
  page.studio.parts.grid.focus({ preventScroll: true });
}
