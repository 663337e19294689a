// What each firing did: energies of the dots, and the line that they print.
import { axes, broken, extent, line, refusal } from "./axes.js";
import { flightText, said } from "./captions.js";
import { surface } from "./pen.js";
import { colours, FONT } from "./theme.js";
import { digits, shown, unitOf } from "./units.js";

const SIDES = [52, 52]; // the margins of the motion, below which the dots lie
const ROUNDING = 1e-9; // m, a place on the paper that is told as none
const placed = (place) => shown(Math.abs(place) < ROUNDING ? 0 : place, "m", 3);

/** Energy that each dot put into the pack, and what the pack kept. */
export function energyView(body, studio) {
  let where = null;
  const paint = (pen, width, height) => {
    const frame = studio.frames.dots;
    if (!frame) return;
    const c = colours();
    const { dots, energy } = frame;
    if (!energy) { refusal(pen, width, height, frame.unknown); return; }
    const unit = unitOf("J");
    const of = (name) => digits(energy[name] * unit.factor, 3);
    const most = Math.max(...dots.map((dot) => dot.loading_work ?? 0), 1e-12);
    pen.font = FONT;
    const supply = energy.supply_work ? `supply ${of("supply_work")}, copper ${of("copper_loss")}, driver ${of("driver_loss")}${energy.eddy_loss ? `, eddy currents ${of("eddy_loss")}` : ""}, ` : "";
    const words = broken(pen, said(`${supply}${energy.drive_work ? `drive ${of("drive_work")}` : `coil ${of("coil_work")}`}, pack ${of("pack_loss")}, backstop ${of("backstop_loss")}${energy.damping_loss ? `, damping ${of("damping_loss")}` : ""} ${unit.name}`, studio.described), width - 12);
    const margin = { left: 46, right: 10, top: 24 + 14 * words.length, bottom: 32 };
    const plane = axes(pen, width, height, { low: 0.5, high: dots.length + 0.5, label: "firing", factor: 1, space: 30, whole: true }, { low: 0, high: 1.08 * most, label: `energy, ${unit.name}`, factor: unit.factor }, margin);
    where = plane;
    const wide = Math.min((plane.box.w / dots.length) * 0.36, 16);
    dots.forEach((dot, k) => {
      const middle = plane.X(k + 1);
      if (!dot.struck) {
        cross(pen, middle, plane.Y(0) - 8, c.lost);
        return;
      }
      bar(pen, plane, middle - wide, wide - 0.5, dot.loading_work, c.x);
      bar(pen, plane, middle + 0.5, wide - 0.5, dot.net_loss, c.pack);
    });
    pen.save();
    pen.font = FONT;
    pen.textAlign = "left";
    pen.textBaseline = "top";
    pen.fillStyle = c.ink;
    let place = 6;
    words.forEach((text, k) => pen.fillText(text, 6, 20 + 14 * k));
    for (const [colour, text] of [[c.x, said("into the pack", studio.described)], [c.pack, "kept by it"]]) {
      pen.fillStyle = colour;
      pen.fillRect(place, 6, 9, 9);
      place += 13;
      pen.fillStyle = c.ink;
      pen.fillText(text, place, 5);
      place += pen.measureText(text).width + 12;
    }
    pen.restore();
  };
  const view = barsOf(body, studio, "Energy of each dot", paint, () => dotTable(studio, { loading_work: "J", net_loss: "J" }));
  const timeAt = (x) => {
    const dot = where && studio.frames.dots?.dots[Math.round(where.x(x)) - 1];
    return dot ? dot.fired_at + (dot.flight_time ?? 0) : null;
  };
  return { ...view, timeAt };
}

