// States from outside: what the page can send is read, anything else is refused with a sentence.

/** A state that the page itself would never send; the message is the reason. */
export class Refusal extends Error {}

const LONGEST_KEY = 60;
const MOST_CONSTANTS = 64;
const QUANTITIES = ["current", "force", "voltage"];

const short = (value) => String(Number(value.toPrecision(6)));
export const isTable = (content) => typeof content === "object" && content !== null && !Array.isArray(content);

function text(content, where, most) {
  if (typeof content !== "string" || content.length > most) throw new Refusal(`${where} is expected to be a text of at most ${most} characters`);
  return content;
}

function number(content, where, low = -Infinity, high = Infinity) {
  if (typeof content !== "number") throw new Refusal(`${where} is expected to be a number`);
  if (!Number.isFinite(content) || content < low || content > high) throw new Refusal(`${where} is expected to be a finite number from ${short(low)} to ${short(high)}`);
  return content;
}

function choice(content, where, known) {
  if (!known.includes(content)) throw new Refusal(`${where} is expected to be one of ${known.join(", ")}`);
  return content;
}

function table(content, where, known) {
  if (!isTable(content)) throw new Refusal(`${where} is expected to be a table`);
  for (const key of Object.keys(content)) if (!known.includes(key)) throw new Refusal(`${where} has the unknown key '${key.slice(0, 40)}'`);
  return content;
}

/** Return the reader of each entry of a state; `limits` and `shapes` are those that Python embeds. */
export function readersOf(limits, { shapes, decays }) {
  const waveform = (content) => {
    if (content === null) return null;
    if (!isTable(content) || typeof content.shape !== "string" || !Object.hasOwn(shapes, content.shape)) throw new Refusal(`waveform.shape is expected to be one of ${Object.keys(shapes).join(", ")}`);
    const { shape } = content;
    if (shape === "sampled") {
      table(content, "waveform", ["shape", "times", "values", "quantity"]);
      const quantity = choice(content.quantity, "waveform.quantity", QUANTITIES);
      const highest = quantity === "voltage" ? limits.LARGEST_VOLTAGE : limits.LARGEST_CURRENT;
      const samples = (name, most) => {
        const list = content[name];
        if (!Array.isArray(list) || list.length > limits.MOST_SAMPLES) throw new Refusal(`waveform.${name} is expected to be a list of at most ${limits.MOST_SAMPLES} numbers`);
        return list.map((value) => number(value, `waveform.${name}`, -most, most));
      };
      return { shape, times: samples("times", limits.LONGEST_TIME), values: samples("values", highest), quantity };
    }
    const { known, voltages, decays: decaying } = limits.WAVEFORMS[shape];
    table(content, "waveform", known);
    const made = { shape };
    for (const { name, unit, optional } of shapes[shape]) {
      if (!(name in content)) throw new Refusal(`waveform.${name} is missing`);
      if (content[name] === null && optional) { made[name] = null; continue; }
      const si = voltages.includes(name) && content.quantity === "voltage" ? "V" : unit;
      const most = si === "s" ? limits.LONGEST_TIME : limits.LARGEST[si] ?? limits.LARGEST_CURRENT;
      made[name] = number(content[name], `waveform.${name}`, -most, most);
    }
    if (decaying) made.decay = choice(content.decay, "waveform.decay", decays);
    if ("quantity" in content) made.quantity = choice(content.quantity, "waveform.quantity", QUANTITIES);
    return made;
  };
  return {
    hammer: (content) => text(content, "hammer", 100),
    text: (content) => text(content, "text", limits.LARGEST_FILE),
    constants: (content) => {
      if (!isTable(content) || Object.keys(content).length > MOST_CONSTANTS) throw new Refusal(`constants is expected to be a table of at most ${MOST_CONSTANTS} numbers`);
      return Object.fromEntries(Object.entries(content).map(([key, value]) => [text(key, "constants", LONGEST_KEY), number(value, key)]));
    },
    waveform,
    rate: (content) => number(content, "rate", ...limits.RATES),
    pulses: (content) => {
      if (!Number.isInteger(content) || content < 1 || content > limits.MOST_PULSES) throw new Refusal(`pulses is expected to be a whole number from 1 to ${limits.MOST_PULSES}`);
      return content;
    },
    pattern: (content) => {
      text(content, "pattern", limits.MOST_PULSES);
      if (!/^[01]*$/.test(content) || (content && !content.includes("1"))) throw new Refusal("pattern is expected to be of 0 and 1, with at least one 1");
      return content;
    },
    overlap: (content) => choice(content, "overlap", ["add", "replace"]),
    low: (content) => number(content, "low", ...limits.RATES),
    high: (content) => number(content, "high", ...limits.RATES),
    line: (content) => text(content, "line", limits.LONGEST_TEXT),
    views: (content) => {
      if (!Array.isArray(content) || content.length > limits.VIEWS.length) throw new Refusal("views is expected to be a list of views");
      return content.map((view) => choice(view, "views", limits.VIEWS));
    },
  };
}

/** Read a whole state: every entry, no other. */
export function readState(content, readers) {
  table(content, "state", Object.keys(readers));
  for (const key of Object.keys(readers)) if (!(key in content)) throw new Refusal(`state.${key} is missing`);
  return Object.fromEntries(Object.entries(readers).map(([key, read]) => [key, read(content[key])]));
}

