// What leaves the studio: files to keep, texts to copy.
import { SvgPen } from "./pen.js";
import { colours, FONT } from "./theme.js";

export function save(name, content, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** Copy a text; where the browser does not allow it, show it to be copied. */
export async function copy(text, studio, what) {
  try {
    await navigator.clipboard.writeText(text);
    studio.say(`${what} copied`);
  } catch {
    studio.showText(what, text);
  }
}

export function csvOf(table) {
  const names = Object.keys(table);
  const rows = [names.join(",")];
  const count = table[names[0]].length;
  for (let k = 0; k < count; k += 1) rows.push(names.map((name) => (Number.isFinite(table[name][k]) ? table[name][k] : "")).join(","));
  return `${rows.join("\n")}\n`;
}

export function svgOf(view, width, height, title) {
  const pen = new SvgPen(width, height, title);
  pen.fillStyle = colours().panel;
  pen.fillRect(0, 0, width, height);
  view.paint(pen, width, height);
  return pen.text();
}

const FOOT = 16; // pixels below a picture for where it is from

export async function pngOf(view, width, height, origin) {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [2 * width, 2 * (height + FOOT)];
  const pen = canvas.getContext("2d");
  pen.scale(2, 2);
  pen.fillStyle = colours().panel;
  pen.fillRect(0, 0, width, height + FOOT);
  pen.save();
  view.paint(pen, width, height);
  pen.restore();
  Object.assign(pen, { fillStyle: colours().muted, font: FONT, textAlign: "right", textBaseline: "bottom" });
  pen.fillText(origin, width - 6, height + FOOT - 3);
  return new Promise((done) => { canvas.toBlob(done, "image/png"); });
}

/** Save the page with what is set in it. */
export async function savePage(studio) {
  const { html } = await studio.ask("page", {});
  const start = JSON.stringify({ text: studio.link() }).replaceAll("<", "\\u003c");
  save("studio-page.html", html.replace(/(<script[^>]* id="start">)[^<]*/, (_all, head) => head + start), "text/html");
}
