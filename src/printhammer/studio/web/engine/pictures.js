// Pictures of the single run of a state: its curves, its dots, its energies.
import { endOf, firingsOf, pose, resample, run, slotsOf, unsettledOf } from "./problem.js";

const CURVES = ["x", "v", "drive", "u", "F magnet", "F spring", "F pack", "F backstop", "F damping", "F drag", "F drive", "F total"];
const DOT = ["fired_at", "struck", "flight_time", "impact_speed", "peak_force", "indentation", "contact_time", "loading_work", "net_loss", "extra_contacts"];
const QUALITY = ["struck", "extra", "force_low", "force_high", "flight_low", "flight_high"];
const CONTACT = 14; // columns of a contact
const WORK = 128; // size of the working space of exact sums

const known = (value) => (Number.isFinite(value) ? value : null);
const named = (names, values, at = 0) => Object.fromEntries(names.map((name, k) => [name, known(values[at + k])]));

/** Why a run ended early; nothing where it reached its end. */
function messageOf(name, { status, steps, nodes }) {
  if (status === "ok") return "";
  const [width, values] = [nodes.shape[1], nodes.values];
  const [time, x] = [values.at(-width), values.at(1 - width)];
  const what = { "range left": "left the range in which its force law holds", runaway: "ran away", "step limit": `needed more than ${steps - 1} steps`, "step underflow": "needed steps shorter than the arithmetic resolves" }[status];
  return `${name} ${what} at t = ${Number(time.toPrecision(9))} s, x = ${Number(x.toPrecision(9))} m`;
}

/** The curves of the run of a state, and its dots. */
export function curves(kernel, hammer, state, limits) {
  return kernel.temporarily(() => {
    const posed = pose(kernel, hammer, state, limits);
    const fired = firingsOf(kernel, state);
    const record = run(kernel, posed, fired, endOf(state, posed, fired), limits.MOST_STEPS);
    const frames = [motion(kernel, posed, record, hammer, slotsOf(kernel, state), limits), dots(kernel, posed, record, hammer, limits)];
    return frames;
  });
}

function motion(kernel, posed, record, hammer, fired, limits) {
  const { nodes } = record;
  const reached = nodes.values.at(-posed.width);
  const points = kernel.array("f", limits.POINTS + 3 * nodes.shape[0] + 1);
  const [count] = kernel.call("curve_times", nodes, limits.POINTS, limits.MOST_ENDS, points);
  const t = points.values.slice(0, count);
  const [out, largest] = [kernel.array("s", CURVES.length, count), kernel.array("f", 1)];
  kernel.call("curves", resample(kernel, posed, record, t), hammer.quantity === "force", out, largest);
  const has = { u: hammer.circuit, "F drag": hammer.damped, "F drive": hammer.quantity === "force" };
  const rows = CURVES.map((name, k) => [name, out.values.slice(k * count, (k + 1) * count)]).filter(([name]) => has[name] ?? true);
  const inside = Float64Array.from(fired.filter((time) => time <= reached));
  const table = resample(kernel, posed, record, inside).values;
  const column = (k) => Float32Array.from(inside, (_, row) => table[row * posed.columns + k]);
  const data = { t, ...Object.fromEntries(rows), "strobe t": inside, "strobe x": column(0), "strobe v": column(1) };
  return {
    kind: "motion", status: record.status, message: messageOf(hammer.described.name, record) || unsettledOf(kernel, posed, record, limits, hammer.described.mover), places: posed.places, contacts: posed.touching, quantity: hammer.quantity, peak: largest.values[0],
    fired, steps: record.steps, pulse: posed.pulse, ...(hammer.circuit ? { supply: posed.peak } : {}), ...(posed.sine ? { sine: posed.sine } : {}), data,
  };
}

/** The dots of a run and its energies, from its contacts and what each step did. */
function dots(kernel, posed, record, hammer, limits) {
  const { nodes, contacts, train } = record;
  const [steps, touches, columns] = [nodes.shape[0] - 1, contacts.shape[0], posed.circuit ? 9 : 5];
  const quadratures = (which, from, to, n) => {
    const out = kernel.array("f", n, columns);
    kernel.call("quadratures", which, from, to, nodes, train, posed.constants, out);
    return out;
  };
  const each = [kernel.array("i", steps), kernel.array("f", steps), kernel.array("f", steps)];
  kernel.call("steps", nodes, ...each);
  const increments = quadratures(...each, steps);
  const peaks = kernel.array("f", touches, 3);
  kernel.call("pack_peaks", contacts, nodes, train, posed.constants, peaks);
  const [work, rows] = [kernel.array("f", WORK), kernel.array("f", touches, CONTACT)];
  const [firings] = train;
  kernel.call("contacts", contacts, nodes, peaks, increments, firings, hammer.described.rigid, work, rows);
  const [works, own] = [kernel.array("f", touches), [kernel.array("i", touches), kernel.array("f", touches), kernel.array("f", touches)]];
  kernel.call("loading", rows, nodes, increments, work, works, ...own);
  const table = kernel.array("f", firings.shape[0], DOT.length);
  const [count] = kernel.call("dots", firings, nodes.values.at(-posed.width), rows, works, quadratures(...own, touches), table);
  const quality = kernel.array("f", QUALITY.length);
  kernel.call("quality", table, count, quality);
  const sums = kernel.array("f", columns + 1);
  kernel.call("sums", increments, work, sums);
  const terms = kernel.array("f", limits.ENERGIES.length);
  const ends = resample(kernel, posed, record, Float64Array.of(nodes.values[0], nodes.values.at(-posed.width)));
  kernel.call("energies", nodes, ends, posed.constants, posed.mass, sums, terms);
  const list = Array.from({ length: count }, (_, index) => {
    const row = named(DOT, table.values, index * DOT.length);
    return { index, ...row, struck: row.struck === 1, extra_contacts: row.extra_contacts ?? 0 };
  });
  return { kind: "dots", dots: list, energy: named(limits.ENERGIES, terms.values), quality: { fired: count, ...named(QUALITY, quality.values) }, data: {} };
}
