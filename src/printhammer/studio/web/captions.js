// What a view tells, in a sentence: read below its title, and by those who do not see the picture.
import { strobeText } from "./planes.js";
import { digits, shown } from "./units.js";

const NUMBERS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"];
const ORDINALS = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth", "eleventh", "twelfth"];

const count = (number, noun) => `${NUMBERS[number] ?? number} ${noun}${number === 1 ? "" : "s"}`;
export const ordinal = (number) => ORDINALS[number - 1] ?? `${number}th`;
const listed = (names) => (names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names.at(-1)}`);
const large = (text) => text.charAt(0).toUpperCase() + text.slice(1);
const range = (low, high, si) => (digits(low, 3) === digits(high, 3) ? shown(low, si, 3) : `${shown(low, si, 3).replace(/ \S+$/, "")} to ${shown(high, si, 3)}`);

/** Return what the firings of a burst did: "Nine dots, the second lost". */
export function burstText(frame) {
  const lost = frame.dots.map((dot, k) => (dot.struck ? 0 : k + 1)).filter(Boolean);
  const fired = frame.dots.length;
  if (!lost.length) return large(`${count(fired, "dot")}, ${fired === 1 ? "struck" : "none lost"}`);
  if (lost.length === fired) return large(`${count(fired, "firing")}, no dot`);
  const which = lost.length <= 4 ? `the ${listed(lost.map(ordinal))} lost` : `${NUMBERS[lost.length] ?? lost.length} of them lost`;
  return large(`${count(fired, "dot")}, ${which}`);
}

const most = (values) => values.reduce((high, value) => Math.max(high, Math.abs(value)), 0);

/** Return the largest force at the backstop and at the pack, N. */
export function hardest(frame) {
  const [stop, damping, pack] = ["F backstop", "F damping", "F pack"].map((name) => frame.data[name]);
  return { backstop: most(stop.map((force, k) => force + damping[k])), pack: most(pack) };
}

const TEXTS = {
  sketch: ({ motion }) => {
    const { backstop, front } = motion.places;
    const places = [...motion.data["strobe x"]].slice(1);
    if (backstop === null || front === null || !places.length) return "The face of the armature, to scale along its stroke.";
    const away = places.filter((x) => x - backstop > 0.02 * (front - backstop)).length;
    return away ? `At ${count(away, "firing")} of ${NUMBERS[places.length + 1] ?? places.length + 1} the armature is not yet back at the backstop.` : "At every firing the armature is back at the backstop.";
  },
  motion: ({ motion, dots }) => {
    const { fired } = motion;
    const gap = fired.length > 1 ? `, fired every ${shown(fired[1] - fired[0], "s", 4)}` : "";
    const coil = motion.data.u ? ` The coil takes up to ${shown(motion.peak, "A", 3)} from ${shown(motion.supply, "V", 3)}.` : "";
    if (!dots) return `The face of the armature against time${gap}.${coil}`;
    const { quality } = dots;
    const flight = quality.struck ? ` From firing to paper ${range(quality.flight_low, quality.flight_high, "s")}.` : "";
    return `${burstText(dots)}${gap}.${flight}${coil}`;
  },
  line: ({ dots, line }, studio) => {
    if (!dots) return "";
    const { quality } = dots;
    const force = quality.struck ? `: ${range(quality.force_low, quality.force_high, "N")}` : "";
    const text = studio.store.state.line.trim() && line && !line.reason ? ` Of the text ${line.good} of ${line.wanted} dots are within limits.` : "";
    return `${burstText(dots)}${force}.${text}`;
  },
  map: ({ map }, studio) => {
    if (!map || map.reason) return map?.reason ?? "";
    const { lost } = studio.views.map;
    const first = lost?.()?.first;
    const said = first ? `In this range the ${ordinal(first.dot)} dot is lost first, from about ${shown(first.rate, "Hz", 3)}.` : "In this range no dot is lost.";
    return `${said} The line is at ${shown(studio.store.state.rate, "Hz", 4)}.`;
  },
  forces: ({ motion }) => {
    const { backstop, pack } = hardest(motion);
    return `${shown(backstop, "N", 3)} at the backstop, ${shown(pack, "N", 3)} at the pack${backstop > 2 * pack ? ": the hardest blow prints nothing" : ""}.`;
  },
  phase: ({ motion }) => (motion.fired.length > 1 ? "Where the states at the firings fall together, the train repeats itself." : "One loop: out to the paper, back to the backstop, bounces.") + (most(motion.data.v) > 0 ? ` Fastest: ${shown(most(motion.data.v), "m/s", 3)}.` : ""),
  strobe: ({ strobe }) => {
    if (!strobe || strobe.reason) return strobe?.reason ?? "";
    const { verdict } = strobe;
    if (!verdict) return strobe.status === "ok" ? "The state at each firing of an endless train; the verdict on it follows." : `An endless train cannot be followed at this rate: ${strobe.status}.`;
    const period = /^period-(\d+)$/.exec(verdict.verdict)?.[1];
    if (period) return period === "1" ? "One point in the end: the train repeats itself with every firing." : `${large(NUMBERS[period] ?? period)} points in the end: the train repeats itself after as many firings.`;
    if (verdict.verdict === "strange") return `The train never repeats itself: what is small grows by a factor of ${digits(Math.exp(verdict.exponent_per_firing), 3)} with each firing.`;
    return "Neither a period nor chaos can be told from these firings.";
  },
  loops: ({ motion }) => {
    const { backstop, pack } = hardest(motion);
    return `What a loop encloses is lost. Up to ${shown(pack, "N", 3)} at the pack, ${shown(backstop, "N", 3)} at the backstop.`;
  },
  energy: ({ dots }) => {
    const struck = dots?.dots.filter((dot) => dot.struck && dot.loading_work > 0) ?? [];
    if (!struck.length) return dots ? `${burstText(dots)}.` : "";
    const works = struck.map((dot) => dot.loading_work);
    const kept = struck.reduce((sum, dot) => sum + dot.net_loss, 0) / works.reduce((sum, work) => sum + work, 0);
    return `${range(Math.min(...works), Math.max(...works), "J")} into the pack for each dot, of which it keeps ${Math.round(100 * kept)} %.`;
  },
};

/** Return what a picture shows, for those who do not see it. */
export function pictureText(name, studio) {
  const { strobe } = studio.frames;
  return `${captionOf(name, studio)}${name === "strobe" && strobe && !strobe.reason ? ` ${large(strobeText(strobe))}.` : ""}`;
}

/** Return what a view tells of the frames that are there; nothing before there are any. */
export function captionOf(name, studio) {
  const { frames } = studio;
  // A number and its unit stay on one line.
  return frames.motion ? TEXTS[name](frames, studio).replace(/(\d) (?=[%µA-Za-z]{1,3}\b|%)/g, "$1\u00a0") : "";
}
