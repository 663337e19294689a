// Displacement and current, and the forces, against time: drawn by uPlot, and by a pen where they are exported.
import uPlot from "./vendor/uPlot.js";
import { axes, before, curve, extent, inside, key, line, MARGIN, ticks, widened } from "./axes.js";
import { said } from "./captions.js";
import { colours, FONT } from "./theme.js";
import { digits, shown, timeUnit, unitOf } from "./units.js";
import { has, packOf, stopOf } from "./words.js";

const FORCES = ["total", "drive", "magnet", "spring", "damping", "drag", "backstop", "pack"];
const SPACE = { 1: 14, 2: 60, 3: 30 }; // pixels between ticks, by side
const LEAST = 1e-6; // N
const KEY = 0.2; // of the height, for the key of forces
const DENSE = 16; // points per pixel of the screen above which only the extremes of each pixel are drawn
const extremes = uPlot.paths.linear(); // path through the extremes of each pixel
const DASHES = { damping: [2, 2], drag: [6, 2] };

/** Displacement against time, with backstop, pack and platen, firings, and the drive on the right axis. */
export function motionView(body, studio) {
  return curveView(body, studio, {
    label: "Displacement and drive against time",
    series: () => [
      { name: "displacement", si: "m", scale: "x", colour: colours().x, values: (f) => f.data.x },
      ...(studio.frames.motion?.data.u ? [{ name: "voltage", si: "V", scale: "volts", colour: colours().volts, values: (f) => f.data.u, thin: true }] : []),
      { name: quantity(studio), si: studio.frames.motion?.quantity === "force" ? "N" : "A", scale: "drive", colour: colours().drive, values: (f) => f.data.drive, dash: [5, 3] },
    ],
    scales: (frame) => ({ x: placesRange(frame), ...driveRanges(frame) }),
    under: (pen, plane, box) => {
      places(pen, plane, box, studio.frames.motion);
      ghosts(pen, plane, studio);
    },
    over: (pen, plane, box) => {
      placeNames(pen, plane, box, studio.frames.motion, stopOf(studio.described), packOf(studio.described));
      remarks(pen, plane, box, studio);
    },
  });
}

/** The forces of the law against time. */
export function forcesView(body, studio) {
  return curveView(body, studio, {
    label: "Forces against time",
    series: () => forcesOf(studio.frames.motion, studio.described).map((name) => ({ name, title: said(name, studio.described), si: "N", scale: "x", colour: colours()[name], values: (f) => f.data[`F ${name}`], dash: DASHES[name] })),
    scales: (frame) => {
      const [low, high] = widened(...forcesOf(frame, studio.described).reduce((ends, name) => extent(frame.data[`F ${name}`], ...ends), [0, 0]));
      // The key lies above the peaks; forces of rounding only are none.
      const span = Math.max(high - low, LEAST);
      return { x: [low, low + (1 + KEY) * span] };
    },
    under: () => {},
  });
}

const widthOf = ({ name, thin }) => (thin || name === "total" ? 0.8 : 1.3);
/** Return the forces of the laws that a device has; a rigid stop acts without one. */
function forcesOf(frame, described) {
  const stop = described.places.backstop !== null && !described.rigid;
  const laws = { magnet: has(described, "magnet"), spring: described.sprung, pack: described.places.front !== null && !described.rigid_front, backstop: stop, damping: stop };
  return FORCES.filter((name) => laws[name] ?? (name === "total" || !frame || `F ${name}` in frame.data));
}

function quantity(studio) { return studio.frames.motion?.quantity === "force" ? "force" : "current"; }

function placesRange(frame) {
  const { backstop, platen } = frame.places;
  const ends = extent(frame.data.x, ...[backstop, platen].filter((place) => place !== null).length === 2 ? [backstop, platen] : []);
  return widened(...ends, 0.06);
}

