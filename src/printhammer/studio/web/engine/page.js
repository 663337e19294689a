// The studio as a page: the state in the address, workers, no server.
import { mount } from "../mount.js";
import { engineOf } from "./engine.js";
import { shelfOf } from "./shelf.js";

/** Unpack what is embedded, and begin. */
export async function begin() {
  // As it was before anything was built, for a page to keep.
  const html = `<!doctype html>\n${document.documentElement.outerHTML}`;
  const text = (id) => document.getElementById(id).textContent;
  const shelf = await shelfOf(text("content"));
  const start = JSON.parse(text("start"));
  shelf.start = start.state ?? {};
  // In a notebook the page has no address of its own; its frame knows the state.
  const framed = location.protocol === "about:";
  let [page, told] = [null, ""];
  const send = engineOf(shelf, JSON.parse(text("worker")), (frame) => page.accept(frame), () => html);
  page = mount(document.getElementById("studio"), send, {
    read: () => (framed ? window.name : location.hash.slice(1)) || (start.text ?? ""),
    write: (hash) => {
      told = hash;
      if (!framed) history.replaceState(null, "", `#${hash}`);
      if (parent !== window) parent.postMessage({ printhammer: hash }, "*");
    },
    address: () => (framed ? `#${told}` : location.href),
  });
  window.studio = page;
  window.addEventListener("hashchange", () => page.open(location.hash.slice(1)));
  window.addEventListener("message", ({ source, data }) => {
    if (source === parent && source !== window && typeof data?.printhammer === "string") page.open(data.printhammer);
  });
  if (parent === window) page.studio.parts.grid.focus({ preventScroll: true });
}
