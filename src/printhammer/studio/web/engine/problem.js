// The arguments of the kernel for a state, in the memory of its module; see printhammer/run/problem.py.
import { checkFrictions, contactsOf, Refusal, replaced, settingsOf, valuesOf } from "./read.js";

const FLIGHTS = { nodes: 2048, contacts: 256, each: 40, most: 1e6 }; // sizes of the first working space
export const STATUS = ["ok", "range left", "runaway", "step limit", "step underflow"];
const ARRAYS = ["body", "damping", "spring", "pack", "backstop", "coil", "magnet"];
const KINDS = ["current", "force", "voltage"];
const ABOUT = { count: 14, support: 0, largest: 2, replaces: 3, shown: 13 }; // numbers about a pulse
const [PIECES, PIECE] = [8, 6]; // rows and columns of the table of a pulse
const [GRID, POINTS] = [8192, 24576]; // working space of the search for the rest position
const SHOWN = 160; // points of the picture of a pulse
const CURRENT_SCALE = 78; // index of the typical current among the constants
const SINGLE = 500000; // steps of the single pulse that decides on the window of a run

/** Whether a state has a continuous sinusoidal force, whose frequency is the rate; each period counts as a firing. */
export const isSine = ({ waveform }) => waveform?.shape === "sine";

/** Return the times at which the pulses of a state begin, s: those of the firings, or the start of a continuous force. */
export const firingsOf = (kernel, state) => (isSine(state) ? [0] : slotsOf(kernel, state));

/** Return the end of the run of a state, s: the time of the last firing and the window of the device, or whole periods. */
export const endOf = (state, posed, times) => (isSine(state) ? (state.pattern.length || state.pulses) / state.rate : times.at(-1) + posed.wait);

/** Return the times of the firings of a state, s; of a continuous force, those at which its periods begin. */
export function slotsOf(kernel, { rate, pattern, pulses }) {
  return kernel.temporarily(() => {
    const marks = kernel.copy("i", [...(pattern || "1".repeat(pulses))].map(Number));
    const times = kernel.array("f", marks.shape[0]);
    const [count] = kernel.call("firings", rate, marks, Boolean(pattern), times);
    return Array.from(times.values.subarray(0, count));
  });
}

/** Refuse with the sentence of an outcome other than 0, and the numbers that belong to it. */
function check(code, entry, out, limits) {
  if (!code) return;
  const [what, expected] = limits.REFUSALS[entry][code] ?? [`${entry}: ${code}`, null];
  const filled = (text) => text.replace(/\{(\d)(?::[^}]*)?\}/g, (_all, k) => String(Number(out.values[k].toPrecision(6))));
  throw new Refusal(expected ? `${filled(what)}: expected ${filled(expected)}` : filled(what));
}

/** The arrays of numbers of a hammer by name, with the constants of a state. */
function numbersOf({ numbers, described }, taken) {
  const value = valuesOf(described, taken);
  return Object.fromEntries(Object.entries(numbers).map(([name, group]) => [name, replaced(group, taken, value).map(Number)]));
}

/** The places of a hammer, m; null where there is none. */
function placesOf({ body: [, position, front], limits: [, , platen, thickness] }) {
  const places = [position, front, platen].filter((place) => !Number.isNaN(place));
  if (places.some((place, k) => k && place <= places[k - 1])) throw new Refusal("the places are not in order: expected the backstop before the pack, and the pack before the platen");
  const known = (place) => (Number.isNaN(place) ? null : place);
  return { backstop: known(position), front: known(front), platen: known(platen), thickness: known(thickness) };
}

/** The times and the values of a record, one after the other. */
function recordOf({ times, values }) {
  const what = "sampled waveform";
  if (times.length !== values.length) throw new Refusal(`${what}: ${times.length} times and ${values.length} values: expected one value for each time`);
  if (times.length < 2) throw new Refusal(`${what}: ${times.length} samples: expected at least 2`);
  if (times[0] < 0) throw new Refusal(`${what}: first time ${times[0]} s: expected 0 or later (the firing is at 0)`);
  const bad = times.findIndex((time, k) => k && time <= times[k - 1]);
  if (bad > 0) throw new Refusal(`${what}: ${times[bad]} s (sample ${bad + 1}) follows ${times[bad - 1]} s: expected strictly increasing times`);
  return [...times, ...values];
}