/** The ends of the right axes: what drives lies below the motion, in the lowest third, current and voltage on one line at zero. */
function driveRanges(frame) {
  const { drive, u } = frame.data;
  const ends = (u ? [drive, u] : [drive]).map((values) => extent(values, 0, 0));
  const most = ends.map(([low, high]) => Math.max(Math.abs(low), Math.abs(high)) || 1);
  const below = Math.max(...ends.map(([low], k) => -low / most[k]));
  const [current, volts] = most.map((size) => [-(below + 0.05) * size, (3.2 * (below + 1) - below) * size]);
  return volts ? { drive: current, volts } : { drive: current };
}

const RIGHT = ["drive", "volts"]; // scales of the axes on the right
/** Whether a number on a right axis is one that is met; none is where the axis is that of a former drive. */
function within(frame, scale, value) {
  const values = scale === "volts" ? frame.data.u : frame.data.drive;
  if (!values) return false;
  const [low, high] = extent(values, 0, 0);
  return value >= 1.01 * low - 1e-9 && value <= 1.01 * high;
}

/** The surfaces that are struck and the contacts as lines, and the firings as marks on the axis. */
function places(pen, plane, box, frame) {
  const c = colours();
  const { backstop, front, platen } = frame.places;
  pen.save();
  pen.globalAlpha = 0.16;
  pen.fillStyle = c.pack;
  if (front !== null) pen.fillRect(box.x, plane.Y(platen ?? front), box.w, Math.max(plane.Y(front) - plane.Y(platen ?? front), 1));
  pen.globalAlpha = 1;
  pen.setLineDash([]);
  pen.strokeStyle = c.muted;
  pen.lineWidth = 0.8;
  for (const place of [backstop, front, platen]) if (place !== null) line(pen, box.x, plane.Y(place), box.x + box.w, plane.Y(place));
  pen.setLineDash([2, 3]);
  for (const { position } of frame.contacts) if (isInside(plane, box, position)) line(pen, box.x, plane.Y(position), box.x + box.w, plane.Y(position));
  pen.setLineDash([]);
  pen.strokeStyle = c.drive;
  pen.lineWidth = 1;
  for (const fired of frame.fired) line(pen, plane.X(fired), box.y + box.h, plane.X(fired), box.y + box.h - 6);
  pen.restore();
}

/** Whether a displacement lies within the vertical axis: the armature may never reach a contact. */
function isInside(plane, box, place) { return plane.Y(place) >= box.y && plane.Y(place) <= box.y + box.h; }

/** The names of the surfaces that are struck and of contacts, and the time between the first two firings, over the curves. */
function placeNames(pen, plane, box, frame, stop, pack) {
  const c = colours();
  const { backstop, front, platen } = frame.places;
  pen.save();
  pen.font = FONT;
  const surfaces = [[stop, backstop], [pack, front], ["platen", platen]].filter(([, place]) => place !== null);
  // A contact may lie close to a surface, so that its name stands beside those of the surfaces.
  const aside = Math.max(0, ...surfaces.map(([name]) => pen.measureText(name).width + 8));
  const contacts = frame.contacts.filter(({ position }) => isInside(plane, box, position));
  const named = [...surfaces.map((each) => [...each, 0]), ...contacts.map(({ name, position }) => [name, position, aside])];
  for (const [name, place, inward] of named) {
    const low = plane.Y(place) > box.y + 16;
    const wide = pen.measureText(name).width;
    grounded(pen, name, box.x + box.w - 3 - inward - 0.5 * wide, plane.Y(place) + (low ? -8 : 8), c.muted, c);
  }
  spacing(pen, plane, box, frame.fired, c);
  pen.restore();
}

/** Write a text about a centre on a ground that lets the curves below show faintly. */
function grounded(pen, text, x, y, colour, c) {
  const wide = pen.measureText(text).width;
  pen.globalAlpha = 0.75;
  pen.fillStyle = c.panel;
  pen.fillRect(x - 0.5 * wide - 1, y - 6.5, wide + 2, 13);
  pen.globalAlpha = 1;
  pen.fillStyle = colour;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, x, y);
}

