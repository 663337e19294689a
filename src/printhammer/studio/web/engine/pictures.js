// What a worker computes of a state: curves and dots of its run, pieces of its map.
import { firingsOf, pose, resample, run } from "./problem.js";

const FORCES = ["magnet", "spring", "pack", "backstop", "damping", "drag"]; // columns 3 to 8 of a table of states
const DRIVE = 2; // column of the current or the force of the drive
const [CURRENT, VOLTAGE] = [10, 11]; // columns of a circuit
const [CONTACTS, TIME_IN, SPEED_IN, TIME_OUT, DEPTH, FORCE, WIDTH] = [0, 1, 2, 3, 4, 5, 6]; // columns of a row of dots
const STRETCH = [2048, 256]; // rows of nodes and of contacts of one stretch of a run
const CARRY = 32;
const COLUMNS = 8; // of a state at which a run of many begins

/** Why a run ended early; nothing where it reached its end. */
function messageOf(name, { status, steps, nodes }) {
  if (status === "ok") return "";
  const [width, values] = [nodes.shape[1], nodes.values];
  const [time, x] = [values[values.length - width], values[values.length - width + 1]];
  const what = { "range left": "left the range in which its force law holds", runaway: "ran away", "step limit": `needed more than ${steps - 1} steps`, "step underflow": "needed steps shorter than the arithmetic resolves" }[status];
  return `${name} ${what} at t = ${Number(time.toPrecision(9))} s, x = ${Number(x.toPrecision(9))} m`;
}

/** Times of the points of a curve, s: dense where steps are short; the end of every step is one of them. */
function pointsOf({ nodes }, limits) {
  const [rows, width] = nodes.shape;
  const { values } = nodes;
  const many = Math.min(rows, limits.MOST_ENDS);
  const ends = [];
  for (let k = 0; k < many; k += 1) {
    const end = values[width * Math.floor(many < 2 ? 0 : (k * (rows - 1)) / (many - 1))];
    if (!ends.length || end > ends.at(-1)) ends.push(end);
  }
  const times = [];
  const least = ends.length - 1 < limits.POINTS ? 3 : 1;
  const span = ends.at(-1) - ends[0];
  for (let k = 1; k < ends.length; k += 1) {
    const [from, step] = [ends[k - 1], ends[k] - ends[k - 1]];
    const count = Math.max(Math.ceil((step * limits.POINTS) / span), least);
    for (let part = 0; part < count; part += 1) times.push(from + (part / count) * step);
  }
  times.push(ends.at(-1));
  return Float64Array.from(times);
}

/** The curves of the run of a state, and its dots. */
export function curves(kernel, hammer, state, limits) {
  return kernel.temporarily(() => {
    const posed = pose(kernel, hammer, state, limits);
    const fired = firingsOf(state);
    const end = fired.at(-1) + posed.wait;
    const record = run(kernel, posed, fired, end, limits.MOST_STEPS);
    const reached = record.nodes.values.at(-posed.width);
    const t = pointsOf(record, limits);
    const column = resample(kernel, posed, record, t);
    const data = { t, x: column(0), v: column(1), drive: column(hammer.circuit ? CURRENT : DRIVE), ...(hammer.circuit ? { u: column(VOLTAGE) } : {}) };
    const total = hammer.quantity === "force" ? column(DRIVE) : new Float32Array(t.length);
    if (hammer.quantity === "force") data["F drive"] = total.slice();
    FORCES.forEach((name, k) => {
      const force = column(3 + k);
      force.forEach((each, j) => { total[j] += each; });
      if (name !== "drag" || hammer.damped) data[`F ${name}`] = force;
    });
    data["F total"] = total;
    const strobed = Float64Array.from(fired.filter((time) => time <= reached));
    const at = resample(kernel, posed, record, strobed);
    Object.assign(data, { "strobe t": strobed, "strobe x": at(0), "strobe v": at(1) });
    const peak = data.drive.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    const motion = {
      kind: "motion", status: record.status, message: messageOf(hammer.described.name, record), places: { ...hammer.described.places, thickness: hammer.thickness },
      quantity: hammer.quantity, peak, fired, steps: record.steps, pulse: posed.pulse, ...(hammer.circuit ? { supply: posed.peak } : {}), data,
    };
    return [motion, dots(kernel, posed, fired, end, reached, limits)];
  });
}

