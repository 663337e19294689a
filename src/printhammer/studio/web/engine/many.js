// Many runs of a state: pieces of its map, its printed line.
import { isSine, pose, pulseOf } from "./problem.js";

const ROW = 6; // columns of a row of dots
const STATE = 8; // columns of a state at which a run begins
const STRETCH = [2048, 256]; // rows of nodes and of contacts of one stretch of a run
const CARRY = 32; // size of the state of a run

/** Return where the rows of runs begin, and after the last one where they end. */
export function startsOf(kernel, counts) {
  const starts = kernel.array("i", counts.length + 1);
  counts.reduce((at, count, k) => (starts.values[k + 1] = at + BigInt(count)), 0n);
  return starts;
}

/** Integrate runs from rest with `counts` firings each, to their ends; `room` is that for dots of each. Return what is kept of them. */
export function many(kernel, posed, firings, counts, ends, { grid = [], strobes = [], room = null, most, control = posed.control, waves = null }) {
  const runs = counts.length;
  const starts = (step) => startsOf(kernel, counts.map(() => step));
  const each = Math.max(...counts);
  const rows = room ?? counts.map(() => 0);
  const states = new Float64Array(runs * STATE);
  for (let k = 0; k < runs; k += 1) states.set([0, posed.rest, 0, -1, 0, 0, 0, NaN], k * STATE);
  const batch = {
    hammer_of: kernel.array("i", runs), hammers: { letter: "f", at: posed.constants.at, shape: [1, posed.constants.shape[0]] },
    controls: kernel.copy("f", control, 1, 4), bounds: kernel.copy("f", posed.bounds, 1, 4), waveform_of: kernel.copy("i", waves ? counts.map((_count, k) => k) : counts.map(() => 0)),
    piece_starts: kernel.copy("i", waves ? waves.starts : [0, posed.pieces.shape[0]]), pieces: waves?.pieces ?? posed.pieces, rates: kernel.array("f", waves ? runs : 1, 3), firing_starts: startsOf(kernel, counts),
    firings, begins: kernel.array("i", firings.shape[0]), replace: posed.replace, states: kernel.copy("f", states, runs, STATE),
    ends: kernel.copy("f", ends), max_steps: most,
  };
  const kept = {
    strobe_starts: starts(strobes.length / runs), strobe_times: kernel.copy("f", strobes), grid: kernel.copy("f", grid), want_dots: room !== null, status: kernel.array("i", runs),
    reached: kernel.array("f", runs), steps: kernel.array("i", runs), extra: kernel.array("i", runs), dot_starts: startsOf(kernel, rows),
    dots: kernel.array("f", rows.reduce((sum, count) => sum + count, 0), ROW), strobes: kernel.array("f", strobes.length, posed.circuit ? 7 : 4), x: kernel.array("s", runs, grid.length),
  };
  let [nodes, contacts] = STRETCH;
  for (let done = 0; done < runs;) {
    const which = Array.from({ length: runs - done }, (_, k) => done + k);
    const space = () => [kernel.array("i", 2, each), kernel.array("f", 2, 3 + 7 * each), kernel.array("f", nodes, posed.width), kernel.array("f", contacts, 7), kernel.array("f", CARRY)];
    [done] = kernel.temporarily(() => kernel.call("members", kernel.copy("i", which), batch, kept, ...space())).map((count) => done + count);
    [nodes, contacts] = [4 * nodes, 4 * contacts];
  }
  return kept;
}

/** The segment tables of a continuous force at several rates, one after the other. */
function wavesOf(kernel, hammer, state, limits, rates) {
  const tables = rates.map((rate) => {
    const { pieces } = pulseOf(kernel, hammer, { ...state, rate }, limits);
    return { rows: pieces.shape[0], values: pieces.values.slice() };
  });
  const starts = [0];
  for (const { rows } of tables) starts.push(starts.at(-1) + rows);
  const pieces = kernel.array("f", starts.at(-1), 6);
  tables.forEach(({ values }, k) => pieces.values.set(values, 6 * starts[k]));
  return { starts, pieces };
}

/** Some rates of the map of a state: displacements, whether runs ended well, and which dots were struck. */
export function piece(kernel, hammer, state, limits, { rates, columns, wanted }) {
  return kernel.temporarily(() => {
    const posed = pose(kernel, hammer, state, limits);
    const slots = state.pattern || "1".repeat(state.pulses);
    // A continuous force begins once, at 0; it differs from rate to rate, and strikes no dots.
    const fired = isSine(state) ? [0] : [...slots].flatMap((mark, k) => (mark === "1" ? [k] : []));
    const end = isSine(state) ? slots.length / state.low : (slots.length - 1) / state.low + posed.wait;
    const grid = kernel.array("f", columns);
    kernel.call("map_rates", 0, end, grid);
    const [starts, firings] = [kernel.array("i", rates.length + 1), kernel.array("f", rates.length * fired.length)];
    kernel.call("map_trains", kernel.copy("f", rates), kernel.copy("i", fired), Boolean(state.pattern), starts, firings);
    const counts = rates.map(() => fired.length);
    const waves = isSine(state) ? wavesOf(kernel, hammer, state, limits, rates) : null;
    const isStruck = wanted && !waves;
    const kinds = { grid: grid.values.slice(), room: isStruck ? counts : null, most: limits.MOST_MAP_STEPS, waves };
    const kept = many(kernel, posed, firings, counts, rates.map(() => end), kinds);
    const struck = isStruck ? kernel.array("i", firings.shape[0]) : null;
    if (struck) kernel.call("map_struck", kept.dots, kept.dot_starts, fired.length, struck);
    return { end, places: posed.places, x: kept.x.values.slice(), ok: Array.from(kept.status.values, (code) => code === 0n), struck: struck && Uint8Array.from(struck.values, Number) };
  });
}

/** The displacements of a map as integers for colours, from its lowest place to its highest. */
export function codes(kernel, { x, rows, columns, places }) {
  return kernel.temporarily(() => {
    const table = kernel.copy("s", x, rows, columns);
    const ends = kernel.copy("f", [Infinity, -Infinity]);
    kernel.call("map_range", table, ends);
    const found = Array.from(ends.values, (end) => (Number.isFinite(end) ? end : 0));
    const low = places.backstop ?? found[0];
    const high = Math.max(places.platen ?? found[1], nextFloat(low));
    const out = kernel.array("i", Math.ceil((rows * columns) / 4));
    kernel.call("map_codes", table, low, high, out);
    return { low, high, data: { codes: new Uint16Array(kernel.memory.buffer, out.at, rows * columns).slice() } };
  });
}

/** The next larger number of single precision. */
function nextFloat(value) {
  const [float, bits] = [Float32Array.of(value), new Uint32Array(1)];
  new Float32Array(bits.buffer)[0] = float[0];
  bits[0] += float[0] >= 0 ? 1 : -1;
  return new Float32Array(bits.buffer)[0] || 1e-45;
}
