// Hammer files of the user's own: constants in the place of those of a hammer of the page that has the same laws.
import { quantityOf, tomlOf, waveformOf } from "./drive.js";
import { checkFrictions, contactsOf, isTable, Refusal, replaced, valuesOf } from "./read.js";

const PLACES = ["backstop.position", "pack.front", "platen"];
const ENTRY_PLACE = /^(force|contact)\..*\.(position|center)$/;
const SIGNED = ["degC", "rad"]; // units in which a value of either sign has the same control
const SPAN = 10; // of a control about its value, as in printhammer/hammer/names.py
const WORDS = ["name", "title", "note", "strike", "struck", "mover"];
const SECTIONS = ["magnet", "coil", "spring", "pack", "backstop", "damping"];
const LISTS = ["force", "contact"];
const UNREAD = ["uncertainty", "waveform", "format", "length_unit", "time_unit", "views", ...WORDS];
const STATUSES = ["stated", "datasheet", "derived", "reconstructed", "assumed"];

/** Entries of a document by dotted key, without what describes it; refused where two of a list have one name. */
function entriesOf(document, where = "") {
  const found = Object.create(null);
  for (const [key, content] of Object.entries(document)) {
    if (UNREAD.includes(key)) continue;
    if (SECTIONS.includes(key) && isTable(content)) for (const [name, entry] of Object.entries(content)) found[`${key}.${name}`] = entry;
    else if (LISTS.includes(key) && Array.isArray(content)) {
      const names = content.filter(isTable).map((entry) => entry.name);
      const twice = names.find((name, place) => names.indexOf(name) < place);
      if (twice !== undefined) throw new Refusal(`${where}: ${key}.name = ${String(twice).slice(0, 60)}: expected a name of its own`);
      for (const { name: own, ...rest } of content.filter(isTable)) for (const [name, entry] of Object.entries(rest)) found[`${key}.${own}.${name}`] = entry;
    }
    else found[key] = content;
  }
  return found;
}
const isSigned = ({ key, unit }) => PLACES.includes(key) || ENTRY_PLACE.test(key) || SIGNED.includes(unit);
const isQuantity = (entry) => isTable(entry) && "value" in entry;
const bare = (entry) => (isQuantity(entry) ? { value: entry.value, unit: entry.unit } : entry);

/** Why the entries of a file are not those of a hammer of the page; empty where only the values of its controls differ. */
function differenceOf(own, known, controls) {
  const missing = Object.keys(known).find((key) => !(key in own));
  const further = Object.keys(own).find((key) => !(key in known));
  if (missing) return `${missing} is missing`;
  if (further) return `${further.slice(0, 60)} is not known`;
  const isSame = (key) => {
    if (!isQuantity(known[key])) return own[key] === known[key];
    return controls.includes(key) || (isQuantity(own[key]) && own[key].value === known[key].value && own[key].unit === known[key].unit);
  };
  const other = Object.keys(known).find((key) => !isSame(key));
  return other ? `${other} = ${(isQuantity(own[other]) ? `${own[other].value} ${own[other].unit}` : String(own[other])).slice(0, 40)}` : "";
}

/** The range of a control of a position of a force or contact about its value; see printhammer/studio/terms.py. */
function rangeOfEntry(key, value, places, values, limits) {
  const all = [...places, ...Object.keys(values).filter((own) => ENTRY_PLACE.test(own)).map((own) => values[own])];
  const reach = 0.5 * (Math.max(...all) - Math.min(...all)) || Math.abs(value) || limits.SPAN_OF_PLACES;
  const backstop = key.startsWith("contact.") ? values["backstop.position"] : undefined;
  return { low: Math.max(value - reach, backstop ?? -Infinity), high: value + reach, log: false };
}

/** The range of a control about its value. */
function rangeOf(control, value, places, values, limits) {
  const { key, low, high, value: before } = control;
  if (ENTRY_PLACE.test(key)) return rangeOfEntry(key, value, places, values, limits);
  if (control.unit === "rad") return { low: Math.min(-limits.QUARTER_TURN, value), high: Math.max(limits.QUARTER_TURN, value), log: false };
  if (PLACES.includes(key)) {
    const reach = 0.5 * (Math.max(...places) - Math.min(...places)) || 0.5 * (high - low);
    return { low: value - reach, high: value + reach, log: false };
  }
  if (value === 0 || control.unit === "degC") return value === 0 && before !== 0 ? { low: 0, high: Math.abs(before), log: false } : { low, high, log: control.log };
  const [least, most] = [value / SPAN, value * SPAN].sort((a, b) => a - b);
  return { low: least, high: key.endsWith(".restitution") ? Math.min(most, 1) : most, log: least > 0 };
}

