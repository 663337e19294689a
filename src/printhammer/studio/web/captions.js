// What a view tells, in a sentence: read below its title, and by those who do not see the picture.
import { strobeText } from "./planes.js";
import { digits, shown } from "./units.js";
import { large, moverOf, packOf, stopOf } from "./words.js";

const NUMBERS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve"];
const ORDINALS = ["first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth", "eleventh", "twelfth"];

const count = (number, noun, nouns = `${noun}s`) => `${NUMBERS[number] ?? number} ${number === 1 ? noun : nouns}`;
export const ordinal = (number) => ORDINALS[number - 1] ?? `${number}th`;
const listed = (names) => (names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names.at(-1)}`);
const range = (low, high, si) => (digits(low, 3) === digits(high, 3) ? shown(low, si, 3) : `${shown(low, si, 3).replace(/ \S+$/, "")} to ${shown(high, si, 3)}`);

/** Return what the firings of a burst did: "Nine dots, the second lost". */
export function burstText(frame, hasNoPack = false) {
  const lost = frame.dots.map((dot, k) => (dot.struck ? 0 : k + 1)).filter(Boolean);
  const fired = frame.dots.length;
  if (hasNoPack) return large(count(fired, "firing"));
  if (!lost.length) return large(`${count(fired, "dot")}, ${fired === 1 ? "struck" : "none lost"}`);
  if (lost.length === fired) return large(`${count(fired, "firing")}, no dot`);
  const which = lost.length <= 4 ? `the ${listed(lost.map(ordinal))} lost` : `${NUMBERS[lost.length] ?? lost.length} of them lost`;
  return large(`${count(fired, "dot")}, ${which}`);
}

const most = (values) => values.reduce((high, value) => Math.max(high, Math.abs(value)), 0);

/** Return the largest force at the backstop and at the pack, N; none at a rigid stop, which acts without one. */
export function hardest(frame, rigid = false) {
  const [stop, damping, pack] = ["F backstop", "F damping", "F pack"].map((name) => frame.data[name]);
  return { backstop: rigid ? null : most(stop.map((force, k) => force + damping[k])), pack: most(pack) };
}

const SOON = 0.25; // of the flight time of the first dot: a touch sooner after a firing was under way before

/** Return the range of the flight times of dots, and how many touches come too soon to be their own firing's. */
function flightsOf(dots) {
  const all = dots.filter((dot) => dot.struck).map((dot) => dot.flight_time);
  const own = all.filter((time) => time >= SOON * all[0]);
  return { low: Math.min(...own), high: Math.max(...own), soon: all.length - own.length };
}

/** Tell the flight times of dots. */
export function flightText(dots) {
  if (!dots.some((dot) => dot.struck)) return "";
  const { low, high, soon } = flightsOf(dots);
  return `From firing to paper ${range(low, high, "s")}${soon ? `; ${count(soon, "touch", "touches")} too soon after a firing to be its own` : ""}.`;
}

/** Return what packs keep of the work of their dots: its share, or nothing where some were pushed once more. */
function keptText(dots) {
  const struck = dots.filter((dot) => dot.struck && dot.loading_work > 0);
  const again = struck.filter((dot) => dot.net_loss > dot.loading_work).length;
  if (again) return `, up to the first peak; ${again === struck.length ? "each" : NUMBERS[again] ?? again} of them ${again === 1 || again === struck.length ? "is" : "are"} pushed again before leaving, and the pack keeps more`;
  const [work, loss] = ["loading_work", "net_loss"].map((name) => struck.reduce((sum, dot) => sum + dot[name], 0));
  return `, of which it keeps ${Math.round((100 * loss) / work)} %`;
}

/** Tell where the rates of a map lose a dot: nothing of a coarse one, which has not looked. */
function lostText(map, first) {
  if (!map.data.struck || map.front === null) return "";
  const rates = `${map.data.codes.shape[0]} rates of the map`;
  return first ? `Of the ${rates}, ${shown(first.rate, "Hz", 4)} is the lowest with a lost dot: the ${ordinal(first.dot)}. ` : `At none of the ${rates} a dot is lost. `;
}

/** Tell the shape of a single run in the phase plane. */
function loopText({ places: { backstop, front }, data: { x } }) {
  const back = backstop !== null && front !== null && Math.abs(x.at(-1) - backstop) < 0.2 * (front - backstop);
  if (front === null) return backstop === null ? "One loop after one firing." : "From the stop and back, with bounces.";
  if (!x.some((place) => place > front)) return "One loop that does not reach the paper.";
  return back ? "One loop: out to the paper, back to the backstop, bounces." : "Out to the paper, and not back at the end of the run.";
}

const TEXTS = {
  sketch: ({ motion }, studio) => {
    const { backstop, front } = motion.places;
    const mover = moverOf(studio.described);
    if (mover !== "armature") {
      const stops = [...(backstop === null ? [] : [stopOf(studio.described)]), ...(front === null ? [] : [packOf(studio.described)])];
      const met = stops[0] === stops[1] && stops.length ? [`two ${stops[0]}s`] : stops.map((name) => `the ${name}`);
      const named = [`The ${mover}`, ...met];
      return `${named.slice(0, -1).join(", ")}${met.length ? " and " : ""}${named.at(-1)}, to scale along the direction of motion.`;
    }
    const places = [...motion.data["strobe x"]].slice(1);
    if (backstop === null || front === null || !places.length) return "The face of the armature, to scale along its stroke.";
    const away = places.filter((x) => x - backstop > 0.02 * (front - backstop)).length;
    return away ? `At ${count(away, "firing")} of ${NUMBERS[places.length + 1] ?? places.length + 1} the armature is not yet back at the backstop.` : "At every firing the armature is back at the backstop.";
  },
  motion: ({ motion, dots }) => {
    const { fired } = motion;
    if (motion.sine) return `A sinusoidal force: ${fired.length} periods of ${shown(motion.sine, "s", 4)}.`;
    const gap = fired.length > 1 ? `, fired every ${shown(fired[1] - fired[0], "s", 4)}` : "";
    const coil = motion.data.u ? ` The coil takes up to ${shown(motion.peak, "A", 3)} from ${shown(motion.supply, "V", 3)}.` : "";
    if (!dots) return `The displacement against time${gap}.${coil}`;
    const { quality } = dots;
    const flight = quality.struck ? ` ${flightText(dots.dots)}` : "";
    return `${burstText(dots, motion.places.front === null)}${gap}.${flight}${coil}`;
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
    return `${lostText(map, studio.views.map.lost?.()?.first)}The line is at ${shown(studio.store.state.rate, "Hz", 4)}.`;
  },
  forces: ({ motion }, studio) => {
    const { backstop, pack } = hardest(motion, studio.described?.rigid);
    const { places } = motion;
    const stop = places.backstop === null ? [] : [backstop === null ? "a rigid backstop, whose blows take no time and have no force" : `${shown(backstop, "N", 3)} at the backstop`];
    const hard = studio.described?.rigid_front;
    const struck = places.front === null ? [] : [hard ? "a rigid pack, whose blows take no time and have no force" : `${shown(pack, "N", 3)} at the pack`];
    const parts = hard && stop.length && backstop === null ? ["rigid stops, whose blows take no time and have no force"] : [...stop, ...struck];
    return parts.length ? `${large(parts.join(", "))}${backstop > 2 * pack && places.front !== null && !hard ? ": the hardest blow prints nothing" : ""}.` : "Neither stop nor pack: the force of flight.";
  },
  phase: ({ motion }) => (motion.fired.length > 1 ? "Where the states at the firings fall together, the train repeats itself." : loopText(motion)) + (most(motion.data.v) > 0 ? ` Fastest: ${shown(most(motion.data.v), "m/s", 3)}.` : ""),
  strobe: ({ strobe, motion }) => {
    if (!strobe || strobe.reason) return strobe?.reason ?? "";
    const { verdict } = strobe;
    const [what, step] = motion?.sine ? ["motion", "period of the force"] : ["train", "firing"];
    if (!verdict) return strobe.status === "ok" ? `The state at each ${step} of an endless ${what}; the verdict on it follows.` : `An endless ${what} cannot be followed at this rate: ${strobe.status}.`;
    const period = /^period-(\d+)$/.exec(verdict.verdict)?.[1];
    if (period) return period === "1" ? `One point in the end: the ${what} repeats itself with every ${step}.` : `${large(NUMBERS[period] ?? period)} points in the end: the ${what} repeats itself after as many ${step.replace(/^\w+/, "$&s")}.`;
    if (verdict.verdict === "strange") return `The ${what} never repeats itself: what is small grows by a factor of ${digits(Math.exp(verdict.exponent_per_firing), 3)} with each ${step}.`;
    return `Neither a period nor chaos can be told from these ${step.replace(/^\w+/, "$&s")}.`;
  },
  loops: ({ motion }, studio) => {
    const { backstop, pack } = hardest(motion, studio.described?.rigid);
    const { places } = motion;
    const parts = [...(places.front === null ? [] : [`${shown(pack, "N", 3)} at the pack`]), ...(places.backstop === null || backstop === null ? [] : [`${shown(backstop, "N", 3)} at the backstop`])];
    return parts.length ? `What a loop encloses is lost. Up to ${parts.join(", ")}.` : places.backstop === null ? "" : "The backstop is rigid: its blows take no time and have no loop.";
  },
  energy: ({ dots }) => {
    const struck = dots?.dots.filter((dot) => dot.struck && dot.loading_work > 0) ?? [];
    if (!struck.length) return dots ? `${burstText(dots)}.` : "";
    const works = struck.map((dot) => dot.loading_work);
    return `${range(Math.min(...works), Math.max(...works), "J")} into the pack for each dot${keptText(struck)}.`;
  },
};

/** Return what a picture shows, for those who do not see it. */
export function pictureText(name, studio) {
  const { strobe } = studio.frames;
  return `${captionOf(name, studio)}${name === "strobe" && strobe && !strobe.reason ? ` ${large(strobeText(strobe, studio.frames.motion?.sine ? "period" : "firing"))}.` : ""}`;
}

/** Say a sentence of a device with its own noun for what a pulse does, see decision 0027. */
export function worded(text, strike = "dot") {
  if (strike === "dot") return text;
  return text.replace(/\b(d|D)ot(s?)\b/g, (_all, first, plural) => `${first === "D" ? large(strike) : strike}${plural}`).replace(/\bpaper\b/g, "pack").replace("prints nothing", "is not at the pack");
}

/** Say a sentence in the words of a device: for a strike, for what is struck, and for the stop. */
export function said(text, described) {
  return worded(text, described?.strike).replaceAll("backstop", stopOf(described)).replace(/\b(paper|pack)\b/g, (word) => described?.struck || word);
}

/** Return what a view tells of the frames that are there; nothing before there are any. */
export function captionOf(name, studio) {
  const { frames, described } = studio;
  // A number and its unit stay on one line.
  return frames.motion ? said(TEXTS[name](frames, studio), described).replace(/(\d) (?=[%µA-Za-z]{1,3}\b|%)/g, "$1\u00a0") : "";
}
