// Measured curves from oscilloscopes and spreadsheets, by the rules of printhammer/support/tables: what cannot be read surely is refused.
import { readQuantity } from "../quantity.js";
import { Refusal } from "./read.js";

const COLUMNS = { time: "s", displacement: "m", current: "A", force: "N", voltage: "V" };
const ALIASES = {
  time: ["time", "t", "x-axis", "sec", "second", "seconds", "zeit", "temps"], displacement: ["displacement", "position", "x", "weg"],
  current: ["current", "i", "strom"], force: ["force", "f", "kraft"], voltage: ["voltage", "u", "spannung", "tension"],
};
const BY_UNIT = { time: "s", current: "A", force: "N" }; // what a unit identifies without a name
const WORDS = { second: "s", seconds: "s", sec: "s", volt: "V", volts: "V", ampere: "A", amperes: "A", amp: "A", amps: "A", newton: "N", newtons: "N", metre: "m", metres: "m", meter: "m", meters: "m" };
const SEPARATORS = "\t;|, ";
const SEEN = 2000; // lines by which the separator is found
const MOST_COLUMNS = 16;
const FIRST = 100; // lines that are always read
const LARGEST = 1e9; // of a measured value, SI
const BEFORE = 0.1; // of the peak, that a drive may have before time 0
const GAPS = ["", "nan", "-nan", "na", "n/a", "#n/a", "null", "none"];
const OVER = ["inf", "-inf", "+inf", "infinity", "-infinity"];
const COMMENT = /^\s*(#|\/\/|[%;]\s*[\p{L}][^;]*$)/u;
const NUMBER = /^[+-]?(\d+(?:\.\d*)?|\.\d+|\d*,\d+|\d{1,3}([.,'\u2019\u00a0\u202f]\d{3})+([.,]\d*)?)([eE][+-]?\d+)?$/;
const GROUPED = { ".": /^[+-]?[1-9]\d{0,2}(\.\d{3})+(,\d*)?$/, ",": /^[+-]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?$/ };

const isNumber = (cell) => NUMBER.test(cell);
const isReading = (cell) => isNumber(cell) || GAPS.includes(cell.toLowerCase()) || OVER.includes(cell.toLowerCase());

/** The factor of a unit to the SI unit, or null where it is none of its dimension. */
function factorOf(unit, si) {
  const word = WORDS[unit.toLowerCase()] ?? unit;
  if (!/^[A-Za-z\u00b5\u03bc%]+$/.test(word)) return null;
  const read = readQuantity(`1 ${word}`, si, { factor: 1, name: si });
  return read.problem === undefined ? read.value : null;
}
const isUnit = (text) => Object.values(COLUMNS).some((si) => factorOf(text, si) !== null);

/** The name and the unit of a heading such as "time [us]", "time (us)" or "t/us". */
function headingOf(cell) {
  const bare = cell.replace(/^"|"$/g, "").trim().replace(/\s+/g, " ");
  const bracket = /^(.*?)\s*(?:\[([^[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\})$/.exec(bare);
  if (bracket) {
    const [, name, square, ...others] = bracket;
    if (square !== undefined) return { name, unit: square.trim() };
    const unit = others.find((each) => each !== undefined).trim();
    if (isUnit(unit)) return { name, unit };
  }
  const beside = /^(.*?)(?:\s+in\s+|\s*\/\s*|\s*,\s*|_)([^\s,/_]+)$/.exec(bare);
  if (beside && beside[1] && isUnit(beside[2])) return { name: beside[1], unit: beside[2] };
  return { name: bare, unit: "" };
}
const quantityOfName = (name) => Object.keys(ALIASES).find((what) => ALIASES[what].includes(name.toLowerCase())) ?? "";

/** The cells of a line; a space stands for any white space. */
function cellsOf(line, separator) {
  if (separator === " ") return line.trim().replace(/\s+(?=[[(])/g, "").split(/\s+/);
  const cells = [];
  const cell = new RegExp(`\\s*(?:"((?:[^"]|"")*)"\\s*|([^${separator}]*))(${separator}|$)`, "y");
  for (let at = 0; at <= line.length;) {
    cell.lastIndex = at;
    const found = cell.exec(line);
    if (!found) return null;
    cells.push((found[1]?.replace(/""/g, '"') ?? found[2]).trim());
    if (!found[3]) break;
    at = cell.lastIndex;
  }
  return cells;
}

function separatorOf(lines) {
  const seen = lines.slice(0, SEEN).filter((line) => line.trim() && line.trim()[0] !== "#");
  let [best, chosen] = [0, ""];
  for (const sign of SEPARATORS) {
    const count = seen.filter((line) => {
      const cells = (sign === " " ? line.trim().split(/\s+/) : line.split(sign)).map((cell) => cell.replace(/^[ \t"]+|[ \t"]+$/g, ""));
      return cells.length > 1 && cells.every(isReading) && cells.some(isNumber);
    }).length;
    if (count > best) [best, chosen] = [count, sign];
  }
  return chosen || [..."\t;|"].find((sign) => 2 * seen.filter((line) => line.includes(sign)).length > seen.length) || ",";
}

const widest = (rows) => rows.reduce((most, { cells }) => Math.max(most, cells.length), 0);

/** Refuse a column such as 999, 1.000, 1.001, whose points may be those of thousands. */
function grouping(rows, unclear) {
  for (let k = 0; k < widest(rows); k += 1) {
    const column = rows.filter(({ cells }) => k < cells.length).map(({ line, cells }) => ({ line, cell: cells[k] }));
    const points = column.filter(({ cell }) => cell.includes("."));
    const whole = column.some(({ cell }) => /^\d+$/.test(cell) && cell !== "0");
    if (points.length && whole && points.some(({ cell }) => cell.endsWith("0")) && points.every(({ cell }) => GROUPED["."].test(cell))) unclear(points[0]);
  }
}

/** The numbers of rows with decimal points and without signs between thousands. */
function pointed(rows, separator, where) {
  const marked = rows.flatMap(({ line, cells }) => cells.filter((cell) => /[.,]/.test(cell) && isNumber(cell)).map((cell) => ({ line, cell })));
  const sure = (mark) => marked.find(({ cell }) => cell.includes(mark) && !GROUPED[mark].test(cell));
  const unclear = ({ line, cell }) => { throw new Refusal(`${where}: line ${line}: the mark in '${cell}' may be a decimal mark or a thousands separator: expected the same decimal mark in all numbers`); };
  const [comma, point] = [sure(","), sure(".")];
  if (comma && point) unclear(comma);
  const grouped = marked.find(({ cell }) => cell.includes(","));
  if (!comma && grouped && !point) unclear(grouped);
  if (!grouped && separator !== ",") grouping(rows, unclear);
  const plain = (cell) => (isNumber(cell) ? (comma ? cell.replace(/[.'\u2019\u00a0\u202f]/g, "").replace(",", ".") : cell.replace(/[,'\u2019\u00a0\u202f]/g, "")) : cell);
  return rows.map(({ line, cells }) => ({ line, cells: cells.map(plain) }));
}

/** The table of a text: headings, rows of cells with their lines. */
function layoutOf(text, where) {
  const lines = text.replace(/^\ufeff/, "").replace(/\r\r?\n|\n\r|\r/g, "\n").split("\n");
  const separator = separatorOf(lines);
  const rows = [];
  lines.forEach((line, k) => {
    if (!line.trim() || COMMENT.test(line)) return;
    const cells = cellsOf(line, separator);
    if (!cells) throw new Refusal(`${where}: line ${k + 1}: expected comma-separated values`);
    while (cells.length && !cells.at(-1)) cells.pop();
    if (cells.length) rows.push({ line: k + 1, cells });
  });
  const begin = rows.findIndex(({ cells }) => cells.some(isNumber) && cells.every(isReading));
  if (begin < 0) throw new Refusal(`${where}: expected columns of numbers below a heading such as 'time [us],current [A]'`);
  const [above, data] = [rows.slice(0, begin), rows.slice(begin)];
  const width = widest(data);
  const isUnits = (cells) => cells.some((cell) => isUnit(cell.replace(/^[([{]|[)\]}]$/g, ""))) && cells.every((cell) => !cell || isUnit(cell.replace(/^[([{]|[)\]}]$/g, "")));
  const last = above.at(-1)?.cells ?? [];
  const narrow = (count) => { if (count > MOST_COLUMNS) throw new Refusal(`${where}: ${count} columns: expected at most ${MOST_COLUMNS}`); };
  narrow(Math.max(width, last.length));
  const unitRow = above.length > 1 && isUnits(last) ? last.map((cell) => cell.replace(/^[([{]|[)\]}]$/g, "")) : null;
  const names = (unitRow ? above.at(-2).cells : last);
  narrow(names.length);
  const longer = data.find(({ cells }) => above.length && cells.length > names.length);
  if (longer) throw new Refusal(`${where}: line ${longer.line} has ${longer.cells.length} cells: expected ${names.length}`);
  for (const { line, cells } of data) {
    if (cells.length > width || !cells.every(isReading)) throw new Refusal(`${where}: line ${line}: '${cells.join(",").slice(0, 60)}': expected ${width} numbers`);
  }
  const headings = Array.from({ length: Math.max(width, above.length ? names.length : 0) }, (_each, k) => {
    const { name, unit } = headingOf(names[k] ?? "");
    return { name, unit: unitRow?.[k] || unit };
  });
  // A unit alone, such as "sec", is the name too.
  for (const heading of headings) if (!heading.unit && factorOf(heading.name, "s") !== null && heading.name.length > 1) Object.assign(heading, { unit: "s" });
  return { where, headings, rows: pointed(data, separator, where) };
}

/** The quantity of each column by its name, or by a unit that occurs once. */
function quantitiesOf({ headings }) {
  const found = headings.map(({ name }) => (name.toLowerCase() in COLUMNS ? name.toLowerCase() : quantityOfName(name)));
  for (const [what, si] of Object.entries(BY_UNIT)) {
    const same = headings.flatMap(({ unit }, k) => (!found[k] && unit && factorOf(unit, si) !== null ? [k] : []));
    if (!found.includes(what) && same.length === 1) found[same[0]] = what;
  }
  return found;
}

/** The numbers of a column in SI; `unit` may be what the number 1 stands for, such as "10 A". */
function valuesOf({ where, rows }, place, what, unit) {
  const si = COLUMNS[what];
  const amount = /^[-+]?(\d|\.\d)/.test(unit) ? readQuantity(unit, si, { factor: 1, name: si }) : null;
  const factor = amount ? amount.value ?? null : factorOf(unit, si);
  if (factor === null) throw new Refusal(`${where}: ${what}: '${unit.slice(0, 40)}': expected a unit such as ${si}, or what 1 stands for`);
  return Float64Array.from(rows, ({ line, cells }) => {
    const cell = cells[place] ?? "";
    const value = cell && isNumber(cell) ? Number(cell) * factor : NaN;
    if (!Number.isFinite(value)) throw new Refusal(`${where}: line ${line}, column '${what}': '${cell.slice(0, 40)}' is no finite number`);
    if (Math.abs(value) > LARGEST) throw new Refusal(`${where}: line ${line}, column '${what}': ${cell}: expected a measured value of at most ${LARGEST} ${si}`);
    return value;
  });
}

/** Return a table with every so many of its lines, so that it has at most so many characters; the first hundred stay. */
export function thinned(text, most) {
  if (text.length <= most) return text;
  const lines = text.split("\n");
  const head = lines.slice(0, FIRST).reduce((sum, line) => sum + line.length + 1, 0);
  const step = Math.ceil((text.length - head) / (0.8 * Math.max(most - head, 1)));
  // Empty lines keep the numbers of the others.
  return lines.map((line, k) => (k < FIRST || k % step === 0 ? line : "")).join("\n");
}

/** The number of characters of a table, without those of empty lines. */
export const sizeOf = (text) => text.replace(/\n+/g, "\n").length;

/** Read a table: its curves over a common time, or its columns where the page has to ask what they hold. */
export function recordOf(text, where, told, limits) {
  const table = layoutOf(text, where);
  const { headings, rows } = table;
  let found = quantitiesOf(table);
  let units = headings.map(({ unit }) => unit);
  if (told) {
    if (told.length !== headings.length) throw new Refusal(`${where}: ${headings.length} columns: expected as many answers, not ${told.length}`);
    [found, units] = [told.map(([what]) => what), told.map(([, unit]) => unit)];
  } else if (found.some((what, k) => what && !units[k]) || !found.includes("time") || !found.some((what) => what && what !== "time")) {
    const columns = headings.map((heading, k) => ({ ...heading, quantity: found[k], first: rows.slice(0, 3).map(({ cells }) => cells[k] ?? "") }));
    return { what: "columns", name: where, columns, quantities: COLUMNS, data: {} };
  }
  for (const what of Object.keys(COLUMNS)) if (found.filter((each) => each === what).length > 1) throw new Refusal(`${where}: several columns of ${what}: expected one`);
  const read = Object.fromEntries(found.flatMap((what, k) => (what ? [[what, valuesOf(table, k, what, units[k])]] : [])));
  const { time, ...curves } = read;
  if (!time || !Object.keys(curves).length) throw new Refusal(`${where}: expected a column of time and one of displacement, current, force or voltage`);
  if (time.length < 2) throw new Refusal(`${where}: ${time.length} samples: expected at least 2`);
  const back = time.findIndex((value, k) => k && value <= time[k - 1]);
  if (back > 0) throw new Refusal(`${where}: line ${rows[back].line}: time ${time[back]} s after ${time[back - 1]} s: expected ascending times`);
  for (const what of ["current", "force", "voltage"].filter((each) => each in curves)) check(what, time, curves[what], where, limits);
  const most = Math.min(time.length, limits.MOST_SAMPLES);
  const kept = [...new Set(Array.from({ length: most }, (_each, k) => Math.floor((k * (time.length - 1)) / Math.max(most - 1, 1))))];
  const thin = (values) => Float64Array.from(kept, (k) => values[k]);
  return { what: "curves", name: where, data: { t: thin(time), ...Object.fromEntries(Object.entries(curves).map(([what, values]) => [what, thin(values)])) } };
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
