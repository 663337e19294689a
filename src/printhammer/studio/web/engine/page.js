// The studio as a page: the state in the address, workers, no server.
import { mount } from "../mount.js";
import { engineOf } from "./engine.js";
import { shelfOf } from "./shelf.js";

/** Begin with the content of the page, and the modules of its hammers as they are packed. */
export function begin(content, modules) {
  // As it was before anything was built, for a page to keep.
  const html = `<!doctype html>\n${document.documentElement.outerHTML}`;
  const shelf = shelfOf(content, modules);
  const start = JSON.parse(document.getElementById("start").textContent);
  shelf.start = start.state ?? {};
  // In a notebook the page has no address of its own; its frame knows the state.
  const framed = location.protocol === "about:";
  let [page, told] = [null, ""];
  const send = engineOf(shelf, content.worker, (frame) => page.accept(frame), () => html);
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
