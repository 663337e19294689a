// The page: a bar, the controls, the views in a grid, and a line for hints.
import { captionOf, pictureText } from "./captions.js";
import { element as make } from "./dom.js";
import { copy, csvOf, pngOf, save, savePage, svgOf } from "./exports.js";
import { findRow } from "./finds.js";
import { HELP } from "./keys.js";
import { menuOf } from "./menu.js";
import { pinRow } from "./pins.js";
import { readoutOf } from "./readout.js";
import { bare, DEEPEST, VIEWS } from "./state.js";
import { storyRow } from "./stories.js";
import { tourOf } from "./tour.js";
import { traceRow } from "./trace.js";
import { titleOf, viewsOf } from "./words.js";

const NARROW = 820; // pixels, as in the style sheet
/** The views beside the large one. */
const BESIDE = ["sketch", "motion", "line"];
const PRESETS = {
  "single pulse": { pulses: 1, pattern: "" }, "two pulses": { pulses: 2, pattern: "", rate: 1000 }, "burst of nine": { pulses: 9, pattern: "", rate: 1200 },
  "fast burst": { pulses: 9, pattern: "", rate: 1800 }, "letters": { pattern: "1101011100101", rate: 1200 }, "long train": { pulses: 40, pattern: "", rate: 1000 },
};

/** What a picture that leaves the studio says of where it is from. */
const origin = ({ described, store, version }) => `${described.name}, ${Number(store.state.rate.toPrecision(6))} Hz, printhammer ${version}`;

