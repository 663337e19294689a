// Names of views and of moving parts, as they suit the device that is shown; and which views apply to it.
import { OPENING, VIEWS } from "./state.js";

const TITLES = { motion: "Motion", sketch: "Actuator", map: "Frequency-time map", forces: "Forces", phase: "Phase plane", strobe: "Strobe", loops: "Loops of force", energy: "Energy per dot", line: "Printed line" };
const SHORT = { ...TITLES, map: "Map", loops: "Loops", energy: "Energy", line: "Line" };

export const large = (text) => text.charAt(0).toUpperCase() + text.slice(1);
const plural = (noun) => (noun === "pull-in" ? "pull-ins" : `${noun}s`);

/** Whether a device prints: what it strikes are dots on paper. */
export const prints = (described) => described.places.front !== null && described.strike === "dot";
/** Whether a device has a law of a part. */
export const has = (described, section) => described.constants.some((constant) => constant.section === section);

/** Return what moves: an armature, or the ball, block or mass of a textbook. */
export const moverOf = (described) => described?.mover ?? "armature";

/** Return what a mover rests on or strikes at the low end of its way. */
export const stopOf = (described) => ({ armature: "backstop", ball: "table", block: "base" })[moverOf(described)] ?? "stop";

/** Return the name of the pack in pictures. */
export const packOf = (described) => described?.struck || "pack";

/** Return the title of a view of a device. */
export function titleOf(name, described, short = false) {
  if (described && name === "sketch" && moverOf(described) !== "armature") return large(moverOf(described));
  if (described && described.strike !== "dot") {
    if (name === "line") return large(plural(described.strike));
    if (name === "energy" && !short) return `Energy per ${described.strike}`;
  }
  return (short ? SHORT : TITLES)[name];
}

/** Return the views that apply to a device, those that its file lists: without a pack, or at a rigid front, nothing is printed; and a rigid stop has no loop. */
export function viewsOf(described) {
  if (!described) return VIEWS;
  const { places: { front, backstop }, rigid, rigid_front: hard, views } = described;
  const lacks = { line: front === null || hard, energy: front === null || hard, loops: (front === null || hard) && (backstop === null || rigid) };
  const possible = (name) => !lacks[name];
  return views?.some(possible) ? views.filter(possible) : VIEWS.filter(possible);
}

/** Return the views with which a device opens: where its file leaves out the map, the first large view of the list takes its place. */
export function openingOf(described) {
  const known = viewsOf(described);
  if (known.includes("map")) return OPENING;
  const large = known.find((name) => !OPENING.includes(name));
  return VIEWS.filter((name) => name === large || (OPENING.includes(name) && known.includes(name)));
}
