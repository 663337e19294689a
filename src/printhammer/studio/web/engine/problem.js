// The arguments of the kernel for a state, in the memory of its module; see printhammer/run/problem.py.
import { Refusal } from "./read.js";

const FLIGHTS = { nodes: 2048, contacts: 256, each: 40, most: 1e6 }; // sizes of the first working space
export const STATUS = ["ok", "range left", "runaway", "step limit", "step underflow"];

/** Return the firing times of a state, s. */
export function firingsOf(kernel, { rate, pattern, pulses }) {
  return kernel.temporarily(() => {
    const marks = kernel.copy("i", [...(pattern || "1".repeat(pulses))].map(Number));
    const times = kernel.array("f", marks.shape[0]);
    const [count] = kernel.call("firings", rate, marks, Boolean(pattern), times);
    return Array.from(times.values.subarray(0, count));
  });
}

/** Whether a pulse is the one that the hammer opens with. */
function isOpening(waveform, { opening }) {
  const sorted = (table) => table && JSON.stringify(Object.entries(table).sort());
  return !waveform || sorted(waveform) === sorted(opening);
}

/** Return what the kernel needs for a state: constants, control, bounds, the tables of the pulse, rest and window. */
export function pose(kernel, hammer, state, limits) {
  const numbers = (list) => list.map(Number);
  if (Object.keys(state.constants).length || !isOpening(state.waveform, hammer)) throw new Refusal(limits.changes);
  const constants = kernel.copy("f", numbers(hammer.constants));
  const pieces = kernel.copy("f", hammer.pieces.flat().map(Number), hammer.pieces.length, hammer.pieces[0].length);
  return {
    constants, pieces, control: numbers(hammer.control), bounds: numbers(hammer.bounds), scales: hammer.scales, rest: hammer.rest, wait: hammer.wait,
    replace: state.overlap === "replace" || hammer.replaces, carry: numbers(hammer.carry),
    exact: numbers(hammer.exact), mass: hammer.mass, places: { ...hammer.described.places, thickness: hammer.thickness },
    circuit: hammer.circuit, width: hammer.circuit ? 9 : 5, columns: hammer.circuit ? 15 : 10, pulse: hammer.pulse, peak: hammer.peak,
  };
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
    if (used <= rows && touched <= touches) return { status: STATUS[status], nodes: cut(nodes, used), contacts: cut(contacts, touched), steps, train };
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