/** The segment table of the pulse of a state, and the numbers about it. */
export function pulseOf(kernel, hammer, state, limits) {
  const wave = state.waveform ?? hammer.described.waveform;
  if (wave.quantity !== hammer.quantity) throw new Refusal(limits.kinds);
  const { fields, decays } = limits.WAVEFORMS[wave.shape];
  const numbers = wave.shape === "sampled" ? recordOf(wave) : wave.shape === "sine" ? [wave.amplitude, state.rate, wave.phase] : fields.map((name) => wave[name] ?? NaN);
  if (decays) numbers.push(limits.DECAYS.indexOf(wave.decay));
  const [pieces, about] = [kernel.array("f", Math.max(PIECES, numbers.length / 2 + 1), PIECE), kernel.array("f", ABOUT.count)];
  const [rows] = kernel.call("pulse", Object.keys(limits.WAVEFORMS).indexOf(wave.shape), kernel.copy("f", numbers), pieces, about);
  if (rows < 1) throw new Refusal(`the constants of the ${wave.shape} pulse do not make one`);
  if (wave.shape === "sine") about.values[ABOUT.shown] = 2 / state.rate;
  return { pieces: cut(pieces, rows), about };
}

/** Return what the kernel needs for a state: constants, control, bounds, the tables of the pulse, rest and window. */
export function pose(kernel, hammer, state, limits) {
  const key = JSON.stringify([state.hammer, state.constants, state.waveform, isSine(state) ? state.rate : null]);
  if (latest.key !== key) latest = { key, device: kernel.temporarily(() => kept(prepare(kernel, hammer, state, limits))) };
  const { constants, pieces, ends, about, rest, wait, ...device } = latest.device;
  const posed = {
    ...device, rest, wait, constants: kernel.copy("f", constants), pieces: kernel.copy("f", pieces, pieces.length / PIECE, PIECE),
    replace: state.overlap === "replace" || about[ABOUT.replaces] !== 0, carry: hammer.carry.map(Number).with(hammer.placeOfRest, rest),
  };
  const scaled = scalesOf(kernel, hammer, { ...posed, ends: kernel.copy("f", ends) });
  Object.assign(posed, scaled(state.pattern ? NaN : 1 / state.rate, limits.DISPLAY_TOLERANCE));
  posed.sine = isSine(state) ? 1 / state.rate : 0; // period of a continuous force, s
  posed.controlAt = (tolerance) => [...posed.scales, ...scaled(NaN, tolerance).control.slice(2)];
  posed.exact = posed.controlAt(limits.TOLERANCE);
  posed.atOrigin = () => scaled(1 / state.rate, limits.TOLERANCE, posed.places.backstop ?? 0).scales;
  posed.currentScale = posed.constants.values[CURRENT_SCALE];
  // How many earlier pulses still act at a firing of an endless train.
  posed.memory = isSine(state) ? 0 : state.overlap === "replace" ? 1 : Math.ceil(about[ABOUT.support] * state.rate) + 1;
  return posed;
}

let latest = { key: null }; // what was prepared last: many works in a row have the same device

