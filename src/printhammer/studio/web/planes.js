// Phase plane, force-displacement loops and strobe section.
import { axes, before, broken, curve, dots, extent, inside, key, refusal, widened } from "./axes.js";
import { surface } from "./pen.js";
import { colours, FONT } from "./theme.js";
import { digits, unitOf } from "./units.js";
import { packOf } from "./words.js";

const SETTLING = 100; // firings in which a train settles, drawn apart
const LEAST = 0.05; // of the extent of a run, arbitrary: the plane of a section is not smaller

const NEAR = 40; // pixels from the pointer to a curve that is meant

/** A view of a plane; `points` are the places on the pixels of a motion, by which the pointer sets the time. */
function planeView(body, studio, label, kinds, paint, table, points = null) {
  const area = surface(body, paint, label);
  const timeAt = (x, y) => {
    const [t, places] = [studio.frames.motion?.data.t, points?.()];
    if (!t || !places) return null;
    let [best, least] = [null, NEAR];
    for (let k = 0; k < t.length; k += 1) {
      const [X, Y] = places(k);
      const away = Math.hypot(X - x, Y - y);
      if (away < least) [best, least] = [t[k], away];
    }
    return best;
  };
  return {
    ...(points ? { timeAt } : {}),
    update: (what) => kinds.includes(what) && area.draw(),
    draw: area.draw,
    cursor: kinds.includes("motion") ? area.draw : () => {},
    paint,
    table,
  };
}

function displacementAxis(low, high) {
  const unit = unitOf("m");
  return { low, high, label: `displacement, ${unit.name}`, factor: unit.factor };
}

function velocityAxis(low, high) {
  const unit = unitOf("m/s");
  return { low, high, label: `velocity, ${unit.name}`, factor: unit.factor };
}

/** Velocity against displacement, with the states at the firings. */
export function phaseView(body, studio) {
  let where = null;
  return planeView(body, studio, "Phase plane with the states at the firings", ["motion"], (pen, width, height) => {
    const frame = studio.frames.motion;
    if (!frame) return;
    const c = colours();
    const { x, v, t } = frame.data;
    const plane = axes(pen, width, height, displacementAxis(...widened(...extent(x))), velocityAxis(...widened(...extent(v))));
    where = (k) => [plane.X(x[k]), plane.Y(v[k])];
    inside(pen, plane);
    pen.lineWidth = 1.1;
    for (const ghost of studio.ghosts) {
      pen.strokeStyle = c.ghost;
      curve(pen, plane, ghost.motion.data.x, ghost.motion.data.v);
    }
    pen.strokeStyle = c.x;
    curve(pen, plane, x, v);
    pen.fillStyle = c.drive;
    dots(pen, plane, frame.data["strobe x"], frame.data["strobe v"], 3);
    const now = before(t, studio.cursor);
    pen.strokeStyle = c.ink;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.arc(plane.X(x[now]), plane.Y(v[now]), 5, 0, 2 * Math.PI);
    pen.stroke();
    pen.restore();
  }, () => {
    const frame = studio.frames.motion;
    return frame && { "time [s]": frame.data.t, "displacement [m]": frame.data.x, "velocity [m/s]": frame.data.v };
  }, () => where);
}

/** Force of pack and backstop against displacement, while they are touched. */
export function loopsView(body, studio) {
  const stop = (frame) => frame.data["F backstop"].map((force, k) => force + frame.data["F damping"][k]);
  let where = null;
  return planeView(body, studio, "Force-displacement loops of pack and backstop", ["motion"], (pen, width, height) => {
    const frame = studio.frames.motion;
    if (!frame) return;
    const c = colours();
    const unit = unitOf("N");
    const { x, t } = frame.data;
    const pack = frame.data["F pack"].map((force) => -force);
    const backstop = stop(frame);
    const [low, high] = widened(...extent(backstop, ...extent(pack, 0, 1e-9)));
    const { front, backstop: place } = frame.places;
    const plane = axes(pen, width, height, displacementAxis(...widened(...extent(x))), { low, high, label: `force, ${unit.name}`, factor: unit.factor });
    where = (k) => [plane.X(x[k]), plane.Y(Math.max(pack[k], backstop[k]))];
    inside(pen, plane);
    pen.lineWidth = 1.2;
    for (const ghost of studio.ghosts) {
      const old = ghost.motion;
      pen.strokeStyle = c.ghost;
      curve(pen, plane, old.data.x, old.data["F pack"].map((force) => -force), (k) => old.data.x[k] >= old.places.front);
      curve(pen, plane, old.data.x, stop(old), (k) => old.data.x[k] <= old.places.backstop);
    }
    pen.strokeStyle = c.pack;
    if (front !== null) curve(pen, plane, x, pack, (k) => x[k] >= front);
    pen.strokeStyle = c.backstop;
    if (place !== null) curve(pen, plane, x, backstop, (k) => x[k] <= place);
    const now = before(t, studio.cursor);
    pen.strokeStyle = c.ink;
    pen.beginPath();
    pen.arc(plane.X(x[now]), plane.Y(Math.max(pack[now], backstop[now])), 4, 0, 2 * Math.PI);
    pen.stroke();
    key(pen, plane.box, [...(place !== null && !studio.described.rigid ? [{ name: "backstop", colour: c.backstop }] : []), ...(front !== null ? [{ name: packOf(studio.described), colour: c.pack }] : [])]);
    pen.restore();
  }, () => {
    const frame = studio.frames.motion;
    return frame && { "displacement [m]": frame.data.x, "pack force [N]": frame.data["F pack"], "backstop force [N]": stop(frame) };
  }, () => where);
}

