// Measured curves from oscilloscopes and spreadsheets: the quantities of the columns of a table.
import { readQuantity } from "../quantity.js";
import { Refusal } from "./read.js";
import { factorOf, isNumber, layoutOf, quantityOfName } from "./table.js";

const COLUMNS = { time: "s", displacement: "m", current: "A", force: "N", voltage: "V" };
const BY_UNIT = { time: "s", current: "A", force: "N" }; // what a unit identifies without a name
const LARGEST = 1e9; // of a measured value, SI
const CAPITALS = ["MA", "MV", "MN"]; // headings in capital letters write these for mA, mV and mN
const PLAIN_AMOUNT = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?\s*[a-z\u00b5\u03bc][^\d+=,*()-]*$/i; // a number and a unit, as the command line reads them
const BEFORE = 0.1; // of the peak, that a drive may have before time 0

/** The quantity of each column by its name, or by a unit that occurs once. */
function quantitiesOf({ headings, clock }) {
  const found = headings.map(({ name, unit }, k) => (k === clock?.numbers ? "" : quantityOfName(name, unit)));
  for (const [what, si] of Object.entries(BY_UNIT)) {
    const same = headings.flatMap(({ unit }, k) => (!found[k] && unit && factorOf(unit, si) !== null ? [k] : []));
    if (!found.includes(what) && same.length === 1) found[same[0]] = what;
  }
  return found;
}

/** The numbers of a column in SI; `unit` may be what the number 1 stands for, such as "10 A", or a scale per volt, such as "10 A/V". */
function valuesOf({ where, headings, rows }, place, what, unit) {
  const si = COLUMNS[what];
  const volts = /\/\s*V$/.test(unit) ? factorOf(headings[place].unit || "V", "V") : null;
  const per = volts === null ? si : `${si}/V`;
  const amount = /^[-+]?(\d|\.\d)/.test(unit) ? readQuantity(unit, per, { factor: 1, name: per }) : null;
  const factor = amount ? (amount.value ?? NaN) * (volts ?? 1) : factorOf(unit, si);
  if (CAPITALS.includes(unit)) throw new Refusal(`${where}: ${what}: ${unit} may be ${unit.replace("M", "m")} in capital letters: expected ${unit.replace("M", "m")} or 1 ${unit}`);
  if (factor === null || !Number.isFinite(factor)) throw new Refusal(`${where}: ${what}: '${unit.slice(0, 40)}': expected a unit such as ${si}, or what 1 stands for`);
  return Float64Array.from(rows, ({ line, cells }) => {
    const cell = cells[place] ?? "";
    const value = cell && isNumber(cell) ? Number(cell) * factor : NaN;
    if (!Number.isFinite(value)) throw new Refusal(`${where}: line ${line}, column '${what}': '${cell.slice(0, 40)}' is no finite number`);
    if (Math.abs(value) > LARGEST) throw new Refusal(`${where}: line ${line}, column '${what}': ${cell}: expected a measured value of at most ${LARGEST} ${si}`);
    return value;
  });
}

/** The TOML file beside a table that declares the answered columns for the command line (printhammer/support/tables/columns.py). */
function declarationOf({ headings }, told) {
  const lines = told.flatMap(([what, unit], k) => {
    if (!what) return [];
    const own = headings[k].unit;
    if (own && unit === own) return [`${what} = "${k + 1}"`];
    const per = /\/\s*V$/.test(unit) ? `${COLUMNS[what]}/V` : COLUMNS[what];
    const amount = factorOf(unit, per) === null ? unit : `1 ${unit}`;
    const factor = PLAIN_AMOUNT.test(amount) ? amount : `${readQuantity(amount, per, { factor: 1, name: per }).value} ${per}`;
    // An answer without "/V" is stated for the number in the table, whatever the unit of its heading.
    return [`${what} = ${JSON.stringify(`${k + 1}*${factor}${own && !per.endsWith("/V") ? `/${own}` : ""}`)}`];
  });
  return `[columns]\n${lines.join("\n")}\n`;
}

