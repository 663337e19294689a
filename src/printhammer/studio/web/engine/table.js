// Layout of a measured table: separator, headings, units, metadata and sample times, by the rules of printhammer/support/tables.
import { readQuantity } from "../quantity.js";
import { quantityOf } from "./drive.js";
import { Refusal } from "./read.js";

const ALIASES = {
  time: ["time", "t", "x-axis", "sec", "second", "seconds", "zeit", "temps"], displacement: ["displacement", "position", "x", "weg"],
  current: ["current", "i", "strom"], force: ["force", "f", "kraft"], voltage: ["voltage", "u", "spannung", "tension"],
};
const MEASURED = ["s", "V", "A", "m", "N", "Hz", "ohm", "Wb", "H"];
const WORDS = { second: "s", seconds: "s", sec: "s", volt: "V", volts: "V", ampere: "A", amperes: "A", amp: "A", amps: "A", newton: "N", newtons: "N", metre: "m", metres: "m", meter: "m", meters: "m" };
const COUNTS = ["number", "sequence", "samples", "sample", "#", "pts", "points"];
const SEPARATORS = "\t;|, ";
const SEEN = 2000; // lines by which the separator is found
const MOST_COLUMNS = 16;
const FIRST = 100; // lines that are always read
const LEFT_OUT = "#\u2026"; // a line of a long table that is not read
const GAPS = ["", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "1.#qnan", "-1.#ind"];
const OVER = ["inf", "-inf", "+inf", "infinity", "-infinity", "\u221e", "-\u221e", "1.#inf", "-1.#inf"];
// An error value of a spreadsheet in the first cell begins no comment.
const COMMENT = /^\s*((?!#(?:#+|N\/A|NUM!|VALUE!|DIV\/0!|REF!|NAME\?|NULL!|WERT!|ZAHL!|NV)\s*[,;|\t])#|\/\/|[%;]\s*[\p{L}][^;]*$)/u;
const NUMBER = /^[+-]?(\d+(?:\.\d*)?|\.\d+|\d*,\d+|\d{1,3}([.,'\u2019\u00a0\u202f]\d{3})+([.,]\d*)?)([eE][+-]?\d+)?$/;
const GROUPED = { ".": /^[+-]?[1-9]\d{0,2}(\.\d{3})+(,\d*)?$/, ",": /^[+-]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?$/ };
// Names of metadata entries, without spaces and signs.
const START = ["xorg", "xorigin", "t0", "x0", "tstart", "xzero", "hoffset", "start", "begin"];
const LOOSE = ["start", "begin"]; // that may be the index of a sample
const STEP = ["increment", "incr", "inc", "step", "delta", "tinc", "dt", "deltax", "timeincrement", "hresolution", "xinc", "xincr", "xincrement", "sampleinterval", "samplinginterval", "samplingperiod"];
const RATE = ["samplerate", "samplingrate"];
const ZERO = ["zeroindex", "triggerpoint"];
const TIME_UNIT = ["horizontalunits", "xunits", "hunit", "timeunits", "timeunit"];
const VALUE_UNIT = ["verticalunits", "yunits", "vunit"];
const STAMP = /^\s*\d{1,4}([:/.-])\d{1,2}\1\d{1,4}/; // time of day or date, never a heading
const NUMBERING = ["x", "no", "no.", "nr", "n", "#", "index", "sample", "sequence", "point"];

export const isNumber = (cell) => NUMBER.test(cell);
const isReading = (cell) => isNumber(cell) || GAPS.includes(cell.toLowerCase()) || OVER.includes(cell.toLowerCase());

/** The factor of a unit to the SI unit, or null where it is none of its dimension. */
export function factorOf(unit, si) {
  const word = WORDS[unit.toLowerCase()] ?? unit;
  if (!/^[A-Za-z\u00b5\u03bc%]+$/.test(word)) return null;
  const read = readQuantity(`1 ${word}`, si, { factor: 1, name: si });
  return read.problem === undefined ? read.value : null;
}

/** A cell such as "(us)", "Volts" or "V DC" as a unit, empty where it is none; "A1" and "V2" are names of channels. */
function unitOf(text) {
  const whole = text.trim().slice(0, 40);
  const plain = whole.replace(/^[()[\]{}]+|[()[\]{}]+$/g, "").trim().replace(/\s*(DC|AC|dc|ac)$/, "") || whole;
  for (const word of [plain, plain.toLowerCase()]) {
    for (const si of MEASURED) {
      const factor = factorOf(word, si);
      if (factor !== null) return factor === 1 ? si : word;
    }
  }
  return "";
}
/** Whether cells are units, counts or empty, with at least one unit. */
function isUnitRow(cells) {
  const units = cells.filter((cell) => cell).map((cell) => unitOf(cell) || COUNTS.includes(cell.replace(/^[()]+|[()]+$/g, "").toLowerCase()));
  return units.every(Boolean) && units.some((unit) => typeof unit === "string");
}

/** The name and the unit of a heading such as "time [us]", "time (us)", "time in us" or "t/us". */
function headingOf(cell) {
  const whole = cell.replace(/^"|"$/g, "").trim().replace(/\s+/g, " ");
  const bracket = /^(.*?)\s*(?:\[([^[\]]*)\]|\(([^()]*)\)|\{([^{}]*)\})$/.exec(whole);
  if (bracket) {
    const [, name, square, ...others] = bracket;
    if (square !== undefined) return { name, unit: unitOf(square) || square.trim() };
    const unit = unitOf(others.find((each) => each !== undefined));
    if (unit) return { name, unit };
  }
  const beside = /^(.*?)(?:(?:^|\s+)in\s+|\s*\/\s*|\s*,\s*|_)([^\s,/_]+)$/.exec(whole);
  if (beside && (beside[1] || whole.startsWith("in ")) && unitOf(beside[2])) return { name: beside[1], unit: unitOf(beside[2]) };
  return { name: whole, unit: "" };
}
export function quantityOfName(name, unit) {
  const word = name.toLowerCase();
  if (word === "x" && unit && factorOf(unit, "s") !== null) return "time"; // the horizontal axis of an oscilloscope
  return Object.keys(ALIASES).find((what) => ALIASES[what].includes(word)) ?? "";
}
const isNamed = (cell) => { const { name, unit } = headingOf(cell); return Boolean(unit || quantityOfName(name, unit)); };

const spaced = (line) => line.trim().replace(/\s+(?=[[(])/g, "").split(/\s+/);

/** The cells of a line; a space stands for any white space. */
function cellsOf(line, separator) {
  if (separator === " ") return spaced(line);
  const cells = [];
  const cell = new RegExp(`[^\\S\\${separator}]*(?:"((?:[^"]|"")*)"[^\\S\\${separator}]*|([^\\${separator}]*))(\\${separator}|$)`, "y");
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
  return rows.map((row) => ({ ...row, cells: row.cells.map(plain) }));
}

/** The name of a metadata entry: lower case, letters and digits only. */
const keyOf = (text) => text.toLowerCase().replace(/[^\p{L}\p{N}]/gu, "");
const assignedOf = (cell) => {
  const [key, value, ...more] = cell.split(/[=:]/).map((part) => part.trim());
  return key && value && !more.length ? [keyOf(key), [value]] : null;
};
/** The metadata of a row: "key,value,...", or cells such as "t0 = -1 ms". */
function factsOf(cells) {
  const facts = Object.fromEntries(cells.map(assignedOf).filter(Boolean));
  if (cells.length > 1 && cells[0]) facts[keyOf(cells[0])] = cells.slice(1);
  return facts;
}
const factOf = (facts, keys, otherwise) => facts[keys.find((key) => facts[key]?.length)] ?? otherwise;

/** Take away columns of metadata left of the numbers, as older Tektronix oscilloscopes write them. */
function withoutFactsBeside(rows) {
  const first = rows[0].cells;
  if (!first[0] || isReading(first[0])) return [rows, null];
  let cut = first.length;
  while (cut && rows.every(({ cells }) => cells.length === first.length && isNumber(cells[cut - 1]))) cut -= 1;
  if (first.length - cut < 2) return [rows, null];
  return [rows.map((row) => ({ ...row, cells: row.cells.slice(cut) })), Object.assign({}, ...rows.map(({ cells }) => factsOf(cells.slice(0, cut))))];
}

/** The number of columns: the length of the heading up to metadata behind it, or else of the longest row. */
function widthOf(data, last) {
  if (!last.some(isNamed) && !isUnitRow(last)) return widest(data);
  const isClock = (key) => START.includes(key) || STEP.includes(key);
  // "Ix(u1:out)" is the name of a column.
  const isFact = (cell) => isClock(keyOf(cell)) || isClock(assignedOf(cell)?.[0]) || (isNumber(cell) && !/^\d+$/.test(cell));
  const end = last.findIndex(isFact);
  return end < 0 ? last.length : end;
}

/** The rows of names and units, up to two, of the rows above the numbers. */
function headingRows(above, width, where) {
  const [before, last] = [above.at(-2), above.at(-1)];
  if (!last || last.cells.length < width) return [];
  const named = before && before.cells.length >= width ? before : null;
  if (last.cells.slice(0, width).some(isNumber) && (isNumber(last.cells[0]) || named?.cells.some(isNamed))) throw new Refusal(`${where}: line ${last.line}: '${last.cells.join(",").slice(0, 60)}': expected numbers only`);
  return named && isUnitRow(last.cells.slice(0, width)) ? [named, last] : [last];
}

/** Headings from a row of names, a row of units, or both, and from the metadata. */
function headingsOf(rows, { width, separator, facts, above, isBeside }) {
  let names = rows.length ? rows.at(-1).cells.slice(0, width) : Array(width).fill("");
  let units = [];
  if (rows.length && isUnitRow(names)) {
    units = names.map(unitOf);
    if (rows.length > 1) names = rows.at(-2).cells.slice(0, width);
  }
  const columns = names.map((name, k) => { const split = headingOf(name); return { ...split, unit: units[k] || split.unit }; });
  const kinds = columns.map(({ name }) => (/^I\w*\(.+\)$/.test(name) ? "A" : /^V\(.+\)$/.test(name) ? "V" : ""));
  if (separator === "\t" && columns.length > 1 && columns[0].name === "time" && !columns[0].unit && kinds.slice(1).every(Boolean)) return columns.map(({ name }, k) => ({ name, unit: kinds[k] || "s" })); // of LTspice
  const isLecroy = Boolean(above[0]?.cells[0].toUpperCase().startsWith("LECROY"));
  const inBrackets = (unit) => headingOf(`x [${unit}]`).unit;
  const [time] = factOf(facts, TIME_UNIT, [isLecroy ? "s" : ""]);
  const stated = factOf(facts, VALUE_UNIT, [isLecroy ? "V" : ""]).filter((value) => value).map((value) => inBrackets(value.split(":").at(-1)));
  let channel = 0;
  const whole = columns.map(({ name, unit }) => {
    if (quantityOfName(name, unit) === "time") return { name, unit: unit || inBrackets(time) };
    const own = stated[stated.length > 1 && channel < stated.length ? channel : 0] ?? "";
    channel += 1;
    return { name, unit: unit || (name || columns.length === 1 ? own : "") };
  });
  if (!isBeside || !facts[TIME_UNIT[0]]) return whole;
  const [source] = factOf(facts, ["source"], [""]);
  return whole.map((column, k) => (k ? { ...column, name: source } : { name: "time", unit: inBrackets(facts[TIME_UNIT[0]][0]) }));
}

/** The sample times that metadata state: start and step, or step and the index of time zero; null where they do not. */
function clockOf({ where, facts, headings, rows, isNumbered }) {
  const inUnit = (name, text, si) => {
    if (!text) return null;
    const value = isNumber(text) ? Number(text.replace(",", ".")) : quantityOf(text.replace(",", "."), [si], `${where}: ${name}`)[0];
    if (!Number.isFinite(value)) throw new Refusal(`${where}: ${name} = '${text.slice(0, 40)}': expected a finite number`);
    return value;
  };
  const text = (keys) => factOf(facts, keys, [""])[0];
  // Above the numbers, a start without a unit may be the index of a sample.
  const isIndex = !isNumbered && isNumber(text(START)) && !START.some((key) => !LOOSE.includes(key) && key in facts);
  const rate = inUnit("sampling rate", text(RATE), "Hz");
  const step = inUnit("step", text(STEP), "s") ?? (rate === null ? null : 1 / rate);
  const zero = isNumber(text(ZERO)) ? inUnit("index of time zero", text(ZERO), "1") : null;
  const start = (isIndex ? null : inUnit("start", text(START), "s")) ?? (step !== null && zero !== null ? -zero * step : null);
  if (start === null || step === null) return null;
  if (!NUMBERING.slice(isNumbered ? 0 : 1).includes(headings[0].name.toLowerCase())) return { start, step, numbers: null };
  return rows.every(({ sample, cells }) => isNumber(cells[0]) && Number(cells[0]) === sample) ? { start, step, numbers: 0 } : null;
}

/** The table of a text: headings, rows of cells with their lines and sample numbers, and the sample times where metadata state them. */
export function layoutOf(text, where) {
  const lines = text.replace(/^\ufeff/, "").replace(/\r\r?\n|\n\r|\r/g, "\n").split("\n");
  const separator = separatorOf(lines);
  const [split, notes, comments] = [[], [], {}];
  let sample = 0; // lines that were left out are samples too
  lines.forEach((line, k) => {
    if (line === LEFT_OUT) sample += 1;
    if (!line.trim() || line === LEFT_OUT) return;
    if (COMMENT.test(line)) {
      const note = line.trim().replace(/^[#%;/]+/, "").trim();
      const colon = note.indexOf(":");
      notes.push({ line: k + 1, note });
      if (colon > 0) comments[keyOf(note.slice(0, colon))] = [note.slice(colon + 1).trim()];
      return;
    }
    const cells = cellsOf(line, separator);
    if (!cells) throw new Refusal(`${where}: line ${k + 1}: expected comma-separated values`);
    const whole = cells.length;
    while (cells.length && !cells.at(-1)) cells.pop();
    if (cells.length) { split.push({ line: k + 1, sample, cells, whole }); sample += 1; }
  });
  const [rows, beside] = split.length ? withoutFactsBeside(split) : [split, null];
  const begin = rows.findIndex(({ cells }) => cells.some(isNumber) && cells.every(isReading));
  if (begin < 0) throw new Refusal(`${where}: expected columns of numbers below a heading such as 'time [us],current [A]'`);
  let [above, data] = [rows.slice(0, begin), rows.slice(begin)];
  if (above.length > 1 && isUnitRow(above.at(-1).cells)) {
    // Columns at the right may have no unit.
    const { cells, whole, ...row } = above.at(-1);
    const missing = Math.min(whole, above.at(-2).cells.length) - cells.length;
    above = [...above.slice(0, -1), { ...row, whole, cells: [...cells, ...Array(Math.max(missing, 0)).fill("")] }];
  }
  const titles = above.at(-1)?.cells ?? [];
  // LabVIEW writes no cell for an empty comment.
  if (titles.at(-1) === "Comment" && data.every(({ cells }) => cells.length < titles.length)) titles.pop();
  let named = above.at(-1)?.cells.some((cell) => STAMP.test(cell)) ? [] : above;
  const width = widthOf(data, named.at(-1)?.cells ?? []);
  if (!width) throw new Refusal(`${where}: line ${above.at(-1).line}: '${above.at(-1).cells[0].slice(0, 40)}' states the sampling: expected the names of the columns left of it`);
  if (width > MOST_COLUMNS) throw new Refusal(`${where}: ${width} columns: expected at most ${MOST_COLUMNS}`);
  for (const { line, cells, whole } of data) {
    if (cells.length > width || whole < width) throw new Refusal(`${where}: line ${line} has ${cells.length} cells: expected ${width}`);
    if (!cells.every(isReading)) throw new Refusal(`${where}: line ${line}: '${cells.join(",").slice(0, 60)}': expected ${width} numbers`);
  }
  if (!above.length && !beside) {
    // NumPy writes the heading in a comment.
    const last = notes.filter(({ line }) => line < data[0].line).at(-1);
    const cells = last ? (separator === " " ? spaced(last.note) : last.note.split(separator)) : [];
    if (cells.length === width && width > 1) named = above = [{ line: last.line, cells }];
  }
  const heading = headingRows(named, width, where);
  const facts = Object.assign({}, comments, beside, ...above.slice(0, above.length - heading.length).map(({ cells }) => factsOf(cells)));
  const extra = heading.map(({ cells }) => cells.slice(width));
  const pairs = extra.length ? extra[0].slice(0, Math.min(...extra.map((cells) => cells.length))) : [];
  pairs.forEach((name, k) => Object.assign(facts, extra.length > 1 ? { [keyOf(name)]: [extra[1][k]] } : factsOf([name])));
  const headings = headingsOf(heading, { width, separator, facts, above, isBeside: Boolean(beside) });
  data = pointed(data, separator, where);
  if (notes.some(({ note }) => note.includes("sigrok"))) facts.start ??= ["0 s"];
  const first = data[0].sample;
  data = data.map((row) => ({ ...row, sample: row.sample - first }));
  const clock = clockOf({ where, facts, headings, rows: data, isNumbered: extra.some((cells) => cells.length) });
  // Rows may be missing.
  const gaps = data.at(-1).line - data[0].line > data.at(-1).sample;
  return { where, headings, rows: data, clock: clock && clock.numbers === null && gaps ? null : clock };
}

/** Return a table with every so many of its lines, so that it has at most so many characters; the first hundred stay. */
export function thinned(text, most) {
  if (text.length <= most) return text;
  const lines = text.split("\n");
  const head = lines.slice(0, FIRST).reduce((sum, line) => sum + line.length + 1, 0);
  const step = Math.ceil((text.length - head) / (0.8 * Math.max(most - head, 1)));
  // The others are counted as lines and as samples.
  return lines.map((line, k) => (k < FIRST || k % step === 0 || !line.trim() ? line : LEFT_OUT)).join("\n");
}

/** The number of characters of a table, without those of lines that were left out. */
export const sizeOf = (text) => text.replaceAll(`${LEFT_OUT}\n`, "").length;