/** The constants that a state sets: those that a file leaves open of a coil only where a voltage drives it, then all, without a resistance of its own. */
export function settingsOf({ described, constants, byVoltage }) {
  const left = Object.fromEntries(described.open.map(({ key, value }) => [key, value]));
  if (byVoltage) return { ...("coil.resistance" in left ? left : {}), ...constants };
  return Object.fromEntries(Object.entries(constants).filter(([key]) => !(key in left)));
}

/** The numbers of an array with other values of constants: those that a constant sets, and the sums of products in which one occurs. */
export function replaced([keys, own, sums], values, value) {
  const list = own.map((number, k) => (keys[k] ? values[keys[k]] : undefined) ?? number);
  const product = ([factor, up, down, sines]) => {
    const over = down.reduce((part, key) => part / value(key), up.reduce((part, key) => part * value(key), factor));
    return sines.reduce((part, key) => part * Math.sin(value(key)), over);
  };
  for (const [index, products] of sums) {
    if (products.some(([, ...groups]) => groups.flat().some((key) => key in values))) list[index] = products.reduce((sum, each) => sum + product(each), 0);
  }
  return list;
}

/** Return what gives the value of a constant of a hammer with other values of some. */
export function valuesOf({ constants, open }, values) {
  const own = new Map([...constants, ...open].map(({ key, value }) => [key, value]));
  return (key) => values[key] ?? own.get(key);
}

/** The contacts of a hammer at other values of constants; refused behind the backstop, and at one position on one side. */
export function contactsOf({ contacts }, value) {
  const [placed, backstop] = [[], value("backstop.position") ?? -Infinity];
  for (const contact of contacts) {
    const key = `contact.${contact.name}.position`;
    const position = value(key);
    if (position < backstop) throw new Refusal(`${key} = ${short(position)} m: expected a position not before backstop.position = ${short(backstop)} m`);
    const same = placed.find((other) => other.side === contact.side && other.position === position);
    if (same) throw new Refusal(`${key} = ${short(position)} m: expected another position than that of contact.${same.name}`);
    placed.push({ ...contact, position });
  }
  return placed;
}

/** Check that no static friction is less than the kinetic friction of its entry. */
export function checkFrictions({ frictions }, value) {
  for (const [kinetic, still] of frictions) {
    if (value(still) < value(kinetic)) throw new Refusal(`${still} = ${short(value(still))} N: expected at least ${kinetic} = ${short(value(kinetic))} N`);
  }
}

/** Check that a hammer has a constant, and that a value lies in the range of its control. */
export function checkConstant(described, key, value) {
  const all = [...described.constants, ...described.open];
  const found = all.find((constant) => constant.key === key);
  if (!found) throw new Refusal(`constants.${key.slice(0, 40)} is not known: expected one of ${all.map((constant) => constant.key).join(", ")}`);
  if (value < found.low || value > found.high) throw new Refusal(`${key} = ${short(value)} ${found.unit}: expected ${short(found.low)} to ${short(found.high)}`);
}

const MOST_NOTES = 6;

/** Take of a state from a link or a file what can be taken; return it with a sentence for each thing that cannot. */
export function taken(content, shelf) {
  if (!isTable(content)) return { state: {}, notes: ["a state is expected to be a table"] };
  const { readers, names } = shelf;
  const [state, notes] = [{}, []];
  for (const [key, value] of Object.entries(content)) {
    const known = Object.hasOwn(readers, key);
    try {
      if (!known) throw new Refusal(`'${key.slice(0, 40)}' is not known`);
      const read = readers[key](value);
      if (key !== "constants") state[key] = read;
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      // Constants are taken one by one, below.
      if (key !== "constants" || !isTable(value)) notes.push(`${error.message}; it is ${known ? "left as it was" : "not used"}`);
    }
  }
  const wanted = state.hammer || names[0];
  let named = wanted;
  let why = names.includes(wanted) ? "" : `hammer = '${wanted}': expected one of ${names.join(", ")}`;
  if (state.text) {
    try {
      [named, why] = [shelf.adopt(state.text), ""];
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      why = error.message;
    }
  }
  if (why) {
    notes.push(`${why}; ${names[0]} is shown instead`);
    Object.assign(state, { hammer: names[0], text: "" });
    [named] = names;
  }
  if (isTable(content.constants)) {
    state.constants = {};
    const { described } = shelf.hammers[named];
    const entries = Object.entries(content.constants);
    if (entries.length > MOST_CONSTANTS) notes.push(`${entries.length} constants: expected at most ${MOST_CONSTANTS}; the others are not used`);
    for (const [key, value] of entries.slice(0, MOST_CONSTANTS)) {
      try {
        readers.constants({ [key]: value });
        checkConstant(described, key, value);
        state.constants[key] = value;
      } catch (error) {
        if (!(error instanceof Refusal)) throw error;
        notes.push(`${error.message}; it is left as the hammer has it`);
      }
    }
  }
  const more = notes.length - MOST_NOTES;
  return { state, notes: more <= 1 ? notes : [...notes.slice(0, MOST_NOTES), `and ${more} more like these`] };
}

/** Read a state file that the studio has exported. */
export function readFile(content, name, shelf) {
  let file = null;
  try { file = JSON.parse(content); } catch { /* refused below */ }
  if (!isTable(file) || file.kind !== shelf.stateFile.kind) throw new Refusal(`${name}: expected a state file of the studio, as its export saves it`);
  if (file.format !== shelf.stateFile.format) throw new Refusal(`${name}: format = ${String(file.format).slice(0, 40)}: expected ${shelf.stateFile.format}`);
  return taken(file.state, shelf);
}
