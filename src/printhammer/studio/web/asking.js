// A dialog that asks what the columns of a dropped table hold, where its heading does not say.
import { element } from "./dom.js";
import { shown } from "./units.js";

const FIRST = { time: "us", displacement: "um", current: "A", force: "N" };

/** Ask; the promise gives quantity and unit of each column and whether they are to be saved as a file, or null where it is left. */
export function askColumns(dialog, { name, columns, quantities, clock }) {
  return new Promise((done) => {
    const rows = columns.map((column, place) => {
      const label = column.name || `column ${place + 1}`;
      const what = element("select", { "aria-label": `what ${label} is` }, element("option", { value: "" }, "not used"), ...Object.keys(quantities).map((kind) => element("option", { value: kind }, kind)));
      const unit = element("input", { type: "text", "aria-label": `unit of ${label}`, size: 8 });
      what.value = column.quantity || (place === 0 && !clock && !columns.some(({ quantity }) => quantity === "time") ? "time" : "");
      unit.value = column.unit || FIRST[what.value] || "";
      what.addEventListener("change", () => { unit.value = column.unit || FIRST[what.value] || ""; });
      return { what, unit, row: element("tr", {}, element("td", {}, label), element("td", {}, column.first.join(", ")), element("td", {}, what), element("td", {}, unit)) };
    });
    const heads = ["column", "begins with", "is", "unit, or what 1 stands for, such as 10 A or 10 A/V"].map((text) => element("th", { scope: "col" }, text));
    const times = clock ? `Without a column of time the samples begin at ${shown(clock.start, "s")} and follow each other by ${shown(clock.step, "s")}, as the file states.` : "";
    const form = element("form", { method: "dialog", class: "asking" }, element("p", { hidden: !clock }, times),
      element("table", {}, element("thead", {}, element("tr", {}, ...heads)), element("tbody", {}, ...rows.map(({ row }) => row))),
      element("button", { value: "use" }, "Use"), element("button", { value: "save", title: "File beside the table, from which the command line reads the columns" }, `Use and save ${name}.toml`), element("button", { value: "" }, "Leave it"));
    dialog.replaceChildren(element("h2", {}, `What do the columns of ${name} hold?`), form);
    dialog.returnValue = "";
    dialog.addEventListener("close", () => done(dialog.returnValue ? { columns: rows.map(({ what, unit }) => [what.value, unit.value.trim()]), isSaved: dialog.returnValue === "save" } : null), { once: true });
    dialog.showModal();
  });
}