/** The controls that move several constants, about the values of a file. */
function combinedOf(combined, values) {
  const [distance, thickness, way] = [values.platen - (values["backstop.position"] ?? 0), values["pack.thickness"], values["pack.front"] - (values["backstop.position"] ?? 0)];
  const ranges = { "platen distance": [distance, distance - 0.8 * way, 1.4 * distance], "forms thickness": [thickness, 0.3 * thickness, thickness + 0.8 * way] };
  return combined.map((control) => {
    const [value, low, high] = ranges[control.key];
    return { ...control, value, low, high };
  });
}

/** The entry of a shelf for the text of a hammer file; refused where no hammer of the page has its laws. */
function entryOf(text, shelf, templates) {
  const where = "dropped file";
  const document = tomlOf(text, where, shelf.limits);
  const beside = Object.keys(document).find((key) => [document[key]].flat().some((entry) => isTable(entry) && "file" in entry));
  if (beside) throw new Refusal(`${where}: ${beside}.file names a table, which does not come with the file: \`printhammer studio FILE\` reads both`);
  const own = entriesOf(document, where);
  let [template, why] = [null, ""];
  for (const { entry, known } of templates) {
    const difference = differenceOf(own, known, entry.described.constants.map((control) => control.key));
    if (!difference) { template = entry; break; }
    // The difference from the hammer with the same law of the magnet and the pack says most.
    if (!why || (known["magnet.law"] === own["magnet.law"] && known["pack.law"] === own["pack.law"])) why = difference;
  }
  if (!template) throw new Refusal(`${where}: ${why}: expected the laws and constants of a hammer of this page; \`printhammer studio FILE\` opens other hammers`);
  const { described, numbers } = template;
  const values = {};
  for (const control of described.constants) {
    if (!(control.key in own)) continue;
    const [value] = quantityOf(bare(own[control.key]), [control.unit], control.key);
    if (!Number.isFinite(value) || (Math.sign(value) !== Math.sign(control.value) && !isSigned(control) && control.value !== 0)) throw new Refusal(`${where}: ${control.key} = ${value} ${control.unit}: expected a number like ${control.value} ${control.unit}; \`printhammer studio FILE\` takes others`);
    values[control.key] = value;
  }
  const places = PLACES.map((key) => values[key]).filter((place) => place !== undefined);
  const constants = described.constants.map((control) => {
    if (!(control.key in values)) return control;
    const { status, source } = isQuantity(own[control.key]) ? own[control.key] : {};
    return { ...control, value: values[control.key], ...rangeOf(control, values[control.key], places, values, shelf.limits), status: STATUSES.includes(status) ? status : "assumed", source: typeof source === "string" ? source.slice(0, 500) : "the dropped file" };
  });
  const words = Object.fromEntries(WORDS.filter((key) => typeof document[key] === "string").map((key) => [key, document[key].slice(0, 2000)]));
  const waveform = document.waveform === undefined ? null : waveformOf(isTable(document.waveform) ? Object.fromEntries(Object.entries(document.waveform).map(([key, entry]) => [key, bare(entry)])) : document.waveform, shelf);
  const place = (key, before) => (before === null ? null : values[key] ?? before);
  // A slow device of the page opens slowly with the pulse of a file, too.
  const { waveform: _own, ...rates } = described.start;
  const made = {
    ...described, name: "dropped file", title: "", note: "", ...words, views: shelf.readers.views(document.views ?? []), constants, combined: combinedOf(described.combined, values), waveform: waveform && shelf.readers.waveform(waveform),
    start: waveform ? rates : described.start.waveform ? described.start : { ...rates, waveform: described.waveform }, places: { backstop: place("backstop.position", described.places.backstop), front: place("pack.front", described.places.front), platen: place("platen", described.places.platen) },
  };
  const value = valuesOf(described, values);
  checkFrictions(described, value);
  made.contacts = contactsOf(described, value);
  const set = (group) => group.with(1, replaced(group, values, value));
  return { ...template, described: made, numbers: Object.fromEntries(Object.entries(numbers).map(([name, pair]) => [name, set(pair)])), text, shipped: false };
}

/** Return a function that adds the hammer of a text to a shelf, under a name that no list shows, and returns this name. */
export function adopter(shelf) {
  const adopted = new Map();
  let templates = null;
  return (text) => {
    templates ??= shelf.names.map((name) => ({ entry: shelf.hammers[name], known: entriesOf(tomlOf(shelf.hammers[name].text, name, shelf.limits)) }));
    if (!adopted.has(text)) {
      const entry = entryOf(text, shelf, templates);
      const name = `dropped hammer ${adopted.size + 1}`;
      shelf.hammers[name] = entry;
      adopted.set(text, name);
    }
    return adopted.get(text);
  };
}