/** Write between the first two firings how far they are apart, where there is room. */
function spacing(pen, plane, box, fired, c) {
  if (fired.length < 2) return;
  const [from, to] = [plane.X(fired[0]), plane.X(fired[1])];
  const text = shown(fired[1] - fired[0], "s", 4);
  if (to - from < pen.measureText(text).width + 12 || to > box.x + box.w || from < box.x) return;
  pen.strokeStyle = c.drive;
  pen.lineWidth = 1;
  pen.setLineDash([]);
  grounded(pen, text, 0.5 * (from + to), box.y + box.h - 14, c.drive, c);
  line(pen, from + 1, box.y + box.h - 4, to - 1, box.y + box.h - 4);
}

function ghosts(pen, plane, studio) {
  const c = colours();
  pen.setLineDash([]);
  for (const ghost of studio.ghosts) {
    pen.strokeStyle = c.ghost;
    pen.lineWidth = 1.2;
    curve(pen, plane, ghost.motion.data.t, ghost.motion.data.x);
    named(pen, plane, studio.frames.motion, ghost, c);
  }
  if (studio.overlay?.what === "displacement") {
    pen.strokeStyle = c.overlay;
    pen.lineWidth = 1.5;
    curve(pen, plane, studio.overlay.data.t, studio.overlay.data.values);
  }
}

/** Write the name of a run that stays behind where it is farthest from the one that is set. */
function named(pen, plane, frame, { name, motion: { data: { t, x } } }, c) {
  let [best, most] = [0, -1];
  const last = frame.data.t.at(-1);
  for (let k = 0; k < t.length && t[k] <= last; k += 1) {
    const away = Math.abs(x[k] - displacementAt(frame, t[k]));
    if (away > most) [best, most] = [k, away];
  }
  pen.font = FONT;
  pen.fillStyle = c.muted;
  pen.textAlign = "left";
  pen.textBaseline = "bottom";
  pen.fillText(name, plane.X(t[best]) + 5, plane.Y(x[best]));
}

/** Write the remarks of a story, each with a line to its place on the curve. */
function remarks(pen, plane, box, studio) {
  const c = colours();
  const frame = studio.frames.motion;
  pen.font = FONT;
  pen.setLineDash([]);
  pen.lineWidth = 1;
  for (const [time, text] of studio.remarks?.() ?? []) {
    const [x, y] = [plane.X(time), plane.Y(displacementAt(frame, time))];
    const wide = pen.measureText(text).width;
    const left = x + 18 + wide < box.x + box.w ? x + 16 : x - 16 - wide;
    const at = Math.min(Math.max(y - 16, box.y + 10), box.y + box.h - 10);
    pen.strokeStyle = c.ink;
    line(pen, x, y, left > x ? left - 2 : left + wide + 2, at);
    grounded(pen, text, left + 0.5 * wide, at, c.ink, c);
  }
}

/** Return the path of a curve through all its points: extremes of whole pixels look like stairs on a steep curve. */
function segments(u, series, from, to) {
  const [t, values] = [u.data[0], u.data[series]];
  if (to - from > DENSE * u.bbox.width) return extremes(u, series, from, to);
  const { scale } = u.series[series];
  const stroke = new Path2D();
  for (let k = from; k <= to; k++) stroke.lineTo(u.valToPos(t[k], "t", true), u.valToPos(values[k], scale, true));
  return { stroke, fill: null, clip: null, band: null, gaps: null, flags: 1 };
}

