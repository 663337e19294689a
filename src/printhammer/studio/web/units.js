// Quantities as people write them: a number of few digits and its unit, metric or inch-pound.
let known = {};
let system = 0;
const LONG = 1e-2; // s, from which a time is no longer told in µs

/** Take units, by SI unit: [metric, inch-pound], each a name and a factor. */
export function setUnits(units) { known = units; }
export function setSystem(number) { system = number; }

const RAISED = { 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹", ".": "·" };
const signed = (si) => si.replace(/\^([\d.]+)/g, (_all, power) => [...power].map((sign) => RAISED[sign]).join(""));

export function unitOf(si) { return known[si]?.[system] ?? { name: si === "1" ? "" : signed(si), factor: 1 }; }

/** Return the unit of a time axis: long ones are told in ms, or in s. */
export function timeUnit(span) { return span > 3 ? { name: "s", factor: 1 } : span > 3e-3 ? { name: "ms", factor: 1e3 } : unitOf("s"); }

/** Return a number with some significant digits. */
export function digits(value, count = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(Math.max(count - 2, 1)).replace("e+", "e");
  return String(Number(value.toPrecision(count)));
}

export function shown(value, si, count = 4) {
  const unit = si === "s" && Math.abs(value) >= LONG && unitOf(si).factor > 1e3 ? timeUnit(Math.abs(value)) : unitOf(si);
  const number = value === null || value === undefined ? "–" : digits(value * unit.factor, count);
  return unit.name ? `${number} ${unit.name}` : number;
}