/** Return the ends of an axis of a strobe section: those of the settled points, if there are any. */
export function sectionEnds(values, [from, to]) {
  const [low, high] = extent(values.length > 2 * SETTLING ? values.slice(SETTLING) : values);
  // The few points of a periodic train differ by rounding, which would fill the whole plane.
  const more = Math.max(0, 0.5 * (LEAST * (to - from) - (high - low)));
  return [low - more, high + more];
}

/** The states at the firings of an endless train, with the verdict. */
export function strobeView(body, studio) {
  return planeView(body, studio, "Strobe section of an endless train at this rate", ["strobe"], (pen, width, height) => {
    const frame = studio.frames.strobe;
    if (!frame) return;
    const c = colours();
    if (frame.reason) { refusal(pen, width, height, frame.reason); return; }
    const { x, v } = frame.data;
    const known = [...x.keys()].filter((k) => Number.isFinite(x[k]));
    const [xs, vs] = [known.map((k) => x[k]), known.map((k) => v[k])];
    const spread = studio.frames.motion ? [extent(studio.frames.motion.data.x), extent(studio.frames.motion.data.v)] : [[0, 1e-4], [0, 1]];
    const settled = Math.min(SETTLING, xs.length);
    const [xe, ve] = [sectionEnds(xs, spread[0]), sectionEnds(vs, spread[1])];
    pen.font = FONT;
    const step = studio.frames.motion?.sine ? "period" : "firing";
    const told = strobeText(frame, step);
    const lines = broken(pen, told, width - 12);
    const margin = { left: 46, right: 10, top: 8 + 14 * lines.length, bottom: 32 };
    const plane = axes(pen, width, height, displacementAxis(...widened(...xe)), velocityAxis(...widened(...ve)), margin);
    inside(pen, plane);
    pen.fillStyle = c.ghost;
    dots(pen, plane, xs.slice(0, settled), vs.slice(0, settled), 2);
    pen.fillStyle = c.x;
    dots(pen, plane, xs.slice(settled), vs.slice(settled), 2);
    if (x.length > SETTLING) key(pen, plane.box, [{ name: `${step}s 1 to ${SETTLING}`, colour: c.ghost }, { name: `to ${x.length}`, colour: c.x }]);
    pen.restore();
    pen.save();
    pen.font = FONT;
    pen.fillStyle = c.ink;
    pen.textAlign = "left";
    pen.textBaseline = "top";
    lines.forEach((text, k) => pen.fillText(text, 6, 5 + 14 * k));
    pen.restore();
  }, () => {
    const frame = studio.frames.strobe;
    return frame && !frame.reason && { firing: [...frame.data.x.keys()].map((k) => k + 1), "displacement [m]": frame.data.x, "velocity [m/s]": frame.data.v };
  });
}

export function strobeText(frame, step = "firing") {
  const told = `${frame.data.x.length} of ${frame.last} points at ${digits(frame.rate, 5)} Hz`;
  if (frame.status !== "ok") return `${told}: ${frame.status}`;
  const judged = frame.verdict;
  const sofar = frame.exponent;
  if (!judged) return `${told}${sofar ? `, exponent so far ${exponentText(sofar.value, sofar.standard_error)}` : ""}`;
  const exponent = judged.exponent_per_firing;
  return `${judged.verdict.replace("-", " ")}${exponent === null ? "" : `, exponent ${exponentText(exponent, judged.standard_error)} per ${step}`}`;
}

/** Tell an exponent with as many digits as its standard error leaves it. */
function exponentText(value, error) {
  const sign = value > 0 ? "+" : "";
  if (error === null || !(error >= 5e-4)) return `${sign}${digits(value, 3)}`;
  const places = Math.min(Math.max(1 - Math.floor(Math.log10(error)), 0), 3);
  return `${sign}${value.toFixed(places)} ± ${error.toFixed(places)}`;
}
