// The drive of a state as a drive file, and a drive file as a state; see printhammer/drive/file.py.
import { readQuantity } from "../quantity.js";
import { parseToml } from "../vendor/toml.js";
import { isTable, Refusal } from "./read.js";

const DRIVEN = { current: "A", force: "N", voltage: "V" };
const TIMING = { train: ["rate", "period", "pulses", "start"], times: ["at", "start"] };
const SINE = ["amplitude", "frequency", "phase"];
const OTHER = ["burst", "sequence"]; // kinds of a drive that a state does not hold
const CLOSE = 1e-9; // of a slot, within which a firing lies on it
// One number and one unit, as in printhammer/units.py: without the arithmetic that may be typed in the page.
const AMOUNT = String.raw`[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?`;
const FACTOR = String.raw`(?:[A-Za-z\u00b5\u03bc%\u00b0]+|1)(?:\s*\^\s*(?:[-+]?\d{1,2}(?:\.\d{1,4})?|\(\s*[-+]?\d{1,2}(?:\/[1-9]\d?)?\s*\)))?`;
const QUANTITY = new RegExp(String.raw`^\s*(${AMOUNT})(?![\d.])\s*(${FACTOR}(?:(?:\s*[*/]\s*|\s+)${FACTOR})*)?\s*$`);
const ANGLE = new RegExp(String.raw`^\s*(${AMOUNT})\s*(rad|deg|\u00b0)\s*$`);
const LONGEST_QUANTITY = 200; // characters of a quantity

const float = (number) => {
  const text = String(number + 0);
  return /[.e]/.test(text) ? text.replace(/^([^.]*)e/, "$1.0e") : `${text}.0`;
};
const quantityText = (value, unit) => `{ value = ${float(value)}, unit = "${unit}" }`;
const columnText = (values, unit) => `{ values = [${values.map(float).join(", ")}], unit = "${unit}" }`;

/** Parse a text as TOML; the reason why not is a refusal. */
export function tomlOf(text, where, { MOST_DOTS }) {
  // Keys of very many dots take very long.
  if (text.split(/[\n,=[\]{}]/).some((part) => part.split(".").length - 1 > MOST_DOTS)) throw new Refusal(`${where}: expected a TOML file, without keys of more than ${MOST_DOTS} dots`);
  try {
    return parseToml(text);
  } catch (error) {
    throw new Refusal(`${where}: expected a TOML file (${String(error.message).split("\n")[0].slice(0, 200)})`);
  }
}

/** The drive of a state as the text of a drive file. */
export function driveText(state, shelf) {
  const wave = state.waveform ?? shelf.hammers[state.hammer].described.waveform;
  if (wave.shape === "sine") return `format = 1\n\n[sine]\namplitude = ${quantityText(wave.amplitude, "N")}\nfrequency = ${quantityText(state.rate, "Hz")}\nphase = ${quantityText(wave.phase, "rad")}\n`;
  const isDriver = shelf.vocabulary.drivers.includes(wave.shape);
  const lines = ["format = 1", `overlap = "${isDriver ? "replace" : state.overlap}"`, ""];
  if (state.pattern) {
    const times = [...state.pattern].flatMap((mark, slot) => (mark === "1" ? [slot / state.rate] : []));
    lines.push("[times]", `at = ${columnText(times, "s")}`);
  } else lines.push("[train]", `rate = ${quantityText(state.rate, "Hz")}`, `pulses = ${state.pulses}`, `start = ${quantityText(0, "s")}`);
  lines.push("", "[waveform]", `shape = "${wave.shape}"`);
  if (wave.shape === "sampled") lines.push('interpolation = "pchip"', `time = ${columnText(wave.times, "s")}`, `${wave.quantity} = ${columnText(wave.values, DRIVEN[wave.quantity])}`);
  else {
    if (isDriver) lines.push(`decay = "${wave.decay}"`);
    const { voltages } = shelf.limits.WAVEFORMS[wave.shape];
    for (const { name, unit } of shelf.vocabulary.shapes[wave.shape]) {
      if (wave[name] !== null && wave[name] !== undefined) lines.push(`${name} = ${quantityText(wave[name], voltages.includes(name) ? DRIVEN[wave.quantity] : unit)}`);
    }
  }
  return `${lines.join("\n")}\n`;
}

