// A studio that was saved as a page: its state and its curves, read only, without a server.
import { element } from "./dom.js";
import { mount } from "./mount.js";

/** Show in an element what was kept. */
export function show(holder, { state, frames, hammer, limits, shapes, drivers, decays, units, offered, overlay, saved, version }) {
  // What a server would say is said here, as soon as it is asked for.
  const answers = {
    open: () => ({ state, notes: [] }),
    hammer: () => ({ hammer, limits, shapes, drivers, decays, units, offered, version, asked: state.hammer, text: state.text }),
  };
  let page = null;
  const send = (text) => {
    const { kind, serial } = JSON.parse(text);
    const heading = answers[kind]?.() ?? { kind: "refusal", reason: "this page was saved and computes nothing: open its state in a studio" };
    queueMicrotask(() => {
      if (kind === "state") for (const data of Object.values(frames)) page.receive(bytes(data));
      else page.receive(framed({ kind, serial, arrays: [], ...heading }));
    });
  };
  page = mount(holder, send, { read: () => "", write: () => {}, address: () => "" });
  const { studio } = page;
  studio.overlay = overlay;
  studio.saved = saved;
  studio.store.keep(["views"]);
  studio.parts.page.classList.add("read-only");
  studio.parts.page.querySelector(".side").inert = true;
  studio.parts.bar.querySelector("h1").after(element("strong", { class: "saved" }, `read only, saved ${saved} UTC`));
  for (const part of studio.parts.bar.querySelectorAll("select:not([aria-label=units]), .undo, .redo, .open")) part.disabled = true;
}

function framed(heading) {
  const text = new TextEncoder().encode(JSON.stringify(heading));
  const data = new Uint8Array(4 + text.length);
  new DataView(data.buffer).setUint32(0, text.length, true);
  data.set(text, 4);
  return data.buffer;
}

function bytes(text) { return Uint8Array.from(atob(text), (sign) => sign.charCodeAt(0)).buffer; }