/** Whether the heading leaves open what a column holds: an unknown name, no unit, no times or no curve. */
function isOpen({ headings, clock }, found) {
  const nameless = headings.every(({ name }) => !name);
  const isUnknown = ({ name, unit }, k) => !found[k] && k !== clock?.numbers && (name || unit || nameless);
  return found.some((what, k) => what && (!headings[k].unit || CAPITALS.includes(headings[k].unit))) || headings.some(isUnknown) || !(clock || found.includes("time")) || !found.some((what) => what && what !== "time");
}

/** Read a table: its curves over a common time, or its columns where the page has to ask what they hold. */
export function recordOf(text, where, told, limits) {
  const table = layoutOf(text, where);
  const { headings, rows, clock } = table;
  let found = quantitiesOf(table);
  let units = headings.map(({ unit }) => unit);
  if (told) {
    if (told.length !== headings.length) throw new Refusal(`${where}: ${headings.length} columns: expected as many answers, not ${told.length}`);
    [found, units] = [told.map(([what]) => what), told.map(([, unit]) => unit)];
  } else if (isOpen(table, found)) {
    const columns = headings.map((heading, k) => ({ ...heading, quantity: found[k], first: rows.slice(0, 3).map(({ cells }) => cells[k] ?? "") }));
    return { what: "columns", name: where, columns, clock, quantities: COLUMNS, data: {} };
  }
  for (const what of Object.keys(COLUMNS)) if (found.filter((each) => each === what).length > 1) throw new Refusal(`${where}: several columns of ${what}: expected one`);
  const read = Object.fromEntries(found.flatMap((what, k) => (what ? [[what, valuesOf(table, k, what, units[k])]] : [])));
  const { time = clock && Float64Array.from(rows, ({ sample }) => clock.start + clock.step * sample), ...curves } = read;
  if (!time) throw new Refusal(`${where}: expected a column of time, or a line such as 't0 = -1 ms, dt = 2 us' above the numbers`);
  if (!Object.keys(curves).length) throw new Refusal(`${where}: expected a column of displacement, current, force or voltage`);
  if (time.length < 2) throw new Refusal(`${where}: ${time.length} samples: expected at least 2`);
  const back = time.findIndex((value, k) => k && value <= time[k - 1]);
  if (back > 0) throw new Refusal(`${where}: line ${rows[back].line}: time ${time[back]} s after ${time[back - 1]} s: expected ascending times`);
  for (const what of ["current", "force", "voltage"].filter((each) => each in curves)) check(what, time, curves[what], where, limits);
  const most = Math.min(time.length, limits.MOST_SAMPLES);
  const kept = [...new Set(Array.from({ length: most }, (_each, k) => Math.floor((k * (time.length - 1)) / Math.max(most - 1, 1))))];
  const thin = (values) => Float64Array.from(kept, (k) => values[k]);
  return { what: "curves", name: where, ...(told ? { beside: declarationOf(table, told) } : {}), data: { t: thin(time), ...Object.fromEntries(Object.entries(curves).map(([what, values]) => [what, thin(values)])) } };
}

/** Check that a drive can be fired: it begins at time 0, ends soon enough and is no larger than a page sets. */
function check(what, time, values, where, limits) {
  const size = values.map(Math.abs);
  const peak = size.reduce((best, value) => Math.max(best, value), 0);
  const early = size.reduce((best, value, k) => (time[k] < 0 ? Math.max(best, value) : best), 0);
  const [unit, largest] = [COLUMNS[what], what === "voltage" ? limits.LARGEST_VOLTAGE : limits.LARGEST_CURRENT];
  if (time.at(-1) < 0 || early > BEFORE * peak) throw new Refusal(`${where}: a ${what} of ${early.toPrecision(4)} ${unit} before time 0: expected the firing at time 0`);
  if (time.at(-1) > limits.LONGEST_TIME) throw new Refusal(`${where}: a ${what} of ${time.at(-1)} s: expected at most ${limits.LONGEST_TIME} s`);
  if (peak > largest) throw new Refusal(`${where}: a ${what} of ${peak.toPrecision(6)} ${unit}: expected at most ${largest} ${unit}`);
}
