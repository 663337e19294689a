// The frequency-time map: colours of displacement, and a cursor that sets the rate.
import { axes, line, refusal } from "./axes.js";
import { printed } from "./bars.js";
import { said } from "./captions.js";
import { surface } from "./pen.js";
import { colours, FONT, SMALL } from "./theme.js";
import { digits, shown, timeUnit, unitOf } from "./units.js";
import { packOf, prints } from "./words.js";

// Cividis (J. R. Nunez, C. R. Anderton, R. S. Renslow, PLoS ONE 13 (2018) e0199239), every fourth colour.
const CIVIDIS = "00224e00255400285b002b62002e6a0030700533711235701a386f213b6e273e6e2d416d32436d36466c3b496c3f4c6c434e6c47516c4b546c4f576c535a6d565c6d5a5f6e5e626e61656f656870686a716c6d726f70737273747676767979777d7c78807f788482798885788c8878908b78938e789791779b94769f9775a39a74a79d73aba072afa471b4a76fb8aa6ebcae6cc0b16ac4b468c8b866cdbb63d1bf61d5c25edac65bdec958e2cd54e7d150ebd44bf0d846f5dc41f9e03afee434";
const CONTACT = [[253, 190, 133], [166, 54, 3]];
const SHADES = 64;
const GAP = 65535;
const MARGIN = { left: 54, right: 12, top: 26, bottom: 32 };
const LOST = [192, 57, 43];
const MARK = 4; // columns of the mark of a lost dot
const SLIP = { w: 210, h: 62, away: 26 }; // pixels of the slip of paper, and from the finger to it

const little = (r, g, b) => ((255 << 24) | (b << 16) | (g << 8) | r) >>> 0;
const borderOf = ({ low, high, front }) => (front === null ? GAP : Math.round(Math.min(Math.max(((front - low) / (high - low)) * (GAP - 1), 1), GAP)));

/**
 * Return the dots that are lost in a map: for each its row and column, and of the lowest rate the number of the first.
 */
function lostDots(frame) {
  const [rows, columns] = frame.data.codes.shape;
  const { codes } = frame.data;
  const { struck } = frame.data;
  const slots = frame.pattern ? [...frame.pattern].flatMap((mark, k) => (mark === "1" ? [k] : [])) : [...Array(frame.pulses).keys()];
  const found = { list: [], first: null };
  if (frame.front === null || !struck) return found;
  for (let row = 0; row < rows; row += 1) {
    const rate = frame.rates[0] + (row / (rows - 1)) * (frame.rates[1] - frame.rates[0]);
    const from = row * columns;
    if (codes[from + columns - 1] === GAP) continue;
    slots.forEach((slot, k) => {
      const begin = Math.ceil((slot / rate / frame.end) * (columns - 1));
      if (struck[row * slots.length + k]) return;
      found.list.push([row, begin, k]);
      found.first ??= { rate, dot: k + 1 };
    });
  }
  return found;
}

/** Return 65536 colours: cividis from backstop to pack, orange to brown inside the pack, grey where unknown. */
function palette(low, high, front, dark) {
  const table = new Uint32Array(65536);
  const border = borderOf({ low, high, front });
  const stops = CIVIDIS.length / 6;
  // It is made anew for every place of the pack: a stretch of codes at a time, not a code.
  for (let at = 0; at < stops; at += 1) {
    const colour = parseInt(CIVIDIS.slice(6 * at, 6 * at + 6), 16);
    table.fill(little(colour >> 16, (colour >> 8) & 255, colour & 255), Math.ceil((at * border) / stops), Math.ceil(((at + 1) * border) / stops));
  }
  const last = border + Math.max((GAP - border) * 0.6, 1);
  for (let at = 0; at < SHADES; at += 1) {
    const part = at / (SHADES - 1);
    const shade = little(...CONTACT[0].map((start, k) => Math.round(start + part * (CONTACT[1][k] - start))));
    table.fill(shade, Math.ceil(border + (at / SHADES) * (last - border)), at === SHADES - 1 ? GAP : Math.ceil(border + ((at + 1) / SHADES) * (last - border)));
  }
  table[GAP] = dark ? little(60, 60, 60) : little(230, 230, 230);
  return table;
}