function curveView(body, studio, kind) {
  let plot = null;
  let made = "";
  let size = [0, 0];
  const holder = body.appendChild(document.createElement("div"));
  holder.className = "curves";
  holder.setAttribute("role", "img");
  holder.setAttribute("aria-label", kind.label);

  const planeOf = (u) => {
    const ratio = uPlot.pxRatio;
    const box = { x: u.bbox.left / ratio, y: u.bbox.top / ratio, w: u.bbox.width / ratio, h: u.bbox.height / ratio };
    return { box, X: (t) => box.x + u.valToPos(t, "t"), Y: (x) => box.y + u.valToPos(x, "x") };
  };
  const scaled = (u, draw) => {
    const ratio = uPlot.pxRatio;
    u.ctx.save();
    u.ctx.scale(ratio, ratio);
    const plane = planeOf(u);
    inside(u.ctx, plane);
    draw(u.ctx, plane, plane.box);
    u.ctx.restore();
    u.ctx.restore();
  };

  function build() {
    const c = colours();
    const series = kind.series();
    const rights = series.filter((entry) => RIGHT.includes(entry.scale)).reverse();
    const right = rights.length > 0;
    const axis = (scale, si, label, side, colour = c.muted) => ({
      scale, side, font: FONT, labelFont: FONT, stroke: right && side === 3 ? c.x : colour, labelSize: 16, labelGap: 0, gap: 3,
      size: side === 2 ? 18 : 36, label, space: SPACE[side],
      grid: { stroke: c.faint, width: 1, show: side !== 1 }, ticks: { show: false },
      values: (u, ticks) => ticks.map((tick) => (tick === null ? "" : digits(Number((tick * shownIn(u, si).factor).toPrecision(6))))),
      splits: (u, _axis, low, high) => splitsOf(low, high, (side === 2 ? u.bbox.width : u.bbox.height) / uPlot.pxRatio, SPACE[side], shownIn(u, si).factor),
      ...(side === 1 ? { filter: (u, splits) => splits.map((value) => (studio.frames.motion && within(studio.frames.motion, scale, value) ? value : null)) } : {}),
    });
    const main = series[0];
    plot?.destroy();
    plot = new uPlot({
      width: size[0], height: size[1], pxAlign: 0, legend: { show: false }, padding: [8, right ? 0 : 8, 0, 0],
      cursor: { sync: { key: "time", setSeries: false, scales: ["t", null] }, drag: { x: true, y: false, setScale: true }, points: { show: false }, bind: { dblclick: () => () => { studio.zoom(null); return null; } } },
      scales: { t: { time: false, auto: false }, x: { auto: false }, drive: { auto: false }, volts: { auto: false } },
      axes: [axis("t", "s", (u) => `time, ${shownIn(u, "s").name}`, 2), axis("x", main.si, `${right ? main.name : "force"}, ${unitOf(main.si).name}`, 3), ...rights.map((entry) => axis(entry.scale, entry.si, `${entry.name}, ${unitOf(entry.si).name}`, 1, entry.colour))],
      series: [{ scale: "t" }, ...series.map((entry) => ({ scale: entry.scale, stroke: entry.colour, width: widthOf(entry), dash: entry.dash, paths: segments, points: { show: false } }))],
      hooks: {
        drawAxes: [(u) => { if (studio.frames.motion) scaled(u, kind.under); }],
        draw: [(u) => { if (studio.frames.motion) scaled(u, (pen, plane, box) => { if (right) kind.over(pen, plane, box); else key(pen, box, series); }); }],
        setCursor: [(u) => { if (u.cursor.event && u.cursor.left >= 0) studio.setCursor(u.posToVal(u.cursor.left, "t"), holder); }],
        setSelect: [(u) => { if (u.select.width > 4) studio.zoom([u.posToVal(u.select.left, "t"), u.posToVal(u.select.left + u.select.width, "t")]); }],
      },
    }, [[0, 1], ...series.map(() => [0, 0])], holder);
    made = style();
  }
  const style = () => JSON.stringify([unitOf("s"), unitOf("m"), unitOf("N"), unitOf("A"), quantity(studio), kind.series().map((entry) => entry.name), colours()]);

  function draw() {
    const frame = studio.frames.motion;
    if (!frame || size[0] < 40 || size[1] < 40) return;
    if (!plot || made !== style()) build();
    const { t } = frame.data;
    const [low, high] = studio.window ?? [t[0], t[t.length - 1]];
    plot.batch(() => {
      plot.setData([t, ...kind.series().map((entry) => entry.values(frame))], false);
      plot.setScale("t", { min: low, max: high });
      for (const [name, [min, max]] of Object.entries(kind.scales(frame))) plot.setScale(name, { min, max });
    });
    cursor();
  }

  function cursor() {
    if (!plot || studio.cursorFrom === holder || !studio.frames.motion) return;
    plot.setCursor({ left: plot.valToPos(studio.cursor, "t"), top: -10 }, false);
  }

  new ResizeObserver(([entry]) => {
    size = [Math.floor(entry.contentRect.width), Math.floor(entry.contentRect.height)];
    if (plot && size[0] > 40 && size[1] > 40) plot.setSize({ width: size[0], height: size[1] });
    draw();
  }).observe(body);

  function paint(pen, width, height) {
    const frame = studio.frames.motion;
    if (!frame) return;
    const { t } = frame.data;
    const [low, high] = studio.window ?? [t[0], t[t.length - 1]];
    const series = kind.series();
    const scales = kind.scales(frame);
    const driven = series.filter((entry) => RIGHT.includes(entry.scale)).reverse();
    const time = timeUnit(high - low);
    const main = unitOf(series[0].si);
    const x = { low, high, label: `time, ${time.name}`, factor: time.factor };
    const y = { low: scales.x[0], high: scales.x[1], label: `${driven.length ? series[0].name : "force"}, ${main.name}`, factor: main.factor };
    const plane = axes(pen, width, height, x, y, driven.length ? { ...MARGIN, right: 44 * driven.length } : MARGIN);
    driven.forEach((entry, k) => rightAxis(pen, plane.box, scales[entry.scale], (value) => within(frame, entry.scale, value), entry, 44 * k));
    inside(pen, plane);
    kind.under(pen, plane, plane.box);
    for (const entry of series) {
      const ends = scales[entry.scale];
      const own = { X: plane.X, Y: (value) => plane.box.y + plane.box.h * (1 - (value - ends[0]) / (ends[1] - ends[0])) };
      pen.strokeStyle = entry.colour;
      pen.lineWidth = widthOf(entry);
      pen.setLineDash(entry.dash ?? []);
      curve(pen, own, t, entry.values(frame));
    }
    key(pen, plane.box, series);
    if (driven.length) kind.over(pen, plane, plane.box);
    pen.restore();
    pen.setLineDash([]);
  }

  const table = () => {
    const frame = studio.frames.motion;
    return frame && { "time [s]": frame.data.t, ...Object.fromEntries(kind.series().map((entry) => [`${entry.name} [${entry.si}]`, entry.values(frame)])) };
  };
  // Remarks need the dots, which come after the curves.
  return { update: (what) => (what === "motion" || (what === "dots" && studio.remarks)) && draw(), draw, cursor, paint, table };
}

