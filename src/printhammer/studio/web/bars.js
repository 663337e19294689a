// What each firing did: energies of the dots, and the line that they print.
import { axes, extent, line, refusal } from "./axes.js";
import { surface } from "./pen.js";
import { colours, FONT } from "./theme.js";
import { digits, shown, unitOf } from "./units.js";

/** Energy that each dot put into the pack, and what the pack kept. */
export function energyView(body, studio) {
  const paint = (pen, width, height) => {
    const frame = studio.frames.dots;
    if (!frame) return;
    const c = colours();
    const { dots, energy } = frame;
    const unit = unitOf("J");
    const of = (name) => digits(energy[name] * unit.factor, 3);
    const most = Math.max(...dots.map((dot) => dot.loading_work ?? 0), 1e-12);
    const margin = { left: 46, right: 10, top: 38, bottom: 32 };
    const plane = axes(pen, width, height, { low: 0.5, high: dots.length + 0.5, label: "firing", factor: 1, space: 30, whole: true }, { low: 0, high: 1.08 * most, label: `energy, ${unit.name}`, factor: unit.factor }, margin);
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
    pen.fillText(`coil ${of("coil_work")}, pack ${of("pack_loss")}, backstop ${of("backstop_loss")} ${unit.name}`, 6, 20);
    for (const [colour, text] of [[c.x, "into the pack"], [c.pack, "kept by it"]]) {
      pen.fillStyle = colour;
      pen.fillRect(place, 6, 9, 9);
      place += 13;
      pen.fillStyle = c.ink;
      pen.fillText(text, place, 5);
      place += pen.measureText(text).width + 12;
    }
    pen.restore();
  };
  return barsOf(body, studio, "Energy of each dot", paint, () => dotTable(studio, { loading_work: "J", net_loss: "J" }));
}

/** The dots as they come out on paper that moves past the hammer: place by arrival, size by force. */
export function lineView(body, studio) {
  const paint = (pen, width, height) => {
    const [frame, motion] = [studio.frames.dots, studio.frames.motion];
    if (!frame || !motion) return;
    if (studio.store.state.line.trim()) {
      if (studio.frames.line) printed(pen, width, height, studio.frames.line);
      return;
    }
    const c = colours();
    const { dots, quality } = frame;
    const first = dots.find((dot) => dot.struck);
    const [force, flight] = [first?.peak_force ?? 1, first?.flight_time ?? 0];
    const period = 1 / studio.store.state.rate;
    const slots = Math.max(Math.round(dots.at(-1).fired_at / period) + 1, 1);
    const pitch = Math.min((width - 30) / slots, 40);
    const left = (width - pitch * slots) / 2 + pitch / 2;
    const middle = 0.42 * height;
    pen.save();
    pen.font = FONT;
    pen.strokeStyle = c.faint;
    pen.lineWidth = 1;
    for (let slot = 0; slot < slots; slot += 1) line(pen, left + slot * pitch, middle - 20, left + slot * pitch, middle + 20);
    dots.forEach((dot) => {
      if (!dot.struck) {
        cross(pen, left + (dot.fired_at / period) * pitch, middle, c.lost);
        return;
      }
      const place = left + ((dot.fired_at + dot.flight_time - flight) / period) * pitch;
      const part = Math.min(dot.peak_force / force, 1.6);
      pen.fillStyle = c.ink;
      pen.globalAlpha = Math.min(0.25 + 0.75 * part, 1);
      pen.beginPath();
      pen.arc(place, middle, Math.max(0.34 * pitch * Math.sqrt(part), 1.5), 0, 2 * Math.PI);
      pen.fill();
      pen.globalAlpha = 1;
      if (dot.extra_contacts) {
        pen.strokeStyle = c.lost;
        pen.lineWidth = 1.5;
        pen.beginPath();
        pen.arc(place, middle, 0.5 * pitch + 2, 0, 2 * Math.PI);
        pen.stroke();
      }
    });
    pen.fillStyle = c.ink;
    pen.textAlign = "center";
    const told = [
      `${quality.struck} of ${quality.fired} dots struck, ${quality.extra} extra contacts`,
      quality.struck ? `force ${shown(quality.force_low, "N", 3)} to ${shown(quality.force_high, "N", 3)}` : "",
      quality.struck ? `flight time ${shown(quality.flight_low, "s", 4)} to ${shown(quality.flight_high, "s", 4)}` : "",
    ];
    told.forEach((text, k) => pen.fillText(text, width / 2, 0.42 * height + 44 + 16 * k));
    pen.restore();
  };
  return barsOf(body, studio, "The line as it is printed", paint, () => (studio.store.state.line.trim() ? lineTable(studio.frames.line) : dotTable(studio, { flight_time: "s", peak_force: "N" })));
}

/** Draw a printed text: where dots are wanted, and how they came out. */
function printed(pen, width, height, frame) {
  const c = colours();
  pen.save();
  pen.font = FONT;
  pen.fillStyle = c.ink;
  pen.textAlign = "center";
  if (frame.reason) {
    pen.restore();
    refusal(pen, width, height, frame.reason);
    return;
  }
  const { data } = frame;
  const [left, right] = extent(data["wanted x"]);
  const [top, bottom] = extent(data["wanted y"]);
  const scale = Math.min((width - 40) / (right - left + 2 * frame.wire), (height - 76) / (bottom - top + 2 * frame.wire));
  const X = (x) => width / 2 + (x - 0.5 * (left + right)) * scale;
  const Y = (y) => 0.5 * (height - 52) + (y - 0.5 * (top + bottom)) * scale;
  const radius = Math.max(0.5 * frame.wire * scale, 1);
  const dot = (x, y) => { pen.beginPath(); pen.arc(X(x), Y(y), radius, 0, 2 * Math.PI); };
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
  const faults = Object.entries(frame.faults).map(([name, count]) => `${count} ${name}`).join(", ");
  pen.fillText(`${frame.good} of ${frame.wanted} dots within limits${faults ? `: ${faults}` : ""}`, width / 2, height - 38);
  if (frame.force) {
    pen.fillText(`force ${digits(100 * frame.force[0], 3)} to ${digits(100 * frame.force[1], 3)} % of the single pulse's`, width / 2, height - 24);
    pen.fillText(`off by ${shown(frame.placement[0], "m", 3)} to ${shown(frame.placement[1], "m", 3)} along the line`, width / 2, height - 10);
  }
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
