// The actuator to scale along its stroke, with the armature moving: play, slow motion, scrub.
import { extent, line } from "./axes.js";
import { displacementAt, valueAt } from "./curves.js";
import { surface } from "./pen.js";
import { voltageAt } from "./readout.js";
import { colours, FONT } from "./theme.js";
import { shown, unitOf } from "./units.js";
import { has, moverOf, packOf, stopOf } from "./words.js";

const SPEEDS = [["1", 1], ["1/3", 1 / 3], ["1/10", 0.1], ["1/30", 1 / 30], ["1/100", 0.01], ["1/300", 1 / 300], ["1/1000", 1e-3], ["1/3000", 1 / 3000]];
const LASTS = 3.5; // s, about, that a run is played

export function sketchView(body, studio) {
  const area = surface(body.appendChild(Object.assign(document.createElement("div"), { className: "drawing" })), paint, "The actuator, to scale along its stroke");
  const bar = body.appendChild(Object.assign(document.createElement("div"), { className: "transport" }));
  bar.innerHTML = `<button type="button" class="play" aria-label="Play">▶</button>
    <input type="range" class="scrub" min="0" max="1000" value="0" step="1" aria-label="Time">
    <select class="speed" aria-label="Slow motion">${SPEEDS.map(([name, factor]) => `<option value="${factor}">${name}</option>`).join("")}</select>`;
  const [play, scrub, speed] = bar.children;
  let suited = null; // the device to which the speed is suited
  const suit = () => {
    const [low, high] = span();
    const away = ([, factor]) => Math.abs(Math.log((high - low) / factor / LASTS));
    speed.value = String(SPEEDS.reduce((best, each) => (away(each) < away(best) ? each : best))[1]);
  };
  let timer = 0;
  let last = 0;

  const span = () => {
    const t = studio.frames.motion?.data.t;
    return t ? studio.window ?? [t[0], t[t.length - 1]] : [0, 1];
  };
  function step(now) {
    const [low, high] = span();
    const next = studio.cursor + ((now - last) / 1000) * Number(speed.value);
    last = now;
    if (next > high && once) {
      toggle();
      studio.setCursor(low);
      return;
    }
    studio.setCursor(next > high || next < low ? low : next);
    timer = requestAnimationFrame(step);
  }
  // It plays once through as soon as there is something to see, unless motion is not wanted, or until something is done.
  let [opening, once] = [!matchMedia("(prefers-reduced-motion: reduce)").matches, false];
  const HALTS = ["pointerdown", "keydown", "wheel"];
  function begin() {
    opening = false;
    toggle();
    once = true;
  }
  /** Play once through the times that are shown, at a speed that suits them, unless motion is not wanted. */
  function playOnce() {
    suit();
    if (timer) toggle();
    studio.setCursor(span()[0]);
    if (!matchMedia("(prefers-reduced-motion: reduce)").matches) begin();
  }
  function halt(event) {
    // The key and the button of the play itself do that.
    if (event.key === " " || event.target === play) return;
    for (const kind of HALTS) removeEventListener(kind, halt, true);
    opening = false;
    if (once && timer) toggle();
  }
  if (opening) for (const kind of HALTS) addEventListener(kind, halt, { capture: true, passive: true });
  function toggle() {
    once = false;
    if (timer) {
      cancelAnimationFrame(timer);
      timer = 0;
    } else {
      last = performance.now();
      timer = requestAnimationFrame(step);
    }
    play.textContent = timer ? "❚❚" : "▶";
    play.setAttribute("aria-label", timer ? "Pause" : "Play");
  }
  play.addEventListener("click", toggle);
  scrub.addEventListener("input", () => {
    const [low, high] = span();
    studio.setCursor(low + (scrub.value / 1000) * (high - low));
  });

  function paint(pen, width, height) {
    const frame = studio.frames.motion;
    if (!frame) return;
    const c = colours();
    const { backstop, front, platen } = frame.places;
    const mover = moverOf(studio.described);
    const isArmature = mover === "armature";
    const { contacts } = frame;
    const known = [backstop, front, platen, ...contacts.map(({ position }) => position), ...(isArmature ? frame.data.x.subarray(0, 1) : extent(frame.data.x))].filter((place) => place !== null);
    const low = Math.min(...known);
    // Without a platen the pack has no end, unless it is rigid.
    const high = platen === null && front !== null && !studio.described?.rigid_front ? front + 0.6 * (front - low) : Math.max(...known);
    const way = high - low || 1e-4;
    const [left, right] = isArmature ? [0.34 * width, 0.9 * width] : [0.16 * width, 0.8 * width];
    const X = (x) => left + ((x - low) / way) * (right - left);
    // Between the readings above and the ruler below there is room for the platen and its name.
    const [top, bottom] = [20, height - 34];
    const middle = 0.5 * (top + bottom);
    const tall = Math.min(Math.max((0.5 * (bottom - top) - 15) / 1.3, 8), 90);
    const x = displacementAt(frame, studio.cursor);
    const driven = valueAt(frame, frame.data.drive, studio.cursor);
    // What is left of an exponential decay, and a rest position that only rounding moves from 0, are told as nothing.
    const place = Math.abs(x) < 1e-9 * way ? 0 : x;
    const current = Math.abs(driven) < 1e-4 * (frame.peak || 1) ? 0 : driven;
    pen.save();
    pen.font = FONT;
    pen.textAlign = "center";
    if (platen !== null) block(pen, X(platen), middle - 1.3 * tall, 0.06 * width, 2.6 * tall, c.backstop, "platen", c);
    // The displacement of a mass is that of its left face, or of its centre without a backstop.
    const [behind, ahead] = isArmature ? [0, 0] : backstop === null ? [-0.04 * width, 0.04 * width] : [0, 0.08 * width];
    if (front !== null && studio.described?.rigid_front) block(pen, X(front) + ahead, middle - 0.75 * tall, 0.05 * width, 1.5 * tall, c.backstop, packOf(studio.described), c);
    else if (front !== null) {
      const touch = Math.max(x, front);
      const thick = Math.max(X(platen ?? high) - X(front), 3);
      pen.fillStyle = c.pack;
      pen.globalAlpha = 0.35;
      pen.fillRect(X(front), middle - 1.2 * tall, thick, 2.4 * tall);
      pen.globalAlpha = 0.9;
      pen.fillRect(X(touch), middle - 0.2 * tall, Math.max(thick - (X(touch) - X(front)), 1), 0.4 * tall);
      pen.globalAlpha = 1;
      pen.fillStyle = c.muted;
      pen.fillText(packOf(studio.described), X(front) + thick / 2, middle + 1.2 * tall + 13);
    }
    const tip = X(x);
    pen.fillStyle = c.x;
    if (isArmature) {
      // Shank and head of the armature, the face at the displacement.
      pen.fillRect(tip - 0.1 * width, middle - 0.16 * tall, 0.1 * width, 0.32 * tall);
      pen.fillRect(tip - 0.19 * width, middle - 0.6 * tall, 0.09 * width, 1.2 * tall);
    } else if (mover === "ball") {
      const radius = Math.min(0.5 * tall, 0.05 * width);
      pen.beginPath();
      pen.arc(tip + radius, middle, radius, 0, 2 * Math.PI);
      pen.fill();
    } else pen.fillRect(tip + behind, middle - 0.5 * tall, 0.08 * width, tall);
    if (backstop !== null) block(pen, X(backstop) - (isArmature ? 0.26 : 0.05) * width, middle - 0.75 * tall, (isArmature ? 0.07 : 0.05) * width, 1.5 * tall, c.backstop, stopOf(studio.described), c);
    const rows = { front: 0, back: 0 };
    for (const { name, side, position } of contacts) {
      const isFront = side === "front";
      const face = isFront ? ahead : behind;
      const closed = isClosed({ side, position }, x);
      lever(pen, X(position) + face, tip + face, closed, middle, isFront ? -tall : tall, c);
      // A closed lever leans away from its name.
      pen.textAlign = isFront ? "right" : "left";
      pen.fillStyle = closed ? c.accent : c.muted;
      pen.fillText(stateOf(name, closed), X(position) + face + (isFront ? -7 : 7), middle + (isFront ? 8 - 1.2 * tall + 13 * rows.front : 1.2 * tall - 13 * rows.back));
      rows[side] += 1;
    }
    pen.textAlign = "center";
    if (has(studio.described, "magnet")) coil(pen, X(low) - 0.15 * width, middle - 1.1 * tall, 0.1 * width, current, frame, c);
    ruler(pen, X, low, high, height, c);
    pen.fillStyle = c.ink;
    pen.textAlign = "left";
    pen.fillText(`${shown(studio.cursor, "s")}   ${shown(place, "m")}   ${shown(current, frame.quantity === "force" ? "N" : "A", 3)}${voltageAt(frame, studio.cursor, "   ")}`, 8, 14);
    pen.restore();
  }

  function cursor() {
    const [low, high] = span();
    scrub.value = String(Math.round((1000 * (studio.cursor - low)) / (high - low || 1)));
    const frame = studio.frames.motion;
    const states = (frame?.contacts ?? []).map((contact) => stateOf(contact.name, isClosed(contact, displacementAt(frame, studio.cursor))));
    scrub.setAttribute("aria-valuetext", [shown(studio.cursor, "s"), ...states].join(", "));
    area.draw();
  }
  return {
    update: (what) => {
      if (what !== "motion") return;
      if (suited !== studio.described.name) { suited = studio.described.name; suit(); }
      cursor();
      if (opening) begin();
    },
    draw: area.draw, cursor, paint, toggle, playOnce,
    table: () => studio.frames.motion && { "time [s]": studio.frames.motion.data.t, "displacement [m]": studio.frames.motion.data.x },
  };
}