/** The dots of the burst, each below its touch, and the text as it is printed. */
export function lineView(body, studio) {
  const paint = (pen, width, height) => {
    const [frame, motion] = [studio.frames.dots, studio.frames.motion];
    if (!frame || !motion) return;
    const text = studio.store.state.line.trim();
    const strip = text ? Math.min(Math.max(0.34 * height, 54), 90) : height;
    burst(pen, width, strip, frame, motion, studio, !text);
    if (!text || !studio.frames.line) return;
    pen.save();
    pen.translate(0, strip);
    printed(pen, width, height - strip, studio.frames.line);
    pen.restore();
  };
  const view = barsOf(body, studio, "The line as it is printed", paint, () => (studio.store.state.line.trim() ? lineTable(studio.frames.line) : dotTable(studio, { flight_time: "s", peak_force: "N" })));
  const timeAt = (x) => {
    const t = studio.frames.motion?.data.t;
    if (!t) return null;
    const [low, high] = studio.window ?? [t[0], t[t.length - 1]];
    const part = (x - SIDES[0]) / (body.clientWidth - SIDES[0] - SIDES[1]);
    return part >= 0 && part <= 1 ? low + part * (high - low) : null;
  };
  return { ...view, cursor: view.draw, timeAt };
}

/** The dots of a burst on the time axis of the motion: place by touch, area by force. */
function burst(pen, width, height, { dots, quality }, motion, studio, explained) {
  const c = colours();
  const { t } = motion.data;
  const [low, high] = studio.window ?? [t[0], t[t.length - 1]];
  const [left, right] = SIDES;
  const X = (time) => left + ((time - low) / (high - low)) * (width - left - right);
  const first = dots.find((dot) => dot.struck);
  const [force, flight] = [first?.peak_force ?? 1, first?.flight_time ?? 0];
  const gaps = dots.slice(1).map((dot, k) => X(dot.fired_at) - X(dots[k].fired_at));
  const pitch = Math.min(...gaps, 44);
  const words = explained
    ? [`${quality.struck} of ${quality.fired} dots struck, ${quality.extra} extra contacts`, quality.struck ? `force ${shown(quality.force_low, "N", 3)} to ${shown(quality.force_high, "N", 3)}` : "", flightText(dots)].map((text) => said(text, studio.described))
    : [];
  const middle = 0.5 * (height - 15 * words.length);
  const reach = Math.min(pitch, middle * 1.5);
  pen.save();
  pen.beginPath();
  pen.rect(left - 30, 0, width - left - right + 60, height);
  pen.clip();
  pen.font = FONT;
  pen.strokeStyle = c.faint;
  pen.lineWidth = 1;
  // Where dots would be if each flew as long as the first.
  for (const dot of dots) line(pen, X(dot.fired_at + flight), middle - 0.6 * reach, X(dot.fired_at + flight), middle + 0.6 * reach);
  line(pen, left, middle, width - right, middle);
  // While the time is within the burst, what comes later is not printed yet.
  const now = studio.cursor > low && studio.cursor < high ? studio.cursor : Infinity;
  for (const dot of dots) {
    if (!dot.struck) { cross(pen, X(dot.fired_at + flight), middle, c.lost); continue; }
    const touched = dot.fired_at + dot.flight_time;
    const part = Math.min(dot.peak_force / force, 1.6);
    pen.fillStyle = c.ink;
    pen.strokeStyle = c.muted;
    pen.beginPath();
    pen.arc(X(touched), middle, Math.max(0.34 * reach * Math.sqrt(part), 1.5), 0, 2 * Math.PI);
    if (touched <= now) {
      pen.globalAlpha = Math.min(0.25 + 0.75 * part, 1);
      pen.fill();
      pen.globalAlpha = 1;
    } else pen.stroke();
    if (dot.extra_contacts) {
      pen.strokeStyle = c.lost;
      pen.lineWidth = 1.5;
      pen.beginPath();
      pen.arc(X(touched), middle, 0.5 * reach + 2, 0, 2 * Math.PI);
      pen.stroke();
      pen.lineWidth = 1;
    }
  }
  if (now < high) {
    pen.strokeStyle = c.muted;
    pen.setLineDash([2, 3]);
    line(pen, X(now), 0, X(now), middle + 0.7 * reach);
    pen.setLineDash([]);
  }
  pen.restore();
  pen.save();
  pen.font = FONT;
  pen.fillStyle = c.ink;
  pen.textAlign = "center";
  words.forEach((text, k) => pen.fillText(text, width / 2, height - 6 - 15 * (words.length - 1 - k)));
  pen.restore();
}