export function mapView(body, studio) {
  const image = document.createElement("canvas");
  let colourOf = null;
  let colourKey = "";
  let plane = null;
  let lost = { list: [], first: null };
  let rendered = null; // the frame of the image
  let finger = null; // where the map is dragged

  function render(frame) {
    rendered = frame;
    const [rows, columns] = frame.data.codes.shape;
    const key = JSON.stringify([frame.low, frame.high, frame.front, colours().dark]);
    if (key !== colourKey) [colourOf, colourKey] = [palette(frame.low, frame.high, frame.front, colours().dark), key];
    image.width = columns;
    image.height = rows;
    const pixels = new ImageData(columns, rows);
    const out = new Uint32Array(pixels.data.buffer);
    const codes = frame.data.codes;
    for (let row = 0; row < rows; row += 1) {
      const [from, to] = [row * columns, (rows - 1 - row) * columns];
      for (let k = 0; k < columns; k += 1) out[to + k] = colourOf[codes[from + k]];
    }
    lost = lostDots(frame);
    for (const [row, column] of lost.list) out.fill(little(...LOST), (rows - 1 - row) * columns + column, (rows - 1 - row) * columns + Math.min(column + MARK, columns));
    image.getContext("2d").putImageData(pixels, 0, 0);
  }

  function paint(pen, width, height) {
    const frame = studio.frames.map;
    if (!frame) return;
    const c = colours();
    plane = null;
    if (frame.reason) { refusal(pen, width, height, frame.reason); return; }
    // It may have come while the view was hidden.
    if (rendered !== frame) render(frame);
    const time = timeUnit(frame.end);
    const x = { low: 0, high: frame.end, label: `time, ${time.name}${frame.pattern ? `, pattern ${frame.pattern.length > 16 ? `${frame.pattern.slice(0, 15)}…` : frame.pattern}` : ""}`, factor: time.factor };
    const y = { low: frame.rates[0], high: frame.rates[1], label: studio.frames.motion?.sine ? "frequency of the force, Hz" : "firing rate, Hz", factor: 1 };
    plane = axes(pen, width, height, x, y, MARGIN);
    const { box } = plane;
    scale(pen, box, frame, c);
    pen.imageSmoothingEnabled = false;
    pen.drawImage(image, box.x, box.y, box.w, box.h);
    if (lost.list.length) lostKey(pen, box, c);
    pen.save();
    const rate = studio.store.state.rate;
    const place = plane.Y(rate);
    if (place >= box.y - 1 && place <= box.y + box.h + 1) {
      for (const [colour, thick] of [["#000", 3], ["#fff", 1.2]]) {
        pen.strokeStyle = colour;
        pen.lineWidth = thick;
        line(pen, box.x, place, box.x + box.w, place);
      }
    }
    const now = plane.X(studio.cursor);
    if (now >= box.x && now <= box.x + box.w) {
      pen.strokeStyle = "#fff";
      pen.lineWidth = 1;
      pen.setLineDash([2, 3]);
      line(pen, now, box.y, now, box.y + box.h);
    }
    pen.setLineDash([]);
    pen.strokeStyle = c.muted;
    pen.strokeRect(box.x, box.y, box.w, box.h);
    if (frame.failed) failures(pen, box, c, frame);
    if (finger) slip(pen, width, c);
    pen.restore();
  }

  /** A slip of paper at the finger: the text as it is printed at the rate that is dragged to. */
  function slip(pen, width, c) {
    const { line: text, rate } = studio.store.state;
    const frame = studio.frames.line;
    const word = prints(studio.described) && text.trim() && frame && !frame.reason ? frame : null;
    const [w, h] = [Math.min(SLIP.w, width - 8), word ? SLIP.h : 20];
    const x = Math.min(Math.max(finger.x - w / 2, 4), width - w - 4);
    const y = finger.y - SLIP.away - h > 0 ? finger.y - SLIP.away - h : finger.y + SLIP.away;
    pen.fillStyle = c.panel;
    pen.strokeStyle = c.ink;
    pen.lineWidth = 1;
    pen.fillRect(x, y, w, h);
    pen.strokeRect(x, y, w, h);
    pen.save();
    pen.translate(x, y);
    if (word) printed(pen, w, h - 12, word, true);
    pen.restore();
    pen.font = SMALL;
    pen.fillStyle = c.ink;
    pen.textAlign = "center";
    pen.textBaseline = "bottom";
    pen.fillText(word ? `${shown(rate, "Hz")}: ${word.good} of ${word.wanted} dots good` : shown(rate, "Hz"), x + w / 2, y + h - 3);
  }

  /** The scale of colours above the map: backstop, front of the pack and platen, or what there is. */
  function scale(pen, box, frame, c) {
    const [wide, border] = [Math.floor(box.w), frame.front === null ? null : borderOf(frame) / (GAP - 1)];
    const [top, thick] = [15, 7];
    for (let k = 0; k < wide; k += 2) {
      const colour = colourOf[Math.round((k / wide) * (GAP - 1))];
      pen.fillStyle = `rgb(${colour & 255},${(colour >> 8) & 255},${(colour >> 16) & 255})`;
      pen.fillRect(box.x + k, top, Math.min(2, wide - k), thick);
    }
    pen.save();
    pen.font = SMALL;
    pen.fillStyle = c.muted;
    pen.textBaseline = "bottom";
    const unit = unitOf("m");
    const write = (align, x, text) => { pen.textAlign = align; pen.fillText(text, x, top - 1); };
    write("left", box.x, digits(frame.low * unit.factor, 3));
    write("right", box.x + box.w, shown(frame.high, "m", 3));
    if (border !== null && border > 0.2 && border < 0.75) write("center", box.x + border * box.w, `${packOf(studio.described)} ${digits(frame.front * unit.factor, 3)}`);
    pen.restore();
  }

  /** The key of lost dots, upon the map. */
  function lostKey(pen, box, c) {
    pen.save();
    pen.font = SMALL;
    pen.textBaseline = "middle";
    pen.fillStyle = c.panel;
    pen.globalAlpha = 0.85;
    const text = said("lost dot", studio.described);
    const wide = pen.measureText(text).width + 20;
    pen.fillRect(box.x + box.w - wide - 2, box.y + 2, wide, 13);
    pen.globalAlpha = 1;
    pen.fillStyle = `rgb(${LOST})`;
    pen.fillRect(box.x + box.w - wide + 2, box.y + 6, 8, 4);
    pen.fillStyle = c.ink;
    pen.textAlign = "right";
    pen.fillText(text, box.x + box.w - 6, box.y + 8.5);
    pen.restore();
  }

  /** Tell how many rates are grey from somewhere on, and why. */
  function failures(pen, box, c, { failed, data: { codes } }) {
    const text = `${failed} of ${codes.shape[0]} runs failed: grey from there`;
    pen.font = FONT;
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.fillStyle = c.panel;
    pen.fillRect(box.x + 4, box.y + 4, Math.min(pen.measureText(text).width + 8, box.w - 8), 16);
    pen.fillStyle = c.ink;
    pen.fillText(text, box.x + 8, box.y + 12);
  }

  const area = surface(body, paint, "Frequency-time map");
  const { canvas } = area;
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "slider");
  canvas.setAttribute("aria-label", "Frequency-time map: firing rate");
  canvas.setAttribute("aria-orientation", "vertical");
  const tip = body.appendChild(document.createElement("div"));
  tip.className = "tip pointed";

  const choose = (event) => {
    if (!plane) return;
    const bounds = canvas.getBoundingClientRect();
    finger = { x: event.clientX - bounds.left, y: event.clientY - bounds.top };
    const rate = plane.y(Math.min(Math.max(event.clientY - bounds.top, plane.box.y), plane.box.y + plane.box.h));
    studio.store.set({ rate: Number(rate.toPrecision(5)) }, "rate");
  };
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); choose(event); });
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons & 1) choose(event);
    read(event);
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, () => { finger = null; area.draw(); });
  canvas.addEventListener("pointerleave", () => { tip.textContent = ""; });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowUp: 1, ArrowDown: -1, PageUp: 10, PageDown: -10 }[event.key];
    if (!step || !studio.frames.map?.rates) return;
    event.preventDefault();
    const [low, high] = studio.frames.map.rates;
    const rate = studio.store.state.rate + (step * (high - low)) / 200;
    studio.store.set({ rate: Number(Math.min(Math.max(rate, low), high).toPrecision(5)) }, "rate");
  });

  /** Tell time, rate and displacement below the pointer. */
  function read(event) {
    const frame = studio.frames.map;
    const bounds = canvas.getBoundingClientRect();
    if (!frame || !plane) return;
    const [time, rate] = [plane.x(event.clientX - bounds.left), plane.y(event.clientY - bounds.top)];
    const x = valueAt(time, rate);
    tip.textContent = x === null || finger ? "" : `${shown(rate, "Hz")}, ${shown(time, "s")}: ${shown(x, "m")}`;
  }

  /** Return the displacement at a time and a rate, m, or null where the map does not know it. */
  function valueAt(time, rate) {
    const frame = studio.frames.map;
    if (!frame || frame.reason) return null;
    const [rows, columns] = frame.data.codes.shape;
    const row = Math.round(((rate - frame.rates[0]) / (frame.rates[1] - frame.rates[0])) * (rows - 1));
    const place = (time / frame.end) * (columns - 1);
    const column = Math.min(Math.floor(place), columns - 2);
    if (row < 0 || row >= rows || place < 0 || place > columns - 1) return null;
    const [from, to] = frame.data.codes.subarray(row * columns + column, row * columns + column + 2);
    if (from === GAP || to === GAP) return null;
    return frame.low + ((from + (place - column) * (to - from)) / (GAP - 1)) * (frame.high - frame.low);
  }

  let told = null;
  function refresh() {
    const { rate } = studio.store.state;
    told = rate;
    const [low, high] = studio.frames.map?.rates ?? [rate, rate];
    canvas.setAttribute("aria-valuemin", low);
    canvas.setAttribute("aria-valuemax", high);
    canvas.setAttribute("aria-valuenow", rate);
    area.draw();
  }
  return {
    update: (what) => {
      if (what === "map" && !studio.frames.map.reason) render(studio.frames.map);
      // Of the state only the rate is seen here; the map itself follows.
      if (what === "line" && finger) area.draw();
      if (what === "map" || (what === "state" && studio.store.state.rate !== told)) refresh();
    },
    draw: () => { if (studio.frames.map && !studio.frames.map.reason) render(studio.frames.map); refresh(); },
    cursor: area.draw,
    paint,
    lost: () => lost,
    valueAt,
    timeAt: (x) => (plane && x >= plane.box.x && x <= plane.box.x + plane.box.w ? plane.x(x) : null),
    table: () => {
      const frame = studio.frames.map;
      if (!frame || frame.reason) return null;
      const [rows, columns] = frame.data.codes.shape;
      const at = (k, count, low, high) => low + (k / (count - 1)) * (high - low);
      const all = [...frame.data.codes.keys()];
      return {
        "rate [Hz]": all.map((k) => at(Math.floor(k / columns), rows, ...frame.rates)),
        "time [s]": all.map((k) => at(k % columns, columns, 0, frame.end)),
        "displacement [m]": all.map((k) => (frame.data.codes[k] === GAP ? NaN : at(frame.data.codes[k], GAP, frame.low, frame.high))),
      };
    },
  };
}