/** The numbers of a device and its pulse that do not depend on the train, with arrays in the memory of the module. */
function prepare(kernel, hammer, state, limits) {
  const { described, circuit } = hammer;
  const taken = settingsOf({ described, constants: state.constants, byVoltage: circuit });
  const numbers = numbersOf(hammer, taken);
  const places = placesOf(numbers);
  const value = valuesOf(described, taken);
  checkFrictions(described, value);
  const touching = contactsOf(described, value);
  const [mass] = numbers.body;
  const [constants, domain] = [kernel.array("f", hammer.size), kernel.array("f", 2)];
  kernel.call("constants", ...ARRAYS.map((name) => kernel.copy("f", numbers[name])), constants, domain);
  const [low, high] = domain.values;
  for (const [key, place] of [["backstop.position", places.backstop], ["pack.front", places.front]]) {
    if (place !== null && !(place >= low && place <= high)) throw new Refusal(`${key} = ${place} m: expected a position where the magnet's law holds, ${low} to ${high} m`);
  }
  const { pieces, about } = pulseOf(kernel, hammer, state, limits);
  const ends = kernel.copy("f", [...domain.values, ...numbers.limits.slice(2)]);
  const found = kernel.array("f", 4);
  if (circuit) check(...kernel.call("supply", constants, ends, about, found), "supply", found, limits);
  const device = {
    constants, pieces, ends, about, mass, places, touching, peak: about.values[ABOUT.largest],
    circuit, width: circuit ? 9 : 5, columns: circuit ? 15 : 10,
  };
  device.rest = restOf(kernel, hammer, constants, ends, limits);
  const carry = hammer.carry.map(Number).with(hammer.placeOfRest, device.rest);
  const alone = { ...device, carry, replace: about.values[ABOUT.replaces] !== 0 };
  const scaled = scalesOf(kernel, hammer, device)(NaN, limits.DISPLAY_TOLERANCE);
  Object.assign(device, isSine(state) ? { wait: 1 / state.rate, flight: NaN } : runWindowOf(kernel, { ...alone, ...scaled }, about, limits));
  const [times, values] = [kernel.array("f", SHOWN), kernel.array("f", SHOWN)];
  kernel.call("map_rates", 0, about.values[ABOUT.shown], times);
  kernel.call("pulse_values", pieces, times, values);
  device.pulse = { t: [...times.values], value: [...values.values] };
  return device;
}

/** The same with copies of its arrays, outside the memory of the module. */
function kept(device) {
  const { constants, pieces, ends, about } = device;
  const copies = Object.entries({ constants, pieces, ends, about }).map(([name, array]) => [name, array.values.slice()]);
  return { ...device, ...Object.fromEntries(copies) };
}

/** Return a function of the period of a train, s, a tolerance and a start, m, which gives the control and the bounds of a run. */
function scalesOf(kernel, hammer, { constants, ends, peak, rest }) {
  return (period, tolerance, start = rest) => {
    const out = kernel.array("f", 8);
    kernel.call("scales", constants, ends, KINDS.indexOf(hammer.quantity), peak, period, kernel.copy("f", [start, 0]), tolerance, out);
    const list = [...out.values];
    return { control: list.slice(0, 4), bounds: list.slice(4), scales: list.slice(0, 2) };
  };
}

/** The rest position, m. */
function restOf(kernel, hammer, constants, ends, limits) {
  const out = kernel.array("f", 2);
  kernel.temporarily(() => {
    const work = [kernel.array("f", GRID), kernel.array("f", 2, POINTS), kernel.array("f", POINTS, 3)];
    check(...kernel.call("rest", constants, ends, ...work, out), "rest", out, limits);
  });
  return out.values[0];
}

/** Whether the armature rests clear of a pack, to which a pulse can throw it. */
const hasFlight = ({ places, rest }) => places.front !== null && rest < places.front;

/** The front of the pack, or the position at the reach of a pulse if there is no flight, m; see printhammer/run/window.py. */
function frontOf(posed, nodes, limits) {
  if (hasFlight(posed)) return posed.places.front;
  let reach = limits.WINDOW.least_reach * posed.scales[0];
  for (let at = 1; at < nodes.values.length; at += posed.width) reach = Math.max(reach, Math.abs(nodes.values[at] - posed.rest));
  return posed.rest + reach;
}

/** Whether a mode lies between the first and the last of a pair. */
const isWithin = (mode, [first, last]) => first <= mode && mode <= last;

/** Whether the armature stands still at all steps of a record that end after a time, s. */
function isStill({ width }, { values }, after) {
  for (let at = 0; at < values.length; at += width) if (values[at] >= after && values[at + 2] !== 0) return false;
  return true;
}