/** Draw a printed text: where dots are wanted, how they came out, and unless it is drawn alone how many. */
export function printed(pen, width, height, frame, alone = false) {
  const c = colours();
  if (frame.reason) { refusal(pen, width, height, frame.reason); return; }
  pen.save();
  pen.font = FONT;
  pen.textAlign = "center";
  const { data } = frame;
  const faults = Object.entries(frame.faults).map(([name, count]) => `${count} ${name}`).join(", ");
  const words = [
    `${frame.good} of ${frame.wanted} dots within limits${faults ? `: ${faults}` : ""}`,
    ...(frame.force ? [`force ${digits(100 * frame.force[0], 3)} to ${digits(100 * frame.force[1], 3)} % of the single pulse's`, `off by ${placed(frame.placement[0])} to ${placed(frame.placement[1])} along the line`] : []),
  ];
  // On one line where they fit, so that the text is as large as it can be.
  const joined = words.join("; ");
  const lines = alone ? [] : pen.measureText(joined).width < width - 16 ? [joined] : words.flatMap((each) => broken(pen, each, width - 16));
  const room = height - 14 * lines.length - 10;
  const [left, right] = extent(data["wanted x"]);
  const [top, bottom] = extent(data["wanted y"]);
  const scale = Math.max(Math.min((width - 40) / (right - left + 2 * frame.wire), (room - 8) / (bottom - top + 2 * frame.wire)), 0);
  const X = (x) => width / 2 + (x - 0.5 * (left + right)) * scale;
  const Y = (y) => 0.5 * room + (y - 0.5 * (top + bottom)) * scale;
  const radius = Math.max(0.5 * frame.wire * scale, 1);
  const dot = (x, y) => { pen.beginPath(); pen.arc(X(x), Y(y), radius, 0, 2 * Math.PI); };
  pen.fillStyle = c.ink;
  for (let k = 0; k < data.x.length; k += 1) {
    if (Number.isFinite(data.x[k])) {
      pen.globalAlpha = Math.min(Math.max(data.darkness[k], 0.05), 1);
      dot(data.x[k], data.y[k]);
      pen.fill();
    } else {
      pen.globalAlpha = 1;
      pen.strokeStyle = c.lost;
      pen.lineWidth = 1;
      dot(data["wanted x"][k], data["wanted y"][k]);
      pen.stroke();
    }
  }
  pen.globalAlpha = 0.5;
  pen.fillStyle = c.drive;
  for (let k = 0; k < data["extra x"].length; k += 1) { dot(data["extra x"][k], data["extra y"][k]); pen.fill(); }
  pen.globalAlpha = 1;
  pen.fillStyle = c.ink;
  lines.forEach((text, k) => pen.fillText(text, width / 2, height - 8 - 14 * (lines.length - 1 - k)));
  pen.restore();
}

function barsOf(body, studio, label, paint, table) {
  const area = surface(body, paint, label);
  return { update: (what) => (what === "dots" || what === "line") && area.draw(), draw: area.draw, cursor: () => {}, paint, table };
}

/** What each firing did, with some quantities of its dot and their units. */
function dotTable(studio, units) {
  const dots = studio.frames.dots?.dots;
  if (!dots) return null;
  const quantities = Object.entries(units).map(([name, unit]) => [`${name} [${unit}]`, dots.map((dot) => dot[name] ?? NaN)]);
  return { firing: dots.map((dot) => dot.index), "fired_at [s]": dots.map((dot) => dot.fired_at), struck: dots.map((dot) => Number(dot.struck)), ...Object.fromEntries(quantities), extra_contacts: dots.map((dot) => dot.extra_contacts) };
}

/** The dots of a printed text: where they are wanted and where they are, and how dark. */
function lineTable(frame) {
  if (!frame || frame.reason) return null;
  const { data } = frame;
  return { "wanted_x [m]": data["wanted x"], "wanted_y [m]": data["wanted y"], "x [m]": data.x, "y [m]": data.y, darkness: data.darkness, fault: data.fault };
}

function bar(pen, plane, x, w, value, colour) {
  pen.fillStyle = colour;
  pen.fillRect(x, plane.Y(value), w, plane.Y(0) - plane.Y(value));
}

function cross(pen, x, y, colour) {
  pen.strokeStyle = colour;
  pen.lineWidth = 2;
  line(pen, x - 5, y - 5, x + 5, y + 5);
  line(pen, x - 5, y + 5, x + 5, y - 5);
}