export function layout(studio, makers) {
  const button = (text, label, action, extra = {}) => make("button", { type: "button", title: label, "aria-label": label, onclick: action, ...extra }, text);
  const hammers = make("select", { "aria-label": "hammer", onchange: () => studio.choose(hammers.value) });
  const honesty = make("span", { class: "honesty" });
  const presets = make("select", { "aria-label": "preset", onchange: () => { if (PRESETS[presets.value]) studio.preset(PRESETS[presets.value]); presets.value = ""; } },
    make("option", { value: "" }, "preset …"), ...Object.keys(PRESETS).map((name) => make("option", { value: name }, name)));
  const units = make("select", { "aria-label": "units", onchange: () => studio.units(Number(units.value)) }, make("option", { value: 0 }, "SI"), make("option", { value: 1 }, "inch-pound"));
  const dialog = make("dialog", { "aria-label": "text" });
  const file = make("input", { type: "file", hidden: true, accept: ".toml,.csv,.txt,.tsv,.json", onchange: () => { for (const each of file.files) studio.drop(each); file.value = ""; } });
  const text = async (kind, action) => {
    const frame = await studio.ask("texts", { state: bare(studio.store.state) });
    if (frame.kind === "refusal") studio.say(frame.reason, true);
    else action(frame.texts[kind]);
  };
  const leaving = {
    "hammer, TOML": () => text("hammer", (content) => save("studio-hammer.toml", content, "text/plain")),
    "drive, TOML": () => text("drive", (content) => save("studio-drive.toml", content, "text/plain")),
    "copy as Python": () => text("python", (content) => copy(content, studio, "Python")),
    "copy as command": () => text("command", (content) => copy(content, studio, "command")),
    "state, file": () => text("state", (content) => save("studio-state.json", content, "application/json")),
  };
  const out = make("select", { "aria-label": "export", class: "out", onchange: () => { leaving[out.value]?.(); out.value = ""; } },
    make("option", { value: "" }, "export …"), ...Object.keys(leaving).map((name) => make("option", { value: name }, name)));

  const undo = button("undo", "Undo (Ctrl+Z)", () => studio.undo(), { class: "undo" });
  const redo = button("redo", "Redo (Ctrl+Shift+Z)", () => studio.redo(), { class: "redo" });
  studio.undo = () => { if (studio.store.past.length) studio.store.undo(); else studio.say(`nothing to undo; the last ${DEEPEST} steps are kept`); };
  studio.redo = () => { if (studio.store.future.length) studio.store.redo(); else studio.say("nothing to redo"); };
  /** Tell how far back and forth it goes. */
  const limits = () => {
    for (const [each, list, text] of [[undo, studio.store.past, "Undo (Ctrl+Z)"], [redo, studio.store.future, "Redo (Ctrl+Shift+Z)"]]) {
      each.setAttribute("aria-disabled", String(!list.length));
      each.title = list.length ? `${text}: ${list.length} step${list.length === 1 ? "" : "s"}` : `${text}: nothing`;
    }
  };
  studio.store.listeners.add(limits);

  const controls = make("div", { class: "controls" });
  const hint = make("div", { class: "hint", "aria-live": "polite" });
  const status = make("div", { class: "status", role: "status" });
  const grid = make("main", { class: "grid", tabindex: -1 });
  const chooser = make("div", { class: "chooser", role: "group", "aria-label": "views" });
  const stories = storyRow(studio);
  const tour = tourOf(studio, stories);
  const strip = make("nav", { class: "strip", "aria-label": "stories from the paper" }, ...stories.buttons, make("button", { type: "button", class: "story tour", onclick: tour.begin }, "Tour"));
  const share = menuOf("share", "Share", "Share what is set", [
    ["", button("copy link", "copy link: the address, which holds what is set", () => copy(studio.address(), studio, "address"))],
    ["", button("save as a page", "save as a page: one file with what is set, which computes without a network", () => savePage(studio))],
    ["", out],
  ], true);
  const menu = menuOf("more", "☰", "Menu", [
    ["Views", chooser], ["Presets", presets],
    ["Runs", button("pin", "Pin this run, to compare others with it (P)", () => studio.pin(), { class: "pin" }), button("unpin", "unpin: take all pins away (U)", () => studio.unpin())],
    ["Files", button("open", "Open a hammer file or a measured CSV", () => file.click())],
    ["Find", findRow(studio)],
    ["Show", units, button("◐", "Light or dark (T)", () => studio.toggleTheme(), { class: "theme" }), button("?", "Keys (?)", () => studio.help(), { class: "help" })],
  ]);
  const bar = make("header", { class: "bar" }, make("h1", {}, "printhammer"), hammers, strip, undo, redo, share, menu, file);
  const sheet = make("button", { type: "button", class: "sheet", "aria-expanded": "false", onclick: () => sheet.setAttribute("aria-expanded", String(side.classList.toggle("open"))) }, "Controls");
  const pinned = make("div", { class: "pinned" });
  const side = make("aside", { class: "side", "aria-label": "controls" }, pinned, sheet, controls, hint);
  const stage = make("div", { class: "stage" }, stories.note, tour.element, pinRow(studio), traceRow(studio), grid);
  const page = make("div", { class: "studio" }, bar, side, stage, status, dialog);
  studio.element.classList.add("studio-place");
  studio.element.replaceChildren(page);
  onRatio(() => studio.theme());
  matchMedia("(forced-colors: active)").addEventListener("change", () => studio.theme());

  studio.search = () => {
    side.classList.add("open");
    controls.querySelector(".search")?.focus();
  };
  studio.toggleTheme = () => {
    const dark = getComputedStyle(page).getPropertyValue("--dark").trim() === "1";
    page.dataset.theme = dark ? "light" : "dark";
    studio.theme();
  };
  studio.help = () => {
    dialog.replaceChildren(make("h2", {}, "Keys"), make("dl", {}, ...HELP.flatMap(([keys, what]) => [make("dt", {}, keys), make("dd", {}, what)])), make("form", { method: "dialog" }, make("button", {}, "Close")));
    dialog.showModal();
  };

  const panels = {};
  const captions = {};
  // Beside the opening one view is the hero, chosen by a tab; on a phone every view is one.
  const isNarrow = () => page.clientWidth < NARROW;
  const tabs = make("div", { class: "tabs", role: "group", "aria-label": "large view" });
  const tab = (name) => {
    const { views } = studio.store.state;
    const next = BESIDE.includes(name) ? views : VIEWS.filter((view) => view === name || BESIDE.includes(view));
    if (next.join() !== views.join()) studio.store.set({ views: next });
    if (isNarrow() && !panels[name].classList.contains("large")) enlarge(name);
    mark();
  };
  studio.hero = tab;
  const mark = () => {
    const large = VIEWS.find((name) => panels[name].classList.contains("large"));
    for (const each of tabs.children) each.setAttribute("aria-pressed", String(large ? each.dataset.tab === large : !panels[each.dataset.tab].hidden && !BESIDE.includes(each.dataset.tab)));
  };
  grid.append(tabs);
  const opening = grid.appendChild(make("div", { class: "opening" }));
  // From above to below: what moves, its curve, what it prints.
  for (const name of VIEWS) {
    const body = make("div", { class: "body" });
    const caption = captions[name] = make("p", { class: "caption", id: `caption-${name}` });
    const leave = make("select", { class: "leave", "aria-label": `save ${titleOf(name)}` }, ...["save", "PNG", "SVG", "CSV"].map((kind, k) => make("option", { value: k ? kind : "" }, kind)));
    const panel = make("section", { class: `panel view-${name}`, "aria-label": titleOf(name), hidden: true },
      make("h2", {}, make("span", {}, titleOf(name)), make("output", { class: "readout" }), leave, button("⤢", `Enlarge ${titleOf(name)}`, () => enlarge(name), { class: "enlarge" })), caption, body);
    (BESIDE.includes(name) ? opening : grid).append(panel);
    tabs.append(make("button", { type: "button", "aria-pressed": "false", "data-tab": name, class: BESIDE.includes(name) ? "beside" : "", onclick: () => tab(name) }, titleOf(name, null, true)));
    panels[name] = panel;
    studio.views[name] = withReadout(name, makers[name](body, studio), panel, studio);
    leave.addEventListener("change", () => { leaveView(name, leave.value, body); leave.value = ""; });
    chooser.append(make("button", { type: "button", "aria-pressed": "false", "data-view": name, onclick: () => toggle(name) }, `${VIEWS.indexOf(name) + 1} ${titleOf(name, null, true)}`));
  }

  async function leaveView(name, kind, body) {
    const view = studio.views[name];
    const [width, height] = [Math.max(body.clientWidth, 480), Math.max(body.clientHeight, 320)];
    const table = view.table();
    if (!table) return;
    const whole = `${studio.described.name}-${Number(studio.store.state.rate.toPrecision(6))}Hz-${name}`;
    if (kind === "CSV") save(`${whole}.csv`, csvOf(table), "text/csv");
    if (kind === "SVG") save(`${whole}.svg`, svgOf(view, width, height, `${titleOf(name, studio.described)}: ${captionOf(name, studio)} ${origin(studio)}`), "image/svg+xml");
    if (kind === "PNG") save(`${whole}.png`, await pngOf(view, width, height, origin(studio)), "image/png");
  }
  function toggle(name) {
    const { views } = studio.store.state;
    const next = views.includes(name) ? views.filter((view) => view !== name) : VIEWS.filter((view) => view === name || views.includes(view));
    if (next.length) studio.store.set({ views: next });
  }
  function enlarge(name) {
    grid.classList.toggle("one", !panels[name].classList.contains("large"));
    for (const [other, panel] of Object.entries(panels)) panel.classList.toggle("large", other === name && grid.classList.contains("one"));
    mark();
    keepFocus();
  }
  studio.enlarge = enlarge;
  /** On a phone one view is enlarged, the one that is chosen; a view that is enlarged elsewhere is there. */
  function fit() {
    const [large, hero] = [VIEWS.find((name) => panels[name].classList.contains("large")), VIEWS.find((name) => !panels[name].hidden && !BESIDE.includes(name))];
    if (large && (panels[large].hidden || (!isNarrow() && narrow))) enlarge(large);
    if (isNarrow() && hero && !grid.classList.contains("one") && grid.classList.contains("with-hero")) enlarge(hero);
    narrow = isNarrow();
  }
  let narrow = false;
  new ResizeObserver(() => { if (isNarrow() !== narrow) fit(); }).observe(page);
  /** Keys go to what has the focus, which must not be lost with a view that is hidden. */
  function keepFocus() {
    const { activeElement } = document;
    if (grid.contains(activeElement) && activeElement.getClientRects().length === 0) grid.focus({ preventScroll: true });
  }

  for (const kind of ["dragover", "drop"]) {
    page.addEventListener(kind, (event) => {
      event.preventDefault();
      if (kind === "drop") for (const each of event.dataTransfer.files) studio.drop(each);
    });
  }
  let telling = 0;
  /** Say anew what the views tell, once they are drawn; for those who do not see the pictures too. */
  const tell = () => {
    telling ||= setTimeout(() => {
      telling = 0;
      for (const name of studio.store.state.views) {
        const [text, whole] = [captionOf(name, studio), pictureText(name, studio)];
        if (captions[name].textContent !== text) captions[name].textContent = text;
        const picture = panels[name].querySelector('[role="img"]');
        if (picture) picture.setAttribute("aria-label", `${titleOf(name, studio.described)}: ${whole}`);
        else panels[name].querySelector("canvas").setAttribute("aria-description", whole);
      }
    }, 60);
  };
  studio.element.addEventListener("painted", tell);
  let shown = "";
  const show = (all) => {
    const known = viewsOf(studio.described);
    const fitting = all.filter((view) => known.includes(view));
    const views = fitting.length ? fitting : known.slice(0, 1);
    const beside = BESIDE.filter((view) => known.includes(view)).length;
    if (views.join() === shown) return;
    shown = views.join();
    for (const [name, panel] of Object.entries(panels)) panel.hidden = !views.includes(name);
    for (const each of chooser.children) each.setAttribute("aria-pressed", String(views.includes(each.dataset.view)));
    const others = views.filter((view) => !BESIDE.includes(view)).length;
    const whole = others > 0 && views.length - others === beside;
    // One view beside what moves, its curve and what it prints is the hero: it takes half.
    grid.classList.toggle("with-hero", whole && others === 1);
    fit();
    mark();
    grid.classList.toggle("with-opening", whole);
    grid.style.setProperty("--rows", String(Math.ceil(others / 2)));
    grid.style.setProperty("--beside", String(Math.min(others, 2)));
    grid.dataset.count = String(views.length);
    keepFocus();
  };
  /** Name the views as the device has them; those that do not apply have no tab. */
  const describe = (described) => {
    const known = viewsOf(described);
    VIEWS.forEach((name, k) => {
      const title = titleOf(name, described);
      panels[name].setAttribute("aria-label", title);
      panels[name].querySelector("h2 span").textContent = title;
      for (const [each, before] of [[tabs.children[k], ""], [chooser.children[k], `${k + 1} `]]) {
        each.textContent = `${before}${titleOf(name, described, true)}`;
        each.hidden = !known.includes(name);
      }
    });
    // What is found and preset is about trains of dots.
    presets.closest(".entry").hidden = Boolean(described.start.rate);
    page.querySelector(".find-lost").textContent = `${described.strike} lost`;
    for (const each of page.querySelectorAll(".find-lost, .find-dot")) each.hidden = described.places.front === null;
    shown = "";
  };
  return { page, bar, controls, pinned, hint, status, grid, dialog, hammers, honesty, layout: { show, enlarge, describe } };
}

/** Return a view that tells beside its title what is there at the time of the cursor. */
function withReadout(name, view, panel, studio) {
  const [tip, body] = [panel.querySelector(".readout"), panel.querySelector(".body")];
  const read = () => {
    const text = readoutOf(name, studio, body.clientWidth > 440);
    if (tip.textContent !== text) tip.textContent = text;
  };
  if (view.timeAt) {
    body.addEventListener("pointermove", (event) => {
      const bounds = body.querySelector("canvas").getBoundingClientRect();
      const time = view.timeAt(event.clientX - bounds.left, event.clientY - bounds.top);
      if (time !== null) studio.setCursor(time);
    });
  }
  return { ...view, cursor: () => { view.cursor(); read(); }, update: (what) => { view.update(what); read(); } };
}

/** Do something whenever the screen has another pixel ratio, as on another monitor. */
function onRatio(action) {
  matchMedia(`(resolution: ${globalThis.devicePixelRatio || 1}dppx)`).addEventListener("change", () => { action(); onRatio(action); }, { once: true });
}