/** The dots of a run. */
function dots(kernel, posed, fired, end, reached, limits) {
  const { rows } = many(kernel, posed, [fired], end, new Float64Array(0), true, limits.MOST_STEPS);
  const list = fired.filter((time) => time <= reached).map((fired_at, index) => {
    const row = rows.subarray(index * WIDTH, (index + 1) * WIDTH);
    const struck = row[CONTACTS] > 0;
    const left = row[TIME_OUT] - row[TIME_IN];
    const own = struck
      ? { flight_time: row[TIME_IN] - fired_at, impact_speed: row[SPEED_IN], peak_force: row[FORCE], indentation: row[DEPTH], contact_time: Number.isFinite(left) ? left : null, extra_contacts: row[CONTACTS] - 1 }
      : { flight_time: null, impact_speed: null, peak_force: null, indentation: null, contact_time: null, extra_contacts: 0 };
    return { index, fired_at, struck, ...own, loading_work: null, net_loss: null };
  });
  const struck = list.filter((dot) => dot.struck);
  const ends = (name) => (struck.length ? [Math.min(...struck.map((dot) => dot[name])), Math.max(...struck.map((dot) => dot[name]))] : [null, null]);
  const [[force_low, force_high], [flight_low, flight_high]] = [ends("peak_force"), ends("flight_time")];
  const quality = { fired: list.length, struck: struck.length, extra: list.reduce((sum, dot) => sum + dot.extra_contacts, 0), force_low, force_high, flight_low, flight_high };
  return { kind: "dots", dots: list, energy: null, unknown: limits.energy, quality, data: {} };
}

/** Displacements and dots of runs under several trains of one pulse, from rest to a common end. */
function many(kernel, posed, trains, end, grid, wanted, most) {
  const runs = trains.length;
  const firings = trains.flat();
  const starts = (step) => kernel.copy("i", Array.from({ length: runs + 1 }, (_, k) => k * step));
  const [each] = trains.map((train) => train.length);
  const states = new Float64Array(runs * COLUMNS);
  for (let k = 0; k < runs; k += 1) states.set([0, posed.rest, 0, -1, 0, 0, 0, NaN], k * COLUMNS);
  const batch = {
    hammer_of: kernel.array("i", runs), hammers: { ...posed.constants, shape: [1, posed.constants.shape[0]], letter: "f" },
    controls: kernel.copy("f", posed.control, 1, 4), bounds: kernel.copy("f", posed.bounds, 1, 4), waveform_of: kernel.array("i", runs),
    piece_starts: kernel.copy("i", [0, posed.pieces.shape[0]]), pieces: posed.pieces, rates: kernel.array("f", 1, 3), firing_starts: starts(each),
    firings: kernel.copy("f", firings), begins: kernel.array("i", firings.length), replace: posed.replace, states: kernel.copy("f", states, runs, COLUMNS),
    ends: kernel.copy("f", new Float64Array(runs).fill(end)), max_steps: most,
  };
  const kept = {
    strobe_starts: starts(0), strobe_times: kernel.array("f", 0), grid: kernel.copy("f", grid), want_dots: wanted, status: kernel.array("i", runs), reached: kernel.array("f", runs),
    steps: kernel.array("i", runs), extra: kernel.array("i", runs), dot_starts: starts(wanted ? each : 0), dots: kernel.array("f", wanted ? firings.length : 0, WIDTH),
    strobes: kernel.array("f", 0, posed.columns > 10 ? 7 : 4), x: kernel.array("s", runs, grid.length),
  };
  let [nodes, contacts] = STRETCH;
  for (let done = 0; done < runs;) {
    const which = Array.from({ length: runs - done }, (_, k) => done + k);
    [done] = kernel.temporarily(() => kernel.call(
      "members", kernel.copy("i", which), batch, kept, kernel.array("i", 2, each), kernel.array("f", 2, 3 + 7 * each),
      kernel.array("f", nodes, posed.width), kernel.array("f", contacts, 7), kernel.array("f", CARRY),
    )).map((count) => done + count);
    [nodes, contacts] = [4 * nodes, 4 * contacts];
  }
  return { x: kept.x.values, rows: kept.dots.values, ok: Array.from(kept.status.values, (code) => code === 0n) };
}

/** Some rates of the map of a state: displacements, whether runs ended well, and which dots were struck. */
export function piece(kernel, hammer, state, limits, { rates, columns, wanted }) {
  return kernel.temporarily(() => {
    const posed = pose(kernel, hammer, state, limits);
    const slots = (state.pattern || "1".repeat(state.pulses)).length;
    const end = (slots - 1) / state.low + posed.wait;
    const grid = Float64Array.from({ length: columns }, (_, k) => (k * end) / (columns - 1));
    const { x, rows, ok } = many(kernel, posed, rates.map((rate) => firingsOf(state, rate)), end, grid, wanted, limits.MOST_MAP_STEPS);
    const count = rows.length / WIDTH;
    return { end, x: x.slice(), ok, struck: wanted ? Uint8Array.from({ length: count }, (_, k) => Number(rows[k * WIDTH + CONTACTS] > 0)) : null };
  });
}