/** Write the scale of the drive on the right, as far as it is met. */
function rightAxis(pen, box, [low, high], met, { name, si, colour }, away) {
  const unit = unitOf(si);
  pen.save();
  pen.font = FONT;
  pen.fillStyle = colour;
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  for (const tick of ticks(low * unit.factor, high * unit.factor, box.h, 14)) {
    const value = tick / unit.factor;
    if (met(value)) pen.fillText(digits(Number(tick.toPrecision(6))), box.x + box.w + 5 + away, box.y + box.h * (1 - (value - low) / (high - low)));
  }
  pen.textAlign = "center";
  pen.translate(box.x + box.w + 36 + away, box.y + box.h / 2);
  pen.rotate(-Math.PI / 2);
  pen.fillText(`${name}, ${unit.name}`, 0, 0);
  pen.restore();
}

/** Return round numbers of the unit that is shown, in SI. */
function splitsOf(low, high, length, space, factor) { return ticks(low * factor, high * factor, length, space).map((tick) => tick / factor); }

function shownIn(u, si) { return si === "s" ? timeUnit(u.scales.t.max - u.scales.t.min) : unitOf(si); }

/** Return a quantity of a motion at a time, between the points next to it. */
export function valueAt(frame, values, time) {
  const { t } = frame.data;
  const k = Math.min(before(t, time), t.length - 2);
  const part = t[k + 1] > t[k] ? Math.min(Math.max((time - t[k]) / (t[k + 1] - t[k]), 0), 1) : 0;
  return values[k] + part * (values[k + 1] - values[k]);
}

export const displacementAt = (frame, time) => valueAt(frame, frame.data.x, time);