function block(pen, x, y, w, h, colour, name, c) {
  pen.fillStyle = colour;
  pen.fillRect(x, y, w, h);
  pen.fillStyle = c.muted;
  pen.fillText(name, x + w / 2, y + h + 13);
}

const isClosed = ({ side, position }, x) => (side === "front" ? x > position : x < position);
const stateOf = (name, closed) => `${name} ${closed ? "closed" : "open"}`;

/** Draw a contact: a lever that stands at its position, and that a pin on the mover bends when the contact is closed. */
function lever(pen, place, pin, closed, middle, tall, c) {
  const touch = closed ? pin : place;
  pen.lineWidth = 2;
  pen.strokeStyle = c.x;
  line(pen, pin, middle + 0.16 * tall, pin, middle + 0.9 * tall);
  pen.strokeStyle = closed ? c.accent : c.muted;
  pen.fillStyle = closed ? c.accent : c.panel;
  line(pen, place, middle + 1.2 * tall, touch, middle + 0.7 * tall);
  pen.beginPath();
  pen.arc(touch, middle + 0.8 * tall, 3, 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
  pen.lineWidth = 1;
}

function coil(pen, x, y, w, current, frame, c) {
  pen.fillStyle = c.magnet;
  pen.globalAlpha = 0.25 + 0.75 * Math.min(Math.abs(current) / (frame.peak || 1), 1);
  pen.fillRect(x, y, w, 8);
  pen.globalAlpha = 1;
  pen.strokeStyle = c.magnet;
  pen.lineWidth = 1;
  pen.strokeRect(x, y, w, 8);
  pen.fillStyle = c.muted;
  pen.fillText("coil", x + w / 2, y - 4);
}

function ruler(pen, X, low, high, height, c) {
  const unit = unitOf("m");
  const power = 10 ** Math.floor(Math.log10((high - low) * unit.factor));
  const step = ((high - low) * unit.factor) / power < 3 ? power / 2 : power;
  pen.strokeStyle = c.muted;
  pen.fillStyle = c.muted;
  pen.lineWidth = 1;
  line(pen, X(low), height - 18, X(high), height - 18);
  for (let k = Math.ceil((low * unit.factor) / step); k * step <= high * unit.factor * 1.0001; k += 1) {
    const place = X((k * step) / unit.factor);
    line(pen, place, height - 18, place, height - 14);
    pen.fillText(String(Number((k * step).toPrecision(4))), place, height - 3);
  }
  pen.textAlign = "right";
  pen.fillText(unit.name, X(low) - 12, height - 14);
  pen.textAlign = "center";
}
