// Axes of a plane: ticks at round numbers, labels, and the way from quantities to pixels.
import { colours, FONT } from "./theme.js";
import { digits } from "./units.js";

const NEAR = 0.7; // pixels
const CHUNK = 64;

export const MARGIN = { left: 46, right: 10, top: 8, bottom: 32 };

/** Return round numbers between two ends, about one every `space` pixels. */
export function ticks(low, high, length, space) {
  const wish = ((high - low) * space) / Math.max(length, 1);
  const power = 10 ** Math.floor(Math.log10(wish));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= wish) * power;
  const list = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k += 1) list.push(k * step);
  return Number.isFinite(step) && list.length < 100 ? list : [];
}

/** Widen a range by a part of itself; make one of a single number. */
export function widened(low, high, part = 0.04) {
  if (!(high > low)) return [low - 1, low + 1];
  const more = part * (high - low);
  return [low - more, high + more];
}

/**
 * Draw axes; x and y are { low, high, label, factor } with the factor from SI to what is written; x also { space, whole }.
 * Returns the pixel of a quantity, the quantity of a pixel, and the box.
 */
export function axes(pen, width, height, x, y, margin = MARGIN) {
  const c = colours();
  const h = height - margin.top - margin.bottom;
  const rows = ticks(y.low * y.factor, y.high * y.factor, h, 30).map((tick) => [tick, digits(Number(tick.toPrecision(6)))]);
  pen.save();
  pen.font = FONT;
  const left = Math.max(margin.left, ...rows.map(([, text]) => Math.ceil(pen.measureText(text).width) + 22));
  pen.restore();
  const box = { x: left, y: margin.top, w: width - left - margin.right, h };
  const X = (value) => box.x + ((value - x.low) / (x.high - x.low)) * box.w;
  const Y = (value) => box.y + box.h - ((value - y.low) / (y.high - y.low)) * box.h;
  pen.save();
  pen.font = FONT;
  pen.lineWidth = 1;
  pen.fillStyle = c.muted;
  pen.strokeStyle = c.faint;
  pen.textAlign = "center";
  pen.textBaseline = "top";
  for (const tick of ticks(x.low * x.factor, x.high * x.factor, box.w, x.space ?? 60)) {
    if (x.whole && !Number.isInteger(tick)) continue;
    const place = X(tick / x.factor);
    line(pen, place, box.y, place, box.y + box.h);
    const text = digits(Number(tick.toPrecision(6)));
    // The last one ends within the picture.
    pen.fillText(text, Math.min(place, width - 0.5 * pen.measureText(text).width - 1), box.y + box.h + 4);
  }
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const [tick, text] of rows) {
    const place = Y(tick / y.factor);
    line(pen, box.x, place, box.x + box.w, place);
    pen.fillText(text, box.x - 5, place);
  }
  pen.textAlign = "center";
  pen.textBaseline = "top";
  pen.fillText(x.label, box.x + box.w / 2, box.y + box.h + 17);
  pen.save();
  pen.translate(3, box.y + box.h / 2);
  pen.rotate(-Math.PI / 2);
  pen.fillText(y.label, 0, 0);
  pen.restore();
  pen.restore();
  return { X, Y, box, x: (place) => x.low + ((place - box.x) / box.w) * (x.high - x.low), y: (place) => y.low + ((box.y + box.h - place) / box.h) * (y.high - y.low) };
}

export function line(pen, x0, y0, x1, y1) {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}

/**
 * Draw a curve through the points that `use` lets pass; a gap where it does not. Points that would lie on the one
 * before are left out, and many short strokes are faster than a long one.
 */
export function curve(pen, plane, xs, ys, use = null) {
  let [on, count, lastX, lastY] = [false, 0, 0, 0];
  pen.beginPath();
  for (let k = 0; k < xs.length; k += 1) {
    if (use && !use(k)) { on = false; continue; }
    const [x, y] = [plane.X(xs[k]), plane.Y(ys[k])];
    if (!on) pen.moveTo(x, y);
    else if (Math.abs(x - lastX) + Math.abs(y - lastY) < NEAR && k < xs.length - 1) continue;
    else pen.lineTo(x, y);
    [on, lastX, lastY] = [true, x, y];
    count += 1;
    if (count % CHUNK === 0) {
      pen.stroke();
      pen.beginPath();
      pen.moveTo(x, y);
    }
  }
  pen.stroke();
}

export function dots(pen, plane, xs, ys, radius) {
  for (let k = 0; k < xs.length; k += 1) {
    if (!Number.isFinite(xs[k])) continue;
    pen.beginPath();
    pen.arc(plane.X(xs[k]), plane.Y(ys[k]), radius, 0, 2 * Math.PI);
    pen.fill();
  }
}

/** Keep what follows inside the box of a plane, until `pen.restore()`. */
export function inside(pen, plane) {
  pen.save();
  pen.beginPath();
  pen.rect(plane.box.x, plane.box.y, plane.box.w, plane.box.h);
  pen.clip();
}

/** Return the smallest and the largest of numbers, at least the two given. */
export function extent(values, low = Infinity, high = -Infinity) {
  let [least, most] = [low, high];
  for (const value of values) {
    if (value < least) least = value;
    if (value > most) most = value;
  }
  return [least, most];
}

/** Return the last index at which ascending numbers are not above a value. */
export function before(values, value) {
  let [low, high] = [0, values.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (values[middle] <= value) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** A key: coloured strokes with names in rows from the right end of a box, a new row where one is full. */
export function key(pen, box, entries) {
  const c = colours();
  pen.save();
  pen.font = FONT;
  pen.textBaseline = "middle";
  pen.textAlign = "right";
  let [place, row] = [box.x + box.w - 4, box.y + 8];
  const placed = [];
  for (const { name: own, title: name = own, colour, dash = [] } of [...entries].reverse()) {
    const wide = pen.measureText(name).width + 4 + 14;
    if (place - wide < box.x) [place, row] = [box.x + box.w - 4, row + 14];
    placed.push({ name, colour, dash, place, row, wide });
    place -= wide + 10;
  }
  // Curves below it do not strike out the names.
  pen.fillStyle = c.panel;
  pen.globalAlpha = 0.8;
  for (const entry of placed) pen.fillRect(entry.place - entry.wide - 3, entry.row - 7, entry.wide + 6, 14);
  pen.globalAlpha = 1;
  for (const { name, colour, dash, place: right, row: middle, wide } of placed) {
    pen.fillStyle = c.ink;
    pen.fillText(name, right, middle);
    pen.strokeStyle = colour;
    pen.lineWidth = 2;
    pen.setLineDash(dash);
    line(pen, right - wide, middle, right - wide + 14, middle);
  }
  pen.restore();
}

/** Return a text in lines that are no wider than some pixels, with the font of a pen. */
export function broken(pen, text, width) {
  const lines = [""];
  for (const word of text.split(" ")) {
    const longer = lines.at(-1) ? `${lines.at(-1)} ${word}` : word;
    if (lines.at(-1) && pen.measureText(longer).width > width) lines.push(word);
    else lines[lines.length - 1] = longer;
  }
  return lines;
}

/** Tell in the middle of a view why it is empty, in lines that fit. */
export function refusal(pen, width, height, reason) {
  pen.save();
  pen.font = FONT;
  pen.fillStyle = colours().ink;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  const lines = broken(pen, reason, width - 24);
  lines.forEach((text, k) => pen.fillText(text, width / 2, height / 2 + 15 * (k - (lines.length - 1) / 2)));
  pen.restore();
}
