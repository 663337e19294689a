// Menus of the header: a button with a sheet below it.
import { element as make } from "./dom.js";

/** Return a menu; it closes with Escape, with a press elsewhere, and after one of its buttons where `once`. */
export function menuOf(kind, text, label, rows, once = false) {
  const head = make("summary", { title: label, "aria-label": label }, text);
  const list = make("div", { class: "list" }, ...rows.map(([what, ...children]) => make("div", { class: "entry" }, ...(what ? [make("span", { class: "what" }, what)] : []), make("div", { class: "choices" }, ...children))));
  const menu = make("details", { class: `menu ${kind}` }, head, list);
  const shut = (event) => { if (!menu.contains(event.target)) menu.open = false; };
  menu.addEventListener("toggle", () => (menu.open ? addEventListener : removeEventListener)("pointerdown", shut, true));
  menu.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || !menu.open) return;
    event.stopPropagation();
    menu.open = false;
    head.focus();
  });
  if (once) list.addEventListener("click", (event) => { if (event.target.matches("button")) menu.open = false; });
  return menu;
}