/** A quantity of a file: a text with its unit, or a table of value and unit. Returns [number in SI, its unit]. */
export function quantityOf(content, units, where) {
  const isPair = isTable(content) && Object.keys(content).every((key) => ["value", "unit"].includes(key));
  let text = content;
  if (isPair && typeof content.unit === "string" && ["number", "bigint"].includes(typeof content.value)) text = `${content.value}${content.unit === "1" ? "" : ` ${content.unit}`}`;
  const plain = units[0] === "1" && ["number", "bigint"].includes(typeof content);
  if (plain) text = String(content);
  if (typeof text !== "string") throw new Refusal(`${where} has no unit: expected a text such as '1 ${units[0]}'`);
  const [, number, unit = ""] = (text.length <= LONGEST_QUANTITY && QUANTITY.exec(text.replace(/[\u00b7\u22c5]/g, "*"))) || [];
  if (number === undefined) throw new Refusal(`${where} = '${text.slice(0, 40)}': expected one number with a decimal point and a unit, such as '1 ${units[0]}'`);
  // A slash divides by the next factor only.
  const written = `${number}${unit.startsWith("1") ? "*" : " "}${unit.replace(/(?<![*/^(\s])\s+(?![*/^)\s])/g, "*")}`;
  let why = "";
  for (const si of units) {
    const read = readQuantity(written, si, { factor: 1, name: si });
    if (read.problem === undefined && (si === "1" || /[^\d\s*/^().]/.test(unit))) return [read.value, si];
    why = read.problem ?? "it has no unit";
  }
  throw new Refusal(`${where} = '${text.slice(0, 40)}': ${why}, expected a quantity in ${units.join(" or ")}`);
}

function columnOf(content, units, where) {
  if (Array.isArray(content)) return content.map((each) => quantityOf(each, units, where)[0]);
  if (!isTable(content) || !Array.isArray(content.values)) throw new Refusal(`${where}: expected a list, or values with a unit`);
  return content.values.map((value) => quantityOf({ value, unit: content.unit }, units, where)[0]);
}

const onlyOf = (table, keys, where) => {
  for (const key of Object.keys(table)) if (!keys.includes(key)) throw new Refusal(`${where ? `${where}.` : ""}${key.slice(0, 40)} is not known: expected one of ${keys.join(", ")}`);
  return table;
};

/** An angle of a file, rad. */
function angleOf(content) {
  const text = isTable(content) ? `${content.value} ${content.unit}` : String(content);
  const found = ANGLE.exec(text.slice(0, LONGEST_QUANTITY));
  if (!found) throw new Refusal(`sine.phase = '${text.slice(0, 40)}': expected an angle in rad or deg`);
  return Number(found[1]) * (found[2] === "rad" ? 1 : Math.PI / 180);
}

/** Whether a TOML document is that of a drive, not of a hammer. */
export const isDrive = (document) => [...Object.keys(TIMING), "sine", ...OTHER].some((kind) => kind in document);