/** The window of a device: the time from the last firing to the end of a run, s, in which a single pulse comes to rest; and its flight time, s. */
function runWindowOf(kernel, posed, about, limits) {
  return kernel.temporarily(() => {
    const out = kernel.array("f", 1);
    const flies = hasFlight(posed);
    const [asked] = kernel.call("window", about, posed.rest, flies ? posed.places.front : Infinity, out);
    const [least] = out.values;
    if (!asked) return { wait: least, flight: NaN };
    for (let wait = least; ; wait *= 2) {
      const { code, contacts, nodes } = run(kernel, posed, [0], wait, SINGLE);
      const places = kernel.copy("f", [posed.rest, frontOf(posed, nodes, limits), ...posed.scales, least]);
      const [enough] = kernel.call("is_window", code, flies ? contacts : cut(contacts, 0), nodes, places, wait, out);
      if (enough || (!flies && isStill(posed, nodes, wait / 2))) return { wait, flight: out.values[0] };
    }
  });
}

/** Describe a mover, such as the armature, that is not at rest at the end of a run in one sentence; empty if at rest. */
export function unsettledOf(kernel, posed, { code, contacts, nodes }, limits, mover) {
  const { rest, width, wait, flight, scales } = posed;
  const { values } = nodes;
  if (code || posed.sine || (values.length > width && isWithin(values.at(3 - 2 * width), limits.WINDOW.held))) return "";
  const [x, v] = [values.at(1 - width), values.at(2 - width)];
  return kernel.temporarily(() => {
    const places = kernel.copy("f", [rest, frontOf(posed, nodes, limits), ...scales, Infinity]);
    const span = Number.isNaN(flight) ? wait : limits.WINDOW.flights * flight;
    const [settled] = kernel.call("is_window", code, cut(contacts, 0), nodes, places, span, kernel.array("f", 1));
    const [far, fast] = [x - rest, v].map((number) => Number(number.toPrecision(4)));
    return settled ? "" : `the ${mover} is not at rest at the end of the run: ${far} m from its rest position, at ${fast} m/s`;
  });
}

/** Lay out a train as the kernel takes it, with its working space. */
export function trainOf(kernel, posed, firings) {
  const n = firings.length;
  return [kernel.copy("f", firings), kernel.array("i", n), posed.pieces, posed.replace, kernel.array("i", n), kernel.array("f", 3 + 7 * n)];
}

/** Integrate from rest to a time, s; return the record, in the memory of the module, and its train. */
export function run(kernel, posed, firings, end, most) {
  const train = trainOf(kernel, posed, firings);
  const flights = Math.min((end * posed.scales[1]) / posed.scales[0], FLIGHTS.most);
  let [rows, touches] = [Math.min(FLIGHTS.nodes + Math.floor(FLIGHTS.each * flights), most + 2), FLIGHTS.contacts + Math.floor(flights)];
  for (;;) {
    const { top } = kernel;
    const [nodes, contacts] = [kernel.array("f", rows, posed.width), kernel.array("f", touches, 7)];
    const carry = kernel.copy("f", posed.carry);
    const [status, used, touched, steps] = kernel.call("run", [train, posed.constants, posed.control, posed.bounds, most], end, nodes, contacts, carry);
    if (used <= rows && touched <= touches) return { status: STATUS[status], code: status, nodes: cut(nodes, used), contacts: cut(contacts, touched), steps, train };
    kernel.top = top;
    [rows, touches] = [Math.max(rows, used), Math.max(touches, touched)];
  }
}

/** An array of the module with only its first rows. */
const cut = (array, rows) => ({ letter: array.letter, at: array.at, shape: [rows, ...array.shape.slice(1)], get values() { return array.values.subarray(0, rows * (array.shape[1] ?? 1)); } });

/** Return states and forces of a record at ascending times, s, as a table in the memory of the module. */
export function resample(kernel, posed, { nodes, train }, times) {
  const out = kernel.array("f", times.length, posed.columns);
  kernel.call("resample", kernel.copy("f", times), nodes, train, posed.constants, out);
  return out;
}