/** The changes of a state that make its drive that of a file. */
export function driveOf(document, shelf, where) {
  const kinds = [...Object.keys(TIMING), "sine", ...OTHER].filter((kind) => kind in document);
  if (kinds.length > 1) throw new Refusal(`${where}: [${kinds.join("] and [")}]: expected one of them`);
  if (OTHER.includes(kinds[0])) throw new Refusal(`${where}: a drive of the kind [${kinds[0]}] is run by \`printhammer run\`; expected [train], [times] or [sine]`);
  onlyOf(document, ["format", "overlap", "waveform", kinds[0]], "");
  if (Number(document.format) !== 1) throw new Refusal(`${where}: format = ${String(document.format).slice(0, 40)}: expected 1`);
  const [kind] = kinds;
  if (kind === "sine") {
    onlyOf(document, ["format", "overlap", "sine"], "");
    const { amplitude, frequency, phase = "0 rad" } = onlyOf(isTable(document.sine) ? document.sine : {}, SINE, "sine");
    const patch = {
      pattern: "", rate: quantityOf(frequency, ["Hz"], "sine.frequency")[0],
      waveform: { shape: "sine", amplitude: quantityOf(amplitude, ["N"], "sine.amplitude")[0], phase: angleOf(phase), quantity: "force" },
    };
    for (const key of Object.keys(patch)) patch[key] = shelf.readers[key](patch[key]);
    return patch;
  }
  const table = onlyOf(isTable(document[kind]) ? document[kind] : {}, TIMING[kind], kind);
  const patch = { pattern: "", overlap: document.overlap ?? "add", waveform: document.waveform === undefined ? null : waveformOf(document.waveform, shelf) };
  if (table.start !== undefined && quantityOf(table.start, ["s"], `${kind}.start`)[0] !== 0) throw new Refusal(`${where}: ${kind}.start: expected 0 s`);
  if (kind === "train") {
    if (("rate" in table) === ("period" in table)) throw new Refusal(`${where}: train: expected a rate or a period`);
    patch.rate = "rate" in table ? quantityOf(table.rate, ["Hz"], "train.rate")[0] : 1 / quantityOf(table.period, ["s"], "train.period")[0];
    patch.pulses = Number(table.pulses ?? 1);
  } else {
    const times = columnOf(table.at, ["s"], "times.at");
    const gaps = times.slice(1).map((time, k) => time - times[k]);
    const step = gaps.length ? Math.min(...gaps) : 1e-3;
    const slots = times.map((time) => Math.round(time / step));
    const most = shelf.limits.MOST_PULSES;
    if (!(step > 0) || times[0] < 0 || slots.some((slot, k) => slot >= most || Math.abs(times[k] / step - slot) > CLOSE * Math.max(slot, 1))) throw new Refusal(`${where}: times.at: expected multiples of their smallest distance, at most ${most} slots`);
    patch.rate = 1 / step;
    patch.pattern = Array.from({ length: slots.at(-1) + 1 }, (_each, slot) => (slots.includes(slot) ? "1" : "0")).join("");
  }
  // What a page could not have set is refused as in a link.
  for (const key of Object.keys(patch)) patch[key] = shelf.readers[key](patch[key]);
  return patch;
}

/** The pulse of a file as that of a state. */
export function waveformOf(table, shelf) {
  const { shapes, drivers } = shelf.vocabulary;
  if (!isTable(table) || typeof table.shape !== "string" || !Object.hasOwn(shapes, table.shape)) throw new Refusal(`waveform.shape: expected one of ${Object.keys(shapes).join(", ")}`);
  const { shape } = table;
  if (shape === "sampled") {
    onlyOf(table, ["shape", "interpolation", "time", ...Object.keys(DRIVEN)], "waveform");
    const driven = Object.keys(DRIVEN).filter((name) => name in table);
    if (!("time" in table) || driven.length !== 1) throw new Refusal("waveform: expected time and one of current, force and voltage");
    if ((table.interpolation ?? "pchip") !== "pchip") throw new Refusal("waveform.interpolation: expected 'pchip' in a page");
    const [quantity] = driven;
    return { shape, times: columnOf(table.time, ["s"], "waveform.time"), values: columnOf(table[quantity], [DRIVEN[quantity]], `waveform.${quantity}`), quantity };
  }
  const { WAVEFORMS: { [shape]: { voltages } }, DECAYS } = shelf.limits;
  const isDriver = drivers.includes(shape);
  onlyOf(table, ["shape", ...shapes[shape].map(({ name }) => name), ...(isDriver ? ["decay"] : [])], "waveform");
  const made = { shape, ...(isDriver ? { decay: table.decay ?? DECAYS[0] } : {}), quantity: isDriver ? "voltage" : "current" };
  for (const { name, unit, start, optional } of shapes[shape]) {
    if (!(name in table)) {
      if (!optional && start === null) throw new Refusal(`waveform.${name} is missing`);
      made[name] = start;
      continue;
    }
    const units = voltages.includes(name) ? [unit, ...Object.values(DRIVEN).filter((other) => other !== unit)] : [unit];
    const [value, si] = quantityOf(table[name], units, `waveform.${name}`);
    made[name] = value;
    if (voltages.includes(name)) made.quantity = Object.keys(DRIVEN).find((each) => DRIVEN[each] === si);
  }
  return made;
}
